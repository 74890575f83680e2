/* Databases of every earlier schema (tests/golden/schema) are upgraded and say what they said. A version that
 * has no file of its own is made from the one before by its step. */
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/store/database.h"
#include "tests/support/folder.h"
#include "tests/support/test.h"

#define TIME 1760000000000

static struct groom_diag diag;

/* --- making one ----------------------------------------------------------------------------- */

static char *read_text(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return NULL;
    ck_assert_int_eq(fseek(file, 0, SEEK_END), 0);
    long n = ftell(file);
    char *text = calloc(1, (size_t)n + 1);
    rewind(file);
    ck_assert_uint_eq(fread(text, 1, (size_t)n, file), (size_t)n);
    fclose(file);
    return text;
}

static char *fixture(int version)
{
    char path[64];
    snprintf(path, sizeof path, "tests/golden/schema/v%d.sql", version);
    return read_text(path);
}

static void make_database(const char *path, int version)
{
    sqlite3 *db;
    char *text = NULL, *error = NULL;
    int from = version + 1;
    while (!text && --from > 0)
        text = fixture(from);
    ck_assert_msg(text != NULL, "tests/golden/schema is looked for from the top of the project");
    ck_assert_int_eq(sqlite3_open(path, &db), SQLITE_OK);
    int code = sqlite3_exec(db, text, NULL, NULL, &error);
    ck_assert_msg(code == SQLITE_OK, "v%d.sql: %s", from, error ? error : "");
    ck_ok(schema_migrate(db, schema_steps, version, &diag));
    ck_assert_int_eq(sqlite3_close(db), SQLITE_OK);
    free(text);
}

/* --- reading it -------------------------------------------------------------------------------- */

static void read_assets(struct store *store)
{
    struct store_asset asset;
    ck_ok(store_asset_get(store, NULL, STORE_STRANDS, "str_old", &asset, &diag));
    ck_assert_str_eq(asset.name, "Brows of Ann");
    ck_assert_str_eq(asset.metadata, "{\"strands\":3}");
    ck_assert_int_eq(asset.up, 'z');
    ck_assert(asset.unit_m > 0.0099 && asset.unit_m < 0.0101);
    ck_assert_int_eq(asset.created_ms, TIME);
    store_asset_finish(&asset);
    ck_ok(store_asset_get(store, NULL, STORE_HEAD, "head_old", &asset, &diag));
    ck_assert_uint_eq(asset.n_bytes, 99);
    store_asset_finish(&asset);
}

static void read_grooms(struct store *store)
{
    struct store_revision revision;
    struct store_revision_list list;
    ck_ok(store_revision_get(store, "grm_old", 0, &revision, &diag));
    ck_assert_uint_eq(revision.number, 2);
    ck_assert_str_eq(revision.name, "Ann");
    ck_assert_ptr_nonnull(strstr(revision.document, "\"x\":2"));
    char *hash = strstr(revision.document, "\"$array\":\"") + 10;
    hash[64] = 0;
    void *bytes;
    size_t n;
    ck_ok(store_array_get(store, hash, &bytes, &n, &diag));
    ck_assert_uint_eq(n, 48);
    free(bytes);
    store_revision_finish(&revision);
    ck_ok(store_revisions_list(store, "grm_old", (struct store_page){0}, &list, &diag));
    ck_assert_uint_eq(list.n, 2);
    store_revision_list_finish(&list);
}

static void read_jobs(struct store *store)
{
    struct store_job job;
    struct store_event_list events;
    struct store_loss_list losses;
    struct store_attempt_list attempts;
    struct store_checkpoint checkpoint;
    ck_ok(store_job_get(store, "job_done", &job, &diag));
    ck_assert_int_eq(job.state, STORE_JOB_SUCCEEDED);
    ck_assert_str_eq(job.options, "{\"seed\":1}");
    ck_assert_str_eq(job.result, "{\"groom\":\"grm_old\",\"revision\":1}");
    ck_assert_int_eq(job.finished_ms, TIME + 9);
    store_job_finish(&job);
    ck_ok(store_job_get(store, "job_waits", &job, &diag));
    ck_assert_int_eq(job.priority, 7);
    ck_assert_int_eq(job.queue_position, 0);
    store_job_finish(&job);
    ck_ok(store_events_since(store, "job_done", 0, 0, &events, &diag));
    ck_assert_uint_eq(events.n, 3);
    store_event_list_finish(&events);
    ck_ok(store_losses_list(store, "job_done", &losses, &diag));
    ck_assert_uint_eq(losses.n, 2);
    store_loss_list_finish(&losses);
    ck_ok(store_attempts_list(store, NULL, &attempts, &diag));
    ck_assert_uint_eq(attempts.n, 1);
    ck_assert_str_eq(attempts.items[0].ref.job_id, "job_runs");
    store_attempt_list_finish(&attempts);
    ck_ok(store_checkpoint_get(store, "job_runs", &checkpoint, &diag));
    ck_assert_uint_eq(checkpoint.stage, 2);
}

