/* The helices of a chain on the kernel for this processor. */
#include "curvature/helix_rows.h"

#include "curvature/chain.h"
#include "curvature/helix.h"

void helix_through_pair(const double p0[3], const double t0[3], const double p1[3], const double t1[3],
                        double omega[3], double *length)
{
    struct helix helix = helix_through(vec_of(p0), vec_of(t0), vec_of(p1), vec_of(t1));
    vec_store(helix.omega, omega);
    *length = helix.length;
}

void helix_chain(uint32_t n, const double (*p)[3], const double (*t)[3], double (*omega)[3], double *length)
{
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2")) {
        helix_chain_avx2(n, p, t, omega, length);
        return;
    }
#endif
    helix_chain_generic(n, p, t, omega, length);
}
