/* Half of a set of strands, as distributions. */
#ifndef QUALITY_HALF_H
#define QUALITY_HALF_H

#include "groom/quality.h"
#include "quality/set.h"

struct quality_half {
    struct quality_set set;
    uint32_t m_bend;                     /* vertices of a strand at which curvature and torsion are looked at */
    uint32_t n_curvatures, n_torsions;
    float *curvature, *torsion, *length; /* [n * (m_bend - 2)], [n * (m_bend - 3)], [n], ascending */
};

/* Distances of a half from another of as many strands. */
struct half_distances { double spectra, segments, curvature, torsion, length; };

/* strand  [n] of the set. Finish it in any case.
 * m_bend  4 .. the set's vertices
 * returns GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status quality_half_init(struct quality_half *half, const struct quality_set *from,
                                                const uint32_t *strand, uint32_t n, uint32_t m_bend,
                                                const struct groom_context *context, struct groom_diag *diag);
void quality_half_finish(struct quality_half *half);

GROOM_MUST_CHECK groom_status quality_half_compare(const struct quality_half *a, const struct quality_half *b,
                                                   uint64_t seed, const struct groom_context *context,
                                                   struct half_distances *distances, struct groom_diag *diag);

/* Ranges of histograms that show most of the values of a half. */
void quality_half_ranges(const struct quality_half *half, struct groom_quality *quality);
/* Adds the half's values, each as `share` of all, to the bins of the target or of the groom. */
void quality_half_count(const struct quality_half *half, double share, int of_groom, struct groom_quality *quality);

#endif
