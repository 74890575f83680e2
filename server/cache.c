#include "server/cache.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

struct cache {
    pthread_mutex_t lock;
    struct cache_entry *first;
    size_t n_bytes, max_bytes, n_entries, max_entries;
    uint64_t clock;
    void (*release)(struct cache_entry *entry);
};

groom_status cache_create(size_t max_bytes, size_t max_entries, void (*release)(struct cache_entry *entry),
                          struct cache **out)
{
    struct cache *cache = calloc(1, sizeof *cache);
    if (!cache)
        return GROOM_ENOMEM;
    *cache = (struct cache){.max_bytes = max_bytes, .max_entries = max_entries, .release = release};
    pthread_mutex_init(&cache->lock, NULL);
    *out = cache;
    return GROOM_OK;
}

void cache_destroy(struct cache *cache)
{
    if (!cache)
        return;
    for (struct cache_entry *entry = cache->first, *next; entry; entry = next) {
        next = entry->in_cache.next;
        cache->release(entry);
    }
    pthread_mutex_destroy(&cache->lock);
    free(cache);
}

/* --- with the lock held ------------------------------------------------------------------ */

static struct cache_entry *use(struct cache *cache, const char *key)
{
    struct cache_entry *entry = cache->first;
    while (entry && strcmp(entry->key, key) != 0)
        entry = entry->in_cache.next;
    if (entry) {
        entry->in_cache.n_users++;
        entry->in_cache.last_used = ++cache->clock;
    }
    return entry;
}

/* The link to the entry that was not used for longest and is not in use, or NULL. */
static struct cache_entry **oldest(struct cache *cache)
{
    struct cache_entry **found = NULL;
    for (struct cache_entry **link = &cache->first; *link; link = &(*link)->in_cache.next)
        if ((*link)->in_cache.n_users == 0 && (!found || (*link)->in_cache.last_used < (*found)->in_cache.last_used))
            found = link;
    return found;
}

/* Take out what is too much: a list for the caller to free without the lock. */
static struct cache_entry *make_room(struct cache *cache)
{
    struct cache_entry *out = NULL, **link;
    while ((cache->n_bytes > cache->max_bytes || cache->n_entries > cache->max_entries) && (link = oldest(cache)) != NULL) {
        struct cache_entry *entry = *link;
        *link = entry->in_cache.next;
        cache->n_bytes -= entry->n_bytes;
        cache->n_entries--;
        entry->in_cache.next = out;
        out = entry;
    }
    return out;
}

/* --- without it ---------------------------------------------------------------------------- */

static void unlock_and_free(struct cache *cache, struct cache_entry *out)
{
    pthread_mutex_unlock(&cache->lock);
    for (struct cache_entry *next; out; out = next) {
        next = out->in_cache.next;
        cache->release(out);
    }
}

struct cache_entry *cache_get(struct cache *cache, const char *key)
{
    pthread_mutex_lock(&cache->lock);
    struct cache_entry *entry = use(cache, key);
    pthread_mutex_unlock(&cache->lock);
    return entry;
}

struct cache_entry *cache_keep(struct cache *cache, struct cache_entry *entry)
{
    pthread_mutex_lock(&cache->lock);
    struct cache_entry *kept = use(cache, entry->key), *out = entry;
    if (kept)
        entry->in_cache.next = NULL;
    else {
        entry->in_cache.next = cache->first;
        cache->first = entry;
        cache->n_bytes += entry->n_bytes;
        cache->n_entries++;
        kept = use(cache, entry->key);
        out = make_room(cache);
    }
    unlock_and_free(cache, out);
    return kept;
}

void cache_put_back(struct cache *cache, struct cache_entry *entry)
{
    if (!entry)
        return;
    pthread_mutex_lock(&cache->lock);
    entry->in_cache.n_users--;
    unlock_and_free(cache, make_room(cache));
}

void cache_resize(struct cache *cache, struct cache_entry *entry, size_t n_bytes)
{
    pthread_mutex_lock(&cache->lock);
    cache->n_bytes += n_bytes - entry->n_bytes;
    entry->n_bytes = n_bytes;
    unlock_and_free(cache, make_room(cache));
}
