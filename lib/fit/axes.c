#include "fit/axes.h"

#include <math.h>
#include <string.h>

#include "fit/frame.h"
#include "fit/trial.h"

#define FLOOR 0.03        /* of the statistics: coarse enough for parameters that were told along other axes */
#define FLOOR_FINE 0.01   /* for those that go along with the axes */
#define WORTH_TURNING 2.5 /* times the least misfit: axes that may still be the best once they are turned, */
#define WORTH_TRYING 1.6  /* or have parameters of their own, */
#define BEHIND 1.25       /* and those that go on being tried after the first steps */
#define APART 0.5         /* radians between axes that are taken for others */
#define MOST_TURNED 12    /* axes that are turned until they fit, */
#define MOST_TRIED 8      /* and that are tried with parameters of their own; */
#define FEW_TURNED 3      /* the same where the file's axes are as good as any so far: */
#define FEW_TRIED 3       /* others are to be better by far */
#define ROUNDS 2          /* by so many slopes; */
#define ROUNDS_ALONG 6    /* where parameters go along: of axes that are much alike, valleys are told apart near their ground; */
#define STEPS 2           /* and steps by each, */
#define LEAST_GAIN 1e-2   /* which are to gain this share of the misfit */
#define NOT_OF_THE_MODEL 2000 /* a misfit, where the model's own hair is less than 1 000 off even with rough parameters: such
                           * hair was made along no axes, and what fits it a little better here is no better anywhere else */
#define SMALL 200         /* strands, fewer of which do not tell axes apart that are much alike */
#define QUARTERS 24
#define AROUND 8         /* turns about one of the hair's own axes */
#define HAIRS (4 * AROUND)
#define PI 3.14159265358979323846

/* What is more likely to begin with stays where others are not much better: a misfit is taken by a factor, for what the model
 * cannot say of the hair, and more by a number, for what chance does, which decides where few strands tell. */
static const struct { double factor, more; } prior[] = {
    [AXES_UNKNOWN] = {1, 0}, [AXES_GIVEN] = {0.72, 0}, [AXES_QUARTER] = {0.93, 10}, [AXES_NEAR] = {1, 22},
             [AXES_FOUND] = {1, 22}};

static double weighed(double square, uint32_t axes) { return prior[axes].factor * square + prior[axes].more; }

static int is_small(const struct groom_fit *fit) { return fit->n < SMALL; }

struct candidate {
    double frame[3][3], square; /* of the misfit, weighed */
    uint32_t axes;
};

/* --- what comes into question ------------------------------------------------------------------- */

static struct vec unit_of(int side)
{
    double sign = side % 2 ? -1 : 1;
    return (struct vec){side / 2 == 0 ? sign : 0, side / 2 == 1 ? sign : 0, side / 2 == 2 ? sign : 0};
}

/* The file's axes, then these turned by quarters. */
static void list_quarters(struct candidate list[QUARTERS])
{
    uint32_t n = 0;
    for (int x = 0; x < 6; x++)
        for (int y = 0; y < 6; y++)
            if (x / 2 != y / 2) {
                list[n].axes = n == 0 ? AXES_GIVEN : AXES_QUARTER;
                frame_of(unit_of(x), unit_of(y), list[n++].frame);
            }
}

/* The hair's own, turned about what they tell best: where hair falls, up, y; where it stands out to all sides, the middle
 * of the head, which its roots lie alike on both sides of, across x. And the same upside down. */
static void list_hairs(const double own[3][3], struct candidate list[HAIRS])
{
    for (int k = 0; k < HAIRS; k++) {
        double angle = 2 * PI * (k / 4) / AROUND, flip = k % 2 ? -1 : 1, turn[3][3];
        if (k / 2 % 2)
            frame_of((struct vec){cos(angle), 0, -flip * sin(angle)}, (struct vec){0, flip, 0}, turn);
        else
            frame_of((struct vec){flip, 0, 0}, (struct vec){0, cos(angle), sin(angle)}, turn);
        frame_multiply((const double (*)[3])turn, own, list[k].frame);
        list[k].axes = AXES_NEAR;
    }
}

/* --- the choice ------------------------------------------------------------------------------------ */

static double angle_between(const double a[3][3], const double b[3][3])
{
    double trace = 0;
    for (int k = 0; k < 9; k++)
        trace += a[k / 3][k % 3] * b[k / 3][k % 3];
    return acos(fmin(fmax((trace - 1) / 2, -1), 1));
}

