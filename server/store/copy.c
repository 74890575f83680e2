/* A consistent copy of the database while it is in use, and what is asked of a copy. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/store/database.h"

int database_copy_pages = 2000;

/* --- copying ------------------------------------------------------------------------------ */

static groom_status open_copy(const char *path, int flags, sqlite3 **db, struct groom_diag *diag)
{
    int code = sqlite3_open_v2(path, db, flags | SQLITE_OPEN_NOMUTEX, database_vfs);
    if (code != SQLITE_OK)
        return database_fail(*db, code, diag);
    sqlite3_extended_result_codes(*db, 1);
    return database_execute(*db, "PRAGMA synchronous = FULL; PRAGMA journal_mode = DELETE; PRAGMA foreign_keys = ON",
                            diag);
}

/* All pages of `from`, as they are in its present read transaction. That begins with something read: else each
 * step would see a state of its own, and begin again from the first page whenever others have written meanwhile. */
static groom_status copy_pages(sqlite3 *from, sqlite3 *to, struct groom_diag *diag)
{
    groom_status status = database_execute(from, "SELECT count(*) FROM sqlite_schema", diag);
    if (status != GROOM_OK)
        return status;
    sqlite3_backup *backup = sqlite3_backup_init(to, "main", from, "main");
    if (!backup)
        return database_fail(to, sqlite3_errcode(to), diag);
    int code;
    do
        code = sqlite3_backup_step(backup, database_copy_pages);
    while (code == SQLITE_OK);
    sqlite3_backup_finish(backup);
    return code == SQLITE_DONE ? GROOM_OK : database_fail(to, code, diag);
}

static groom_status copy_into(sqlite3 *from, const char *path, struct groom_diag *diag)
{
    sqlite3 *to = NULL;
    groom_status status = open_copy(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, &to, diag);
    if (status == GROOM_OK)
        status = copy_pages(from, to, diag);
    if (status == GROOM_OK) /* what was copied says WAL: one file is easier to carry */
        status = database_execute(to, "PRAGMA journal_mode = DELETE", diag);
    sqlite3_close(to);
    if (status != GROOM_OK)
        store_copy_remove(path);
    return status;
}

/* A reader sees one state for as long as it takes, and stops nobody. */
groom_status store_copy(struct store *store, const char *path, struct groom_diag *diag)
{
    struct connection *c = read_begin(store);
    groom_status status = copy_into(c->db, path, diag);
    read_end(c);
    return status;
}

groom_status store_copy_file(const char *from, const char *path, struct groom_diag *diag)
{
    sqlite3 *db = NULL;
    int code = sqlite3_open_v2(from, &db, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, database_vfs);
    groom_status status = code == SQLITE_OK ? copy_into(db, path, diag) : database_fail(db, code, diag);
    sqlite3_close(db);
    return status;
}

void store_copy_remove(const char *path)
{
    static const char *const suffixes[] = {"", "-journal", "-wal", "-shm"};
    char name[1600];
    for (size_t i = 0; i < sizeof suffixes / sizeof suffixes[0]; i++) {
        snprintf(name, sizeof name, "%s%s", path, suffixes[i]);
        unlink(name);
    }
}

/* --- a copy as a store of its own ------------------------------------------------------------ */

groom_status database_open_copy(const char *path, struct store *store, struct groom_diag *diag)
{
    *store = (struct store){.writer.store = store};
    pthread_mutex_init(&store->writing, NULL);
    groom_status status = open_copy(path, SQLITE_OPEN_READWRITE, &store->writer.db, diag);
    if (status == GROOM_OK)
        status = schema_migrate(store->writer.db, schema_steps, schema_version, diag);
    if (status != GROOM_OK)
        database_close_copy(store);
    return status;
}

void database_close_copy(struct store *store)
{
    for (size_t i = 0; i < store->writer.n_cached; i++)
        sqlite3_finalize(store->writer.cache[i].statement);
    sqlite3_close(store->writer.db);
    pthread_mutex_destroy(&store->writing);
}

groom_status store_copy_drop_upload(const char *path, const char *id, struct groom_diag *diag)
{
    struct store copy;
    groom_status status = database_open_copy(path, &copy, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(&copy.writer, "DELETE FROM uploads WHERE id = ?1", diag);
    query_text(&q, 1, id);
    status = query_run(&q, NULL);
    database_close_copy(&copy);
    return status;
}
