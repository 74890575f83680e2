/* Opening and closing; ids and times. */
#include "server/store/store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

#include "server/store/database.h"

/* --- opening ------------------------------------------------------------------------- */

/* FULL: a commit that was acknowledged survives the loss of power (NORMAL may lose the last ones in
 * WAL mode). Exclusive: this process alone, which also keeps the WAL index off shared memory. */
static const char pragmas[] = "PRAGMA locking_mode = EXCLUSIVE;"
                              "PRAGMA journal_mode = WAL;"
                              "PRAGMA synchronous = FULL;"
                              "PRAGMA foreign_keys = ON;"
                              "PRAGMA trusted_schema = OFF;"
                              "PRAGMA temp_store = MEMORY;"
                              "PRAGMA journal_size_limit = 67108864;";

/* quick_check gives one row "ok", or a row for each thing that is wrong. */
static groom_status check(sqlite3 *db, const char *path, struct groom_diag *diag)
{
    sqlite3_stmt *statement = NULL;
    int code = sqlite3_prepare_v2(db, "PRAGMA quick_check(1)", -1, &statement, NULL);
    if (code == SQLITE_OK)
        code = sqlite3_step(statement);
    groom_status status = GROOM_OK;
    if (code != SQLITE_ROW) {
        status = database_fail(db, code, diag);
    } else {
        const char *answer = (const char *)sqlite3_column_text(statement, 0);
        if (!answer || strcmp(answer, "ok") != 0)
            status = groom_fail(diag, GROOM_EFORMAT, "%s is damaged (%s): restore a backup", path,
                                answer ? answer : "no answer");
    }
    sqlite3_finalize(statement);
    return status;
}

static groom_status open_database(struct store *store, const char *path, struct groom_diag *diag)
{
    int code = sqlite3_open_v2(path, &store->db,
                               SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, NULL);
    if (code != SQLITE_OK)
        return database_fail(store->db, code, diag);
    sqlite3_extended_result_codes(store->db, 1);
    sqlite3_busy_timeout(store->db, 2000);
    groom_status status;
    if ((status = database_execute(store->db, pragmas, diag)) == GROOM_OK &&
        (status = check(store->db, path, diag)) == GROOM_OK)
        status = schema_migrate(store->db, schema_steps, schema_version, diag);
    return status;
}

groom_status store_open(const char *path, struct store **store, struct groom_diag *diag)
{
    struct store *made = calloc(1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the store");
    pthread_mutex_init(&made->lock, NULL);
    groom_status status = open_database(made, path, diag);
    if (status != GROOM_OK) {
        store_close(made);
        return status;
    }
    *store = made;
    return GROOM_OK;
}

void store_close(struct store *store)
{
    if (!store)
        return;
    for (size_t i = 0; i < store->n_cached; i++)
        sqlite3_finalize(store->cache[i].statement);
    sqlite3_close(store->db);
    pthread_mutex_destroy(&store->lock);
    free(store);
}

groom_status store_ping(struct store *store, struct groom_diag *diag)
{
    store_lock(store);
    struct query q = query_open(store, "SELECT count(*) FROM sqlite_schema", diag);
    query_row(&q);
    groom_status status = query_end(&q);
    store_unlock(store);
    return status;
}

/* --- ids and times ---------------------------------------------------------------------- */

groom_status store_make_id(const char *prefix, char id[STORE_ID_SIZE])
{
    unsigned char random[20];
    if (getrandom(random, sizeof random, 0) != (ssize_t)sizeof random)
        return GROOM_EIO;
    int n = snprintf(id, STORE_ID_SIZE, "%.8s", prefix);
    for (size_t i = 0; i < sizeof random; i++)
        id[n++] = "abcdefghijklmnopqrstuvwxyz234567"[random[i] & 31];
    id[n] = 0;
    return GROOM_OK;
}

int64_t store_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

void store_time_text(int64_t time_ms, char text[32])
{
    time_t seconds = (time_t)(time_ms / 1000);
    struct tm tm;
    gmtime_r(&seconds, &tm);
    size_t n = strftime(text, 32, "%Y-%m-%dT%H:%M:%S", &tm);
    snprintf(text + n, 32 - n, ".%03dZ", (int)(time_ms % 1000));
}
