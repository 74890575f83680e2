#include "fit/guide_system.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"

#define BAND 3
#define LEAST_PIVOT 1e-12
#define ACROSS 4 /* of a matrix entry; before it data: own shapes, own and clumped, clumped and own, clumped */

static const double difference[BAND + 1] = {-1, 3, -3, 1}; /* third: zero on what turns at one rate */

/* --- the matrix --------------------------------------------------------------------- */

static int add_data_row(struct sparse *matrix, const struct mean_strands *mean, uint32_t g)
{
    for (uint32_t at = mean->first[g]; at < mean->first[g + 1]; at++) {
        uint32_t i = mean->member[at] / mean->n_parts;
        const struct mean_part *own = mean->part + mean->member[at], *all = mean->part + (size_t)i * mean->n_parts;
        for (uint32_t p = 0; p < mean->n_parts; p++) {
            double *entry = sparse_entry(matrix, g, all[p].guide);
            if (!entry)
                return 0;
            entry[0] += (double)own->shape * all[p].shape;
            entry[1] += (double)own->shape * all[p].clumped;
            entry[2] += (double)own->clumped * all[p].shape;
            entry[3] += (double)own->clumped * all[p].clumped;
        }
    }
    return 1;
}

/* Row g of weight L^T L; L is symmetric in its pattern. */
static int add_across_row(struct sparse *matrix, const struct sparse *l, uint32_t g, double weight)
{
    for (uint32_t at = l->first[g]; at < l->first[g + 1]; at++) {
        uint32_t row = l->column[at];
        double here = 0;
        for (uint32_t b = l->first[row]; b < l->first[row + 1]; b++)
            if (l->column[b] == g)
                here = l->value[b][0];
        for (uint32_t b = l->first[row]; b < l->first[row + 1]; b++) {
            double *entry = sparse_entry(matrix, g, l->column[b]);
            if (!entry)
                return 0;
            entry[ACROSS] += weight * here * l->value[b][0];
        }
    }
    return 1;
}

static int fill_matrix(struct guide_system *system, const struct mean_strands *mean, const struct sparse *laplacian,
                       double across)
{
    double nu = (double)mean->n / mean->n_guides;
    for (uint32_t g = 0; g < system->n_guides; g++) {
        if (!sparse_entry(&system->matrix, g, g) || !add_data_row(&system->matrix, mean, g) ||
            !add_across_row(&system->matrix, laplacian, g, nu * across))
            return 0;
        sparse_end_row(&system->matrix, g);
    }
    return 1;
}

/* --- life ----------------------------------------------------------------------------- */

groom_status guide_system_init(struct guide_system *system, const struct mean_strands *mean,
                               const struct sparse *laplacian, double along, double across,
                               const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t size = (size_t)mean->n_guides * mean->m;
    *system = (struct guide_system){.n_guides = mean->n_guides, .m = mean->m, .allocator = allocator};
    int fine = sparse_init(&system->matrix, mean->n_guides, allocator);
    system->along = memory_array(allocator, mean->m, sizeof *system->along);
    system->power = memory_array(allocator, mean->m, sizeof *system->power);
    system->hold = memory_array_zero(allocator, size, sizeof *system->hold);
    system->pull = memory_array(allocator, size, sizeof *system->pull);
    system->band = memory_array(allocator, size - mean->n_guides, sizeof *system->band);
    system->arrow = memory_array(allocator, size, sizeof *system->arrow);
    system->r = memory_array(allocator, size, sizeof *system->r);
    system->z = memory_array(allocator, size, sizeof *system->z);
    system->p = memory_array(allocator, size, sizeof *system->p);
    system->q = memory_array(allocator, size, sizeof *system->q);
    system->partial = memory_array(allocator, mean->n_guides, sizeof *system->partial);
    if (!fine || !system->along || !system->power || !system->hold || !system->pull || !system->band || !system->arrow || !system->r || !system->z ||
        !system->p || !system->q || !system->partial || !fill_matrix(system, mean, laplacian, across))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the equations of %u guides", mean->n_guides);
    for (uint32_t j = 0; j < mean->m; j++) {
        double rest = mean->rest[j];
        system->along[j] = along * mean->n / mean->n_guides;
        system->power[j][0] = rest * rest, system->power[j][1] = rest * (1 - rest), system->power[j][2] = (1 - rest) * (1 - rest);
    }
    mean_strands_pull(mean, system->pull, context);
    return GROOM_OK;
}

