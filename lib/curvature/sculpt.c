/* Eq. 15 over many strands: anchors sorted by strand, strands in pieces through the vectorised solver; those that
 * take long are gathered from all pieces for further attempts, and the stubborn ones finished one by one. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "curvature/sculpt_lanes.h"
#include "curvature/sculpt_tail.h"
#include "groom/curvature.h"

#define STRANDS_A_PIECE 256
#define MOST_ANCHORS 256

struct groom_sculpt_options groom_sculpt_options_default(void)
{
    return (struct groom_sculpt_options){.stiffness = groom_sculpt_stiffness(10.0, 45), .max_iterations = 30,
                                         .n_roads = 3, .max_tail = 200, .tolerance = 1e-8, .most_turning = 1.5};
}

double groom_sculpt_stiffness(double c_cm4, uint32_t n_elements) { return c_cm4 * 1e-8 * n_elements; }

/* --- what is asked ----------------------------------------------------------------------- */

static int is_finite3(const double v[3]) { return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]); }

static groom_status check_options(const struct groom_sculpt_options *o, struct groom_diag *diag)
{
    if (!(o->stiffness >= 0.0) || !isfinite(o->stiffness))
        return groom_fail_field(diag, GROOM_EINVAL, "/stiffness", "stiffness is %g: it must be 0 or more", o->stiffness);
    if (!(o->tolerance >= 0.0) || !(o->most_turning > 0.0))
        return groom_fail(diag, GROOM_EINVAL, "tolerance must be 0 or more, most_turning above 0");
    return GROOM_OK;
}

static groom_status check_anchors(const struct groom_superhelices *h, const struct groom_anchor *anchors,
                                  size_t n, struct groom_diag *diag)
{
    char pointer[64];
    for (size_t i = 0; i < n; i++) {
        const struct groom_anchor *a = &anchors[i];
        const char *field = a->strand >= h->n_strands            ? "strand"
                            : !(a->at >= 0.0 && a->at <= 1.0)    ? "at"
                            : !is_finite3(a->position)           ? "position"
                                                                 : NULL;
        if (!field)
            continue;
        snprintf(pointer, sizeof pointer, "/anchors/%zu/%s", i, field);
        if (field[0] == 's')
            return groom_fail_field(diag, GROOM_EINVAL, pointer, "anchor %zu is on strand %u; there are %u strands", i,
                                    a->strand, h->n_strands);
        if (field[0] == 'a')
            return groom_fail_field(diag, GROOM_EINVAL, pointer, "anchor %zu is at %g of its strand: 0..1 is the strand",
                                    i, a->at);
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "the position of anchor %zu is not finite", i);
    }
    return GROOM_OK;
}

/* --- scratch of one thread ------------------------------------------------------------------ */

/* The strands of one piece, as the solver takes them. */
struct sculpt_batch {
    uint32_t n;
    struct lane_input in[STRANDS_A_PIECE];
    struct lane_output out[STRANDS_A_PIECE];
    double (*q[STRANDS_A_PIECE])[3];
};

struct sculpt_space {
    uint32_t max_elements, max_anchors;
    struct sculpt_group *group;
    struct located_anchor *located; /* [STRANDS_A_PIECE * max_anchors] */
    struct sculpt_problem *problems;/* [STRANDS_A_PIECE] */
    struct sculpt_batch *batch, *again; /* one each: the present piece, and another attempt at it */
    double (*detour)[3];            /* [STRANDS_A_PIECE * max_elements] */
    double *tail;                   /* [tail_space] */
    struct chain_state *junction;   /* [max_elements + 1] */
};

static void space_finish(struct sculpt_space *s, const struct groom_allocator *a)
{
    sculpt_group_destroy(s->group);
    memory_release(a, s->located, (size_t)STRANDS_A_PIECE * s->max_anchors, sizeof *s->located);
    memory_release(a, s->problems, STRANDS_A_PIECE, sizeof *s->problems);
    memory_release(a, s->batch, 1, sizeof *s->batch);
    memory_release(a, s->again, 1, sizeof *s->again);
    memory_release(a, s->detour, (size_t)STRANDS_A_PIECE * s->max_elements, sizeof *s->detour);
    memory_release(a, s->tail, tail_space(s->max_elements), sizeof *s->tail);
    memory_release(a, s->junction, (size_t)s->max_elements + 1, sizeof *s->junction);
}

