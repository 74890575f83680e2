/* An order of strands in which those that grow near each other are near: along a Z-curve of their roots. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "retarget/job.h"

#define BITS 10 /* an axis */

struct keyed {
    uint32_t key, strand;
};

static int compare(const void *a, const void *b)
{
    const struct keyed *x = a, *y = b;
    return x->key != y->key ? (x->key > y->key) - (x->key < y->key) : (x->strand > y->strand) - (x->strand < y->strand);
}

static uint32_t key_of(const float p[3], const float low[3], float size)
{
    uint32_t key = 0;
    for (int c = 0; c < 3; c++) {
        uint32_t at = size > 0 ? (uint32_t)((p[c] - low[c]) / size * ((1 << BITS) - 1)) : 0;
        for (int bit = 0; bit < BITS; bit++)
            key |= (at >> bit & 1) << (3 * bit + c);
    }
    return key;
}

/* returns the longest side of the roots' box */
static float bounds(const struct coupled *hair, float low[3])
{
    float size = 0;
    for (int c = 0; c < 3; c++) {
        float least = INFINITY, most = -INFINITY;
        for (uint32_t i = 0; i < hair->n_strands; i++) {
            least = fminf(least, hair->rest[hair->first[i]][c]);
            most = fmaxf(most, hair->rest[hair->first[i]][c]);
        }
        low[c] = least;
        size = fmaxf(size, most - least);
    }
    return size;
}

groom_status coupled_order(const struct coupled *hair, uint32_t *order, const struct groom_allocator *allocator,
                           struct groom_diag *diag)
{
    struct keyed *keyed = memory_array(allocator, hair->n_strands, sizeof *keyed);
    float low[3], size = bounds(hair, low);
    if (!keyed)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to order %u strands", hair->n_strands);
    for (uint32_t i = 0; i < hair->n_strands; i++)
        keyed[i] = (struct keyed){key_of(hair->rest[hair->first[i]], low, size), i};
    qsort(keyed, hair->n_strands, sizeof *keyed, compare);
    for (uint32_t i = 0; i < hair->n_strands; i++)
        order[i] = keyed[i].strand;
    memory_release(allocator, keyed, hair->n_strands, sizeof *keyed);
    return GROOM_OK;
}
