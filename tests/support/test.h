/* Shared by the unit tests: one suite a file, each test a function that Check runs in a process
 * of its own, so that a crash is one failed test.
 *
 *     START_TEST(resample_keeps_endpoints) { ... } END_TEST
 *     TEST_SUITE("strands", resample_keeps_endpoints, ...)
 */
#ifndef SUPPORT_TEST_H
#define SUPPORT_TEST_H

#include <check.h>
#include <stddef.h>

#include "groom/diag.h"

int test_run(const char *suite, const TTest *const *tests, size_t n_tests);

#define TEST_SUITE(name, ...)                                                                      \
    int main(void)                                                                                 \
    {                                                                                              \
        const TTest *const tests[] = {__VA_ARGS__};                                                \
        return test_run(name, tests, sizeof tests / sizeof tests[0]);                              \
    }

/* Fails with the error's own name and detail. */
#define ck_ok(call)                                                                                \
    do {                                                                                           \
        groom_status ck_status_ = (call);                                                          \
        ck_assert_msg(ck_status_ == GROOM_OK, "%s: %s", #call, groom_status_name(ck_status_));     \
    } while (0)
#define ck_status(call, expected)                                                                  \
    do {                                                                                           \
        groom_status ck_status_ = (call);                                                          \
        ck_assert_msg(ck_status_ == (expected), "%s: %s, expected %s", #call,                      \
                      groom_status_name(ck_status_), groom_status_name(expected));                 \
    } while (0)

/* The path of a file in ../shared/data, or NULL (and a line that says what is skipped) where that
 * folder is missing: it holds real captures that are not the project's to copy. GROOM_SHARED
 * names another place for it. */
const char *test_shared_data(const char *relative);

/* An allocator whose nth allocation (from 0) fails; counts what is outstanding. */
struct test_failing_allocator {
    size_t fail_at, n_allocations;
    size_t outstanding_bytes;
};
struct groom_allocator;
void test_failing_allocator_init(struct test_failing_allocator *state, size_t fail_at,
                                 struct groom_allocator *allocator);

#endif