static int space_init(struct sculpt_space *s, uint32_t max_elements, uint32_t max_anchors,
                      const struct groom_allocator *a)
{
    s->max_elements = max_elements;
    s->max_anchors = max_anchors;
    s->group = sculpt_group_create(max_elements, max_anchors, a);
    s->located = memory_array(a, (size_t)STRANDS_A_PIECE * max_anchors, sizeof *s->located);
    s->problems = memory_array(a, STRANDS_A_PIECE, sizeof *s->problems);
    s->batch = memory_array(a, 1, sizeof *s->batch);
    s->again = memory_array(a, 1, sizeof *s->again);
    s->detour = memory_array(a, (size_t)STRANDS_A_PIECE * max_elements, sizeof *s->detour);
    s->tail = memory_array(a, tail_space(max_elements), sizeof *s->tail);
    s->junction = memory_array(a, (size_t)max_elements + 1, sizeof *s->junction);
    return s->group && s->located && s->problems && s->batch && s->again && s->detour && s->tail && s->junction;
}

/* --- anchors by strand --------------------------------------------------------------------- */

struct sculpt_job {
    struct groom_superhelices *helices;
    const double (*rest_q)[3];
    const struct groom_anchor *anchors;
    size_t n_anchors;
    const struct groom_sculpt_options *options;
    const struct groom_allocator *allocator;
    struct groom_sculpt_outcome *outcomes;
    uint32_t *first;        /* [n_strands + 1] where each strand's anchors begin in order */
    uint32_t *order;        /* [n_anchors] */
    uint32_t *touched;      /* [n_touched] strands with anchors */
    uint32_t n_touched;
    struct lane_output *out;/* [n_touched] */
    uint32_t *hard;         /* [n_hard] of the touched: those that took long, together, so that lanes are full */
    uint32_t n_hard;
    double (*result)[3];    /* [n_elements]: so that an error leaves the input as it was */
    struct sculpt_space *spaces;
    uint32_t n_spaces, most_elements, most_anchors;
    const struct groom_context *context;
    uint32_t begin_piece;   /* of the present chunk */
};

/* Counting sort: stable, so that equal stations keep the caller's order. */
static void sort_by_strand(struct sculpt_job *job)
{
    uint32_t n = job->helices->n_strands;
    for (size_t i = 0; i < job->n_anchors; i++)
        job->first[job->anchors[i].strand + 1]++;
    for (uint32_t i = 0; i < n; i++)
        job->first[i + 1] += job->first[i];
    for (size_t i = job->n_anchors; i-- > 0;)
        job->order[--job->first[job->anchors[i].strand + 1]] = (uint32_t)i;
    /* the begin of strand i now stands in first[i + 1] */
    for (uint32_t i = 0; i < n; i++)
        job->first[i] = job->first[i + 1];
    job->first[n] = (uint32_t)job->n_anchors;
}

static void list_touched(struct sculpt_job *job)
{
    const uint32_t *elements = job->helices->first;
    for (uint32_t i = 0; i < job->helices->n_strands; i++) {
        uint32_t m = job->first[i + 1] - job->first[i], n = elements[i + 1] - elements[i];
        if (m == 0)
            continue;
        job->touched[job->n_touched++] = i;
        job->most_anchors = m > job->most_anchors ? m : job->most_anchors;
        job->most_elements = n > job->most_elements ? n : job->most_elements;
    }
}

/* Strand i as the solver sees it: relative to its root. `located` rises along the strand. */
static struct sculpt_problem problem_of(const struct sculpt_job *job, uint32_t i, struct located_anchor *located)
{
    const struct groom_superhelices *h = job->helices;
    struct sculpt_problem p = {.chain = chain_of(h, i), .n_anchors = job->first[i + 1] - job->first[i],
                               .anchor = located, .rest = job->rest_q + h->first[i],
                               .c = job->options->stiffness / (h->first[i + 1] - h->first[i])};
    double length = groom_superhelix_length(h, i);
    p.chain.root.p = (vec3){0.0, 0.0, 0.0};
    for (uint32_t k = 0; k < p.n_anchors; k++) {
        const struct groom_anchor *a = &job->anchors[job->order[job->first[i] + k]];
        double target[3];
        for (int c = 0; c < 3; c++)
            target[c] = a->position[c] - h->root[i][c];
        struct located_anchor new = energy_locate(&p.chain, a->at * length, target);
        uint32_t to = k;
        for (; to > 0 && (located[to - 1].element > new.element ||
                          (located[to - 1].element == new.element && located[to - 1].s > new.s)); to--)
            located[to] = located[to - 1];
        located[to] = new;
    }
    return p;
}

/* --- the work ---------------------------------------------------------------------------------- */

