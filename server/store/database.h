/* The store's own way to SQLite: one connection that writes, a few that read, queries with a sticky
 * status.
 *
 * In WAL mode a reader sees what was committed when it began and waits for nobody, so that a look at a
 * job does not stand behind another's fsync. SQLite 3.40 can damage a WAL where two connections write
 * or checkpoint at the same instant: the writer alone does either; the others are opened read-only.
 *
 * A query goes on after a failure as if nothing had happened and says so at its end, so that a
 * function reads straight down:
 *
 *     struct query q = query_open(c, "SELECT name FROM grooms WHERE id = ?1", diag);
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

#define DATABASE_MAX_STATEMENTS 192

#define DATABASE_READERS        4

/* One way to the database, one thread's at a time. */
struct connection {
    struct store *store;
    sqlite3 *db;
    struct connection *next; /* of the readers that nobody uses */
    /* Prepared once, found again by the address of their text. */
    struct {
        const char *sql;
        sqlite3_stmt *statement;
    } cache[DATABASE_MAX_STATEMENTS];
    size_t n_cached;
};

struct store {
    pthread_mutex_t writing; /* writers take turns */
    struct connection writer, readers[DATABASE_READERS];
    pthread_mutex_t lock; /* of what follows */
    pthread_cond_t freed;
    struct { /* what store_ping found last */
        int64_t at_ms;
        groom_status status;
        struct groom_diag diag;
    } ping;
    struct connection *free;
};

/* The seam below: SQLite's "unix-excl", which keeps other processes out and the WAL's index in memory
 * that only connections of this process share. A test names another before store_open. */
extern const char *database_vfs;

/* --- transactions ------------------------------------------------------------------ */

/* Take the writer, and begin. On failure nothing is taken. */
GROOM_MUST_CHECK groom_status transaction_begin(struct store *store, struct connection **c,
                                                struct groom_diag *diag);
/* Commit where `status` is GROOM_OK, else roll back; give it back. returns what became of it. */
GROOM_MUST_CHECK groom_status transaction_end(struct connection *c, groom_status status,
                                              struct groom_diag *diag);
/* A reader for several statements that see one state of things. Waits only where all are in use. */
struct connection *read_begin(struct store *store);
void read_end(struct connection *c);

/* A result code of SQLite as a status, with its words. */
groom_status database_fail(sqlite3 *db, int code, struct groom_diag *diag);
/* Several statements without parameters. */
GROOM_MUST_CHECK groom_status database_execute(sqlite3 *db, const char *sql, struct groom_diag *diag);

/* --- queries ---------------------------------------------------------------------- */

struct query {
    struct connection *connection;
    sqlite3_stmt *statement;
    groom_status status;
    struct groom_diag *diag;
};

/* `sql` is a string literal. */
struct query query_open(struct connection *c, const char *sql, struct groom_diag *diag);
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

/* --- copies (copy.c) ------------------------------------------------------------------------- */

/* How many pages are copied at a time; a test says fewer. */
extern int database_copy_pages;
/* A copy as a store with its writer alone, brought to the present schema. */
GROOM_MUST_CHECK groom_status database_open_copy(const char *path, struct store *store, struct groom_diag *diag);
void database_close_copy(struct store *store);

/* --- parts of larger transactions ----------------------------------------------------------- */

groom_status groom_add_revision(struct connection *c, const struct store_revision_new *revision,
                                uint32_t expected_latest, struct groom_diag *diag);
groom_status groom_insert(struct connection *c, const struct store_revision_new *revision, const char *project,
                          int64_t now, struct groom_diag *diag);
/* While it is running and is its job's last one; *cancel (or NULL): the job is to be cancelled.
 * returns  GROOM_ECONFLICT (fenced) */
groom_status attempt_may_speak(struct connection *c, const struct store_attempt_ref *ref, bool *cancel,
                               struct groom_diag *diag);
/* As store_asset_put. */
groom_status asset_insert(struct connection *c, const struct store_asset *asset, uint64_t max_bytes, int64_t now,
                          bool *created, struct groom_diag *diag);
groom_status quality_insert(struct connection *c, const struct store_quality *key, const char *report, int64_t now,
                            struct groom_diag *diag);
groom_status event_append(struct connection *c, const char *job_id, const char *type, const char *data,
                          int64_t now, struct groom_diag *diag);
groom_status webhook_insert(struct connection *c, const char *job_id, const struct store_webhook_new *webhook,
                            int64_t now, struct groom_diag *diag);
groom_status webhooks_release(struct connection *c, const char *job_id, int64_t now, struct groom_diag *diag);
groom_status audit_append(struct connection *c, const char *project, const char *action, const char *subject,
                          const char *detail, int64_t now, struct groom_diag *diag);
/* The Idempotency-Key of the present request, where it has one, stands for this from now on.
 * returns  GROOM_ECONFLICT where another came first */
groom_status key_insert(struct connection *c, const char *project, const char *subject, uint32_t number, int64_t now,
                        struct groom_diag *diag);
groom_status usage_read(struct connection *c, const char *owner, struct store_usage *usage,
                        struct groom_diag *diag);
/* "" and NULL are the default project. */
const char *project_or_default(const char *project);

/* The queue in its order, as rows (seq, position): priorities first; then owners in turn, those first of
 * whose jobs fewer run, and among these the one whose turn is longest ago; an owner's own by age.
 * `which` narrows it down ("AND not_before <= ?1"). */
#define QUEUE_IN_ORDER(which)                                                                      \
    "(WITH running AS (SELECT owner, count(*) AS n FROM jobs WHERE state = 1 GROUP BY owner),"     \
    " waiting AS (SELECT jobs.seq, priority, coalesce(turns.taken, 0) AS taken, coalesce(running.n, 0) +" \
    "  row_number() OVER (PARTITION BY jobs.owner, priority ORDER BY jobs.seq) AS turn"            \
    "  FROM jobs LEFT JOIN running USING (owner) LEFT JOIN turns USING (owner) WHERE state = 0 " which ")" \
    " SELECT seq, row_number() OVER (ORDER BY priority DESC, turn, taken, seq) - 1 AS position FROM waiting)"

/* The limit of a page, one more than asked for, so that a next page shows itself. */
int64_t page_limit(struct store_page page);
int64_t page_before(struct store_page page);

#endif
