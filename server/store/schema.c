/* The tables, and how a database of an earlier version becomes one of the present. A step that has
 * been released is never changed: what changes a table is a new step. */
#include <stdio.h>

#include "server/store/database.h"

static const char version_1[] =
    /* uploads; the bytes are the blob `sha256` */
    "CREATE TABLE assets ("
    "  seq INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, kind INTEGER NOT NULL,"
    "  sha256 TEXT NOT NULL, n_bytes INTEGER NOT NULL, format TEXT NOT NULL, unit_m REAL NOT NULL,"
    "  up TEXT NOT NULL, name TEXT NOT NULL, metadata TEXT NOT NULL, created INTEGER NOT NULL) STRICT;"
    "CREATE INDEX assets_by_hash ON assets (sha256);"
    "CREATE INDEX assets_by_kind ON assets (kind, seq);"

    /* grooms: nothing of a revision ever changes */
    "CREATE TABLE grooms ("
    "  seq INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, name TEXT NOT NULL,"
    "  latest INTEGER NOT NULL, created INTEGER NOT NULL, changed INTEGER NOT NULL) STRICT;"
    "CREATE TABLE revisions ("
    "  groom_id TEXT NOT NULL REFERENCES grooms (id), number INTEGER NOT NULL, parent INTEGER NOT NULL,"
    "  name TEXT NOT NULL, document TEXT NOT NULL, note TEXT NOT NULL, created INTEGER NOT NULL,"
    "  PRIMARY KEY (groom_id, number)) STRICT;"
    "CREATE TABLE arrays (sha256 TEXT NOT NULL UNIQUE, bytes BLOB NOT NULL) STRICT;"
    "CREATE TABLE revision_arrays ("
    "  groom_id TEXT NOT NULL, number INTEGER NOT NULL, sha256 TEXT NOT NULL REFERENCES arrays (sha256),"
    "  PRIMARY KEY (groom_id, number, sha256),"
    "  FOREIGN KEY (groom_id, number) REFERENCES revisions (groom_id, number)) STRICT, WITHOUT ROWID;"
    "CREATE INDEX revision_arrays_by_hash ON revision_arrays (sha256);"

    /* the queue */
    "CREATE TABLE jobs ("
    "  seq INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, kind TEXT NOT NULL,"
    "  state INTEGER NOT NULL, priority INTEGER NOT NULL, not_before INTEGER NOT NULL DEFAULT 0,"
    "  request TEXT NOT NULL, options TEXT NOT NULL,"
    "  stage TEXT NOT NULL DEFAULT '', stage_index INTEGER NOT NULL DEFAULT 0,"
    "  stage_count INTEGER NOT NULL DEFAULT 0, progress REAL NOT NULL DEFAULT 0,"
    "  eta_s REAL NOT NULL DEFAULT -1, loss TEXT NOT NULL DEFAULT '{}',"
    "  attempt INTEGER NOT NULL DEFAULT 0, n_failures INTEGER NOT NULL DEFAULT 0,"
    "  cancel_requested INTEGER NOT NULL DEFAULT 0, result TEXT, error TEXT,"
    "  n_events INTEGER NOT NULL DEFAULT 0, created INTEGER NOT NULL,"
    "  started INTEGER NOT NULL DEFAULT 0, finished INTEGER NOT NULL DEFAULT 0) STRICT;"
    "CREATE INDEX jobs_queued ON jobs (priority DESC, seq) WHERE state = 0;"
    "CREATE INDEX jobs_by_state ON jobs (state, seq);"
    "CREATE TABLE attempts ("
    "  job_id TEXT NOT NULL REFERENCES jobs (id), number INTEGER NOT NULL, token_hash TEXT NOT NULL UNIQUE,"
    "  state INTEGER NOT NULL, handle TEXT NOT NULL DEFAULT '', last_words TEXT NOT NULL DEFAULT '',"
    "  started INTEGER NOT NULL, finished INTEGER NOT NULL DEFAULT 0,"
    "  PRIMARY KEY (job_id, number)) STRICT;"
    "CREATE INDEX attempts_running ON attempts (job_id) WHERE state = 0;"
    "CREATE TABLE checkpoints ("
    "  job_id TEXT NOT NULL PRIMARY KEY REFERENCES jobs (id), sha256 TEXT NOT NULL,"
    "  n_bytes INTEGER NOT NULL, stage INTEGER NOT NULL, created INTEGER NOT NULL) STRICT;"
    "CREATE INDEX checkpoints_by_hash ON checkpoints (sha256);"
    /* one row an iteration: an attempt that repeats one writes it again */
    "CREATE TABLE losses ("
    "  seq INTEGER PRIMARY KEY, job_id TEXT NOT NULL REFERENCES jobs (id), stage TEXT NOT NULL,"
    "  name TEXT NOT NULL, iteration INTEGER NOT NULL, value REAL NOT NULL,"
    "  UNIQUE (job_id, stage, name, iteration)) STRICT;"
    "CREATE TABLE events ("
    "  job_id TEXT NOT NULL REFERENCES jobs (id), sequence INTEGER NOT NULL, type TEXT NOT NULL,"
    "  data TEXT NOT NULL, created INTEGER NOT NULL, PRIMARY KEY (job_id, sequence)) STRICT, WITHOUT ROWID;"
    "CREATE TABLE idempotency_keys ("
    "  key TEXT NOT NULL PRIMARY KEY, request_hash TEXT NOT NULL, job_id TEXT NOT NULL REFERENCES jobs (id),"
    "  created INTEGER NOT NULL) STRICT;";

