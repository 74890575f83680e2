#include "fit/head_clear.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "fit/follow.h"
#include "fit/gather.h"
#include "fit/head_planes.h"
#include "fit/strand_state.h"
#include "geometry/side.h"
#include "groom/spatial.h"

#define LEFT 0.001       /* metres in the head of ordinary size that are told of */
#define STIFF 10.0f      /* times what depth costs while numbers are looked for */
#define GAIN 0.3f        /* share of its error that another operator guide must be better by */
#define NEAR_OPERATORS 32 /* operator guides around a strand that it may follow first, */
#define NEAR 96          /* and guides; */
#define AFAR_OPERATORS 96 /* the same where it stays in with these */
#define AFAR 200
#define TRIES 16         /* with other guides; in each, depth costs twice what it did in the one before */
#define LENDERS 16       /* strands around one that stays in all the same, of which one after the other lends it what it has */
#define CHUNK 4000       /* strands that are looked at together */
#define STRANDS_PER_PIECE 16
#define STEPS 3          /* of Newton */
#define AS_NEAR 1.05f    /* times what it was: the error with which a strand is still as near to its target */
#define VALUES 24        /* of a number, over its range */
#define HALVINGS 3
#define HOLD 0.001f      /* moving a weight is cheap here */

/* --- how deep ------------------------------------------------------------------------------- */

static float apart(const float a[3], const float b[3])
{
    float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrtf(x * x + y * y + z * z);
}

/* What strands are like as they stand. */
struct standing {
    float *depth;  /* [n] of the deepest vertex but the root, metres */
    float *beyond; /* [n] how much deeper that is than the deepest of its target */
    float *error;  /* [n] but for depth */
};

struct looking {
    const struct groom_bvh *head;
    const float (*points)[3], (*target)[3]; /* [n * m] */
    uint32_t n, m;
    struct standing *standing;
};

/* What a vertex is outside, those after it are for as long. */
static float depth_of(const struct groom_bvh *head, const float (*x)[3], uint32_t m)
{
    struct side_walk walk = side_walk_begin(head);
    float spare = 0, depth = 0;
    for (uint32_t j = 1; j < m; j++) {
        struct groom_surface_point near;
        if ((spare -= apart(x[j - 1], x[j])) > 0 || !groom_bvh_closest(head, x[j], INFINITY, &near))
            continue;
        int inside = side_walk(&walk, x[j]);
        depth = inside ? fmaxf(depth, near.distance) : depth;
        spare = inside ? 0 : near.distance;
    }
    return depth;
}

static void look_at(const struct looking *job, uint32_t i)
{
    float depth = depth_of(job->head, job->points + (size_t)i * job->m, job->m);
    job->standing->depth[i] = depth;
    job->standing->beyond[i] = depth > 0 ? depth - depth_of(job->head, job->target + (size_t)i * job->m, job->m) : 0;
}

static void look_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct looking *job = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < job->n && i - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; i++)
        look_at(job, i);
}

