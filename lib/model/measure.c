/* Arc lengths of a block that comes from guides or from a base; operators measure what they make. */
#include "model/kernel.h"
#include "model/vec.h"

static void measure_baseline(uint32_t m, const lanes *restrict x, lanes *restrict at) { vec_measure(m, x, at); }

#if defined(__x86_64__)
KERNEL_TARGET_AVX2 static void measure_avx2(uint32_t m, const lanes *restrict x, lanes *restrict at)
{
    vec_measure(m, x, at);
}
kernel_measure *const kernel_measures[KERNEL_VARIANTS] = {measure_baseline, measure_avx2};
#else
kernel_measure *const kernel_measures[KERNEL_VARIANTS] = {measure_baseline};
#endif
