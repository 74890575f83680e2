/* One mesh laid over another: what retargeting needs where source and target have different triangles.
 *
 * The source's mesh is deformed until it lies on the target's surface, part on like part: its
 * triangles with other positions, which is a target of the same topology. */
#ifndef GROOM_CORRESPONDENCE_H
#define GROOM_CORRESPONDENCE_H

#include <stddef.h>
#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GROOM_MAX_LANDMARKS 256
#define GROOM_MIN_LANDMARKS 4

struct groom_landmark {
    char name[32];              /* may be empty */
    float source[3], target[3]; /* the same place on both, metres; within 3 cm of the surfaces */
};

struct groom_landmarks {
    uint32_t n; /* GROOM_MIN_LANDMARKS..GROOM_MAX_LANDMARKS, not all in a plane */
    struct groom_landmark pairs[GROOM_MAX_LANDMARKS];
};

/* {"landmarks":[{"name":"nose","source":[x,y,z],"target":[x,y,z]},...]}; names may be left out.
 * returns  GROOM_OK, GROOM_EINVAL with a JSON pointer, GROOM_ENOMEM; *out is set only on success */
GROOM_MUST_CHECK groom_status groom_landmarks_parse(const char *json, size_t n_bytes, struct groom_landmarks *out,
                                                    struct groom_diag *diag);
/* The same form; malloc'd and ended by 0, for the caller to free(). */
GROOM_MUST_CHECK groom_status groom_landmarks_print(const struct groom_landmarks *landmarks, char **json, struct groom_diag *diag);

struct groom_correspondence_report {
    int by_texture;              /* whether texture coordinates served, not landmarks */
    double covered;              /* fraction of the source's vertices that have a partner on the target */
    double mean_distance, max_distance; /* of these from the target's surface, metres */
    double mean_landmark_error, max_landmark_error; /* of landmarks from their partners, metres; 0 by texture */
    uint32_t n_flipped;          /* triangles that face against the target's surface under them */
    uint32_t n_folded;           /* sides at which two triangles meet at less than 60 degrees that do not in the source */
    uint32_t iterations;
};

/* Lay the source over the target.
 *
 * First by the similarity that fits the landmarks best; then by an as-rigid-as-possible deformation
 * (Sorkine and Alexa 2007) pulled to the landmarks and to nearest points of the target whose normals
 * agree to 60 degrees, in steps: the length over which the deformation is stiff goes from half the
 * landmarks' extent to a hundredth of it, and the shape at rest follows after each step. Nearest
 * points on the edge of an open target do not pull. What folds at the end is eased. Where no landmarks are given, both meshes must have
 * texture coordinates, and of the same layout: these are then followed, and refined in the same way.
 *
 * source, target  borrowed; right side out (groom/body.h)
 * landmarks       NULL: by texture coordinates
 * registered      the source's triangles and texture coordinates; owned by the caller
 * report          may be NULL
 * returns  GROOM_OK; GROOM_EINVAL with a pointer: neither landmarks nor texture coordinates (says what
 *          differs between the meshes), too few or all in a plane, one off its surface ("/landmarks/2/source"),
 *          some that contradict the others, coordinates of another layout; GROOM_EDEGENERATE where the result folds or stays off the target;
 *          GROOM_ENOMEM, GROOM_ECANCELLED
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status groom_correspondence_create(const struct groom_mesh *source, const struct groom_mesh *target,
                                                          const struct groom_landmarks *landmarks,
                                                          const struct groom_context *context, struct groom_mesh **registered,
                                                          struct groom_correspondence_report *report, struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
