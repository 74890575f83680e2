/* sparse Cholesky: solves what it factors, whatever the graph */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/cholesky.h"
#include "groom/random.h"
#include "tests/support/test.h"

enum { SIDE = 40, N = SIDE * SIDE };

struct matrix {
    uint32_t n, first[N + 1], column[8 * N];
    double value[8 * N];
};

/* The graph's Laplacian plus `shift`: neighbours(v, out) returns how many. */
static void build(struct matrix *m, uint32_t n, double shift, uint32_t (*neighbours)(uint32_t v, uint32_t n, uint32_t *out))
{
    uint32_t at = 0, around[N];
    m->n = n;
    for (uint32_t v = 0; v < n; v++) {
        uint32_t count = neighbours(v, n, around);
        m->first[v] = at;
        m->column[at] = v;
        m->value[at++] = count + shift;
        for (uint32_t i = 0; i < count; i++) {
            m->column[at] = around[i];
            m->value[at++] = -1;
        }
    }
    m->first[n] = at;
}

static uint32_t grid(uint32_t v, uint32_t n, uint32_t *out)
{
    uint32_t x = v % SIDE, y = v / SIDE, count = 0;
    if (x > 0) out[count++] = v - 1;
    if (x + 1 < SIDE) out[count++] = v + 1;
    if (y > 0) out[count++] = v - SIDE;
    if (v + SIDE < n) out[count++] = v + SIDE;
    return count;
}

static uint32_t star(uint32_t v, uint32_t n, uint32_t *out)
{
    uint32_t count = 0;
    if (v > 0) {
        out[0] = 0;
        return 1;
    }
    while (count + 1 < n) {
        out[count] = count + 1;
        count++;
    }
    return count;
}

static uint32_t alone(uint32_t v, uint32_t n, uint32_t *out) { return 0; }

static void check(const struct matrix *m)
{
    static double x[N], b[N];
    struct groom_random_key key = {5, 1};
    struct cholesky *factor = cholesky_create(m->n, m->first, m->column, &groom_default_allocator);
    ck_assert_ptr_nonnull(factor);
    for (int round = 0; round < 2; round++) { /* a factor serves again */
        ck_assert(cholesky_factor(factor, m->value));
        for (uint32_t i = 0; i < m->n; i++)
            x[i] = b[i] = groom_random_uniform(key, i, (uint32_t)round) - 0.5;
        cholesky_solve(factor, x);
        for (uint32_t i = 0; i < m->n; i++) {
            double sum = 0;
            for (uint32_t e = m->first[i]; e < m->first[i + 1]; e++)
                sum += m->value[e] * x[m->column[e]];
            ck_assert_double_eq_tol(sum, b[i], 1e-10);
        }
    }
    cholesky_destroy(factor);
}

static struct matrix matrix;

START_TEST(solves_grids_stars_and_points_alone)
{
    build(&matrix, N, 0.01, grid);
    check(&matrix);
    build(&matrix, 500, 0.5, star);
    check(&matrix);
    build(&matrix, 300, 2, alone);
    check(&matrix);
    build(&matrix, 1, 2, alone);
    check(&matrix);
}
END_TEST

START_TEST(what_is_not_positive_definite_is_told)
{
    build(&matrix, N, -0.5, grid);
    struct cholesky *factor = cholesky_create(N, matrix.first, matrix.column, &groom_default_allocator);
    ck_assert(!cholesky_factor(factor, matrix.value));
    build(&matrix, N, 0.1, grid);
    ck_assert(cholesky_factor(factor, matrix.value)); /* and does not spoil it for what is */
    cholesky_destroy(factor);
}
END_TEST

START_TEST(every_allocation_may_fail)
{
    build(&matrix, 200, 0.1, grid);
    for (size_t fail_at = 0;; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct cholesky *factor = cholesky_create(200, matrix.first, matrix.column, &allocator);
        int done = factor != NULL;
        cholesky_destroy(factor);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (done)
            break;
    }
}
END_TEST

TEST_SUITE("cholesky", solves_grids_stars_and_points_alone, what_is_not_positive_definite_is_told, every_allocation_may_fail)