static int is_apart(const struct candidate *list, uint32_t n, const struct candidate *one)
{
    for (uint32_t i = 0; i < n; i++)
        if (list[i].axes == one->axes &&
            angle_between((const double (*)[3])list[i].frame, (const double (*)[3])one->frame) < APART)
            return 0;
    return 1;
}

/* The first of those that are the best. */
static uint32_t best_of(const struct candidate *list, uint32_t n)
{
    uint32_t best = 0;
    for (uint32_t k = 1; k < n; k++)
        best = list[k].square < list[best].square ? k : best;
    return best;
}

/* Adds the best of others that are apart from each other and from all in the list, at most this much off, until it is
 * `most` long. returns how long it is */
static uint32_t add_best(struct candidate *list, uint32_t n, uint32_t most, const struct candidate *other, uint32_t n_others,
                         double farthest)
{
    while (n < most) {
        uint32_t best = n_others;
        for (uint32_t k = 0; k < n_others; k++)
            if (other[k].square <= farthest && is_apart(list, n, &other[k]) && (best == n_others || other[k].square < other[best].square))
                best = k;
        if (best == n_others)
            break;
        list[n++] = other[best];
    }
    return n;
}

static groom_status weigh(const struct groom_fit *fit, struct matching *matching, struct candidate *list, uint32_t n,
                          const struct groom_context *context, struct groom_diag *diag)
{
    struct trial trial;
    groom_status st = GROOM_OK;
    trial_init(fit, 0, &trial);
    for (uint32_t k = 0; st == GROOM_OK && k < n; k++) {
        memcpy(trial.frame, list[k].frame, sizeof trial.frame);
        st = trial_misfit(matching, &trial, &list[k].square, context, diag);
        list[k].square = weighed(list[k].square, list[k].axes);
    }
    return st;
}

static groom_status refine(struct matching *matching, struct trial *trial, double *square, int *ended,
                           const struct groom_context *context, struct groom_diag *diag)
{
    return trial_refine(matching, trial, 0, STEPS, LEAST_GAIN, square, ended, context, diag);
}

/* Turned until they fit, with the parameters that there are. */
static groom_status turn(const struct groom_fit *fit, struct matching *matching, struct candidate *list, uint32_t n,
                         const struct groom_context *context, struct groom_diag *diag)
{
    struct trial trial;
    groom_status st = GROOM_OK;
    for (uint32_t k = 0; st == GROOM_OK && k < n; k++) {
        double square = 0;
        trial_init(fit, 0, &trial);
        trial.n_unknowns = 0;
        trial_let_turn(&trial);
        memcpy(trial.frame, list[k].frame, sizeof trial.frame);
        for (int round = 0, ended = 0; st == GROOM_OK && !ended && round < ROUNDS; round++)
            st = refine(matching, &trial, &square, &ended, context, diag);
        list[k].square = weighed(square, list[k].axes);
        frame_turned((const double (*)[3])trial.frame, trial.turn, list[k].frame);
    }
    return st;
}

/* What may be the best: of the file's axes and quarter turns, the best; what there was before; and of the hair's own, turned
 * until they fit, those that are apart.
 * found  [MOST_TRIED] out */
static groom_status look_around(const struct groom_fit *fit, struct matching *matching, struct candidate *found, uint32_t *n_found,
                                const struct groom_context *context, struct groom_diag *diag)
{
    struct candidate quarter[QUARTERS], hair[HAIRS], turned[MOST_TURNED], now = {.axes = fit->axes};
    uint32_t n = 0, n_turned;
    memcpy(now.frame, fit->frame, sizeof now.frame);
    list_quarters(quarter);
    list_hairs(fit->own, hair);
    groom_status st = weigh(fit, matching, quarter, QUARTERS, context, diag);
    if (st == GROOM_OK)
        st = weigh(fit, matching, hair, HAIRS, context, diag);
    if (st == GROOM_OK)
        st = weigh(fit, matching, &now, 1, context, diag);
    if (st != GROOM_OK)
        return st;
    if (fit->axes != AXES_UNKNOWN)
        found[n++] = now;
    n = add_best(found, n, n + 1, quarter, QUARTERS, INFINITY);
    double farthest = WORTH_TURNING * found[best_of(found, n)].square;
    const struct candidate *best = &found[best_of(found, n)];
    int given = is_small(fit) || (best->axes == AXES_GIVEN && best->square <= hair[best_of(hair, HAIRS)].square);
    n_turned = add_best(turned, 0, given ? FEW_TURNED : MOST_TURNED, hair, HAIRS, farthest);
    if ((st = turn(fit, matching, turned, n_turned, context, diag)) == GROOM_OK)
        *n_found = add_best(found, n, given ? FEW_TRIED : MOST_TRIED, turned, n_turned, INFINITY);
    return st;
}

