/* Signatures as standardwebhooks.com describes them. */
#include "server/webhooks/webhooks.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <openssl/evp.h>
#include <openssl/hmac.h>

#define PREFIX     "whsec_"
#define MAX_SECRET 200

/* returns  bytes of the key, or -1 */
static int read_key(const char *secret, unsigned char key[MAX_SECRET])
{
    size_t n = strlen(secret);
    if (n < 16 || n > MAX_SECRET)
        return -1;
    if (strncmp(secret, PREFIX, strlen(PREFIX))) {
        memcpy(key, secret, n);
        return (int)n;
    }
    const char *text = secret + strlen(PREFIX);
    n = strlen(text);
    if (n == 0 || n % 4 != 0)
        return -1;
    int decoded = EVP_DecodeBlock(key, (const unsigned char *)text, (int)n);
    return decoded < 0 ? -1 : decoded - (text[n - 1] == '=') - (text[n - 2] == '=');
}

groom_status webhook_secret_check(const char *secret, struct groom_diag *diag)
{
    unsigned char key[MAX_SECRET + 4];
    for (const char *c = secret; *c; c++)
        if (*c < 33 || *c > 126)
            return groom_fail(diag, GROOM_EINVAL, "a secret has printable characters without blanks");
    if (read_key(secret, key) < 0)
        return groom_fail(diag, GROOM_EINVAL, "a secret has 16 to %d characters; after " PREFIX " they are base64",
                          MAX_SECRET);
    return GROOM_OK;
}

groom_status webhook_sign(const char *secret, const char *id, int64_t timestamp_s, const char *body,
                          char signature[WEBHOOK_SIGNATURE_SIZE])
{
    unsigned char key[MAX_SECRET + 4], digest[EVP_MAX_MD_SIZE], base64[48];
    unsigned n_digest = 0;
    char *text = NULL;
    int n_key = read_key(secret, key);
    int n = asprintf(&text, "%s.%lld.%s", id, (long long)timestamp_s, body);
    if (n_key < 0 || n < 0) {
        free(n < 0 ? NULL : text);
        return n < 0 ? GROOM_ENOMEM : GROOM_EINVAL;
    }
    bool done = HMAC(EVP_sha256(), key, n_key, (const unsigned char *)text, (size_t)n, digest, &n_digest) != NULL;
    free(text);
    if (!done)
        return GROOM_EINTERNAL;
    EVP_EncodeBlock(base64, digest, 32);
    snprintf(signature, WEBHOOK_SIGNATURE_SIZE, "v1,%s", (const char *)base64);
    return GROOM_OK;
}
