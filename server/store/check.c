/* Is a database what it should be? Asked of a copy (copy.c), so that nobody waits. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <openssl/evp.h>

#include "server/store/database.h"

struct check {
    struct connection *c;
    const struct store_check_sink *sink;
    struct groom_diag *diag;
};

static void complain(const struct check *check, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void complain(const struct check *check, const char *format, ...)
{
    char text[512];
    va_list arguments;
    if (!check->sink->problem)
        return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    check->sink->problem(check->sink->user, text);
}

/* --- what SQLite knows ---------------------------------------------------------------------- */

static groom_status check_pages(const struct check *check)
{
    char text[400];
    struct query q = query_open(check->c, "PRAGMA integrity_check(100)", check->diag);
    while (query_row(&q)) {
        query_copy(&q, 0, text, sizeof text);
        if (strcmp(text, "ok") != 0)
            complain(check, "the database is damaged: %s", text);
    }
    return query_end(&q);
}

static groom_status check_references(const struct check *check)
{
    char table[64], parent[64];
    struct query q = query_open(check->c, "PRAGMA foreign_key_check", check->diag);
    while (query_row(&q)) {
        query_copy(&q, 0, table, sizeof table);
        query_copy(&q, 2, parent, sizeof parent);
        complain(check, "row %lld of %s names something that is not in %s", (long long)query_int64(&q, 1), table, parent);
    }
    return query_end(&q);
}

/* --- what must hold -------------------------------------------------------------------------- */

/* Each query gives a name and what is wrong with it, a row for each; none where all is well. */
static const struct rule {
    const char *what, *sql;
} rules[] = {
    {"groom", "SELECT g.id, 'has revisions that are not 1 to ' || latest FROM grooms AS g LEFT JOIN revisions AS r"
              " ON r.groom_id = g.id GROUP BY g.id HAVING count(r.number) <> latest OR coalesce(max(r.number), 0) <> latest"},
    {"groom", "SELECT groom_id || ' revision ' || number, 'has a document that is not JSON' FROM revisions"
              " WHERE NOT json_valid(document)"},
    {"groom", "SELECT r.groom_id || ' revision ' || r.number, 'names the array ' || t.atom || ', which is not kept for it'"
              " FROM revisions AS r, json_tree(r.document) AS t WHERE json_valid(r.document) AND t.key = '$array'"
              " AND NOT EXISTS (SELECT 1 FROM revision_arrays AS a WHERE a.groom_id = r.groom_id"
              "  AND a.number = r.number AND a.sha256 = t.atom)"},
    {"job", "SELECT id, 'is running without an attempt that runs' FROM jobs WHERE state = 1 AND NOT EXISTS"
            " (SELECT 1 FROM attempts WHERE job_id = jobs.id AND number = jobs.attempt AND state = 0)"},
    {"job", "SELECT job_id, 'has an attempt that runs, and is not running' FROM attempts JOIN jobs ON jobs.id = job_id"
            " WHERE attempts.state = 0 AND (jobs.state <> 1 OR attempts.number <> jobs.attempt)"},
    {"job", "SELECT id, 'has succeeded without a result' FROM jobs WHERE state = 2 AND result IS NULL"},
    {"job", "SELECT id, 'has texts that are not JSON' FROM jobs WHERE NOT (json_valid(request) AND json_valid(options)"
            " AND json_valid(loss) AND (result IS NULL OR json_valid(result)) AND (error IS NULL OR json_valid(error)))"},
    {"job", "SELECT id, 'lacks its last event' FROM jobs WHERE n_events > 0 AND NOT EXISTS"
            " (SELECT 1 FROM events WHERE job_id = jobs.id AND sequence = jobs.n_events)"
            " AND events_retired = 0"},
    {"upload", "SELECT id, 'has more bytes than it is to have' FROM uploads WHERE n_durable > n_bytes"},
};

static groom_status check_rule(const struct check *check, const struct rule *rule)
{
    char name[160], wrong[256];
    struct query q = query_open(check->c, rule->sql, check->diag);
    while (query_row(&q)) {
        query_copy(&q, 0, name, sizeof name);
        query_copy(&q, 1, wrong, sizeof wrong);
        complain(check, "%s %s %s", rule->what, name, wrong);
    }
    return query_end(&q);
}

static groom_status check_arrays(const struct check *check)
{
    struct query q = query_open(check->c, "SELECT sha256, bytes FROM arrays", check->diag);
    while (query_row(&q)) {
        char sha256[STORE_HASH_SIZE], found[STORE_HASH_SIZE];
        unsigned char digest[EVP_MAX_MD_SIZE];
        const void *bytes = sqlite3_column_blob(q.statement, 1);
        size_t n = (size_t)sqlite3_column_bytes(q.statement, 1);
        query_copy(&q, 0, sha256, sizeof sha256);
        EVP_Digest(bytes ? bytes : "", n, digest, NULL, EVP_sha256(), NULL);
        for (int i = 0; i < 32; i++)
            snprintf(found + 2 * i, 3, "%02x", digest[i]);
        if (strcmp(sha256, found) != 0)
            complain(check, "the array %s has other bytes than its name says", sha256);
    }
    return query_end(&q);
}

/* --- what lies outside -------------------------------------------------------------------------- */

static groom_status name_blobs(const struct check *check)
{
    char sha256[STORE_HASH_SIZE], owner[64];
    struct query q = query_open(check->c,
                                "SELECT sha256, n_bytes, id FROM assets UNION ALL"
                                " SELECT sha256, n_bytes, 'the checkpoint of ' || job_id FROM checkpoints UNION ALL"
                                " SELECT sha256, n_bytes, 'the preparation of ' || subject FROM preparations UNION ALL"
                                " SELECT sha256, n_bytes, id FROM uploads WHERE sha256 <> '' ORDER BY 1", check->diag);
    while (query_row(&q)) {
        query_copy(&q, 0, sha256, sizeof sha256);
        query_copy(&q, 2, owner, sizeof owner);
        check->sink->blob(check->sink->user, sha256, (uint64_t)query_int64(&q, 1), owner);
    }
    return query_end(&q);
}

static groom_status name_uploads(const struct check *check)
{
    char id[STORE_ID_SIZE];
    struct query q = query_open(check->c, "SELECT id, n_durable FROM uploads WHERE sha256 = ''", check->diag);
    while (query_row(&q)) {
        query_copy(&q, 0, id, sizeof id);
        check->sink->upload(check->sink->user, id, (uint64_t)query_int64(&q, 1));
    }
    return query_end(&q);
}

static groom_status run(const struct check *check)
{
    groom_status status = GROOM_OK;
    if (check->sink->problem) {
        if ((status = check_pages(check)) == GROOM_OK && (status = check_references(check)) == GROOM_OK)
            status = check_arrays(check);
        for (size_t i = 0; status == GROOM_OK && i < sizeof rules / sizeof rules[0]; i++)
            status = check_rule(check, &rules[i]);
    }
    if (status == GROOM_OK && (status = name_blobs(check)) == GROOM_OK)
        status = name_uploads(check);
    return status;
}

groom_status store_copy_check(const char *path, const struct store_check_sink *sink, struct groom_diag *diag)
{
    struct store copy;
    groom_status status = database_open_copy(path, &copy, diag);
    if (status != GROOM_OK)
        return status;
    const struct check check = {&copy.writer, sink, diag};
    status = run(&check);
    database_close_copy(&copy);
    return status;
}
