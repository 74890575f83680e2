/* The store: rows come back as they went in, transactions are whole, the fence holds. */
#include <pthread.h>
#include <signal.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/actor.h"
#include "server/store/database.h"
#include "tests/support/folder.h"
#include "tests/support/test.h"

#define HASH_A "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
#define HASH_B "bbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbb"
#define HASH_C "cccccccccccccccccccccccccccccccccccccccccccccccccccccccccccccccc"

static struct groom_diag diag;
static struct store *job_store;

static struct store *open_new(void)
{
    struct store *store;
    test_folder_make();
    ck_ok(store_open(test_folder_path("groomd.db"), &store, &diag));
    return store;
}

static struct store *reopen(struct store *store)
{
    store_close(store);
    ck_ok(store_open(test_folder_path("groomd.db"), &store, &diag));
    return store;
}

static void close_all(struct store *store)
{
    store_close(store);
    test_folder_remove();
}

static void make_job(struct store *store, const char *id, int32_t priority)
{
    struct store_job_new job = {.id = id, .kind = "fit", .request = "{\"strands\":\"str_a\"}",
                                .options = "{\"seed\":1}", .priority = priority};
    ck_ok(store_job_create(store, &job, &diag));
}

static struct store_attempt_ref take(struct store *store, const char *token_hash)
{
    struct store_attempt_ref ref;
    bool taken = false;
    int64_t next = -1;
    ck_ok(store_job_take(store, token_hash, &ref, &taken, &next, &diag));
    ck_assert(taken);
    return ref;
}

static groom_status move(struct store *store, const char *id, enum store_job_state from, enum store_job_state to,
                         uint32_t attempt, enum store_attempt_state attempt_state)
{
    char garbage[STORE_HASH_SIZE];
    struct store_job_move m = {.job_id = id, .from = from, .to = to, .attempt = attempt,
                               .attempt_state = attempt_state};
    return store_job_move(store, &m, garbage, &diag);
}

static enum store_job_state state_of(struct store *store, const char *id)
{
    struct store_job job;
    ck_ok(store_job_get(store, id, &job, &diag));
    enum store_job_state state = job.state;
    store_job_finish(&job);
    return state;
}

/* --- opening and the schema ------------------------------------------------------------ */

