#include "proto/http_client.h"

#include <curl/curl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>
#include <unistd.h>

#define MAX_COLLECTED ((size_t)256 << 20)
#define UPLOAD_PIECE  (1L << 20)
#define TICK_MS       100

struct http_client {
    CURLM *multi;
    char *base_url, *authorization, *agent;
    int connect_timeout_ms;
    int (*interrupted)(void *user);
    void *user;
};

/* One request under way. */
struct transfer {
    CURL *easy;
    struct curl_slist *headers;
    const struct http_request *request;
    struct http_response *response;
    char *url;
    char error[CURL_ERROR_SIZE];
    size_t capacity; /* of response->body */
    uint64_t at;     /* of the body sent */
    int stopped;     /* the sink said so */
    int done;
    CURLcode code;
};

/* --- the client ----------------------------------------------------------- */

static void start_curl(void) { curl_global_init(CURL_GLOBAL_DEFAULT); }

static char *join(const char *a, const char *b)
{
    size_t n = strlen(a), m = strlen(b);
    char *text = malloc(n + m + 1);
    if (!text)
        return NULL;
    memcpy(text, a, n);
    memcpy(text + n, b, m + 1);
    return text;
}

struct http_client *http_client_create(const struct http_client_options *options)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    struct http_client *client = calloc(1, sizeof *client);
    if (!client)
        return NULL;
    pthread_once(&once, start_curl);
    client->multi = curl_multi_init();
    client->base_url = join(options->base_url, "");
    client->agent = join(options->agent ? options->agent : "groom", "");
    client->authorization = options->token ? join("Authorization: Bearer ", options->token) : NULL;
    client->connect_timeout_ms = options->connect_timeout_ms ? options->connect_timeout_ms : 5000;
    client->interrupted = options->interrupted;
    client->user = options->user;
    if (!client->multi || !client->base_url || !client->agent || (options->token && !client->authorization)) {
        http_client_destroy(client);
        return NULL;
    }
    for (size_t n = strlen(client->base_url); n && client->base_url[n - 1] == '/'; n--)
        client->base_url[n - 1] = '\0';
    return client;
}

void http_client_destroy(struct http_client *client)
{
    if (!client)
        return;
    if (client->multi)
        curl_multi_cleanup(client->multi);
    free(client->base_url);
    free(client->authorization);
    free(client->agent);
    free(client);
}

const char *http_client_base_url(const struct http_client *client) { return client->base_url; }

void http_response_finish(struct http_response *response)
{
    free(response->body);
    memset(response, 0, sizeof *response);
}

/* --- callbacks of libcurl ---------------------------------------------------- */

/* n bytes of the parts, from t->at on. */
static void copy_parts(const struct transfer *t, char *buffer, size_t n)
{
    uint64_t skip = t->at;
    for (unsigned i = 0; i < t->request->n_parts && n > 0; i++) {
        const struct http_part *part = &t->request->parts[i];
        if (skip >= part->n) {
            skip -= part->n;
            continue;
        }
        size_t here = part->n - (size_t)skip < n ? part->n - (size_t)skip : n;
        memcpy(buffer, (const char *)part->bytes + skip, here);
        buffer += here;
        n -= here;
        skip = 0;
    }
}

static size_t on_send(char *buffer, size_t size, size_t n, void *user)
{
    struct transfer *t = user;
    const struct http_request *request = t->request;
    uint64_t left = request->n_body - t->at;
    size_t piece = size * n < left ? size * n : (size_t)left;
    if (request->body) {
        memcpy(buffer, (const char *)request->body + t->at, piece);
    } else if (request->n_parts) {
        copy_parts(t, buffer, piece);
    } else if (piece) {
        ssize_t got = read(request->body_fd, buffer, piece);
        if (got <= 0)
            return CURL_READFUNC_ABORT;
        piece = (size_t)got;
    }
    t->at += piece;
    if (request->sent)
        request->sent(request->user, t->at, request->n_body);
    return piece;
}

