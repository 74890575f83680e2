#include "fit/axes.h"

#include <math.h>
#include <string.h>

#include "base/progress.h"
#include "fit/matching.h"
#include "geometry/vec.h"

#define FLOOR 0.03      /* of the statistics: coarse enough for parameters that were told along other axes */
#define AS_GOOD 0.75    /* of a misfit: what is more likely to begin with stays */
#define QUARTERS 24
#define AROUND 8        /* turns about where the hair falls to: its front is told less well than that */
#define HAIRS (2 * AROUND)
#define PI 3.14159265358979323846

/* --- rotations --------------------------------------------------------------------------- */

static void set_rows(struct vec x, struct vec y, double rows[3][3])
{
    const struct vec row[3] = {x, y, vec_cross(x, y)};
    for (int c = 0; c < 3; c++) {
        rows[c][0] = row[c].x;
        rows[c][1] = row[c].y;
        rows[c][2] = row[c].z;
    }
}

/* out = a b */
static void multiply(const double a[3][3], const double b[3][3], double out[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            out[i][j] = 0;
            for (int k = 0; k < 3; k++)
                out[i][j] += a[i][k] * b[k][j];
        }
}

/* Rodrigues' formula, row by row: each is a unit vector turned back. */
void axes_rotation(const double vector[3], double turn[3][3])
{
    struct vec v = {vector[0], vector[1], vector[2]};
    double angle = vec_length(v), cosine = cos(angle), sine = sin(angle);
    struct vec axis = angle > 0 ? vec_scale(v, 1 / angle) : (struct vec){1, 0, 0};
    struct vec row[2];
    for (int c = 0; c < 2; c++) {
        struct vec unit = {c == 0, c == 1, 0};
        row[c] = vec_add(vec_add(vec_scale(unit, cosine), vec_scale(vec_cross(unit, axis), sine)),
                         vec_scale(axis, vec_dot(axis, unit) * (1 - cosine)));
    }
    set_rows(row[0], row[1], turn);
}

void axes_turned(const double frame[3][3], const float vector[3], double out[3][3])
{
    double turn[3][3], turned[3][3];
    if (vector[0] == 0 && vector[1] == 0 && vector[2] == 0) {
        memcpy(out, frame, sizeof turn);
        return;
    }
    axes_rotation((const double[3]){vector[0], vector[1], vector[2]}, turn);
    multiply((const double (*)[3])turn, frame, turned);
    set_rows(vec_unit((struct vec){turned[0][0], turned[0][1], turned[0][2]}),
             vec_unit((struct vec){turned[1][0], turned[1][1], turned[1][2]}), out);
}

void axes_store(const double frame[3][3], float axes[3][3])
{
    int space = 1;
    for (int k = 0; k < 9; k++)
        space &= frame[k / 3][k % 3] == (k / 3 == k % 3);
    for (int k = 0; k < 9; k++)
        axes[k / 3][k % 3] = space ? 0 : (float)frame[k / 3][k % 3];
}

void axes_give(struct groom_fit *fit)
{
    memset(fit->groom->axes, 0, sizeof fit->groom->axes);
    if (fit->axes != AXES_UNKNOWN)
        axes_store((const double (*)[3])fit->frame, fit->groom->axes);
}

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
                set_rows(unit_of(x), unit_of(y), frame[n++]);
}

/* The hair's own, up and down, turned about y. */
static void list_hairs(const double own[3][3], double frame[HAIRS][3][3])
{
    for (int k = 0; k < HAIRS; k++) {
        double angle = 2 * PI * k / AROUND, up = k < AROUND ? 1 : -1, turn[3][3];
        set_rows((struct vec){cos(angle), 0, -up * sin(angle)}, (struct vec){0, up, 0}, turn);
        multiply((const double (*)[3])turn, own, frame[k]);
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
