#include "fit/loss_strands.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "quality/loss_wasserstein.h"
#include "groom/strands.h"

#define BATCH 512 /* strands whose spectra are in memory at once */

/* Polylines whose segments are those of x, made unit: their features are the directions'. */
static void straighten(const float (*x)[3], uint32_t n, uint32_t m, float (*out)[3])
{
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < m; j++) {
            size_t v = (size_t)i * m + j;
            double e[3], square = 0;
            for (int c = 0; c < 3; c++) {
                e[c] = j ? (double)x[v][c] - x[v - 1][c] : 0;
                square += e[c] * e[c];
            }
            for (int c = 0; c < 3; c++)
                out[v][c] = (j ? out[v - 1][c] : 0) + (float)(square > 0 ? e[c] / sqrt(square) : 0);
        }
}

static double distance(const float a[3], const float b[3])
{
    double x = (double)a[0] - b[0], y = (double)a[1] - b[1], z = (double)a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

static void add_geometry(const float (*a)[3], const float (*b)[3], uint32_t n, uint32_t m, double unit,
                         struct loss_strands *loss)
{
    for (uint32_t i = 0; i < n; i++) {
        const float (*p)[3] = a + (size_t)i * m, (*q)[3] = b + (size_t)i * m;
        double longer = (groom_polyline_length(p, m) - groom_polyline_length(q, m)) / unit;
        for (uint32_t j = 0; j < m; j++)
            loss->vertex += distance(p[j], q[j]) / m;
        loss->length += longer * longer;
    }
}

/* Of features [n][3 (m-1)] and their spectra. */
static void add_features(const float *a, const float *b, const float *spectra_a, const float *spectra_b, uint32_t n,
                         uint32_t m, struct loss_strands *loss)
{
    size_t d = (size_t)3 * (m - 1), h = (size_t)3 * ((m - 1) / 2 + 1);
    for (size_t i = 0; i < n; i++) {
        double dot = 0, square = 0;
        for (size_t k = 0; k < d; k++)
            dot += (double)a[i * d + k] * b[i * d + k];
        for (size_t k = 0; k < h; k++)
            square += ((double)spectra_a[i * h + k] - spectra_b[i * h + k]) * ((double)spectra_a[i * h + k] - spectra_b[i * h + k]);
        loss->direction += 1 - dot / (m - 1);
        loss->spectra += square;
    }
}

groom_status loss_strands(const float (*a)[3], const float (*b)[3], uint32_t n, uint32_t m, double unit, double lambda_d,
                          double lambda_l, const struct groom_context *context, struct loss_strands *out,
                          struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t batch = n < BATCH ? n : BATCH, d = (size_t)3 * (m - 1), h = (size_t)3 * ((m - 1) / 2 + 1);
    size_t n_floats = batch * (3 * (size_t)m + 2 * (d + h));
    float *memory = memory_array(allocator, n_floats, sizeof *memory);
    struct loss_strands loss = {0};
    groom_status st = GROOM_OK;
    if (!memory)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to compare %u strands", n);
    float *of_a = memory + 3 * batch * m, *of_b = of_a + batch * d, *spectra_a = of_b + batch * d, *spectra_b = spectra_a + batch * h;
    float (*unit_segments)[3] = (float (*)[3])(void *)memory;
    for (uint32_t first = 0; st == GROOM_OK && first < n; first += (uint32_t)batch) {
        uint32_t count = n - first < batch ? n - first : (uint32_t)batch;
        const float (*p)[3] = a + (size_t)first * m, (*q)[3] = b + (size_t)first * m;
        straighten(p, count, m, unit_segments);
        st = loss_shape_features((const float (*)[3])unit_segments, count, m, 1, of_a, spectra_a, context, diag);
        straighten(q, count, m, unit_segments);
        if (st == GROOM_OK)
            st = loss_shape_features((const float (*)[3])unit_segments, count, m, 1, of_b, spectra_b, context, diag);
        if (st == GROOM_OK) {
            add_features(of_a, of_b, spectra_a, spectra_b, count, m, &loss);
            add_geometry(p, q, count, m, unit, &loss);
        }
    }
    memory_release(allocator, memory, n_floats, sizeof *memory);
    if (st != GROOM_OK)
        return st;
    loss.direction /= n, loss.spectra /= n, loss.length /= n, loss.vertex /= n;
    loss.total = loss.spectra + lambda_d * loss.direction + lambda_l * loss.length;
    *out = loss;
    return st;
}
