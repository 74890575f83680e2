#include "fit/paper_guides.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "fit/gradient_filter.h"
#include "fit/loss_guides.h"

#define UNIT 0.1              /* metres on an ordinary head: what the paper's learning rates fit */
#define STEP_STRANDS 100000   /* strands times gradients of one step of the stage */
#define MOST_STEPS 100
#define STREAMED 10           /* one loss of so many is streamed */
#define FIRST 0.9             /* Adam's averages */
#define SECOND 0.999
#define EPSILON 1e-8
#define LEAST_LENGTH 1e-4f    /* of a segment, in units: it does not turn around */

enum { ANGLES, LENGTHS, CURVATURES, KINDS };

/* All numbers of guides are rows: 2 angles, m-1 lengths, 2 (m-2) curvatures. */
static uint32_t width_of(const struct groom_fit *fit) { return 3 * fit->m - 3; }
static uint32_t kind_begin(uint32_t m, int kind) { return kind == ANGLES ? 0 : kind == LENGTHS ? 2 : kind == CURVATURES ? m + 1 : 3 * m - 3; }

/* Poles, parameters, first and second averages. */
uint32_t paper_guides_moments(const struct groom_fit *fit) { return fit->n_guides * (9 + 3 * width_of(fit)); }

struct descent {
    struct groom_fit *fit;
    double unit;
    float *state;                       /* [paper_guides_moments] */
    float *row, *first, *second;        /* [n_guides][width] of it */
    float *gradient, *smooth;           /* [n_guides][width] */
    float *filter;                      /* [n_guides][n_guides] */
    float (*direction)[3];              /* [n_guides] */
    struct groom_curvature_guides *guides, *slopes;
    struct groom_operator operators[GROOM_FIT_MAX_OPERATORS];
    struct groom mean;                  /* the fit's groom on average, with guides of its own */
    struct groom_gradient *of_mean;
    float (*points)[3], (*d_points)[3]; /* [n_guides * m] in units; points in metres are mean.guides */
    double *piece_loss;
};

/* --- rows -------------------------------------------------------------------------------------- */

static void to_row(const struct groom_curvature_guides *guides, uint32_t g, float *row)
{
    uint32_t m = guides->n_vertices;
    memcpy(row, guides->angle[g], sizeof guides->angle[g]);
    memcpy(row + kind_begin(m, LENGTHS), guides->length + (size_t)g * (m - 1), (m - 1) * sizeof *row);
    memcpy(row + kind_begin(m, CURVATURES), guides->curvature + (size_t)g * (m - 2), 2 * (size_t)(m - 2) * sizeof *row);
}

static void from_row(const float *row, struct groom_curvature_guides *guides, uint32_t g)
{
    uint32_t m = guides->n_vertices;
    memcpy(guides->angle[g], row, sizeof guides->angle[g]);
    memcpy(guides->length + (size_t)g * (m - 1), row + kind_begin(m, LENGTHS), (m - 1) * sizeof *row);
    memcpy(guides->curvature + (size_t)g * (m - 2), row + kind_begin(m, CURVATURES), 2 * (size_t)(m - 2) * sizeof *row);
}

/* --- the gradient ---------------------------------------------------------------------------------- */

/* Eq. 8 with the one strand that there is of each root. */
static void compare_piece(void *user, uint32_t first, uint32_t n, const float (*points)[3], float (*d_points)[3])
{
    const struct descent *d = user;
    const struct groom_fit *fit = d->fit;
    const float (*target)[3] = (const float (*)[3])(fit->target + (size_t)first * fit->m);
    double sum = 0, scale = 2 / (d->unit * d->unit * fit->n);
    for (size_t v = 0; v < (size_t)n * fit->m; v++)
        for (int c = 0; c < 3; c++) {
            double off = (double)points[v][c] - ((double)target[v][c] * fit->scale + fit->centre[c]);
            sum += off * off;
            d_points[v][c] = (float)(scale * off);
        }
    d->piece_loss[first / GROOM_GRADIENT_PIECE] = sum;
}

static uint32_t pieces_of(uint32_t n) { return n / GROOM_GRADIENT_PIECE + (n % GROOM_GRADIENT_PIECE != 0); }