/* points, target [n * m] scratch */
static groom_status measure(struct random_search *search, const uint32_t *strand, uint32_t n, float (*points)[3],
                            float (*target)[3], struct standing *standing, const struct groom_context *context,
                            struct groom_diag *diag)
{
    const struct groom_fit *fit = search->fit;
    struct looking job = {fit->bvh, (const float (*)[3])points, (const float (*)[3])target, n, fit->m, standing};
    groom_status st = gather_evaluated(fit, strand, n, points, context, diag);
    if (st != GROOM_OK)
        return st;
    gather_targets(fit, strand, n, target);
    parallel_for(context, (n + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE, look_piece, &job);
    float price = search->weights.depth;
    search->weights.depth = 0;
    search->only = strand;
    random_search_errors(search, n, standing->error, context);
    search->weights.depth = price;
    search->only = NULL;
    return GROOM_OK;
}

/* --- ways out ---------------------------------------------------------------------------------- */

static uint32_t lesser(uint32_t a, uint32_t b) { return a < b ? a : b; }

/* What is near strands of the search. */
struct near { float (*uv)[2]; uint32_t n, k, *candidate; /* [n], [n * k] */ };

static groom_status near_init(struct near *near, const struct random_search *search, uint32_t n, uint32_t k,
                              const struct groom_allocator *allocator, struct groom_diag *diag)
{
    *near = (struct near){memory_array(allocator, n, sizeof *near->uv), n, k,
                          memory_array(allocator, (size_t)n * k, sizeof *near->candidate)};
    if (!near->uv || !near->candidate)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to choose guides");
    for (uint32_t at = 0; at < n; at++)
        memcpy(near->uv[at], search->fit->groom->root_uv[search->only[at]], sizeof *near->uv);
    return GROOM_OK;
}

static void near_finish(struct near *near, const struct groom_allocator *allocator)
{
    memory_release(allocator, near->uv, near->n, sizeof *near->uv);
    memory_release(allocator, near->candidate, (size_t)near->n * near->k, sizeof *near->candidate);
}

/* Other operator guides, where their curl or clump is what draws strands in. */
static groom_status choose_operator_guides(struct random_search *search, uint32_t n, uint32_t n_near, const struct groom_context *context,
                                           struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const struct groom *groom = search->fit->groom;
    struct near near;
    groom_status st = near_init(&near, search, n, lesser(n_near, groom->n_operator_guides), allocator, diag);
    if (st == GROOM_OK &&
        (st = follow_candidates(groom, (const float (*)[2])near.uv, n, near.k, near.candidate, context, diag)) == GROOM_OK)
        random_search_guides(search, 0, n, near.candidate, near.k, GAIN, context);
    near_finish(&near, allocator);
    return st;
}

/* Other guides for each strand; one at first, which the polish then mixes. Of those near it, the best n_tried are passed
 * over, as long as there are others. */
static groom_status choose_guides(struct random_search *search, uint32_t n, uint32_t n_near, uint32_t n_tried,
                                  const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const struct groom *groom = search->fit->groom;
    uint32_t k = lesser(n_near, groom->n_guides), skip = lesser(n_tried, k - lesser(groom->n_instancing, k));
    struct groom_neighbours *index = NULL;
    struct near near;
    groom_status st = near_init(&near, search, n, k, allocator, diag);
    if (st == GROOM_OK)
        st = groom_neighbours_create(groom->guide_uv[0], groom->n_guides, 2, context, &index, diag);
    if (st == GROOM_OK &&
        (st = groom_neighbours_find(index, near.uv[0], n, k, near.candidate, NULL, context, diag)) == GROOM_OK)
        random_search_instances(search, n, near.candidate, k, skip, context);
    groom_neighbours_destroy(index);
    near_finish(&near, allocator);
    return st;
}

/* The strand next to each, passing over the nearest n_lent; itself where there is none. lender [n] */
static groom_status find_lenders(const struct random_search *search, uint32_t n, uint32_t n_lent, uint32_t *lender,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const struct groom *groom = search->fit->groom;
    uint32_t k = lesser(n_lent + 2, groom->n_strands); /* of which the first is the strand itself */
    struct groom_neighbours *index = NULL;
    struct near near;
    groom_status st = near_init(&near, search, n, k, allocator, diag);
    if (st == GROOM_OK)
        st = groom_neighbours_create(groom->root_uv[0], groom->n_strands, 2, context, &index, diag);
    if (st == GROOM_OK)
        st = groom_neighbours_find(index, near.uv[0], n, k, near.candidate, NULL, context, diag);
    for (uint32_t at = 0; st == GROOM_OK && at < n; at++) {
        uint32_t farthest = near.candidate[(size_t)at * k + k - 1];
        lender[at] = farthest == UINT32_MAX ? search->only[at] : farthest;
    }
    groom_neighbours_destroy(index);
    near_finish(&near, allocator);
    return st;
}

/* All that these have of their own, to the strands of the search. */
static groom_status lend(struct random_search *search, uint32_t n, uint32_t n_lent, const struct groom_context *context,
                         struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom *groom = search->fit->groom;
    struct strand_state lent = {0};
    uint32_t *lender = memory_array(allocator, n, sizeof *lender);
    groom_status st = lender ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to look for strands that are out");
    if (st == GROOM_OK && (st = find_lenders(search, n, n_lent, lender, context, diag)) == GROOM_OK)
        st = strand_state_init(&lent, groom, lender, 0, n, allocator, diag);
    lent.strand = search->only;
    for (uint32_t at = 0; st == GROOM_OK && at < n; at++)
        strand_state_give_back(&lent, groom, at);
    strand_state_finish(&lent, allocator);
    memory_release(allocator, lender, n, sizeof *lender);
    return st;
}

/* What is deeper in the head than its target: from where it is; then, try by try, from other guides and on from there.
 * Planes beside the target tell little of where a strand far from it is in the head, so that the guides that promise most
 * may not keep what they promise, and others are tried. Then what strands next to it have of their own. At last all that is in
 * the head. */
struct way {
    enum { NUDGED, BLENDED_ANEW, LENT, WITHDRAWN } kind;
    uint32_t n_tries; /* before this one */
};
#define N_WAYS_BLENDED (1 + 2 * TRIES)
#define N_WAYS (N_WAYS_BLENDED + LENDERS + 1)
_Static_assert(TRIES <= RANDOM_SEARCH_SKIP + 1, "a try passes over those of all before it");

static struct way way_at(uint32_t k)
{
    if (k + 1 == N_WAYS)
        return (struct way){WITHDRAWN, 0};
    if (k >= N_WAYS_BLENDED)
        return (struct way){LENT, k - N_WAYS_BLENDED};
    return (struct way){k % 2 ? BLENDED_ANEW : NUDGED, k < 2 ? 0 : (k - 1) / 2};
}

static groom_status blend_anew(struct random_search *search, uint32_t n, uint32_t n_tries,
                               const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = choose_operator_guides(search, n, n_tries == 0 ? NEAR_OPERATORS : AFAR_OPERATORS, context, diag);
    if (st == GROOM_OK)
        st = choose_guides(search, n, n_tries == 0 ? NEAR : AFAR, n_tries, context, diag);
    if (st == GROOM_OK)
        random_search_numbers(search, 0, n, VALUES, VALUES, HALVINGS, context);
    return st;
}

static groom_status take(struct way way, struct random_search *search, uint32_t n, const struct groom_context *context,
                         struct groom_diag *diag)
{
    groom_status st = GROOM_OK;
    search->out_of_head = way.kind == WITHDRAWN;
    if (way.kind == BLENDED_ANEW)
        st = blend_anew(search, n, way.n_tries, context, diag);
    if (way.kind == LENT)
        st = lend(search, n, way.n_tries, context, diag);
    if (st == GROOM_OK)
        random_search_polish(search, 0, n, STEPS, HOLD, 1, context);
    return st;
}

/* --- strands -------------------------------------------------------------------------------------- */

struct clearing {
    struct random_search *search;
    uint32_t first, count;            /* the strands that are looked at together */
    uint32_t n, *strand;              /* [n <= count] those of them that a way is tried for */
    struct standing now, after;       /* [count] of all; [n] of what the way makes of them */
    float (*points)[3], (*target)[3]; /* [count * m] scratch */
    float deep, price;                /* of depth, at first */
};

/* The strands that a way is for. */
static void list_for(struct clearing *job, struct way way)
{
    const float *depth = way.kind == WITHDRAWN ? job->now.depth : job->now.beyond;
    job->n = 0;
    for (uint32_t at = 0; at < job->count; at++)
        if (depth[at] > job->deep)
            job->strand[job->n++] = job->first + at;
}

/* A strand that is deeper in the head than its target comes out at any cost; one that follows it in, only where it comes
 * out about as near to it as it was. */
static int is_better(const struct clearing *job, uint32_t at)
{
    const struct standing *now = &job->now, *after = &job->after;
    uint32_t i = job->strand[at] - job->first;
    if (now->beyond[i] > job->deep)
        return after->beyond[at] < now->beyond[i];
    return after->beyond[at] <= job->deep && after->depth[at] < now->depth[i] && after->error[at] <= AS_NEAR * now->error[i];
}

static void keep_better(struct clearing *job, const struct strand_state *before)
{
    for (uint32_t at = 0; at < job->n; at++) {
        uint32_t i = job->strand[at] - job->first;
        if (is_better(job, at)) {
            job->now.depth[i] = job->after.depth[at];
            job->now.beyond[i] = job->after.beyond[at];
            job->now.error[i] = job->after.error[at];
        } else
            strand_state_give_back(before, job->search->fit->groom, at);
    }
}

static groom_status try_way(struct clearing *job, struct way way, const struct groom_context *context,
                            struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct strand_state before;
    groom_status st = strand_state_init(&before, job->search->fit->groom, job->strand, 0, job->n, allocator, diag);
    job->search->only = job->strand;
    job->search->weights.depth = ldexpf(job->price, (int)way.n_tries);
    if (st == GROOM_OK && (st = take(way, job->search, job->n, context, diag)) == GROOM_OK &&
        (st = measure(job->search, job->strand, job->n, job->points, job->target, &job->after, context, diag)) == GROOM_OK)
        keep_better(job, &before);
    strand_state_finish(&before, allocator);
    return st;
}

static void count_left(const struct clearing *job, struct head_left *left)
{
    for (uint32_t at = 0; at < job->count; at++) {
        left->n_deep += job->now.depth[at] > left->depth;
        left->n_beyond += job->now.beyond[at] > left->depth;
    }
}

static groom_status clear_chunk(struct clearing *job, uint32_t first, uint32_t count, struct head_left *left,
                                const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st;
    job->first = first;
    job->count = count;
    for (uint32_t at = 0; at < count; at++)
        job->strand[at] = first + at;
    if ((st = measure(job->search, job->strand, count, job->points, job->target, &job->now, context, diag)) != GROOM_OK)
        return st;
    for (uint32_t k = 0; st == GROOM_OK && k < N_WAYS; k++) {
        list_for(job, way_at(k));
        if (job->n > 0)
            st = try_way(job, way_at(k), context, diag);
    }
    count_left(job, left);
    return st;
}

#define N_FLOATS 6 /* a strand */

groom_status head_clear(struct random_search *search, uint32_t first, uint32_t count, struct head_left *left,
                        const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t size = lesser(count, CHUNK), m = search->fit->m;
    struct clearing job = {.search = search, .deep = (float)HEAD_TOO_DEEP * search->fit->ordinary,
                           .price = STIFF * search->weights.depth};
    struct head_left found = {.depth = (float)LEFT * search->fit->ordinary};
    struct strand_state whole;
    groom_status st = strand_state_init(&whole, search->fit->groom, NULL, first, count, allocator, diag);
    int is_kept = st == GROOM_OK;
    float *floats = memory_array(allocator, (size_t)size * N_FLOATS, sizeof *floats);
    job.strand = memory_array(allocator, size, sizeof *job.strand);
    job.points = memory_array(allocator, (size_t)size * m, sizeof *job.points);
    job.target = memory_array(allocator, (size_t)size * m, sizeof *job.target);
    if (st == GROOM_OK && !(floats && job.strand && job.points && job.target))
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to look for strands in the head");
    if (st == GROOM_OK) {
        job.now = (struct standing){floats, floats + size, floats + 2 * (size_t)size};
        job.after = (struct standing){floats + 3 * (size_t)size, floats + 4 * (size_t)size, floats + 5 * (size_t)size};
    }
    for (uint32_t at = 0; st == GROOM_OK && at < count; at += size)
        st = clear_chunk(&job, first + at, lesser(count - at, size), &found, context, diag);
    for (uint32_t at = 0; is_kept && st != GROOM_OK && at < count; at++) /* a step that fails has changed nothing */
        strand_state_give_back(&whole, search->fit->groom, at);
    if (st == GROOM_OK)
        *left = found;
    strand_state_finish(&whole, allocator);
    memory_release(allocator, floats, (size_t)size * N_FLOATS, sizeof *floats);
    memory_release(allocator, job.strand, size, sizeof *job.strand);
    memory_release(allocator, job.points, (size_t)size * m, sizeof *job.points);
    memory_release(allocator, job.target, (size_t)size * m, sizeof *job.target);
    return st;
}
