/* Surfaces of uploaded heads, for contact: read by groom-worker, which writes what it has understood, and
 * kept while they are asked for. */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/mesh.h"
#include "groom/spatial.h"
#include "server/grooms/room.h"
#include "server/launch/child.h"

#define MOST_HEADS 4
#define CONVERT_WALL_MS 60000
#define CONVERT_MEMORY ((uint64_t)8 << 30)
#define CONVERT_FILE ((uint64_t)4 << 30)

struct head {
    struct cache_entry entry; /* its key is the head's id; its bytes are not counted: there are few */
    struct groom_mesh *mesh;
    struct groom_bvh *bvh;
};

static struct head *head_of(struct cache_entry *entry) { return (struct head *)entry; }

static void free_head(struct cache_entry *entry)
{
    if (entry) {
        groom_bvh_destroy(head_of(entry)->bvh);
        groom_mesh_destroy(head_of(entry)->mesh);
    }
    free(entry);
}

groom_status heads_create(struct cache **heads) { return cache_create(SIZE_MAX, MOST_HEADS, free_head, heads); }

const struct groom_bvh *head_surface(const struct head *head) { return head->bvh; }

/* --- reading one --------------------------------------------------------------------------- */

static groom_status convert(struct grooms *grooms, const struct store_asset *asset, int in, int out,
                            struct groom_diag *diag)
{
    char unit[32], up[2] = {asset->up, 0};
    snprintf(unit, sizeof unit, "%.17g", asset->unit_m);
    const char *const argv[] = {grooms->options.worker_path, "convert-head", "--format", asset->format, "--unit", unit, "--up", up, NULL};
    const struct child_spec spec = {.argv = argv, .stdin_fd = in, .stdout_fd = out, .wall_ms = CONVERT_WALL_MS,
                                    .limits = {.memory_bytes = CONVERT_MEMORY, .file_bytes = CONVERT_FILE}};
    struct child_result result = {0};
    groom_status status = child_run(&spec, &result, diag);
    if (status == GROOM_OK && result.exit_status != 0)
        status = groom_fail(diag, GROOM_EINTERNAL, "the head could not be read%s: %.300s",
                            result.timed_out ? " in time" : "", result.words);
    child_result_finish(&result);
    return status;
}

static groom_status read_mesh(struct grooms *grooms, int fd, struct head *head, struct groom_diag *diag)
{
    const struct groom_mesh_read_options options = {.format = GROOM_MESH_OBJ};
    if (lseek(fd, 0, SEEK_SET) != 0)
        return groom_fail(diag, GROOM_EIO, "a head could not be read back");
    struct groom_source source = groom_source_from_fd(fd);
    groom_status status = groom_mesh_read(&source, &options, &grooms->context, &head->mesh, NULL, diag);
    return status == GROOM_OK ? groom_bvh_create(head->mesh, &grooms->context, &head->bvh, diag) : status;
}

static groom_status load(struct grooms *grooms, const struct store_asset *asset, struct head *head,
                         struct groom_diag *diag)
{
    int in = -1, out = -1;
    uint64_t n_bytes;
    groom_status status = blobs_read(grooms->options.blobs, asset->sha256, &in, &n_bytes, diag);
    if (status == GROOM_OK && (out = open(grooms->options.temporary_folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)) < 0)
        status = groom_fail(diag, GROOM_EIO, "no temporary file");
    if (status == GROOM_OK)
        status = convert(grooms, asset, in, out, diag);
    if (status == GROOM_OK)
        status = read_mesh(grooms, out, head, diag);
    if (in >= 0)
        close(in);
    if (out >= 0)
        close(out);
    return status;
}

/* --- what others call ---------------------------------------------------------------------------- */

groom_status heads_acquire(struct grooms *grooms, const char *id, struct head **out, struct groom_diag *diag)
{
    struct store_asset asset = {0};
    *out = head_of(cache_get(grooms->heads, id));
    if (*out || store_asset_get(grooms->options.store, NULL, STORE_HEAD, id, &asset, NULL) != GROOM_OK)
        return GROOM_OK; /* a groom from elsewhere: its head is not here */
    struct head *made = calloc(1, sizeof *made);
    groom_status status = made ? load(grooms, &asset, made, diag) : groom_fail(diag, GROOM_ENOMEM, "no memory for a head");
    store_asset_finish(&asset);
    if (status != GROOM_OK) {
        free_head((struct cache_entry *)made);
        return status;
    }
    strncpy(made->entry.key, id, sizeof made->entry.key - 1);
    *out = head_of(cache_keep(grooms->heads, &made->entry));
    return GROOM_OK;
}

void heads_release(struct grooms *grooms, struct head *head) { cache_put_back(grooms->heads, (struct cache_entry *)head); }
