/* Trigonometry in rows on the kernel for this processor. */
#include "curvature/trig_rows.h"

void trig_rows(const struct trig_rows *rows, uint32_t n)
{
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2")) {
        trig_rows_avx2(rows, n);
        return;
    }
#endif
    trig_rows_generic(rows, n);
}
