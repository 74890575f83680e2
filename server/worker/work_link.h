/* The attempt's line to the daemon: authenticated calls, repeated where that helps.
 *
 * All calls answer GROOM_OK, GROOM_ECANCELLED (leave quietly: fenced off, stopped by a signal, or
 * the daemon has been away for too long; `why` says which), or what the daemon refused. */
#ifndef WORKER_WORK_LINK_H
#define WORKER_WORK_LINK_H

#include <signal.h>
#include <stddef.h>

#include "groom/diag.h"
#include "proto/http_client.h"

struct work_link {
    struct http_client *client;
    const volatile sig_atomic_t *stop; /* nonzero: the process has been asked to end */
    int closing;                       /* last words: `stop` no longer interrupts, and nobody waits long */
    double patience_s;                 /* how long a daemon that does not answer is waited for */
    char why[160];                     /* of the last GROOM_ECANCELLED */
};

/* url and token as the environment gave them; returns 0 where memory is out. */
int work_link_open(struct work_link *link, const char *url, const char *token, const volatile sig_atomic_t *stop);
void work_link_close(struct work_link *link);

/* One call, repeated with back-off while the line is broken or the daemon is busy.
 * response  NULL where the answer's body is of no interest; else to be http_response_finish-ed */
GROOM_MUST_CHECK groom_status work_link_call(struct work_link *link, const struct http_request *request,
                                             struct http_response *response, struct groom_diag *diag);

/* One try, half a second at most, for what the next message says anew: a broken line is GROOM_OK with
 * response->status 0. */
GROOM_MUST_CHECK groom_status work_link_mention(struct work_link *link, const struct http_request *request,
                                                struct http_response *response, struct groom_diag *diag);

/* The process ends without a result: its last words, said once; nothing but this follows. */
void work_link_farewell(struct work_link *link, const char *words);

#endif
