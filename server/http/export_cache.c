#include "server/http/export_cache.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/cache.h"

#define MOST_EXPORTS 32 /* each holds a descriptor */

struct export_cache {
    struct cache *cache;
    uint64_t max_bytes;
};

struct kept {
    struct cache_entry entry;
    int fd;
};

static void free_kept(struct cache_entry *entry)
{
    close(((struct kept *)entry)->fd);
    free(entry);
}

struct export_cache *export_cache_create(uint64_t max_bytes)
{
    struct export_cache *exports = calloc(1, sizeof *exports);
    if (exports && cache_create(max_bytes, MOST_EXPORTS, free_kept, &exports->cache) != GROOM_OK) {
        free(exports);
        return NULL;
    }
    if (exports)
        exports->max_bytes = max_bytes;
    return exports;
}

void export_cache_destroy(struct export_cache *exports)
{
    if (exports)
        cache_destroy(exports->cache);
    free(exports);
}

bool export_cache_find(struct export_cache *exports, const char *key, int *fd, uint64_t *n_bytes)
{
    struct kept *kept = (struct kept *)cache_get(exports->cache, key);
    if (!kept)
        return false;
    *fd = fcntl(kept->fd, F_DUPFD_CLOEXEC, 3);
    *n_bytes = kept->entry.n_bytes;
    cache_put_back(exports->cache, &kept->entry);
    return *fd >= 0;
}

void export_cache_keep(struct export_cache *exports, const char *key, int fd, uint64_t n_bytes)
{
    struct kept *kept;
    if (n_bytes > exports->max_bytes || strlen(key) >= sizeof kept->entry.key || !(kept = calloc(1, sizeof *kept)))
        return;
    strcpy(kept->entry.key, key);
    kept->entry.n_bytes = n_bytes;
    if ((kept->fd = fcntl(fd, F_DUPFD_CLOEXEC, 3)) < 0)
        free(kept);
    else
        cache_put_back(exports->cache, cache_keep(exports->cache, &kept->entry));
}
