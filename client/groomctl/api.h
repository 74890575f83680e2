/* Calls to the daemon that explain themselves when they fail. */
#ifndef GROOMCTL_API_H
#define GROOMCTL_API_H

#include <cjson/cJSON.h>

#include "client/groomctl/groomctl.h"

/* One call. DONE where it was answered with 2xx; else what is wrong and what to do about it has been
 * printed on standard error, and the exit status is returned. */
int api_call(struct groomctl *ctl, const struct http_request *request, struct http_response *response);

/* One call whose answer is JSON.
 * body    sent as JSON; NULL: none
 * header  one more header or NULL
 * answer  the caller's to delete; set on DONE only (NULL where the answer had no body). NULL: not wanted */
int api_json(struct groomctl *ctl, const char *method, const char *path, const cJSON *body, const char *header,
             cJSON **answer);

/* The ETag of a groom's latest revision as an If-Match header. */
int api_if_match(struct groomctl *ctl, const char *groom, char *header, size_t size);

/* Print what a call did not achieve; returns the exit status. */
int api_complain(struct groomctl *ctl, http_outcome outcome, const struct http_response *response);

/* A JSON value on standard output: one line with --json, indented for people. */
void api_print(const struct groomctl *ctl, const cJSON *json);

/* Members that may be missing. */
const char *api_text(const cJSON *object, const char *name);                     /* "" */
double api_number(const cJSON *object, const char *name, double otherwise);

#endif