/* The guides' points from their rows. */
static void place_guides(struct descent *d, const struct groom_context *context)
{
    size_t n_points = (size_t)d->fit->n_guides * d->fit->m;
    for (uint32_t g = 0; g < d->fit->n_guides; g++)
        from_row(d->row + (size_t)g * width_of(d->fit), d->guides, g);
    groom_curvature_guides_to_points(d->guides, d->points, context);
    for (size_t v = 0; v < n_points; v++)
        for (int c = 0; c < 3; c++)
            d->mean.guides[v][c] = (float)(d->unit * (double)d->points[v][c]);
}

static groom_status evaluate(struct descent *d, double *loss, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_fit *fit = d->fit;
    struct groom_adjoint adjoint = {compare_piece, d};
    place_guides(d, context);
    groom_status st = groom_evaluate_gradient(&d->mean, NULL, fit->n, adjoint, d->of_mean, context, diag);
    if (st != GROOM_OK)
        return st;
    *loss = 0;
    for (uint32_t p = 0; p < pieces_of(fit->n); p++)
        *loss += d->piece_loss[p] / ((double)fit->n * fit->m);
    for (size_t v = 0; v < (size_t)fit->n_guides * fit->m; v++)
        for (int c = 0; c < 3; c++)
            d->d_points[v][c] = (float)(d->unit * (double)d->of_mean->guides[v][c]);
    groom_curvature_guides_gradient(d->guides, (const float (*)[3])d->d_points, d->slopes, context);
    for (uint32_t g = 0; g < fit->n_guides; g++)
        to_row(d->slopes, g, d->gradient + (size_t)g * width_of(fit));
    return GROOM_OK;
}

/* --- one step of descent ------------------------------------------------------------------------------ */

static void average(struct descent *d)
{
    size_t n = (size_t)d->fit->n_guides * width_of(d->fit);
    for (size_t i = 0; i < n; i++) {
        double g = (double)d->gradient[i];
        d->first[i] = (float)(FIRST * (double)d->first[i] + (1 - FIRST) * g);
        d->second[i] = (float)(SECOND * (double)d->second[i] + (1 - SECOND) * g * g);
    }
}

static void largest_of_kinds(const struct descent *d, const float *rows, double largest[KINDS])
{
    uint32_t width = width_of(d->fit);
    for (int kind = 0; kind < KINDS; kind++) {
        largest[kind] = 0;
        for (uint32_t g = 0; g < d->fit->n_guides; g++)
            for (uint32_t i = kind_begin(d->fit->m, kind); i < kind_begin(d->fit->m, kind + 1); i++)
                largest[kind] = fmax(largest[kind], (double)rows[(size_t)g * width + i]);
    }
}

/* step 1 for the first one */
static void descend(struct descent *d, uint32_t step, const struct groom_context *context)
{
    const struct groom_fit *fit = d->fit;
    double largest[KINDS], first = 1 - pow(FIRST, step), second = 1 - pow(SECOND, step);
    double rates[KINDS] = {fit->options.stages.guides.learning_rate_angle, fit->options.stages.guides.learning_rate_length,
                           fit->options.stages.guides.learning_rate_curvature};
    uint32_t width = width_of(fit), n = fit->n_guides;
    average(d);
    gradient_filter_apply(d->filter, d->second, n, width, d->smooth, context);
    largest_of_kinds(d, d->smooth, largest);
    gradient_filter_apply(d->filter, d->first, n, width, d->smooth, context);
    for (int kind = 0; kind < KINDS; kind++) {
        double rate = rates[kind] / first / (sqrt(largest[kind] / second) + EPSILON);
        for (uint32_t g = 0; g < n; g++)
            for (uint32_t i = kind_begin(fit->m, kind); i < kind_begin(fit->m, kind + 1); i++) {
                size_t at = (size_t)g * width + i;
                d->row[at] = (float)((double)d->row[at] - rate * (double)d->smooth[at]);
                if (kind == LENGTHS)
                    d->row[at] = fmaxf(d->row[at], LEAST_LENGTH);
            }
    }
}

