/* Stage `operators`: the operators' parameters (Chang et al. 2025, Section 5.5, reached another way).
 *
 * The paper descends its losses with Adam, 9 000 steps that alternate between shape, scale and clump;
 * they see some parameters too little and others not apart (loss_*.h and moments.h say which). Here all
 * parameters are found at once, so that none can take what belongs to another: on a sub-sample with
 * common random numbers, they are moved until some 180 statistics of the strands agree with the target's
 * (moments.h), by their covariance. First the frequencies look around for a better valley, then Levenberg and
 * Marquardt's steps go down it. The statistics begin as coarse ones, of which the large differences decide,
 * and are taken more finely from step to step; once they are fine, they tell along which axes the hair was made
 * (axes.h). The paper's losses, before and after, are the yardstick.
 *
 * method "paper" is the paper's own, as a reference (paper_operators.h). */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "fit/axes.h"
#include "fit/gather.h"
#include "fit/gradient_determinant.h"
#include "fit/loss_determinant.h"
#include "fit/operators.h"
#include "fit/paper_operators.h"
#include "fit/prune.h"
#include "fit/trial.h"
#include "groom/strands.h"
#include "quality/loss_wasserstein.h"

enum phase { BEFORE, SEARCH, REFINE, PRUNE, AFTER, ENDED };

#define STREAM_SLICES 0x66690011u  /* and the one after it */
#define STREAM_BATCHES 0x66690013u

#define UNIT 0.1               /* metres on an ordinary head: what the paper's weights were made for */
#define LOSS_STRANDS 1500      /* compared by the shape losses */
#define FEWEST_STRANDS 32      /* that statistics are taken of: the estimates of fewer stay */
#define LEAST_START 0.3        /* of a parameter's initial value, to begin with: below, it hardly shows */
#define LEAST_RANDOM 1.0       /* of one that scales a random number: the effect goes with its square */
#define FLOOR_FIRST 0.3        /* of the statistics in the first step, and how it falls to the last */
#define FLOOR_RATIO 0.5
#define FLOOR_LAST 0.01
#define SEARCH_SHARE 3         /* one pair in so many */
#define AXES_FLOOR 0.011       /* of the statistics in the step before which the hair's axes are chosen */
#define LAST_LOOK 4            /* steps before the last, in which they are chosen again */
#define CONVERGED 1e-3         /* share of the misfit that a step must gain, while guides are rough; */
#define CONVERGED_ROUGHLY 1e-2 /* before some operators go; */
#define CONVERGED_LAST 1e-5    /* when they are known: valleys are flat, and what stops on their sides remembers its way */
#define SETTLING 3             /* rounds of slopes at the minimum of the mean of draws, at most */
#define STEPS_AT_HAND 4        /* by the same slopes, near the minimum */

/* --- parameters --------------------------------------------------------------------------- */

static uint32_t count_unknowns(const struct groom_fit *fit)
{
    struct trial trial;
    trial_begin(fit, 0, &trial);
    return trial.n_unknowns;
}

/* --- search ------------------------------------------------------------------------------------ */

/* Other values of one parameter, in logarithms or fractions of a strand. */
static groom_status search_one(struct matching *matching, struct trial *trial, uint32_t index, double *square,
                               const struct groom_context *context, struct groom_diag *diag)
{
    static const double ratios[] = {-1.0, -0.5, 0.5, 1.0}, shifts[] = {-0.3, -0.15, 0.15, 0.3};
    const struct unknown *unknown = &trial->unknowns[index];
    double start = trial_read(unknown), best = start;
    for (int k = 0; k < 4; k++) {
        double other, x = start + (unknown->logarithmic ? ratios[k] : shifts[k]);
        trial_write(unknown, x);
        groom_status st = trial_misfit(matching, trial, &other, context, diag);
        if (st != GROOM_OK)
            return st;
        if (other < *square) {
            *square = other;
            best = x;
        }
    }
    trial_write(unknown, best);
    return GROOM_OK;
}

/* --- between rounds of stage randoms -------------------------------------------------------------- */

