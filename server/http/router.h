/* Which handler answers which request: one table of routes, and how a target is found in it. */
#ifndef HTTP_ROUTER_H
#define HTTP_ROUTER_H

#include <stddef.h>

#include "proto/uri.h"

struct request;

/* What happens to a body before the handler runs. */
enum body_mode {
    BODY_NONE,   /* refused where there is one */
    BODY_MEMORY, /* request.body, up to --max-body */
    BODY_FILE,   /* request.body_fd, a file without a name, up to --max-upload */
    BODY_BLOB,   /* request.blob, a blob being written and hashed, up to --max-upload */
    BODY_UPLOAD  /* a piece of an upload, into request.upload, which the route's check has opened */
};

/* Where the handler runs. */
enum lane_name {
    LANE_INLINE, /* in the HTTP thread: for what is in memory */
    LANE_FAST,   /* may wait for the database */
    LANE_SLOW    /* may wait for a child process or compute */
};

#define ROUTE_MAX_PARAMETERS 2

struct route {
    const char *method;  /* "GET" answers HEAD as well */
    const char *pattern; /* "/v1/strands/{id}/data"; a {name} takes one segment that is not empty */
    void (*handle)(struct request *request);
    enum body_mode body;
    enum lane_name lane;
    const char *query; /* query parameters that it knows, blanks between; any other is refused */
    int flags;
    /* NULL, or asked before the body is read: answers and returns false where the request cannot be
     * right. It must not wait, unless ROUTE_WAITS. */
    int (*check)(struct request *request);
};

/* Every other call asks for a token of the scope read (GET) or submit; an {id} in its path must be of the
 * token's project. */
#define ROUTE_WORK    1 /* asks for the bearer token of an attempt */
#define ROUTE_QUIET   2 /* logged at level debug: probes and progress */
#define ROUTE_RESUMES 4 /* its handler calls request_resume when it has the answer */
#define ROUTE_WAITS   8 /* its check runs in the fast lane and may wait for the database */
#define ROUTE_TUS     16 /* of the tus protocol: every answer carries Tus-Resumable */
#define ROUTE_PUBLIC  32 /* asks for nothing; who comes with a token is known by it */
#define ROUTE_ADMIN   64 /* asks for the scope admin */
#define ROUTE_LOOKS   128 /* asks for read, though it is no GET */

enum router_outcome { ROUTER_FOUND, ROUTER_NO_PATH, ROUTER_NO_METHOD };

struct router_match {
    const struct route *route;
    const char *parameter[ROUTE_MAX_PARAMETERS]; /* of the pattern, in order; into the uri */
    char allow[64];                              /* methods of this path, for 405 and OPTIONS */
};

enum router_outcome router_find(const struct route *routes, size_t n_routes, const char *method,
                                const struct uri *uri, struct router_match *match);

/* Is `name` among the words of `list`? */
int router_knows(const char *list, const char *name);

#endif
