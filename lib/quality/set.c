#include "quality/set.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"

static groom_status allocate(struct quality_set *set, uint32_t n, uint32_t m, const struct groom_context *context,
                             struct groom_diag *diag)
{
    memset(set, 0, sizeof *set);
    set->allocator = memory_allocator(context);
    if ((uint64_t)n * m > UINT32_MAX)
        return groom_fail(diag, GROOM_ETOOBIG, "%u strands of %u vertices are more than 2^32 vertices", n, m);
    set->n = n;
    set->m = m;
    set->points = memory_array(set->allocator, (size_t)n * m, sizeof *set->points);
    set->start = memory_array(set->allocator, (size_t)n + 1, sizeof *set->start);
    if (!set->points || !set->start)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to compare %u strands of %u vertices", n, m);
    return GROOM_OK;
}

void quality_set_finish(struct quality_set *set)
{
    if (!set->allocator)
        return;
    memory_release(set->allocator, set->points, (size_t)set->n * set->m, sizeof *set->points);
    memory_release(set->allocator, set->start, (size_t)set->n + 1, sizeof *set->start);
    memset(set, 0, sizeof *set);
}

static groom_status check(const struct groom_strands *strands, struct groom_diag *diag)
{
    if (strands->n_strands < 2)
        return groom_fail(diag, GROOM_EEMPTY, "strands are compared in two halves: there must be 2 at least");
    for (uint32_t i = 0; i < strands->n_strands; i++)
        for (uint32_t v = strands->first[i]; v < strands->first[i + 1]; v++)
            for (int c = 0; c < 3; c++)
                if (!isfinite(strands->points[v][c]))
                    return groom_fail(diag, GROOM_EINVAL, "vertex %u of strand %u is not finite", v - strands->first[i], i);
    return GROOM_OK;
}

groom_status quality_set_init(struct quality_set *set, const struct groom_strands *strands, uint32_t m,
                              const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st;
    memset(set, 0, sizeof *set);
    if ((st = check(strands, diag)) != GROOM_OK ||
        (st = allocate(set, strands->n_strands, m, context, diag)) != GROOM_OK ||
        (st = groom_strands_resample(strands, m, set->points, context, diag)) != GROOM_OK)
        return st;
    set->start[0] = 0;
    for (uint32_t i = 0; i < set->n; i++) {
        const float (*points)[3] = (const float (*)[3])(strands->points + strands->first[i]);
        set->start[i + 1] = set->start[i] + groom_polyline_length(points, strands->first[i + 1] - strands->first[i]);
    }
    if (!(quality_set_length(set) > 0))
        return groom_fail(diag, GROOM_EEMPTY, "no strand has any length: there is nothing to compare");
    return GROOM_OK;
}

groom_status quality_set_select(struct quality_set *set, const struct quality_set *from, const uint32_t *strand, uint32_t n,
                                const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = allocate(set, n, from->m, context, diag);
    if (st != GROOM_OK)
        return st;
    set->start[0] = 0;
    for (uint32_t i = 0; i < n; i++) {
        memcpy(set->points + (size_t)i * set->m, from->points + (size_t)strand[i] * set->m, set->m * sizeof *set->points);
        set->start[i + 1] = set->start[i] + (from->start[strand[i] + 1] - from->start[strand[i]]);
    }
    return GROOM_OK;
}

double quality_set_length(const struct quality_set *set) { return set->start[set->n]; }

/* The last strand that starts at `arc` or before. */
static uint32_t strand_at(const struct quality_set *set, double arc)
{
    uint32_t low = 0, high = set->n - 1;
    while (low < high) {
        uint32_t middle = low + (high - low + 1) / 2;
        if (set->start[middle] <= arc)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

void quality_set_place(const struct quality_set *set, double arc, struct quality_place *place)
{
    uint32_t i = strand_at(set, arc);
    double length = set->start[i + 1] - set->start[i];
    double at = length > 0 ? fmin(fmax((arc - set->start[i]) / length, 0), 1) * (set->m - 1) : 0;
    uint32_t j = at < set->m - 2 ? (uint32_t)at : set->m - 2;
    const float *a = set->points[(size_t)i * set->m + j], *b = a + 3;
    double t = at - j, square = 0;
    for (int c = 0; c < 3; c++) {
        place->position[c] = (float)(a[c] + t * ((double)b[c] - a[c]));
        place->direction[c] = b[c] - a[c];
        square += (double)place->direction[c] * place->direction[c];
    }
    for (int c = 0; c < 3; c++)
        place->direction[c] = square > 0 ? (float)(place->direction[c] / sqrt(square)) : 0;
}
