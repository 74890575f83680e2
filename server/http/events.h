/* GET /v1/jobs/{id}/events: a job's events as server-sent events (WHATWG HTML, 9.2), replayed from
 * Last-Event-ID, a comment every 15 s, and an end after the job's own. */
#ifndef HTTP_EVENTS_H
#define HTTP_EVENTS_H

#include "server/http/request.h"

/* Answer the request with the events of a job after sequence `after`. */
void events_respond(struct request *request, const char *job_id, int64_t after);

struct MHD_Response;
/* The response that streams this feed, which is taken over. NULL: out of memory. */
struct MHD_Response *events_create_response(struct event_feed *feed);
/* A feed that will not be streamed after all. */
void events_drop(struct event_feed *feed);

#endif