groom_status operators_refine(struct groom_fit *fit, uint32_t n_steps, int frequencies_known,
                              const struct groom_context *context, struct groom_diag *diag)
{
    struct matching *matching;
    struct trial here, before;
    double square;
    int ended = 0;
    trial_begin(fit, frequencies_known, &here);
    trial_init(fit, frequencies_known, &before);
    if (before.n_unknowns == 0 || fit->n < FEWEST_STRANDS)
        return GROOM_OK;
    /* where axes are not known, curls were found along others than those that are matched along */
    struct matching_wanted wanted = {fit->options.stages.operators.pairs, FLOOR_LAST, fit->axes != AXES_UNKNOWN, 1};
    groom_status st = matching_create(fit, &wanted, context, &matching, diag);
    if (st != GROOM_OK)
        return st;
    st = trial_average(matching, &here, context, diag);
    for (uint32_t k = 0, last = 0; st == GROOM_OK && !last && k < n_steps; k++) {
        last = ended || k + 1 == n_steps;
        if ((st = trial_refine(matching, &here, (int)last, STEPS_AT_HAND, CONVERGED_LAST, &square, &ended, context, diag)) == GROOM_OK)
            trial_keep(&here, fit);
    }
    if (st != GROOM_OK)
        trial_keep(&before, fit);
    axes_give(fit);
    matching_destroy(matching);
    return st;
}

/* --- the paper's losses ---------------------------------------------------------------------------- */

struct losses { double spectra, segments, shape, scale, clump; };

struct yardstick {
    uint32_t n_shape, n_batches, n_batch, n;  /* n: strands in all */
    uint32_t *strand;                         /* [n] n_shape, then the batches */
    float (*fitted)[3], (*target)[3];         /* [n * m] */
};

static groom_status choose_strands(const struct groom_fit *fit, struct yardstick *y, const struct groom_context *context,
                                   struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_random_key key = {fit->options.seed, STREAM_BATCHES};
    uint32_t *order = memory_array(allocator, fit->n, sizeof *order);
    if (!order)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to draw strands");
    groom_fair_order(fit->n, order);
    memcpy(y->strand, order, y->n_shape * sizeof *order);
    memory_release(allocator, order, fit->n, sizeof *order);
    return determinant_batches((const float (*)[2])fit->root_uv, fit->n, y->n_batches, y->n_batch, key, context,
                               y->strand + y->n_shape, diag);
}

static groom_status compare(const struct groom_fit *fit, const struct yardstick *y, struct losses *losses,
                            const struct groom_context *context, struct groom_diag *diag)
{
    const float (*a)[3] = (const float (*)[3])y->fitted, (*b)[3] = (const float (*)[3])y->target;
    size_t first = (size_t)y->n_shape * fit->m;
    struct groom_random_key key = {fit->options.seed, STREAM_SLICES};
    struct loss_shape shape;
    double unit = UNIT * fit->ordinary;
    groom_status st = loss_shape(a, b, y->n_shape, fit->m, unit, fit->options.stages.operators.lambda_e, key, context,
                                 &shape, diag);
    if (st != GROOM_OK)
        return st;
    losses->spectra = shape.spectra;
    losses->segments = shape.segments;
    losses->shape = shape.total;
    if ((st = loss_determinant(a + first, b + first, y->n_batches, y->n_batch, fit->m, unit,
                               fit->options.stages.operators.sigma_scale, determinant_scale_kernel, context,
                               &losses->scale, diag)) != GROOM_OK)
        return st;
    return loss_determinant(a + first, b + first, y->n_batches, y->n_batch, fit->m, unit,
                            fit->options.stages.operators.sigma_clump, determinant_clump_kernel, context,
                            &losses->clump, diag);
}