/* Asked for when a kept-alive connection turns out to be closed and libcurl sends again. */
static int on_rewind(void *user, curl_off_t offset, int origin)
{
    struct transfer *t = user;
    if (origin != SEEK_SET)
        return CURL_SEEKFUNC_CANTSEEK;
    if (!t->request->body && !t->request->n_parts &&
        lseek(t->request->body_fd, (off_t)offset - (off_t)t->at, SEEK_CUR) < 0)
        return CURL_SEEKFUNC_CANTSEEK;
    t->at = (uint64_t)offset;
    return CURL_SEEKFUNC_OK;
}

static int collect(struct transfer *t, const char *bytes, size_t n)
{
    struct http_response *r = t->response;
    size_t wanted = r->n_body + n + 1, capacity = t->capacity ? t->capacity : 4096;
    if (wanted > MAX_COLLECTED)
        return 0;
    while (capacity < wanted)
        capacity *= 2;
    if (capacity != t->capacity) {
        char *body = realloc(r->body, capacity);
        if (!body)
            return 0;
        r->body = body;
        t->capacity = capacity;
    }
    memcpy(r->body + r->n_body, bytes, n);
    r->n_body += n;
    r->body[r->n_body] = '\0';
    return 1;
}

static size_t on_receive(char *bytes, size_t size, size_t n, void *user)
{
    struct transfer *t = user;
    long status = 0;
    curl_easy_getinfo(t->easy, CURLINFO_RESPONSE_CODE, &status);
    if (!t->request->sink || status < 200 || status > 299)
        return collect(t, bytes, size * n) ? size * n : 0;
    if (t->request->sink(t->request->user, bytes, size * n) == size * n)
        return size * n;
    t->stopped = 1;
    return 0;
}

static void keep_header(char *out, size_t capacity, const char *line, size_t n, const char *name)
{
    size_t length = strlen(name);
    if (n <= length || strncasecmp(line, name, length) || line[length] != ':')
        return;
    for (length++; length < n && (line[length] == ' ' || line[length] == '\t'); length++) {
    }
    while (n > length && (line[n - 1] == '\r' || line[n - 1] == '\n' || line[n - 1] == ' '))
        n--;
    snprintf(out, capacity, "%.*s", (int)(n - length), line + length);
}

static void keep_number(long long *out, const char *line, size_t n, const char *name)
{
    char text[24] = "", *end;
    keep_header(text, sizeof text, line, n, name);
    long long value = strtoll(text, &end, 10);
    if (text[0] && !*end && value >= 0)
        *out = value;
}

static size_t on_header(char *line, size_t size, size_t n, void *user)
{
    struct http_response *r = ((struct transfer *)user)->response;
    char seconds[24] = "";
    n *= size;
    keep_header(r->content_type, sizeof r->content_type, line, n, "Content-Type");
    keep_header(r->etag, sizeof r->etag, line, n, "ETag");
    keep_header(r->location, sizeof r->location, line, n, "Location");
    keep_header(seconds, sizeof seconds, line, n, "Retry-After");
    if (seconds[0])
        r->retry_after_s = atoi(seconds);
    keep_number(&r->upload_offset, line, n, "Upload-Offset");
    keep_number(&r->upload_length, line, n, "Upload-Length");
    keep_number(&r->content_length, line, n, "Content-Length");
    return n;
}

/* --- one transfer -------------------------------------------------------------- */

static int add_header(struct transfer *t, const char *line)
{
    struct curl_slist *list = curl_slist_append(t->headers, line);
    if (list)
        t->headers = list;
    return list != NULL;
}

static int set_headers(struct http_client *client, struct transfer *t)
{
    char line[160];
    int ok = !client->authorization || add_header(t, client->authorization);
    if (t->request->content_type) {
        snprintf(line, sizeof line, "Content-Type: %s", t->request->content_type);
        ok = ok && add_header(t, line);
    } else {
        ok = ok && add_header(t, "Content-Type:");
    }
    for (int i = 0; i < HTTP_MAX_HEADERS && t->request->headers[i]; i++)
        ok = ok && add_header(t, t->request->headers[i]);
    curl_easy_setopt(t->easy, CURLOPT_HTTPHEADER, t->headers);
    return ok;
}