/* What the anchors miss by after the tail. */
static void measure_anchors(const struct sculpt_problem *p, const double (*q)[3], struct lane_output *out)
{
    struct chain_state at = p->chain.root;
    uint32_t k = 0;
    out->miss_max = out->miss_mean = 0.0;
    for (uint32_t j = 0; j < p->chain.n && k < p->n_anchors; j++) {
        for (; k < p->n_anchors && p->anchor[k].element == j; k++) {
            vec3 r = vec_sub(chain_point(at, vec_of(q[j]), p->anchor[k].s), vec_of(p->anchor[k].target));
            double miss = sqrt(vec_dot(r, r));
            out->miss_max = fmax(out->miss_max, miss);
            out->miss_mean += miss / p->n_anchors;
        }
        at = chain_step(at, vec_of(q[j]), p->chain.length[j]);
    }
}

/* The tail, where the kernel did not get there. Returns whether it did then. */
static int run_tail(const struct sculpt_job *job, struct sculpt_space *space, const struct sculpt_problem *p,
                    double (*q)[3], struct lane_output *out)
{
    const struct groom_sculpt_options *o = job->options;
    uint32_t more;
    int converged;
    out->energy = tail_minimise(p, q, o->max_tail, o->tolerance, o->most_turning, space->tail, space->junction, &more,
                                &converged);
    out->iterations += more;
    measure_anchors(p, (const double (*)[3])q, out);
    return converged;
}

static void finish_strand(const struct sculpt_job *job, struct sculpt_space *space, uint32_t i,
                          const struct sculpt_problem *p, struct lane_output *out)
{
    int converged = !out->active;
    if (!converged && job->options->max_tail)
        converged = run_tail(job, space, p, job->result + job->helices->first[i], out);
    if (job->outcomes)
        job->outcomes[i] = (struct groom_sculpt_outcome){
            .end = converged ? GROOM_SCULPT_CONVERGED : GROOM_SCULPT_STOPPED, .iterations = out->iterations,
            .energy_before = out->energy_before, .energy_after = out->energy,
            .anchor_error_max_m = out->miss_max, .anchor_error_mean_m = out->miss_mean};
}

static struct lane_input lane_of(const struct sculpt_job *job, uint32_t i, const struct sculpt_problem *p)
{
    const struct groom_superhelices *h = job->helices;
    double length = groom_superhelix_length(h, i);
    return (struct lane_input){.n = p->chain.n, .m = p->n_anchors, .frame = (const double (*)[3])h->frame[i],
                               .length = p->chain.length, .q = p->chain.q, .rest = p->rest, .anchor = p->anchor,
                               .c = p->c, .least_energy = 1e-24 * length * length};
}

/* Strands that took long have targets they can hardly reach, and many minima: they go on from where they are;
 * then come from the start again by smaller turns; then from the start with a stiffness so high that there is one
 * minimum, which is followed while the stiffness falls to what it should be. The best is kept. */
enum road { ROAD_ON, ROAD_SMALL_TURNS, ROAD_FALLING_STIFFNESS, N_ROADS };

#define LONG_SHARE 0.38         /* of the first iterations: more than that is long */
#define SMALL_TURNS 0.27        /* of the usual cap */
#define FIRST_STIFFNESS 1000.0  /* times what it should be */
#define STIFFNESS_FALL 5.0
#define FALL_STEPS 20           /* at each stiffness on the way */
#define SHARE_OF_FIRST 0.9      /* of the progress: the rest is the hard strands' */

/* `again` begins where the strand is at the last of the stiffnesses above its own. */
static void follow_stiffness(struct sculpt_space *space, const struct sculpt_batch *hard, struct sculpt_batch *again,
                             const struct sculpt_settings *settings)
{
    struct sculpt_settings few = *settings;
    few.n_steps = FALL_STEPS;
    for (double factor = FIRST_STIFFNESS; factor > 1.0; factor /= STIFFNESS_FALL) {
        for (uint32_t i = 0; i < again->n; i++)
            again->in[i].c = hard->in[i].c * factor;
        sculpt_group_solve(space->group, again->in, again->n, &few, again->q, again->out);
        for (uint32_t i = 0; i < again->n; i++)
            again->in[i].q = (const double (*)[3])again->q[i];
    }
    for (uint32_t i = 0; i < again->n; i++)
        again->in[i].c = hard->in[i].c;
}

