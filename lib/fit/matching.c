#include "fit/matching.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/sort.h"
#include "fit/dense.h"
#include "fit/frame.h"
#include "groom/strands.h"

#define FEWEST_PAIRS 100      /* of which more draws are worth their time: what fewer tell is rough at any rate */
#define NEIGHBOURS 8          /* of which a partner is chosen */
#define LEAST_PEAK 4          /* of the frequencies, from lowest: 3.6 turns of a strand */
#define DUPLICATE_SHARE 0.01  /* of the usual squared distance to a neighbour: closer ones are duplicates */

struct matching {
    const struct groom_allocator *allocator;
    struct groom *groom;              /* of the sub-sample, with random numbers of its own, along */
    double frame[3][3];               /* the fit's */
    struct groom_strands *evaluated;  /* its strands, as they come */
    float (*points)[3];               /* the same resampled as the target was */
    float (*base)[3], (*guide)[3];
    float *values;                    /* [n_pairs][MOMENTS_COUNT] */
    double *cholesky;                 /* of the statistics' covariance */
    double target[MOMENTS_COUNT];
    double other_draws[MOMENTS_COUNT]; /* how far their mean is from what is simulated */
    int known;                         /* of matching_wanted */
    struct moments_plan plan;
};

static size_t guide_points(const struct groom *groom) { return (size_t)groom->n_guides * groom->n_vertices; }
static size_t points_of(const struct matching *matching) { return 2 * (size_t)matching->plan.n_pairs * matching->plan.m; }

/* --- pairs ------------------------------------------------------------------------------ */

/* The nearest neighbour that is no duplicate, else the farthest of those that were found, else the strand. */
static uint32_t partner_of(uint32_t strand, const uint32_t *ids, const float *squared, float least)
{
    uint32_t last = strand;
    for (int k = 0; k < NEIGHBOURS; k++) {
        if (ids[k] == UINT32_MAX || ids[k] == strand)
            continue;
        last = ids[k];
        if (squared[k] > least)
            break;
    }
    return last;
}

/* strand [2 n_pairs]: the first half is set; fills the second. */
static groom_status choose_partners(const struct groom_fit *fit, uint32_t n_pairs, uint32_t *strand,
                                    const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_neighbours *neighbours = NULL;
    float (*query)[2] = memory_array(allocator, n_pairs, sizeof *query);
    uint32_t *ids = memory_array(allocator, n_pairs, NEIGHBOURS * sizeof *ids);
    float *squared = memory_array(allocator, n_pairs, (NEIGHBOURS + 1) * sizeof *squared), *usual;
    groom_status st = query && ids && squared ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to pair strands");
    if (st == GROOM_OK)
        st = groom_neighbours_create(fit->root_uv[0], fit->n, 2, context, &neighbours, diag);
    for (uint32_t i = 0; st == GROOM_OK && i < n_pairs; i++)
        memcpy(query[i], fit->root_uv[strand[i]], sizeof query[i]);
    if (st == GROOM_OK)
        st = groom_neighbours_find(neighbours, query[0], n_pairs, NEIGHBOURS, ids, squared, context, diag);
    if (st == GROOM_OK) {
        usual = squared + (size_t)n_pairs * NEIGHBOURS;
        for (uint32_t i = 0; i < n_pairs; i++)
            usual[i] = squared[(size_t)i * NEIGHBOURS + NEIGHBOURS / 2];
        float least = (float)DUPLICATE_SHARE * median_of_floats(usual, n_pairs);
        for (uint32_t i = 0; i < n_pairs; i++)
            strand[n_pairs + i] = partner_of(strand[i], ids + (size_t)i * NEIGHBOURS, squared + (size_t)i * NEIGHBOURS, least);
    }
    groom_neighbours_destroy(neighbours);
    memory_release(allocator, query, n_pairs, sizeof *query);
    memory_release(allocator, ids, n_pairs, NEIGHBOURS * sizeof *ids);
    memory_release(allocator, squared, n_pairs, (NEIGHBOURS + 1) * sizeof *squared);
    return st;
}

static groom_status choose_pairs(const struct groom_fit *fit, uint32_t n_pairs, uint32_t *strand,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t *order = memory_array(allocator, fit->n, sizeof *order);
    if (!order)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to draw strands");
    groom_fair_order(fit->n, order);
    memcpy(strand, order, n_pairs * sizeof *strand);
    memory_release(allocator, order, fit->n, sizeof *order);
    return choose_partners(fit, n_pairs, strand, context, diag);
}

/* --- random numbers ---------------------------------------------------------------------- */