/* a cluster may run an attempt more than once */
static const char version_2[] = "ALTER TABLE attempts ADD COLUMN run INTEGER NOT NULL DEFAULT 0;";

/* uploads that come in pieces; until it is used, an upload is a file of its own, then the blob `sha256` */
static const char version_3[] =
    "CREATE TABLE uploads ("
    "  id TEXT NOT NULL PRIMARY KEY, n_bytes INTEGER NOT NULL, n_durable INTEGER NOT NULL DEFAULT 0,"
    "  sha256 TEXT NOT NULL DEFAULT '', metadata TEXT NOT NULL, created INTEGER NOT NULL,"
    "  expires INTEGER NOT NULL) STRICT;"
    "CREATE INDEX uploads_by_hash ON uploads (sha256) WHERE sha256 <> '';"
    "CREATE INDEX uploads_by_end ON uploads (expires);";

/* what goes after a time, found without looking at all jobs */
static const char version_4[] =
    "ALTER TABLE jobs ADD COLUMN events_retired INTEGER NOT NULL DEFAULT 0;"
    "CREATE INDEX jobs_by_end ON jobs (finished) WHERE state >= 2;";

/* whether it can be written to, asked by /readyz */
static const char version_5[] =
    "CREATE TABLE heartbeat (one INTEGER PRIMARY KEY CHECK (one = 1), at INTEGER NOT NULL) STRICT;";

/* quality reports: of a revision (or of strands: 0), compared with strands or with "<groom>/<revision>" */
static const char version_6[] =
    "CREATE TABLE qualities ("
    "  subject TEXT NOT NULL, number INTEGER NOT NULL, target TEXT NOT NULL, report TEXT NOT NULL,"
    "  created INTEGER NOT NULL, PRIMARY KEY (subject, number, target)) STRICT, WITHOUT ROWID;";

/* who is told of a job's end; due 0: it has not ended */
static const char version_7[] =
    "CREATE TABLE webhooks ("
    "  id TEXT NOT NULL PRIMARY KEY, job_id TEXT NOT NULL REFERENCES jobs (id), url TEXT NOT NULL,"
    "  secret TEXT NOT NULL, state INTEGER NOT NULL DEFAULT 0, attempts INTEGER NOT NULL DEFAULT 0,"
    "  due INTEGER NOT NULL DEFAULT 0, last_status INTEGER NOT NULL DEFAULT 0,"
    "  last_error TEXT NOT NULL DEFAULT '', created INTEGER NOT NULL, finished INTEGER NOT NULL DEFAULT 0) STRICT;"
    "CREATE INDEX webhooks_by_job ON webhooks (job_id);"
    "CREATE INDEX webhooks_due ON webhooks (due) WHERE state = 0;";

/* Everything belongs to a project. `owner` is who made it, for limits and fair turns: a token's id, or
 * the project where none was asked for. */