/* Leaves out what is not worth trying. returns how many are left */
static uint32_t leave_worthy(struct candidate *found, uint32_t n)
{
    double farthest = WORTH_TRYING * found[best_of(found, n)].square;
    uint32_t left = 0;
    for (uint32_t k = 0; k < n; k++)
        if (found[k].square <= farthest)
            found[left++] = found[k];
    return left;
}

/* Parameters that go along with the axes, and axes that go along, where these are near the hair's. Who falls behind is left
 * where he is: those that lie wrong gain most by the first steps.
 * returns  the best in *best */
static groom_status try_along(const struct groom_fit *fit, struct matching *matching, struct candidate *found, uint32_t n,
                              struct trial *trial, uint32_t *best, const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = GROOM_OK;
    int ended[MOST_TRIED] = {0};
    for (uint32_t k = 0; k < n; k++) {
        trial_init(fit, 0, &trial[k]);
        if (found[k].axes == AXES_NEAR)
            trial_let_turn(&trial[k]);
        memcpy(trial[k].frame, found[k].frame, sizeof trial[k].frame);
        found[k].square = 0;
    }
    for (int round = 0; round < (is_small(fit) ? ROUNDS : ROUNDS_ALONG); round++) {
        double farthest = BEHIND * found[best_of(found, n)].square;
        for (uint32_t k = 0; st == GROOM_OK && k < n; k++) {
            double square = 0;
            if (ended[k] || found[k].square > farthest)
                continue;
            st = refine(matching, &trial[k], &square, &ended[k], context, diag);
            found[k].square = weighed(square, found[k].axes);
        }
    }
    *best = best_of(found, n);
    return st;
}

/* Into the fit, with what was tried along it, unless that is where it was. */
static void take(struct groom_fit *fit, const struct candidate *best, const struct trial *tried)
{
    int moved = memcmp(best->frame, fit->frame, sizeof fit->frame) != 0;
    fit->axes = best->axes;
    memcpy(fit->frame, best->frame, sizeof fit->frame);
    if (moved && tried)
        trial_keep(tried, fit);
}

static void take_given(struct groom_fit *fit)
{
    fit->axes = AXES_GIVEN;
    frame_of(unit_of(0), unit_of(2), fit->frame);
}

/* Few pairs tell when the file's axes are as good as any; which of others are needs all of them. */
static uint32_t pairs_for(const struct groom_fit *fit, uint32_t n_pairs, const struct candidate *likeliest)
{
    return likeliest->axes == AXES_GIVEN ? n_pairs : fit->options.stages.operators.pairs;
}

groom_status axes_choose(struct groom_fit *fit, uint32_t n_pairs, const struct groom_context *context, struct groom_diag *diag)
{
    struct candidate found[MOST_TRIED];
    struct trial trial[MOST_TRIED];
    struct matching_wanted wanted = {.n_pairs = n_pairs, .floor = FLOOR};
    struct matching *matching = NULL;
    uint32_t n = 0, best;
    groom_status st = matching_create(fit, &wanted, context, &matching, diag);
    if (st == GROOM_OK)
        st = look_around(fit, matching, found, &n, context, diag);
    matching_destroy(matching);
    if (st != GROOM_OK)
        return st;
    if (found[best_of(found, n)].square > NOT_OF_THE_MODEL) {
        take_given(fit);
        return GROOM_OK;
    }
    n = leave_worthy(found, n);
    best = best_of(found, n);
    if (n == 1 || fit->axes == AXES_UNKNOWN) { /* the first time, parameters are rough */
        take(fit, &found[best], NULL);
        return GROOM_OK;
    }
    wanted = (struct matching_wanted){.n_pairs = pairs_for(fit, n_pairs, &found[best]), .floor = FLOOR_FINE};
    matching = NULL;
    st = matching_create(fit, &wanted, context, &matching, diag);
    if (st == GROOM_OK)
        st = try_along(fit, matching, found, n, trial, &best, context, diag);
    matching_destroy(matching);
    if (st == GROOM_OK)
        take(fit, &found[best], &trial[best]);
    return st;
}

void axes_give(struct groom_fit *fit)
{
    memset(fit->groom->axes, 0, sizeof fit->groom->axes);
    if (fit->axes != AXES_UNKNOWN)
        frame_store((const double (*)[3])fit->frame, fit->groom->axes);
}
