/* Between two heads in curvature space (Shi et al. 2026, Section 4.3 and Fig. 9). */
#include <math.h>

#include "base/memory.h"
#include "curvature/chain.h"
#include "curvature/pieces.h"
#include "groom/spatial.h"

/* Breaks nearer than this share of the strand are one. */
#define SAME_BREAK 1e-9

struct between_job {
    const struct groom_superhelices *a, *b;
    const uint32_t *partner;
    double t;
    struct groom_superhelices *out;
    uint32_t *count; /* [n_strands] elements of each result */
};

static uint32_t partner_of(const struct between_job *job, uint32_t i) { return job->partner ? job->partner[i] : i; }

/* --- walking along both ---------------------------------------------------------------- */

struct side {
    const struct groom_superhelices *h;
    uint32_t j, end;
    double passed, length;
};

static struct side side_of(const struct groom_superhelices *h, uint32_t i)
{
    return (struct side){h, h->first[i], h->first[i + 1], 0.0, groom_superhelix_length(h, i)};
}

/* The fraction of the strand at which the present element ends; a strand of no length divides evenly. */
static double side_end(const struct side *s)
{
    if (s->j + 1 == s->end)
        return 1.0;
    return s->length > 0.0 ? (s->passed + s->h->length[s->j]) / s->length : 1.0;
}

/* Go on to where the next break of either lies; *at goes there, the return value is how far it is. Both
 * sides move past their element if it ends there. */
static double next_break(struct side *a, struct side *b, double *at)
{
    double ea = side_end(a), eb = side_end(b), next = ea < eb ? ea : eb, share = next - *at;
    if (ea <= next + SAME_BREAK)
        a->passed += a->h->length[a->j], a->j++;
    if (eb <= next + SAME_BREAK)
        b->passed += b->h->length[b->j], b->j++;
    *at = next;
    return share > 0.0 ? share : 0.0;
}

static int both_go_on(const struct side *a, const struct side *b) { return a->j < a->end && b->j < b->end; }

static void count_strand(const struct between_job *job, uint32_t i)
{
    struct side a = side_of(job->a, i), b = side_of(job->b, partner_of(job, i));
    double at = 0.0;
    uint32_t n = 0;
    for (; both_go_on(&a, &b); n++)
        next_break(&a, &b, &at);
    job->count[i] = n;
}

/* --- frames ------------------------------------------------------------------------------ */

/* The rotation vector that takes a to b the short way, in the world. */
static vec3 turn_between(mat3 a, mat3 b)
{
    vec3 axis = vec_scale(0.5, vec_add(vec_cross(a.t, b.t), vec_add(vec_cross(a.u, b.u), vec_cross(a.v, b.v))));
    double cosine = 0.5 * (vec_dot(a.t, b.t) + vec_dot(a.u, b.u) + vec_dot(a.v, b.v) - 1.0);
    double sine = sqrt(vec_dot(axis, axis)), angle = atan2(sine, cosine);
    if (sine > 1e-8)
        return vec_scale(angle / sine, axis);
    if (cosine > 0.0)
        return axis;
    /* half a turn: its axis is the longest column of (R + I), R = b a^T, that is of a + b mapped back */
    vec3 best = vec_add(a.t, b.t), others[2] = {vec_add(a.u, b.u), vec_add(a.v, b.v)};
    for (int k = 0; k < 2; k++)
        if (vec_dot(others[k], others[k]) > vec_dot(best, best))
            best = others[k];
    return vec_scale(M_PI / sqrt(vec_dot(best, best)), best);
}

static mat3 frame_between(mat3 a, mat3 b, double t)
{
    vec3 w = vec_scale(t, turn_between(a, b));
    double x = vec_dot(w, w);
    trig3 f = trig3_of(x);
    return frame_mend(mat_mul(element_turn(f.A, f.B, x, w), a));
}

/* The frame of a strand after its gauge has been turned. */
static mat3 gauged(mat3 F, double angle)
{
    double c = cos(angle), s = sin(angle);
    return (mat3){F.t, vec_sub(vec_scale(c, F.u), vec_scale(s, F.v)), vec_add(vec_scale(s, F.u), vec_scale(c, F.v))};
}

/* --- strands -------------------------------------------------------------------------------- */

static void fill_elements(const struct between_job *job, uint32_t i, double angle)
{
    struct side a = side_of(job->a, i), b = side_of(job->b, partner_of(job, i));
    double c = cos(angle), s = sin(angle), t = job->t, at = 0.0;
    for (uint32_t to = job->out->first[i]; to < job->out->first[i + 1]; to++) {
        const double *p = a.h->q[a.j], *q = b.h->q[b.j];
        double turned[3] = {q[0], c * q[1] - s * q[2], s * q[1] + c * q[2]};
        double share = next_break(&a, &b, &at);
        for (int k = 0; k < 3; k++)
            job->out->q[to][k] = (1.0 - t) * p[k] + t * turned[k];
        job->out->length[to] = share * ((1.0 - t) * a.length + t * b.length);
    }
}

