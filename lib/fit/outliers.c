#include "fit/outliers.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/radix.h"

#define FAR_ROOT 8.0f   /* times the median distance of roots from their middle */
#define FAR_REACH 4.0f  /* times what nine strands of ten reach, and */
#define FAR_REACH_ROOTS 20.0f
#define MOST_SHARE 0.1

struct sorting { float *values, *sorted, *spare; uint32_t n; };

static float quantile(struct sorting *s, double q)
{
    memcpy(s->sorted, s->values, s->n * sizeof *s->sorted);
    radix_sort_floats(s->sorted, s->spare, s->n);
    return s->sorted[(uint32_t)(q * (s->n - 1))];
}

static float distance(const float a[3], const float b[3])
{
    double x = (double)a[0] - b[0], y = (double)a[1] - b[1], z = (double)a[2] - b[2];
    return (float)sqrt(x * x + y * y + z * z);
}

/* The median of each coordinate of the roots, and the median distance from there; values holds the distances. */
static float measure_roots(const struct groom_strands *strands, struct sorting *s)
{
    float middle[3];
    for (int c = 0; c < 3; c++) {
        for (uint32_t i = 0; i < s->n; i++)
            s->values[i] = strands->points[strands->first[i]][c];
        middle[c] = quantile(s, 0.5);
    }
    for (uint32_t i = 0; i < s->n; i++)
        s->values[i] = distance(strands->points[strands->first[i]], middle);
    return quantile(s, 0.5);
}

static void measure_reach(const struct groom_strands *strands, struct sorting *s)
{
    for (uint32_t i = 0; i < s->n; i++) {
        s->values[i] = 0;
        for (uint32_t v = strands->first[i] + 1; v < strands->first[i + 1]; v++)
            s->values[i] = fmaxf(s->values[i], distance(strands->points[v], strands->points[strands->first[i]]));
    }
}

static void mark_above(const struct sorting *s, float limit, unsigned char *outlier)
{
    for (uint32_t i = 0; i < s->n; i++)
        outlier[i] |= s->values[i] > limit;
}

groom_status outliers_find(const struct groom_strands *strands, const struct groom_context *context, unsigned char *outlier,
                           uint32_t *n_outliers, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = strands->n_strands, found = 0;
    float *memory = memory_array(allocator, (size_t)3 * n, sizeof *memory);
    if (!memory)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to look for outliers among %u strands", n);
    struct sorting s = {memory, memory + n, memory + 2 * (size_t)n, n};
    memset(outlier, 0, n);
    float roots = measure_roots(strands, &s);
    if (roots > 0)
        mark_above(&s, FAR_ROOT * roots, outlier);
    measure_reach(strands, &s);
    mark_above(&s, FAR_REACH * quantile(&s, 0.9) + FAR_REACH_ROOTS * roots, outlier);
    for (uint32_t i = 0; i < n; i++)
        found += outlier[i];
    if (found > MOST_SHARE * n) {
        memset(outlier, 0, n);
        found = 0;
    }
    *n_outliers = found;
    memory_release(allocator, memory, (size_t)3 * n, sizeof *memory);
    return GROOM_OK;
}
