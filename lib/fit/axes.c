#include "fit/axes.h"

#include <math.h>
#include <string.h>

#include "base/progress.h"
#include "fit/frame.h"
#include "fit/matching.h"

#define FLOOR 0.03      /* of the statistics: coarse enough for parameters that were told along other axes */
#define AS_GOOD 0.75    /* of a misfit: what is more likely to begin with stays */
#define QUARTERS 24
#define AROUND 8        /* turns about where the hair falls to: its front is told less well than that */
#define HAIRS (2 * AROUND)
#define PI 3.14159265358979323846

/* --- what comes into question ------------------------------------------------------------------- */

static struct vec unit_of(int side)
{
    double sign = side % 2 ? -1 : 1;
    return (struct vec){side / 2 == 0 ? sign : 0, side / 2 == 1 ? sign : 0, side / 2 == 2 ? sign : 0};
}

/* The file's axes, then these turned by quarters. */
static void list_quarters(double frame[QUARTERS][3][3])
{
    int n = 0;
    for (int x = 0; x < 6; x++)
        for (int y = 0; y < 6; y++)
            if (x / 2 != y / 2)
                frame_of(unit_of(x), unit_of(y), frame[n++]);
}

/* The hair's own, up and down, turned about y. */
static void list_hairs(const double own[3][3], double frame[HAIRS][3][3])
{
    for (int k = 0; k < HAIRS; k++) {
        double angle = 2 * PI * k / AROUND, up = k < AROUND ? 1 : -1, turn[3][3];
        frame_of((struct vec){cos(angle), 0, -up * sin(angle)}, (struct vec){0, up, 0}, turn);
        frame_multiply((const double (*)[3])turn, own, frame[k]);
    }
}

/* --- the choice ------------------------------------------------------------------------------------ */

static groom_status misfit_along(struct matching *matching, const struct groom_fit *fit, const double frame[3][3], double *square,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    double residual[MOMENTS_COUNT];
    if (progress_cancelled(context))
        return groom_fail(diag, GROOM_ECANCELLED, "cancelled while the hair's axes were looked for");
    groom_status st = matching_residual(matching, fit->groom->operators, frame, residual, context, diag);
    *square = 0;
    for (int f = 0; st == GROOM_OK && f < MOMENTS_COUNT; f++)
        *square += residual[f] * residual[f];
    return st;
}

/* The least of the first n. */
static int best_of(const double *square, int n)
{
    int best = 0;
    for (int k = 1; k < n; k++)
        best = square[k] < square[best] ? k : best;
    return best;
}

groom_status axes_choose(struct groom_fit *fit, uint32_t n_pairs, const struct groom_context *context, struct groom_diag *diag)
{
    double frame[QUARTERS + HAIRS][3][3], square[QUARTERS + HAIRS];
    struct matching_wanted wanted = {.n_pairs = n_pairs, .floor = FLOOR};
    struct matching *matching = NULL;
    groom_status st = matching_create(fit, &wanted, context, &matching, diag);
    list_quarters(frame);
    list_hairs((const double (*)[3])fit->frame, frame + QUARTERS);
    for (int k = 0; st == GROOM_OK && k < QUARTERS + HAIRS; k++)
        st = misfit_along(matching, fit, (const double (*)[3])frame[k], &square[k], context, diag);
    if (st == GROOM_OK) {
        int best = best_of(square, QUARTERS + HAIRS), quarter = best_of(square, QUARTERS);
        best = AS_GOOD * square[quarter] <= square[best] ? quarter : best;
        best = AS_GOOD * square[0] <= square[best] ? 0 : best;
        memcpy(fit->frame, frame[best], sizeof fit->frame);
        fit->axes = best == 0 ? AXES_GIVEN : best < QUARTERS ? AXES_QUARTER : AXES_NEAR;
    }
    matching_destroy(matching);
    return st;
}

void axes_give(struct groom_fit *fit)
{
    memset(fit->groom->axes, 0, sizeof fit->groom->axes);
    if (fit->axes != AXES_UNKNOWN)
        frame_store((const double (*)[3])fit->frame, fit->groom->axes);
}