static void set_version(int version)
{
    sqlite3 *db;
    char sql[64];
    ck_assert_int_eq(sqlite3_open(test_folder_path("groomd.db"), &db), SQLITE_OK);
    snprintf(sql, sizeof sql, "PRAGMA user_version = %d", version);
    ck_assert_int_eq(sqlite3_exec(db, sql, NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(db);
}

START_TEST(a_newer_schema_is_refused)
{
    struct store *store = open_new();
    store_close(store);
    set_version(schema_version + 1);
    ck_status(store_open(test_folder_path("groomd.db"), &store, &diag), GROOM_EFORMAT);
    ck_assert_ptr_nonnull(strstr(diag.detail, "schema version"));
    test_folder_remove();
}
END_TEST

START_TEST(what_is_not_a_database_is_refused)
{
    struct store *store;
    test_folder_make();
    FILE *file = fopen(test_folder_path("groomd.db"), "w");
    for (int i = 0; i < 1000; i++)
        fputs("this is not a database\n", file);
    fclose(file);
    ck_status(store_open(test_folder_path("groomd.db"), &store, &diag), GROOM_EFORMAT);
    test_folder_remove();
}
END_TEST

/* Pages overwritten in the middle of the file. */
START_TEST(a_damaged_database_is_refused)
{
    struct store *store = open_new();
    for (int i = 0; i < 400; i++) {
        char id[STORE_ID_SIZE];
        ck_ok(store_make_id("job_", id));
        make_job(store, id, 0);
    }
    store_close(store);
    FILE *file = fopen(test_folder_path("groomd.db"), "r+");
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    fseek(file, 4096, SEEK_SET);
    for (long i = 4096; i < size; i++)
        fputc(0x5a, file);
    fclose(file);
    ck_status(store_open(test_folder_path("groomd.db"), &store, &diag), GROOM_EFORMAT);
    test_folder_remove();
}
END_TEST

/* The other is forked before: SQLite's locks are a process's own. */
START_TEST(two_daemons_do_not_share_a_database)
{
    struct store *store;
    int go[2], how = 1;
    char byte = 0;
    test_folder_make();
    const char *path = test_folder_path("groomd.db");
    ck_assert_int_eq(pipe(go), 0);
    pid_t child = fork();
    if (child == 0) {
        bool told = read(go[0], &byte, 1) == 1;
        bool refused = told && store_open(path, &store, &diag) == GROOM_EIO;
        _exit(refused && strstr(diag.detail, "another") ? 0 : 1);
    }
    ck_ok(store_open(path, &store, &diag));
    ck_assert_int_eq((int)write(go[1], &byte, 1), 1);
    ck_assert_int_eq(waitpid(child, &how, 0), child);
    ck_assert_int_eq(how, 0);
    close_all(store);
}
END_TEST

START_TEST(a_step_that_fails_leaves_the_version_before_it)
{
    static const char *const steps[] = {"CREATE TABLE one (a INTEGER)",
                                        "CREATE TABLE two (a INTEGER); CREATE TABLE one (b INTEGER)"};
    sqlite3 *db;
    sqlite3_stmt *statement;
    ck_assert_int_eq(sqlite3_open(":memory:", &db), SQLITE_OK);
    ck_status(schema_migrate(db, steps, 2, &diag), GROOM_EINTERNAL);
    sqlite3_prepare_v2(db, "SELECT count(*) FROM sqlite_schema", -1, &statement, NULL);
    ck_assert_int_eq(sqlite3_step(statement), SQLITE_ROW);
    ck_assert_int_eq(sqlite3_column_int(statement, 0), 1); /* "two" was rolled back */
    sqlite3_finalize(statement);
    ck_ok(schema_migrate(db, steps, 1, &diag)); /* at version 1 already */
    sqlite3_close(db);
}
END_TEST

/* What was there before there were projects is the default one's. */
START_TEST(the_first_schema_becomes_the_present_one)
{
    struct store *store;
    struct store_asset asset;
    struct store_job job;
    char project[STORE_PROJECT_SIZE];
    sqlite3 *db;
    test_folder_make();
    ck_assert_int_eq(sqlite3_open(test_folder_path("groomd.db"), &db), SQLITE_OK);
    ck_ok(schema_migrate(db, schema_steps, 1, &diag));
    ck_ok(database_execute(db,
                           "INSERT INTO assets (id, kind, sha256, n_bytes, format, unit_m, up, name, metadata, created)"
                           " VALUES ('str_a', 0, '" HASH_A "', 5, 'hair', 1, 'y', 'bob', '{}', 7);"
                           "INSERT INTO jobs (id, kind, state, priority, request, options, created)"
                           " VALUES ('job_a', 'fit', 0, 2, '{}', '{}', 8);"
                           "INSERT INTO idempotency_keys VALUES ('k', 'h', 'job_a', 8);"
                           "INSERT INTO grooms (id, name, latest, created, changed) VALUES ('grm_a', 'g', 1, 9, 9);"
                           "INSERT INTO revisions VALUES ('grm_a', 1, 0, 'g', '{}', 'fit', 9)", &diag));
    sqlite3_close(db);
    ck_ok(store_open(test_folder_path("groomd.db"), &store, &diag));
    ck_ok(store_asset_get(store, "default", STORE_STRANDS, "str_a", &asset, &diag));
    ck_assert_str_eq(asset.owner, "default");
    ck_assert_str_eq(asset.name, "bob");
    store_asset_finish(&asset);
    ck_ok(store_project_of(store, "grm_a", project, &diag));
    ck_assert_str_eq(project, "default");
    ck_ok(store_job_get(store, "job_a", &job, &diag));
    ck_assert_int_eq(job.queue_position, 0);
    store_job_finish(&job);
    ck_assert_str_eq(take(store, HASH_A).job_id, "job_a");
    close_all(store);
}
END_TEST

/* --- ids and times ---------------------------------------------------------------------- */

START_TEST(ids_have_their_prefix_and_differ)
{
    char a[STORE_ID_SIZE], b[STORE_ID_SIZE];
    ck_ok(store_make_id("job_", a));
    ck_ok(store_make_id("job_", b));
    ck_assert_str_ne(a, b);
    ck_assert_int_eq((int)strlen(a), 24);
    ck_assert_int_eq(strncmp(a, "job_", 4), 0);
}
END_TEST

START_TEST(times_are_rfc_3339)
{
    char text[32];
    store_time_text(1769860800250, text);
    ck_assert_str_eq(text, "2026-01-31T12:00:00.250Z");
}
END_TEST

/* --- uploads ------------------------------------------------------------------------------ */

START_TEST(an_upload_comes_back_and_the_same_id_is_kept_once)
{
    struct store *store = open_new();
    struct store_asset asset = {.kind = STORE_STRANDS, .sha256 = HASH_A, .n_bytes = 12, .format = (char *)"hair",
                                .unit_m = 0.01, .up = 'z', .name = (char *)"bob", .metadata = (char *)"{\"strands\":3}"};
    store_asset_id(NULL, STORE_STRANDS, HASH_A, "hair", 0.01, 'z', asset.id);
    bool created = false;
    ck_ok(store_asset_put(store, &asset, 0, &created, &diag));
    ck_assert(created);
    ck_ok(store_asset_put(store, &asset, 0, &created, &diag));
    ck_assert(!created);
    store = reopen(store);
    struct store_asset read;
    ck_ok(store_asset_get(store, NULL, STORE_STRANDS, asset.id, &read, &diag));
    ck_assert_str_eq(read.sha256, HASH_A);
    ck_assert_str_eq(read.format, "hair");
    ck_assert_str_eq(read.name, "bob");
    ck_assert_str_eq(read.metadata, "{\"strands\":3}");
    ck_assert_double_eq(read.unit_m, 0.01);
    ck_assert_int_eq(read.up, 'z');
    ck_assert_int_gt(read.created_ms, 0);
    store_asset_finish(&read);
    ck_status(store_asset_get(store, NULL, STORE_HEAD, asset.id, &read, &diag), GROOM_ENOTFOUND);
    bool referenced = false;
    ck_ok(store_blob_referenced(store, HASH_A, &referenced, &diag));
    ck_assert(referenced);
    ck_ok(store_blob_referenced(store, HASH_B, &referenced, &diag));
    ck_assert(!referenced);
    close_all(store);
}
END_TEST

START_TEST(the_id_of_an_upload_depends_on_bytes_and_options)
{
    char a[STORE_ID_SIZE], b[STORE_ID_SIZE];
    store_asset_id(NULL, STORE_STRANDS, HASH_A, "hair", 0.01, 'z', a);
    store_asset_id(NULL, STORE_STRANDS, HASH_A, "hair", 0.01, 'z', b);
    ck_assert_str_eq(a, b);
    store_asset_id(NULL, STORE_STRANDS, HASH_A, "hair", 0.01, 'y', b);
    ck_assert_str_ne(a, b);
    store_asset_id(NULL, STORE_STRANDS, HASH_A, "hair", 1, 'z', b);
    ck_assert_str_ne(a, b);
    store_asset_id(NULL, STORE_STRANDS, HASH_B, "hair", 0.01, 'z', b);
    ck_assert_str_ne(a, b);
    store_asset_id(NULL, STORE_HEAD, HASH_A, "hair", 0.01, 'z', b);
    ck_assert_str_ne(a + 4, b + 5);
}
END_TEST

START_TEST(pages_walk_a_list_from_new_to_old)
{
    struct store *store = open_new();
    for (int i = 0; i < 7; i++) {
        struct store_asset asset = {.kind = STORE_HEAD, .sha256 = HASH_A, .unit_m = 1, .up = 'y'};
        snprintf(asset.id, sizeof asset.id, "head_%d", i);
        ck_ok(store_asset_put(store, &asset, 0, NULL, &diag));
    }
    struct store_page page = {.limit = 3};
    int expected = 6, n_pages = 0;
    do {
        struct store_asset_list list;
        ck_ok(store_assets_list(store, NULL, STORE_HEAD, page, &list, &diag));
        for (size_t i = 0; i < list.n; i++)
            ck_assert_int_eq(list.items[i].id[5] - '0', expected--);
        page.before = list.next;
        n_pages++;
        store_asset_list_finish(&list);
    } while (page.before);
    ck_assert_int_eq(expected, -1);
    ck_assert_int_eq(n_pages, 3);
    close_all(store);
}
END_TEST

/* --- grooms --------------------------------------------------------------------------------- */

static const struct store_array one_array = {.sha256 = HASH_A, .bytes = "12345678", .n_bytes = 8};
static const struct store_revision_new first_revision = {
    .groom_id = "grm_one", .name = "bob", .document = "{\"x\":{\"$array\":\"" HASH_A "\"}}", .note = "fit",
    .arrays = &one_array, .n_arrays = 1};

START_TEST(revisions_are_kept_and_follow_each_other)
{
    struct store *store = open_new();
    struct store_revision row;
    ck_ok(store_groom_create(store, &first_revision, &diag));
    ck_status(store_groom_create(store, &first_revision, &diag), GROOM_ECONFLICT);
    struct store_array again = {.sha256 = HASH_A};
    struct store_revision_new second = {.groom_id = "grm_one", .name = "bobby", .document = "{}",
                                        .arrays = &again, .n_arrays = 1};
    ck_ok(store_revision_add(store, &second, 1, &diag));
    ck_status(store_revision_add(store, &second, 1, &diag), GROOM_ECONFLICT);
    store = reopen(store);
    ck_ok(store_revision_get(store, "grm_one", 0, &row, &diag));
    ck_assert_uint_eq(row.number, 2);
    ck_assert_uint_eq(row.parent, 1);
    ck_assert_str_eq(row.name, "bobby");
    ck_assert_str_eq(row.document, "{}");
    store_revision_finish(&row);
    ck_ok(store_revision_get(store, "grm_one", 1, &row, &diag));
    ck_assert_uint_eq(row.latest, 2);
    ck_assert_str_eq(row.name, "bob");
    ck_assert_str_eq(row.document, first_revision.document);
    ck_assert_str_eq(row.note, "fit");
    store_revision_finish(&row);
    ck_status(store_revision_get(store, "grm_one", 3, &row, &diag), GROOM_ENOTFOUND);
    ck_status(store_revision_get(store, "grm_two", 0, &row, &diag), GROOM_ENOTFOUND);
    close_all(store);
}
END_TEST

START_TEST(arrays_come_back_byte_for_byte)
{
    struct store *store = open_new();
    void *bytes;
    size_t n;
    struct store_array arrays[] = {one_array, {.sha256 = HASH_B, .bytes = "", .n_bytes = 0}};
    struct store_revision_new revision = first_revision;
    revision.arrays = arrays;
    revision.n_arrays = 2;
    ck_ok(store_groom_create(store, &revision, &diag));
    ck_ok(store_array_get(store, HASH_A, &bytes, &n, &diag));
    ck_assert_uint_eq(n, 8);
    ck_assert_mem_eq(bytes, "12345678", 8);
    free(bytes);
    ck_ok(store_array_get(store, HASH_B, &bytes, &n, &diag));
    ck_assert_uint_eq(n, 0);
    free(bytes);
    ck_status(store_array_get(store, HASH_C, &bytes, &n, &diag), GROOM_ENOTFOUND);
    close_all(store);
}
END_TEST

START_TEST(a_revision_with_an_unknown_array_leaves_nothing)
{
    struct store *store = open_new();
    struct store_array unknown = {.sha256 = HASH_C};
    struct store_revision_new revision = first_revision;
    struct store_revision row;
    revision.arrays = &unknown;
    ck_status(store_groom_create(store, &revision, &diag), GROOM_EINVAL);
    ck_status(store_revision_get(store, "grm_one", 0, &row, &diag), GROOM_ENOTFOUND);
    ck_ok(store_groom_create(store, &first_revision, &diag));
    ck_status(store_revision_add(store, &revision, 1, &diag), GROOM_EINVAL);
    ck_ok(store_revision_get(store, "grm_one", 0, &row, &diag));
    ck_assert_uint_eq(row.latest, 1);
    store_revision_finish(&row);
    close_all(store);
}
END_TEST

START_TEST(grooms_and_revisions_are_listed)
{
    struct store *store = open_new();
    struct store_revision_new revision = first_revision;
    struct store_groom_list grooms;
    struct store_revision_list revisions;
    ck_ok(store_groom_create(store, &revision, &diag));
    for (uint32_t i = 1; i < 5; i++)
        ck_ok(store_revision_add(store, &revision, i, &diag));
    revision.groom_id = "grm_two";
    ck_ok(store_groom_create(store, &revision, &diag));
    ck_ok(store_grooms_list(store, NULL, (struct store_page){0}, &grooms, &diag));
    ck_assert_uint_eq(grooms.n, 2);
    ck_assert_str_eq(grooms.items[0].id, "grm_two");
    ck_assert_uint_eq(grooms.items[1].latest, 5);
    store_groom_list_finish(&grooms);
    ck_ok(store_revisions_list(store, "grm_one", (struct store_page){.limit = 2}, &revisions, &diag));
    ck_assert_uint_eq(revisions.n, 2);
    ck_assert_uint_eq(revisions.items[0].number, 5);
    ck_assert_int_eq(revisions.next, 4);
    ck_assert_ptr_null(revisions.items[0].document);
    store_revision_list_finish(&revisions);
    ck_status(store_revisions_list(store, "grm_six", (struct store_page){0}, &revisions, &diag), GROOM_ENOTFOUND);
    close_all(store);
}
END_TEST

/* --- jobs -------------------------------------------------------------------------------------- */

START_TEST(jobs_are_taken_by_priority_then_age)
{
    struct store *store = open_new();
    struct store_job job;
    struct store_attempt_ref ref;
    bool taken = true;
    int64_t next = -1;
    make_job(store, "job_old", 0);
    make_job(store, "job_young", 0);
    make_job(store, "job_urgent", 5);
    ck_ok(store_job_get(store, "job_young", &job, &diag));
    ck_assert_int_eq(job.queue_position, 2);
    store_job_finish(&job);
    ck_assert_str_eq(take(store, HASH_A).job_id, "job_urgent");
    ck_assert_str_eq(take(store, HASH_B).job_id, "job_old");
    ck_assert_str_eq(take(store, HASH_C).job_id, "job_young");
    ck_ok(store_job_take(store, "another", &ref, &taken, &next, &diag));
    ck_assert(!taken);
    ck_assert_int_eq(next, 0);
    ck_ok(store_job_get(store, "job_young", &job, &diag));
    ck_assert_int_eq(job.queue_position, -1);
    ck_assert_int_gt(job.started_ms, 0);
    ck_assert_uint_eq(job.attempt, 1);
    store_job_finish(&job);
    close_all(store);
}
END_TEST

/* What the HTTP side says of the request that this thread is at. */
static void act_with_key(const char *key, const char *hash, int64_t lifetime_ms)
{
    struct actor actor = {.request = "abc", .token = "tok_a", .name = "ann", .project = "film",
                          .key = key, .key_hash = hash, .key_lifetime_ms = lifetime_ms};
    actor_set(&actor);
}

START_TEST(an_idempotency_key_stands_for_what_it_made)
{
    struct store *store = open_new();
    struct store_job_new job = {.id = "job_a", .kind = "fit", .request = "{}", .options = "{}", .project = "film"};
    struct store_key found;
    ck_status(store_key_find(store, "film", "k", HASH_A, &found, &diag), GROOM_ENOTFOUND);
    act_with_key("k", HASH_A, 60000);
    ck_ok(store_job_create(store, &job, &diag));
    job.id = "job_b";
    ck_status(store_job_create(store, &job, &diag), GROOM_ECONFLICT); /* came at the same moment */
    actor_set(NULL);
    store = reopen(store);
    ck_ok(store_key_find(store, "film", "k", HASH_A, &found, &diag));
    ck_assert_str_eq(found.subject, "job_a");
    ck_status(store_key_find(store, "film", "k", HASH_B, &found, &diag), GROOM_ECONFLICT);
    ck_status(store_key_find(store, "other", "k", HASH_A, &found, &diag), GROOM_ENOTFOUND);
    close_all(store);
}
END_TEST

START_TEST(an_idempotency_key_expires)
{
    struct store *store = open_new();
    struct store_key found;
    act_with_key("k", HASH_A, -1);
    ck_ok(store_groom_create(store, &first_revision, &diag));
    ck_status(store_key_find(store, NULL, "k", HASH_A, &found, &diag), GROOM_ENOTFOUND);
    act_with_key("k", HASH_B, 60000);
    ck_ok(store_revision_add(store, &first_revision, 1, &diag));
    actor_set(NULL);
    ck_ok(store_key_find(store, "default", "k", HASH_B, &found, &diag));
    ck_assert_str_eq(found.subject, first_revision.groom_id);
    ck_assert_uint_eq(found.number, 2);
    close_all(store);
}
END_TEST

/* --- projects, turns, the audit --------------------------------------------------------------------- */

START_TEST(projects_share_bytes_and_nothing_else)
{
    struct store *store = open_new();
    struct store_asset film = {.kind = STORE_STRANDS, .project = "film", .sha256 = HASH_A, .n_bytes = 10, .unit_m = 1,
                               .up = 'y'}, game = film, read;
    char id[STORE_ID_SIZE], project[STORE_PROJECT_SIZE];
    bool created = false;
    snprintf(game.project, sizeof game.project, "game");
    store_asset_id("film", STORE_STRANDS, HASH_A, "", 1, 'y', film.id);
    store_asset_id("game", STORE_STRANDS, HASH_A, "", 1, 'y', game.id);
    store_asset_id("default", STORE_STRANDS, HASH_A, "", 1, 'y', id);
    ck_assert_str_ne(film.id, game.id);
    ck_assert_str_ne(film.id, id);
    ck_ok(store_asset_put(store, &film, 0, &created, &diag));
    ck_ok(store_asset_put(store, &game, 0, &created, &diag));
    ck_assert(created);
    ck_ok(store_asset_get(store, "film", STORE_STRANDS, film.id, &read, &diag));
    store_asset_finish(&read);
    ck_status(store_asset_get(store, "film", STORE_STRANDS, game.id, &read, &diag), GROOM_ENOTFOUND);
    ck_ok(store_project_of(store, game.id, project, &diag));
    ck_assert_str_eq(project, "game");
    ck_status(store_project_of(store, "str_none", project, &diag), GROOM_ENOTFOUND);
    struct store_asset_list list;
    ck_ok(store_assets_list(store, "game", STORE_STRANDS, (struct store_page){0}, &list, &diag));
    ck_assert_uint_eq(list.n, 1);
    ck_assert_str_eq(list.items[0].id, game.id);
    store_asset_list_finish(&list);
    close_all(store);
}
END_TEST

START_TEST(an_owner_has_so_many_bytes_and_no_more)
{
    struct store *store = open_new();
    struct store_asset asset = {.id = "str_a", .project = "film", .owner = "tok_a", .sha256 = HASH_A, .n_bytes = 60,
                                .unit_m = 1, .up = 'y'};
    bool created = false;
    struct store_usage usage;
    ck_ok(store_asset_put(store, &asset, 100, &created, &diag));
    snprintf(asset.id, sizeof asset.id, "str_b");
    ck_status(store_asset_put(store, &asset, 100, &created, &diag), GROOM_ELIMIT);
    snprintf(asset.id, sizeof asset.id, "str_a"); /* it is there: nothing is added */
    ck_ok(store_asset_put(store, &asset, 1, &created, &diag));
    snprintf(asset.id, sizeof asset.id, "str_b");
    snprintf(asset.owner, sizeof asset.owner, "tok_b");
    ck_ok(store_asset_put(store, &asset, 100, &created, &diag));
    ck_ok(store_usage_of(store, "tok_a", &usage, &diag));
    ck_assert_uint_eq(usage.n_bytes, 60);
    close_all(store);
}
END_TEST

static void queue(struct store *store, const char *id, const char *owner, int32_t priority)
{
    struct store_job_new job = {.id = id, .kind = "fit", .request = "{}", .options = "{}", .owner = owner,
                                .priority = priority};
    ck_ok(store_job_create(store, &job, &diag));
}

/* Whoever queues many at once gets one turn in two; positions say in which order they are taken. */
START_TEST(owners_take_turns_and_positions_say_so)
{
    struct store *store = open_new();
    static const char *const order[] = {"job_urgent", "job_a1", "job_b1", "job_c1", "job_a2", "job_b2", "job_a3"};
    queue(store, "job_a1", "ann", 0);
    queue(store, "job_a2", "ann", 0);
    queue(store, "job_a3", "ann", 0);
    queue(store, "job_b1", "bob", 0);
    queue(store, "job_b2", "bob", 0);
    queue(store, "job_c1", "cat", 0);
    queue(store, "job_urgent", "dan", 1);
    struct store_job_list list;
    ck_ok(store_jobs_list(store, NULL, NULL, (struct store_page){0}, &list, &diag));
    for (size_t i = 0; i < list.n; i++)
        ck_assert_str_eq(order[list.items[i].queue_position], list.items[i].id);
    store_job_list_finish(&list);
    for (size_t i = 0; i < sizeof order / sizeof order[0]; i++) {
        struct store_job job;
        char token[8];
        ck_ok(store_job_get(store, order[i], &job, &diag));
        ck_assert_int_eq(job.queue_position, 0);
        store_job_finish(&job);
        snprintf(token, sizeof token, "t%zu", i);
        ck_assert_str_eq(take(store, token).job_id, order[i]);
    }
    close_all(store);
}
END_TEST

/* Turns count what was taken, also where nothing runs any more: three of ann's came and went. */
START_TEST(a_turn_is_remembered_after_its_job)
{
    struct store *store = open_new();
    queue(store, "job_a1", "ann", 0);
    ck_ok(move(store, take(store, "1").job_id, STORE_JOB_RUNNING, STORE_JOB_SUCCEEDED, 1, STORE_ATTEMPT_SUCCEEDED));
    queue(store, "job_a2", "ann", 0);
    queue(store, "job_b1", "bob", 0);
    ck_assert_str_eq(take(store, "2").job_id, "job_b1");
    ck_assert_str_eq(take(store, "3").job_id, "job_a2");
    close_all(store);
}
END_TEST

START_TEST(a_full_queue_takes_no_more)
{
    struct store *store = open_new();
    struct store_job_new job = {.id = "job_c", .kind = "fit", .request = "{}", .options = "{}", .owner = "ann",
                                .max_queued = 3, .max_queued_of_owner = 2};
    queue(store, "job_a", "ann", 0);
    queue(store, "job_b", "ann", 0);
    ck_status(store_job_create(store, &job, &diag), GROOM_ELIMIT);
    job.owner = "bob";
    ck_ok(store_job_create(store, &job, &diag));
    job.id = "job_d";
    ck_status(store_job_create(store, &job, &diag), GROOM_ELIMIT);
    ck_assert_ptr_nonnull(strstr(diag.detail, "queue is full"));
    take(store, HASH_A); /* what runs does not wait */
    ck_ok(store_job_create(store, &job, &diag));
    close_all(store);
}
END_TEST

START_TEST(every_change_is_in_the_audit_and_stays_there)
{
    struct store *store = open_new();
    struct store_audit_list list;
    struct connection *c;
    act_with_key(NULL, NULL, 0);
    make_job(store, "job_a", 0);
    ck_ok(store_groom_create(store, &first_revision, &diag));
    ck_status(store_groom_create(store, &first_revision, &diag), GROOM_ECONFLICT); /* no change */
    ck_ok(store_revision_add(store, &first_revision, 1, &diag));
    actor_set(NULL);
    ck_ok(move(store, "job_a", STORE_JOB_QUEUED, STORE_JOB_CANCELLED, 0, 0));
    store = reopen(store);
    ck_ok(store_audit_list(store, (struct store_page){0}, &list, &diag));
    ck_assert_uint_eq(list.n, 4);
    ck_assert_str_eq(list.items[0].action, "job.end");
    ck_assert_str_eq(list.items[0].name, "groomd");
    ck_assert_str_eq(list.items[1].action, "groom.revise");
    ck_assert_str_eq(list.items[1].subject, first_revision.groom_id);
    ck_assert_str_eq(list.items[2].action, "groom.create");
    ck_assert_str_eq(list.items[3].action, "job.create");
    ck_assert_str_eq(list.items[3].request, "abc");
    ck_assert_str_eq(list.items[3].token, "tok_a");
    ck_assert_str_eq(list.items[3].name, "ann");
    store_audit_list_finish(&list);
    ck_ok(store_audit_list(store, (struct store_page){.limit = 1, .before = 3}, &list, &diag));
    ck_assert_str_eq(list.items[0].action, "groom.create");
    ck_assert_int_eq(list.next, 2);
    store_audit_list_finish(&list);
    ck_ok(transaction_begin(store, &c, &diag));
    ck_assert_int_ne(database_execute(c->db, "DELETE FROM audit", &diag), GROOM_OK);
    ck_assert_int_ne(database_execute(c->db, "UPDATE audit SET name = 'eve'", &diag), GROOM_OK);
    ck_ok(transaction_end(c, GROOM_OK, &diag));
    close_all(store);
}
END_TEST

/* Every pair of states: what the picture in store.h has no arrow for is refused. */
START_TEST(only_the_drawn_transitions_are_allowed)
{
    static const bool drawn[STORE_JOB_STATES][STORE_JOB_STATES] = {
        [STORE_JOB_QUEUED] = {[STORE_JOB_FAILED] = true, [STORE_JOB_CANCELLED] = true},
        [STORE_JOB_RUNNING] = {[STORE_JOB_QUEUED] = true, [STORE_JOB_SUCCEEDED] = true,
                               [STORE_JOB_FAILED] = true, [STORE_JOB_CANCELLED] = true},
    };
    struct store *store = open_new();
    for (int from = 0; from < STORE_JOB_STATES; from++) {
        for (int to = 0; to < STORE_JOB_STATES; to++) {
            char id[STORE_ID_SIZE], token[STORE_ID_SIZE];
            ck_ok(store_make_id("job_", id));
            ck_ok(store_make_id("tok_", token));
            make_job(store, id, 100 * from + to + 1); /* the first to be taken */
            if (from != STORE_JOB_QUEUED)
                ck_assert_str_eq(take(store, token).job_id, id);
            if (store_job_state_is_end((enum store_job_state)from))
                ck_ok(move(store, id, STORE_JOB_RUNNING, (enum store_job_state)from, 1, STORE_ATTEMPT_FAILED));
            uint32_t attempt = from == STORE_JOB_RUNNING ? 1 : 0;
            groom_status status = move(store, id, (enum store_job_state)from, (enum store_job_state)to, attempt,
                                       STORE_ATTEMPT_DIED);
            ck_assert_int_eq(status == GROOM_OK, drawn[from][to]);
            if (status != GROOM_OK)
                ck_assert_int_eq(status, GROOM_ECONFLICT);
            ck_assert_int_eq(state_of(store, id), drawn[from][to] ? to : from);
            if (state_of(store, id) == STORE_JOB_QUEUED) /* leave nothing that would be taken next */
                ck_ok(move(store, id, STORE_JOB_QUEUED, STORE_JOB_CANCELLED, 0, STORE_ATTEMPT_DIED));
        }
    }
    close_all(store);
}
END_TEST

START_TEST(success_and_its_groom_are_one_transaction)
{
    struct store *store = open_new();
    struct store_revision row;
    char garbage[STORE_HASH_SIZE];
    make_job(store, "job_a", 0);
    struct store_attempt_ref ref = take(store, HASH_A);
    struct store_array unknown = {.sha256 = HASH_C};
    struct store_revision_new groom = first_revision;
    struct store_job_move success = {.job_id = "job_a", .from = STORE_JOB_RUNNING, .to = STORE_JOB_SUCCEEDED,
                                     .attempt = ref.number, .attempt_state = STORE_ATTEMPT_SUCCEEDED,
                                     .result = "{\"groom\":\"grm_one\"}", .grooms = &groom, .n_grooms = 1};
    groom.arrays = &unknown;
    ck_status(store_job_move(store, &success, garbage, &diag), GROOM_EINVAL);
    ck_assert_int_eq(state_of(store, "job_a"), STORE_JOB_RUNNING);
    ck_status(store_revision_get(store, "grm_one", 0, &row, &diag), GROOM_ENOTFOUND);
    groom.arrays = &one_array;
    ck_ok(store_job_move(store, &success, garbage, &diag));
    ck_assert_int_eq(state_of(store, "job_a"), STORE_JOB_SUCCEEDED);
    ck_ok(store_revision_get(store, "grm_one", 0, &row, &diag));
    store_revision_finish(&row);
    ck_status(store_job_move(store, &success, garbage, &diag), GROOM_ECONFLICT);
    struct store_job job;
    ck_ok(store_job_get(store, "job_a", &job, &diag));
    ck_assert_str_eq(job.result, "{\"groom\":\"grm_one\"}");
    ck_assert_double_eq(job.progress, 1);
    ck_assert_int_gt(job.finished_ms, 0);
    store_job_finish(&job);
    close_all(store);
}
END_TEST

/* A retargeting makes a groom for each target, and the strands that it stands on. */
START_TEST(success_may_bring_several_grooms_and_their_uploads)
{
    struct store *store = open_new();
    struct store_asset row;
    struct store_revision revision;
    char garbage[STORE_HASH_SIZE];
    make_job(store, "job_a", 0);
    struct store_attempt_ref ref = take(store, HASH_A);
    const struct store_asset assets[] = {
        {.id = "str_new", .kind = STORE_STRANDS, .sha256 = HASH_B, .n_bytes = 7, .format = (char *)"hair", .unit_m = 1, .up = 'y'}};
    struct store_revision_new grooms[] = {first_revision, {.groom_id = "grm_one", .name = "twin", .document = "{}"}};
    const struct store_job_move success = {.job_id = "job_a", .from = STORE_JOB_RUNNING, .to = STORE_JOB_SUCCEEDED,
                                           .attempt = ref.number, .attempt_state = STORE_ATTEMPT_SUCCEEDED,
                                           .result = "{}", .grooms = grooms, .n_grooms = 2,
                                           .assets = assets, .n_assets = 1};
    ck_status(store_job_move(store, &success, garbage, &diag), GROOM_ECONFLICT); /* the second has the first's id */
    ck_status(store_asset_get(store, NULL, STORE_STRANDS, "str_new", &row, &diag), GROOM_ENOTFOUND);
    ck_status(store_revision_get(store, "grm_one", 0, &revision, &diag), GROOM_ENOTFOUND);
    grooms[1].groom_id = "grm_two";
    ck_ok(store_job_move(store, &success, garbage, &diag));
    ck_ok(store_asset_get(store, "default", STORE_STRANDS, "str_new", &row, &diag));
    ck_assert_str_eq(row.sha256, HASH_B);
    store_asset_finish(&row);
    ck_ok(store_revision_get(store, "grm_two", 0, &revision, &diag));
    ck_assert_str_eq(revision.name, "twin");
    store_revision_finish(&revision);
    close_all(store);
}
END_TEST

START_TEST(a_preparation_is_kept_under_its_key_and_goes_with_its_subject)
{
    struct store *store = open_new();
    struct store_preparation found, made = {.sha256 = HASH_B, .n_bytes = 7}, other = {.sha256 = HASH_C, .n_bytes = 8};
    const struct store_asset strands = {.id = "str_a", .kind = STORE_STRANDS, .sha256 = HASH_A, .n_bytes = 1,
                                        .format = (char *)"hair", .unit_m = 1, .up = 'y'};
    struct store_retired retired = {0};
    char garbage[STORE_HASH_SIZE];
    bool created, referenced;
    ck_ok(store_asset_put(store, &strands, 0, &created, &diag));
    make_job(store, "job_a", 0);
    struct store_attempt_ref ref = take(store, HASH_A), stale = ref;
    stale.number++;
    ck_status(store_preparation_get(store, "k", &found, &diag), GROOM_ENOTFOUND);
    ck_status(store_attempt_preparation(store, &stale, "k", "str_a", &made, &diag), GROOM_ECONFLICT);
    ck_ok(store_attempt_preparation(store, &ref, "k", "str_a", &other, &diag));
    ck_ok(store_attempt_preparation(store, &ref, "k", "str_a", &made, &diag)); /* the last stays */
    ck_ok(store_preparation_get(store, "k", &found, &diag));
    ck_assert_str_eq(found.sha256, HASH_B);
    ck_assert_uint_eq(found.n_bytes, 7);
    ck_ok(store_blob_referenced(store, HASH_B, &referenced, &diag));
    ck_assert(referenced);
    const struct store_retention recent = {.preparations_before_ms = store_now_ms() - 100000};
    ck_ok(store_retire(store, &recent, 10, &retired, &diag));
    ck_assert_uint_eq(retired.n_preparations, 0);
    ck_ok(store_attempt_preparation(store, &ref, "l", "grm_b", &made, &diag));
    ck_ok(move(store, "job_a", STORE_JOB_RUNNING, STORE_JOB_FAILED, 1, STORE_ATTEMPT_FAILED));
    ck_ok(store_asset_remove(store, STORE_STRANDS, "str_a", garbage, &diag));
    ck_status(store_preparation_get(store, "k", &found, &diag), GROOM_ENOTFOUND);
    const struct store_retention all = {.preparations_before_ms = store_now_ms() + 1000};
    ck_ok(store_retire(store, &all, 10, &retired, &diag));
    ck_assert_uint_eq(retired.n_preparations, 1);
    ck_status(store_preparation_get(store, "l", &found, &diag), GROOM_ENOTFOUND);
    close_all(store);
}
END_TEST

START_TEST(an_input_that_stands_deep_in_a_request_is_not_removed)
{
    struct store *store = open_new();
    const struct store_asset head = {.id = "head_a", .kind = STORE_HEAD, .sha256 = HASH_A, .n_bytes = 1,
                                     .format = (char *)"obj", .unit_m = 1, .up = 'y'};
    const struct store_job_new job = {.id = "job_a", .kind = "retarget", .options = "{}",
                                      .request = "{\"targets\":[{\"head\":\"head_a\"}]}"};
    char garbage[STORE_HASH_SIZE];
    bool created;
    ck_ok(store_asset_put(store, &head, 0, &created, &diag));
    ck_ok(store_job_create(store, &job, &diag));
    ck_status(store_asset_remove(store, STORE_HEAD, "head_a", garbage, &diag), GROOM_ECONFLICT);
    close_all(store);
}
END_TEST

START_TEST(a_job_that_is_to_be_cancelled_neither_succeeds_nor_queues_again)
{
    struct store *store = open_new();
    enum store_job_state state;
    make_job(store, "job_a", 0);
    ck_ok(store_job_request_cancel(store, "job_a", &state, &diag));
    ck_assert_int_eq(state, STORE_JOB_QUEUED); /* queued: the caller moves it, nothing was noted */
    take(store, HASH_A);
    ck_ok(store_job_request_cancel(store, "job_a", &state, &diag));
    ck_assert_int_eq(state, STORE_JOB_RUNNING);
    ck_status(move(store, "job_a", STORE_JOB_RUNNING, STORE_JOB_SUCCEEDED, 1, STORE_ATTEMPT_SUCCEEDED),
              GROOM_ECANCELLED);
    ck_status(move(store, "job_a", STORE_JOB_RUNNING, STORE_JOB_QUEUED, 1, STORE_ATTEMPT_STOPPED),
              GROOM_ECANCELLED);
    ck_ok(move(store, "job_a", STORE_JOB_RUNNING, STORE_JOB_CANCELLED, 1, STORE_ATTEMPT_CANCELLED));
    ck_status(store_job_request_cancel(store, "job_b", &state, &diag), GROOM_ENOTFOUND);
    close_all(store);
}
END_TEST

START_TEST(a_stale_attempt_is_fenced_off)
{
    struct store *store = open_new();
    struct store_attempt_ref found;
    struct store_progress progress = {.progress = 0.5, .eta_s = -1};
    struct store_checkpoint checkpoint = {.sha256 = HASH_A, .stage = 1};
    char replaced[STORE_HASH_SIZE];
    bool cancel;
    make_job(store, "job_a", 0);
    struct store_attempt_ref first = take(store, HASH_A);
    ck_ok(store_attempt_find(store, HASH_A, 0, &found, &diag));
    ck_assert_uint_eq(found.number, 1);
    ck_ok(move(store, "job_a", STORE_JOB_RUNNING, STORE_JOB_QUEUED, 1, STORE_ATTEMPT_DIED));
    ck_status(store_attempt_find(store, HASH_A, 0, &found, &diag), GROOM_ECONFLICT);
    struct store_attempt_ref second = take(store, HASH_B);
    ck_assert_uint_eq(second.number, 2);
    ck_status(store_attempt_find(store, HASH_A, 0, &found, &diag), GROOM_ECONFLICT);
    ck_status(store_attempt_find(store, HASH_C, 0, &found, &diag), GROOM_ENOTFOUND);
    ck_status(store_attempt_progress(store, &first, &progress, &cancel, &diag), GROOM_ECONFLICT);
    ck_status(store_attempt_checkpoint(store, &first, &checkpoint, replaced, &diag), GROOM_ECONFLICT);
    ck_status(move(store, "job_a", STORE_JOB_RUNNING, STORE_JOB_SUCCEEDED, 1, STORE_ATTEMPT_SUCCEEDED),
              GROOM_ECONFLICT);
    ck_ok(store_attempt_progress(store, &second, &progress, &cancel, &diag));
    close_all(store);
}
END_TEST

/* A cluster lost the node and started the same attempt elsewhere; then the node comes back. */
START_TEST(a_stale_run_of_an_attempt_is_fenced_off)
{
    struct store *store = open_new();
    struct store_attempt_ref run_0, run_2, again;
    struct store_progress progress = {.progress = 0.5, .eta_s = -1};
    bool cancel;
    make_job(store, "job_a", 0);
    take(store, HASH_A);
    ck_ok(store_attempt_find(store, HASH_A, 0, &run_0, &diag));
    ck_ok(store_attempt_begin_run(store, &run_0, &diag));
    ck_ok(store_attempt_find(store, HASH_A, 2, &run_2, &diag));
    ck_ok(store_attempt_progress(store, &run_0, &progress, &cancel, &diag)); /* the other has not begun */
    ck_ok(store_attempt_begin_run(store, &run_2, &diag));
    ck_status(store_attempt_progress(store, &run_0, &progress, &cancel, &diag), GROOM_ECONFLICT);
    ck_status(store_attempt_begin_run(store, &run_0, &diag), GROOM_ECONFLICT);
    ck_status(store_attempt_ended(store, &run_0, "late", &diag), GROOM_ECONFLICT);
    ck_status(store_attempt_find(store, HASH_A, 1, &again, &diag), GROOM_ECONFLICT);
    ck_ok(store_attempt_progress(store, &run_2, &progress, &cancel, &diag));
    ck_ok(store_attempt_ended(store, &run_2, "signal 11", &diag));
    struct store_attempt_list attempts;
    ck_ok(store_attempts_list(store, "job_a", &attempts, &diag));
    ck_assert_int_eq(attempts.items[0].state, STORE_ATTEMPT_RUNNING);
    ck_assert_int_gt(attempts.items[0].finished_ms, 0);
    ck_assert_str_eq(attempts.items[0].last_words, "signal 11");
    store_attempt_list_finish(&attempts);
    close_all(store);
}
END_TEST

START_TEST(a_back_off_holds_a_job_back)
{
    struct store *store = open_new();
    struct store_attempt_ref ref;
    char garbage[STORE_HASH_SIZE];
    bool taken = true;
    int64_t next = 0, later = store_now_ms() + 100000;
    make_job(store, "job_a", 0);
    take(store, HASH_A);
    struct store_job_move again = {.job_id = "job_a", .from = STORE_JOB_RUNNING, .to = STORE_JOB_QUEUED,
                                   .attempt = 1, .attempt_state = STORE_ATTEMPT_DIED, .not_before_ms = later,
                                   .last_words = "oh no"};
    ck_ok(store_job_move(store, &again, garbage, &diag));
    ck_ok(store_job_take(store, HASH_B, &ref, &taken, &next, &diag));
    ck_assert(!taken);
    ck_assert_int_eq(next, later);
    struct store_attempt_list attempts;
    ck_ok(store_attempts_list(store, "job_a", &attempts, &diag));
    ck_assert_uint_eq(attempts.n, 1);
    ck_assert_int_eq(attempts.items[0].state, STORE_ATTEMPT_DIED);
    ck_assert_str_eq(attempts.items[0].last_words, "oh no");
    store_attempt_list_finish(&attempts);
    struct store_job job;
    ck_ok(store_job_get(store, "job_a", &job, &diag));
    ck_assert_uint_eq(job.n_failures, 1);
    store_job_finish(&job);
    close_all(store);
}
END_TEST

START_TEST(a_checkpoint_replaces_the_one_before_and_goes_with_the_job)
{
    struct store *store = open_new();
    struct store_checkpoint a = {.sha256 = HASH_A, .n_bytes = 5, .stage = 1}, read;
    struct store_checkpoint b = {.sha256 = HASH_B, .n_bytes = 6, .stage = 2};
    char replaced[STORE_HASH_SIZE], garbage[STORE_HASH_SIZE];
    bool referenced;
    make_job(store, "job_a", 0);
    struct store_attempt_ref ref = take(store, HASH_A);
    ck_ok(store_attempt_checkpoint(store, &ref, &a, replaced, &diag));
    ck_assert_str_eq(replaced, "");
    ck_ok(store_attempt_checkpoint(store, &ref, &a, replaced, &diag));
    ck_assert_str_eq(replaced, ""); /* the same again is nothing to collect */
    ck_ok(store_attempt_checkpoint(store, &ref, &b, replaced, &diag));
    ck_assert_str_eq(replaced, HASH_A);
    store = reopen(store);
    ck_ok(store_checkpoint_get(store, "job_a", &read, &diag));
    ck_assert_str_eq(read.sha256, HASH_B);
    ck_assert_uint_eq(read.stage, 2);
    ck_ok(store_blob_referenced(store, HASH_B, &referenced, &diag));
    ck_assert(referenced);
    struct store_job_move end = {.job_id = "job_a", .from = STORE_JOB_RUNNING, .to = STORE_JOB_FAILED,
                                 .attempt = 1, .attempt_state = STORE_ATTEMPT_FAILED, .error = "{\"type\":\"x\"}"};
    ck_ok(store_job_move(store, &end, garbage, &diag));
    ck_assert_str_eq(garbage, HASH_B);
    ck_status(store_checkpoint_get(store, "job_a", &read, &diag), GROOM_ENOTFOUND);
    ck_ok(store_blob_referenced(store, HASH_B, &referenced, &diag));
    ck_assert(!referenced);
    close_all(store);
}
END_TEST

START_TEST(events_are_numbered_without_gaps)
{
    struct store *store = open_new();
    struct store_event_list events;
    bool cancel;
    make_job(store, "job_a", 0);
    struct store_attempt_ref ref = take(store, HASH_A);
    struct store_event_new reported[] = {{"stage", "{\"name\":\"initialize\"}"}, {"progress", "{\"progress\":0.5}"}};
    struct store_progress progress = {.stage = "initialize", .stage_count = 5, .progress = 0.5, .eta_s = 3,
                                      .events = reported, .n_events = 2};
    ck_ok(store_attempt_progress(store, &ref, &progress, &cancel, &diag));
    ck_ok(move(store, "job_a", STORE_JOB_RUNNING, STORE_JOB_FAILED, 1, STORE_ATTEMPT_FAILED));
    store = reopen(store);
    ck_ok(store_events_since(store, "job_a", 0, 0, &events, &diag));
    static const char *const types[] = {"state", "state", "stage", "progress", "state"};
    ck_assert_uint_eq(events.n, 5);
    for (size_t i = 0; i < events.n; i++) {
        ck_assert_int_eq(events.items[i].sequence, (int64_t)i + 1);
        ck_assert_str_eq(events.items[i].type, types[i]);
    }
    ck_assert_str_eq(events.items[1].data, "{\"state\":\"running\",\"attempt\":1}");
    store_event_list_finish(&events);
    ck_ok(store_events_since(store, "job_a", 3, 1, &events, &diag));
    ck_assert_uint_eq(events.n, 1);
    ck_assert_int_eq(events.items[0].sequence, 4);
    store_event_list_finish(&events);
    ck_status(store_events_since(store, "job_b", 0, 0, &events, &diag), GROOM_ENOTFOUND);
    close_all(store);
}
END_TEST

START_TEST(a_loss_that_is_reported_again_is_kept_once)
{
    struct store *store = open_new();
    struct store_loss losses[] = {{"guides", 0, "chamfer", 2.5}, {"guides", 1, "chamfer", 1.5}};
    struct store_progress progress = {.progress = -1, .eta_s = -1, .losses = losses, .n_losses = 2};
    struct store_loss_list read;
    bool cancel;
    make_job(store, "job_a", 0);
    struct store_attempt_ref ref = take(store, HASH_A);
    ck_ok(store_attempt_progress(store, &ref, &progress, &cancel, &diag));
    losses[0].value = 2.25;
    ck_ok(store_attempt_progress(store, &ref, &progress, &cancel, &diag));
    ck_ok(store_losses_list(store, "job_a", &read, &diag));
    ck_assert_uint_eq(read.n, 2);
    ck_assert_double_eq(read.items[0].value, 2.25);
    ck_assert_int_eq(read.items[1].iteration, 1);
    store_loss_list_finish(&read);
    close_all(store);
}
END_TEST

START_TEST(progress_leaves_alone_what_it_does_not_name)
{
    struct store *store = open_new();
    struct store_progress stage = {.stage = "guides", .stage_index = 2, .stage_count = 5, .progress = 0.25,
                                   .eta_s = 9, .loss = "{\"chamfer\":1}"};
    struct store_progress nothing = {.progress = -1, .eta_s = -1};
    struct store_job job;
    bool cancel = true;
    make_job(store, "job_a", 0);
    struct store_attempt_ref ref = take(store, HASH_A);
    ck_ok(store_attempt_progress(store, &ref, &stage, &cancel, &diag));
    ck_assert(!cancel);
    ck_ok(store_attempt_progress(store, &ref, &nothing, &cancel, &diag));
    ck_ok(store_job_get(store, "job_a", &job, &diag));
    ck_assert_str_eq(job.stage, "guides");
    ck_assert_uint_eq(job.stage_index, 2);
    ck_assert_double_eq(job.progress, 0.25);
    ck_assert_double_eq(job.eta_s, -1);
    ck_assert_str_eq(job.loss, "{\"chamfer\":1}");
    store_job_finish(&job);
    close_all(store);
}
END_TEST

/* --- threads --------------------------------------------------------------------------------------- */

struct taker {
    struct store *store;
    int number, n_taken;
};

static void *take_all(void *user)
{
    struct taker *taker = user;
    bool taken = true;
    for (int i = 0; taken; i++) {
        struct store_attempt_ref ref;
        int64_t next;
        char token[64];
        snprintf(token, sizeof token, "%d-%d", taker->number, i);
        if (store_job_take(taker->store, token, &ref, &taken, &next, NULL) != GROOM_OK)
            break;
        taker->n_taken += taken;
    }
    return NULL;
}

START_TEST(no_job_is_taken_twice)
{
    struct store *store = open_new();
    pthread_t threads[4];
    struct taker takers[4];
    for (int i = 0; i < 50; i++) {
        char id[STORE_ID_SIZE];
        ck_ok(store_make_id("job_", id));
        make_job(store, id, 0);
    }
    for (int i = 0; i < 4; i++) {
        takers[i] = (struct taker){store, i, 0};
        ck_assert_int_eq(pthread_create(&threads[i], NULL, take_all, &takers[i]), 0);
    }
    int n_taken = 0;
    for (int i = 0; i < 4; i++) {
        pthread_join(threads[i], NULL);
        n_taken += takers[i].n_taken;
    }
    ck_assert_int_eq(n_taken, 50);
    struct store_counts counts;
    ck_ok(store_count(store, &counts, &diag));
    ck_assert_uint_eq(counts.jobs[STORE_JOB_RUNNING], 50);
    ck_assert_uint_eq(counts.jobs[STORE_JOB_QUEUED], 0);
    ck_ok(store_ping(store, &diag));
    close_all(store);
}
END_TEST

/* --- a killed process --------------------------------------------------------------------------------- */

/* Makes jobs and says each that the store has acknowledged. */
static void make_jobs_and_say(int fd)
{
    struct store *store;
    if (store_open(test_folder_path("groomd.db"), &store, NULL) != GROOM_OK)
        _exit(1);
    for (;;) {
        char id[STORE_ID_SIZE] = "";
        struct store_job_new job = {.id = id, .kind = "fit", .request = "{}", .options = "{}"};
        if (store_make_id("job_", id) != GROOM_OK || store_job_create(store, &job, NULL) != GROOM_OK ||
            write(fd, id, sizeof id) != (ssize_t)sizeof id)
            _exit(1);
    }
}

START_TEST(what_was_acknowledged_survives_a_kill)
{
    struct store *store = open_new();
    char id[STORE_ID_SIZE];
    store_close(store);
    for (int round = 0; round < 8; round++) {
        int ends[2], n_said = 0;
        ck_assert_int_eq(pipe(ends), 0);
        pid_t child = fork();
        if (child == 0)
            make_jobs_and_say(ends[1]);
        close(ends[1]);
        while (n_said < 3 + 5 * round && read(ends[0], id, sizeof id) == (ssize_t)sizeof id)
            n_said++;
        kill(child, SIGKILL);
        waitpid(child, NULL, 0);
        ck_assert_int_ge(n_said, 3);
        ck_ok(store_open(test_folder_path("groomd.db"), &store, &diag));
        do { /* the last one read, and all that were said after it */
            struct store_job job;
            ck_ok(store_job_get(store, id, &job, &diag));
            store_job_finish(&job);
        } while (read(ends[0], id, sizeof id) == (ssize_t)sizeof id);
        store_close(store);
        close(ends[0]);
    }
    test_folder_remove();
}
END_TEST

/* --- readers and the writer ------------------------------------------------------------------------------ */

static void *look_at_it(void *user)
{
    struct store_job job;
    bool *seen = user;
    *seen = store_job_get(job_store, "job_a", &job, NULL) == GROOM_OK && job.priority == 3;
    if (*seen)
        store_job_finish(&job);
    return NULL;
}

/* A transaction is open, and stays so until the look has ended: were it to wait, this would not end. */
START_TEST(a_look_waits_for_no_writer)
{
    struct store *store = job_store = open_new();
    struct connection *c;
    bool seen = false;
    pthread_t looker;
    make_job(store, "job_a", 3);
    ck_ok(transaction_begin(store, &c, &diag));
    ck_ok(database_execute(c->db, "UPDATE jobs SET priority = 4", &diag));
    ck_assert_int_eq(pthread_create(&looker, NULL, look_at_it, &seen), 0);
    pthread_join(looker, NULL);
    ck_status(transaction_end(c, GROOM_ECANCELLED, &diag), GROOM_ECANCELLED);
    ck_assert(seen);
    close_all(store);
}
END_TEST

/* What SQLite 3.40 demands: see database.h. */
START_TEST(readers_cannot_write_or_checkpoint)
{
    struct store *store = open_new();
    struct connection *c = read_begin(store);
    ck_status(database_execute(c->db, "DELETE FROM jobs", &diag), GROOM_EIO);
    read_end(c);
    ck_assert_int_eq(sqlite3_db_readonly(c->db, "main"), 1);
    ck_assert_int_ne(sqlite3_wal_checkpoint_v2(c->db, NULL, SQLITE_CHECKPOINT_TRUNCATE, NULL, NULL), SQLITE_OK);
    make_job(store, "job_a", 3);
    close_all(store);
}
END_TEST

/* --- copies while others write --------------------------------------------------------------------- */

#define MOST_WRITES 3000

struct writing {
    struct store *store;
    _Atomic int n, stop;
};

static void *write_on(void *user)
{
    struct writing *writing = user;
    char id[STORE_ID_SIZE];
    while (!writing->stop && writing->n < MOST_WRITES) {
        snprintf(id, sizeof id, "job_%d", writing->n);
        make_job(writing->store, id, 0);
        writing->n++;
    }
    return NULL;
}

/* It takes longer than the writes between its steps: it must not begin again with each of them. */
START_TEST(a_copy_is_one_state_and_ends_though_others_write)
{
    struct writing writing = {.store = open_new()};
    struct store_counts before, copied;
    struct store *copy;
    pthread_t thread;
    char *large = calloc(1, 16 << 20);
    struct store_array array = {.sha256 = HASH_B, .bytes = large, .n_bytes = 16 << 20};
    struct store_revision_new revision = first_revision;
    revision.arrays = &array;
    database_copy_pages = 1;
    ck_ok(database_execute(writing.store->writer.db, "PRAGMA synchronous = OFF", &diag)); /* many writes, quickly */
    ck_ok(store_groom_create(writing.store, &revision, &diag));
    ck_assert_int_eq(pthread_create(&thread, NULL, write_on, &writing), 0);
    while (writing.n < 3)
        sched_yield();
    ck_ok(store_count(writing.store, &before, &diag));
    ck_ok(store_copy(writing.store, test_folder_path("copy.db"), &diag));
    int n_meanwhile = writing.n;
    writing.stop = 1;
    pthread_join(thread, NULL);
    ck_assert_int_lt(n_meanwhile, MOST_WRITES); /* it has not waited for a quiet moment */
    ck_ok(store_open(test_folder_path("copy.db"), &copy, &diag));
    ck_ok(store_count(copy, &copied, &diag));
    ck_assert_uint_ge(copied.jobs[STORE_JOB_QUEUED], before.jobs[STORE_JOB_QUEUED]);
    ck_assert_uint_le(copied.jobs[STORE_JOB_QUEUED], (uint64_t)n_meanwhile + 1);
    store_close(copy);
    free(large);
    database_copy_pages = 2000;
    close_all(writing.store);
}
END_TEST

/* --- a full disk -------------------------------------------------------------------------------------- */

START_TEST(a_full_database_says_so_and_goes_on)
{
    struct store *store = open_new();
    char *large = calloc(1, 1 << 20);
    struct store_array array = {.sha256 = HASH_B, .bytes = large, .n_bytes = 1 << 20};
    struct store_revision_new revision = first_revision;
    revision.arrays = &array;
    ck_ok(database_execute(store->writer.db, "PRAGMA max_page_count = 100", &diag));
    ck_status(store_groom_create(store, &revision, &diag), GROOM_ENOSPC);
    ck_ok(database_execute(store->writer.db, "PRAGMA max_page_count = 100000", &diag));
    ck_ok(store_groom_create(store, &revision, &diag));
    free(large);
    close_all(store);
}
END_TEST

TEST_SUITE("store", the_first_schema_becomes_the_present_one, a_look_waits_for_no_writer, readers_cannot_write_or_checkpoint, a_newer_schema_is_refused, what_is_not_a_database_is_refused, a_damaged_database_is_refused,
           two_daemons_do_not_share_a_database, a_step_that_fails_leaves_the_version_before_it,
           ids_have_their_prefix_and_differ, times_are_rfc_3339,
           an_upload_comes_back_and_the_same_id_is_kept_once, the_id_of_an_upload_depends_on_bytes_and_options,
           pages_walk_a_list_from_new_to_old, revisions_are_kept_and_follow_each_other,
           arrays_come_back_byte_for_byte, a_revision_with_an_unknown_array_leaves_nothing,
           grooms_and_revisions_are_listed, jobs_are_taken_by_priority_then_age,
           an_idempotency_key_stands_for_what_it_made, an_idempotency_key_expires,
           projects_share_bytes_and_nothing_else, an_owner_has_so_many_bytes_and_no_more,
           owners_take_turns_and_positions_say_so, a_turn_is_remembered_after_its_job, a_full_queue_takes_no_more,
           every_change_is_in_the_audit_and_stays_there, only_the_drawn_transitions_are_allowed,
           success_and_its_groom_are_one_transaction,
           success_may_bring_several_grooms_and_their_uploads, a_preparation_is_kept_under_its_key_and_goes_with_its_subject,
           an_input_that_stands_deep_in_a_request_is_not_removed,
           a_job_that_is_to_be_cancelled_neither_succeeds_nor_queues_again, a_stale_attempt_is_fenced_off, a_stale_run_of_an_attempt_is_fenced_off,
           a_back_off_holds_a_job_back, a_checkpoint_replaces_the_one_before_and_goes_with_the_job,
           events_are_numbered_without_gaps, a_loss_that_is_reported_again_is_kept_once,
           progress_leaves_alone_what_it_does_not_name, no_job_is_taken_twice,
           what_was_acknowledged_survives_a_kill, a_copy_is_one_state_and_ends_though_others_write,
           a_full_database_says_so_and_goes_on)
