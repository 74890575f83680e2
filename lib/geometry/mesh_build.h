/* What the mesh readers share: raw vertices and polygons as a file has them, made into a
 * struct groom_mesh once all are there. */
#ifndef GEOMETRY_MESH_BUILD_H
#define GEOMETRY_MESH_BUILD_H

#include "base/growing.h"
#include "base/number.h"
#include "groom/mesh.h"

#define MESH_NO_UV UINT32_MAX

struct mesh_corner {
    uint32_t vertex, uv; /* uv may be MESH_NO_UV */
};

struct mesh_face {
    uint32_t first, n;    /* corners[first .. first + n - 1] */
    uint32_t byte_offset; /* where it stands in the file, for messages */
};

struct mesh_build {
    const struct groom_context *context;
    const struct groom_allocator *allocator;
    struct growing points;  /* float[3], in the file's frame; may be not finite */
    struct growing uvs;     /* float[2]; may be not finite */
    struct growing corners; /* struct mesh_corner, indices unchecked */
    struct growing faces;   /* struct mesh_face */
    int by_faces_alone;     /* groom_mesh_read_options */
};

void mesh_build_init(struct mesh_build *build, const struct groom_context *context);
void mesh_build_finish(struct mesh_build *build);

/* base/number.h for text as char; NULL where no number stands. */
static inline const char *mesh_scan_number(const char *at, double *value)
{
    return (const char *)number_scan_any((const unsigned char *)at, value);
}
static inline const char *mesh_scan_integer(const char *at, long long *value)
{
    return (const char *)number_scan_integer((const unsigned char *)at, value);
}

/* Readers: bytes[0 .. n_bytes - 1] into build, with GROWING_PADDING zero bytes behind them. */
GROOM_MUST_CHECK groom_status mesh_read_obj(struct mesh_build *build, const char *bytes, size_t n_bytes,
                                            const char *group, struct groom_diag *diag);
GROOM_MUST_CHECK groom_status mesh_read_ply(struct mesh_build *build, const char *bytes, size_t n_bytes,
                                            struct groom_diag *diag);

/* The same refusal everywhere. */
groom_status mesh_no_memory(struct groom_diag *diag);

/* Check, triangulate, leave out what is unused, convert to metres. Fills the report's counts and warnings. */
GROOM_MUST_CHECK groom_status mesh_build_mesh(struct mesh_build *build, struct groom_frame frame,
                                              struct groom_mesh **mesh,
                                              struct groom_mesh_read_report *report,
                                              struct groom_diag *diag);

#endif
