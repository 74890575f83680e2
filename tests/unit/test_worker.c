/* What an attempt reads and what it makes of the daemon's answers. */
#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "groom/fit.h"
#include "groom/sample.h"
#include "server/worker/blob.h"
#include "server/worker/checkpoint.h"
#include "server/worker/order.h"
#include "server/worker/progress_report.h"
#include "server/worker/work_link.h"
#include "server/worker/worker.h"
#include "tests/support/test.h"

#define ABC_SHA256 "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad" /* of "abc" */

/* --- orders ------------------------------------------------------------------------ */

static groom_status parse(const char *json, struct order *order)
{
    return order_parse(json, strlen(json), order, NULL);
}

START_TEST(order_reads_inputs_options_and_checkpoint)
{
    struct order order;
    ck_ok(parse(
        "{\"job\":\"job_a\",\"kind\":\"fit\",\"attempt\":3,\"options\":{\"seed\":7},\"inputs\":{\"strands\":"
        "{\"id\":\"str_a\",\"sha256\":\"" ABC_SHA256 "\",\"bytes\":3,\"format\":\"hair\",\"unit_m\":0.01,"
        "\"up\":\"z\",\"name\":\"n\"},\"head\":null},\"checkpoint\":{\"sha256\":\"" ABC_SHA256
        "\",\"bytes\":3,"
        "\"stage\":1,\"path\":\"/p\"}}",
        &order));
    ck_assert_str_eq(order.options, "{\"seed\":7}");
    ck_assert_uint_eq(order.attempt, 3);
    ck_assert_str_eq(order.strands.format, "hair");
    ck_assert(order.strands.frame.up == GROOM_UP_Z && order.strands.frame.unit_m == 0.01);
    ck_assert_str_eq(order.head.blob.sha256, "");
    ck_assert_str_eq(order.checkpoint.path, "/p");
    order_finish(&order);
}
END_TEST

START_TEST(order_refuses_what_is_not_one)
{
    static const char *const bad[] = {
        "", "[]", "{\"inputs\":{}}", "{\"inputs\":{\"strands\":{\"sha256\":\"../x\",\"bytes\":3}}}",
        "{\"inputs\":{\"strands\":{\"sha256\":\"" ABC_SHA256 "\",\"bytes\":-1}}}"};
    struct order order;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        ck_status(parse(bad[i], &order), GROOM_EFORMAT);
}
END_TEST

/* --- a daemon of canned answers, one connection each ------------------------------------- */

struct canned {
    int listener;
    const char *const *answers;
    int n_served;
    pthread_t thread;
    char url[64];
};

static void *serve(void *argument)
{
    struct canned *server = argument;
    char asked[4096];
    for (; server->answers[server->n_served]; server->n_served++) {
        const char *answer = server->answers[server->n_served];
        int fd = accept(server->listener, NULL, NULL);
        if (read(fd, asked, sizeof asked) < 0 || write(fd, answer, strlen(answer)) < 0)
            perror("canned");
        shutdown(fd, SHUT_WR);
        while (read(fd, asked, sizeof asked) > 0) {
        }
        close(fd);
    }
    return NULL;
}

static void canned_start(struct canned *server, const char *const *answers)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t n = sizeof address;
    *server = (struct canned){.listener = socket(AF_INET, SOCK_STREAM, 0), .answers = answers};
    ck_assert_int_eq(bind(server->listener, (struct sockaddr *)&address, sizeof address), 0);
    ck_assert_int_eq(listen(server->listener, 8), 0);
    ck_assert_int_eq(getsockname(server->listener, (struct sockaddr *)&address, &n), 0);
    snprintf(server->url, sizeof server->url, "http://127.0.0.1:%d", ntohs(address.sin_port));
    ck_assert_int_eq(pthread_create(&server->thread, NULL, serve, server), 0);
}

static volatile sig_atomic_t no_stop;

#define ANSWER(status, body_length, body)                                                                    \
    "HTTP/1.1 " status "\r\nConnection: close\r\nContent-Length: " body_length "\r\n\r\n" body

