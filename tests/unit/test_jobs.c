/* The queue: submitting, watching, the worker protocol, and a supervisor over shell scripts that play
 * the worker: they write their token to a file, and the test speaks for them. */
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "server/jobs/supervisor.h"
#include "server/jobs/work.h"
#include "tests/support/folder.h"
#include "tests/support/test.h"

static struct groom_diag diag;

static void nap(int ms)
{
    struct timespec time = {ms / 1000, ms % 1000 * 1000000L};
    nanosleep(&time, NULL);
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* --- a daemon without HTTP --------------------------------------------------------------- */

static struct store *store;
static struct blobs *blobs;
static struct jobs *jobs;
static struct launcher *launcher;
static struct supervisor *supervisor;

static void open_daemon(void)
{
    ck_ok(store_open(test_folder_path("groomd.db"), &store, &diag));
    ck_ok(blobs_open(test_folder_path("blobs"), NULL, &blobs, &diag));
    ck_ok(jobs_create(store, blobs, &jobs, &diag));
    ck_ok(launch_local_create(&launcher, &diag));
}

static void close_daemon(void)
{
    supervisor_destroy(supervisor);
    supervisor = NULL;
    launch_destroy(launcher);
    jobs_destroy(jobs);
    blobs_close(blobs);
    store_close(store);
}

static void begin(void)
{
    test_folder_make();
    open_daemon();
}

static void end(void)
{
    close_daemon();
    test_folder_remove();
}

/* The worker is this script; $D is the test's folder. */
static void supervise(const char *script, struct supervisor_options options)
{
    static char folder[512], log_folder[512];
    static const char *argv[4], *env[2];
    snprintf(folder, sizeof folder, "D=%s", test_folder_path(""));
    snprintf(log_folder, sizeof log_folder, "%s", test_folder_path("logs"));
    argv[0] = "/bin/sh";
    argv[1] = "-c";
    argv[2] = script;
    argv[3] = NULL;
    env[0] = folder;
    env[1] = NULL;
    options.worker_argv = argv;
    options.worker_env = env;
    options.launcher = launcher;
    options.work_url = "http://127.0.0.1:1";
    options.log_folder = log_folder;
    ck_ok(supervisor_start(jobs, &options, &supervisor, &diag));
}

static const struct supervisor_options quick = {.n_slots = 1, .backoff_ms = 20, .cancel_grace_ms = 100};

/* Says its token and waits. */
#define SAY_TOKEN "echo $GROOM_WORK_TOKEN >> $D/tokens; "
#define WAITER    SAY_TOKEN "exec sleep 60"

static void submit(char id[STORE_ID_SIZE])
{
    struct jobs_request request = {.kind = "fit", .inputs = "{\"strands\":\"str_a\"}", .options = "{\"seed\":1}"};
    struct store_job job;
    ck_ok(jobs_submit(jobs, &request, &job, &diag));
    memcpy(id, job.id, STORE_ID_SIZE);
    store_job_finish(&job);
}

static struct store_job get(const char *id)
{
    struct store_job job;
    ck_ok(jobs_get(jobs, id, &job, &diag));
    return job;
}

static enum store_job_state state_of(const char *id)
{
    struct store_job job = get(id);
    enum store_job_state state = job.state;
    store_job_finish(&job);
    return state;
}

static void wait_state(const char *id, enum store_job_state state)
{
    for (int i = 0; i < 4000 && state_of(id) != state; i++)
        nap(5);
    ck_assert_str_eq(store_job_state_name(state_of(id)), store_job_state_name(state));
}

/* The token of the next attempt that has begun. */
static int n_tokens_read;

static void wait_token(char token[WORK_TOKEN_SIZE])
{
    const long line = WORK_TOKEN_SIZE; /* 64 digits and the end of the line */
    for (int i = 0; i < 4000; i++) {
        FILE *file = fopen(test_folder_path("tokens"), "r");
        bool read = file && fseek(file, n_tokens_read * line, SEEK_SET) == 0 &&
                    fread(token, 1, (size_t)line, file) == (size_t)line;
        if (file)
            fclose(file);
        if (read) {
            token[line - 1] = 0;
            n_tokens_read++;
            return;
        }
        nap(5);
    }
    ck_abort_msg("no worker was launched");
}

static struct store_attempt_ref wait_attempt(void)
{
    char token[WORK_TOKEN_SIZE];
    struct store_attempt_ref ref;
    wait_token(token);
    ck_ok(work_authenticate(jobs, token, &ref, &diag));
    return ref;
}

static groom_status progress(const struct store_attempt_ref *ref, const char *body, bool *cancel)
{
    return work_progress(jobs, ref, body, strlen(body), cancel, &diag);
}

static groom_status succeed(const struct store_attempt_ref *ref, const char *groom_id)
{
    struct store_revision_new groom = {.groom_id = groom_id, .name = "", .document = "{}", .note = "fit"};
    return work_result(jobs, ref, &groom, &diag);
}

static void checkpoint(const struct store_attempt_ref *ref, const char *text, uint32_t stage,
                       char sha256[BLOBS_HASH_SIZE])
{
    struct blobs_writer *writer;
    ck_ok(blobs_begin(blobs, 0, &writer, &diag));
    ck_ok(blobs_write(writer, text, strlen(text), &diag));
    ck_ok(blobs_commit(writer, NULL, sha256, &diag));
    ck_ok(work_checkpoint(jobs, ref, sha256, strlen(text), stage, &diag));
}

static bool blob_is_there(const char *sha256)
{
    uint64_t n;
    int fd;
    if (blobs_read(blobs, sha256, &fd, &n, &diag) != GROOM_OK)
        return false;
    close(fd);
    return true;
}

/* Takes a job without a supervisor. */
static struct store_attempt_ref take(char token[WORK_TOKEN_SIZE])
{
    char hash[STORE_HASH_SIZE];
    struct store_attempt_ref ref;
    bool taken = false;
    int64_t next;
    ck_ok(work_token_make(token, hash));
    ck_ok(store_job_take(store, hash, &ref, &taken, &next, &diag));
    ck_assert(taken);
    return ref;
}

/* --- submitting ------------------------------------------------------------------------------ */

START_TEST(a_job_reads_as_the_contract_names_it)
{
    begin();
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE];
    bool cancel;
    submit(id);
    struct store_job job = get(id);
    cJSON *json = jobs_json(&job);
    static const char *const names[] = {"id", "kind", "state", "queue_position", "stage", "progress", "eta_s",
                                        "attempt", "loss", "options", "result", "error", "created_at",
                                        "started_at", "finished_at", "strands"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        ck_assert_msg(cJSON_GetObjectItemCaseSensitive(json, names[i]) != NULL, "%s is missing", names[i]);
    ck_assert_str_eq(cJSON_GetObjectItem(json, "state")->valuestring, "queued");
    ck_assert_int_eq(cJSON_GetObjectItem(json, "queue_position")->valueint, 0);
    ck_assert(cJSON_IsNull(cJSON_GetObjectItem(json, "stage")));
    ck_assert(cJSON_IsNull(cJSON_GetObjectItem(json, "started_at")));
    cJSON_Delete(json);
    store_job_finish(&job);
    struct store_attempt_ref ref = take(token);
    ck_ok(progress(&ref, "{\"stage\":{\"name\":\"initialize\",\"index\":0,\"count\":5},\"progress\":0.5}", &cancel));
    job = get(id);
    json = jobs_json(&job);
    ck_assert(cJSON_IsNull(cJSON_GetObjectItem(json, "queue_position")));
    ck_assert_int_eq(cJSON_GetObjectItem(cJSON_GetObjectItem(json, "stage"), "count")->valueint, 5);
    ck_assert(cJSON_IsNull(cJSON_GetObjectItem(json, "eta_s")));
    ck_assert_int_eq((int)strlen(cJSON_GetObjectItem(json, "started_at")->valuestring), 24);
    cJSON_Delete(json);
    store_job_finish(&job);
    end();
}
END_TEST

/* --- the worker protocol -------------------------------------------------------------------------- */

START_TEST(an_attempt_is_told_its_job_its_inputs_and_its_checkpoint)
{
    begin();
    char token[WORK_TOKEN_SIZE], hash[BLOBS_HASH_SIZE], *text;
    struct store_asset asset = {.kind = STORE_STRANDS, .n_bytes = 7, .format = (char *)"hair", .unit_m = 0.01, .up = 'z'};
    memset(asset.sha256, 'a', 64);
    store_asset_id(NULL, STORE_STRANDS, asset.sha256, "", 0.01, 'z', asset.id);
    ck_ok(store_asset_put(store, &asset, 0, NULL, &diag));
    char request[64];
    snprintf(request, sizeof request, "{\"strands\":\"%s\"}", asset.id);
    struct jobs_request submitted = {.kind = "fit", .inputs = request, .options = "{\"seed\":7}"};
    struct store_job job;
    ck_ok(jobs_submit(jobs, &submitted, &job, &diag));
    store_job_finish(&job);
    struct store_attempt_ref ref = take(token);
    checkpoint(&ref, "half", 2, hash);
    ck_ok(work_describe(jobs, &ref, &text, &diag));
    cJSON *json = cJSON_Parse(text);
    free(text);
    cJSON *strands = cJSON_GetObjectItem(cJSON_GetObjectItem(json, "inputs"), "strands");
    ck_assert_str_eq(cJSON_GetObjectItem(json, "kind")->valuestring, "fit");
    ck_assert_int_eq(cJSON_GetObjectItem(json, "attempt")->valueint, 1);
    ck_assert_int_eq(cJSON_GetObjectItem(cJSON_GetObjectItem(json, "options"), "seed")->valueint, 7);
    ck_assert_str_eq(cJSON_GetObjectItem(strands, "sha256")->valuestring, asset.sha256);
    ck_assert_str_eq(cJSON_GetObjectItem(strands, "up")->valuestring, "z");
    ck_assert_double_eq(cJSON_GetObjectItem(strands, "unit_m")->valuedouble, 0.01);
    ck_assert_ptr_null(cJSON_GetObjectItem(cJSON_GetObjectItem(json, "inputs"), "head"));
    ck_assert_str_eq(cJSON_GetObjectItem(cJSON_GetObjectItem(json, "checkpoint"), "sha256")->valuestring, hash);
    ck_assert_int_eq(cJSON_GetObjectItem(cJSON_GetObjectItem(json, "checkpoint"), "stage")->valueint, 2);
    cJSON_Delete(json);
    ck_ok(work_may_read(jobs, &ref, asset.sha256, &diag));
    ck_ok(work_may_read(jobs, &ref, hash, &diag));
    asset.sha256[0] = 'b';
    ck_status(work_may_read(jobs, &ref, asset.sha256, &diag), GROOM_ENOTFOUND);
    end();
}
END_TEST

START_TEST(progress_leaves_events_and_losses)
{
    begin();
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE], *text;
    bool cancel = true;
    submit(id);
    struct store_attempt_ref ref = take(token);
    const char *body = "{\"stage\":{\"name\":\"guides\",\"index\":2,\"count\":5},\"progress\":0.25,\"eta_s\":12,"
                       "\"losses\":[{\"iteration\":0,\"name\":\"chamfer\",\"value\":2},"
                       "{\"iteration\":1,\"name\":\"chamfer\",\"value\":1.5}]}";
    ck_ok(progress(&ref, body, &cancel));
    ck_assert(!cancel);
    ck_ok(progress(&ref, "{\"stage\":{\"name\":\"guides\",\"index\":2,\"count\":5},\"progress\":0.5,"
                         "\"losses\":[{\"iteration\":2,\"name\":\"length\",\"value\":3}]}", &cancel));
    ck_ok(progress(&ref, "{}", &cancel)); /* a sign of life leaves nothing */
    struct store_event_list events;
    ck_ok(jobs_events_since(jobs, id, 2, 0, &events, &diag));
    static const char *const types[] = {"stage", "progress", "loss", "progress", "loss"};
    ck_assert_uint_eq(events.n, 5);
    for (size_t i = 0; i < 5; i++)
        ck_assert_str_eq(events.items[i].type, types[i]);
    ck_assert_str_eq(events.items[1].data, "{\"stage\":\"guides\",\"progress\":0.25,\"eta_s\":12}");
    store_event_list_finish(&events);
    struct store_job job = get(id);
    ck_assert_str_eq(job.loss, "{\"chamfer\":1.5,\"length\":3}");
    ck_assert_double_eq(job.progress, 0.5);
    store_job_finish(&job);
    ck_ok(jobs_losses_json(jobs, id, &text, &diag));
    ck_assert_str_eq(text, "{\"guides\":[{\"iteration\":0,\"name\":\"chamfer\",\"value\":2},"
                           "{\"iteration\":1,\"name\":\"chamfer\",\"value\":1.5},"
                           "{\"iteration\":2,\"name\":\"length\",\"value\":3}]}");
    free(text);
    end();
}
END_TEST

