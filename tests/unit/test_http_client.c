/* URLs, event streams and what the HTTP client makes of servers that behave and misbehave. */
#include <arpa/inet.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "proto/event_stream.h"
#include "proto/http_client.h"
#include "proto/job.h"
#include "proto/url.h"
#include "tests/support/test.h"

/* --- words ------------------------------------------------------------------- */

START_TEST(job_states_have_names_and_back)
{
    for (int s = 0; s < JOB_STATE_COUNT; s++)
        ck_assert_int_eq(job_state_parse(job_state_name((job_state)s)), s);
    ck_assert_int_eq(job_state_parse("done"), JOB_STATE_COUNT);
    ck_assert_int_eq(job_state_parse(NULL), JOB_STATE_COUNT);
    ck_assert(!job_state_is_end(JOB_STATE_RUNNING) && job_state_is_end(JOB_STATE_CANCELLED));
}
END_TEST

START_TEST(url_encodes_what_a_query_may_not_hold)
{
    struct url url;
    url_init(&url, "/v1/strands");
    url_query(&url, "name", "a b&c=d/é");
    url_query(&url, "format", NULL);
    url_query_number(&url, "unit", 0.01);
    ck_assert_str_eq(url.text, "/v1/strands?name=a%20b%26c%3Dd%2F%C3%A9&unit=0.01");
    url_init(&url, "/v1/jobs");
    url_segment(&url, "../x");
    ck_assert_str_eq(url.text, "/v1/jobs/..%2Fx");
}
END_TEST

START_TEST(url_says_when_it_does_not_fit)
{
    struct url url;
    char *name = malloc(2000);
    memset(name, 'x', 1999);
    name[1999] = '\0';
    url_init(&url, "/v1/strands");
    url_query(&url, "name", name);
    ck_assert_int_eq(url.overflow, 1);
    free(name);
}
END_TEST

/* --- events -------------------------------------------------------------------- */

static char seen[4096];

static void on_event(void *user, const struct event *event)
{
    size_t n = strlen(seen);
    snprintf(seen + n, sizeof seen - n, "[%s|%s|%s]", event->name, event->data, event->id);
}

START_TEST(events_come_whole_whatever_the_pieces)
{
    static const char text[] = ": hello\n\nid: 7\nevent: progress\ndata: {\"a\":1}\n\n"
                               "data: x\r\ndata: y\r\n\r\nevent: state\ndata:z\n\nevent: empty\n\n";
    for (size_t piece = 1; piece < sizeof text; piece += 3) {
        struct event_stream stream;
        event_stream_init(&stream, on_event, NULL);
        seen[0] = '\0';
        for (size_t at = 0; at < sizeof text - 1; at += piece)
            event_stream_feed(&stream, text + at,
                              at + piece < sizeof text - 1 ? piece : sizeof text - 1 - at);
        ck_assert_str_eq(seen, "[progress|{\"a\":1}|7][message|x\ny|7][state|z|7]");
    }
}
END_TEST

START_TEST(events_survive_a_reconnect_and_a_flood)
{
    struct event_stream stream;
    event_stream_init(&stream, on_event, NULL);
    seen[0] = '\0';
    event_stream_feed(&stream, "id: 3\nevent: state\ndata: ha", 28);
    event_stream_reconnect(&stream);
    event_stream_feed(&stream, "data: whole\n\n", 13);
    ck_assert_str_eq(seen, "[message|whole|3]");
    for (int i = 0; i < 100000; i++)
        event_stream_feed(&stream, "data: xxxxxxxx", 14);
    event_stream_feed(&stream, "\n", 1);
}
END_TEST

/* --- a server of one canned answer ------------------------------------------------ */

struct canned {
    int listener;
    const char *answer;
    char asked[8192];
    pthread_t thread;
    char url[64];
};