static const char version_8[] =
    "ALTER TABLE assets ADD COLUMN project TEXT NOT NULL DEFAULT 'default';"
    "ALTER TABLE assets ADD COLUMN owner TEXT NOT NULL DEFAULT 'default';"
    "ALTER TABLE grooms ADD COLUMN project TEXT NOT NULL DEFAULT 'default';"
    "ALTER TABLE jobs ADD COLUMN project TEXT NOT NULL DEFAULT 'default';"
    "ALTER TABLE jobs ADD COLUMN owner TEXT NOT NULL DEFAULT 'default';"
    "ALTER TABLE uploads ADD COLUMN project TEXT NOT NULL DEFAULT 'default';"
    "ALTER TABLE uploads ADD COLUMN owner TEXT NOT NULL DEFAULT 'default';"
    "DROP INDEX assets_by_kind;"
    "CREATE INDEX assets_by_project ON assets (project, kind, seq);"
    "CREATE INDEX assets_by_owner ON assets (owner, n_bytes);"
    "CREATE INDEX grooms_by_project ON grooms (project, seq);"
    "CREATE INDEX jobs_by_project ON jobs (project, seq);"
    "CREATE INDEX jobs_by_owner ON jobs (owner, state);"
    /* whose turn was when, counted */
    "CREATE TABLE turns (owner TEXT NOT NULL PRIMARY KEY, taken INTEGER NOT NULL) STRICT;"
    /* `subject` and `number` are what the request made: a job, or a groom's revision */
    "CREATE TABLE keys ("
    "  project TEXT NOT NULL, key TEXT NOT NULL, request_hash TEXT NOT NULL, subject TEXT NOT NULL,"
    "  number INTEGER NOT NULL, expires INTEGER NOT NULL, PRIMARY KEY (project, key)) STRICT, WITHOUT ROWID;"
    "CREATE INDEX keys_by_end ON keys (expires);"
    "DROP TABLE idempotency_keys;" /* their hashes were of another kind; none was older than its client */
    "CREATE TABLE audit ("
    "  seq INTEGER PRIMARY KEY AUTOINCREMENT, created INTEGER NOT NULL, request TEXT NOT NULL,"
    "  token TEXT NOT NULL, name TEXT NOT NULL, project TEXT NOT NULL, action TEXT NOT NULL,"
    "  subject TEXT NOT NULL, detail TEXT NOT NULL) STRICT;"
    "CREATE TRIGGER audit_is_not_changed BEFORE UPDATE ON audit"
    " BEGIN SELECT RAISE(ABORT, 'the audit is only added to'); END;"
    "CREATE TRIGGER audit_is_not_cut BEFORE DELETE ON audit"
    " BEGIN SELECT RAISE(ABORT, 'the audit is only added to'); END;";

/* what was worked out of strands alone, for the next job with the same */
static const char version_9[] =
    "CREATE TABLE preparations ("
    "  key TEXT NOT NULL PRIMARY KEY, subject TEXT NOT NULL, sha256 TEXT NOT NULL, n_bytes INTEGER NOT NULL,"
    "  used INTEGER NOT NULL) STRICT;"
    "CREATE INDEX preparations_by_hash ON preparations (sha256);"
    "CREATE INDEX preparations_by_subject ON preparations (subject);"
    "CREATE INDEX preparations_by_use ON preparations (used);";

const char *const schema_steps[] = {version_1, version_2, version_3, version_4, version_5,
                                    version_6, version_7, version_8, version_9};
const int schema_version = sizeof schema_steps / sizeof schema_steps[0];

static groom_status read_version(sqlite3 *db, int *version, struct groom_diag *diag)
{
    sqlite3_stmt *statement = NULL;
    int code = sqlite3_prepare_v2(db, "PRAGMA user_version", -1, &statement, NULL);
    if (code == SQLITE_OK)
        code = sqlite3_step(statement);
    groom_status status = code == SQLITE_ROW ? GROOM_OK : database_fail(db, code, diag);
    if (status == GROOM_OK)
        *version = sqlite3_column_int(statement, 0);
    sqlite3_finalize(statement);
    return status;
}

static groom_status take_step(sqlite3 *db, const char *step, int version, struct groom_diag *diag)
{
    char mark[64];
    snprintf(mark, sizeof mark, "PRAGMA user_version = %d", version);
    groom_status status = database_execute(db, "BEGIN EXCLUSIVE", diag);
    if (status != GROOM_OK)
        return status;
    if ((status = database_execute(db, step, diag)) == GROOM_OK &&
        (status = database_execute(db, mark, diag)) == GROOM_OK)
        status = database_execute(db, "COMMIT", diag);
    if (status != GROOM_OK && !sqlite3_get_autocommit(db))
        sqlite3_exec(db, "ROLLBACK", NULL, NULL, NULL);
    return status;
}

groom_status schema_migrate(sqlite3 *db, const char *const *steps, int n, struct groom_diag *diag)
{
    int version = 0;
    groom_status status = read_version(db, &version, diag);
    if (status == GROOM_OK && version > n)
        return groom_fail(diag, GROOM_EFORMAT,
                          "the database has schema version %d and this groomd knows %d: start the newer "
                          "groomd that wrote it, or restore a backup", version, n);
    for (; status == GROOM_OK && version < n; version++)
        status = take_step(db, steps[version], version + 1, diag);
    return status;
}
