/* Arc lengths of a block that comes from guides or from a base; operators measure what they make. */
#include "model/kernel.h"
#include "model/vec.h"

LANES_INLINE void measure_body(uint32_t m, const lanes *restrict x, lanes *restrict at)
{
    struct measure measure = measure_from(x);
    vec_store(at[0], measure.length);
    for (uint32_t j = 1; j < m; j++) {
        measure_to(&measure, vec_load(x[3 * j]), vec_load(x[3 * j + 1]), vec_load(x[3 * j + 2]));
        vec_store(at[j], measure.length);
    }
}

static void measure_baseline(uint32_t m, const lanes *restrict x, lanes *restrict at) { measure_body(m, x, at); }

#if defined(__x86_64__)
KERNEL_TARGET_AVX2 static void measure_avx2(uint32_t m, const lanes *restrict x, lanes *restrict at)
{
    measure_body(m, x, at);
}
kernel_measure *const kernel_measures[KERNEL_VARIANTS] = {measure_baseline, measure_avx2};
#else
kernel_measure *const kernel_measures[KERNEL_VARIANTS] = {measure_baseline};
#endif
