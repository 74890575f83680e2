/* K-means on rows of floats: counter-based k-means++ seeding and Lloyd's iterations.
 *
 * Deterministic for any pool. Rows are best centred and of a size near 1: distances are
 * |x|^2 - 2 x.c + |c|^2 in single precision. */
#ifndef GEOMETRY_KMEANS_H
#define GEOMETRY_KMEANS_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/random.h"

/* k-means++ (Arthur and Vassilvitskii 2007): each next centre is drawn with probability
 * proportional to its squared distance from the nearest centre so far.
 * x         [n][d]
 * k         1..n
 * chosen    [k] rows taken as centres, all different places
 * n_chosen  fewer than k where the rows are at fewer than k places */
GROOM_MUST_CHECK groom_status kmeans_seed(const float *x, uint32_t n, uint32_t d, uint32_t k,
                                          struct groom_random_key key, const struct groom_context *context,
                                          uint32_t *chosen, uint32_t *n_chosen, struct groom_diag *diag);

struct kmeans_step {
    double objective;   /* mean squared distance of a row to the centre it was assigned to, before that moved */
    uint32_t n_changed; /* rows that changed their cluster */
    uint32_t n_refilled;/* clusters that had lost all rows and got the worst-served one */
};

/* One iteration of Lloyd: every row to its nearest centre (ties to the lower index), every centre
 * to the mean of its rows. No cluster is left empty. The objective never increases from one
 * iteration to the next.
 * x           [n][d]
 * centres     [k][d] read and written
 * cluster_of  [n] read (for n_changed) and written
 * returns     GROOM_OK, GROOM_ENOMEM, GROOM_ECANCELLED: centres and cluster_of are as before */
GROOM_MUST_CHECK groom_status kmeans_iterate(const float *x, uint32_t n, uint32_t d, uint32_t k, float *centres,
                                             uint32_t *cluster_of, const struct groom_context *context,
                                             struct kmeans_step *step, struct groom_diag *diag);

/* Centres at the means of their rows: a cluster without rows keeps its own.
 * x           [n][d]
 * cluster_of  [n] of k
 * centres     [k][d] read and written
 * returns     GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status kmeans_means(const float *x, uint32_t n, uint32_t d, uint32_t k, const uint32_t *cluster_of,
                                           float *centres, const struct groom_context *context, struct groom_diag *diag);

#endif
