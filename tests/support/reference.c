#include "tests/support/reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef double vec[3];

#define NONE 1e-12 /* metres; shorter is no length */

/* --- common operations ------------------------------------------------------------ */

static double dot(const vec a, const vec b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const vec a, const vec b, vec out)
{
    vec c = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    memcpy(out, c, sizeof c);
}

static void subtract(const vec a, const vec b, vec out)
{
    for (int c = 0; c < 3; c++)
        out[c] = a[c] - b[c];
}

static void normalise(vec v)
{
    double length = sqrt(dot(v, v));
    vec up = {0, 1, 0};
    for (int c = 0; c < 3; c++)
        v[c] = length > NONE ? v[c] / length : up[c];
}

static double sigmoid(double x) { return 1.0 / (1.0 + exp(-x)); }

static double segment_length(vec *x, uint32_t j)
{
    vec e;
    subtract(x[j + 1], x[j], e);
    return sqrt(dot(e, e));
}

/* Arc length up to vertex j; up to m - 1 it is the strand's length. */
static double arc_length(vec *x, uint32_t j)
{
    double sum = 0;
    for (uint32_t i = 0; i < j; i++)
        sum += segment_length(x, i);
    return sum;
}

static double fraction(double part, double whole) { return whole > NONE ? part / whole : 0.0; }

/* Rodrigues: v turned by angle about a unit axis. */
static void rotate(const vec axis, double angle, const vec v, vec out)
{
    vec c;
    cross(axis, v, c);
    for (int i = 0; i < 3; i++)
        c[i] = v[i] * cos(angle) + c[i] * sin(angle) + axis[i] * dot(axis, v) * (1 - cos(angle));
    memcpy(out, c, sizeof c);
}

/* --- operators: x is deformed in place ---------------------------------------------- */

static void apply_scale(const double *p, double u, uint32_t m, vec *x)
{
    for (uint32_t j = 1; j < m; j++)
        for (int c = 0; c < 3; c++)
            x[j][c] = x[0][c] + (1 + p[0] * u) * (x[j][c] - x[0][c]);
}

static void bend_axis(vec *guide, double u, vec axis)
{
    vec e, v;
    subtract(guide[1], guide[0], e);
    normalise(e);
    vec auxiliary = {fabs(e[1]) < 0.1 ? 0 : 1, fabs(e[1]) < 0.1 ? 1 : 0, 0};
    cross(e, auxiliary, v);
    rotate(e, M_PI * u, v, axis);
    normalise(axis);
}

static void apply_bend(const double *p, double u, vec *guide, uint32_t m, vec *x)
{
    vec axis, bent[4096];
    double angle = p[0], start = p[1], length = arc_length(x, m - 1), at = 0, after = 0, sum = 0;
    bend_axis(guide, u, axis);
    for (uint32_t j = 0; j + 1 < m; j++) {
        at += segment_length(x, j);
        after += segment_length(x, j) * sigmoid(10 * (fraction(at, length) - start));
    }
    at = 0;
    memcpy(bent[0], x[0], sizeof(vec));
    for (uint32_t j = 0; j + 1 < m; j++) {
        vec e;
        at += segment_length(x, j);
        sum += segment_length(x, j) * sigmoid(10 * (fraction(at, length) - start));
        subtract(x[j + 1], x[j], e);
        rotate(axis, angle * fraction(sum, after), e, e);
        for (int c = 0; c < 3; c++)
            bent[j + 1][c] = bent[j][c] + e[c];
    }
    memcpy(x, bent, m * sizeof(vec));
}

static void curl_frame(vec *guide, uint32_t m, uint32_t j, vec normal, vec binormal)
{
    vec tangent;
    subtract(guide[j == m - 1 ? j : j + 1], guide[j == 0 ? j : j - 1], tangent);
    normalise(tangent);
    int singular = fabs(tangent[0]) + fabs(tangent[1]) < 1e-4;
    normal[0] = singular ? 1 : tangent[1];
    normal[1] = singular ? 0 : -tangent[0];
    normal[2] = 0;
    normalise(normal);
    cross(tangent, normal, binormal);
}

