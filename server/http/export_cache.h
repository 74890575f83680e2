/* Exports that were lately made, as files without a name: a revision never changes, so neither does
 * what is evaluated from it. Without this, a download that is resumed in ranges would be evaluated anew
 * for each of them.
 *
 * threads   any */
#ifndef HTTP_EXPORT_CACHE_H
#define HTTP_EXPORT_CACHE_H

#include <stdbool.h>
#include <stdint.h>

struct export_cache;

/* max_bytes of disk in all; 0 keeps nothing. NULL: out of memory. */
struct export_cache *export_cache_create(uint64_t max_bytes);
void export_cache_destroy(struct export_cache *cache); /* takes NULL */

/* A descriptor of one's own on the file of this key, to be read by offset; false where there is none. */
bool export_cache_find(struct export_cache *cache, const char *key, int *fd, uint64_t *n_bytes);
/* Keep a file, whose descriptor stays the caller's; those that were not asked for longest make room. */
void export_cache_keep(struct export_cache *cache, const char *key, int fd, uint64_t n_bytes);

#endif
