/* An array that grows as it is filled, from the context's allocator. */
#ifndef BASE_GROWING_H
#define BASE_GROWING_H

#include <stddef.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/io.h"

struct growing {
    void *items;
    size_t count, capacity, item_size;
};

/* An empty array of items of this size; nothing is allocated yet. */
struct growing growing_of(size_t item_size);
void growing_finish(struct growing *array, const struct groom_allocator *allocator);

/* Room for n more items at the end, counted in and uninitialised; NULL where memory is out. */
void *growing_add(struct growing *array, size_t n, const struct groom_allocator *allocator);

#define GROWING_PADDING 16
/* All the bytes of a source, up to max_bytes, into an array of bytes. GROWING_PADDING zero bytes
 * follow them that are not counted, so that what scans text needs not look for the end.
 * returns  GROOM_OK, GROOM_ETOOBIG, GROOM_EIO, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status growing_read_all(struct growing *bytes, const struct groom_source *source,
                                               size_t max_bytes, const struct groom_allocator *allocator,
                                               struct groom_diag *diag);

#endif
