/* A small HTTP client on libcurl, shared by groomctl and groom-worker.
 *
 * Calls block; several requests can be under way in one call (event streams). Nothing is retried
 * here and redirects are not followed: the caller knows what may be repeated. */
#ifndef PROTO_HTTP_CLIENT_H
#define PROTO_HTTP_CLIENT_H

#include <stddef.h>
#include <stdint.h>

struct http_client;

struct http_client_options {
    const char *base_url;  /* "http://127.0.0.1:8080"; a trailing slash is dropped */
    const char *token;     /* sent as `Authorization: Bearer`; NULL: none */
    const char *agent;     /* User-Agent; NULL: "groom" */
    int connect_timeout_ms;/* 0: 5000 */
    /* asked at least ten times a second while a call runs; nonzero: give up with HTTP_INTERRUPTED */
    int (*interrupted)(void *user);
    void *user;
};

/* NULL where memory is out. The strings are copied. One client serves one thread at a time. */
struct http_client *http_client_create(const struct http_client_options *options);
void http_client_destroy(struct http_client *client); /* takes NULL */
const char *http_client_base_url(const struct http_client *client);

typedef enum http_outcome {
    HTTP_ANSWERED = 0,  /* there is a status and a body, whatever the status says */
    HTTP_UNREACHABLE,   /* no connection: nothing was sent */
    HTTP_BROKEN,        /* the line broke, or the time ran out, in the middle */
    HTTP_INTERRUPTED,   /* the caller's interrupted() or sink said stop */
    HTTP_REFUSED_URL,   /* the URL is not one */
    HTTP_NO_MEMORY
} http_outcome;

struct http_response {
    int status;            /* 0 where nothing was answered */
    char *body;            /* NUL-terminated; NULL where the sink took it */
    size_t n_body;
    char content_type[96], etag[96], location[256]; /* "" where missing */
    int retry_after_s;     /* -1 where missing */
    long long upload_offset, upload_length; /* of tus; -1 where missing */
    long long content_length; /* of the body, known before it comes; -1 where missing */
    char failure[256];     /* what libcurl says, where not HTTP_ANSWERED */
};
void http_response_finish(struct http_response *response); /* takes zeroed values */

#define HTTP_MAX_HEADERS 6
#define HTTP_MAX_PARTS 4
struct http_part {
    const void *bytes;
    size_t n;
};
struct http_request {
    const char *method;    /* "GET" */
    const char *path;      /* "/v1/jobs?limit=5", already percent-encoded */
    const char *headers[HTTP_MAX_HEADERS]; /* "If-Match: \"3\""; NULL ends */
    const char *content_type;              /* of the body */
    /* The body: n_body bytes of memory, or of body_fd from where it stands (body NULL, body_fd > 0), or of
     * `parts`, one after the other (both missing, n_parts > 0). */
    const void *body;
    int body_fd;
    uint64_t n_body;
    struct http_part parts[HTTP_MAX_PARTS];
    unsigned n_parts;
    /* Bytes of a 2xx answer as they come; anything but n stops the call. NULL: collected in
     * response->body, as the bodies of other answers always are (up to 256 MB). */
    size_t (*sink)(void *user, const char *bytes, size_t n);
    /* The call begins: what the sink took of an earlier try is void. NULL: silence. */
    void (*begin)(void *user);
    /* How much of the body has been sent. NULL: silence. */
    void (*sent)(void *user, uint64_t n_sent, uint64_t n_total);
    void *user;            /* of sink, begin and sent */
    int timeout_ms;        /* of the whole call; 0: none */
    int is_vital;          /* where this one ends by itself, http_perform_all stops the others, too */
    int idle_timeout_s;    /* no byte either way for so long is HTTP_BROKEN; 0: 60 */
};

/* response is overwritten; http_response_finish it whatever the outcome. */
http_outcome http_perform(struct http_client *client, const struct http_request *request,
                          struct http_response *response);

/* Several at once, until all have ended, or a vital one has, or `interrupted` says so. What was
 * stopped in that way, or by its own sink, is HTTP_INTERRUPTED. `tick` (may be NULL) is called
 * about ten times a second. outcomes[i] is set for each. */
void http_perform_all(struct http_client *client, const struct http_request *requests, size_t n,
                      struct http_response *responses, http_outcome *outcomes,
                      void (*tick)(void *user), void *tick_user);

#endif