static void *serve(void *argument)
{
    struct canned *server = argument;
    int fd = accept(server->listener, NULL, NULL);
    ssize_t got = fd < 0 ? 0 : read(fd, server->asked, sizeof server->asked - 1);
    size_t n = got > 0 ? (size_t)got : 0;
    /* a request with a body ends when it says so in it */
    while (n && strstr(server->asked, "Content-Length") && !strstr(server->asked, "end of body") &&
           n < sizeof server->asked - 1) {
        got = read(fd, server->asked + n, sizeof server->asked - 1 - n);
        if (got <= 0)
            break;
        n += (size_t)got;
    }
    if (server->answer && write(fd, server->answer, strlen(server->answer)) < 0)
        perror("write");
    close(fd);
    return NULL;
}

static void canned_start(struct canned *server, const char *answer)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t n = sizeof address;
    memset(server, 0, sizeof *server);
    server->answer = answer;
    server->listener = socket(AF_INET, SOCK_STREAM, 0);
    ck_assert_int_eq(bind(server->listener, (struct sockaddr *)&address, sizeof address), 0);
    ck_assert_int_eq(listen(server->listener, 4), 0);
    ck_assert_int_eq(getsockname(server->listener, (struct sockaddr *)&address, &n), 0);
    snprintf(server->url, sizeof server->url, "http://127.0.0.1:%d/", ntohs(address.sin_port));
    ck_assert_int_eq(pthread_create(&server->thread, NULL, serve, server), 0);
}

static void canned_stop(struct canned *server)
{
    pthread_join(server->thread, NULL);
    close(server->listener);
}

static struct http_client *client_to(const char *url, const char *token)
{
    struct http_client *client =
        http_client_create(&(struct http_client_options){.base_url = url, .token = token});
    ck_assert_ptr_nonnull(client);
    return client;
}

START_TEST(client_sends_the_request_and_reads_the_answer)
{
    struct canned server;
    struct http_response response;
    canned_start(&server,
                 "HTTP/1.1 201 Created\r\nETag: \"4\"\r\nlocation: /v1/jobs/job_1\r\nRetry-After: 3\r\n"
                 "Content-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}");
    struct http_client *client = client_to(server.url, "secret");
    struct http_request request = {.method = "PATCH",
                                   .path = "/v1/x?a=b",
                                   .headers = {"If-Match: \"3\""},
                                   .content_type = "text/plain",
                                   .body = "end of body",
                                   .n_body = 11};
    ck_assert_int_eq(http_perform(client, &request, &response), HTTP_ANSWERED);
    canned_stop(&server);
    ck_assert_int_eq(response.status, 201);
    ck_assert_str_eq(response.body, "{}");
    ck_assert_str_eq(response.etag, "\"4\"");
    ck_assert_str_eq(response.location, "/v1/jobs/job_1");
    ck_assert_int_eq(response.retry_after_s, 3);
    ck_assert_ptr_nonnull(strstr(server.asked, "PATCH /v1/x?a=b HTTP/1.1\r\n"));
    ck_assert_ptr_nonnull(strstr(server.asked, "Authorization: Bearer secret\r\n"));
    ck_assert_ptr_nonnull(strstr(server.asked, "If-Match: \"3\"\r\n"));
    ck_assert_ptr_nonnull(strstr(server.asked, "Content-Length: 11\r\n"));
    ck_assert_ptr_nonnull(strstr(server.asked, "\r\n\r\nend of body"));
    http_response_finish(&response);
    http_client_destroy(client);
}
END_TEST

START_TEST(client_sends_a_body_of_parts)
{
    struct canned server;
    struct http_response response;
    canned_start(&server, "HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n");
    struct http_client *client = client_to(server.url, NULL);
    struct http_request request = {.method = "POST", .path = "/v1/x", .n_body = 11,
                                   .parts = {{"end ", 4}, {"", 0}, {"of b", 4}, {"ody", 3}}, .n_parts = 4};
    ck_assert_int_eq(http_perform(client, &request, &response), HTTP_ANSWERED);
    canned_stop(&server);
    ck_assert_int_eq(response.status, 204);
    ck_assert_ptr_nonnull(strstr(server.asked, "Content-Length: 11\r\n"));
    ck_assert_ptr_nonnull(strstr(server.asked, "\r\n\r\nend of body"));
    http_response_finish(&response);
    http_client_destroy(client);
}
END_TEST

