/* The "webhook" member of what is submitted. */
#ifndef HTTP_WEBHOOK_CALLS_H
#define HTTP_WEBHOOK_CALLS_H

#include "server/http/request.h"

/* body.webhook, whose texts stay body's; *n is 0 where there is none.
 * returns  false where it was refused (and answered) */
bool webhook_take(struct request *request, const struct cJSON *body, struct store_webhook_new *webhook, size_t *n);

#endif
