#include "tests/support/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/context.h"

/* TESTS_NAMED=threads: those alone whose names have that word. */
static int is_wanted(const TTest *test)
{
    const char *word = getenv("TESTS_NAMED");
    return !word || strstr(test->name, word) != NULL;
}

int test_run(const char *suite_name, const TTest *const *tests, size_t n_tests)
{
    Suite *suite = suite_create(suite_name);
    TCase *cases = tcase_create(suite_name);
    tcase_set_timeout(cases, 300);
    for (size_t i = 0; i < n_tests; i++)
        if (is_wanted(tests[i]))
            tcase_add_test(cases, tests[i]);
    suite_add_tcase(suite, cases);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    int n_failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return n_failed ? EXIT_FAILURE : EXIT_SUCCESS;
}

const char *test_shared_data(const char *relative)
{
    static char path[4096];
    const char *shared = getenv("GROOM_SHARED");
    snprintf(path, sizeof path, "%s/data/%s", shared ? shared : "../shared", relative);
    if (access(path, R_OK) == 0)
        return path;
    printf("SKIPPED: %s is not there\n", path);
    return NULL;
}

static void *allocate(void *user, size_t bytes)
{
    struct test_failing_allocator *state = user;
    size_t n = __atomic_fetch_add(&state->n_allocations, 1, __ATOMIC_RELAXED);
    if (n == state->fail_at)
        return NULL;
    void *memory = groom_default_allocator.allocate(groom_default_allocator.user, bytes);
    if (memory)
        __atomic_fetch_add(&state->outstanding_bytes, bytes, __ATOMIC_RELAXED);
    return memory;
}

static void release(void *user, void *memory, size_t bytes)
{
    struct test_failing_allocator *state = user;
    if (!memory)
        return;
    __atomic_fetch_sub(&state->outstanding_bytes, bytes, __ATOMIC_RELAXED);
    groom_default_allocator.release(groom_default_allocator.user, memory, bytes);
}

void test_failing_allocator_init(struct test_failing_allocator *state, size_t fail_at,
                                 struct groom_allocator *allocator)
{
    *state = (struct test_failing_allocator){.fail_at = fail_at};
    *allocator = (struct groom_allocator){allocate, release, state};
}