static void apply_curl(const double *p, double u1, double u2, vec *guide, uint32_t m, vec *x)
{
    double radius = p[0], rate = fmax(p[1] + p[2] * u1, 0), start = p[3], length = arc_length(x, m - 1), at = 0;
    vec previous;
    memcpy(previous, x[0], sizeof(vec));
    for (uint32_t j = 1; j < m; j++) {
        vec e, n, b;
        subtract(x[j], previous, e); /* of the undeformed strand */
        memcpy(previous, x[j], sizeof(vec));
        at += sqrt(dot(e, e));
        double v = fraction(at, length), turn = at * rate + 3.9 * u2;
        double size = sigmoid(10 * (v - start)) * radius * (0.43 + 0.79 * v);
        curl_frame(guide, m, j, n, b);
        for (int c = 0; c < 3; c++)
            x[j][c] += size * (sin(2 * M_PI * turn) * n[c] + cos(2 * M_PI * turn) * b[c]);
    }
}

static void apply_clump(const double *p, vec *guide, uint32_t m, vec *x)
{
    double length = arc_length(x, m - 1), at = 0;
    vec previous;
    memcpy(previous, x[0], sizeof(vec));
    for (uint32_t j = 0; j < m; j++) {
        vec e;
        subtract(x[j], previous, e);
        memcpy(previous, x[j], sizeof(vec));
        at += sqrt(dot(e, e));
        double a = 1 - exp(-p[0] * fraction(at, length));
        for (int c = 0; c < 3; c++)
            x[j][c] = (1 - a) * x[j][c] + a * guide[j][c];
    }
}

static double noise_gradient(int64_t i)
{
    uint32_t h = (uint32_t)i * 0x9e3779b1u;
    h = (h ^ (h >> 15)) * 0x85ebca77u;
    double size = 9.0 / 32.0 + 23.0 / 32.0 * ((h >> 8) % 8388608u) / 8388608.0;
    return h >= 0x80000000u ? -size : size;
}

static double perlin(double t)
{
    double f = t - floor(t), fade = 6 * pow(f, 5) - 15 * pow(f, 4) + 10 * pow(f, 3);
    double a = noise_gradient((int64_t)floor(t)) * f, b = noise_gradient((int64_t)floor(t) + 1) * (f - 1);
    return a + fade * (b - a);
}

static void apply_frizz(const double *p, double u, uint32_t m, vec *x)
{
    const double offset[3] = {0, 37.3125, 71.6875};
    double at = 0;
    vec previous;
    memcpy(previous, x[0], sizeof(vec));
    for (uint32_t j = 1; j < m; j++) {
        vec e;
        subtract(x[j], previous, e);
        memcpy(previous, x[j], sizeof(vec));
        at += sqrt(dot(e, e));
        for (int c = 0; c < 3; c++) {
            double chi = p[0] * at + 10 * u + offset[c];
            x[j][c] += 0.5 * p[1] * (2.0 / 3.0) * (perlin(chi) + perlin(2 * chi) / 3.0);
        }
    }
}

/* --- the whole ------------------------------------------------------------------------ */

static void instance(const struct reference *r, uint32_t strand, vec *x)
{
    const struct groom *groom = r->groom;
    uint32_t m = groom->n_vertices, k = groom->n_instancing;
    for (uint32_t j = 0; j < m; j++)
        for (int c = 0; c < 3; c++) {
            x[j][c] = r->roots[strand][c];
            for (uint32_t a = 0; a < k; a++) {
                vec *guide = &r->guides[(size_t)groom->instancing_guide[(size_t)strand * k + a] * m];
                x[j][c] += r->weight[(size_t)strand * k + a] * (guide[j][c] - guide[0][c]);
            }
        }
}

