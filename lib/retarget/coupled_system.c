/* Conjugate gradients, preconditioned by each strand's own tridiagonal matrix: about ten steps. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "retarget/coupled.h"

#define SHORTEST 0.02        /* of the source's length: a segment counts as this long at least */
#define LEAST_LENGTH 1e-6f   /* metres */

/* --- memory ------------------------------------------------------------------------------ */

static int system_allocate(struct system *s, const struct groom_allocator *allocator)
{
    const struct coupled *hair = s->hair;
    uint32_t n = hair->n;
    s->w = memory_array(allocator, n, sizeof *s->w);
    s->pivot = memory_array(allocator, n, sizeof *s->pivot);
    s->b = memory_array(allocator, n, sizeof *s->b);
    s->x = memory_array(allocator, n, sizeof *s->x);
    s->r = memory_array(allocator, n, sizeof *s->r);
    s->d = memory_array(allocator, n, sizeof *s->d);
    s->ad = memory_array(allocator, n, sizeof *s->ad);
    s->f = memory_array(allocator, n, sizeof *s->f);
    s->away = memory_array_zero(allocator, n, sizeof *s->away);
    s->state = memory_array_zero(allocator, n, 1);
    s->plane = memory_array(allocator, n, sizeof *s->plane);
    s->sums = memory_array(allocator, s->n_pieces, sizeof *s->sums);
    return s->w && s->pivot && s->b && s->x && s->r &&
           s->d && s->ad && s->f && s->away && s->state && s->plane && s->sums;
}

void system_finish(struct system *s)
{
    const struct groom_allocator *allocator = s->job->allocator;
    uint32_t n = s->hair->n;
    links_finish(&s->links, allocator);
    memory_release(allocator, s->w, n, sizeof *s->w);
    memory_release(allocator, s->pivot, n, sizeof *s->pivot);
    memory_release(allocator, s->b, n, sizeof *s->b);
    memory_release(allocator, s->x, n, sizeof *s->x);
    memory_release(allocator, s->r, n, sizeof *s->r);
    memory_release(allocator, s->d, n, sizeof *s->d);
    memory_release(allocator, s->ad, n, sizeof *s->ad);
    memory_release(allocator, s->f, n, sizeof *s->f);
    memory_release(allocator, s->away, n, sizeof *s->away);
    memory_release(allocator, s->state, n, 1);
    memory_release(allocator, s->plane, n, sizeof *s->plane);
    memory_release(allocator, s->sums, s->n_pieces, sizeof *s->sums);
}

groom_status system_init(struct system *s, struct job *job, const struct coupled *hair, struct groom_diag *diag)
{
    *s = (struct system){.job = job, .hair = hair, .n_pieces = hair->n_strands / COUPLED_PIECE + 1};
    groom_status st = links_init(&s->links, job, hair, diag);
    if (st != GROOM_OK)
        return st;
    if (!system_allocate(s, job->allocator))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to adapt %u particles together", hair->n);
    for (uint32_t i = 0; i < hair->n_strands; i++)
        s->state[hair->first[i]] = COUPLED_FIXED;
    return GROOM_OK;
}

/* --- the matrix ---------------------------------------------------------------------------- */

struct product {
    struct system *s;
    const float (*v)[3];
    float (*out)[3];
};

/* f = G L v */
static void laplacian_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct product *job = user;
    const struct coupled *hair = job->s->hair;
    uint32_t end = hair->first[system_piece_end(job->s, piece)];
    (void)thread;
    for (uint32_t i = hair->first[piece * COUPLED_PIECE]; i < end; i++)
        point_store(job->s->f[i], links_difference(&job->s->links, i, job->v));
}

/* alpha L^T f of one particle */
static void pulled(const struct system *s, uint32_t i, float out[3])
{
    point_store(out, links_pull(&s->links, i, (const float(*)[3])s->f));
}