void guide_system_finish(struct guide_system *system)
{
    const struct groom_allocator *allocator = system->allocator;
    size_t size = (size_t)system->n_guides * system->m;
    if (!allocator)
        return;
    sparse_finish(&system->matrix);
    memory_release(allocator, system->along, system->m, sizeof *system->along);
    memory_release(allocator, system->power, system->m, sizeof *system->power);
    memory_release(allocator, system->hold, size, sizeof *system->hold);
    memory_release(allocator, system->pull, size, sizeof *system->pull);
    memory_release(allocator, system->band, size - system->n_guides, sizeof *system->band);
    memory_release(allocator, system->arrow, size, sizeof *system->arrow);
    memory_release(allocator, system->r, size, sizeof *system->r);
    memory_release(allocator, system->z, size, sizeof *system->z);
    memory_release(allocator, system->p, size, sizeof *system->p);
    memory_release(allocator, system->q, size, sizeof *system->q);
    memory_release(allocator, system->partial, system->n_guides, sizeof *system->partial);
}

/* --- product --------------------------------------------------------------------------- */

struct product {
    struct guide_system *system;
    const double (*shape)[3];
    double (*out)[3];
};

/* What shape at vertex j weighs with shape at vertex j; ... */
static double weight_at(const struct guide_system *system, const double value[SPARSE_WIDTH], uint32_t j)
{
    const double *power = system->power[j];
    return power[0] * value[0] + power[1] * (value[1] + value[2]) + power[2] * value[3] + value[ACROSS];
}

/* ... the root of the other with this one's shape; ... */
static double others_root(const struct guide_system *system, const double value[SPARSE_WIDTH], uint32_t j)
{
    return system->power[j][1] * value[1] + system->power[j][2] * value[3];
}

/* ... and this one's root with the other's shape. */
static double own_root(const struct guide_system *system, const double value[SPARSE_WIDTH], uint32_t j)
{
    return system->power[j][1] * value[2] + system->power[j][2] * value[3];
}

static double root_with_root(const struct guide_system *system, const double value[SPARSE_WIDTH])
{
    double sum = 0;
    for (uint32_t j = 1; j < system->m; j++)
        sum += system->power[j][2] * value[3];
    return sum;
}

/* Third differences of the shape, which begins at 0, and their transpose. */
static void add_along(const struct guide_system *system, const double (*restrict s)[3], double (*restrict out)[3])
{
    for (uint32_t j = 0; j + BAND < system->m; j++)
        for (int c = 0; c < 3; c++) {
            uint32_t begin = j == 0;
            double sum = 0;
            for (uint32_t d = begin; d <= BAND; d++)
                sum += difference[d] * s[j + d][c];
            for (uint32_t d = begin; d <= BAND; d++)
                out[j + d][c] += system->along[j] * difference[d] * sum;
        }
}

/* out += what the moves of roots, rows 0, do to it and are done by it. */
static void add_roots(const struct guide_system *system, const double value[SPARSE_WIDTH], const double (*restrict s)[3],
                      double (*restrict out)[3])
{
    double both = root_with_root(system, value);
    for (int c = 0; c < 3; c++)
        out[0][c] += both * s[0][c];
    for (uint32_t j = 1; j < system->m; j++) {
        double here = own_root(system, value, j), there = others_root(system, value, j);
        for (int c = 0; c < 3; c++) {
            out[0][c] += here * s[j][c];
            out[j][c] += there * s[0][c];
        }
    }
}

static void apply_row(void *user, uint32_t g, uint32_t thread)
{
    const struct product *job = user;
    const struct guide_system *system = job->system;
    uint32_t m = system->m;
    const double (*own)[3] = job->shape + (size_t)g * m;
    double (*restrict out)[3] = job->out + (size_t)g * m;
    (void)thread;
    for (uint32_t j = 0; j < m; j++)
        for (int c = 0; c < 3; c++)
            out[j][c] = system->hold[(size_t)g * m + j] * own[j][c];
    for (uint32_t at = system->matrix.first[g]; at < system->matrix.first[g + 1]; at++) {
        const double (*restrict s)[3] = job->shape + (size_t)system->matrix.column[at] * m, *value = system->matrix.value[at];
        for (uint32_t j = 1; j < m; j++) {
            double weight = weight_at(system, value, j);
            for (int c = 0; c < 3; c++)
                out[j][c] += weight * s[j][c];
        }
        if (value[2] != 0 || value[3] != 0 || value[1] != 0)
            add_roots(system, value, s, out);
    }
    add_along(system, own, out);
}

void guide_system_apply(struct guide_system *system, const double (*shape)[3], double (*out)[3],
                        const struct groom_context *context)
{
    struct product job = {system, shape, out};
    parallel_for(context, system->n_guides, apply_row, &job);
}

