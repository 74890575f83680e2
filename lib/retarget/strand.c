#include "retarget/strand.h"

#include <string.h>

#include "base/memory.h"

int strand_init(struct strand *s, uint32_t longest, const struct groom_allocator *allocator)
{
    s->w = memory_array(allocator, longest, sizeof *s->w);
    s->diagonal = memory_array(allocator, longest, sizeof *s->diagonal);
    s->force = memory_array(allocator, longest, sizeof *s->force);
    s->d = memory_array(allocator, longest, sizeof *s->d);
    s->pivot = memory_array(allocator, longest, sizeof *s->pivot);
    s->block = memory_array(allocator, longest, sizeof *s->block);
    s->middle = memory_array(allocator, longest, sizeof *s->middle);
    s->plane = memory_array(allocator, longest, sizeof *s->plane);
    s->state = memory_array(allocator, longest, 1);
    return s->w && s->diagonal && s->force && s->d && s->pivot && s->block && s->middle && s->plane && s->state;
}

void strand_finish(struct strand *s, uint32_t longest, const struct groom_allocator *allocator)
{
    memory_release(allocator, s->w, longest, sizeof *s->w);
    memory_release(allocator, s->diagonal, longest, sizeof *s->diagonal);
    memory_release(allocator, s->force, longest, sizeof *s->force);
    memory_release(allocator, s->d, longest, sizeof *s->d);
    memory_release(allocator, s->pivot, longest, sizeof *s->pivot);
    memory_release(allocator, s->block, longest, sizeof *s->block);
    memory_release(allocator, s->middle, longest, sizeof *s->middle);
    memory_release(allocator, s->plane, longest, sizeof *s->plane);
    memory_release(allocator, s->state, longest, 1);
}

/* Thomas's elimination, three right-hand sides at once. */
void strand_solve(const struct strand *s)
{
    uint32_t n = s->n;
    memset(s->d[0], 0, sizeof s->d[0]);
    for (uint32_t i = 1; i < n; i++) {
        double back = i > 1 ? s->w[i - 1] * s->pivot[i - 1] : 0;
        s->pivot[i] = 1 / (s->diagonal[i] - (i > 1 ? s->w[i - 1] * back : 0));
        for (int c = 0; c < 3; c++)
            s->d[i][c] = s->force[i][c] + back * s->d[i - 1][c];
    }
    for (uint32_t i = n - 1; i >= 1; i--)
        for (int c = 0; c < 3; c++)
            s->d[i][c] = (s->d[i][c] + (i + 1 < n ? s->w[i] * s->d[i + 1][c] : 0)) * s->pivot[i];
}

/* --- with half-spaces as equations ------------------------------------------------------------ */

/* An active particle moves by height normal plus what is left in the plane: its block is projected by
 * P = I - normal normal^T. The normal part of its row is filled up with the diagonal, so that every block of the
 * diagonal is diagonal[i] I, and what is known of the neighbours goes to the right-hand side. */

static int active(const struct strand *s, uint32_t i) { return i < s->n && s->state[i] == PLANE_ACTIVE; }

static double dot3(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void project(const struct strand *s, uint32_t i, double v[3])
{
    if (!active(s, i))
        return;
    const double *normal = s->plane[i].normal;
    double along = dot3(normal, v);
    for (int c = 0; c < 3; c++)
        v[c] -= along * normal[c];
}

/* The coupling of i to i + 1 without its sign and weight: P_i P_(i+1). */
static void coupling(const struct strand *s, uint32_t i, double m[9])
{
    for (int column = 0; column < 3; column++) {
        double v[3] = {column == 0, column == 1, column == 2};
        project(s, i + 1, v);
        project(s, i, v);
        for (int row = 0; row < 3; row++)
            m[3 * row + column] = v[row];
    }
}

static void invert(const double a[9], double out[9])
{
    double c0 = a[4] * a[8] - a[5] * a[7], c1 = a[5] * a[6] - a[3] * a[8], c2 = a[3] * a[7] - a[4] * a[6];
    double scale = 1 / (a[0] * c0 + a[1] * c1 + a[2] * c2);
    out[0] = c0 * scale, out[1] = (a[2] * a[7] - a[1] * a[8]) * scale, out[2] = (a[1] * a[5] - a[2] * a[4]) * scale;
    out[3] = c1 * scale, out[4] = (a[0] * a[8] - a[2] * a[6]) * scale, out[5] = (a[2] * a[3] - a[0] * a[5]) * scale;
    out[6] = c2 * scale, out[7] = (a[1] * a[6] - a[0] * a[7]) * scale, out[8] = (a[0] * a[4] - a[1] * a[3]) * scale;
}

static void times(const double a[9], const double b[9], double out[9])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

static void apply(const double a[9], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = dot3(a + 3 * i, v);
}

static void right_hand_side(const struct strand *s, uint32_t i, double out[3])
{
    memcpy(out, s->force[i], 3 * sizeof *out);
    for (int c = 0; c < 3; c++) {
        if (i > 1 && active(s, i - 1))
            out[c] += s->w[i - 1] * s->plane[i - 1].height * s->plane[i - 1].normal[c];
        if (active(s, i + 1))
            out[c] += s->w[i] * s->plane[i + 1].height * s->plane[i + 1].normal[c];
    }
    project(s, i, out);
}

void strand_solve_active(const struct strand *s)
{
    uint32_t n = s->n;
    memset(s->d[0], 0, sizeof s->d[0]);
    for (uint32_t i = 1; i < n; i++) {
        double diagonal[9] = {s->diagonal[i], 0, 0, 0, s->diagonal[i], 0, 0, 0, s->diagonal[i]}, inverse[9], c[9], right[3];
        right_hand_side(s, i, right);
        if (i > 1) { /* the row less C^T times the row before, where C = -w P P */
            double before[9], product[9], carried[3];
            coupling(s, i - 1, before);
            for (int row = 0; row < 3; row++)
                for (int column = 0; column < 3; column++)
                    c[3 * row + column] = before[3 * column + row];
            times(c, s->block[i - 1], product);
            apply(c, s->middle[i - 1], carried);
            for (int k = 0; k < 9; k++)
                diagonal[k] -= s->w[i - 1] * product[k];
            for (int k = 0; k < 3; k++)
                right[k] += s->w[i - 1] * carried[k];
        }
        invert(diagonal, inverse);
        apply(inverse, right, s->middle[i]);
        if (i + 1 < n) {
            coupling(s, i, c);
            times(inverse, c, s->block[i]);
            for (int k = 0; k < 9; k++)
                s->block[i][k] *= s->w[i];
        }
    }
    for (uint32_t i = n - 1; i >= 1; i--) {
        memcpy(s->d[i], s->middle[i], sizeof s->d[i]);
        if (i + 1 < n) {
            double carried[3], next[3];
            memcpy(next, s->d[i + 1], sizeof next);
            project(s, i + 1, next);
            apply(s->block[i], next, carried);
            for (int c = 0; c < 3; c++)
                s->d[i][c] += carried[c];
        }
        for (int c = 0; active(s, i) && c < 3; c++)
            s->d[i][c] += s->plane[i].height * s->plane[i].normal[c];
    }
}

double strand_push(const struct strand *s, uint32_t i)
{
    double row[3];
    for (int c = 0; c < 3; c++) {
        row[c] = s->diagonal[i] * s->d[i][c] - s->force[i][c];
        row[c] -= i > 1 ? s->w[i - 1] * s->d[i - 1][c] : 0;
        row[c] -= i + 1 < s->n ? s->w[i] * s->d[i + 1][c] : 0;
    }
    return dot3(s->plane[i].normal, row);
}