/* out = A v, and the piece's part of v . out */
static void apply_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct product *job = user;
    struct system *s = job->s;
    const struct coupled *hair = s->hair;
    float beta = s->links.beta;
    double sum = 0;
    (void)thread;
    for (uint32_t strand = piece * COUPLED_PIECE; strand < system_piece_end(s, piece); strand++) {
        uint32_t first = hair->first[strand], last = hair->first[strand + 1] - 1;
        for (uint32_t i = first; i <= last; i++) {
            float *out = job->out[i], gamma = beta * links_gamma(&s->links, i);
            pulled(s, i, out);
            for (int c = 0; c < 3; c++) {
                float v = job->v[i][c], before = i > first ? s->w[i - 1] * (v - job->v[i - 1][c]) : 0;
                float after = i < last ? s->w[i] * (v - job->v[i + 1][c]) : 0;
                out[c] += before + after + gamma * v;
                sum += (double)out[c] * v;
            }
        }
    }
    s->sums[piece] = sum;
}

static double total(const struct system *s)
{
    double sum = 0;
    for (uint32_t i = 0; i < s->n_pieces; i++)
        sum += s->sums[i];
    return sum;
}

static double apply(struct system *s, float (*v)[3], float (*out)[3])
{
    struct product job = {.s = s, .v = (const float(*)[3])v, .out = out};
    parallel_for(s->job->context, s->n_pieces, laplacian_piece, &job);
    parallel_for(s->job->context, s->n_pieces, apply_piece, &job);
    return total(s);
}

void system_apply(struct system *s, float (*v)[3], float (*out)[3]) { apply(s, v, out); }

/* --- linearising ------------------------------------------------------------------------------ */

static float segment(const float (*p)[3], uint32_t i, float step[3])
{
    float square = 0;
    for (int c = 0; c < 3; c++) {
        step[c] = p[i + 1][c] - p[i][c];
        square += step[c] * step[c];
    }
    return sqrtf(square);
}

/* d_i = p_i - rest_i, for f */
static void movement_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct system *s = user;
    const struct coupled *hair = s->hair;
    uint32_t end = hair->first[system_piece_end(s, piece)];
    (void)thread;
    for (uint32_t i = hair->first[piece * COUPLED_PIECE]; i < end; i++)
        for (int c = 0; c < 3; c++)
            s->d[i][c] = hair->p[i][c] - hair->rest[i][c];
}

/* w, and b = - gradient / 2 */
static void force_strand(struct system *s, uint32_t first, uint32_t last)
{
    const struct coupled *hair = s->hair;
    float before[3] = {0, 0, 0}, beta = s->links.beta;
    for (uint32_t i = first; i <= last; i++) {
        float after[3] = {0, 0, 0}, pull[3], step[3], rest[3], gamma = beta * links_gamma(&s->links, i);
        s->w[i] = 0;
        if (i < last) {
            float length = segment((const float(*)[3])hair->p, i, step), was = segment(hair->rest, i, rest);
            length = fmaxf(fmaxf(length, (float)SHORTEST * was), LEAST_LENGTH);
            s->w[i] = 1 / (length * length);
            for (int c = 0; c < 3; c++)
                after[c] = s->w[i] * step[c] - (was > 0 ? rest[c] / was : 0) / length;
        }
        pulled(s, i, pull);
        for (int c = 0; c < 3; c++) {
            s->b[i][c] = after[c] - before[c] - pull[c] - gamma * (hair->p[i][c] - hair->hat[i][c]);
            before[c] = after[c];
        }
    }
}

/* The tridiagonal matrix of a strand without its root: pivot_i = 1 / (diagonal_i - w^2 pivot_(i-1)). */
static void factor_strand(struct system *s, uint32_t first, uint32_t last)
{
    for (uint32_t i = first + 1; i <= last; i++) {
        float back = i > first + 1 ? s->w[i - 1] * s->w[i - 1] * s->pivot[i - 1] : 0;
        s->pivot[i] = 1 / (s->links.diagonal[i] + s->w[i - 1] + s->w[i] - back);
    }
    s->pivot[first] = 0;
}

static void linearise_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct system *s = user;
    (void)thread;
    for (uint32_t strand = piece * COUPLED_PIECE; strand < system_piece_end(s, piece); strand++) {
        force_strand(s, s->hair->first[strand], s->hair->first[strand + 1] - 1);
        factor_strand(s, s->hair->first[strand], s->hair->first[strand + 1] - 1);
    }
}

