/* What a mesh must be to serve as a body: a surface that has an inside.
 *
 * Retargeting (groom/retarget.h) asks which side of the body hair is on, so a body must be turned
 * right side out and must enclose something. What can be mended is mended and named; what cannot is
 * refused with what to mend. Counts of vertices and triangles, and their order, never change, so
 * that two meshes of one topology stay so. */
#ifndef GROOM_BODY_H
#define GROOM_BODY_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GROOM_BODY_MAX_WARNINGS 6

struct groom_body_report {
    uint32_t n_shells;             /* pieces that hang together by edges; vertices at one place are one */
    uint32_t n_boundary_edges;     /* of one triangle */
    uint32_t n_holes;              /* closed loops of them */
    uint32_t n_non_manifold_edges; /* of more than two triangles */
    uint32_t n_turned;             /* triangles whose corners 1 and 2 were exchanged */
    double open;                   /* area that would close the largest shell, over its own: 0 closed */
    double volume;                 /* cubic metres of the largest shell, its holes closed flat */
    uint32_t n_warnings;
    char warnings[GROOM_BODY_MAX_WARNINGS][160]; /* sentences: what was mended, what was let pass */
};

/* Check a mesh and turn it right side out in place.
 *
 *   flipped normals     mended: triangles are made to agree with their neighbours, and each shell to
 *                       have its volume inside; n_turned tells
 *   open                let pass and told where the holes are small against the surface, as a cut at
 *                       neck or waist is (open < 1/3): what is inside is told by winding numbers
 *                       there. Refused where the mesh is rather a sheet
 *   several shells      let pass and told: eyes, teeth, a tongue. Those that are sheets (eyelashes)
 *                       are told too
 *   non-manifold edges  let pass and told up to one edge in fifty; refused beyond
 *   one-sided           (a Moebius band) refused
 *
 * mesh     the caller's; only triangles and uv_triangles change, by exchanging corners
 * report   may be NULL
 * returns  GROOM_OK; GROOM_EDEGENERATE with what to mend in diag; GROOM_EINVAL (an index out of range, not
 *          finite), GROOM_EEMPTY (no triangle), GROOM_ENOMEM; on error triangles may be partly turned */
GROOM_MUST_CHECK groom_status groom_body_check(struct groom_mesh *mesh, const struct groom_context *context,
                                               struct groom_body_report *report, struct groom_diag *diag);

/* Whether two meshes have the same triangles of the same vertices, the order of corners aside.
 * difference  gets what differs, a part of a sentence; "" where nothing does. May be NULL
 * returns     1 or 0 */
int groom_topology_same(const struct groom_mesh *a, const struct groom_mesh *b, char difference[160]);

#ifdef __cplusplus
}
#endif
#endif