static groom_status measure_losses(const struct groom_fit *fit, struct losses *losses,
                                   const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct yardstick y = {.n_shape = fit->n < LOSS_STRANDS ? fit->n : LOSS_STRANDS,
                          .n_batches = fit->options.stages.operators.batches_late, .n_batch = gradient_determinant_batch(fit)};
    y.n = y.n_shape + y.n_batches * y.n_batch;
    size_t n_points = (size_t)y.n * fit->m;
    groom_status st = GROOM_ENOMEM;
    y.strand = memory_array(allocator, y.n, sizeof *y.strand);
    y.fitted = memory_array(allocator, n_points, sizeof *y.fitted);
    y.target = memory_array(allocator, n_points, sizeof *y.target);
    if (!y.strand || !y.fitted || !y.target)
        groom_fail(diag, st, "no memory to measure the losses of %u strands", y.n);
    else if ((st = choose_strands(fit, &y, context, diag)) == GROOM_OK &&
             (st = gather_strands(fit, y.strand, y.n, y.fitted, y.target, context, diag)) == GROOM_OK)
        st = compare(fit, &y, losses, context, diag);
    memory_release(allocator, y.strand, y.n, sizeof *y.strand);
    memory_release(allocator, y.fitted, n_points, sizeof *y.fitted);
    memory_release(allocator, y.target, n_points, sizeof *y.target);
    return st;
}

static groom_status report_losses(struct groom_fit *fit, uint64_t iteration, const struct groom_context *context,
                                  struct groom_diag *diag)
{
    struct losses losses;
    groom_status st = measure_losses(fit, &losses, context, diag);
    if (st != GROOM_OK)
        return st;
    report_progress(&fit->report, "operators", "shape", losses.shape, iteration, context);
    report_progress(&fit->report, "operators", "spectra", losses.spectra, iteration, context);
    report_progress(&fit->report, "operators", "segments", losses.segments, iteration, context);
    report_progress(&fit->report, "operators", "scale", losses.scale, iteration, context);
    report_progress(&fit->report, "operators", "clump", losses.clump, iteration, context);
    return GROOM_OK;
}

/* --- the stage ------------------------------------------------------------------------------------ */

/* The next unknown, from this one on, that is searched: a frequency. */
static uint32_t next_searched(const struct trial *trial, uint32_t from)
{
    while (from < trial->n_unknowns && !trial->unknowns[from].frequency)
        from++;
    return from;
}

static double floor_of(const struct groom_fit *fit)
{
    return fit->phase == SEARCH ? FLOOR_FIRST : fmax(FLOOR_FIRST * pow(FLOOR_RATIO, fit->iteration), FLOOR_LAST);
}

/* Tell where a frequency's valley is, and along which axes hair was made. */
static uint32_t some_pairs(const struct groom_fit *fit)
{
    return (fit->options.stages.operators.pairs + SEARCH_SHARE - 1) / SEARCH_SHARE;
}

static uint32_t pairs_of(const struct groom_fit *fit)
{
    return fit->phase == SEARCH ? some_pairs(fit) : fit->options.stages.operators.pairs;
}

static void begin(struct groom_fit *fit)
{
    struct trial trial;
    trial_begin(fit, 0, &trial);
    for (uint32_t k = 0; k < trial.n_unknowns; k++) {
        const struct unknown *unknown = &trial.unknowns[k];
        double least = fmax((unknown->random ? LEAST_RANDOM : LEAST_START) * unknown->initial, unknown->minimum);
        if (unknown->logarithmic && *unknown->value < least)
            trial_write(unknown, log(least));
    }
    trial_keep(&trial, fit);
    fit->iteration = next_searched(&trial, 0);
    fit->phase = fit->iteration < trial.n_unknowns ? SEARCH : REFINE;
    fit->iteration = fit->phase == SEARCH ? fit->iteration : 0;
}

static groom_status search_step(struct groom_fit *fit, struct matching *matching, const struct groom_context *context,
                                struct groom_diag *diag)
{
    struct trial trial;
    double square;
    groom_status st;
    trial_begin(fit, 0, &trial);
    if ((st = trial_misfit(matching, &trial, &square, context, diag)) != GROOM_OK ||
        (st = search_one(matching, &trial, fit->iteration, &square, context, diag)) != GROOM_OK)
        return st;
    trial_keep(&trial, fit);
    report_progress(&fit->report, "operators", "misfit", square, fit->iteration, context);
    if ((fit->iteration = next_searched(&trial, fit->iteration + 1)) == trial.n_unknowns) {
        fit->phase = REFINE;
        fit->iteration = 0;
    }
    return GROOM_OK;
}

