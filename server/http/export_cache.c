#include "server/http/export_cache.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define N_SLOTS 32

struct slot {
    char key[160]; /* "" for an empty slot */
    int fd;
    uint64_t n_bytes, last_used;
};

struct export_cache {
    pthread_mutex_t lock;
    uint64_t max_bytes, n_bytes, clock;
    struct slot slots[N_SLOTS];
};

struct export_cache *export_cache_create(uint64_t max_bytes)
{
    struct export_cache *cache = calloc(1, sizeof *cache);
    if (!cache)
        return NULL;
    pthread_mutex_init(&cache->lock, NULL);
    cache->max_bytes = max_bytes;
    return cache;
}

static void empty(struct export_cache *cache, struct slot *slot)
{
    if (!slot->key[0])
        return;
    close(slot->fd);
    cache->n_bytes -= slot->n_bytes;
    *slot = (struct slot){.fd = -1};
}

void export_cache_destroy(struct export_cache *cache)
{
    if (!cache)
        return;
    for (size_t i = 0; i < N_SLOTS; i++)
        empty(cache, &cache->slots[i]);
    pthread_mutex_destroy(&cache->lock);
    free(cache);
}

static struct slot *slot_of(struct export_cache *cache, const char *key)
{
    for (size_t i = 0; i < N_SLOTS; i++)
        if (!strcmp(cache->slots[i].key, key))
            return &cache->slots[i];
    return NULL;
}

bool export_cache_find(struct export_cache *cache, const char *key, int *fd, uint64_t *n_bytes)
{
    bool found = false;
    pthread_mutex_lock(&cache->lock);
    struct slot *slot = slot_of(cache, key);
    if (slot && (*fd = fcntl(slot->fd, F_DUPFD_CLOEXEC, 3)) >= 0) {
        *n_bytes = slot->n_bytes;
        slot->last_used = ++cache->clock;
        found = true;
    }
    pthread_mutex_unlock(&cache->lock);
    return found;
}

/* An empty slot, or the one that was not used longest. */
static struct slot *oldest(struct export_cache *cache)
{
    struct slot *old = &cache->slots[0];
    for (size_t i = 1; i < N_SLOTS; i++)
        if (cache->slots[i].last_used < old->last_used)
            old = &cache->slots[i];
    return old;
}

/* Empty slots were last used at 0, so `oldest` finds them first: to make room it looks at used ones. */
static void make_room(struct export_cache *cache, uint64_t n_bytes)
{
    while (cache->n_bytes + n_bytes > cache->max_bytes) {
        struct slot *old = NULL;
        for (size_t i = 0; i < N_SLOTS; i++)
            if (cache->slots[i].key[0] && (!old || cache->slots[i].last_used < old->last_used))
                old = &cache->slots[i];
        if (!old)
            return;
        empty(cache, old);
    }
}

void export_cache_keep(struct export_cache *cache, const char *key, int fd, uint64_t n_bytes)
{
    int own = -1;
    if (n_bytes > cache->max_bytes || strlen(key) >= sizeof cache->slots[0].key || !key[0])
        return;
    pthread_mutex_lock(&cache->lock);
    if (!slot_of(cache, key) && (own = fcntl(fd, F_DUPFD_CLOEXEC, 3)) >= 0) {
        make_room(cache, n_bytes);
        struct slot *slot = oldest(cache);
        empty(cache, slot);
        snprintf(slot->key, sizeof slot->key, "%s", key);
        slot->fd = own;
        slot->n_bytes = n_bytes;
        slot->last_used = ++cache->clock;
        cache->n_bytes += n_bytes;
    }
    pthread_mutex_unlock(&cache->lock);
}
