#include "server/upkeep/upkeep.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "server/upkeep/files.h"

#define PATH_SIZE 1500

struct checking {
    const struct upkeep *upkeep;
    uint64_t n_problems, n_blobs, n_bytes, n_named, n_uploads;
    char last[BLOBS_HASH_SIZE]; /* the blob that was looked at last: several rows may name one */
};

static void say(struct checking *checking, char kind, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void say(struct checking *checking, char kind, const char *format, ...)
{
    char text[900];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    checking->n_problems += kind == 'p';
    checking->upkeep->say(checking->upkeep->user, kind, text);
}

static void on_problem(void *user, const char *text) { say(user, 'p', "%s", text); }

/* --- blobs ---------------------------------------------------------------------------------- */

/* Such a blob is mended by uploading the same file again: its bytes then take the place of these. */
static void on_blob(void *user, const char *sha256, uint64_t n_bytes, const char *owner)
{
    struct checking *checking = user;
    char path[PATH_SIZE], found[BLOBS_HASH_SIZE] = "";
    uint64_t n_found = 0;
    struct groom_diag diag = {0};
    if (!blobs_is_hash(sha256)) {
        say(checking, 'p', "%s names a blob that has no name", owner);
        return;
    }
    if (!strcmp(checking->last, sha256))
        return;
    memcpy(checking->last, sha256, BLOBS_HASH_SIZE);
    checking->n_blobs++;
    snprintf(path, sizeof path, "%s/blobs/%.2s/%s", checking->upkeep->folder, sha256, sha256);
    groom_status status = file_hash(path, &n_found, found, &diag);
    checking->n_bytes += n_found;
    if (status == GROOM_ENOTFOUND)
        say(checking, 'p', "the blob %s of %s is missing: upload the file again", sha256, owner);
    else if (status != GROOM_OK)
        say(checking, 'p', "the blob %s of %s cannot be read: %s", sha256, owner, diag.detail);
    else if (strcmp(found, sha256))
        say(checking, 'p', "the blob %s of %s is damaged (%llu bytes of %llu): upload the file again", sha256, owner,
            (unsigned long long)n_found, (unsigned long long)n_bytes);
}

/* --- uploads in pieces ------------------------------------------------------------------------ */

/* Has it gone, or become a blob, since the database was copied? */
static bool has_moved_on(const struct checking *checking, const char *id)
{
    struct store_upload row = {0};
    if (!checking->upkeep->store)
        return false;
    groom_status status = store_upload_get(checking->upkeep->store, id, &row, NULL);
    bool moved = status == GROOM_ENOTFOUND || (status == GROOM_OK && row.sha256[0]);
    store_upload_finish(&row);
    return moved;
}

static void on_upload(void *user, const char *id, uint64_t n_durable)
{
    struct checking *checking = user;
    char path[PATH_SIZE], sha256[BLOBS_HASH_SIZE];
    uint64_t n_found = 0;
    struct groom_diag diag = {0};
    checking->n_uploads++;
    snprintf(path, sizeof path, "%s/uploads/%s", checking->upkeep->folder, id);
    groom_status status = file_hash(path, &n_found, sha256, &diag);
    if (status == GROOM_OK && n_found >= n_durable)
        return;
    if (status == GROOM_ENOTFOUND && has_moved_on(checking, id))
        return;
    if (status == GROOM_OK)
        say(checking, 'p', "the upload %s has %llu bytes, not the %llu that its sender was told", id,
            (unsigned long long)n_found, (unsigned long long)n_durable);
    else
        say(checking, 'p', "the upload %s cannot be read: %s", id, diag.detail);
}

/* --- all of it --------------------------------------------------------------------------------- */

struct garbage {
    struct checking *checking;
    uint64_t n, n_bytes;
};

static groom_status count_blob(void *user, const char *sha256, uint64_t n_bytes)
{
    struct garbage *garbage = user;
    (void)sha256;
    garbage->n++;
    garbage->n_bytes += n_bytes;
    return GROOM_OK;
}

static groom_status count_garbage(struct checking *checking, struct groom_diag *diag)
{
    struct garbage garbage = {checking, 0, 0};
    groom_status status = blobs_each(checking->upkeep->blobs, count_blob, &garbage, diag);
    if (status == GROOM_OK && garbage.n > checking->n_blobs)
        say(checking, 'n', "%llu blobs are named by no row; the daemon removes them by itself",
            (unsigned long long)(garbage.n - checking->n_blobs));
    return status;
}

static groom_status check_copy(struct checking *checking, const char *path, struct groom_diag *diag)
{
    const struct store_check_sink sink = {on_problem, on_blob, on_upload, checking};
    groom_status status = store_copy_check(path, &sink, diag);
    if (status == GROOM_OK)
        status = count_garbage(checking, diag);
    if (status == GROOM_OK)
        say(checking, 's', "%llu problems; %llu blobs of %.1f MB and %llu uploads under way looked at",
            (unsigned long long)checking->n_problems, (unsigned long long)checking->n_blobs,
            (double)checking->n_bytes * 1e-6, (unsigned long long)checking->n_uploads);
    return status;
}

groom_status upkeep_check(const struct upkeep *upkeep, uint64_t *n_problems, struct groom_diag *diag)
{
    struct checking checking = {.upkeep = upkeep};
    char path[PATH_SIZE], from[STORE_PLACE_SIZE];
    snprintf(path, sizeof path, "%s/tmp/check.db", upkeep->folder);
    store_place(upkeep->folder, from);
    store_copy_remove(path);
    blobs_hold(upkeep->blobs);
    groom_status status =
        upkeep->store ? store_copy(upkeep->store, path, diag) : store_copy_file(from, path, diag);
    if (status == GROOM_OK)
        status = check_copy(&checking, path, diag);
    else if (status == GROOM_EFORMAT) { /* too damaged to be copied is an answer */
        say(&checking, 'p', "%s", diag ? diag->detail : "the database cannot be read");
        status = GROOM_OK;
    }
    blobs_release(upkeep->blobs);
    store_copy_remove(path);
    if (status == GROOM_OK)
        *n_problems = checking.n_problems;
    return status;
}
