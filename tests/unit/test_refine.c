/* The least squares of the conversion: its gradient against finite differences in double precision, and its
 * Gauss-Newton matrix. The kernel's own functions are looked at, so its text is compiled here once more. */
#include "curvature/refine.h"

static refine_fit_function refine_fit_here;
#define REFINE_FIT refine_fit_here
#define REFINE_TRIG trig_rows_generic
#include "curvature/refine_kernel.h"

#include <stdlib.h>

#include "groom/random.h"
#include "tests/support/test.h"

enum { N = 5, VERTICES = 23 };

/* Elements of 0.5 to 1.5 cm that turn by some radians, vertices a millimetre off the curve. */
struct fixture {
    struct refine_strand strand;
    struct refine_space space;
    double length[N], q[N][3], fraction[VERTICES], kept[4 * N];
    uint32_t element[VERTICES];
    vec3 vertex[VERTICES], fitted[VERTICES];
    struct chain_state junction[N + 1], moved[N + 1];
    struct refine_element elements[N];
    _Alignas(32) double trig[6][N + VERTICES + 4]; /* rows of a multiple of 32 bytes */
};

static double normal(uint32_t what, uint32_t index)
{
    return groom_random_normal((struct groom_random_key){17, what}, index, 0);
}

static void place_vertices(struct fixture *f)
{
    for (uint32_t k = 0; k < VERTICES; k++) {
        double at = (double)k / (VERTICES - 1) * N;
        f->element[k] = k + 1 < VERTICES ? (uint32_t)at : N - 1;
        f->fraction[k] = at - f->element[k];
    }
}

static void fixture_init(struct fixture *f)
{
    double ignored;
    *f = (struct fixture){.strand = {.n_elements = N, .n_vertices = VERTICES, .root = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}}};
    f->strand.length = f->length, f->strand.q = f->q, f->strand.fraction = f->fraction;
    f->strand.element = f->element, f->strand.vertex = f->vertex, f->strand.fitted = f->fitted;
    f->space = (struct refine_space){.element = f->elements, .kept = f->kept, .junction = f->junction, .moved = f->moved,
                                     .trig = {f->trig[0], f->trig[1], f->trig[2], f->trig[3], f->trig[4], f->trig[5]}};
    for (uint32_t j = 0; j < N; j++) {
        f->length[j] = 0.01 + 0.0025 * (j % 3 - 1.0);
        for (uint32_t c = 0; c < 3; c++)
            f->q[j][c] = 150.0 * normal(c, j);
    }
    place_vertices(f);
    measure(&f->strand, &f->space, f->junction, 0, &ignored);
    for (uint32_t k = 1; k < VERTICES; k++)
        f->vertex[k] = vec_add(f->fitted[k], (vec3){1e-3 * normal(3, k), 1e-3 * normal(4, k), 1e-3 * normal(5, k)});
}

static double half_sum(struct fixture *f)
{
    double ignored;
    return 0.5 * measure(&f->strand, &f->space, f->junction, 0, &ignored);
}

/* Central differences of half the sum of squares by *x. */
static double difference(struct fixture *f, double *x, double step)
{
    double at = *x;
    *x = at + step;
    double above = half_sum(f);
    *x = at - step;
    double below = half_sum(f);
    *x = at;
    return (above - below) / (2.0 * step);
}

/* ... by a turn of the root frame about axis i. */
static double turn_difference(struct fixture *f, int i, double step)
{
    const mat3 root = f->strand.root;
    double turn[3] = {0.0}, sides[2];
    for (int side = 0; side < 2; side++) {
        turn[i] = side ? -step : step;
        f->strand.root = turned(root, turn);
        sides[side] = half_sum(f);
        f->strand.root = root;
    }
    return (sides[0] - sides[1]) / (2.0 * step);
}

static void check_near(const char *what, uint32_t element, double got, double want, double scale)
{
    ck_assert_msg(fabs(got - want) <= 1e-7 * scale, "%s of element %u: %.12g, finite differences say %.12g", what, element,
                  got, want);
}

/* Under a damping without end no element answers, and what remains of the step times its weight is the gradient. */
#define NO_ANSWER 1e30