static groom_status choose_axes(struct groom_fit *fit, int *moved, const struct groom_context *context, struct groom_diag *diag)
{
    double before[3][3];
    memcpy(before, fit->frame, sizeof before);
    groom_status st = axes_choose(fit, some_pairs(fit), context, diag);
    *moved = memcmp(before, fit->frame, sizeof before) != 0;
    fit->axes_looks += st == GROOM_OK;
    return st;
}

/* Once statistics are fine enough to tell, and once more before the end: what was told along wrong axes tells less. */
static groom_status axes_step(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    int moved, last_look = fit->iteration + LAST_LOOK == fit->options.stages.operators.refinements;
    if (fit->phase != REFINE || floor_of(fit) > AXES_FLOOR || fit->axes_looks >= (last_look ? 2 : 1))
        return GROOM_OK;
    return choose_axes(fit, &moved, context, diag);
}

/* From the minimum of one draw, as one side's slopes have it, to that of their mean, which is near. */
static groom_status settle(struct matching *matching, struct trial *here, double *square, const struct groom_context *context,
                           struct groom_diag *diag)
{
    int ended = 0;
    groom_status st = trial_average(matching, here, context, diag);
    for (int k = 0; st == GROOM_OK && !ended && k < SETTLING; k++)
        st = trial_refine(matching, here, 1, STEPS_AT_HAND, CONVERGED, square, &ended, context, diag);
    return st;
}

/* Unnamed operators are pruned when they have been refined; what is left is told in a step beyond the last. */
static int is_pruned(const struct groom_fit *fit) { return fit->iteration >= fit->options.stages.operators.refinements; }

static groom_status refine_step(struct groom_fit *fit, struct matching *matching, const struct groom_context *context,
                                struct groom_diag *diag)
{
    struct trial here;
    double square = 0;
    int converged = 0, moved = 0, last = fit->iteration + 1 >= fit->options.stages.operators.refinements;
    int to_prune = prune_tells(fit) && !is_pruned(fit);
    trial_begin(fit, 0, &here);
    uint32_t n_steps = floor_of(fit) <= FLOOR_LAST ? STEPS_AT_HAND : 1;
    groom_status st = GROOM_OK;
    if (!is_pruned(fit))
        st = trial_refine(matching, &here, 0, n_steps, to_prune ? CONVERGED_ROUGHLY : CONVERGED, &square, &converged, context, diag);
    converged &= floor_of(fit) <= FLOOR_LAST;
    if (st == GROOM_OK && (converged || last) && !to_prune)
        st = settle(matching, &here, &square, context, diag);
    if (st != GROOM_OK)
        return st;
    trial_keep(&here, fit);
    converged &= fit->axes != AXES_UNKNOWN;
    if (converged && !last && fit->axes_looks < 2 && (st = choose_axes(fit, &moved, context, diag)) != GROOM_OK)
        return st;
    report_progress(&fit->report, "operators", "misfit", square, count_unknowns(fit) + fit->iteration, context);
    fit->iteration++;
    if (last || (converged && !moved)) {
        fit->phase = to_prune ? PRUNE : AFTER;
        fit->iteration = 0;
    }
    return GROOM_OK;
}

static groom_status prune_step(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = prune_operators(fit, context, diag);
    if (st == GROOM_OK) {
        fit->phase = REFINE;
        fit->iteration = fit->options.stages.operators.refinements;
    }
    return st;
}

static groom_status try_step(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct matching *matching;
    groom_status st = axes_step(fit, context, diag);
    if (st != GROOM_OK)
        return st;
    struct matching_wanted wanted = {.n_pairs = pairs_of(fit), .floor = floor_of(fit)};
    if ((st = matching_create(fit, &wanted, context, &matching, diag)) != GROOM_OK)
        return st;
    st = fit->phase == SEARCH ? search_step(fit, matching, context, diag) : refine_step(fit, matching, context, diag);
    matching_destroy(matching);
    return st;
}