static void take_road(const struct sculpt_job *job, struct sculpt_space *space, struct sculpt_batch *hard, enum road road)
{
    struct sculpt_batch *again = space->again;
    struct sculpt_settings settings = {.n_steps = 10 * job->options->max_iterations, .tolerance = job->options->tolerance,
                                       .most_turning = job->options->most_turning};
    if (road == ROAD_SMALL_TURNS)
        settings.most_turning *= SMALL_TURNS;
    again->n = hard->n;
    for (uint32_t i = 0; i < hard->n; i++) {
        again->in[i] = hard->in[i];
        again->q[i] = space->detour + (size_t)i * space->max_elements;
        if (road == ROAD_ON)
            again->in[i].q = (const double (*)[3])hard->q[i];
    }
    if (road == ROAD_FALLING_STIFFNESS)
        follow_stiffness(space, hard, again, &settings);
    sculpt_group_solve(space->group, again->in, again->n, &settings, again->q, again->out);
    for (uint32_t i = 0; i < hard->n; i++) {
        struct lane_output *best = &hard->out[i];
        again->out[i].energy_before = best->energy_before;
        again->out[i].iterations += best->iterations;
        best->iterations = again->out[i].iterations;
        if (!(again->out[i].energy < best->energy) && road != ROAD_ON)
            continue;
        *best = again->out[i];
        memcpy(hard->q[i], again->q[i], hard->in[i].n * sizeof *again->q[i]);
    }
}

/* Did it take long? Some arrive in a minimum that is not the best one to be had. */
static int is_hard(const struct sculpt_job *job, const struct lane_output *o)
{
    if (job->options->n_roads == 0)
        return 0;
    return o->active || o->iterations > job->options->max_iterations * LONG_SHARE;
}

/* Strands begin, begin + 1, ... of `order`, or of the touched themselves where it is NULL, at most a piece of them. */
static struct sculpt_batch *fill_batch(const struct sculpt_job *job, struct sculpt_space *space, const uint32_t *order,
                                       uint32_t n, uint32_t begin)
{
    struct sculpt_batch *batch = space->batch;
    batch->n = n - begin < STRANDS_A_PIECE ? n - begin : STRANDS_A_PIECE;
    for (uint32_t k = 0; k < batch->n; k++) {
        uint32_t t = order ? order[begin + k] : begin + k, i = job->touched[t];
        space->problems[k] = problem_of(job, i, space->located + (size_t)k * space->max_anchors);
        batch->in[k] = lane_of(job, i, &space->problems[k]);
        batch->out[k] = job->out[t];
        batch->q[k] = job->result + job->helices->first[i];
    }
    return batch;
}

static void sculpt_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct sculpt_job *job = user;
    struct sculpt_space *space = &job->spaces[thread];
    struct sculpt_settings settings = {.n_steps = job->options->max_iterations, .tolerance = job->options->tolerance,
                                       .most_turning = job->options->most_turning};
    uint32_t begin = (job->begin_piece + piece) * STRANDS_A_PIECE;
    struct sculpt_batch *batch = fill_batch(job, space, NULL, job->n_touched, begin);
    sculpt_group_solve(space->group, batch->in, batch->n, &settings, batch->q, batch->out);
    for (uint32_t k = 0; k < batch->n; k++) {
        job->out[begin + k] = batch->out[k];
        if (!is_hard(job, &batch->out[k]))
            finish_strand(job, space, job->touched[begin + k], &space->problems[k], &batch->out[k]);
    }
}

static void sculpt_hard_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct sculpt_job *job = user;
    struct sculpt_space *space = &job->spaces[thread];
    uint32_t begin = (job->begin_piece + piece) * STRANDS_A_PIECE;
    struct sculpt_batch *hard = fill_batch(job, space, job->hard, job->n_hard, begin);
    for (uint32_t road = 0; road < job->options->n_roads && road < N_ROADS; road++)
        take_road(job, space, hard, (enum road)road);
    for (uint32_t k = 0; k < hard->n; k++)
        finish_strand(job, space, job->touched[job->hard[begin + k]], &space->problems[k], &hard->out[k]);
}

/* In chunks, so that a large sculpt reports progress and can be stopped. */
static groom_status run_chunks(struct sculpt_job *job, uint32_t n, parallel_body *body, double from, double to,
                               struct groom_diag *diag)
{
    enum { PIECES_A_CHUNK = 32 };
    uint32_t pieces = n / STRANDS_A_PIECE + (n % STRANDS_A_PIECE != 0);
    for (job->begin_piece = 0; job->begin_piece < pieces; job->begin_piece += PIECES_A_CHUNK) {
        uint32_t left = pieces - job->begin_piece, here = left < PIECES_A_CHUNK ? left : PIECES_A_CHUNK;
        if (progress_cancelled(job->context))
            return groom_fail(diag, GROOM_ECANCELLED, "the sculpt was cancelled");
        parallel_for(job->context, here, body, job);
        progress_report(job->context, from + (to - from) * (job->begin_piece + here) / pieces);
    }
    return GROOM_OK;
}