/* --- preconditioner --------------------------------------------------------------------- */

static const double *own_entry(const struct guide_system *system, uint32_t g)
{
    uint32_t at = system->matrix.first[g];
    while (system->matrix.column[at] != g)
        at++;
    return system->matrix.value[at];
}

/* A guide's own block, but for its root: row j - 1 is vertex j, entry BAND - d couples it with vertex j - d. */
static void fill_block(const struct guide_system *system, uint32_t g, double (*band)[BAND + 1])
{
    uint32_t m = system->m;
    const double *own = own_entry(system, g);
    memset(band, 0, (m - 1) * sizeof *band);
    for (uint32_t j = 1; j < m; j++)
        band[j - 1][BAND] = weight_at(system, own, j) + system->hold[(size_t)g * m + j];
    for (uint32_t j = 0; j + BAND < m; j++)
        for (uint32_t a = 0; a <= BAND; a++)
            for (uint32_t b = 0; b <= a; b++)
                if (j + b > 0)
                    band[j + a - 1][BAND - (a - b)] += system->along[j] * difference[a] * difference[b];
}

static double at_band(const double (*band)[BAND + 1], uint32_t row, uint32_t column)
{
    return row - column > BAND ? 0 : band[row][BAND - (row - column)];
}

/* Banded Cholesky, in place. A pivot that is nothing (a guide without strands, alone) is made 1. */
static void factor(double (*band)[BAND + 1], uint32_t n)
{
    for (uint32_t row = 0; row < n; row++)
        for (uint32_t column = row < BAND ? 0 : row - BAND; column <= row; column++) {
            double sum = band[row][BAND - (row - column)];
            for (uint32_t k = row < BAND ? 0 : row - BAND; k < column; k++)
                sum -= at_band((const double (*)[BAND + 1])band, row, k) * at_band((const double (*)[BAND + 1])band, column, k);
            if (column == row)
                band[row][BAND] = sum > LEAST_PIVOT ? sqrt(sum) : 1;
            else
                band[row][BAND - (row - column)] = sum / band[column][BAND];
        }
}

/* x = (L L^T)^-1 x, one coordinate; `step` apart */
static void solve_band(const double (*band)[BAND + 1], uint32_t n, double *x, size_t step)
{
    for (uint32_t row = 0; row < n; row++) {
        double sum = x[row * step];
        for (uint32_t d = 1; d <= BAND && d <= row; d++)
            sum -= band[row][BAND - d] * x[(row - d) * step];
        x[row * step] = sum / band[row][BAND];
    }
    for (uint32_t row = n; row-- > 0;) {
        double sum = x[row * step];
        for (uint32_t d = 1; d <= BAND && row + d < n; d++)
            sum -= band[row + d][BAND - d] * x[(row + d) * step];
        x[row * step] = sum / band[row][BAND];
    }
}

/* The move of the root is coupled with all vertices, as an arrow's point is: by column a = own_root with the band B.
 * Kept are B^-1 a, from entry 1 on, and in entry 0 what is left of the root's own weight, a^T B^-1 a taken off. */
static void factor_root(const struct guide_system *system, uint32_t g)
{
    uint32_t m = system->m;
    const double *own = own_entry(system, g);
    double *arrow = system->arrow + (size_t)g * m;
    arrow[0] = system->hold[(size_t)g * m] + root_with_root(system, own);
    for (uint32_t j = 1; j < m; j++)
        arrow[j] = own_root(system, own, j);
    solve_band((const double (*)[BAND + 1])(system->band + (size_t)g * (m - 1)), m - 1, arrow + 1, 1);
    for (uint32_t j = 1; j < m; j++)
        arrow[0] -= own_root(system, own, j) * arrow[j];
}

static void factor_row(void *user, uint32_t g, uint32_t thread)
{
    const struct guide_system *system = user;
    double (*band)[BAND + 1] = system->band + (size_t)g * (system->m - 1);
    (void)thread;
    fill_block(system, g, band);
    factor(band, system->m - 1);
    factor_root(system, g);
}

/* z = (the guide's own block)^-1 r */
static void precondition(const struct guide_system *system, uint32_t g)
{
    uint32_t m = system->m;
    const double (*band)[BAND + 1] = (const double (*)[BAND + 1])(system->band + (size_t)g * (m - 1));
    const double *arrow = system->arrow + (size_t)g * m;
    double (*z)[3] = system->z + (size_t)g * m;
    memcpy(z, system->r + (size_t)g * m, m * sizeof *z);
    for (int c = 0; c < 3; c++) {
        for (uint32_t j = 1; j < m; j++)
            z[0][c] -= arrow[j] * z[j][c];
        z[0][c] = arrow[0] > LEAST_PIVOT ? z[0][c] / arrow[0] : 0;
        solve_band(band, m - 1, &z[1][c], 3);
        for (uint32_t j = 1; j < m; j++)
            z[j][c] -= arrow[j] * z[0][c];
    }
}