/* The quantile of N(0,1) truncated to [-1,1]. */
static double truncated_quantile(double probability)
{
    double low = -1, high = 1, half = erf(sqrt(0.5));
    for (int i = 0; i < 40; i++) {
        double middle = 0.5 * (low + high);
        if (0.5 + 0.5 * erf(middle * sqrt(0.5)) / half < probability)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

struct ranked { float value; uint32_t index; };

static int compare_ranked(const void *a, const void *b)
{
    const struct ranked *x = a, *y = b;
    if (x->value != y->value)
        return x->value < y->value ? -1 : 1;
    return (x->index > y->index) - (x->index < y->index);
}

static groom_status stratify(float *u, uint32_t n, int uniform, const struct groom_allocator *allocator)
{
    struct ranked *ranked = memory_array(allocator, n, sizeof *ranked);
    if (!ranked)
        return GROOM_ENOMEM;
    for (uint32_t i = 0; i < n; i++)
        ranked[i] = (struct ranked){u[i], i};
    qsort(ranked, n, sizeof *ranked, compare_ranked);
    for (uint32_t rank = 0; rank < n; rank++) {
        double probability = (rank + 0.5) / n;
        u[ranked[rank].index] = (float)(uniform ? probability : truncated_quantile(probability));
    }
    memory_release(allocator, ranked, n, sizeof *ranked);
    return GROOM_OK;
}

/* Curls that were found are the target's own, of which many strands tell; what is matched are then the same waves, not others
 * of their kind. Numbers that single strands were found to have hold what guides are wrong by, and are drawn. */
static int keeps_numbers(const struct groom_operator *op, int known) { return known && op->type == GROOM_OPERATOR_CURL; }

static groom_status draw_numbers(struct groom *groom, int known, uint64_t draw, const struct groom_allocator *allocator,
                                 struct groom_diag *diag)
{
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        struct groom_operator *op = &groom->operators[o];
        uint32_t n_randoms, n = groom_operator_random_per_guide(op->type) ? groom->n_operator_guides : groom->n_strands;
        const struct groom_operator_random *randoms = groom_operator_randoms(op->type, &n_randoms);
        if (keeps_numbers(op, known))
            continue;
        groom_draw_random(groom, op, FIT_OWN_SEED + draw);
        for (uint32_t r = 0; r < n_randoms; r++)
            if (stratify(op->random[r], n, randoms[r].minimum == 0, allocator) != GROOM_OK)
                return groom_fail(diag, GROOM_ENOMEM, "no memory for random numbers");
    }
    return GROOM_OK;
}

/* --- the sample ---------------------------------------------------------------------------- */

static groom_status allocate(struct matching *matching, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = matching->allocator;
    uint32_t n = 2 * matching->plan.n_pairs, m = matching->plan.m;
    groom_status st = groom_strands_create(n, (uint64_t)n * m, context, &matching->evaluated, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t i = 0; i <= n; i++)
        matching->evaluated->first[i] = i * m;
    matching->points = memory_array(allocator, points_of(matching), sizeof *matching->points);
    matching->base = memory_array(allocator, points_of(matching), sizeof *matching->base);
    matching->guide = memory_array(allocator, points_of(matching), sizeof *matching->guide);
    matching->values = memory_array(allocator, matching->plan.n_pairs, MOMENTS_COUNT * sizeof *matching->values);
    matching->cholesky = memory_array(allocator, MOMENTS_COUNT, MOMENTS_COUNT * sizeof *matching->cholesky);
    if (!matching->points || !matching->base || !matching->guide || !matching->values || !matching->cholesky)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a sample of %u strands", n);
    matching->plan.base = (const float (*)[3])matching->base;
    matching->plan.guide = (const float (*)[3])matching->guide;
    matching->plan.bundle = matching->groom->operator_guide_of;
    return GROOM_OK;
}

/* Into a frame about the middle of the hair, where floats are finest. */
static void move(const double frame[3][3], const float centre[3], float (*points)[3], size_t n)
{
    for (size_t v = 0; v < n; v++) {
        double d[3];
        for (int c = 0; c < 3; c++)
            d[c] = (double)points[v][c] - (double)centre[c];
        for (int c = 0; c < 3; c++)
            points[v][c] = (float)(frame[c][0] * d[0] + frame[c][1] * d[1] + frame[c][2] * d[2]);
    }
}

/* The sample lies along the fit's frame, where operators mostly lean on nothing else, which is quickest. */
static void move_groom(struct matching *matching, const struct groom_fit *fit)
{
    struct groom *groom = matching->groom;
    memcpy(matching->frame, fit->frame, sizeof matching->frame);
    memset(groom->axes, 0, sizeof groom->axes);
    move(fit->frame, fit->centre, groom->guides, guide_points(groom));
    move(fit->frame, fit->centre, groom->roots, groom->n_strands);
}

static void lean_on(struct matching *matching, const double axes[3][3])
{
    double back[3][3], along[3][3];
    memset(matching->groom->axes, 0, sizeof matching->groom->axes);
    if (memcmp(axes, matching->frame, sizeof matching->frame) == 0)
        return;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            back[i][j] = matching->frame[j][i];
    frame_multiply(axes, (const double (*)[3])back, along);
    frame_store((const double (*)[3])along, matching->groom->axes);
}

static groom_status make_base(struct matching *matching, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom *groom = matching->groom;
    uint32_t m = matching->plan.m, n_operators = groom->n_operators;
    groom->n_operators = 0; /* for this one evaluation */
    groom_status st = groom_evaluate(groom, 0, groom->n_strands, matching->base, context, diag);
    groom->n_operators = n_operators;
    for (uint32_t i = 0; i < groom->n_strands; i++)
        memcpy(matching->guide + (size_t)i * m,
               groom->guides + (size_t)groom->operator_guide[groom->operator_guide_of[i]] * m, m * sizeof *matching->guide);
    return st == GROOM_OK ? moments_plan_init(&matching->plan, context, diag) : st;
}

/* The strongest of the frequencies that windows tell apart. */
static uint32_t peak_of(const double target[MOMENTS_COUNT])
{
    uint32_t best = LEAST_PEAK;
    for (uint32_t q = LEAST_PEAK; q < MOMENTS_FREQUENCIES; q++)
        if (target[MOMENTS_SPECTRUM + q] < 0 && target[MOMENTS_SPECTRUM + q] > target[MOMENTS_SPECTRUM + best])
            best = q;
    return best;
}

static void take_target(struct matching *matching, const struct groom_fit *fit, const uint32_t *strand)
{
    uint32_t m = fit->m;
    for (uint32_t i = 0; i < 2 * matching->plan.n_pairs; i++)
        for (uint32_t j = 0; j < m; j++)
            for (int c = 0; c < 3; c++)
                matching->points[(size_t)i * m + j][c] = fit->target[(size_t)strand[i] * m + j][c] * fit->scale;
    move(fit->frame, (const float[3]){0, 0, 0}, matching->points, points_of(matching));
}

static void measure_target(struct matching *matching, const struct groom_context *context)
{
    for (int round = 0; round < 3; round++) { /* each with the levels, then the peak's phase, that were found before */
        moments_measure(&matching->plan, (const float (*)[3])matching->points, matching->values, context);
        moments_mean(matching->values, matching->plan.n_pairs, matching->target);
        memcpy(matching->plan.level, matching->target + MOMENTS_SPECTRUM, sizeof matching->plan.level);
        matching->plan.centroid = matching->target[MOMENTS_CENTROID];
        matching->plan.peak = round == 0 ? peak_of(matching->target) : matching->plan.peak;
        matching->plan.phase = round > 0 ? matching->target[MOMENTS_PHASE] : 0;
    }
}

static groom_status simulate(struct matching *matching, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom *groom = matching->groom;
    groom_status st = groom_evaluate(groom, 0, groom->n_strands, matching->evaluated->points, context, diag);
    if (st == GROOM_OK)
        st = groom_strands_resample(matching->evaluated, matching->plan.m, matching->points, context, diag);
    if (st == GROOM_OK) {
        moments_measure(&matching->plan, (const float (*)[3])matching->points, matching->values, context);
    }
    return st;
}

/* values: the target's, then how far they are from simulated ones. */
static groom_status take_off_simulated(struct matching *matching, const struct groom_context *context, struct groom_diag *diag)
{
    size_t n = (size_t)matching->plan.n_pairs * MOMENTS_COUNT;
    float *target = memory_array(matching->allocator, n, sizeof *target);
    if (!target)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to compare %u pairs of strands", matching->plan.n_pairs);
    memcpy(target, matching->values, n * sizeof *target);
    groom_status st = simulate(matching, context, diag);
    for (size_t v = 0; st == GROOM_OK && v < n; v++)
        matching->values[v] = target[v] - matching->values[v];
    memory_release(matching->allocator, target, n, sizeof *target);
    return st;
}

/* values: the target's. */
static groom_status find_covariance(struct matching *matching, const struct matching_wanted *wanted,
                                    const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = wanted->by_pairs ? take_off_simulated(matching, context, diag) : GROOM_OK;
    if (st != GROOM_OK)
        return st;
    return moments_covariance(matching->values, matching->plan.n_pairs, matching->groom->operator_guide_of,
                              matching->groom->n_operator_guides, matching->target, wanted->floor, matching->cholesky, context, diag);
}

groom_status matching_create(const struct groom_fit *fit, const struct matching_wanted *wanted, const struct groom_context *context,
                             struct matching **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = wanted->n_pairs < fit->n ? wanted->n_pairs : fit->n;
    struct matching *matching = memory_array_zero(allocator, 1, sizeof *matching);
    uint32_t *strand = memory_array(allocator, n, 2 * sizeof *strand);
    groom_status st = matching && strand ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to match operators");
    if (matching) {
        matching->allocator = allocator;
        matching->known = wanted->known;
        matching->plan.n_pairs = n;
        matching->plan.m = fit->m;
    }
    if (st != GROOM_OK)
        goto out;
    if ((st = choose_pairs(fit, n, strand, context, diag)) != GROOM_OK ||
        (st = groom_select(fit->groom, strand, 2 * n, context, &matching->groom, diag)) != GROOM_OK)
        goto out;
    move_groom(matching, fit);
    if ((st = draw_numbers(matching->groom, wanted->known, 0, allocator, diag)) != GROOM_OK ||
        (st = allocate(matching, context, diag)) != GROOM_OK ||
        (st = make_base(matching, context, diag)) != GROOM_OK)
        goto out;
    take_target(matching, fit, strand);
    measure_target(matching, context);
    if ((st = find_covariance(matching, wanted, context, diag)) != GROOM_OK)
        goto out;
    *out = matching;
    matching = NULL;
out:
    matching_destroy(matching);
    memory_release(allocator, strand, n, 2 * sizeof *strand);
    return st;
}

void matching_destroy(struct matching *matching)
{
    if (!matching)
        return;
    const struct groom_allocator *allocator = matching->allocator;
    size_t n_points = points_of(matching);
    memory_release(allocator, matching->points, n_points, sizeof *matching->points);
    memory_release(allocator, matching->base, n_points, sizeof *matching->base);
    memory_release(allocator, matching->guide, n_points, sizeof *matching->guide);
    memory_release(allocator, matching->values, matching->plan.n_pairs, MOMENTS_COUNT * sizeof *matching->values);
    memory_release(allocator, matching->cholesky, MOMENTS_COUNT, MOMENTS_COUNT * sizeof *matching->cholesky);
    groom_strands_destroy(matching->evaluated);
    groom_destroy(matching->groom);
    memory_release(allocator, matching, 1, sizeof *matching);
}

static void set_operators(struct matching *matching, const struct groom_operator *operators, const double axes[3][3])
{
    for (uint32_t o = 0; o < matching->groom->n_operators; o++)
        memcpy(matching->groom->operators[o].parameter, operators[o].parameter, sizeof operators[o].parameter);
    lean_on(matching, axes);
}

/* The mean statistics of one draw of random numbers, which stays. */
static groom_status simulate_draw(struct matching *matching, uint32_t draw, double mean[MOMENTS_COUNT],
                                  const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = draw_numbers(matching->groom, matching->known, draw, matching->allocator, diag);
    if (st == GROOM_OK)
        st = simulate(matching, context, diag);
    if (st == GROOM_OK)
        moments_mean(matching->values, matching->plan.n_pairs, mean);
    return st;
}

groom_status matching_average(struct matching *matching, const struct groom_operator *operators, const double axes[3][3],
                              uint32_t n_draws, const struct groom_context *context, struct groom_diag *diag)
{
    double sum[MOMENTS_COUNT] = {0}, mean[MOMENTS_COUNT] = {0};
    if (matching->plan.n_pairs < FEWEST_PAIRS)
        return GROOM_OK;
    set_operators(matching, operators, axes);
    for (uint32_t draw = n_draws; draw-- > 0;) { /* ends with the first, which is left to be simulated */
        groom_status st = simulate_draw(matching, draw, mean, context, diag);
        if (st != GROOM_OK)
            return st;
        for (int f = 0; f < MOMENTS_COUNT; f++)
            sum[f] += mean[f];
    }
    for (int f = 0; f < MOMENTS_COUNT; f++)
        matching->other_draws[f] = sum[f] / n_draws - mean[f];
    return GROOM_OK;
}

groom_status matching_residual(struct matching *matching, const struct groom_operator *operators, const double axes[3][3],
                               double residual[MOMENTS_COUNT], const struct groom_context *context, struct groom_diag *diag)
{
    set_operators(matching, operators, axes);
    groom_status st = simulate(matching, context, diag);
    if (st != GROOM_OK)
        return st;
    moments_mean(matching->values, matching->plan.n_pairs, residual);
    for (int f = 0; f < MOMENTS_COUNT; f++)
        residual[f] += matching->other_draws[f] - matching->target[f];
    dense_forward(matching->cholesky, MOMENTS_COUNT, residual);
    return GROOM_OK;
}