static groom_status ask(const char *const *answers, struct groom_diag *diag)
{
    struct canned server;
    struct work_link link;
    canned_start(&server, answers);
    ck_assert(work_link_open(&link, server.url, "t", &no_stop));
    groom_status st =
        work_link_call(&link, &(struct http_request){.method = "GET", .path = "/x"}, NULL, diag);
    work_link_close(&link);
    close(server.listener);
    pthread_join(server.thread, NULL);
    return st;
}

START_TEST(link_repeats_what_passes)
{
    static const char *const answers[] = {ANSWER("503 Busy", "0", ""),
                                          "HTTP/1.1 200 OK\r\nContent-Length: 9\r\n\r\ncut",
                                          ANSWER("200 OK", "0", ""), NULL};
    ck_ok(ask(answers, NULL));
}
END_TEST

START_TEST(link_leaves_quietly_when_fenced)
{
    static const char *const answers[] = {ANSWER("409 Conflict", "0", ""), NULL};
    ck_status(ask(answers, NULL), GROOM_ECANCELLED);
}
END_TEST

START_TEST(link_tells_a_refusal_with_its_detail)
{
    static const char *const answers[] = {
        ANSWER("400 Bad Request", "52", "{\"type\":\"/problems/x\",\"title\":\"t\",\"detail\":\"not so\"}"),
        NULL};
    struct groom_diag diag;
    ck_status(ask(answers, &diag), GROOM_EIO);
    ck_assert_str_eq(diag.detail, "the daemon answered 400: not so");
}
END_TEST

START_TEST(link_stops_waiting_when_the_process_is_to_end)
{
    volatile sig_atomic_t stop = 1;
    struct work_link link;
    ck_assert(work_link_open(&link, "http://127.0.0.1:9", "t", &stop));
    ck_status(work_link_call(&link, &(struct http_request){.method = "GET", .path = "/x"}, NULL, NULL),
              GROOM_ECANCELLED);
    work_link_close(&link);
}
END_TEST

/* --- blobs ---------------------------------------------------------------------------------- */

static groom_status fetch(const char *const *answers, struct blob *blob)
{
    struct canned server;
    struct work_link link;
    struct order_blob name = {.sha256 = ABC_SHA256, .n_bytes = 3};
    canned_start(&server, answers);
    ck_assert(work_link_open(&link, server.url, "t", &no_stop));
    groom_status st = blob_fetch(&link, &name, blob, NULL);
    work_link_close(&link);
    close(server.listener);
    pthread_join(server.thread, NULL);
    return st;
}

START_TEST(blob_is_verified_and_a_broken_line_taken_up_again)
{
    static const char *const answers[] = {"HTTP/1.1 200 OK\r\nContent-Length: 3\r\n\r\na",
                                          ANSWER("200 OK", "3", "abc"), NULL};
    struct blob blob;
    ck_ok(fetch(answers, &blob));
    ck_assert_uint_eq(blob.n_bytes, 3);
    ck_assert_mem_eq(blob.bytes, "abc", 3);
    blob_release(&blob);
}
END_TEST

START_TEST(blob_of_other_bytes_is_refused)
{
    static const char *const other[] = {ANSWER("200 OK", "3", "abd"), NULL},
                             *const longer[] = {ANSWER("200 OK", "5", "abcde"), NULL},
                             *const shorter[] = {ANSWER("200 OK", "2", "ab"), NULL};
    struct blob blob;
    ck_status(fetch(other, &blob), GROOM_EIO);
    ck_status(fetch(shorter, &blob), GROOM_EIO);
    ck_ok(fetch(longer, &blob)); /* what was announced is there; the rest is dropped */
    blob_release(&blob);
}
END_TEST

START_TEST(blob_comes_from_a_shared_folder_where_there_is_one)
{
    char path[] = "/tmp/blob_XXXXXX";
    int fd = mkstemp(path);
    struct work_link link;
    struct blob blob;
    struct order_blob name = {.sha256 = ABC_SHA256, .n_bytes = 3};
    ck_assert_int_eq(write(fd, "abc", 3), 3);
    close(fd);
    snprintf(name.path, sizeof name.path, "%s", path);
    ck_assert(work_link_open(&link, "http://127.0.0.1:9", "t", &no_stop));
    ck_ok(blob_fetch(&link, &name, &blob, NULL));
    ck_assert(blob.is_map);
    blob_release(&blob);
    work_link_close(&link);
    unlink(path);
}
END_TEST

