#include "fit/refine.h"

#include <math.h>
#include <string.h>

#include "base/parallel.h"

#define STRANDS_PER_PIECE 256
#define PER_VERTEX 2 /* points of the curve for each vertex that the strand is to have */

#define SMOOTH 0.866 /* cosine of a turn that a curve makes between two vertices: 30 degrees; */
#define CORNER 0.5   /* of a corner: 60; */
#define STRAIGHT 0.9999 /* of none worth a curve: 1 */


static double knot(const float a[3], const float b[3])
{
    double square = 0;
    for (int c = 0; c < 3; c++)
        square += ((double)b[c] - a[c]) * ((double)b[c] - a[c]);
    return sqrt(sqrt(square)); /* the root of the distance */
}

/* The tangent at b, per unit of knots, of the curve through a, b, c. */
static void tangent(const float *a, const float *b, const float *c, double out[3])
{
    double before = knot(a, b), after = knot(b, c);
    for (int k = 0; k < 3; k++) {
        double first = before > 0 ? ((double)b[k] - a[k]) / before : 0, second = after > 0 ? ((double)c[k] - b[k]) / after : 0;
        double across = before + after > 0 ? ((double)c[k] - a[k]) / (before + after) : 0;
        out[k] = before > 0 && after > 0 ? first - across + second : before > 0 ? first : second;
    }
}

/* Of the turn at b; 1 at an end of the strand, where two of them are one. */
static double cosine(const float *a, const float *b, const float *c)
{
    double dot = 0, before = 0, after = 0;
    for (int k = 0; k < 3; k++) {
        double x = (double)b[k] - a[k], y = (double)c[k] - b[k];
        dot += x * y, before += x * x, after += y * y;
    }
    return before > 0 && after > 0 ? dot / sqrt(before * after) : 1;
}

/* How far a vertex is one of a curve, 1, or a corner, 0: crimps that turn from vertex to vertex have no curve to tell. */
static double smoothness(const float *a, const float *b, const float *c)
{
    return fmin(fmax((cosine(a, b, c) - CORNER) / (SMOOTH - CORNER), 0), 1);
}

/* Points 0 .. steps-1 of the segment from x[j]; at the strand's ends it begins and ends straight. */
static void cut_segment(const float (*x)[3], uint32_t n, uint32_t j, uint32_t steps, float (*out)[3])
{
    const float *before = x[j > 0 ? j - 1 : j], *after = x[j + 2 < n ? j + 2 : j + 1];
    double length = knot(x[j], x[j + 1]), from[3], to[3];
    double smooth = fmin(smoothness(before, x[j], x[j + 1]), smoothness(x[j], x[j + 1], after));
    tangent(before, x[j], x[j + 1], from);
    tangent(x[j], x[j + 1], after, to);
    memcpy(out[0], x[j], sizeof out[0]);
    for (uint32_t s = 1; s < steps; s++) {
        double t = (double)s / steps, u = 1 - t;
        for (int c = 0; c < 3; c++) {
            double straight = u * x[j][c] + t * x[j + 1][c];
            double curve = u * u * (1 + 2 * t) * x[j][c] + t * t * (1 + 2 * u) * x[j + 1][c] +
                           t * u * length * (u * from[c] - t * to[c]);
            out[s][c] = (float)(straight + smooth * (curve - straight));
        }
    }
}

static int is_straight(const float (*x)[3], uint32_t n)
{
    for (uint32_t j = 1; j + 1 < n; j++)
        if (cosine(x[j - 1], x[j], x[j + 1]) < STRAIGHT)
            return 0;
    return 1;
}

/* Steps that each segment of strand i is cut into. */
static uint32_t steps_of(const struct groom_strands *strands, uint32_t i, uint32_t m)
{
    uint32_t n = strands->first[i + 1] - strands->first[i];
    if (n < 3 || n > m / 2 || is_straight((const float (*)[3])(strands->points + strands->first[i]), n))
        return 1;
    return (PER_VERTEX * m + n - 2) / (n - 1);
}

struct refining { const struct groom_strands *in; struct groom_strands *out; uint32_t m; };

static void refine_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct refining *job = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < job->in->n_strands && i < (piece + 1) * STRANDS_PER_PIECE; i++) {
        uint32_t n = job->in->first[i + 1] - job->in->first[i], steps = steps_of(job->in, i, job->m);
        const float (*x)[3] = (const float (*)[3])(job->in->points + job->in->first[i]);
        float (*out)[3] = job->out->points + job->out->first[i];
        for (uint32_t j = 0; j + 1 < n; j++)
            cut_segment(x, n, j, steps, out + (size_t)j * steps);
        memcpy(out[(size_t)(n - 1) * steps], x[n - 1], sizeof out[0]);
    }
}

groom_status refine_strands(const struct groom_strands *in, uint32_t m, const struct groom_context *context,
                            struct groom_strands **out, struct groom_diag *diag)
{
    struct refining job = {.in = in, .m = m};
    uint64_t n_vertices = 0;
    for (uint32_t i = 0; i < in->n_strands; i++) {
        uint32_t n = in->first[i + 1] - in->first[i];
        n_vertices += (uint64_t)(n - 1) * steps_of(in, i, m) + 1;
    }
    groom_status st = groom_strands_create(in->n_strands, n_vertices, context, &job.out, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t i = 0; i < in->n_strands; i++) {
        uint32_t n = in->first[i + 1] - in->first[i];
        job.out->first[i + 1] = job.out->first[i] + (n - 1) * steps_of(in, i, m) + 1;
    }
    parallel_for(context, in->n_strands / STRANDS_PER_PIECE + (in->n_strands % STRANDS_PER_PIECE != 0), refine_piece, &job);
    *out = job.out;
    return GROOM_OK;
}
