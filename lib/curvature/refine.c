/* Least squares on the kernel for this processor. */
#include "curvature/refine.h"

double refine_fit(struct refine_strand *strand, struct refine_space *space, uint32_t n_steps,
                  double tolerance, double *worst)
{
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2"))
        return refine_fit_avx2(strand, space, n_steps, tolerance, worst);
#endif
    return refine_fit_generic(strand, space, n_steps, tolerance, worst);
}
