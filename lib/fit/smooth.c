#include "fit/smooth.h"

#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"

#define POLYLINES_PER_PIECE 8
#define PI 3.14159265358979323846

struct smoothing {
    float (*points)[3];
    uint32_t n, m, n_fixed;
    uint32_t n_free;   /* f: vertices n_fixed .. m - 2 */
    double *matrix;    /* [f][f] symmetric */
    double *offset;    /* [threads][f] of one coordinate from the straight line */
};

/* S D S with S_jk = sqrt(2 / (f + 1)) sin(pi (j+1)(k+1) / (f + 1)); sin(pi i / (f + 1)) has period 2 (f + 1) in i. */
static void fill_matrix(struct smoothing *s, double lambda, uint32_t n_steps, double *decay, double *sine)
{
    uint32_t f = s->n_free, period = 2 * (f + 1);
    for (uint32_t i = 0; i < period; i++)
        sine[i] = sin(PI * i / (f + 1));
    for (uint32_t k = 0; k < f; k++)
        decay[k] = pow(1 + lambda * (2 - 2 * cos(PI * (k + 1) / (f + 1))), -(double)n_steps) * 2 / (f + 1);
    for (uint32_t a = 0; a < f; a++)
        for (uint32_t b = 0; b <= a; b++) {
            double sum = 0;
            for (uint32_t k = 1; k <= f; k++)
                sum += sine[(uint64_t)(a + 1) * k % period] * decay[k - 1] * sine[(uint64_t)(b + 1) * k % period];
            s->matrix[(size_t)a * f + b] = s->matrix[(size_t)b * f + a] = sum;
        }
}

/* The free vertex `at` of the straight line between the fixed neighbours. */
static double line_at(const struct smoothing *s, const float (*p)[3], int c, uint32_t at)
{
    double begin = p[s->n_fixed - 1][c], end = p[s->m - 1][c];
    return begin + (end - begin) * (at + 1) / (s->n_free + 1);
}

static void smooth_one(const struct smoothing *s, float (*p)[3], int c, double *restrict offset)
{
    uint32_t f = s->n_free;
    for (uint32_t j = 0; j < f; j++)
        offset[j] = p[s->n_fixed + j][c] - line_at(s, (const float (*)[3])p, c, j);
    for (uint32_t j = 0; j < f; j++) {
        const double *restrict row = s->matrix + (size_t)j * f;
        double sum = 0;
        for (uint32_t k = 0; k < f; k++)
            sum += row[k] * offset[k];
        p[s->n_fixed + j][c] = (float)(line_at(s, (const float (*)[3])p, c, j) + sum);
    }
}

static void smooth_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct smoothing *s = user;
    uint32_t begin = piece * POLYLINES_PER_PIECE;
    for (uint32_t i = begin; i < s->n && i < begin + POLYLINES_PER_PIECE; i++)
        for (int c = 0; c < 3; c++)
            smooth_one(s, s->points + (size_t)i * s->m, c, s->offset + (size_t)thread * s->n_free);
}

groom_status smooth_polylines(float (*points)[3], uint32_t n, uint32_t m, uint32_t n_fixed, double lambda,
                              uint32_t n_steps, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_threads = parallel_threads(context);
    struct smoothing s = {.points = points, .n = n, .m = m, .n_fixed = n_fixed > 1 ? n_fixed : 1};
    groom_status st = GROOM_OK;

    if (s.n_fixed + 1 >= m || n_steps == 0 || lambda == 0)
        return GROOM_OK;
    uint32_t f = s.n_free = m - 1 - s.n_fixed;
    double *decay = memory_array(allocator, f, sizeof *decay);
    double *sine = memory_array(allocator, 2 * (f + 1), sizeof *sine);
    s.matrix = memory_array(allocator, (size_t)f * f, sizeof *s.matrix);
    s.offset = memory_array(allocator, (size_t)n_threads * f, sizeof *s.offset);
    if (!decay || !sine || !s.matrix || !s.offset) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to smooth polylines of %u vertices", m);
        goto out;
    }
    fill_matrix(&s, lambda, n_steps, decay, sine);
    parallel_for(context, (n + POLYLINES_PER_PIECE - 1) / POLYLINES_PER_PIECE, smooth_piece, &s);
out:
    memory_release(allocator, decay, f, sizeof *decay);
    memory_release(allocator, sine, 2 * (f + 1), sizeof *sine);
    memory_release(allocator, s.matrix, (size_t)f * f, sizeof *s.matrix);
    memory_release(allocator, s.offset, (size_t)n_threads * f, sizeof *s.offset);
    return st;
}
