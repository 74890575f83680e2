/* How the library's own files get memory: a checked array from the context's allocator. */
#ifndef BASE_MEMORY_H
#define BASE_MEMORY_H

#include <stddef.h>

#include "groom/context.h"

/* The allocator of a context that may be NULL or have none. */
const struct groom_allocator *memory_allocator(const struct groom_context *context);

/* count elements of `size` bytes, aligned to 64; NULL where memory is out or count * size overflows.
 * A count of 0 gives one element, so that NULL always means failure. */
void *memory_array(const struct groom_allocator *allocator, size_t count, size_t size);
void *memory_array_zero(const struct groom_allocator *allocator, size_t count, size_t size);
/* Give back what memory_array(allocator, count, size) gave; takes NULL. */
void memory_release(const struct groom_allocator *allocator, void *memory, size_t count, size_t size);

#endif
