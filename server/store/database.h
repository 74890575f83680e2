/* The store's own way to SQLite: one connection, one lock, queries with a sticky status.
 *
 * A query goes on after a failure as if nothing had happened and says so at its end, so that a
 * function reads straight down:
 *
 *     struct query q = query_open(store, "SELECT name FROM grooms WHERE id = ?1", diag);
 *     query_text(&q, 1, id);
 *     if (query_row(&q))
 *         name = query_string(&q, 0);
 *     return query_end(&q);
 */
#ifndef STORE_DATABASE_H
#define STORE_DATABASE_H

#include <pthread.h>
#include <sqlite3.h>

#include "server/store/store.h"

#define DATABASE_MAX_STATEMENTS 96

struct store {
    sqlite3 *db;
    pthread_mutex_t lock;
    /* Prepared once, found again by the address of their text. */
    struct {
        const char *sql;
        sqlite3_stmt *statement;
    } cache[DATABASE_MAX_STATEMENTS];
    size_t n_cached;
};

/* --- transactions ------------------------------------------------------------------ */

/* Lock, and begin. On failure nothing is locked. */
GROOM_MUST_CHECK groom_status transaction_begin(struct store *store, struct groom_diag *diag);
/* Commit where `status` is GROOM_OK, else roll back; unlock. returns what became of it. */
GROOM_MUST_CHECK groom_status transaction_end(struct store *store, groom_status status, struct groom_diag *diag);
/* For what only reads, in one statement or several. */
void store_lock(struct store *store);
void store_unlock(struct store *store);

/* A result code of SQLite as a status, with its words. */
groom_status database_fail(sqlite3 *db, int code, struct groom_diag *diag);
/* Several statements without parameters. */
GROOM_MUST_CHECK groom_status database_execute(sqlite3 *db, const char *sql, struct groom_diag *diag);

/* --- queries; the store is locked ------------------------------------------------------ */

struct query {
    struct store *store;
    sqlite3_stmt *statement;
    groom_status status;
    struct groom_diag *diag;
};

/* `sql` is a string literal. */
struct query query_open(struct store *store, const char *sql, struct groom_diag *diag);
/* Bound bytes are borrowed until query_end. NULL binds NULL. */
void query_text(struct query *q, int parameter, const char *text);
void query_integer(struct query *q, int parameter, int64_t value);
void query_real(struct query *q, int parameter, double value);
void query_bytes(struct query *q, int parameter, const void *bytes, size_t n_bytes);
/* The next row; false at the end and after a failure. */
bool query_row(struct query *q);
/* A copy of a text column, NULL for NULL; malloc'ed. */
char *query_string(struct query *q, int column);
/* The same into a fixed place. */
void query_copy(struct query *q, int column, char *text, size_t size);
int64_t query_int64(struct query *q, int column);
double query_double(struct query *q, int column);
/* One more zeroed item at the end of a malloc'ed array that doubles; NULL where memory is out. */
void *query_append(struct query *q, void *items, size_t *n, size_t item_size);
GROOM_MUST_CHECK groom_status query_end(struct query *q);
/* For statements without rows: step and end. *n_changed (or NULL) is how many rows it touched. */
GROOM_MUST_CHECK groom_status query_run(struct query *q, int64_t *n_changed);

/* --- the schema (schema.c) ---------------------------------------------------------------- */

/* Bring the database to version `n`: step i makes version i + 1, each in a transaction of its own.
 * returns  GROOM_EFORMAT where the database is newer than that */
GROOM_MUST_CHECK groom_status schema_migrate(sqlite3 *db, const char *const *steps, int n,
                                             struct groom_diag *diag);
extern const char *const schema_steps[];
extern const int schema_version;

/* --- parts of larger transactions ----------------------------------------------------------- */

groom_status groom_insert(struct store *store, const struct store_revision_new *revision, int64_t now,
                          struct groom_diag *diag);
groom_status event_append(struct store *store, const char *job_id, const char *type, const char *data,
                          int64_t now, struct groom_diag *diag);
/* The limit of a page, one more than asked for, so that a next page shows itself. */
int64_t page_limit(struct store_page page);
int64_t page_before(struct store_page page);

#endif
