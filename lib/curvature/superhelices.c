/* The container of super-helices: memory, copies, and the check of what came from outside. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "groom/curvature.h"

#define ORTHONORMAL_TOLERANCE 1e-6

void groom_superhelices_destroy(struct groom_superhelices *helices)
{
    if (!helices)
        return;
    const struct groom_allocator *a = helices->allocator;
    size_t n = helices->n_strands, m = helices->n_elements;
    memory_release(a, helices->first, n + 1, sizeof *helices->first);
    memory_release(a, helices->root, n, sizeof *helices->root);
    memory_release(a, helices->frame, n, sizeof *helices->frame);
    memory_release(a, helices->length, m, sizeof *helices->length);
    memory_release(a, helices->q, m, sizeof *helices->q);
    memory_release(a, helices, 1, sizeof *helices);
}

static int allocate_arrays(struct groom_superhelices *helices)
{
    const struct groom_allocator *a = helices->allocator;
    size_t n = helices->n_strands, m = helices->n_elements;
    helices->first = memory_array(a, n + 1, sizeof *helices->first);
    helices->root = memory_array(a, n, sizeof *helices->root);
    helices->frame = memory_array(a, n, sizeof *helices->frame);
    helices->length = memory_array(a, m, sizeof *helices->length);
    helices->q = memory_array(a, m, sizeof *helices->q);
    return helices->first && helices->root && helices->frame && helices->length && helices->q;
}

groom_status groom_superhelices_create(uint64_t n_strands, uint64_t n_elements,
                                       const struct groom_context *context,
                                       struct groom_superhelices **helices, struct groom_diag *diag)
{
    if (n_strands > UINT32_MAX - 1 || n_elements > UINT32_MAX - 1)
        return groom_fail(diag, GROOM_ETOOBIG, "%llu elements in %llu strands: the limit is 2^32-2 of each",
                          (unsigned long long)n_elements, (unsigned long long)n_strands);
    const struct groom_allocator *a = memory_allocator(context);
    struct groom_superhelices *made = memory_array_zero(a, 1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the super-helices");
    made->allocator = a;
    made->n_strands = (uint32_t)n_strands;
    made->n_elements = (uint32_t)n_elements;
    if (!allocate_arrays(made)) {
        groom_superhelices_destroy(made);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %llu helical elements",
                          (unsigned long long)n_elements);
    }
    made->first[0] = 0;
    *helices = made;
    return GROOM_OK;
}

groom_status groom_superhelices_copy(const struct groom_superhelices *helices,
                                     const struct groom_context *context,
                                     struct groom_superhelices **copy, struct groom_diag *diag)
{
    struct groom_superhelices *made = NULL;
    size_t n = helices->n_strands, m = helices->n_elements;
    groom_status st = groom_superhelices_create(n, m, context, &made, diag);
    if (st != GROOM_OK)
        return st;
    memcpy(made->first, helices->first, (n + 1) * sizeof *made->first);
    memcpy(made->root, helices->root, n * sizeof *made->root);
    memcpy(made->frame, helices->frame, n * sizeof *made->frame);
    memcpy(made->length, helices->length, m * sizeof *made->length);
    memcpy(made->q, helices->q, m * sizeof *made->q);
    *copy = made;
    return GROOM_OK;
}

double groom_superhelix_length(const struct groom_superhelices *helices, uint32_t strand)
{
    double sum = 0.0;
    for (uint32_t j = helices->first[strand]; j < helices->first[strand + 1]; j++)
        sum += helices->length[j];
    return sum;
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static int is_orthonormal(const double f[3][3])
{
    const double (*a)[3] = f;
    double volume = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) +
                    a[0][1] * (a[1][2] * a[2][0] - a[1][0] * a[2][2]) +
                    a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
    double worst = fabs(volume - 1.0);
    for (int i = 0; i < 3; i++)
        for (int k = i; k < 3; k++)
            worst = fmax(worst, fabs(dot(f[i], f[k]) - (i == k)));
    return worst <= ORTHONORMAL_TOLERANCE; /* fmax drops a NaN: finiteness is asked for before */
}

static int all_finite(const double *numbers, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(numbers[i]))
            return 0;
    return 1;
}

static const char *fault_of_strand(const struct groom_superhelices *h, uint32_t i)
{
    uint32_t begin = h->first[i], end = h->first[i + 1];
    if (begin >= end || end > h->n_elements)
        return "has no elements, or offsets that do not rise";
    if (!all_finite(h->root[i], 3) || !all_finite(h->frame[i][0], 9) ||
        !all_finite(h->q[begin], (size_t)(end - begin) * 3) || !all_finite(&h->length[begin], end - begin))
        return "holds a number that is not finite";
    for (uint32_t j = begin; j < end; j++)
        if (h->length[j] < 0.0)
            return "has an element of negative length";
    if (!is_orthonormal((const double (*)[3])h->frame[i]))
        return "has a root frame that is not orthonormal and right-handed";
    return NULL;
}

groom_status groom_superhelices_check(const struct groom_superhelices *helices, struct groom_diag *diag)
{
    if (helices->first[0] != 0 || helices->first[helices->n_strands] != helices->n_elements)
        return groom_fail(diag, GROOM_EINVAL, "the element offsets must run from 0 to %u", helices->n_elements);
    for (uint32_t i = 0; i < helices->n_strands; i++) {
        const char *fault = fault_of_strand(helices, i);
        if (fault)
            return groom_fail(diag, GROOM_EINVAL, "super-helix %u %s", i, fault);
    }
    return GROOM_OK;
}