/* --- life ------------------------------------------------------------------------------------------------ */

static void begin_state(struct descent *d, const struct groom_context *context)
{
    const struct groom_fit *fit = d->fit;
    uint32_t n = fit->n_guides;
    for (size_t v = 0; v < (size_t)n * fit->m; v++)
        for (int c = 0; c < 3; c++)
            d->points[v][c] = (float)((double)fit->groom->guides[v][c] / d->unit);
    groom_curvature_guides_from_points((const float (*)[3])d->points, d->guides, context);
    memcpy(d->state, d->guides->pole, n * sizeof *d->guides->pole);
    for (uint32_t g = 0; g < n; g++)
        to_row(d->guides, g, d->row + (size_t)g * width_of(fit));
}

static void resume_state(struct descent *d)
{
    const struct groom_fit *fit = d->fit;
    memcpy(d->state, fit->moments, fit->n_moments * sizeof *d->state);
    memcpy(d->guides->pole, d->state, fit->n_guides * sizeof *d->guides->pole);
    for (uint32_t g = 0; g < fit->n_guides; g++)
        for (int c = 0; c < 3; c++)
            d->guides->root[g][c] = (float)((double)fit->groom->guides[(size_t)g * fit->m][c] / d->unit);
}

static void root_directions(struct descent *d)
{
    for (uint32_t g = 0; g < d->fit->n_guides; g++) {
        const float (*x)[3] = (const float (*)[3])(d->points + (size_t)g * d->fit->m);
        double e[3], square = 0;
        for (int c = 0; c < 3; c++) {
            e[c] = (double)x[1][c] - x[0][c];
            square += e[c] * e[c];
        }
        for (int c = 0; c < 3; c++)
            d->direction[g][c] = square > 0 ? (float)(e[c] / sqrt(square)) : 0;
    }
}

/* Everything that a descent keeps while it runs: what, how many, of which size. */
#define DESCENT_MEMORY(X)                                                                                    \
    X(state, paper_guides_moments(fit))                                                                      \
    X(gradient, rows)                                                                                        \
    X(smooth, rows)                                                                                          \
    X(filter, (size_t)fit->n_guides * fit->n_guides)                                                         \
    X(direction, fit->n_guides)                                                                              \
    X(points, n_points)                                                                                      \
    X(d_points, n_points)                                                                                    \
    X(mean.guides, n_points)                                                                                 \
    X(piece_loss, pieces_of(fit->n))

static groom_status descent_init(struct descent *d, struct groom_fit *fit, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t rows = (size_t)fit->n_guides * width_of(fit), n_points = (size_t)fit->n_guides * fit->m;
    struct gradient_filter_widths widths = {fit->options.stages.guides.lambda, fit->options.stages.guides.sigma_d,
                                            fit->options.stages.guides.sigma_phi};
    groom_status st;
    *d = (struct descent){.fit = fit, .unit = UNIT * fit->ordinary};
    d->mean = loss_guides_mean(fit->groom, d->operators);
    d->mean.guides = NULL;
#define GET(member, count) d->member = memory_array_zero(allocator, count, sizeof *d->member);
    DESCENT_MEMORY(GET)
#undef GET
#define IS_THERE(member, count) d->member &&
    if (!(DESCENT_MEMORY(IS_THERE) 1))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to move %u guides", fit->n_guides);
#undef IS_THERE
    d->row = d->state + (size_t)9 * fit->n_guides;
    d->first = d->row + rows;
    d->second = d->first + rows;
    if ((st = groom_curvature_guides_create(fit->n_guides, fit->m, context, &d->guides, diag)) != GROOM_OK ||
        (st = groom_curvature_guides_create(fit->n_guides, fit->m, context, &d->slopes, diag)) != GROOM_OK ||
        (st = groom_gradient_create(&d->mean, context, &d->of_mean, diag)) != GROOM_OK)
        return st;
    if (fit->n_moments > 0)
        resume_state(d);
    else
        begin_state(d, context);
    place_guides(d, context);
    root_directions(d);
    return gradient_filter((const float (*)[2])fit->groom->guide_uv, (const float (*)[3])d->direction, fit->n_guides,
                           widths, d->filter, context, diag);
}

