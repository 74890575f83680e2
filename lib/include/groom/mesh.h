/* Triangle meshes of heads and bodies: metres, y up, the face towards +z. */
#ifndef GROOM_MESH_H
#define GROOM_MESH_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/io.h"

#ifdef __cplusplus
extern "C" {
#endif

struct groom_mesh {
    uint32_t n_vertices, n_triangles, n_uvs;
    float (*points)[3];          /* [n_vertices] finite, metres */
    uint32_t (*triangles)[3];    /* [n_triangles] indices into points, counter-clockwise from outside */
    float (*uvs)[2];             /* [n_uvs] texture coordinates, or NULL where there are none */
    uint32_t (*uv_triangles)[3]; /* [n_triangles] indices into uvs, one a corner; NULL with uvs */
    const struct groom_allocator *allocator; /* owns the arrays */
};

/* A mesh with room for these counts; arrays uninitialised. n_uvs = 0: no texture coordinates.
 * Owned by the caller. returns GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_mesh_create(uint32_t n_vertices, uint32_t n_triangles, uint32_t n_uvs,
                                                const struct groom_context *context,
                                                struct groom_mesh **mesh, struct groom_diag *diag);
void groom_mesh_destroy(struct groom_mesh *mesh); /* takes NULL */

/* Whether every index is in range and every number finite.
 * returns  GROOM_OK or GROOM_EINVAL */
GROOM_MUST_CHECK groom_status groom_mesh_validate(const struct groom_mesh *mesh, struct groom_diag *diag);

/* The box of all points; the mesh has at least one. */
void groom_mesh_bounds(const struct groom_mesh *mesh, float bbox_min[3], float bbox_max[3]);

/* --- reading -------------------------------------------------------------- */

/* X(constant, name, media type, file extension, what it is) */
#define GROOM_MESH_FORMAT_LIST(X)                                                                  \
    X(GROOM_MESH_OBJ, "obj", "model/obj",         "obj", "Wavefront OBJ")                          \
    X(GROOM_MESH_PLY, "ply", "application/x-ply", "ply", "PLY, ASCII or binary")

typedef enum groom_mesh_format {
    GROOM_MESH_AUTO = 0,
#define GROOM_MESH_FORMAT_ENUM(name, slug, media, extension, text) name,
    GROOM_MESH_FORMAT_LIST(GROOM_MESH_FORMAT_ENUM)
#undef GROOM_MESH_FORMAT_ENUM
    GROOM_MESH_FORMAT_COUNT
} groom_mesh_format;

const char *groom_mesh_format_name(groom_mesh_format format); /* "obj"; "auto" */
/* returns GROOM_OK or GROOM_EINVAL with the list of names in diag */
GROOM_MUST_CHECK groom_status groom_mesh_format_parse(const char *name, groom_mesh_format *format,
                                                      struct groom_diag *diag);

struct groom_mesh_read_options {
    groom_mesh_format format; /* GROOM_MESH_AUTO: recognised from the bytes */
    struct groom_frame frame; /* {0}: metres, y up */
    const char *group;        /* OBJ: keep only faces of the group or object of this name; NULL: all */
    uint64_t max_bytes;       /* refuse a longer file with GROOM_ETOOBIG; 0: 2^32-1 */
    int by_faces_alone;       /* 1: polygons are fanned from their first corner and kept without area, so that two
                               * files with the same faces have the same triangles, wherever their corners are */
};

struct groom_mesh_read_report {
    groom_mesh_format format;        /* what it was read as */
    uint64_t n_vertices_in_file, n_faces_in_file;
    uint64_t n_dropped_not_finite;   /* faces with a corner that is not finite */
    uint64_t n_dropped_degenerate;   /* faces of fewer than 3 different corners or of no area */
    uint32_t n_warnings;
    char warnings[4][160];           /* sentences; the counts above among them */
};

/* Read a mesh; polygons become triangles (fans of convex ones, ears of the others), vertices that
 * no face uses are left out, texture coordinates are kept where every kept face has them.
 * report   may be NULL
 * returns  GROOM_OK; GROOM_EUNKNOWN, GROOM_EFORMAT (an index out of range, a number that is none),
 *          GROOM_ETRUNCATED, GROOM_ETOOBIG, GROOM_EEMPTY (no face is usable, or the group is not
 *          there), GROOM_EIO, GROOM_ENOMEM, with a diag that names the byte offset */
GROOM_MUST_CHECK groom_status groom_mesh_read(const struct groom_source *source,
                                              const struct groom_mesh_read_options *options,
                                              const struct groom_context *context,
                                              struct groom_mesh **mesh,
                                              struct groom_mesh_read_report *report,
                                              struct groom_diag *diag);

/* Write as OBJ, in the frame given ({0}: metres, y up).
 * returns  GROOM_OK, what the sink answers */
GROOM_MUST_CHECK groom_status groom_mesh_write_obj(const struct groom_mesh *mesh, struct groom_frame frame,
                                                   struct groom_sink sink, struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
