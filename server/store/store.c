/* Opening and closing; ids and times. */
#include "server/store/store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

#include "server/store/database.h"

/* --- where it is ---------------------------------------------------------------------- */

#define FILE_NAME "groomd.db" /* beside it, SQLite's own: groomd.db-wal, groomd.db-shm */

void store_place(const char *folder, char place[STORE_PLACE_SIZE])
{
    snprintf(place, STORE_PLACE_SIZE, "%s/" FILE_NAME, folder);
}

bool store_is_in(const char *folder)
{
    char place[STORE_PLACE_SIZE];
    store_place(folder, place);
    return access(place, F_OK) == 0;
}

bool store_has_entry(const char *name) { return !strncmp(name, FILE_NAME, sizeof FILE_NAME - 1); }

/* --- opening ------------------------------------------------------------------------- */

const char *database_vfs = "unix-excl";

/* FULL: a commit that was acknowledged survives the loss of power (NORMAL may lose the last ones in
 * WAL mode). */
static const char writer_pragmas[] = "PRAGMA journal_mode = WAL;"
                                     "PRAGMA synchronous = FULL;"
                                     "PRAGMA foreign_keys = ON;"
                                     "PRAGMA trusted_schema = OFF;"
                                     "PRAGMA temp_store = MEMORY;"
                                     "PRAGMA journal_size_limit = 67108864;";
static const char reader_pragmas[] = "PRAGMA query_only = ON;"
                                     "PRAGMA trusted_schema = OFF;"
                                     "PRAGMA temp_store = MEMORY;";

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

static groom_status open_connection(struct store *store, const char *path, int flags, const char *pragmas,
                                    struct connection *c, struct groom_diag *diag)
{
    c->store = store;
    int code = sqlite3_open_v2(path, &c->db, flags | SQLITE_OPEN_NOMUTEX, database_vfs);
    if (code != SQLITE_OK)
        return database_fail(c->db, code, diag);
    sqlite3_extended_result_codes(c->db, 1);
    sqlite3_busy_timeout(c->db, 2000);
    return database_execute(c->db, pragmas, diag);
}

static groom_status open_readers(struct store *store, const char *path, struct groom_diag *diag)
{
    for (size_t i = 0; i < DATABASE_READERS; i++) {
        struct connection *c = &store->readers[i];
        groom_status status = open_connection(store, path, SQLITE_OPEN_READONLY, reader_pragmas, c, diag);
        if (status != GROOM_OK)
            return status;
        c->next = store->free;
        store->free = c;
    }
    return GROOM_OK;
}

static groom_status open_database(struct store *store, const char *path, struct groom_diag *diag)
{
    sqlite3 *db;
    groom_status status = open_connection(store, path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE,
                                          writer_pragmas, &store->writer, diag);
    if (status == GROOM_OK && (db = store->writer.db) && (status = check(db, path, diag)) == GROOM_OK &&
        (status = schema_migrate(db, schema_steps, schema_version, diag)) == GROOM_OK)
        status = open_readers(store, path, diag);
    return status;
}

groom_status store_open(const char *path, struct store **store, struct groom_diag *diag)
{
    struct store *made = calloc(1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the store");
    pthread_mutex_init(&made->writing, NULL);
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->freed, NULL);
    groom_status status = open_database(made, path, diag);
    if (status != GROOM_OK) {
        store_close(made);
        return status;
    }
    *store = made;
    return GROOM_OK;
}

static void close_connection(struct connection *c)
{
    for (size_t i = 0; i < c->n_cached; i++)
        sqlite3_finalize(c->cache[i].statement);
    sqlite3_close(c->db);
}

/* The writer last: whoever closes last checkpoints. */
void store_close(struct store *store)
{
    if (!store)
        return;
    for (size_t i = 0; i < DATABASE_READERS; i++)
        close_connection(&store->readers[i]);
    close_connection(&store->writer);
    pthread_cond_destroy(&store->freed);
    pthread_mutex_destroy(&store->lock);
    pthread_mutex_destroy(&store->writing);
    free(store);
}

/* A database that lies in the cache reads well on a dead disk: it is written to. */
static groom_status beat(struct store *store, struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "INSERT INTO heartbeat (one, at) VALUES (1, ?1)"
                                   " ON CONFLICT (one) DO UPDATE SET at = ?1", diag);
    query_integer(&q, 1, store_now_ms());
    return transaction_end(c, query_run(&q, NULL), diag);
}

/* Whoever asks often is told what was found last: each beat waits for the disk. */
groom_status store_ping(struct store *store, struct groom_diag *diag)
{
    struct groom_diag found = {0};
    int64_t now = store_now_ms();
    pthread_mutex_lock(&store->lock);
    bool fresh = store->ping.at_ms && now >= store->ping.at_ms && now - store->ping.at_ms < 1000;
    groom_status status = store->ping.status;
    if (fresh && diag)
        *diag = store->ping.diag;
    pthread_mutex_unlock(&store->lock);
    if (fresh)
        return status;
    status = beat(store, &found);
    pthread_mutex_lock(&store->lock);
    store->ping.at_ms = now;
    store->ping.status = status;
    store->ping.diag = found;
    pthread_mutex_unlock(&store->lock);
    if (diag)
        *diag = found;
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
