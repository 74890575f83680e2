/* Uploaded strands as the daemon may read them: groom-worker reads the upload and writes HAIR in metres. */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/format.h"
#include "server/grooms/room.h"
#include "server/launch/child.h"

#define CONVERT_WALL_MS 120000
#define CONVERT_MEMORY ((uint64_t)8 << 30)
#define CONVERT_FILE ((uint64_t)16 << 30)

static groom_status convert(struct grooms *grooms, const struct store_asset *asset, int in, int out,
                            struct groom_diag *diag)
{
    char unit[32], up[2] = {asset->up, 0};
    snprintf(unit, sizeof unit, "%.17g", asset->unit_m);
    const char *const argv[] = {grooms->options.worker_path, "convert", "--from-format", asset->format,
                                "--from-unit", unit, "--from-up", up, "--to-format", "hair", NULL};
    const struct child_spec spec = {.argv = argv, .stdin_fd = in, .stdout_fd = out, .wall_ms = CONVERT_WALL_MS,
                                    .limits = {.memory_bytes = CONVERT_MEMORY, .file_bytes = CONVERT_FILE}};
    struct child_result result = {0};
    groom_status status = child_run(&spec, &result, diag);
    if (status == GROOM_OK && result.exit_status != 0)
        status = groom_fail(diag, GROOM_EINTERNAL, "the strands could not be read%s: %.300s",
                            result.timed_out ? " in time" : "", result.words);
    child_result_finish(&result);
    return status;
}

static groom_status read_back(struct grooms *grooms, int fd, struct groom_strands **strands, struct groom_diag *diag)
{
    const struct groom_read_options options = {.format = GROOM_FORMAT_HAIR};
    if (lseek(fd, 0, SEEK_SET) != 0)
        return groom_fail(diag, GROOM_EIO, "strands could not be read back");
    struct groom_source source = groom_source_from_fd(fd);
    return groom_strands_read(&source, &options, &grooms->context, strands, NULL, diag);
}

static groom_status load(struct grooms *grooms, const struct store_asset *asset, struct groom_strands **strands,
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
        status = read_back(grooms, out, strands, diag);
    if (in >= 0)
        close(in);
    if (out >= 0)
        close(out);
    return status;
}

groom_status uploads_acquire(struct grooms *grooms, const char *id, struct state **state, char **name,
                             struct groom_diag *diag)
{
    struct store_asset asset = {0};
    struct groom_strands *strands = NULL;
    groom_status status = store_asset_get(grooms->options.store, NULL, STORE_STRANDS, id, &asset, diag);
    if (status != GROOM_OK)
        return status;
    if (!(*state = states_find(grooms->states, id)) &&
        (status = load(grooms, &asset, &strands, diag)) == GROOM_OK &&
        states_keep(grooms->states, id, strands, state) != GROOM_OK)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for the strands");
    if (status == GROOM_OK && !(*name = strdup(asset.name))) {
        states_release(grooms->states, *state);
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for the strands");
    }
    store_asset_finish(&asset);
    return status;
}