static void fill_strand(const struct between_job *job, uint32_t i)
{
    uint32_t k = partner_of(job, i);
    double angle = groom_superhelix_gauge(job->a, i, job->b, k);
    mat3 F = mat_of(job->a->frame[i]), G = gauged(mat_of(job->b->frame[k]), angle);
    for (int c = 0; c < 3; c++)
        job->out->root[i][c] = (1.0 - job->t) * job->a->root[i][c] + job->t * job->b->root[k][c];
    mat_store(frame_between(F, G, job->t), job->out->frame[i]);
    fill_elements(job, i, angle);
}

static void count_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct between_job *job = user;
    uint32_t begin, end;
    (void)thread;
    piece_bounds(job->a->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++)
        count_strand(job, i);
}

static void fill_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct between_job *job = user;
    uint32_t begin, end;
    (void)thread;
    piece_bounds(job->a->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++)
        fill_strand(job, i);
}

static groom_status check_partners(const struct between_job *job, struct groom_diag *diag)
{
    if (!(job->t >= 0.0 && job->t <= 1.0))
        return groom_fail_field(diag, GROOM_EINVAL, "/blend", "the blend is %g: it must lie in 0..1", job->t);
    for (uint32_t i = 0; i < job->a->n_strands; i++)
        if (partner_of(job, i) >= job->b->n_strands)
            return groom_fail(diag, GROOM_EINVAL, "strand %u has partner %u, but the other groom has %u strands", i,
                              partner_of(job, i), job->b->n_strands);
    return GROOM_OK;
}

groom_status groom_superhelices_interpolate(const struct groom_superhelices *a, const struct groom_superhelices *b,
                                            const uint32_t *partner, double t, const struct groom_context *context,
                                            struct groom_superhelices **between, struct groom_diag *diag)
{
    const struct groom_allocator *memory = memory_allocator(context);
    struct between_job job = {.a = a, .b = b, .partner = partner, .t = t};
    uint64_t total = 0;
    groom_status st = check_partners(&job, diag);
    if (st != GROOM_OK)
        return st;
    job.count = memory_array(memory, a->n_strands, sizeof *job.count);
    if (!job.count)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to blend %u strands", a->n_strands);
    parallel_for(context, piece_count(a->n_strands), count_piece, &job);
    for (uint32_t i = 0; i < a->n_strands; i++)
        total += job.count[i];
    if ((st = groom_superhelices_create(a->n_strands, total, context, &job.out, diag)) != GROOM_OK)
        goto out;
    for (uint32_t i = 0; i < a->n_strands; i++)
        job.out->first[i + 1] = job.out->first[i] + job.count[i];
    parallel_for(context, piece_count(a->n_strands), fill_piece, &job);
    *between = job.out;
out:
    memory_release(memory, job.count, a->n_strands, sizeof *job.count);
    return st;
}

/* --- who belongs to whom ------------------------------------------------------------------------ */

static float *roots_of(const struct groom_superhelices *h, const struct groom_allocator *memory)
{
    float *roots = memory_array(memory, (size_t)h->n_strands * 3, sizeof *roots);
    for (size_t i = 0; roots && i < h->n_strands; i++)
        for (size_t c = 0; c < 3; c++)
            roots[3 * i + c] = (float)h->root[i][c];
    return roots;
}

groom_status groom_superhelices_match_roots(const struct groom_superhelices *a, const struct groom_superhelices *b,
                                            const struct groom_context *context, uint32_t *partner,
                                            struct groom_diag *diag)
{
    const struct groom_allocator *memory = memory_allocator(context);
    struct groom_neighbours *index = NULL;
    float *from = roots_of(a, memory), *to = roots_of(b, memory);
    groom_status st = GROOM_OK;
    if (!from || !to)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to match %u roots", a->n_strands);
    if (st == GROOM_OK)
        st = groom_neighbours_create(to, b->n_strands, 3, context, &index, diag);
    if (st == GROOM_OK && a->n_strands)
        st = groom_neighbours_find(index, from, a->n_strands, 1, partner, NULL, context, diag);
    groom_neighbours_destroy(index);
    memory_release(memory, from, (size_t)a->n_strands * 3, sizeof *from);
    memory_release(memory, to, (size_t)b->n_strands * 3, sizeof *to);
    return st;
}
