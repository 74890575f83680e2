/* what the cache of exports keeps, and for how long */
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "server/http/export_cache.h"
#include "tests/support/test.h"

static void keep(struct export_cache *cache, const char *key, const char *text, uint64_t n_bytes)
{
    int fd = memfd_create("export", 0);
    ck_assert_int_eq(write(fd, text, strlen(text)), (int)strlen(text));
    export_cache_keep(cache, key, fd, n_bytes);
    close(fd);
}

static int has(struct export_cache *cache, const char *key, const char *text)
{
    int fd;
    uint64_t n_bytes;
    char found[32] = "";
    if (!export_cache_find(cache, key, &fd, &n_bytes))
        return 0;
    ck_assert_int_ge(pread(fd, found, sizeof found - 1, 0), 0);
    close(fd);
    ck_assert_str_eq(found, text);
    return 1;
}

START_TEST(what_was_kept_is_found)
{
    struct export_cache *cache = export_cache_create(100);
    keep(cache, "a", "one", 3);
    ck_assert(has(cache, "a", "one"));
    ck_assert(has(cache, "a", "one"));
    ck_assert(!has(cache, "b", ""));
    keep(cache, "a", "another", 7);
    ck_assert(has(cache, "a", "one"));
    export_cache_destroy(cache);
}
END_TEST

START_TEST(what_was_not_asked_for_longest_goes_first)
{
    struct export_cache *cache = export_cache_create(100);
    keep(cache, "a", "one", 40);
    keep(cache, "b", "two", 40);
    ck_assert(has(cache, "a", "one"));
    keep(cache, "c", "three", 40);
    ck_assert(has(cache, "a", "one"));
    ck_assert(!has(cache, "b", "two"));
    ck_assert(has(cache, "c", "three"));
    keep(cache, "d", "too large", 101);
    ck_assert(!has(cache, "d", ""));
    ck_assert(has(cache, "c", "three"));
    export_cache_destroy(cache);
}
END_TEST

START_TEST(many_small_ones_take_turns)
{
    struct export_cache *cache = export_cache_create(1000000);
    char key[16];
    for (int i = 0; i < 100; i++) {
        snprintf(key, sizeof key, "key %d", i);
        keep(cache, key, key, 1);
        ck_assert(has(cache, key, key));
    }
    ck_assert(!has(cache, "key 0", ""));
    ck_assert(has(cache, "key 99", "key 99"));
    export_cache_destroy(cache);
    export_cache_destroy(NULL);
}
END_TEST

TEST_SUITE("export_cache", what_was_kept_is_found, what_was_not_asked_for_longest_goes_first,
           many_small_ones_take_turns)
