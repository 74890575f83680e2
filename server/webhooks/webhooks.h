/* Telling others that a job has ended: one POST to each webhook, signed, tried again with growing pauses.
 *
 * A message is a row that is made with the job and due from its end on, so that none is lost in a crash; a
 * receiver may hear one twice and knows it by its id. Signed as standardwebhooks.com says: webhook-id,
 * webhook-timestamp, and webhook-signature: v1,<base64 of HMAC-SHA256(key, "id.timestamp.body")>, where the key is
 * what a secret whsec_<base64> holds, or the secret's own bytes.
 *
 * No message goes to an address of this machine or of private networks unless allowed: the address is looked at
 * when the connection to it is made, after the name was resolved, so that no name can lead elsewhere later.
 * Redirects are not followed, proxies not used.
 *
 * threads   webhooks_start makes two */
#ifndef WEBHOOKS_WEBHOOKS_H
#define WEBHOOKS_WEBHOOKS_H

#include <stdbool.h>

#include "server/store/store.h"

struct sockaddr;
struct webhooks;

struct webhooks_options {
    struct store *store;
    const char *allow; /* addresses and networks that are allowed though private: "127.0.0.1 10.0.0.0/8" */
    uint32_t max_attempts;
    uint32_t timeout_s;  /* of one; 0: 10 */
    uint32_t backoff_ms; /* before the second; four times that before each further, an hour at most; 0: 5000 */
};

/* The options' texts are copied. */
GROOM_MUST_CHECK groom_status webhooks_start(const struct webhooks_options *options, struct webhooks **webhooks,
                                             struct groom_diag *diag);
void webhooks_stop(struct webhooks *webhooks); /* cuts what is under way; takes NULL */

/* --- rules (address.c) ---------------------------------------------------------------------- */

/* May a message go there? */
bool webhook_address_allowed(const struct sockaddr *address, const char *allow);
/* Is it the list of addresses and networks that `allow` must be? returns  GROOM_EINVAL */
GROOM_MUST_CHECK groom_status webhook_allow_check(const char *allow, struct groom_diag *diag);
/* http or https, no name and password in it, a host that is not an address that is refused anyway.
 * returns  GROOM_EINVAL */
GROOM_MUST_CHECK groom_status webhook_url_check(const char *url, const char *allow, struct groom_diag *diag);

/* --- signing (sign.c) ------------------------------------------------------------------------- */

#define WEBHOOK_SIGNATURE_SIZE 64
/* 16 to 200 characters; after whsec_ base64. returns  GROOM_EINVAL */
GROOM_MUST_CHECK groom_status webhook_secret_check(const char *secret, struct groom_diag *diag);
/* "v1,<base64>" */
GROOM_MUST_CHECK groom_status webhook_sign(const char *secret, const char *id, int64_t timestamp_s, const char *body,
                                           char signature[WEBHOOK_SIGNATURE_SIZE]);

#endif