START_TEST(the_gradient_agrees_with_finite_differences)
{
    struct fixture *f = calloc(1, sizeof *f);
    struct quadratic value;
    fixture_init(f);
    half_sum(f);
    fill_controls(&f->strand, &f->space);
    ck_assert_int_eq(eliminate(&f->strand, &f->space, NO_ANSWER, &value), 1);
    for (uint32_t j = 0; j < N; j++) {
        double l = f->length[j], weight = NO_ANSWER * l * l * l * l, scale = 0.0, got[4], want[4];
        for (int c = 0; c < 4; c++)
            got[c] = row_at(&f->elements[j].gain[c], 6) * (c < 3 ? weight : 10.0 * NO_ANSWER);
        for (int c = 0; c < 3; c++)
            want[c] = difference(f, &f->q[j][c], 1e-3), scale = fmax(scale, fabs(want[c]));
        want[3] = difference(f, &f->length[j], 1e-7);
        for (int c = 0; c < 3; c++)
            check_near("curvature", j, got[c], want[c], scale);
        check_near("length", j, got[3], want[3], fabs(want[3]) + 1e-4);
    }
    for (int i = 0; i < 3; i++)
        check_near("the root's turn", 0, row_at(&value.row[i], 6), turn_difference(f, i, 1e-6), 1e-4);
    free(f);
}
END_TEST

/* Where all vertices are met the Hessian is J^T J: the root's 3 x 3 block against second differences. */
START_TEST(the_matrix_of_the_root_is_the_hessian_where_nothing_is_missed)
{
    struct fixture *f = calloc(1, sizeof *f);
    struct quadratic value;
    const double step = 1e-4;
    fixture_init(f);
    memcpy(f->vertex, f->fitted, sizeof f->vertex);
    ck_assert_double_eq(half_sum(f), 0.0);
    fill_controls(&f->strand, &f->space);
    ck_assert_int_eq(eliminate(&f->strand, &f->space, NO_ANSWER, &value), 1);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k <= i; k++) {
            double turn[3] = {0.0}, got = value.row[i].low[k] * (i == k ? 1.0 : 2.0);
            const mat3 root = f->strand.root;
            double alone[2];
            for (int one = 0; one < 2; one++) { /* of axis i and k alone: the mixed term is what is left */
                double single[3] = {0.0};
                single[one ? k : i] = step;
                f->strand.root = turned(root, single);
                alone[one] = half_sum(f);
            }
            turn[i] = turn[k] = step;
            f->strand.root = turned(root, turn);
            double both = half_sum(f), want = (i == k ? 2.0 * alone[0] : 2.0 * (both - alone[0] - alone[1])) / (step * step);
            f->strand.root = root;
            ck_assert_msg(fabs(got - want) <= 1e-3 * fabs(value.row[i].low[i]), "%d %d: %.9g, not %.9g", i, k, got, want);
        }
    free(f);
}
END_TEST

/* The pull on the root's turn, without any answer. */
static double root_pull(struct fixture *f)
{
    struct quadratic value;
    half_sum(f);
    fill_controls(&f->strand, &f->space);
    ck_assert_int_eq(eliminate(&f->strand, &f->space, NO_ANSWER, &value), 1);
    return sqrt(row_at(&value.row[0], 6) * row_at(&value.row[0], 6) + row_at(&value.row[1], 6) * row_at(&value.row[1], 6) +
                row_at(&value.row[2], 6) * row_at(&value.row[2], 6));
}

START_TEST(the_fit_ends_where_the_gradient_is_nothing)
{
    struct fixture *f = calloc(1, sizeof *f);
    double worst, before, pull;
    fixture_init(f);
    before = half_sum(f);
    pull = root_pull(f);
    for (int round = 0; round < 40; round++) /* a call stops where another step is not worth while */
        refine_fit_here(&f->strand, &f->space, 12, 0.0, &worst);
    ck_assert_double_lt(half_sum(f), before);
    ck_assert_double_lt(root_pull(f), 1e-3 * pull);
    free(f);
}
END_TEST

TEST_SUITE("refine", the_gradient_agrees_with_finite_differences,
           the_matrix_of_the_root_is_the_hessian_where_nothing_is_missed, the_fit_ends_where_the_gradient_is_nothing)