/* --- conjugate gradients -------------------------------------------------------------------- */

struct iteration {
    struct guide_system *system;
    double (*x)[3];
    double alpha, beta;
};

static double dot(const double (*a)[3], const double (*b)[3], uint32_t n)
{
    double sum = 0;
    for (uint32_t j = 0; j < n; j++)
        sum += a[j][0] * b[j][0] + a[j][1] * b[j][1] + a[j][2] * b[j][2];
    return sum;
}

static double total(const struct guide_system *system)
{
    double sum = 0;
    for (uint32_t g = 0; g < system->n_guides; g++)
        sum += system->partial[g];
    return sum;
}

/* r = pull - q */
static void residual_row(void *user, uint32_t g, uint32_t thread)
{
    struct iteration *job = user;
    struct guide_system *system = job->system;
    size_t first = (size_t)g * system->m;
    (void)thread;
    for (uint32_t j = 0; j < system->m; j++)
        for (int c = 0; c < 3; c++)
            system->r[first + j][c] = system->pull[first + j][c] - system->q[first + j][c];
    system->partial[g] = dot((const double (*)[3])(system->pull + first), (const double (*)[3])(system->pull + first), system->m);
}

static void precondition_row(void *user, uint32_t g, uint32_t thread)
{
    struct iteration *job = user;
    struct guide_system *system = job->system;
    size_t first = (size_t)g * system->m;
    (void)thread;
    precondition(system, g);
    system->partial[g] = dot((const double (*)[3])(system->r + first), (const double (*)[3])(system->z + first), system->m);
}

static void direction_row(void *user, uint32_t g, uint32_t thread)
{
    struct iteration *job = user;
    struct guide_system *system = job->system;
    (void)thread;
    for (size_t v = (size_t)g * system->m; v < (size_t)(g + 1) * system->m; v++)
        for (int c = 0; c < 3; c++)
            system->p[v][c] = system->z[v][c] + job->beta * system->p[v][c];
}

static void curvature_row(void *user, uint32_t g, uint32_t thread)
{
    struct iteration *job = user;
    struct guide_system *system = job->system;
    size_t first = (size_t)g * system->m;
    struct product product = {system, (const double (*)[3])system->p, system->q};
    apply_row(&product, g, thread);
    system->partial[g] = dot((const double (*)[3])(system->p + first), (const double (*)[3])(system->q + first), system->m);
}

static void advance_row(void *user, uint32_t g, uint32_t thread)
{
    struct iteration *job = user;
    struct guide_system *system = job->system;
    size_t first = (size_t)g * system->m;
    (void)thread;
    for (size_t v = first; v < first + system->m; v++)
        for (int c = 0; c < 3; c++) {
            job->x[v][c] += job->alpha * system->p[v][c];
            system->r[v][c] -= job->alpha * system->q[v][c];
        }
    system->partial[g] = dot((const double (*)[3])(system->r + first), (const double (*)[3])(system->r + first), system->m);
}

uint32_t guide_system_solve(struct guide_system *system, double (*shape)[3], double tolerance, uint32_t most_iterations,
                            const struct groom_context *context)
{
    struct iteration job = {.system = system, .x = shape};
    uint32_t n = system->n_guides, iteration = 0;
    parallel_for(context, n, factor_row, system);
    guide_system_apply(system, (const double (*)[3])shape, system->q, context);
    parallel_for(context, n, residual_row, &job);
    double enough = tolerance * tolerance * total(system), rz = 0;
    memset(system->p, 0, (size_t)n * system->m * sizeof *system->p);
    for (; iteration < most_iterations && !progress_cancelled(context); iteration++) {
        parallel_for(context, n, precondition_row, &job);
        double next = total(system);
        if (!(next > 0))
            break;
        job.beta = rz > 0 ? next / rz : 0;
        rz = next;
        parallel_for(context, n, direction_row, &job);
        parallel_for(context, n, curvature_row, &job);
        double curvature = total(system);
        if (!(curvature > 0))
            break;
        job.alpha = rz / curvature;
        parallel_for(context, n, advance_row, &job);
        if (total(system) <= enough)
            break;
    }
    return iteration;
}
