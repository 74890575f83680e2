/* What goes and what stays: rows that only helped, blobs that nobody refers to, and none that somebody does. */
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/actor.h"
#include "server/housekeeper.h"
#include "server/jobs/jobs.h"
#include "server/uploads/uploads.h"
#include "tests/support/folder.h"
#include "tests/support/test.h"

static struct groom_diag diag;
static struct store *store;
static struct blobs *blobs;

static void open_all(void)
{
    test_folder_make();
    ck_ok(store_open(test_folder_path("db"), &store, &diag));
    ck_ok(blobs_open(test_folder_path("blobs"), NULL, &blobs, &diag));
}

static void close_all(void)
{
    blobs_close(blobs);
    store_close(store);
    test_folder_remove();
}

/* --- rows --------------------------------------------------------------------------------- */

static void make_job(const char *id, const char *key)
{
    struct store_job_new job = {.id = id, .kind = "fit", .request = "{\"strands\":\"str_a\"}", .options = "{}"};
    const struct actor actor = {.name = "ann", .key = key, .key_hash = key, .key_lifetime_ms = 500};
    actor_set(&actor);
    ck_ok(store_job_create(store, &job, &diag));
    actor_set(NULL);
}

static void run_job(void)
{
    struct store_attempt_ref ref;
    bool taken, cancel;
    int64_t next;
    char garbage[STORE_HASH_SIZE], token[STORE_HASH_SIZE];
    snprintf(token, sizeof token, "%064d", rand());
    ck_ok(store_job_take(store, token, &ref, &taken, &next, &diag));
    const struct store_event_new events[] = {{"stage", "{}"}, {"progress", "{}"}, {"loss", "{}"}};
    const struct store_loss loss = {"guides", 1, "total", 0.5};
    struct store_progress progress = {.progress = 0.5, .eta_s = -1, .losses = &loss, .n_losses = 1,
                                      .events = events, .n_events = 3};
    ck_ok(store_attempt_progress(store, &ref, &progress, &cancel, &diag));
    struct store_job_move move = {.job_id = ref.job_id, .from = STORE_JOB_RUNNING, .to = STORE_JOB_FAILED,
                                  .attempt = ref.number, .attempt_state = STORE_ATTEMPT_FAILED, .error = "{}"};
    ck_ok(store_job_move(store, &move, garbage, &diag));
}

static size_t count_events(const char *id)
{
    struct store_event_list list;
    ck_ok(store_events_since(store, id, 0, 0, &list, &diag));
    size_t n = list.n;
    store_event_list_finish(&list);
    return n;
}

START_TEST(progress_goes_history_stays)
{
    struct store_retired retired;
    struct store_loss_list losses;
    struct store_retention keep = {0};
    open_all();
    make_job("job_ended", "k1");
    run_job();
    make_job("job_waits", "k2");
    ck_assert_uint_eq(count_events("job_ended"), 6);
    ck_ok(store_retire(store, &keep, 100, &retired, &diag));
    ck_assert_uint_eq(count_events("job_ended"), 6);
    keep.events_before_ms = keep.keys_before_ms = store_now_ms() + 1000;
    ck_ok(store_retire(store, &keep, 100, &retired, &diag));
    ck_assert_uint_eq(retired.n_event_streams, 1);
    ck_assert_uint_eq(retired.n_keys, 2);
    ck_assert_uint_eq(count_events("job_ended"), 4);
    ck_assert_uint_eq(count_events("job_waits"), 1);
    ck_ok(store_losses_list(store, "job_ended", &losses, &diag));
    ck_assert_uint_eq(losses.n, 1);
    store_loss_list_finish(&losses);
    ck_ok(store_retire(store, &keep, 100, &retired, &diag));
    ck_assert_uint_eq(retired.n_event_streams + retired.n_keys, 0);
    make_job("job_again", "k1");
    close_all();
}
END_TEST

START_TEST(jobs_go_where_that_is_asked_for)
{
    struct store_retired retired;
    struct store_job job;
    struct store_retention keep = {0};
    open_all();
    for (int i = 0; i < 5; i++) {
        char id[32];
        snprintf(id, sizeof id, "job_%d", i);
        make_job(id, id);
        run_job();
    }
    make_job("job_waits", "k2");
    keep.jobs_before_ms = store_now_ms() + 1000;
    ck_ok(store_retire(store, &keep, 3, &retired, &diag));
    ck_assert_uint_eq(retired.n_jobs, 3);
    ck_ok(store_retire(store, &keep, 3, &retired, &diag));
    ck_assert_uint_eq(retired.n_jobs, 2);
    ck_status(store_job_get(store, "job_0", &job, &diag), GROOM_ENOTFOUND);
    ck_ok(store_job_get(store, "job_waits", &job, &diag));
    store_job_finish(&job);
    close_all();
}
END_TEST

/* --- blobs: everybody at once --------------------------------------------------------------- */

static struct jobs *jobs;
static struct uploads *uploads;
static atomic_bool over;

static groom_status is_referenced(void *user, const char *sha256, bool *referenced)
{
    return store_blob_referenced(user, sha256, referenced, NULL);
}