START_TEST(a_progress_message_that_is_wrong_is_refused_by_its_field)
{
    begin();
    static const struct {
        const char *body, *pointer;
    } wrong[] = {
        {"", ""}, {"[]", ""}, {"{\"progress\":", ""},
        {"{\"progress\":1.5}", "/progress"}, {"{\"progress\":\"x\"}", "/progress"},
        {"{\"eta_s\":-1}", "/eta_s"},
        {"{\"stage\":{\"name\":\"\",\"index\":0,\"count\":1}}", "/stage/name"},
        {"{\"stage\":{\"name\":\"a\",\"index\":-1,\"count\":1}}", "/stage/index"},
        {"{\"stage\":{\"name\":\"a\",\"index\":0}}", "/stage/count"},
        {"{\"losses\":{}}", "/losses"}, {"{\"losses\":[{\"iteration\":0,\"name\":\"a\",\"value\":1e999}]}", ""},
        {"{\"losses\":[{\"iteration\":0,\"value\":1}]}", "/losses"},
    };
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE];
    bool cancel;
    submit(id);
    struct store_attempt_ref ref = take(token);
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        ck_status(progress(&ref, wrong[i].body, &cancel), GROOM_EINVAL);
        ck_assert_str_eq(diag.pointer, wrong[i].pointer);
    }
    end();
}
END_TEST