static void set_body(struct transfer *t)
{
    const struct http_request *request = t->request;
    if (!request->body && request->body_fd <= 0 && !request->n_parts) {
        if (!strcmp(request->method, "HEAD"))
            curl_easy_setopt(t->easy, CURLOPT_NOBODY, 1L);
        else if (!strcmp(request->method, "POST")) {
            curl_easy_setopt(t->easy, CURLOPT_POST, 1L);
            curl_easy_setopt(t->easy, CURLOPT_POSTFIELDSIZE, 0L);
        }
        return;
    }
    curl_easy_setopt(t->easy, CURLOPT_UPLOAD, 1L);
    curl_easy_setopt(t->easy, CURLOPT_INFILESIZE_LARGE, (curl_off_t)request->n_body);
    curl_easy_setopt(t->easy, CURLOPT_UPLOAD_BUFFERSIZE, UPLOAD_PIECE);
    curl_easy_setopt(t->easy, CURLOPT_READFUNCTION, on_send);
    curl_easy_setopt(t->easy, CURLOPT_READDATA, t);
    curl_easy_setopt(t->easy, CURLOPT_SEEKFUNCTION, on_rewind);
    curl_easy_setopt(t->easy, CURLOPT_SEEKDATA, t);
}

static void set_limits(struct http_client *client, struct transfer *t)
{
    int idle_s = t->request->idle_timeout_s ? t->request->idle_timeout_s : 60;
    curl_easy_setopt(t->easy, CURLOPT_CONNECTTIMEOUT_MS, (long)client->connect_timeout_ms);
    curl_easy_setopt(t->easy, CURLOPT_TIMEOUT_MS, (long)t->request->timeout_ms);
    curl_easy_setopt(t->easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(t->easy, CURLOPT_LOW_SPEED_TIME, (long)idle_s);
    curl_easy_setopt(t->easy, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(t->easy, CURLOPT_FOLLOWLOCATION, 0L);
    curl_easy_setopt(t->easy, CURLOPT_PROTOCOLS_STR, "http,https");
}

static int transfer_init(struct transfer *t, struct http_client *client, const struct http_request *request,
                         struct http_response *response)
{
    memset(t, 0, sizeof *t);
    memset(response, 0, sizeof *response);
    response->retry_after_s = -1;
    response->upload_offset = response->upload_length = response->content_length = -1;
    t->request = request;
    t->response = response;
    t->code = CURLE_OUT_OF_MEMORY;
    if (request->begin)
        request->begin(request->user);
    t->easy = curl_easy_init();
    t->url = join(client->base_url, request->path);
    if (!t->easy || !t->url || !set_headers(client, t))
        return 0;
    curl_easy_setopt(t->easy, CURLOPT_URL, t->url);
    curl_easy_setopt(t->easy, CURLOPT_USERAGENT, client->agent);
    curl_easy_setopt(t->easy, CURLOPT_ERRORBUFFER, t->error);
    curl_easy_setopt(t->easy, CURLOPT_BUFFERSIZE, 512L << 10);
    curl_easy_setopt(t->easy, CURLOPT_WRITEFUNCTION, on_receive);
    curl_easy_setopt(t->easy, CURLOPT_WRITEDATA, t);
    curl_easy_setopt(t->easy, CURLOPT_HEADERFUNCTION, on_header);
    curl_easy_setopt(t->easy, CURLOPT_HEADERDATA, t);
    set_body(t);
    curl_easy_setopt(t->easy, CURLOPT_CUSTOMREQUEST, request->method);
    set_limits(client, t);
    return curl_multi_add_handle(client->multi, t->easy) == CURLM_OK;
}

static http_outcome outcome_of(const struct transfer *t)
{
    if (!t->done || t->stopped || t->code == CURLE_ABORTED_BY_CALLBACK)
        return HTTP_INTERRUPTED;
    switch (t->code) {
    case CURLE_OK:
        return HTTP_ANSWERED;
    case CURLE_OUT_OF_MEMORY:
        return HTTP_NO_MEMORY;
    case CURLE_URL_MALFORMAT:
    case CURLE_UNSUPPORTED_PROTOCOL:
        return HTTP_REFUSED_URL;
    case CURLE_COULDNT_CONNECT:
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_RESOLVE_PROXY:
        return HTTP_UNREACHABLE;
    /* A server that refuses a body early may close before it has read it; the answer counts. */
    case CURLE_SEND_ERROR:
        return t->response->status >= 400 && t->response->n_body ? HTTP_ANSWERED : HTTP_BROKEN;
    default:
        return HTTP_BROKEN;
    }
}

static http_outcome transfer_finish(struct transfer *t, struct http_client *client)
{
    long status = 0;
    http_outcome outcome;
    if (!t->easy)
        return HTTP_NO_MEMORY;
    curl_easy_getinfo(t->easy, CURLINFO_RESPONSE_CODE, &status);
    t->response->status = (int)status;
    outcome = outcome_of(t);
    if (outcome != HTTP_ANSWERED)
        snprintf(t->response->failure, sizeof t->response->failure, "%s",
                 t->error[0] ? t->error : curl_easy_strerror(t->code));
    curl_multi_remove_handle(client->multi, t->easy);
    curl_easy_cleanup(t->easy);
    curl_slist_free_all(t->headers);
    free(t->url);
    return outcome;
}

/* --- running ---------------------------------------------------------------------- */

static void note_ended(CURLM *multi, struct transfer *transfers, size_t n)
{
    CURLMsg *message;
    int left;
    while ((message = curl_multi_info_read(multi, &left))) {
        if (message->msg != CURLMSG_DONE)
            continue;
        for (size_t i = 0; i < n; i++)
            if (transfers[i].easy == message->easy_handle) {
                transfers[i].done = 1;
                transfers[i].code = message->data.result;
            }
    }
}

static int vital_ended(const struct transfer *transfers, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (transfers[i].done && !transfers[i].stopped && transfers[i].request->is_vital)
            return 1;
    return 0;
}

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static void run(struct http_client *client, struct transfer *transfers, size_t n, void (*tick)(void *user),
                void *tick_user)
{
    int running = 1;
    double last = 0;
    while (running) {
        if (client->interrupted && client->interrupted(client->user))
            return;
        if (curl_multi_perform(client->multi, &running) != CURLM_OK)
            return;
        note_ended(client->multi, transfers, n);
        if (vital_ended(transfers, n))
            return;
        if (tick && now_ms() - last >= TICK_MS) {
            tick(tick_user);
            last = now_ms();
        }
        if (running && curl_multi_poll(client->multi, NULL, 0, TICK_MS, NULL) != CURLM_OK)
            return;
    }
}

void http_perform_all(struct http_client *client, const struct http_request *requests, size_t n,
                      struct http_response *responses, http_outcome *outcomes, void (*tick)(void *user),
                      void *tick_user)
{
    struct transfer *transfers = calloc(n ? n : 1, sizeof *transfers);
    for (size_t i = 0; i < n; i++) {
        memset(&responses[i], 0, sizeof responses[i]);
        outcomes[i] = HTTP_NO_MEMORY;
    }
    if (!transfers)
        return;
    for (size_t i = 0; i < n; i++)
        if (!transfer_init(&transfers[i], client, &requests[i], &responses[i]))
            transfers[i].done = 1;
    run(client, transfers, n, tick, tick_user);
    for (size_t i = 0; i < n; i++)
        outcomes[i] = transfer_finish(&transfers[i], client);
    free(transfers);
}

http_outcome http_perform(struct http_client *client, const struct http_request *request,
                          struct http_response *response)
{
    http_outcome outcome;
    http_perform_all(client, request, 1, response, &outcome, NULL, NULL);
    return outcome;
}