static void *collect(void *user)
{
    (void)user;
    while (!atomic_load(&over))
        ck_ok(jobs_collect_blobs(jobs, NULL, NULL));
    return NULL;
}

/* Bytes as a blob with its pin: plainly, or through an upload in pieces. */
static void put_bytes(const char *text, bool in_pieces, char sha256[BLOBS_HASH_SIZE])
{
    struct store_upload upload;
    struct upload_writer *piece;
    struct blobs_writer *writer;
    enum upload_refusal refusal;
    uint64_t n;
    int64_t expires;
    if (!in_pieces) {
        ck_ok(blobs_begin(blobs, 0, &writer, NULL));
        ck_ok(blobs_write(writer, text, strlen(text), NULL));
        ck_ok(blobs_commit(writer, NULL, sha256, NULL));
        return;
    }
    ck_ok(uploads_begin(uploads, NULL, NULL, strlen(text), "", &upload, NULL));
    ck_ok(upload_open(uploads, upload.id, 0, NULL, &piece, &refusal, NULL));
    ck_ok(upload_write(piece, text, strlen(text), NULL));
    ck_ok(upload_finish(piece, &n, &expires, &refusal, NULL));
    ck_ok(uploads_take(uploads, upload.id, sha256, &n, &refusal, NULL));
    ck_ok(uploads_remove(uploads, upload.id, NULL));
    store_upload_finish(&upload);
}

/* Four write, read and remove the same few blobs under rows of their own, and look all the while whether
 * what a row names is there. */
static void *use(void *user)
{
    unsigned seed = (unsigned)(size_t)user;
    for (int i = 0; i < 50; i++) {
        char text[16], garbage[STORE_HASH_SIZE];
        struct store_asset asset = {.kind = STORE_STRANDS, .n_bytes = 1, .unit_m = 1, .up = 'y', .format = (char[]){"x"}};
        bool created;
        uint64_t n;
        int fd;
        snprintf(text, sizeof text, "%u", rand_r(&seed) % 3);
        snprintf(asset.id, sizeof asset.id, "str_%zu_%d", (size_t)user, i);
        put_bytes(text, rand_r(&seed) % 2, asset.sha256);
        ck_ok(store_asset_put(store, &asset, 0, &created, NULL));
        blobs_unpin(blobs, asset.sha256);
        ck_ok(blobs_read(blobs, asset.sha256, &fd, &n, NULL));
        ck_assert_uint_eq(n, 1);
        close(fd);
        ck_ok(store_asset_remove(store, STORE_STRANDS, asset.id, garbage, NULL));
        ck_ok(blobs_collect(blobs, garbage, is_referenced, store, NULL, NULL));
    }
    return NULL;
}

START_TEST(the_collector_takes_nothing_that_a_row_names)
{
    pthread_t collector, users[4];
    open_all();
    ck_ok(jobs_create(store, blobs, &jobs, &diag));
    const struct uploads_options options = {.store = store, .blobs = blobs, .folder = test_folder_path("uploads"),
                                            .expiry_ms = 60000};
    ck_ok(uploads_create(&options, &uploads, &diag));
    size_t n_files = test_folder_files();
    ck_assert_int_eq(pthread_create(&collector, NULL, collect, NULL), 0);
    for (size_t i = 0; i < 4; i++)
        ck_assert_int_eq(pthread_create(&users[i], NULL, use, (void *)(i + 1)), 0);
    for (size_t i = 0; i < 4; i++)
        pthread_join(users[i], NULL);
    atomic_store(&over, true);
    pthread_join(collector, NULL);
    ck_ok(jobs_collect_blobs(jobs, NULL, &diag));
    ck_assert_uint_eq(test_folder_files(), n_files);
    uploads_destroy(uploads);
    jobs_destroy(jobs);
    close_all();
}
END_TEST

START_TEST(a_round_of_the_housekeeper_does_all_of_it)
{
    char sha256[BLOBS_HASH_SIZE];
    struct housekeeper *keeper;
    open_all();
    ck_ok(jobs_create(store, blobs, &jobs, &diag));
    make_job("job_a", "k");
    run_job();
    put_bytes("garbage", false, sha256);
    const struct housekeeper_options options = {.store = store, .jobs = jobs, .keep_events_s = 1000};
    ck_ok(housekeeper_round(&options, &diag));
    ck_ok(blobs_pin(blobs, sha256, &diag)); /* it was pinned */
    blobs_unpin(blobs, sha256);
    blobs_unpin(blobs, sha256);
    ck_ok(housekeeper_round(&options, &diag));
    ck_status(blobs_pin(blobs, sha256, &diag), GROOM_ENOTFOUND);
    ck_assert_uint_eq(count_events("job_a"), 6);
    ck_ok(housekeeper_start(&options, &keeper, &diag));
    housekeeper_stop(keeper);
    jobs_destroy(jobs);
    close_all();
}
END_TEST

TEST_SUITE("retention", progress_goes_history_stays, jobs_go_where_that_is_asked_for,
           the_collector_takes_nothing_that_a_row_names, a_round_of_the_housekeeper_does_all_of_it)
