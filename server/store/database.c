#include "server/store/database.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "proto/json_text.h"

groom_status database_fail(sqlite3 *db, int code, struct groom_diag *diag)
{
    groom_status status;
    switch (code & 0xff) {
    case SQLITE_FULL: status = GROOM_ENOSPC; break;
    case SQLITE_NOMEM: status = GROOM_ENOMEM; break;
    case SQLITE_IOERR:
        status = db && sqlite3_system_errno(db) == ENOSPC ? GROOM_ENOSPC : GROOM_EIO;
        break;
    case SQLITE_READONLY: case SQLITE_CANTOPEN: case SQLITE_BUSY: case SQLITE_LOCKED:
        status = GROOM_EIO;
        break;
    case SQLITE_CORRUPT: case SQLITE_NOTADB: status = GROOM_EFORMAT; break;
    default: status = GROOM_EINTERNAL;
    }
    if ((code & 0xff) == SQLITE_BUSY)
        return groom_fail(diag, status, "another process has the database open: one groomd serves a data folder");
    return groom_fail(diag, status, "the database: %s", db ? sqlite3_errmsg(db) : sqlite3_errstr(code));
}

groom_status database_execute(sqlite3 *db, const char *sql, struct groom_diag *diag)
{
    int code = sqlite3_exec(db, sql, NULL, NULL, NULL);
    return code == SQLITE_OK ? GROOM_OK : database_fail(db, code, diag);
}

/* --- transactions ------------------------------------------------------------------ */

groom_status transaction_begin(struct store *store, struct connection **c, struct groom_diag *diag)
{
    pthread_mutex_lock(&store->writing);
    groom_status status = database_execute(store->writer.db, "BEGIN IMMEDIATE", diag);
    if (status != GROOM_OK)
        pthread_mutex_unlock(&store->writing);
    else
        *c = &store->writer;
    return status;
}

groom_status transaction_end(struct connection *c, groom_status status, struct groom_diag *diag)
{
    if (status == GROOM_OK && json_memory_failed()) /* what is being written may lack a member */
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for what was to be written");
    if (status == GROOM_OK)
        status = database_execute(c->db, "COMMIT", diag);
    /* some failures (a full disk) have rolled back already */
    if (status != GROOM_OK && !sqlite3_get_autocommit(c->db))
        sqlite3_exec(c->db, "ROLLBACK", NULL, NULL, NULL);
    pthread_mutex_unlock(&c->store->writing);
    return status;
}

static void step_once(struct connection *c, const char *sql)
{
    struct query q = query_open(c, sql, NULL);
    query_row(&q);
    groom_status status = query_end(&q);
    (void)status; /* without it each statement sees a state of its own, or says why it sees none */
}

struct connection *read_begin(struct store *store)
{
    pthread_mutex_lock(&store->lock);
    while (!store->free)
        pthread_cond_wait(&store->freed, &store->lock);
    struct connection *c = store->free;
    store->free = c->next;
    pthread_mutex_unlock(&store->lock);
    step_once(c, "BEGIN");
    return c;
}

void read_end(struct connection *c)
{
    struct store *store = c->store;
    step_once(c, "COMMIT");
    pthread_mutex_lock(&store->lock);
    c->next = store->free;
    store->free = c;
    pthread_cond_signal(&store->freed);
    pthread_mutex_unlock(&store->lock);
}

/* --- queries ------------------------------------------------------------------------ */

static int prepare(struct connection *c, const char *sql, sqlite3_stmt **statement)
{
    for (size_t i = 0; i < c->n_cached; i++) {
        if (c->cache[i].sql == sql) {
            *statement = c->cache[i].statement;
            return SQLITE_OK;
        }
    }
    if (c->n_cached == DATABASE_MAX_STATEMENTS)
        return SQLITE_FULL;
    int code = sqlite3_prepare_v3(c->db, sql, -1, SQLITE_PREPARE_PERSISTENT, statement, NULL);
    if (code == SQLITE_OK) {
        c->cache[c->n_cached].sql = sql;
        c->cache[c->n_cached++].statement = *statement;
    }
    return code;
}