static size_t take_all(void *user, const char *bytes, size_t n)
{
    strncat(user, bytes, n);
    return n;
}

START_TEST(client_keeps_a_problem_out_of_the_sink)
{
    struct canned server;
    struct http_response response;
    char taken[64] = "";
    canned_start(&server, "HTTP/1.1 404 Not Found\r\nContent-Length: 4\r\nConnection: close\r\n\r\nnone");
    struct http_client *client = client_to(server.url, NULL);
    struct http_request request = {.method = "GET", .path = "/x", .sink = take_all, .user = taken};
    ck_assert_int_eq(http_perform(client, &request, &response), HTTP_ANSWERED);
    canned_stop(&server);
    ck_assert_str_eq(taken, "");
    ck_assert_str_eq(response.body, "none");
    ck_assert_ptr_null(strstr(server.asked, "Authorization"));
    http_response_finish(&response);
    http_client_destroy(client);
}
END_TEST

START_TEST(client_names_how_a_line_fails)
{
    struct canned server;
    struct http_response response;
    struct http_request request = {.method = "GET", .path = "/x"};
    canned_start(&server, "HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nshort");
    struct http_client *client = client_to(server.url, NULL);
    ck_assert_int_eq(http_perform(client, &request, &response), HTTP_BROKEN);
    ck_assert_int_ne(response.failure[0], 0);
    http_response_finish(&response);
    canned_stop(&server);
    ck_assert_int_eq(http_perform(client, &request, &response), HTTP_UNREACHABLE);
    http_response_finish(&response);
    http_client_destroy(client);
    client = client_to("nonsense://x", NULL);
    ck_assert_int_eq(http_perform(client, &request, &response), HTTP_REFUSED_URL);
    http_response_finish(&response);
    http_client_destroy(client);
}
END_TEST

static int at_once(void *user) { return 1; }

START_TEST(client_gives_up_when_interrupted)
{
    struct http_response response;
    struct http_client *client = http_client_create(
        &(struct http_client_options){.base_url = "http://127.0.0.1:9", .interrupted = at_once});
    ck_assert_int_eq(http_perform(client, &(struct http_request){.method = "GET", .path = "/"}, &response),
                     HTTP_INTERRUPTED);
    http_response_finish(&response);
    http_client_destroy(client);
    http_client_destroy(NULL);
}
END_TEST

static void count_tick(void *user) { ++*(int *)user; }

START_TEST(client_lets_go_of_all_when_a_vital_one_ends)
{
    struct canned quick; /* serves one connection; the other waits to be accepted */
    struct http_response responses[2];
    http_outcome outcomes[2];
    int ticks = 0;
    canned_start(&quick, "HTTP/1.1 200 OK\r\nContent-Length: 1\r\nConnection: close\r\n\r\nx");
    struct http_client *client = client_to(quick.url, NULL);
    struct http_request requests[2] = {{.method = "GET", .path = "/x", .is_vital = 1},
                                       {.method = "GET", .path = "/never", .is_vital = 1}};
    http_perform_all(client, requests, 2, responses, outcomes, count_tick, &ticks);
    ck_assert(outcomes[0] == HTTP_ANSWERED || outcomes[1] == HTTP_ANSWERED);
    ck_assert(outcomes[0] == HTTP_INTERRUPTED || outcomes[1] == HTTP_INTERRUPTED);
    ck_assert_int_ge(ticks, 1);
    http_response_finish(&responses[0]);
    http_response_finish(&responses[1]);
    http_client_destroy(client);
    canned_stop(&quick);
}
END_TEST

TEST_SUITE("http_client", job_states_have_names_and_back, url_encodes_what_a_query_may_not_hold,
           url_says_when_it_does_not_fit, events_come_whole_whatever_the_pieces,
           events_survive_a_reconnect_and_a_flood, client_sends_the_request_and_reads_the_answer, client_sends_a_body_of_parts,
           client_keeps_a_problem_out_of_the_sink, client_names_how_a_line_fails,
           client_gives_up_when_interrupted, client_lets_go_of_all_when_a_vital_one_ends)