static void read_uploads(struct store *store)
{
    struct store_upload upload;
    ck_ok(store_upload_get(store, "upl_old", &upload, &diag));
    ck_assert_uint_eq(upload.n_durable, 60);
    store_upload_finish(&upload);
}

static void no_problem(void *user, const char *text)
{
    (void)user;
    ck_abort_msg("%s", text);
}

static void count_blob(void *user, const char *sha256, uint64_t n_bytes, const char *owner)
{
    (void)sha256, (void)n_bytes, (void)owner;
    ++*(size_t *)user;
}

static void ignore_upload(void *user, const char *id, uint64_t n_durable) { (void)user, (void)id, (void)n_durable; }

static void check(struct store *store)
{
    size_t n_blobs = 0;
    const struct store_check_sink sink = {no_problem, count_blob, ignore_upload, &n_blobs};
    ck_ok(store_copy(store, test_folder_path("copy"), &diag));
    ck_ok(store_copy_check(test_folder_path("copy"), &sink, &diag));
    ck_assert_uint_ge(n_blobs, 3);
}

/* It goes on as if it had never been another: a job is taken, and ends. */
static void work(struct store *store)
{
    struct store_attempt_ref ref;
    bool taken;
    int64_t next;
    char garbage[STORE_HASH_SIZE];
    ck_ok(store_job_take(store, "dddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddd", &ref, &taken, &next, &diag));
    ck_assert(taken);
    ck_assert_str_eq(ref.job_id, "job_waits");
    struct store_job_move move = {.job_id = "job_waits", .from = STORE_JOB_RUNNING, .to = STORE_JOB_FAILED,
                                  .attempt = 1, .attempt_state = STORE_ATTEMPT_FAILED, .error = "{}"};
    ck_ok(store_job_move(store, &move, garbage, &diag));
    ck_ok(store_ping(store, &diag));
}

START_TEST(every_earlier_schema_is_upgraded_and_read)
{
    for (int version = 1; version <= schema_version; version++) {
        struct store *store;
        test_folder_make();
        make_database(test_folder_path("groomd.db"), version);
        for (int round = 0; round < 2; round++) { /* upgraded, then as it is */
            groom_status status = store_open(test_folder_path("groomd.db"), &store, &diag);
            ck_assert_msg(status == GROOM_OK, "version %d: %s", version, diag.detail);
            read_assets(store);
            read_grooms(store);
            read_jobs(store);
            if (version >= 3)
                read_uploads(store);
            check(store);
            store_copy_remove(test_folder_path("copy"));
            if (round == 1)
                work(store);
            store_close(store);
        }
        test_folder_remove();
    }
}
END_TEST

/* A step that fails leaves the database at the one before, whole. */
START_TEST(a_step_that_fails_changes_nothing)
{
    static const char *const steps[] = {"CREATE TABLE a (x)", "CREATE TABLE b (x); INSERT INTO nothing VALUES (1)"};
    sqlite3 *db;
    test_folder_make();
    ck_assert_int_eq(sqlite3_open(test_folder_path("db"), &db), SQLITE_OK);
    groom_status status = schema_migrate(db, steps, 2, &diag);
    ck_assert_int_ne(status, GROOM_OK);
    ck_assert_int_eq(sqlite3_exec(db, "INSERT INTO a VALUES (1)", NULL, NULL, NULL), SQLITE_OK);
    ck_assert_int_ne(sqlite3_exec(db, "INSERT INTO b VALUES (1)", NULL, NULL, NULL), SQLITE_OK);
    ck_ok(schema_migrate(db, steps, 1, &diag));
    sqlite3_close(db);
    test_folder_remove();
}
END_TEST

TEST_SUITE("migrations", every_earlier_schema_is_upgraded_and_read, a_step_that_fails_changes_nothing)
