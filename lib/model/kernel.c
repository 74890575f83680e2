#include "model/kernel.h"

const struct operator_kernels *kernel_of(groom_operator_type type)
{
    static const struct operator_kernels *const table[GROOM_OPERATOR_COUNT] = {
        [GROOM_OPERATOR_SCALE] = &scale_kernels, [GROOM_OPERATOR_BEND] = &bend_kernels,
        [GROOM_OPERATOR_CURL] = &curl_kernels,   [GROOM_OPERATOR_CLUMP] = &clump_kernels,
        [GROOM_OPERATOR_FRIZZ] = &frizz_kernels,
    };
    return table[type];
}

enum kernel_variant kernel_best_variant(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return KERNEL_AVX2;
#endif
    return KERNEL_BASELINE;
}
