#include "tests/support/adam.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A problem of its own, in centimetres. */
struct centimetres {
    struct sculpt_problem problem;
    struct located_anchor *anchor;
    double *length, (*rest)[3], (*q)[3], (*gradient)[3], (*m)[3], (*v)[3];
    struct chain_state *junction;
};

static struct centimetres convert(const struct sculpt_problem *from, double unit)
{
    uint32_t n = from->chain.n;
    struct centimetres to = {.problem = *from};
    to.anchor = calloc(from->n_anchors + 1, sizeof *to.anchor);
    to.length = calloc(n, sizeof *to.length);
    to.rest = calloc(n, sizeof *to.rest), to.q = calloc(n, sizeof *to.q);
    to.gradient = calloc(n, sizeof *to.gradient);
    to.m = calloc(n, sizeof *to.m), to.v = calloc(n, sizeof *to.v);
    to.junction = calloc(n + 1, sizeof *to.junction);
    for (uint32_t k = 0; k < from->n_anchors; k++) {
        to.anchor[k] = from->anchor[k];
        to.anchor[k].s *= unit;
        for (int c = 0; c < 3; c++)
            to.anchor[k].target[c] *= unit;
    }
    for (uint32_t j = 0; j < n; j++) {
        to.length[j] = from->chain.length[j] * unit;
        for (int c = 0; c < 3; c++) {
            to.rest[j][c] = from->rest[j][c] / unit;
            to.q[j][c] = from->chain.q[j][c] / unit;
        }
    }
    to.problem.chain.length = to.length;
    to.problem.chain.root.p = vec_scale(unit, from->chain.root.p);
    to.problem.rest = (const double(*)[3])to.rest;
    to.problem.anchor = to.anchor;
    to.problem.c = from->c * unit * unit * unit * unit;
    return to;
}

static void release(struct centimetres *c)
{
    free(c->anchor), free(c->length), free(c->rest), free(c->q);
    free(c->gradient), free(c->m), free(c->v), free(c->junction);
}

static void adam_step(struct centimetres *c, uint32_t step)
{
    double slow = 1.0 - pow(0.9, step), fast = 1.0 - pow(0.999, step);
    double *q = *c->q, *m = *c->m, *v = *c->v;
    const double *gradient = *c->gradient;
    for (uint32_t i = 0; i < 3 * c->problem.chain.n; i++) {
        double g = gradient[i];
        m[i] = 0.9 * m[i] + 0.1 * g;
        v[i] = 0.999 * v[i] + 0.001 * g * g;
        q[i] -= 0.001 * (m[i] / slow) / (sqrt(v[i] / fast) + 1e-8);
    }
}

struct adam_result adam_sculpt(const struct sculpt_problem *problem, double unit)
{
    struct centimetres c = convert(problem, unit);
    struct adam_result result = {.energy = INFINITY};
    uint32_t idle = 0;
    for (result.steps = 0; result.steps < 4000 && idle < 50; result.steps++) {
        double energy = energy_gradient(&c.problem, (const double(*)[3])c.q, c.gradient, c.junction);
        idle = energy < result.energy ? 0 : idle + 1;
        result.energy = fmin(result.energy, energy);
        if (energy < 1e-6)
            break;
        adam_step(&c, result.steps + 1);
    }
    release(&c);
    result.energy /= unit * unit;
    return result;
}