static void descent_finish(struct descent *d, const struct groom_context *context)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const struct groom_fit *fit = d->fit;
    size_t rows = (size_t)fit->n_guides * width_of(fit), n_points = (size_t)fit->n_guides * fit->m;
    groom_gradient_destroy(d->of_mean);
    groom_curvature_guides_destroy(d->guides);
    groom_curvature_guides_destroy(d->slopes);
#define RELEASE(member, count) memory_release(allocator, d->member, count, sizeof *d->member);
    DESCENT_MEMORY(RELEASE)
#undef RELEASE
}

/* --- steps of the stage ------------------------------------------------------------------------------------- */

static groom_status descend_some(struct descent *d, uint32_t count, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    for (uint32_t k = 0; k < count; k++) {
        uint32_t iteration = d->fit->iteration + k;
        double loss;
        if (progress_cancelled(context))
            return groom_fail(diag, GROOM_ECANCELLED, "cancelled in stage guides");
        groom_status st = evaluate(d, &loss, context, diag);
        if (st != GROOM_OK)
            return st;
        if (iteration % STREAMED == 0)
            progress_loss(context, "L_g", iteration, loss);
        descend(d, iteration + 1, context);
    }
    place_guides(d, context);
    return GROOM_OK;
}

static int is_finite(const float (*x)[3], uint32_t m)
{
    for (uint32_t j = 0; j < m; j++)
        if (!isfinite(x[j][0]) || !isfinite(x[j][1]) || !isfinite(x[j][2]))
            return 0;
    return 1;
}

/* What the fit keeps in between: moments of its own, for the context's may be another allocator. */
static groom_status keep_moments(struct descent *d, int ended, struct groom_diag *diag)
{
    struct groom_fit *fit = d->fit;
    uint32_t n = paper_guides_moments(fit);
    if (!ended && fit->n_moments == 0) {
        float *moments = memory_array(fit->allocator, n, sizeof *moments);
        if (!moments)
            return groom_fail(diag, GROOM_ENOMEM, "no memory for the moments of %u guides", fit->n_guides);
        memory_release(fit->allocator, fit->moments, fit->n_moments, sizeof *fit->moments);
        fit->moments = moments;
        fit->n_moments = n;
    }
    if (ended) {
        memory_release(fit->allocator, fit->moments, fit->n_moments, sizeof *fit->moments);
        fit->moments = NULL;
        fit->n_moments = 0;
    } else {
        memcpy(fit->moments, d->state, n * sizeof *fit->moments);
    }
    return GROOM_OK;
}

groom_status paper_guides_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                               struct groom_diag *diag)
{
    uint32_t all = fit->options.stages.guides.iterations, left = all - fit->iteration;
    uint32_t count = STEP_STRANDS / fit->n > 1 ? STEP_STRANDS / fit->n : 1;
    double before = 0, after = 0;
    struct descent d;
    groom_status st;
    count = count < MOST_STEPS ? count : MOST_STEPS;
    count = count < left ? count : left;
    if ((st = descent_init(&d, fit, context, diag)) != GROOM_OK ||
        (fit->iteration == 0 && (st = loss_guides(fit, &before, context, diag)) != GROOM_OK) ||
        (st = descend_some(&d, count, context, diag)) != GROOM_OK ||
        (st = evaluate(&d, &after, context, diag)) != GROOM_OK ||
        (st = keep_moments(&d, count == left, diag)) != GROOM_OK)
        goto out;
    if (fit->iteration == 0)
        report_progress(&fit->report, "guides", "L_g", before, 0, context);
    fit->iteration += count;
    report_progress(&fit->report, "guides", "L_g", after, fit->iteration, context);
    for (uint32_t g = 0; g < fit->n_guides; g++) {
        size_t at = (size_t)g * fit->m;
        if (is_finite((const float (*)[3])(d.mean.guides + at), fit->m))
            memcpy(fit->groom->guides + at + 1, d.mean.guides + at + 1, (fit->m - 1) * sizeof *fit->groom->guides);
    }
    *ended = count == left;
out:
    descent_finish(&d, context);
    return st;
}