/* Nothing has changed where it fails. */
static groom_status match_step(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct trial before;
    uint32_t axes = fit->axes, looks = fit->axes_looks;
    trial_init(fit, 0, &before);
    groom_status st = fit->phase == PRUNE ? prune_step(fit, context, diag) : try_step(fit, context, diag);
    if (st != GROOM_OK) {
        trial_keep(&before, fit);
        fit->axes = axes;
        fit->axes_looks = looks;
    }
    axes_give(fit);
    return st;
}

static int is_paper(const struct groom_fit *fit) { return fit->options.stages.operators.method == GROOM_FIT_PAPER; }

static groom_status paper_step(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    int ended = 0;
    groom_status st = paper_operators_step(fit, &ended, context, diag);
    if (st == GROOM_OK && ended) {
        fit->phase = AFTER;
        fit->iteration = 0;
    }
    return st;
}

groom_status operators_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                            struct groom_diag *diag)
{
    groom_status st = GROOM_OK;
    switch ((enum phase)fit->phase) {
    case BEFORE:
        if (is_paper(fit) ? paper_operators_iterations(fit) == 0
                          : count_unknowns(fit) == 0 || fit->options.stages.operators.refinements == 0 ||
                                fit->n < FEWEST_STRANDS)
            fit->phase = ENDED;
        else if ((st = report_losses(fit, 0, context, diag)) == GROOM_OK && is_paper(fit))
            fit->phase = REFINE;
        else if (st == GROOM_OK)
            begin(fit);
        break;
    case SEARCH:
    case PRUNE:
    case REFINE: st = is_paper(fit) ? paper_step(fit, context, diag) : match_step(fit, context, diag); break;
    case AFTER:
        if ((st = report_losses(fit, is_paper(fit) ? fit->options.stages.operators.iterations : 1, context, diag)) == GROOM_OK)
            fit->phase = ENDED;
        break;
    case ENDED: break;
    }
    *ended = st == GROOM_OK && fit->phase == ENDED;
    return st;
}

double operators_fraction(const struct groom_fit *fit)
{
    uint32_t n = fit->groom ? count_unknowns(fit) : 0;
    double search = n ? (double)fit->iteration / n : 0;
    uint32_t steps = fit->groom && is_paper(fit) ? paper_operators_iterations(fit) : fit->options.stages.operators.refinements;
    double refined = (double)fit->iteration / fmax(steps, 1);
    switch ((enum phase)fit->phase) {
    case BEFORE: return 0;
    case SEARCH: return 0.05 + 0.3 * search;
    case REFINE: return 0.35 + 0.5 * fmin(refined, 1);
    case PRUNE: return 0.85;
    case AFTER: return 0.95;
    case ENDED: break;
    }
    return 1;
}

static int sound_paper(const struct groom_fit *fit)
{
    int under_way = fit->phase == REFINE && fit->iteration > 0;
    uint32_t limit = fit->phase == REFINE ? paper_operators_iterations(fit) : 1;
    return (fit->phase == BEFORE || fit->phase == REFINE || fit->phase == AFTER) && fit->iteration < limit &&
           fit->n_moments == (under_way ? paper_operators_moments(fit) : 0);
}

int operators_sound(const struct groom_fit *fit)
{
    if (fit->groom->n_operators > GROOM_FIT_MAX_OPERATORS)
        return 0;
    if (is_paper(fit))
        return sound_paper(fit);
    switch ((enum phase)fit->phase) {
    case BEFORE:
    case PRUNE:
    case AFTER: return 1;
    case SEARCH: return fit->iteration < count_unknowns(fit);
    case REFINE: return fit->iteration < fit->options.stages.operators.refinements + (uint32_t)(prune_tells(fit) != 0);
    case ENDED: break;
    }
    return 0;
}