/* All strands, then the hard ones together: one or two of each piece would leave most lanes empty. */
static groom_status run(struct sculpt_job *job, struct groom_diag *diag)
{
    groom_status st = run_chunks(job, job->n_touched, sculpt_piece, 0.0, SHARE_OF_FIRST, diag);
    for (uint32_t t = 0; t < job->n_touched; t++)
        if (is_hard(job, &job->out[t]))
            job->hard[job->n_hard++] = t;
    return st == GROOM_OK ? run_chunks(job, job->n_hard, sculpt_hard_piece, SHARE_OF_FIRST, 1.0, diag) : st;
}

static int job_init(struct sculpt_job *job)
{
    const struct groom_allocator *a = job->allocator;
    const struct groom_superhelices *h = job->helices;
    job->first = memory_array_zero(a, (size_t)h->n_strands + 1, sizeof *job->first);
    job->order = memory_array(a, job->n_anchors, sizeof *job->order);
    job->touched = memory_array(a, h->n_strands, sizeof *job->touched);
    job->hard = memory_array(a, h->n_strands, sizeof *job->hard);
    job->out = memory_array_zero(a, h->n_strands, sizeof *job->out);
    job->result = memory_array(a, h->n_elements, sizeof *job->result);
    job->n_spaces = parallel_threads(job->context);
    job->spaces = memory_array_zero(a, job->n_spaces, sizeof *job->spaces);
    return job->first && job->order && job->touched && job->hard && job->out && job->result && job->spaces;
}

static int spaces_init(struct sculpt_job *job)
{
    int good = 1;
    for (uint32_t k = 0; k < job->n_spaces; k++)
        good = good && space_init(&job->spaces[k], job->most_elements, job->most_anchors, job->allocator);
    return good;
}

static void job_finish(struct sculpt_job *job)
{
    const struct groom_allocator *a = job->allocator;
    const struct groom_superhelices *h = job->helices;
    for (uint32_t k = 0; job->spaces && k < job->n_spaces; k++)
        space_finish(&job->spaces[k], a);
    memory_release(a, job->first, (size_t)h->n_strands + 1, sizeof *job->first);
    memory_release(a, job->order, job->n_anchors, sizeof *job->order);
    memory_release(a, job->touched, h->n_strands, sizeof *job->touched);
    memory_release(a, job->hard, h->n_strands, sizeof *job->hard);
    memory_release(a, job->out, h->n_strands, sizeof *job->out);
    memory_release(a, job->result, h->n_elements, sizeof *job->result);
    memory_release(a, job->spaces, job->n_spaces, sizeof *job->spaces);
}

groom_status groom_superhelices_sculpt(struct groom_superhelices *helices, const double (*rest_q)[3],
                                       const struct groom_anchor *anchors, size_t n_anchors,
                                       const struct groom_sculpt_options *options,
                                       const struct groom_context *context,
                                       struct groom_sculpt_outcome *outcomes, struct groom_diag *diag)
{
    struct sculpt_job job = {.helices = helices, .anchors = anchors, .n_anchors = n_anchors, .options = options,
                             .rest_q = rest_q ? rest_q : (const double (*)[3])helices->q, .outcomes = outcomes,
                             .allocator = memory_allocator(context), .context = context};
    groom_status st = check_options(options, diag);
    if (st == GROOM_OK)
        st = check_anchors(helices, anchors, n_anchors, diag);
    if (st != GROOM_OK)
        return st;
    if (n_anchors > UINT32_MAX || !job_init(&job))
        goto no_memory;
    sort_by_strand(&job);
    list_touched(&job);
    if (job.most_anchors > MOST_ANCHORS) {
        st = groom_fail_field(diag, GROOM_EINVAL, "/anchors", "%u anchors on one strand: %d is the most", job.most_anchors,
                              MOST_ANCHORS);
        goto out;
    }
    if (!spaces_init(&job))
        goto no_memory;
    memcpy(job.result, helices->q, helices->n_elements * sizeof *job.result);
    if (outcomes)
        memset(outcomes, 0, helices->n_strands * sizeof *outcomes);
    if ((st = run(&job, diag)) == GROOM_OK)
        memcpy(helices->q, job.result, helices->n_elements * sizeof *job.result);
    goto out;
no_memory:
    st = groom_fail(diag, GROOM_ENOMEM, "no memory to sculpt %u strands", helices->n_strands);
out:
    job_finish(&job);
    return st;
}
