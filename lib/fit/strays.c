#include "fit/strays.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/sort.h"
#include "fit/follow.h"
#include "fit/strand_state.h"

#define SAMPLE 1000      /* strands that tell what is usual */
#define FAR_OFF 4.0f     /* times the usual error */
#define NEAR 3           /* operator guides around a strand that it tries, besides its own */
#define GAIN 0.1f        /* share of its error that another one must be better by */
#define VALUES 12        /* of a number, over its range; */
#define RUGGED_VALUES 40 /* where the error is rugged in it */
#define HALVINGS 3

struct strays {
    struct random_search *search;
    struct groom *groom;
    uint32_t n, *strand;          /* [n] */
    uint32_t n_near, *near;       /* [n][n_near] operator guides, UINT32_MAX: none */
    float *least, *now;           /* [n] errors: of what is best so far, and of what is tried */
    struct strand_state was, best;
};

/* --- who strays ------------------------------------------------------------------------------- */

static void errors_of(struct random_search *search, const uint32_t *strand, uint32_t n, float *error,
                      const struct groom_context *context)
{
    search->only = strand;
    random_search_errors(search, n, error, context);
    search->only = NULL;
}

/* The median error, of strands spread over all. */
static groom_status find_usual(struct random_search *search, float *usual, const struct groom_context *context,
                               struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t all = search->fit->n, n = all < SAMPLE ? all : SAMPLE;
    uint32_t *strand = memory_array(allocator, n, sizeof *strand);
    float *error = memory_array(allocator, n, sizeof *error);
    groom_status st = strand && error ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to tell what errors are usual");
    if (st == GROOM_OK) {
        for (uint32_t at = 0; at < n; at++)
            strand[at] = (uint32_t)((uint64_t)at * all / n);
        errors_of(search, strand, n, error, context);
        *usual = median_of_floats(error, n);
    }
    memory_release(allocator, strand, n, sizeof *strand);
    memory_release(allocator, error, n, sizeof *error);
    return st;
}

/* Of the strands that are listed, those that are far off, and how far. */
static void leave_far(struct strays *s, float usual, const struct groom_context *context)
{
    uint32_t n = 0;
    errors_of(s->search, s->strand, s->n, s->least, context);
    for (uint32_t at = 0; at < s->n; at++)
        if (s->least[at] > FAR_OFF * usual) {
            s->strand[n] = s->strand[at];
            s->least[n++] = s->least[at];
        }
    s->n = n;
}

/* --- what they try ------------------------------------------------------------------------------ */

static int moves_bundles(const struct groom *groom)
{
    int any = 0;
    for (uint32_t o = 0; o < groom->n_operators; o++)
        any |= groom->operators[o].enabled &&
               (groom->operators[o].type == GROOM_OPERATOR_CURL || groom->operators[o].type == GROOM_OPERATOR_CLUMP);
    return any && groom->n_operator_guides > 1;
}

/* near [n][n_near] */
static groom_status find_near(struct strays *s, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    float (*uv)[2] = memory_array(allocator, s->n, sizeof *uv);
    if (!uv)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the places of %u strands", s->n);
    for (uint32_t at = 0; at < s->n; at++)
        memcpy(uv[at], s->groom->root_uv[s->strand[at]], sizeof *uv);
    groom_status st = follow_candidates(s->groom, (const float (*)[2])uv, s->n, s->n_near, s->near, context, diag);
    memory_release(allocator, uv, s->n, sizeof *uv);
    return st;
}

/* From where they began, with the c-th operator guide near them; the last is their own. */
static void try_numbers(struct strays *s, uint32_t c, const struct groom_context *context)
{
    for (uint32_t at = 0; at < s->n; at++) {
        uint32_t guide = c < s->n_near ? s->near[(size_t)at * s->n_near + c] : UINT32_MAX;
        strand_state_give_back(&s->was, s->groom, at);
        if (guide != UINT32_MAX)
            s->groom->operator_guide_of[s->strand[at]] = guide;
    }
    s->search->only = s->strand;
    random_search_numbers(s->search, 0, s->n, VALUES, RUGGED_VALUES, HALVINGS, context);
    random_search_polish(s->search, 0, s->n, 1, 0, 0, context);
    errors_of(s->search, s->strand, s->n, s->now, context);
}

static void keep_better(struct strays *s)
{
    for (uint32_t at = 0; at < s->n; at++) {
        int same = s->groom->operator_guide_of[s->strand[at]] == s->best.follows[at];
        if (s->now[at] < (same ? 1 : 1 - GAIN) * s->least[at]) {
            s->least[at] = s->now[at];
            strand_state_keep(&s->best, s->groom, at);
        }
    }
}

static groom_status settle(struct strays *s, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    groom_status st = strand_state_init(&s->was, s->groom, s->strand, 0, s->n, allocator, diag);
    if (st == GROOM_OK)
        st = strand_state_init(&s->best, s->groom, s->strand, 0, s->n, allocator, diag);
    if (st == GROOM_OK && s->n_near > 0)
        st = find_near(s, context, diag);
    for (uint32_t c = 0; st == GROOM_OK && c <= s->n_near; c++) {
        try_numbers(s, c, context);
        keep_better(s);
    }
    for (uint32_t at = 0; st == GROOM_OK && at < s->n; at++)
        strand_state_give_back(&s->best, s->groom, at);
    strand_state_finish(&s->was, allocator);
    strand_state_finish(&s->best, allocator);
    return st;
}

groom_status strays_settle(struct random_search *search, uint32_t first, uint32_t count, int follow, const struct groom_context *context,
                           struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom *groom = search->fit->groom;
    struct strays s = {.search = search, .groom = groom, .n = count};
    float usual = 0;
    s.n_near = !follow || !moves_bundles(groom) ? 0 : NEAR < groom->n_operator_guides ? NEAR : groom->n_operator_guides;
    s.strand = memory_array(allocator, count, sizeof *s.strand);
    s.near = memory_array(allocator, (size_t)count * s.n_near, sizeof *s.near);
    s.least = memory_array(allocator, count, sizeof *s.least);
    s.now = memory_array(allocator, count, sizeof *s.now);
    groom_status st = s.strand && s.near && s.least && s.now ? find_usual(search, &usual, context, diag)
                                                             : groom_fail(diag, GROOM_ENOMEM, "no memory to look for strays");
    if (st == GROOM_OK) {
        for (uint32_t at = 0; at < count; at++)
            s.strand[at] = first + at;
        leave_far(&s, usual, context);
        if (s.n > 0)
            st = settle(&s, context, diag);
    }
    memory_release(allocator, s.strand, count, sizeof *s.strand);
    memory_release(allocator, s.near, (size_t)count * s.n_near, sizeof *s.near);
    memory_release(allocator, s.least, count, sizeof *s.least);
    memory_release(allocator, s.now, count, sizeof *s.now);
    return st;
}