START_TEST(a_checkpoint_takes_the_place_of_the_one_before)
{
    begin();
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE], first[BLOBS_HASH_SIZE], second[BLOBS_HASH_SIZE];
    submit(id);
    struct store_attempt_ref ref = take(token);
    checkpoint(&ref, "one", 1, first);
    ck_assert(blob_is_there(first));
    checkpoint(&ref, "two", 2, second);
    ck_assert(!blob_is_there(first));
    ck_assert(blob_is_there(second));
    ck_ok(succeed(&ref, "grm_a"));
    ck_assert(!blob_is_there(second)); /* a job that is over needs none */
    end();
}
END_TEST

START_TEST(checkpoints_of_two_jobs_with_the_same_bytes_are_kept_for_both)
{
    begin();
    char a[STORE_ID_SIZE], b[STORE_ID_SIZE], token[WORK_TOKEN_SIZE], hash[BLOBS_HASH_SIZE];
    submit(a);
    submit(b);
    struct store_attempt_ref first = take(token), second = take(token);
    checkpoint(&first, "same", 1, hash);
    checkpoint(&second, "same", 1, hash);
    ck_ok(succeed(&first, "grm_a"));
    ck_assert(blob_is_there(hash));
    ck_ok(succeed(&second, "grm_b"));
    ck_assert(!blob_is_there(hash));
    end();
}
END_TEST

