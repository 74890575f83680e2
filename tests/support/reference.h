/* The procedural model in double precision, strand by strand, straight from the formulas of Chang et
 * al. 2025 (Eq. 3, Appendix A, with the conventions of the fit's notes) and libm: what the engine's
 * kernels are measured against. Slow, and independent of lib/model. */
#ifndef SUPPORT_REFERENCE_H
#define SUPPORT_REFERENCE_H

#include "groom/groom.h"

struct reference_operator {
    groom_operator_type type;
    int enabled;
    double parameter[GROOM_OPERATOR_MAX_PARAMETERS];
    double *random[GROOM_OPERATOR_MAX_RANDOM];
};

/* A groom's numbers widened to double, so that a test can move each by a small step. */
struct reference {
    const struct groom *groom; /* shape and indices; borrowed */
    double (*roots)[3], (*guides)[3], *weight;
    struct reference_operator *operators;
};

struct reference *reference_create(const struct groom *groom);
void reference_destroy(struct reference *reference);

/* out: [m][3] */
void reference_strand(const struct reference *reference, uint32_t strand, double (*out)[3]);

#endif
