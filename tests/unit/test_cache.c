/* what is kept while it is asked for, and what makes room */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/cache.h"
#include "tests/support/test.h"

struct thing {
    struct cache_entry entry;
    int value;
};

static _Atomic int n_freed;

static void free_thing(struct cache_entry *entry)
{
    n_freed++;
    free(entry);
}

static struct cache *of(size_t max_bytes, size_t max_entries)
{
    struct cache *cache;
    ck_assert_int_eq(cache_create(max_bytes, max_entries, free_thing, &cache), GROOM_OK);
    n_freed = 0;
    return cache;
}

static struct thing *use(struct cache *cache, const char *key, size_t n_bytes)
{
    struct thing *made = calloc(1, sizeof *made);
    ck_assert_ptr_nonnull(made);
    strcpy(made->entry.key, key);
    made->entry.n_bytes = n_bytes;
    made->value = atoi(key);
    return (struct thing *)cache_keep(cache, &made->entry);
}

static void keep(struct cache *cache, const char *key, size_t n_bytes) { cache_put_back(cache, &use(cache, key, n_bytes)->entry); }

static int has(struct cache *cache, const char *key)
{
    struct cache_entry *entry = cache_get(cache, key);
    cache_put_back(cache, entry);
    return entry != NULL;
}

START_TEST(bytes_are_bounded)
{
    struct cache *cache = of(100, 1000);
    keep(cache, "1", 40);
    keep(cache, "2", 40);
    ck_assert(has(cache, "1"));
    keep(cache, "3", 40);
    ck_assert(has(cache, "1") && !has(cache, "2") && has(cache, "3"));
    struct thing *thing = use(cache, "3", 1);
    ck_assert_uint_eq(thing->entry.n_bytes, 40);
    cache_resize(cache, &thing->entry, 90);
    ck_assert(!has(cache, "1") && has(cache, "3"));
    cache_put_back(cache, &thing->entry);
    cache_destroy(cache);
    ck_assert_int_eq(n_freed, 4);
}
END_TEST

START_TEST(so_is_their_number)
{
    char key[16];
    struct cache *cache = of(1000, 10);
    for (int i = 0; i < 100; i++) {
        snprintf(key, sizeof key, "%d", i);
        keep(cache, key, 1);
    }
    ck_assert_int_eq(n_freed, 90);
    ck_assert(!has(cache, "89") && has(cache, "90") && has(cache, "99"));
    cache_destroy(cache);
}
END_TEST

START_TEST(what_is_in_use_stays)
{
    struct cache *cache = of(100, 1);
    struct thing *first = use(cache, "1", 99), *second = use(cache, "2", 99);
    ck_assert(has(cache, "1") && has(cache, "2"));
    cache_put_back(cache, &first->entry);
    ck_assert(!has(cache, "1") && has(cache, "2"));
    keep(cache, "4", 500); /* larger than all there is room for */
    ck_assert(!has(cache, "4") && has(cache, "2"));
    cache_put_back(cache, &second->entry);
    cache_destroy(cache);
    cache_destroy(NULL);
}
END_TEST

static void *keep_and_read(void *context)
{
    struct cache *cache = context;
    char key[16];
    for (int i = 0; i < 20000; i++) {
        snprintf(key, sizeof key, "%d", i * 7 % 13);
        struct thing *thing = (struct thing *)cache_get(cache, key);
        if (!thing)
            thing = use(cache, key, 1);
        if (thing->value != i * 7 % 13)
            return thing; /* another one */
        cache_put_back(cache, &thing->entry);
    }
    return NULL;
}

START_TEST(threads_share_it)
{
    struct cache *cache = of(1000, 5);
    pthread_t threads[4];
    void *complaint;
    for (int i = 0; i < 4; i++)
        ck_assert_int_eq(pthread_create(&threads[i], NULL, keep_and_read, cache), 0);
    for (int i = 0; i < 4; i++) {
        pthread_join(threads[i], &complaint);
        ck_assert_ptr_null(complaint);
    }
    cache_destroy(cache);
}
END_TEST

TEST_SUITE("cache", bytes_are_bounded, so_is_their_number, what_is_in_use_stays, threads_share_it)