static void apply(const struct reference *r, const struct reference_operator *op, uint32_t strand, vec *guide, vec *x)
{
    uint32_t m = r->groom->n_vertices, o = r->groom->operator_guide_of[strand];
    switch (op->type) {
    case GROOM_OPERATOR_SCALE: apply_scale(op->parameter, op->random[0][strand], m, x); break;
    case GROOM_OPERATOR_BEND: apply_bend(op->parameter, op->random[0][strand], guide, m, x); break;
    case GROOM_OPERATOR_CURL: apply_curl(op->parameter, op->random[0][o], op->random[1][o], guide, m, x); break;
    case GROOM_OPERATOR_CLUMP: apply_clump(op->parameter, guide, m, x); break;
    case GROOM_OPERATOR_FRIZZ: apply_frizz(op->parameter, op->random[0][strand], m, x); break;
    default: abort();
    }
}

static void *allocate(size_t n, size_t size)
{
    void *memory = calloc(n + 1, size);
    if (!memory)
        abort();
    return memory;
}

/* Into the groom's axes, or back. */
static void turn(const struct groom *groom, int back, vec *x, uint32_t m)
{
    for (uint32_t j = 0; j < m; j++) {
        vec y = {0, 0, 0};
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                y[c] += (double)(back ? groom->axes[k][c] : groom->axes[c][k]) * x[j][k];
        memcpy(x[j], y, sizeof y);
    }
}

/* What leans on axes of its own is a groom that was turned, evaluated there, and turned back. */
void reference_strand(const struct reference *r, uint32_t strand, double (*x)[3])
{
    const struct groom *groom = r->groom;
    uint32_t m = groom->n_vertices, o = groom->operator_guide_of[strand];
    static const float space[3][3];
    int turned = memcmp(groom->axes, space, sizeof space) != 0;
    vec *guide = allocate(m, sizeof *guide);
    memcpy(guide, &r->guides[(size_t)groom->operator_guide[o] * m], m * sizeof *guide);
    instance(r, strand, x);
    if (turned) {
        turn(groom, 0, guide, m);
        turn(groom, 0, x, m);
    }
    for (uint32_t i = 0; i < groom->n_operators; i++)
        if (r->operators[i].enabled)
            apply(r, &r->operators[i], strand, guide, x);
    if (turned)
        turn(groom, 1, x, m);
    free(guide);
}

static double *widen(const float *values, size_t n)
{
    double *wide = allocate(n, sizeof *wide);
    for (size_t i = 0; i < n; i++)
        wide[i] = values[i];
    return wide;
}

struct reference *reference_create(const struct groom *groom)
{
    struct reference *r = allocate(1, sizeof *r);
    r->groom = groom;
    r->roots = (vec *)widen(&groom->roots[0][0], 3 * (size_t)groom->n_strands);
    r->guides = (vec *)widen(&groom->guides[0][0], 3 * (size_t)groom->n_guides * groom->n_vertices);
    r->weight = widen(groom->instancing_weight, (size_t)groom->n_strands * groom->n_instancing);
    r->operators = allocate(groom->n_operators, sizeof *r->operators);
    for (uint32_t i = 0; i < groom->n_operators; i++) {
        const struct groom_operator *op = &groom->operators[i];
        size_t n = groom_operator_random_per_guide(op->type) ? groom->n_operator_guides : groom->n_strands;
        r->operators[i].type = op->type;
        r->operators[i].enabled = op->enabled;
        for (int p = 0; p < GROOM_OPERATOR_MAX_PARAMETERS; p++)
            r->operators[i].parameter[p] = op->parameter[p];
        for (uint32_t a = 0; a < groom_operator_random_arrays(op->type); a++)
            r->operators[i].random[a] = widen(op->random[a], n);
    }
    return r;
}

void reference_destroy(struct reference *r)
{
    if (!r)
        return;
    for (uint32_t i = 0; i < r->groom->n_operators; i++)
        for (int a = 0; a < GROOM_OPERATOR_MAX_RANDOM; a++)
            free(r->operators[i].random[a]);
    free(r->operators);
    free(r->weight);
    free(r->guides);
    free(r->roots);
    free(r);
}
