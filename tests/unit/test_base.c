/* status, pool, random numbers */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "base/blas.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "groom/random.h"
#include "tests/support/test.h"

START_TEST(every_status_has_a_name_and_a_message)
{
    for (int status = GROOM_OK; status <= GROOM_EINTERNAL; status++) {
        ck_assert(strlen(groom_status_name((groom_status)status)) > 0);
        ck_assert(strlen(groom_status_message((groom_status)status)) > 0);
        ck_assert_int_ge(groom_status_http((groom_status)status), 200);
    }
    ck_assert_str_eq(groom_status_name((groom_status)9999), "internal");
}
END_TEST

START_TEST(fail_fills_the_diag_and_returns_the_status)
{
    struct groom_diag diag = {0};
    ck_status(groom_fail_field(&diag, GROOM_EINVAL, "/a/b", "k is %d", 7), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/a/b");
    ck_assert_str_eq(diag.detail, "k is 7");
    ck_assert_int_eq(diag.byte_offset, -1);
    ck_status(groom_fail(NULL, GROOM_EIO, "ignored"), GROOM_EIO);
}
END_TEST

START_TEST(array_refuses_what_overflows)
{
    ck_assert_ptr_null(memory_array(memory_allocator(NULL), SIZE_MAX / 2, 4));
}
END_TEST

static void count_piece(void *user, uint32_t piece, uint32_t thread)
{
    (void)thread;
    ((uint32_t *)user)[piece]++;
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) /* which reserve all the address space there is */
static void limit_memory(rlim_t bytes)
{
    struct rlimit limit = {bytes, RLIM_INFINITY};
    ck_assert_int_eq(setrlimit(RLIMIT_AS, &limit), 0);
}

/* OpenBLAS itself would not say so: it looks for memory until it is killed. */
START_TEST(matrix_products_without_memory_are_refused)
{
    struct groom_pool *pool;
    ck_ok(groom_pool_create(2, &pool));
    struct groom_context context = {.pool = pool};
    limit_memory(256u << 20);
    ck_status(blas_prepare(&context, NULL), GROOM_ENOMEM);
    limit_memory(RLIM_INFINITY);
    ck_ok(blas_prepare(&context, NULL));
    limit_memory(256u << 20); /* what it has taken it keeps */
    ck_ok(blas_prepare(&context, NULL));
    limit_memory(RLIM_INFINITY);
    groom_pool_destroy(pool);
}
END_TEST
#endif

START_TEST(parallel_for_visits_each_piece_once)
{
    for (uint32_t n_threads = 1; n_threads <= 4; n_threads++) {
        struct groom_pool *pool;
        ck_ok(groom_pool_create(n_threads, &pool));
        struct groom_context context = {.pool = pool};
        for (int round = 0; round < 200; round++) {
            uint32_t visits[37] = {0};
            parallel_for(&context, 37, count_piece, visits);
            for (int i = 0; i < 37; i++)
                ck_assert_uint_eq(visits[i], 1);
        }
        groom_pool_destroy(pool);
    }
}
END_TEST

struct nested {
    const struct groom_context *context;
    uint32_t visits[8][8];
};

static void outer_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct nested *nested = user;
    (void)thread;
    parallel_for(nested->context, 8, count_piece, nested->visits[piece]);
}

START_TEST(a_loop_inside_a_loop_runs_in_its_thread)
{
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    struct nested nested = {.context = &context};
    parallel_for(&context, 8, outer_piece, &nested);
    for (int i = 0; i < 64; i++)
        ck_assert_uint_eq(nested.visits[i / 8][i % 8], 1);
    groom_pool_destroy(pool);
}
END_TEST

START_TEST(random_block_depends_on_each_of_its_inputs)
{
    struct groom_random_key key = {42, 1};
    uint32_t a[4], b[4];
    groom_random_block(key, 5, 0, a);
    groom_random_block(key, 5, 0, b);
    ck_assert_mem_eq(a, b, sizeof a);
    groom_random_block(key, 6, 0, b);
    ck_assert_mem_ne(a, b, sizeof a);
    groom_random_block(key, 5, 1, b);
    ck_assert_mem_ne(a, b, sizeof a);
    key.stream = 2;
    groom_random_block(key, 5, 0, b);
    ck_assert_mem_ne(a, b, sizeof a);
    key = (struct groom_random_key){43, 1};
    groom_random_block(key, 5, 0, b);
    ck_assert_mem_ne(a, b, sizeof a);
}
END_TEST

START_TEST(random_numbers_have_their_moments)
{
    struct groom_random_key key = {7, 3};
    double uniform = 0, truncated_square = 0, normal_square = 0;
    const int n = 100000;
    for (int i = 0; i < n; i++) {
        float u = groom_random_uniform(key, (uint32_t)i, 0);
        float t = groom_random_truncated_normal(key, (uint32_t)i, 1);
        double g = groom_random_normal(key, (uint32_t)i, 2);
        ck_assert(u > 0.0f && u < 1.0f);
        ck_assert(t >= -1.0f && t <= 1.0f);
        uniform += u;
        truncated_square += (double)t * t;
        normal_square += g * g;
    }
    ck_assert_double_eq_tol(uniform / n, 0.5, 0.005);
    /* variance of N(0,1) truncated to [-1,1]: 1 - 2 phi(1) / (2 Phi(1) - 1) = 0.29113 */
    ck_assert_double_eq_tol(truncated_square / n, 0.29113, 0.005);
    ck_assert_double_eq_tol(normal_square / n, 1.0, 0.02);
}
END_TEST

START_TEST(numbers_are_sorted_and_the_middle_one_is_the_median)
{
    float floats[5] = {3, -1, 2, 2, -7};
    double doubles[4] = {4, 1, 3, 2};
    uint32_t indices[3] = {UINT32_MAX, 0, 7};
    sort_floats(floats, 5);
    sort_doubles(doubles, 4);
    sort_indices(indices, 3);
    for (int k = 0; k < 4; k++)
        ck_assert_float_le(floats[k], floats[k + 1]);
    for (int k = 0; k < 4; k++)
        ck_assert_double_eq(doubles[k], k + 1);
    ck_assert(indices[0] == 0 && indices[1] == 7 && indices[2] == UINT32_MAX);
    ck_assert_float_eq(median_of_floats((float[]){9, 1, 5}, 3), 5);
    ck_assert_double_eq(median_of_doubles((double[]){4, 1, 3, 2}, 4), 3); /* the upper one of two */
    ck_assert_float_eq(median_of_floats(floats, 0), 0);
    ck_assert_double_eq(median_of_doubles(doubles, 0), 0);
}
END_TEST

TEST_SUITE("base", every_status_has_a_name_and_a_message, fail_fills_the_diag_and_returns_the_status,
           array_refuses_what_overflows,
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
           matrix_products_without_memory_are_refused,
#endif
           parallel_for_visits_each_piece_once,
           a_loop_inside_a_loop_runs_in_its_thread, random_block_depends_on_each_of_its_inputs,
           random_numbers_have_their_moments, numbers_are_sorted_and_the_middle_one_is_the_median)