START_TEST(a_result_is_taken_once)
{
    begin();
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE], hash[BLOBS_HASH_SIZE];
    struct store_attempt_ref found;
    bool cancel;
    submit(id);
    struct store_attempt_ref ref = take(token);
    ck_ok(succeed(&ref, "grm_a"));
    ck_status(succeed(&ref, "grm_b"), GROOM_ECONFLICT);
    ck_status(work_authenticate(jobs, token, &found, &diag), GROOM_ECONFLICT);
    ck_status(work_authenticate(jobs, "guessed", &found, &diag), GROOM_ENOTFOUND);
    ck_status(progress(&ref, "{}", &cancel), GROOM_ECONFLICT);
    struct blobs_writer *writer;
    ck_ok(blobs_begin(blobs, 0, &writer, &diag));
    ck_ok(blobs_commit(writer, NULL, hash, &diag));
    ck_status(work_checkpoint(jobs, &ref, hash, 0, 1, &diag), GROOM_ECONFLICT);
    ck_assert(!blob_is_there(hash)); /* refused, and not left lying about */
    struct store_job job = get(id);
    ck_assert_str_eq(job.result, "{\"groom\":\"grm_a\",\"revision\":1}");
    store_job_finish(&job);
    struct store_groom_list grooms;
    ck_ok(store_grooms_list(store, NULL, (struct store_page){0}, &grooms, &diag));
    ck_assert_uint_eq(grooms.n, 1);
    store_groom_list_finish(&grooms);
    end();
}
END_TEST

START_TEST(a_job_that_cannot_be_done_fails_at_once_with_its_problem)
{
    begin();
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE];
    const char *problem = "{\"type\":\"/problems/degenerate\",\"title\":\"bald\",\"status\":422,\"detail\":\"no strands are left\"}";
    submit(id);
    struct store_attempt_ref ref = take(token);
    ck_status(work_failed(jobs, &ref, "{}", 2, &diag), GROOM_EINVAL);
    ck_status(work_failed(jobs, &ref, "no", 2, &diag), GROOM_EINVAL);
    ck_ok(work_failed(jobs, &ref, problem, strlen(problem), &diag));
    struct store_job job = get(id);
    ck_assert_int_eq(job.state, STORE_JOB_FAILED);
    ck_assert_str_eq(job.error, problem);
    store_job_finish(&job);
    ck_status(work_failed(jobs, &ref, problem, strlen(problem), &diag), GROOM_ECONFLICT);
    end();
}
END_TEST

/* --- watching ---------------------------------------------------------------------------------------- */

static void count_up(void *user) { __atomic_fetch_add((int *)user, 1, __ATOMIC_RELAXED); }

START_TEST(a_watch_is_woken_by_its_job_alone)
{
    begin();
    char a[STORE_ID_SIZE], b[STORE_ID_SIZE], token[WORK_TOKEN_SIZE];
    struct jobs_watch *watch;
    struct store_job job;
    int n_woken = 0;
    bool cancel;
    submit(a);
    submit(b);
    ck_ok(jobs_watch(jobs, a, count_up, &n_woken, &watch));
    ck_assert_uint_eq(jobs_watching(jobs), 1);
    ck_ok(jobs_cancel(jobs, b, &job, &diag));
    store_job_finish(&job);
    ck_assert_int_eq(n_woken, 0);
    struct store_attempt_ref ref = take(token);
    ck_ok(progress(&ref, "{\"progress\":0.1}", &cancel));
    ck_assert_int_eq(n_woken, 1);
    ck_ok(progress(&ref, "{}", &cancel));
    ck_assert_int_eq(n_woken, 1);
    ck_ok(succeed(&ref, "grm_a"));
    ck_assert_int_eq(n_woken, 2);
    jobs_wake_all(jobs);
    ck_assert_int_eq(n_woken, 3);
    jobs_unwatch(jobs, watch);
    jobs_unwatch(jobs, NULL);
    jobs_wake_all(jobs);
    ck_assert_int_eq(n_woken, 3);
    end();
}
END_TEST

/* --- cancelling ------------------------------------------------------------------------------------------ */

START_TEST(a_queued_job_is_cancelled_at_once_and_an_ended_one_stays)
{
    begin();
    char id[STORE_ID_SIZE];
    struct store_job job;
    submit(id);
    ck_ok(jobs_cancel(jobs, id, &job, &diag));
    ck_assert_int_eq(job.state, STORE_JOB_CANCELLED);
    store_job_finish(&job);
    ck_ok(jobs_cancel(jobs, id, &job, &diag));
    ck_assert_int_eq(job.state, STORE_JOB_CANCELLED);
    store_job_finish(&job);
    ck_status(jobs_cancel(jobs, "job_none", &job, &diag), GROOM_ENOTFOUND);
    end();
}
END_TEST

