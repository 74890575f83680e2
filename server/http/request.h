/* One request on its way: what a handler reads, and how it answers.
 *
 * A handler runs in one thread at a time, in the lane that its route names. It reads the request
 * through these functions and calls exactly one respond_…; the server sends the answer when the
 * handler has returned. The handler of a route with ROUTE_RESUMES calls request_resume itself, now
 * or later from another thread. Nothing here keeps what it is passed unless it says "taken over".
 *
 * threads   the handler's alone */
#ifndef HTTP_REQUEST_H
#define HTTP_REQUEST_H

#include <stdbool.h>
#include <stdint.h>

#include "groom/diag.h"
#include "proto/problem.h"
#include "server/access/access.h"
#include "server/actor.h"
#include "server/blobs/blobs.h"
#include "server/http/lane.h"
#include "server/http/router.h"
#include "server/http/service.h"
#include "server/store/store.h"

struct cJSON;
struct event_feed;
struct MHD_Connection;
struct server;
struct upload_writer;

enum response_kind { RESPONSE_NONE, RESPONSE_BYTES, RESPONSE_FILE, RESPONSE_EVENTS, RESPONSE_PIECES };

/* Memory that is sent as it lies there. */
#define RESPONSE_MAX_PIECES 4
struct response_pieces {
    struct {
        const void *bytes;
        size_t n;
    } piece[RESPONSE_MAX_PIECES];
    unsigned n;
    void (*release)(struct response_pieces *pieces); /* called once, by any thread, when it has been sent or dropped */
};

#define RESPONSE_MAX_HEADERS 8
struct response {
    enum response_kind kind;
    int status;
    const char *content_type; /* static */
    char *bytes;              /* malloc'ed, or static where is_static */
    size_t n_bytes;
    bool is_static;
    int fd; /* of RESPONSE_FILE */
    uint64_t n_file;
    struct event_feed *feed; /* of RESPONSE_EVENTS */
    struct response_pieces *pieces; /* of RESPONSE_PIECES */
    char etag[80];           /* with its quotes; "" for none */
    size_t n_headers;
    struct {
        const char *name;
        char value[360];
    } headers[RESPONSE_MAX_HEADERS];
};

struct request {
    struct task task; /* first: a lane's task is its request */
    const struct service *service;
    char id[24]; /* in the log, in X-Request-Id and in problems */
    char method[16];
    char path[160]; /* as it was sent, for logs and problems; may be cut */
    struct uri uri;
    const struct route *route; /* NULL where none was found */
    const char *parameter[ROUTE_MAX_PARAMETERS];

    /* the body, as the route's body_mode says */
    char *body; /* BODY_MEMORY: zero-terminated beyond n_body */
    size_t n_body;
    int body_fd;               /* BODY_FILE: -1 for none; stands at the end of what was written */
    struct blobs_writer *blob; /* BODY_BLOB: the handler commits it (and sets it to NULL) */
    struct upload_writer *upload; /* BODY_UPLOAD: the handler finishes it (and sets it to NULL) */
    char upload_id[STORE_ID_SIZE];
    int64_t upload_expires_ms;
    uint64_t n_received;
    bool has_digest; /* digest.h: what Content-Digest says of it */
    unsigned char digest[32];
    struct evp_md_ctx_st *hash;

    struct actor actor; /* who is asking, and for which project */
    unsigned scopes;    /* of enum access_scope */
    struct access_limits limits;
    struct store_attempt_ref attempt; /* ROUTE_WORK: the attempt that is asking */
    char job_id[STORE_ID_SIZE]; /* the job that it is about, for the log; "" */
    struct response response;

    /* the server's */
    struct server *server;
    struct MHD_Connection *connection;
    struct link *link; /* of the connection */
    int phase;
    bool discard; /* the answer is known: the rest of the body is read and dropped */
    bool http_1_1;
    bool close;          /* after the answer */
    uint64_t n_expected; /* Content-Length; UINT64_MAX where chunked */
    size_t body_capacity;
    int64_t started_us;
    uint64_t n_sent;
    bool owned; /* the id in the path is of this project */
    char key_hash[STORE_HASH_SIZE];
    uint32_t retry_after_s; /* of a 429 or 503; 0: 2 */
};

/* For limits and fair turns: the token, or the project where none is asked for. */
static inline const char *request_owner(const struct request *request)
{
    return request->actor.token[0] ? request->actor.token : request->actor.project;
}

/* --- reading ---------------------------------------------------------------------- */

const char *request_header(const struct request *request, const char *name); /* or NULL */
const char *request_query(const struct request *request, const char *name);  /* or NULL */
bool request_is_head(const struct request *request);

/* A whole number of the query; absent: *value stays as it is.
 * returns  false where it was refused (and answered) */
bool request_query_number(struct request *request, const char *name, uint64_t minimum, uint64_t maximum,
                          uint64_t *value);
/* A finite number, likewise. */
bool request_query_real(struct request *request, const char *name, double minimum, double maximum, double *value);
/* "true" or "false" of the query; absent: *value stays as it is. */
bool request_query_bool(struct request *request, const char *name, bool *value);
/* The body as a JSON object, the caller's to delete; NULL where it was refused (and answered). */
struct cJSON *request_json(struct request *request);
/* limit and before of a list. returns false where it was refused (and answered) */
bool request_page(struct request *request, struct store_page *page);
/* If-Match as a revision number. returns  false where it is missing (428) or no revision (412), answered */
bool request_if_match(struct request *request, uint32_t *revision);
/* Does If-None-Match name this ETag? Then 304 has been answered. etag has no quotes. */
bool request_not_modified(struct request *request, const char *etag);
/* "wait=N" of Prefer in seconds, 0 where it is not asked for; at most --max-wait. */
uint32_t request_wait_s(const struct request *request);

/* --- answering ---------------------------------------------------------------------- */

/* Taken over: json, also where NULL (out of memory is then the answer). */
void respond_json(struct request *request, int status, struct cJSON *json);
/* bytes are malloc'ed and taken over; content_type is static. */
void respond_bytes(struct request *request, int status, const char *content_type, char *bytes,
                   size_t n_bytes);
void respond_static(struct request *request, int status, const char *content_type, const char *bytes,
                    size_t n_bytes);
void respond_empty(struct request *request, int status);
/* fd is taken over; all n_bytes of it from its beginning. Ranges are honoured. */
void respond_file(struct request *request, const char *content_type, int fd, uint64_t n_bytes);
/* Memory that stays as it is until pieces->release is called, which it is whatever happens. */
void respond_pieces(struct request *request, const char *content_type, struct response_pieces *pieces);
/* The feed is taken over. */
void respond_events(struct request *request, struct event_feed *feed);

void respond_problem(struct request *request, const struct problem *problem);
/* What a call of the library or the store answered. */
void respond_failure(struct request *request, groom_status status, const struct groom_diag *diag);
/* A problem of HTTP itself: name and title are static. */
void respond_refusal(struct request *request, int status, const char *name, const char *title,
                     const char *format, ...) __attribute__((format(printf, 5, 6)));
/* The query parameter `parameter` is refused. */
void respond_bad_query(struct request *request, const char *parameter, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* The field at `pointer` of the body is refused. */
void respond_bad_field(struct request *request, int status, const char *pointer, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* After a respond_…: a header, an ETag (without quotes). name is static. */
void respond_header(struct request *request, const char *name, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void respond_etag(struct request *request, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Release what an unsent answer holds. */
void response_finish(struct response *response);

/* For ROUTE_RESUMES: the answer is there. The request is not touched any more. */
void request_resume(struct request *request);

#endif
