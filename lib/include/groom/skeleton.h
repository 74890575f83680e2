/* Skeletons: the bones that tell where on a body a strand is (Yu et al., Section 4.1).
 *
 * A skeleton belongs to one mesh. Bones of the same index are the same bone on both sides of a
 * retargeting: groom_skeleton_match brings them there. Plain data: copy it, keep it, no cleanup. */
#ifndef GROOM_SKELETON_H
#define GROOM_SKELETON_H

#include <stddef.h>
#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GROOM_SKELETON_MAX_BONES 32
#define GROOM_BONE_MIN_LENGTH 1e-4f /* metres: a shorter bone has no direction to speak of */

struct groom_bone {
    char name[32];          /* not empty */
    float head[3], tail[3]; /* metres */
};

struct groom_skeleton {
    uint32_t n_bones; /* 1..GROOM_SKELETON_MAX_BONES */
    struct groom_bone bones[GROOM_SKELETON_MAX_BONES];
};

/* Whether it has bones, each with a name of its own, finite ends and a length.
 * returns  GROOM_OK, or GROOM_EINVAL with the pointer of the bone ("/bones/2") */
GROOM_MUST_CHECK groom_status groom_skeleton_validate(const struct groom_skeleton *skeleton, struct groom_diag *diag);

/* {"bones":[{"name":...,"head":[x,y,z],"tail":[x,y,z]},...]}, metres, y up.
 * returns  GROOM_OK; GROOM_EINVAL with a JSON pointer (not JSON, an unknown field, too many bones,
 *          what groom_skeleton_validate refuses); GROOM_ENOMEM. *out is set only on success */
GROOM_MUST_CHECK groom_status groom_skeleton_parse(const char *json, size_t n_bytes, struct groom_skeleton *out,
                                                   struct groom_diag *diag);
/* The same form, which reads back to the same bits; malloc'd and ended by 0, for the caller to free(). */
GROOM_MUST_CHECK groom_status groom_skeleton_print(const struct groom_skeleton *skeleton, char **json,
                                                   struct groom_diag *diag);

/* Bring the bones of b into the order of a, by name.
 * returns  GROOM_OK; GROOM_EINVAL naming the bone that one side lacks; b is changed only on success */
GROOM_MUST_CHECK groom_status groom_skeleton_match(const struct groom_skeleton *a, struct groom_skeleton *b,
                                                   struct groom_diag *diag);

/* A skeleton from a mesh alone: "head"; "neck" where the mesh goes on below one; "left_shoulder",
 * "right_shoulder", "left_upper_arm", "right_upper_arm" as far as it has them (left: +x).
 *
 * The mesh is sliced across y from its top: the head is what lies above the narrowest slice below
 * the widest, the neck what lies between there and where it widens to the shoulders; a mesh that
 * does not narrow is a head alone. Lengths are in proportion to the head's. Only the largest shell counts.
 * mesh     upright, the face towards +z
 * returns  GROOM_OK, GROOM_EDEGENERATE (no extent), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_skeleton_make(const struct groom_mesh *mesh, const struct groom_context *context,
                                                  struct groom_skeleton *out, struct groom_diag *diag);

/* The same bones in another mesh of the same topology: each end moves by the affine map that fits
 * the movement of the surface around it best, weights falling with the fourth power of distance.
 * Exact where the target is an affine image of the source.
 * returns  GROOM_OK; GROOM_EINVAL (another topology; says what differs); GROOM_EDEGENERATE (a bone lost its length) */
GROOM_MUST_CHECK groom_status groom_skeleton_carry(const struct groom_skeleton *skeleton, const struct groom_mesh *source,
                                                   const struct groom_mesh *target, struct groom_skeleton *out,
                                                   struct groom_diag *diag);

/* Which bones a triangle may serve: the region Lambda_b of Eq. 2, as bit b of mask[t].
 * The paper clips SMPL's skinning weights. Here the weight of bone b at a vertex is d_b^-4 over the
 * sum of all bones', d its distance from the bone, and a triangle serves the bones that weigh more
 * than 0.2 at one of its corners. Every triangle serves one at least: its nearest.
 * mask     [n_triangles], the caller's */
void groom_skeleton_regions(const struct groom_skeleton *skeleton, const struct groom_mesh *mesh, uint32_t *mask);

#ifdef __cplusplus
}
#endif
#endif