START_TEST(a_worker_hears_of_the_cancellation_and_may_not_succeed)
{
    begin();
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE];
    struct store_job job;
    bool cancel = false;
    submit(id);
    struct store_attempt_ref ref = take(token);
    ck_ok(jobs_cancel(jobs, id, &job, &diag));
    ck_assert_int_eq(job.state, STORE_JOB_RUNNING);
    ck_assert(job.cancel_requested);
    store_job_finish(&job);
    ck_ok(progress(&ref, "{}", &cancel));
    ck_assert(cancel);
    ck_status(succeed(&ref, "grm_a"), GROOM_ECANCELLED);
    const char *problem = "{\"type\":\"cancelled\",\"detail\":\"told to\"}";
    ck_status(work_failed(jobs, &ref, problem, strlen(problem), &diag), GROOM_ECANCELLED);
    ck_assert_int_eq(state_of(id), STORE_JOB_RUNNING);
    end();
}
END_TEST

/* --- the supervisor -------------------------------------------------------------------------------------------- */

START_TEST(a_worker_that_hands_in_its_result_has_done_the_job)
{
    begin();
    char id[STORE_ID_SIZE];
    supervise(WAITER, quick);
    submit(id);
    struct store_attempt_ref ref = wait_attempt();
    ck_assert_str_eq(ref.job_id, id);
    ck_assert_int_eq(state_of(id), STORE_JOB_RUNNING);
    ck_ok(succeed(&ref, "grm_a"));
    ck_assert_int_eq(state_of(id), STORE_JOB_SUCCEEDED);
    /* it does not exit by itself: its slot is freed all the same */
    submit(id);
    wait_attempt();
    struct supervisor_counts counts;
    supervisor_count(supervisor, &counts);
    ck_assert_uint_eq(counts.n_launched, 2);
    ck_assert_uint_eq(counts.n_died, 0);
    ck_assert_uint_eq(counts.n_running, 1);
    end();
}
END_TEST

START_TEST(a_worker_that_dies_is_followed_by_another_from_its_checkpoint)
{
    begin();
    char id[STORE_ID_SIZE], hash[BLOBS_HASH_SIZE], token[WORK_TOKEN_SIZE], *text;
    struct store_attempt_ref second, stale;
    bool cancel;
    struct store_asset asset = {.id = "str_a", .kind = STORE_STRANDS, .unit_m = 1, .up = 'y'};
    ck_ok(store_asset_put(store, &asset, 0, NULL, &diag));
    supervise(SAY_TOKEN "[ -e $D/once ] && exec sleep 60; touch $D/once; while [ ! -e $D/die ]; do sleep 0.01; done;"
              " kill -9 $$", quick);
    submit(id);
    wait_token(token);
    ck_ok(work_authenticate(jobs, token, &stale, &diag));
    checkpoint(&stale, "half", 1, hash);
    fclose(fopen(test_folder_path("die"), "w"));
    second = wait_attempt();
    ck_assert_uint_eq(second.number, 2);
    /* the first one's token opens nothing any more */
    ck_status(work_authenticate(jobs, token, &second, &diag), GROOM_ECONFLICT);
    ck_status(progress(&stale, "{}", &cancel), GROOM_ECONFLICT);
    ck_status(succeed(&stale, "grm_stale"), GROOM_ECONFLICT);
    ck_ok(work_describe(jobs, &second, &text, &diag));
    ck_assert_ptr_nonnull(strstr(text, hash));
    free(text);
    struct store_job job = get(id);
    ck_assert_uint_eq(job.n_failures, 1);
    store_job_finish(&job);
    checkpoint(&second, "half", 1, hash); /* where it was: that is no progress */
    job = get(id);
    ck_assert_uint_eq(job.n_failures, 1);
    store_job_finish(&job);
    checkpoint(&second, "more", 2, hash);
    job = get(id);
    ck_assert_uint_eq(job.n_failures, 0);
    store_job_finish(&job);
    ck_ok(succeed(&second, "grm_a"));
    struct store_attempt_list attempts;
    ck_ok(store_attempts_list(store, id, &attempts, &diag));
    ck_assert_uint_eq(attempts.n, 2);
    ck_assert_int_eq(attempts.items[0].state, STORE_ATTEMPT_DIED);
    ck_assert_str_eq(attempts.items[0].last_words, "signal 9 (Killed)");
    ck_assert_int_eq(attempts.items[1].state, STORE_ATTEMPT_SUCCEEDED);
    store_attempt_list_finish(&attempts);
    end();
}
END_TEST