static void note(struct query *q, int code)
{
    if (code != SQLITE_OK && q->status == GROOM_OK)
        q->status = database_fail(q->connection->db, code, q->diag);
}

struct query query_open(struct connection *c, const char *sql, struct groom_diag *diag)
{
    struct query q = {.connection = c, .status = GROOM_OK, .diag = diag};
    note(&q, prepare(c, sql, &q.statement));
    return q;
}

void query_text(struct query *q, int parameter, const char *text)
{
    if (q->status == GROOM_OK)
        note(q, sqlite3_bind_text(q->statement, parameter, text, -1, SQLITE_STATIC));
}

void query_integer(struct query *q, int parameter, int64_t value)
{
    if (q->status == GROOM_OK)
        note(q, sqlite3_bind_int64(q->statement, parameter, value));
}

void query_real(struct query *q, int parameter, double value)
{
    if (q->status == GROOM_OK)
        note(q, sqlite3_bind_double(q->statement, parameter, value));
}

void query_bytes(struct query *q, int parameter, const void *bytes, size_t n_bytes)
{
    if (q->status != GROOM_OK)
        return;
    /* a NULL pointer would bind NULL: no bytes are not an absent value */
    note(q, bytes ? sqlite3_bind_blob64(q->statement, parameter, bytes, n_bytes, SQLITE_STATIC)
                  : sqlite3_bind_zeroblob(q->statement, parameter, 0));
}

bool query_row(struct query *q)
{
    if (q->status != GROOM_OK)
        return false;
    int code = sqlite3_step(q->statement);
    if (code != SQLITE_ROW && code != SQLITE_DONE)
        note(q, code);
    return code == SQLITE_ROW;
}

char *query_string(struct query *q, int column)
{
    const char *text = (const char *)sqlite3_column_text(q->statement, column);
    if (!text && sqlite3_column_type(q->statement, column) == SQLITE_NULL)
        return NULL;
    char *copy = text ? strdup(text) : NULL;
    if (!copy)
        note(q, SQLITE_NOMEM);
    return copy;
}

void query_copy(struct query *q, int column, char *text, size_t size)
{
    const char *value = (const char *)sqlite3_column_text(q->statement, column);
    size_t n = value ? strlen(value) : 0;
    if (n >= size)
        n = size - 1;
    if (n > 0)
        memcpy(text, value, n);
    text[n] = 0;
}

int64_t query_int64(struct query *q, int column) { return sqlite3_column_int64(q->statement, column); }
double query_double(struct query *q, int column) { return sqlite3_column_double(q->statement, column); }

void *query_append(struct query *q, void *items, size_t *n, size_t item_size)
{
    char **array = items;
    if ((*n & (*n - 1)) == 0) { /* 0, 1, 2, 4, …: it is full */
        char *larger = realloc(*array, (*n ? 2 * *n : 1) * item_size);
        if (!larger) {
            note(q, SQLITE_NOMEM);
            return NULL;
        }
        *array = larger;
    }
    char *item = *array + (*n)++ * item_size;
    memset(item, 0, item_size);
    return item;
}

groom_status query_end(struct query *q)
{
    if (q->statement) {
        sqlite3_reset(q->statement);
        sqlite3_clear_bindings(q->statement);
        q->statement = NULL;
    }
    return q->status;
}

groom_status query_run(struct query *q, int64_t *n_changed)
{
    while (query_row(q))
        continue;
    if (n_changed)
        *n_changed = q->status == GROOM_OK ? sqlite3_changes64(q->connection->db) : 0;
    return query_end(q);
}

/* --- pages ----------------------------------------------------------------------------- */

int64_t page_limit(struct store_page page) { return (int64_t)(page.limit ? page.limit : 100) + 1; }
int64_t page_before(struct store_page page) { return page.before > 0 ? page.before : INT64_MAX; }