/* --- progress and checkpoints ----------------------------------------------------------------- */

static struct groom_fit *small_fit(void)
{
    struct groom_sample_options sample_options;
    struct groom_sample *sample;
    struct groom_fit_options *options = malloc(sizeof *options);
    struct groom_fit *fit;
    groom_sample_options_init(GROOM_SAMPLE_SHORT, &sample_options);
    sample_options.n_strands = 60;
    sample_options.n_guides = 10;
    sample_options.n_operator_guides = 3;
    ck_ok(groom_sample_create(&sample_options, NULL, &sample, NULL));
    groom_fit_options_init(GROOM_FIT_DRAFT, options);
    options->vertices = 20;
    options->guides = 10;
    ck_ok(groom_fit_create(sample->capture, NULL, options, NULL, &fit, NULL));
    groom_sample_destroy(sample);
    free(options);
    return fit;
}

START_TEST(progress_is_told_from_the_fit_and_its_report)
{
    struct progress_report report;
    struct groom_fit *fit = small_fit();
    progress_report_init(&report, NULL);
    char *text = progress_report_text(&report, 0);
    ck_assert_str_eq(text, "{\"losses\":[]}");
    free(text);
    progress_report_follow(&report, fit);
    report.callbacks.loss(report.callbacks.user, "cluster", 3, 0.5);
    report.callbacks.loss(report.callbacks.user, "cluster", 4, NAN);
    text = progress_report_text(&report, report.started_s + 1);
    ck_assert_ptr_nonnull(strstr(text, "\"stage\":{\"name\":\"initialize\",\"index\":0,"));
    ck_assert_ptr_nonnull(strstr(text, "\"progress\":0,"));
    ck_assert_ptr_nonnull(
        strstr(text, "[{\"stage\":\"initialize\",\"iteration\":3,\"name\":\"cluster\",\"value\":0.5}]"));
    ck_assert_ptr_null(strstr(text, "eta_s"));
    free(text);
    while (!groom_fit_done(fit))
        ck_ok(groom_fit_step(fit, NULL, NULL));
    text = progress_report_text(&report, report.started_s + 1);
    ck_assert_ptr_nonnull(strstr(text, "\"progress\":0.9,\"eta_s\":0.1,"));
    free(text);
    groom_fit_destroy(fit);
    progress_report_compare(&report);
    report.callbacks.report(report.callbacks.user, 0.5);
    text = progress_report_text(&report, report.started_s + 1);
    ck_assert_ptr_nonnull(strstr(text, "\"stage\":{\"name\":\"quality\","));
    ck_assert_ptr_nonnull(strstr(text, "\"progress\":0.925,"));
    free(text);
}
END_TEST

START_TEST(losses_are_thinned_and_the_newest_kept)
{
    struct progress_report report;
    progress_report_init(&report, NULL);
    for (uint64_t i = 0; i < 100000; i++)
        report.callbacks.loss(report.callbacks.user, "total", i, 1);
    ck_assert_uint_le(report.n_losses, PROGRESS_MAX_LOSSES);
    ck_assert_uint_gt(report.n_losses, PROGRESS_MAX_LOSSES / 4);
    ck_assert_uint_eq(report.losses[report.n_losses - 1].iteration, 99999);
    ck_assert_uint_eq(report.losses[0].iteration, 0);
}
END_TEST

START_TEST(a_checkpoint_that_does_not_fit_is_passed_over)
{
    char path[] = "/tmp/checkpoint_XXXXXX";
    int fd = mkstemp(path);
    struct work_link link;
    struct order_blob name = {.sha256 = ABC_SHA256, .n_bytes = 3};
    struct groom_fit *fit = small_fit();
    struct groom_fit_progress progress;
    ck_assert_int_eq(write(fd, "abc", 3), 3);
    close(fd);
    snprintf(name.path, sizeof name.path, "%s", path);
    ck_assert(work_link_open(&link, "http://127.0.0.1:9", "t", &no_stop));
    ck_ok(checkpoints_load(fit, &name, &link, NULL, NULL));
    groom_fit_progress(fit, &progress);
    ck_assert(progress.fraction == 0);
    ck_assert_uint_eq(checkpoints_stage(fit), 0);
    groom_fit_destroy(fit);
    work_link_close(&link);
    unlink(path);
}
END_TEST