START_TEST(a_poison_job_fails_with_its_history_and_last_words)
{
    begin();
    char id[STORE_ID_SIZE];
    supervise("echo going down >&2; exit 7", quick);
    submit(id);
    wait_state(id, STORE_JOB_FAILED);
    struct store_job job = get(id);
    cJSON *error = cJSON_Parse(job.error);
    ck_assert_uint_eq(job.attempt, 3);
    ck_assert_uint_eq(job.n_failures, 3);
    ck_assert_str_eq(cJSON_GetObjectItem(error, "type")->valuestring, "/problems/worker-died");
    ck_assert_str_eq(cJSON_GetObjectItem(error, "detail")->valuestring,
                     "3 attempts died without getting further; the last one ended with exit status 7");
    cJSON *attempts = cJSON_GetObjectItem(error, "attempts");
    ck_assert_int_eq(cJSON_GetArraySize(attempts), 3);
    for (int i = 0; i < 3; i++) {
        cJSON *attempt = cJSON_GetArrayItem(attempts, i);
        ck_assert_str_eq(cJSON_GetObjectItem(attempt, "state")->valuestring, "died");
        ck_assert_str_eq(cJSON_GetObjectItem(attempt, "last_words")->valuestring, "exit status 7\ngoing down\n");
    }
    cJSON_Delete(error);
    store_job_finish(&job);
    /* each waited twice as long as the one before */
    struct store_attempt_list rows;
    ck_ok(store_attempts_list(store, id, &rows, &diag));
    for (uint32_t i = 1; i < 3; i++)
        ck_assert_int_ge(rows.items[i].started_ms - rows.items[i - 1].finished_ms, (int)(quick.backoff_ms << (i - 1)));
    store_attempt_list_finish(&rows);
    struct supervisor_counts counts;
    supervisor_drain(supervisor, 1000); /* it counts after it has written */
    supervisor_count(supervisor, &counts);
    ck_assert_uint_eq(counts.n_died, 3);
    end();
}
END_TEST

/* Its only attempt, and the error of the job. */
static cJSON *fail_for_lack_of_time(const char *script, struct supervisor_options options)
{
    char id[STORE_ID_SIZE];
    supervise(script, options);
    submit(id);
    wait_state(id, STORE_JOB_FAILED);
    struct store_job job = get(id);
    cJSON *error = cJSON_Parse(job.error);
    ck_assert_uint_eq(job.attempt, 1);
    ck_assert_str_eq(cJSON_GetObjectItem(error, "type")->valuestring, "/problems/time-limit");
    ck_assert_int_eq(cJSON_GetArraySize(cJSON_GetObjectItem(error, "attempts")), 1);
    store_job_finish(&job);
    return error;
}

START_TEST(a_job_out_of_processor_time_fails_at_once)
{
    begin();
    struct supervisor_options options = quick;
    options.limits.cpu_s = 1;
    cJSON *error = fail_for_lack_of_time("while :; do :; done", options);
    ck_assert_ptr_nonnull(strstr(cJSON_GetObjectItem(error, "detail")->valuestring, "1 s of processor time (--job-time)"));
    cJSON_Delete(error);
    end();
}
END_TEST

/* It uses no processor time at all, and hears SIGTERM first: its last words are kept. */
START_TEST(a_job_out_of_time_by_the_clock_fails_at_once)
{
    begin();
    struct supervisor_options options = quick;
    options.wall_s = 1;
    cJSON *error = fail_for_lack_of_time("trap 'echo was told; exit 75' TERM; while :; do sleep 0.05; done", options);
    ck_assert_ptr_nonnull(strstr(cJSON_GetObjectItem(error, "detail")->valuestring, "1 s of time (--job-wall)"));
    const cJSON *attempt = cJSON_GetArrayItem(cJSON_GetObjectItem(error, "attempts"), 0);
    const char *words = cJSON_GetObjectItem(attempt, "last_words")->valuestring;
    ck_assert(!strncmp(words, "exit status 75\n", 15) && strstr(words, "was told\n"));
    cJSON_Delete(error);
    end();
}
END_TEST

/* Nobody here did that: as far as the queue knows it has died, and the next one goes on. */
START_TEST(a_worker_that_others_stop_is_followed_by_another)
{
    begin();
    char id[STORE_ID_SIZE];
    supervise(SAY_TOKEN "[ -e $D/once ] && exec sleep 60; touch $D/once; exit 75", quick);
    submit(id);
    wait_attempt();
    ck_assert_uint_eq(wait_attempt().number, 2);
    struct store_job job = get(id);
    ck_assert_int_eq(job.state, STORE_JOB_RUNNING);
    ck_assert_uint_eq(job.n_failures, 1);
    store_job_finish(&job);
    end();
}
END_TEST

START_TEST(a_worker_that_cannot_be_started_counts_as_dead)
{
    begin();
    char id[STORE_ID_SIZE];
    static const char *const argv[] = {"/nonexistent/groom-worker", "attempt", NULL};
    struct supervisor_options options = quick;
    options.worker_argv = argv;
    options.launcher = launcher;
    options.work_url = "http://127.0.0.1:1";
    options.log_folder = test_folder_path("logs");
    options.max_deaths = 2;
    ck_ok(supervisor_start(jobs, &options, &supervisor, &diag));
    submit(id);
    wait_state(id, STORE_JOB_FAILED);
    struct store_job job = get(id);
    ck_assert_ptr_nonnull(strstr(job.error, "/nonexistent/groom-worker"));
    store_job_finish(&job);
    end();
}
END_TEST

