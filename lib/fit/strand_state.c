#include "fit/strand_state.h"

#include <string.h>

#include "base/memory.h"

int strand_state_draws(const struct groom_operator *op)
{
    return groom_operator_random_arrays(op->type) > 0 && !groom_operator_random_per_guide(op->type);
}

static size_t strand_at(const struct strand_state *state, uint32_t at)
{
    return state->strand ? state->strand[at] : state->first + (size_t)at;
}

groom_status strand_state_init(struct strand_state *state, const struct groom *groom, const uint32_t *strand, uint32_t first,
                               uint32_t n, const struct groom_allocator *allocator, struct groom_diag *diag)
{
    *state = (struct strand_state){.strand = strand, .first = first, .n = n, .n_instancing = groom->n_instancing,
                                   .n_operators = groom->n_operators};
    state->guide = memory_array(allocator, (size_t)n * state->n_instancing, sizeof *state->guide);
    state->weight = memory_array(allocator, (size_t)n * state->n_instancing, sizeof *state->weight);
    state->follows = memory_array(allocator, n, sizeof *state->follows);
    state->number = memory_array(allocator, (size_t)n * state->n_operators, sizeof *state->number);
    if (!state->guide || !state->weight || !state->follows || !state->number)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to keep %u strands as they are", n);
    for (uint32_t at = 0; at < n; at++)
        strand_state_keep(state, groom, at);
    return GROOM_OK;
}

void strand_state_finish(struct strand_state *state, const struct groom_allocator *allocator)
{
    memory_release(allocator, state->guide, (size_t)state->n * state->n_instancing, sizeof *state->guide);
    memory_release(allocator, state->weight, (size_t)state->n * state->n_instancing, sizeof *state->weight);
    memory_release(allocator, state->follows, state->n, sizeof *state->follows);
    memory_release(allocator, state->number, (size_t)state->n * state->n_operators, sizeof *state->number);
}

void strand_state_keep(struct strand_state *state, const struct groom *groom, uint32_t at)
{
    size_t k = state->n_instancing, i = strand_at(state, at);
    memcpy(state->guide + at * k, groom->instancing_guide + i * k, k * sizeof *state->guide);
    memcpy(state->weight + at * k, groom->instancing_weight + i * k, k * sizeof *state->weight);
    state->follows[at] = groom->operator_guide_of[i];
    for (uint32_t o = 0; o < state->n_operators; o++)
        if (strand_state_draws(&groom->operators[o]))
            state->number[(size_t)at * state->n_operators + o] = groom->operators[o].random[0][i];
}

void strand_state_give_back(const struct strand_state *state, struct groom *groom, uint32_t at)
{
    size_t k = state->n_instancing, i = strand_at(state, at);
    memcpy(groom->instancing_guide + i * k, state->guide + at * k, k * sizeof *state->guide);
    memcpy(groom->instancing_weight + i * k, state->weight + at * k, k * sizeof *state->weight);
    groom->operator_guide_of[i] = state->follows[at];
    for (uint32_t o = 0; o < state->n_operators; o++)
        if (strand_state_draws(&groom->operators[o]))
            groom->operators[o].random[0][i] = state->number[(size_t)at * state->n_operators + o];
}