/* --- command lines and problems ---------------------------------------------------------------- */

START_TEST(counts_are_whole_numbers_in_range)
{
    unsigned long long value;
    ck_ok(worker_count_parse("--count", "12", 100, &value, NULL));
    ck_assert_uint_eq(value, 12);
    ck_ok(worker_count_parse("--count", NULL, 100, &value, NULL));
    ck_assert_uint_eq(value, 0);
    ck_status(worker_count_parse("--count", "-1", 100, &value, NULL), GROOM_EINVAL);
    ck_status(worker_count_parse("--count", "1x", 100, &value, NULL), GROOM_EINVAL);
    ck_status(worker_count_parse("--count", "101", 100, &value, NULL), GROOM_EINVAL);
}
END_TEST

START_TEST(problem_carries_offset_and_pointer)
{
    struct groom_diag diag;
    ck_status(groom_fail_at(&diag, GROOM_ETRUNCATED, 128, "cut"), GROOM_ETRUNCATED);
    char *text = worker_problem_text(GROOM_ETRUNCATED, &diag);
    ck_assert_ptr_nonnull(strstr(text, "\"byte_offset\":128"));
    ck_assert_ptr_nonnull(strstr(text, "truncated-file"));
    free(text);
    text =
        worker_problem_text(GROOM_ENOMEM, &diag); /* a diag of another failure is not taken for this one's */
    ck_assert_ptr_null(strstr(text, "cut"));
    free(text);
}
END_TEST

static void *nothing(void *argument) { return argument; }

START_TEST(sandbox_leaves_threads_and_memory_and_no_way_out)
{
    char *const no_words[] = {NULL};
    pthread_t thread;
    worker_enter_sandbox();
    ck_assert_int_eq(socket(AF_INET, SOCK_STREAM, 0), -1);
    ck_assert_int_eq(errno, EPERM);
    ck_assert_int_eq(execve("/bin/true", no_words, no_words), -1);
    ck_assert_int_eq(errno, EPERM);
    ck_assert_int_eq(unlink("/tmp/nothing"), -1);
    ck_assert_int_eq(errno, EPERM);
    ck_assert_int_eq(pthread_create(&thread, NULL, nothing, NULL), 0);
    pthread_join(thread, NULL);
    void *memory = malloc(64 << 20);
    ck_assert_ptr_nonnull(memory);
    free(memory);
}
END_TEST

START_TEST(input_is_read_whole_from_a_pipe_within_its_limit)
{
    int ends[2];
    char *text;
    size_t n;
    struct worker_input input;
    for (int i = 0; i < 2; i++) {
        ck_assert_int_eq(pipe(ends), 0);
        ck_assert_int_eq(write(ends[1], "hello", 5), 5);
        close(ends[1]);
        worker_input_open(ends[0], &input);
        if (i)
            ck_status(worker_input_text(&input, 4, &text, &n, NULL), GROOM_ETOOBIG);
        else
            ck_ok(worker_input_text(&input, 5, &text, &n, NULL));
        if (!i) {
            ck_assert_str_eq(text, "hello");
            free(text);
        }
        worker_input_close(&input);
        close(ends[0]);
    }
}
END_TEST

TEST_SUITE("worker", order_reads_inputs_options_and_checkpoint, order_refuses_what_is_not_one,
           link_repeats_what_passes, link_leaves_quietly_when_fenced, link_tells_a_refusal_with_its_detail,
           link_stops_waiting_when_the_process_is_to_end, blob_is_verified_and_a_broken_line_taken_up_again,
           blob_of_other_bytes_is_refused, blob_comes_from_a_shared_folder_where_there_is_one,
           counts_are_whole_numbers_in_range, problem_carries_offset_and_pointer,
           sandbox_leaves_threads_and_memory_and_no_way_out, progress_is_told_from_the_fit_and_its_report,
           losses_are_thinned_and_the_newest_kept, a_checkpoint_that_does_not_fit_is_passed_over,
           input_is_read_whole_from_a_pipe_within_its_limit)