static void *cancel_soon(void *user)
{
    struct store_job job;
    if (jobs_cancel(jobs, user, &job, NULL) == GROOM_OK)
        store_job_finish(&job);
    return NULL;
}

/* Neither a hint nor SIGTERM moves this worker. */
START_TEST(a_cancelled_worker_is_really_stopped)
{
    begin();
    char id[STORE_ID_SIZE];
    pthread_t thread;
    supervise("trap '' TERM; echo $$ > $D/pid; " SAY_TOKEN "while :; do sleep 0.05; done", quick);
    submit(id);
    wait_attempt();
    double start = seconds();
    ck_assert_int_eq(pthread_create(&thread, NULL, cancel_soon, id), 0);
    wait_state(id, STORE_JOB_CANCELLED);
    ck_assert_double_lt(seconds() - start, 30);
    pthread_join(thread, NULL);
    FILE *file = fopen(test_folder_path("pid"), "r");
    int pid = 0;
    ck_assert_int_eq(fscanf(file, "%d", &pid), 1);
    fclose(file);
    ck_assert_int_ne(kill(pid, 0), 0);
    struct store_attempt_list attempts;
    ck_ok(store_attempts_list(store, id, &attempts, &diag));
    ck_assert_int_eq(attempts.items[0].state, STORE_ATTEMPT_CANCELLED);
    store_attempt_list_finish(&attempts);
    end();
}
END_TEST

START_TEST(slots_work_side_by_side_and_no_more_than_there_are)
{
    begin();
    char ids[5][STORE_ID_SIZE];
    struct supervisor_options options = quick;
    options.n_slots = 2;
    supervise(WAITER, options);
    for (int i = 0; i < 5; i++)
        submit(ids[i]);
    struct store_attempt_ref a = wait_attempt(), b = wait_attempt();
    nap(100);
    struct supervisor_counts counts;
    supervisor_count(supervisor, &counts);
    ck_assert_uint_eq(counts.n_running, 2);
    ck_ok(succeed(&a, "grm_a"));
    ck_ok(succeed(&b, "grm_b"));
    wait_attempt();
    wait_attempt();
    ck_assert_int_eq(state_of(ids[4]), STORE_JOB_QUEUED);
    end();
}
END_TEST

START_TEST(draining_gives_the_jobs_back_without_a_mark)
{
    begin();
    char id[STORE_ID_SIZE];
    supervise(WAITER, quick);
    submit(id);
    wait_attempt();
    supervisor_drain(supervisor, 1000);
    supervisor_drain(supervisor, 1000);
    struct store_job job = get(id);
    ck_assert_int_eq(job.state, STORE_JOB_QUEUED);
    ck_assert_uint_eq(job.n_failures, 0);
    ck_assert_int_eq(job.queue_position, 0);
    store_job_finish(&job);
    /* and the next daemon goes on with it */
    close_daemon();
    open_daemon();
    supervise(WAITER, quick);
    ck_assert_uint_eq(wait_attempt().number, 2);
    end();
}
END_TEST

/* A daemon in a process of its own is killed in the middle; the next one goes on from the checkpoint. */
START_TEST(a_killed_daemon_loses_nothing)
{
    begin();
    char id[STORE_ID_SIZE], hash[BLOBS_HASH_SIZE];
    struct store_attempt_ref ref;
    close_daemon();
    int ends[2];
    ck_assert_int_eq(pipe(ends), 0);
    pid_t daemon_pid = fork();
    if (daemon_pid == 0) {
        open_daemon();
        supervise(WAITER, quick);
        submit(id);
        ref = wait_attempt();
        checkpoint(&ref, "half", 1, hash);
        if (write(ends[1], id, sizeof id) == (ssize_t)sizeof id &&
            write(ends[1], hash, sizeof hash) == (ssize_t)sizeof hash)
            pause();
        _exit(1);
    }
    ck_assert_int_eq(read(ends[0], id, sizeof id), sizeof id);
    ck_assert_int_eq(read(ends[0], hash, sizeof hash), sizeof hash);
    kill(daemon_pid, SIGKILL);
    waitpid(daemon_pid, NULL, 0);
    n_tokens_read = 1;
    open_daemon();
    ck_assert_int_eq(state_of(id), STORE_JOB_RUNNING); /* as it was left */
    supervise(WAITER, quick);
    ref = wait_attempt();
    ck_assert_str_eq(ref.job_id, id);
    ck_assert_uint_eq(ref.number, 2);
    ck_assert(blob_is_there(hash));
    struct store_attempt_list attempts;
    ck_ok(store_attempts_list(store, id, &attempts, &diag));
    ck_assert_int_eq(attempts.items[0].state, STORE_ATTEMPT_STOPPED);
    store_attempt_list_finish(&attempts);
    struct store_job job = get(id);
    ck_assert_uint_eq(job.n_failures, 0);
    store_job_finish(&job);
    end();
}
END_TEST

