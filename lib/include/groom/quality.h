/* How alike two sets of strands are: the target of a fit, and the strands of its groom.
 *
 * Both are resampled to `vertices` vertices a strand, so that vertex counts do not matter.
 *
 * Distributions are compared as distances with a floor: the target is cut into two random halves A
 * and B. `distance` is that between one half of the target and the other half of the groom's strands
 * (both ways, the mean); `floor` that between A and B themselves, which another capture of the same
 * hair would have. So a groom whose strands cannot be told from the target's scores its floor.
 *   spectra, segments  sliced Wasserstein distances (Chang et al. 2025, Eqs. 11 and 12), as root mean
 *                      squares over strands and directions: on the magnitudes of the Fourier transforms
 *                      of segments, and on segments. Lengths in units of 0.1 m
 *   curvature          1/m, turning angle over segment length; torsion: rad/m, angle between osculating
 *                      planes, signed, over segment length; length: m. Wasserstein-1 distances
 * At most `strands` strands enter into each half.
 *
 * Places are compared one by one: `places` points at equal steps of arc length along all strands of one
 * set, and for each the nearest point on any segment of the other (what "nearest vertex" tends to as
 * vertices get dense). Precision is the share of the groom's places that find a segment of the target
 * within a distance whose direction, root to tip, is within an angle of their own; recall the same from
 * the target's places; the F-score their harmonic mean. This is how papers on reconstruction count
 * (Nam et al. 2019; NeuralHaircut, GaussianHaircut). The stricter reading, that the direction of the
 * nearest segment alone decides, stands beside it as `nearest_...`, and in place of it for sets smaller than
 * 3 cm, among which everything is near. The floor is A against B.
 *
 * Head: how many strands, and how much of their length, lies more than 1 mm inside.
 * Paired: where both sets have as many strands, strand i against strand i, vertex by vertex. */
#ifndef GROOM_QUALITY_H
#define GROOM_QUALITY_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"

#ifdef __cplusplus
extern "C" {
#endif

struct groom_strands;
struct groom_mesh;

struct groom_quality_options {
    uint32_t vertices; /* of each strand; 0: 100. 3 at least */
    uint32_t strands;  /* of each half that is compared; 0: 10 000 */
    uint32_t places;   /* of each set; 0: one for each quarter millimetre of the target, 2 000 to 60 000 */
    uint64_t seed;     /* of the halves and of the directions of slices */
};

#define GROOM_QUALITY_TOLERANCES 3 /* (1 mm, 10 degrees), (2 mm, 20), (3 mm, 30) */
#define GROOM_QUALITY_BINS 40

struct groom_quality_distance { double distance, floor; };

struct groom_quality_nearest { double mean, p95; }; /* metres */

struct groom_quality_score {
    double distance, angle; /* metres, radians */
    double precision, recall, f_score;
    double nearest_precision, nearest_recall, nearest_f_score;
    double floor, nearest_floor; /* F-scores of A against B */
};

/* Shares of all values; what lies outside low..high is in no bin. */
struct groom_quality_histogram {
    double low, high;
    double target[GROOM_QUALITY_BINS], groom[GROOM_QUALITY_BINS];
};

struct groom_quality_head {
    uint32_t strands;   /* with a vertex, the root left out, more than 1 mm inside */
    uint32_t vertices;  /* that deep, roots left out */
    uint32_t segments;  /* both of whose ends are that deep */
    double share;       /* of all length, in such segments */
    double deepest;     /* metres, of the vertices that were looked at: those near another are not; 0: none is inside */
};

struct groom_quality {
    uint32_t n_target, n_groom;       /* strands */
    uint32_t bend_vertices;    /* of each strand at which curvature and torsion were looked at */
    double length_target, length_groom; /* metres of all strands together */
    struct groom_quality_distance spectra, segments, curvature, torsion, length;
    struct groom_quality_nearest to_target, to_groom, floor; /* from the groom's places, from the target's, A and B */
    struct groom_quality_score scores[GROOM_QUALITY_TOLERANCES];
    struct groom_quality_histogram curvatures, torsions, lengths;
    int has_head;
    struct groom_quality_head head_target, head_groom;
    int has_pairs;
    double pair_distance;  /* metres: mean distance of vertices of the same index */
    double pair_direction; /* radians: mean angle of segments of the same index */
};

/* The target, made ready: several grooms are compared with it. */
struct groom_quality_target;

/* strands  borrowed for the call; every strand has 2 finite vertices or more
 * head     borrowed until groom_quality_target_destroy; NULL: none
 * options  NULL: all 0
 * returns  GROOM_OK, GROOM_EEMPTY (fewer than 2 strands, or none of any length), GROOM_EINVAL,
 *          GROOM_ETOOBIG (2^32 vertices and more), GROOM_ENOMEM, GROOM_ECANCELLED
 * memory   the target's vertices, 12 bytes each after resampling; 44 bytes a segment while comparing */
GROOM_MUST_CHECK groom_status groom_quality_target_create(const struct groom_strands *strands,
                                                          const struct groom_mesh *head,
                                                          const struct groom_quality_options *options,
                                                          const struct groom_context *context,
                                                          struct groom_quality_target **target,
                                                          struct groom_diag *diag);
void groom_quality_target_destroy(struct groom_quality_target *target); /* takes NULL */

/* Compares strands with the target.
 * returns  as groom_quality_target_create; *quality is set only on success
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status groom_quality_compare(const struct groom_quality_target *target,
                                                    const struct groom_strands *strands,
                                                    const struct groom_context *context,
                                                    struct groom_quality *quality, struct groom_diag *diag);

struct groom;

/* Compares a groom's strands with the target, as they are and with every operator's random numbers
 * drawn from its seed: before and after stage `randoms` of a fit.
 * drawn    equal to *fitted where the groom's numbers are such draws
 * memory   the groom once more, and its strands */
GROOM_MUST_CHECK groom_status groom_quality_of_groom(const struct groom_quality_target *target,
                                                     const struct groom *groom, const struct groom_context *context,
                                                     struct groom_quality *fitted, struct groom_quality *drawn,
                                                     struct groom_diag *diag);

/* {"format":"quality/1","strands":{..},"fitted":{..},"drawn":{..}|null}; proto/openapi.yaml has it whole.
 * fitted   the groom as it is
 * drawn    the same groom with random numbers drawn from its seeds; NULL: not measured
 * json     malloc'd and ended by 0, for the caller to free() */
GROOM_MUST_CHECK groom_status groom_quality_print(const struct groom_quality *fitted, const struct groom_quality *drawn,
                                                  char **json, struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
