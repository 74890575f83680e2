/* What is dear to make is kept while it is asked for: by key, least recently used out first. What is in use
 * stays. Bounded in bytes and in number, so that a daemon that is left running with ever new small grooms
 * neither grows nor searches longer.
 *
 * threads  any */
#ifndef SERVER_CACHE_H
#define SERVER_CACHE_H

#include <stddef.h>
#include <stdint.h>

#include "groom/status.h"

#define CACHE_KEY_SIZE 160

/* The first member of what is kept. Its maker sets the key and its size with all that hangs on it. */
struct cache_entry {
    char key[CACHE_KEY_SIZE];
    size_t n_bytes;
    struct { /* the cache's own */
        unsigned n_users;
        uint64_t last_used;
        struct cache_entry *next;
    } in_cache;
};

struct cache;

/* release  frees an entry that has left the cache */
groom_status cache_create(size_t max_bytes, size_t max_entries, void (*release)(struct cache_entry *entry),
                          struct cache **cache);
void cache_destroy(struct cache *cache); /* with all entries, none of which is in use; takes NULL */

/* The entry of this key, to be put back; or NULL. */
struct cache_entry *cache_get(struct cache *cache, const char *key);
/* Hand over an entry; what to use in its place is returned, to be put back: itself, or what another thread
 * has kept under the same key meanwhile (then this one is freed). */
struct cache_entry *cache_keep(struct cache *cache, struct cache_entry *entry);
void cache_put_back(struct cache *cache, struct cache_entry *entry); /* takes NULL */
/* An entry in use has another size from now on. */
void cache_resize(struct cache *cache, struct cache_entry *entry, size_t n_bytes);

#endif
