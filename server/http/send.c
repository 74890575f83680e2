/* Answers to libmicrohttpd: headers that every answer has, byte ranges of files (RFC 9110, 14). */
#include <ctype.h>
#include <errno.h>
#include <microhttpd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/http/access.h"
#include "server/http/events.h"
#include "server/http/server.h"

struct range {
    uint64_t first, n;
    enum { WHOLE, PART, OUTSIDE } kind;
};

static bool parse_u64(const char **text, uint64_t *value)
{
    char *end;
    errno = 0;
    if (!isdigit((unsigned char)**text))
        return false;
    *value = strtoull(*text, &end, 10);
    *text = end;
    return !errno;
}

/* One range of bytes; several, or one that is not well-formed, are answered with the whole file. */
static struct range parse_range(const char *header, uint64_t size)
{
    struct range range = {0, size, WHOLE};
    uint64_t first, last = UINT64_MAX;
    if (!header || strncmp(header, "bytes=", 6))
        return range;
    const char *at = header + 6;
    if (*at == '-') {
        at++;
        if (!parse_u64(&at, &last) || *at)
            return range;
        first = last < size ? size - last : 0;
        return (struct range){first, size - first, last && size ? PART : OUTSIDE};
    }
    if (!parse_u64(&at, &first) || *at++ != '-' || (*at && (!parse_u64(&at, &last) || *at)) || last < first)
        return range;
    if (first >= size)
        return (struct range){0, 0, OUTSIDE};
    last = last < size ? last : size - 1;
    return (struct range){first, last - first + 1, PART};
}

static struct MHD_Response *from_file(struct request *request)
{
    struct response *response = &request->response;
    const char *if_range = request_header(request, "If-Range"), *wanted = request_header(request, "Range");
    struct range range =
        parse_range(if_range && strcmp(if_range, response->etag) ? NULL : wanted, response->n_file);
    uint64_t size = response->n_file;
    if (range.kind == OUTSIDE) {
        respond_refusal(request, 416, "range-not-satisfiable", "the range is outside the file",
                        "the file has %llu bytes", (unsigned long long)size);
        respond_header(request, "Content-Range", "bytes */%llu", (unsigned long long)size);
        return MHD_create_response_from_buffer(response->n_bytes, response->bytes, MHD_RESPMEM_MUST_COPY);
    }
    if (range.kind == PART) {
        response->status = 206;
        respond_header(request, "Content-Range", "bytes %llu-%llu/%llu", (unsigned long long)range.first,
                       (unsigned long long)(range.first + range.n - 1), (unsigned long long)size);
    }
    respond_header(request, "Accept-Ranges", "bytes");
    request->n_sent = range.n;
    if (range.n == 0)
        return MHD_create_response_from_buffer(0, (void *)(size_t) "", MHD_RESPMEM_PERSISTENT);
    struct MHD_Response *sent = MHD_create_response_from_fd_at_offset64(range.n, response->fd, range.first);
    if (sent)
        response->fd = -1; /* libmicrohttpd closes it */
    return sent;
}

static struct MHD_Response *from_bytes(struct request *request)
{
    struct response *response = &request->response;
    enum MHD_ResponseMemoryMode mode = response->is_static ? MHD_RESPMEM_PERSISTENT : MHD_RESPMEM_MUST_FREE;
    request->n_sent = response->n_bytes;
    struct MHD_Response *sent = MHD_create_response_from_buffer(response->n_bytes, response->bytes, mode);
    if (sent)
        response->is_static = true; /* libmicrohttpd frees what is to be freed */
    return sent;
}

static void release_pieces(void *user)
{
    struct response_pieces *pieces = user;
    pieces->release(pieces);
}

static struct MHD_Response *from_pieces(struct request *request)
{
    struct response_pieces *pieces = request->response.pieces;
    struct MHD_IoVec vector[RESPONSE_MAX_PIECES];
    request->n_sent = 0;
    for (unsigned i = 0; i < pieces->n; i++) {
        vector[i] = (struct MHD_IoVec){pieces->piece[i].bytes, pieces->piece[i].n};
        request->n_sent += pieces->piece[i].n;
    }
    struct MHD_Response *sent = MHD_create_response_from_iovec(vector, pieces->n, release_pieces, pieces);
    if (sent)
        request->response.pieces = NULL; /* libmicrohttpd releases them */
    return sent;
}

static struct MHD_Response *create(struct request *request)
{
    struct event_feed *feed = request->response.feed;
    switch (request->response.kind) {
    case RESPONSE_FILE:
        return from_file(request);
    case RESPONSE_EVENTS:
        request->response.feed = NULL;
        return events_create_response(feed);
    case RESPONSE_BYTES:
        return from_bytes(request);
    case RESPONSE_PIECES:
        return from_pieces(request);
    default:
        respond_failure(request, GROOM_EINTERNAL, NULL);
        return from_bytes(request);
    }
}

/* returns  false where memory is out; what can be no header is left out */
static bool add_header(struct MHD_Response *sent, const char *name, const char *value)
{
    if (!value[0] || strpbrk(value, "\r\n\t"))
        return true;
    return MHD_add_response_header(sent, name, value) == MHD_YES;
}

/* An answer that lacks one of them would say something else. */
static bool add_headers(struct request *request, struct MHD_Response *sent)
{
    const struct response *response = &request->response;
    bool added = true;
    for (size_t i = 0; i < response->n_headers; i++)
        added = added && add_header(sent, response->headers[i].name, response->headers[i].value);
    if (request->route && (request->route->flags & ROUTE_TUS))
        added = added && add_header(sent, "Tus-Resumable", "1.0.0");
    if (response->content_type)
        added = added && add_header(sent, "Content-Type", response->content_type);
    added = added && add_header(sent, "ETag", response->etag);
    added = added && add_header(sent, "Cache-Control", response->etag[0] ? "no-cache" : "no-store");
    added = added && add_header(sent, "X-Content-Type-Options", "nosniff");
    added = added && add_header(sent, "X-Request-Id", request->id);
    access_add_cors(request, sent);
    if (request->close)
        added = added && add_header(sent, "Connection", "close");
    return added;
}

int server_send(struct request *request)
{
    struct MHD_Response *sent = create(request);
    if (!sent)
        return MHD_NO;
    if (!add_headers(request, sent)) {
        MHD_destroy_response(sent);
        return MHD_NO; /* the connection breaks */
    }
    if (request_is_head(request) || request->response.status == 304)
        request->n_sent = 0;
    enum MHD_Result result =
        MHD_queue_response(request->connection, (unsigned)request->response.status, sent);
    MHD_destroy_response(sent);
    return result;
}
