/* Guides near each root and their weights: Chang et al. 2025, Eq. 3. */
#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "groom/groom.h"
#include "model/uv_grid.h"

#define PIECE 1024 /* strands */
#define SIGMA_IN_SPACINGS 1.5

struct instancing {
    struct groom *groom;
    const struct uv_grid *grid;
    double sigma;     /* <= 0: equal weights */
    double *squared;  /* [threads * k] */
};

/* The median distance of a guide to its nearest guide; 0 where there is only one. */
static groom_status median_spacing(const struct uv_grid *grid, double *spacing)
{
    uint32_t n = 0, nearest;
    double *squared = memory_array(grid->allocator, grid->n_points, sizeof *squared);
    if (!squared)
        return GROOM_ENOMEM;
    for (uint32_t g = 0; g < grid->n_points; g++)
        n += uv_grid_nearest(grid, grid->points[g], 1, g, &nearest, &squared[n]);
    *spacing = sqrt(median_of_doubles(squared, n));
    memory_release(grid->allocator, squared, grid->n_points, sizeof *squared);
    return GROOM_OK;
}

/* Gaussian weights that sum to 1. Taken relative to the nearest guide, so that a strand far from
 * every guide gets weights too. */
static void weigh(const double *squared, uint32_t k, double sigma, float *weight)
{
    double sum = 0.0, scale = sigma > 0.0 ? 1.0 / (sigma * sigma) : 0.0;
    for (uint32_t i = 0; i < k; i++)
        sum += exp((squared[0] - squared[i]) * scale);
    for (uint32_t i = 0; i < k; i++)
        weight[i] = (float)(exp((squared[0] - squared[i]) * scale) / sum);
}

static void instance_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct instancing *job = user;
    struct groom *groom = job->groom;
    uint32_t k = groom->n_instancing, first = piece * PIECE;
    double *squared = job->squared + (size_t)thread * k;
    for (uint32_t i = first; i < groom->n_strands && i - first < PIECE; i++) {
        uv_grid_nearest(job->grid, groom->root_uv[i], k, UINT32_MAX, groom->instancing_guide + (size_t)i * k, squared);
        weigh(squared, k, job->sigma, groom->instancing_weight + (size_t)i * k);
    }
}

groom_status groom_instance_by_distance(struct groom *groom, float sigma, const struct groom_context *context,
                                        struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_squared = (size_t)parallel_threads(context) * groom->n_instancing;
    struct uv_grid grid = {0};
    struct instancing job = {.groom = groom, .grid = &grid, .sigma = sigma};
    groom_status status = uv_grid_init(&grid, (const float(*)[2])groom->guide_uv, groom->n_guides, allocator);
    if (status == GROOM_OK && !(sigma > 0.0f)) {
        status = median_spacing(&grid, &job.sigma);
        job.sigma *= SIGMA_IN_SPACINGS;
    }
    if (status == GROOM_OK && !(job.squared = memory_array(allocator, n_squared, sizeof *job.squared)))
        status = GROOM_ENOMEM;
    if (status != GROOM_OK) {
        status = groom_fail(diag, status, "no memory to find the guides of %u strands", groom->n_strands);
        goto out;
    }
    parallel_for(context, (groom->n_strands + PIECE - 1) / PIECE, instance_piece, &job);
out:
    memory_release(allocator, job.squared, n_squared, sizeof *job.squared);
    uv_grid_finish(&grid);
    return status;
}
