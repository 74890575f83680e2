/* The HTTP side of groomd on libmicrohttpd: connections in, requests through the routes, answers out.
 *
 *   connection ──▶ head ──▶ (check) ──▶ body ──▶ handler ──▶ answer
 *                   │ refused: 4xx                │ in a lane, the connection suspended
 *
 * Its few threads only move bytes. A request whose handler may wait is suspended and given to a
 * lane; the answer resumes it. The end: server_stop refuses what is new, lets what is under way end,
 * closes event streams in good order, and only then stops libmicrohttpd (which aborts the process
 * where a connection is still suspended). */
#ifndef HTTP_SERVER_H
#define HTTP_SERVER_H

#include "server/http/connections.h"
#include "server/http/export_cache.h"
#include "server/http/follow.h"
#include "server/http/metrics.h"
#include "server/http/request.h"

struct server_options {
    const struct service *service;
    const struct route *routes;
    size_t n_routes;
    int listen_fd; /* bound and listening; taken over */
};

/* returns GROOM_ENOMEM, GROOM_EIO */
GROOM_MUST_CHECK groom_status server_start(const struct server_options *options, struct server **server,
                                           struct groom_diag *diag);
/* Blocks up to timeout_ms. returns false where something was still under way: then the process must
 * end without server_destroy. */
bool server_stop(struct server *server, uint32_t timeout_ms);
void server_destroy(struct server *server); /* takes NULL; after a server_stop that returned true */

/* For handlers: the parts of the server that they tell of. */
struct metrics *server_metrics(struct server *server);
struct followers *server_followers(struct server *server);
uint64_t server_connections(struct server *server);
struct export_cache *server_exports(struct server *server);
struct lane *server_lane(struct server *server, enum lane_name name);
bool server_is_draining(const struct server *server); /* what waits is to come to an end */
/* Around a connection that waits in an event stream; server_suspended returns false where the server is
 * closing. */
bool server_suspended(struct server *server);
void server_resumed(struct server *server);

/* send.c: give the answer of a request to libmicrohttpd. Returns what the access handler returns. */
int server_send(struct request *request);

#endif
