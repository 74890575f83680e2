#include "fit/follow.h"

#include <string.h>

#include "base/memory.h"
#include "groom/spatial.h"

static void leave_used(const struct groom *groom, uint8_t *used, size_t n, uint32_t *candidate)
{
    for (uint32_t i = 0; i < groom->n_strands; i++)
        used[groom->operator_guide_of[i]] = 1;
    for (size_t i = 0; i < n; i++)
        if (candidate[i] != UINT32_MAX && !used[candidate[i]])
            candidate[i] = UINT32_MAX;
}

groom_status follow_candidates(const struct groom *groom, const float (*uv)[2], uint32_t n, uint32_t k, uint32_t *candidate,
                               const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_guides = groom->n_operator_guides;
    struct groom_neighbours *index = NULL;
    uint8_t *used = memory_array_zero(allocator, n_guides, 1);
    float (*at)[2] = memory_array(allocator, n_guides, sizeof *at);
    groom_status st = used && at ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to choose operator guides");
    for (uint32_t o = 0; st == GROOM_OK && o < n_guides; o++)
        memcpy(at[o], groom->guide_uv[groom->operator_guide[o]], sizeof at[o]);
    if (st == GROOM_OK)
        st = groom_neighbours_create(at[0], n_guides, 2, context, &index, diag);
    if (st == GROOM_OK && (st = groom_neighbours_find(index, uv[0], n, k, candidate, NULL, context, diag)) == GROOM_OK)
        leave_used(groom, used, (size_t)n * k, candidate);
    groom_neighbours_destroy(index);
    memory_release(allocator, used, n_guides, 1);
    memory_release(allocator, at, n_guides, sizeof *at);
    return st;
}