void system_linearise(struct system *s)
{
    struct product job = {.s = s, .v = (const float(*)[3])s->d};
    parallel_for(s->job->context, s->n_pieces, movement_piece, s);
    parallel_for(s->job->context, s->n_pieces, laplacian_piece, &job);
    parallel_for(s->job->context, s->n_pieces, linearise_piece, s);
}

/* --- conjugate gradients ------------------------------------------------------------------------- */

struct step {
    struct system *s;
    float along, turn; /* x += along d, r -= along ad; d = f + turn d */
};

/* f = P M^-1 r of one strand; returns r . f */
static double precondition_strand(struct system *s, uint32_t first, uint32_t last)
{
    double sum = 0;
    memset(s->f[first], 0, sizeof s->f[first]);
    for (uint32_t i = first + 1; i <= last; i++)
        for (int c = 0; c < 3; c++)
            s->f[i][c] = s->r[i][c] + (i > first + 1 ? s->w[i - 1] * s->pivot[i - 1] * s->f[i - 1][c] : 0);
    for (uint32_t i = last; i > first; i--)
        for (int c = 0; c < 3; c++)
            s->f[i][c] = (s->f[i][c] + (i < last ? s->w[i] * s->f[i + 1][c] : 0)) * s->pivot[i];
    for (uint32_t i = first + 1; i <= last; i++) {
        system_project(s, i, s->f[i]);
        for (int c = 0; c < 3; c++)
            sum += (double)s->r[i][c] * s->f[i][c];
    }
    return sum;
}

/* x and r one step on, then f */
static void advance_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct step *step = user;
    struct system *s = step->s;
    double sum = 0;
    (void)thread;
    for (uint32_t strand = piece * COUPLED_PIECE; strand < system_piece_end(s, piece); strand++) {
        uint32_t first = s->hair->first[strand], last = s->hair->first[strand + 1] - 1;
        for (uint32_t i = first; i <= last; i++) {
            system_project(s, i, s->ad[i]);
            for (int c = 0; c < 3; c++) {
                s->x[i][c] += step->along * s->d[i][c];
                s->r[i][c] -= step->along * s->ad[i][c];
            }
        }
        sum += precondition_strand(s, first, last);
    }
    s->sums[piece] = sum;
}

static void turn_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct step *step = user;
    struct system *s = step->s;
    uint32_t end = s->hair->first[system_piece_end(s, piece)];
    (void)thread;
    for (uint32_t i = s->hair->first[piece * COUPLED_PIECE]; i < end; i++)
        for (int c = 0; c < 3; c++)
            s->d[i][c] = s->f[i][c] + step->turn * s->d[i][c];
}

/* r = P (b - ad), d = 0, f = P M^-1 r */
static void start_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct system *s = user;
    double sum = 0;
    (void)thread;
    for (uint32_t strand = piece * COUPLED_PIECE; strand < system_piece_end(s, piece); strand++) {
        uint32_t first = s->hair->first[strand], last = s->hair->first[strand + 1] - 1;
        for (uint32_t i = first; i <= last; i++) {
            for (int c = 0; c < 3; c++) {
                s->r[i][c] = s->b[i][c] - s->ad[i][c];
                s->d[i][c] = 0;
            }
            system_project(s, i, s->r[i]);
        }
        sum += precondition_strand(s, first, last);
    }
    s->sums[piece] = sum;
}

double system_solve(struct system *s, double scale, double share, uint32_t most_steps)
{
    struct step step = {.s = s};
    apply(s, s->x, s->ad);
    parallel_for(s->job->context, s->n_pieces, start_piece, s);
    double rf = total(s);
    if (scale == 0)
        scale = sqrt(fmax(rf, 0));
    for (uint32_t i = 0; i < most_steps && rf > share * share * scale * scale && rf > 0; i++) {
        parallel_for(s->job->context, s->n_pieces, turn_piece, &step);
        double curvature = apply(s, s->d, s->ad);
        if (!(curvature > 0))
            break;
        step.along = (float)(rf / curvature);
        parallel_for(s->job->context, s->n_pieces, advance_piece, &step);
        double last = rf;
        rf = total(s);
        step.turn = (float)(rf / last);
        if (progress_cancelled(s->job->context))
            break;
    }
    return scale;
}
