/* Which reader a mesh file goes to. */
#include <string.h>

#include "base/growing.h"
#include "base/memory.h"
#include "geometry/mesh_build.h"

static int is_ply(const char *bytes, size_t n)
{
    return n >= 4 && memcmp(bytes, "ply", 3) == 0 && (bytes[3] == '\n' || bytes[3] == '\r');
}

/* OBJ has no magic: a line in the first 64 KiB that starts with v and a number, or with f and one,
 * and no byte that text does not have. */
static int is_obj(const char *bytes, size_t n)
{
    int found = 0;
    n = n < 65536 ? n : 65536;
    if (memchr(bytes, 0, n))
        return 0;
    for (const char *at = bytes, *end = bytes + n; at && at + 2 < end; at = memchr(at, '\n', (size_t)(end - at))) {
        at += *at == '\n';
        while (at + 2 < end && (*at == ' ' || *at == '\t'))
            at++;
        if (at + 2 < end && (*at == 'v' || *at == 'f') && (at[1] == ' ' || at[1] == '\t'))
            found = 1;
    }
    return found;
}

static groom_status recognise(const char *bytes, size_t n, groom_mesh_format *format, struct groom_diag *diag)
{
    groom_mesh_format found = is_ply(bytes, n) ? GROOM_MESH_PLY : is_obj(bytes, n) ? GROOM_MESH_OBJ : GROOM_MESH_AUTO;
    if (n == 0)
        return groom_fail_at(diag, GROOM_ETRUNCATED, 0, "the file is empty; expected an OBJ or PLY mesh");
    if (*format == GROOM_MESH_PLY && found != GROOM_MESH_PLY)
        return groom_fail_at(diag, GROOM_EFORMAT, 0, "expected \"ply\" as the first line of a PLY file");
    if (*format == GROOM_MESH_AUTO && found == GROOM_MESH_AUTO)
        return groom_fail_at(diag, GROOM_EUNKNOWN, 0, "neither \"ply\" nor a vertex line of OBJ begins the file; a head may be OBJ or PLY");
    if (*format == GROOM_MESH_AUTO)
        *format = found;
    return GROOM_OK;
}

groom_status groom_mesh_read(const struct groom_source *source, const struct groom_mesh_read_options *options,
                             const struct groom_context *context, struct groom_mesh **mesh,
                             struct groom_mesh_read_report *report, struct groom_diag *diag)
{
    static const struct groom_mesh_read_options defaults;
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_mesh_read_report own_report = {0};
    struct growing bytes = growing_of(1);
    struct mesh_build build;
    groom_status st;

    options = options ? options : &defaults;
    report = report ? report : &own_report;
    memset(report, 0, sizeof *report);
    /* offsets are kept in 32 bits */
    size_t max_bytes = options->max_bytes && options->max_bytes < UINT32_MAX ? options->max_bytes : UINT32_MAX - 1u;
    mesh_build_init(&build, context);
    build.by_faces_alone = options->by_faces_alone;
    if ((st = growing_read_all(&bytes, source, max_bytes, allocator, diag)) != GROOM_OK)
        goto out;
    report->format = options->format;
    if ((st = recognise(bytes.items, bytes.count, &report->format, diag)) != GROOM_OK)
        goto out;
    st = report->format == GROOM_MESH_PLY ? mesh_read_ply(&build, bytes.items, bytes.count, diag)
                                          : mesh_read_obj(&build, bytes.items, bytes.count, options->group, diag);
    if (st == GROOM_OK)
        st = mesh_build_mesh(&build, options->frame, mesh, report, diag);
out:
    mesh_build_finish(&build);
    growing_finish(&bytes, allocator);
    return st;
}
