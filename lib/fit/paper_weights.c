#include "fit/paper_weights.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "fit/adam.h"

#define UNIT 0.1             /* metres on an ordinary head: what the paper's learning rates fit */
#define MOST 16              /* guides of a strand */
#define STRANDS_PER_PIECE 32
#define STRANDS_A_ROUND 2048 /* between two looks at whether to go on */
#define LEAST_SUM 1e-3       /* of weights, over the sum of their sizes: less is no blend */

struct descent {
    const struct groom_fit *fit;
    uint32_t first, count, begin; /* strands; where the present round begins among them */
    float *weight;              /* [count * k] out */
    double (*piece_loss)[2];    /* before, after: squared distances in the target's frame */
};

/* |sum_k v_k s_k - t|^2 of one strand, as a function of the v that sum to 1: v gram v - 2 b v + square. */
struct quadratic { uint32_t n; double gram[MOST][MOST], b[MOST], square; };

static void fill_quadratic(const struct groom_fit *fit, uint32_t i, struct quadratic *q)
{
    const float (*x)[3] = (const float (*)[3])(fit->target + (size_t)i * fit->m);
    const uint32_t *guide = fit->groom->instancing_guide + (size_t)i * fit->groom->n_instancing;
    *q = (struct quadratic){.n = fit->groom->n_instancing};
    for (uint32_t j = 1; j < fit->m; j++)
        for (int c = 0; c < 3; c++) {
            double s[MOST], t = (double)x[j][c] - x[0][c];
            for (uint32_t a = 0; a < q->n; a++) {
                const float (*g)[3] = (const float (*)[3])(fit->centroids + (size_t)guide[a] * fit->m);
                s[a] = (double)g[j][c] - g[0][c];
                q->b[a] += s[a] * t;
                for (uint32_t b = 0; b <= a; b++)
                    q->gram[a][b] += s[a] * s[b];
            }
            q->square += t * t;
        }
    for (uint32_t a = 0; a < q->n; a++)
        for (uint32_t b = a + 1; b < q->n; b++)
            q->gram[a][b] = q->gram[b][a];
}

static double value_of(const struct quadratic *q, const double *v)
{
    double value = q->square;
    for (uint32_t a = 0; a < q->n; a++) {
        value -= 2 * q->b[a] * v[a];
        for (uint32_t b = 0; b < q->n; b++)
            value += v[a] * q->gram[a][b] * v[b];
    }
    return fmax(value, 0);
}

/* Eq. 3: v = w / sum w. Returns 0 where they nearly cancel; v is then by a sum that keeps its distance from 0. */
static int normalise(const float *w, uint32_t n, double *v, double *sum)
{
    double size = 0;
    *sum = 0;
    for (uint32_t a = 0; a < n; a++) {
        *sum += (double)w[a];
        size += fabs((double)w[a]);
    }
    int fine = fabs(*sum) >= LEAST_SUM * size && size > 0;
    if (!fine)
        *sum = copysign(fmax(LEAST_SUM * size, 1e-12), *sum);
    for (uint32_t a = 0; a < n; a++)
        v[a] = (double)w[a] / *sum;
    return fine;
}

/* d(Eq. 5)/dw: `scale` times that of the squared distance. */
static void slope(const struct quadratic *q, const double *v, double sum, double scale, float *gradient)
{
    double of_v[MOST], along = 0;
    for (uint32_t a = 0; a < q->n; a++) {
        of_v[a] = -2 * q->b[a];
        for (uint32_t b = 0; b < q->n; b++)
            of_v[a] += 2 * q->gram[a][b] * v[b];
        along += v[a] * of_v[a];
    }
    for (uint32_t a = 0; a < q->n; a++)
        gradient[a] = (float)(scale * (of_v[a] - along) / sum);
}

static void descend_strand(const struct descent *job, uint32_t at, double loss[2])
{
    const struct groom_fit *fit = job->fit;
    uint32_t n = fit->groom->n_instancing, i = job->first + at;
    double unit = UNIT * fit->ordinary / fit->scale, scale = 1 / (unit * unit * fit->n * fit->m), v[MOST], sum;
    float w[MOST], gradient[MOST], moments[2 * MOST] = {0}, *out = job->weight + (size_t)at * n;
    struct quadratic q;
    fill_quadratic(fit, i, &q);
    memcpy(w, fit->groom->instancing_weight + (size_t)i * n, n * sizeof *w);
    memcpy(out, w, n * sizeof *w);
    normalise(w, n, v, &sum);
    loss[0] += value_of(&q, v);
    for (uint32_t t = 0; t < fit->options.stages.instance_weights.iterations; t++) {
        slope(&q, v, sum, scale, gradient);
        adam_step(w, gradient, moments, n, fit->options.stages.instance_weights.learning_rate, t + 1);
        normalise(w, n, v, &sum);
    }
    if (normalise(w, n, v, &sum))
        for (uint32_t a = 0; a < n; a++)
            out[a] = (float)v[a];
    for (uint32_t a = 0; a < n; a++)
        v[a] = (double)out[a];
    loss[1] += value_of(&q, v);
}

static void descend_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct descent *job = user;
    uint32_t first = job->begin + piece * STRANDS_PER_PIECE;
    double *loss = job->piece_loss[first / STRANDS_PER_PIECE];
    (void)thread;
    loss[0] = loss[1] = 0;
    for (uint32_t at = first; at < job->count && at < first + STRANDS_PER_PIECE; at++)
        descend_strand(job, at, loss);
}

static uint32_t pieces_of(uint32_t n) { return n / STRANDS_PER_PIECE + (n % STRANDS_PER_PIECE != 0); }

groom_status paper_weights_solve(struct groom_fit *fit, uint32_t first, uint32_t count,
                                 const struct groom_context *context, struct weights_loss *loss,
                                 struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t k = fit->groom->n_instancing, n_pieces = pieces_of(count);
    struct descent job = {.fit = fit, .first = first, .count = count};
    groom_status st = GROOM_OK;
    job.weight = memory_array(allocator, (size_t)count * k, sizeof *job.weight);
    job.piece_loss = memory_array(allocator, n_pieces, sizeof *job.piece_loss);
    if (!job.weight || !job.piece_loss) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the weights of %u strands", count);
        goto out;
    }
    for (; job.begin < count; job.begin += STRANDS_A_ROUND) {
        if (progress_cancelled(context)) {
            st = groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage instance_weights");
            goto out;
        }
        parallel_for(context, pieces_of(count - job.begin < STRANDS_A_ROUND ? count - job.begin : STRANDS_A_ROUND),
                     descend_piece, &job);
    }
    memcpy(fit->groom->instancing_weight + (size_t)first * k, job.weight, (size_t)count * k * sizeof *job.weight);
    for (uint32_t piece = 0; piece < n_pieces; piece++) {
        loss->before += job.piece_loss[piece][0];
        loss->after += job.piece_loss[piece][1];
    }
out:
    memory_release(allocator, job.weight, (size_t)count * k, sizeof *job.weight);
    memory_release(allocator, job.piece_loss, n_pieces, sizeof *job.piece_loss);
    return st;
}