START_TEST(a_cancellation_outlives_the_daemon)
{
    begin();
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE];
    struct store_job job;
    submit(id);
    take(token);
    ck_ok(jobs_cancel(jobs, id, &job, &diag));
    store_job_finish(&job);
    close_daemon(); /* its supervisor never came to it */
    open_daemon();
    supervise(WAITER, quick);
    ck_assert_int_eq(state_of(id), STORE_JOB_CANCELLED);
    end();
}
END_TEST

START_TEST(blobs_without_rows_are_collected_and_others_kept)
{
    begin();
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE], kept[BLOBS_HASH_SIZE], lost[BLOBS_HASH_SIZE];
    struct blobs_writer *writer;
    uint64_t n_removed = 0;
    submit(id);
    struct store_attempt_ref ref = take(token);
    checkpoint(&ref, "kept", 1, kept);
    /* killed between the blob and its row */
    ck_ok(blobs_begin(blobs, 0, &writer, &diag));
    ck_ok(blobs_write(writer, "lost", 4, &diag));
    ck_ok(blobs_commit(writer, NULL, lost, &diag));
    close_daemon();
    open_daemon();
    ck_assert(blob_is_there(lost));
    ck_ok(jobs_collect_blobs(jobs, &n_removed, &diag));
    ck_assert_uint_eq(n_removed, 1);
    ck_assert(!blob_is_there(lost));
    ck_assert(blob_is_there(kept));
    end();
}
END_TEST

/* --- all at once: for ThreadSanitizer -------------------------------------------------------------------------- */

static void *submit_and_cancel(void *user)
{
    (void)user;
    for (int i = 0; i < 6; i++) {
        struct jobs_request request = {.kind = "fit", .inputs = "{}", .options = "{}"};
        struct jobs_watch *watch;
        struct store_job job, after;
        int n_woken = 0;
        if (jobs_submit(jobs, &request, &job, NULL) != GROOM_OK)
            return (void *)(uintptr_t)"a job was refused";
        if (jobs_watch(jobs, job.id, count_up, &n_woken, &watch) != GROOM_OK)
            return (void *)(uintptr_t)"no watch";
        nap(i % 3 * 10);
        if (jobs_cancel(jobs, job.id, &after, NULL) != GROOM_OK)
            return (void *)(uintptr_t)"not cancelled";
        store_job_finish(&after);
        for (int k = 0; k < 4000; k++) {
            if (jobs_get(jobs, job.id, &after, NULL) != GROOM_OK)
                return (void *)(uintptr_t)"the job is gone";
            bool over = store_job_state_is_end(after.state);
            store_job_finish(&after);
            if (over)
                break;
            nap(5);
        }
        jobs_unwatch(jobs, watch);
        store_job_finish(&job);
    }
    return NULL;
}

START_TEST(many_submit_watch_and_cancel_at_once)
{
    begin();
    pthread_t threads[4];
    struct supervisor_options options = {.n_slots = 3, .backoff_ms = 5, .cancel_grace_ms = 20};
    supervise("sleep 0.02; exit 1", options);
    for (int i = 0; i < 4; i++)
        ck_assert_int_eq(pthread_create(&threads[i], NULL, submit_and_cancel, NULL), 0);
    for (int i = 0; i < 4; i++) {
        void *complaint;
        pthread_join(threads[i], &complaint);
        ck_assert_msg(!complaint, "%s", (char *)complaint);
    }
    struct store_counts counts;
    ck_ok(store_count(store, &counts, &diag));
    ck_assert_uint_eq(counts.jobs[STORE_JOB_CANCELLED] + counts.jobs[STORE_JOB_FAILED], 24);
    end();
}
END_TEST

TEST_SUITE("jobs", a_job_reads_as_the_contract_names_it,
           an_attempt_is_told_its_job_its_inputs_and_its_checkpoint, progress_leaves_events_and_losses,
           a_progress_message_that_is_wrong_is_refused_by_its_field,
           a_checkpoint_takes_the_place_of_the_one_before,
           checkpoints_of_two_jobs_with_the_same_bytes_are_kept_for_both, a_result_is_taken_once,
           a_job_that_cannot_be_done_fails_at_once_with_its_problem, a_watch_is_woken_by_its_job_alone,
           a_queued_job_is_cancelled_at_once_and_an_ended_one_stays,
           a_worker_hears_of_the_cancellation_and_may_not_succeed,
           a_worker_that_hands_in_its_result_has_done_the_job,
           a_worker_that_dies_is_followed_by_another_from_its_checkpoint,
           a_poison_job_fails_with_its_history_and_last_words, a_job_out_of_processor_time_fails_at_once,
           a_job_out_of_time_by_the_clock_fails_at_once, a_worker_that_others_stop_is_followed_by_another, a_worker_that_cannot_be_started_counts_as_dead,
           a_cancelled_worker_is_really_stopped, slots_work_side_by_side_and_no_more_than_there_are,
           draining_gives_the_jobs_back_without_a_mark, a_killed_daemon_loses_nothing,
           a_cancellation_outlives_the_daemon, blobs_without_rows_are_collected_and_others_kept,
           many_submit_watch_and_cancel_at_once)
