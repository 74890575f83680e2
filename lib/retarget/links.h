/* What particles are to each other and to the body: the quadratic part of Eq. 1, alpha |G^1/2 L (p - rest)|^2 +
 * beta |G^1/2 (p - hat)|^2, whose matrix is K = alpha L^T G L + beta G with G = diag(gamma). x, y and z do not
 * meet in it. It is never written down: L is the graph, L^T the graph the other way round. */
#ifndef RETARGET_LINKS_H
#define RETARGET_LINKS_H

#include "retarget/job.h"
#include "retarget/point.h"

struct links {
    const struct coupled *hair;
    float alpha, beta;
    uint32_t *back_first, *back_row; /* the graph the other way round: who has i for a neighbour ... */
    float *back_weight;              /* ... and with which weight */
    float *diagonal;                 /* [n] of K */
};

groom_status links_init(struct links *links, const struct job *job, const struct coupled *hair, struct groom_diag *diag);
void links_finish(struct links *links, const struct groom_allocator *allocator); /* takes {0} but for hair */

/* K v takes two rounds over all particles: f = G L v for each, then alpha L^T f + beta G v for each. */

static inline float links_gamma(const struct links *links, uint32_t i) { return links->hair->gamma ? links->hair->gamma[i] : 1; }

static inline int links_any(const struct links *links, uint32_t i)
{
    return links->hair->graph->weight[(size_t)i * links->hair->graph->k] > 0;
}

/* (G L v) of particle i */
LANES_INLINE quad links_difference(const struct links *links, uint32_t i, const float (*v)[3])
{
    const struct graph *graph = links->hair->graph;
    const uint32_t *neighbour = graph->neighbour + (size_t)i * graph->k;
    const float *weight = graph->weight + (size_t)i * graph->k;
    quad sum = quad_of(weight[0] > 0) * point_load(v[i]);
    for (uint32_t j = 0; j < graph->k; j++)
        sum -= quad_of(weight[j]) * point_load(v[neighbour[j]]);
    return quad_of(links_gamma(links, i)) * sum;
}

/* (alpha L^T f) of particle i */
LANES_INLINE quad links_pull(const struct links *links, uint32_t i, const float (*f)[3])
{
    quad sum = quad_of((float)links_any(links, i)) * point_load(f[i]);
    for (uint32_t l = links->back_first[i]; l < links->back_first[i + 1]; l++)
        sum -= quad_of(links->back_weight[l]) * point_load(f[links->back_row[l]]);
    return quad_of(links->alpha) * sum;
}

#endif
