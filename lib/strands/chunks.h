/* An array that grows without moving: elements in chunks of fixed size, or in one slab where the
 * final count is known and can be believed. Growing never needs old and new memory at once, which is
 * how the readers stay within twice the strands' own size. */
#ifndef STRANDS_CHUNKS_H
#define STRANDS_CHUNKS_H

#include <stddef.h>
#include <stdint.h>

#include "base/memory.h"

#define CHUNK_SHIFT    12
#define CHUNK_ELEMENTS ((uint64_t)1 << CHUNK_SHIFT)

struct chunks {
    const struct groom_allocator *allocator;
    size_t element_size;
    uint64_t n;      /* elements in use */
    uint64_t n_room; /* elements there is memory for */
    unsigned char **table;
    size_t n_chunks, table_capacity;
    unsigned char *slab;  /* the first chunks, in one piece, or NULL */
    uint64_t n_slab;      /* elements of the slab */
    size_t n_slab_chunks; /* table entries that point into it */
};

void chunks_init(struct chunks *chunks, const struct groom_allocator *allocator, size_t element_size);
void chunks_finish(struct chunks *chunks); /* takes a zeroed struct */

/* Memory for exactly n elements in one piece; the list must be new. 0 where memory is out. */
int chunks_reserve(struct chunks *chunks, uint64_t n);
/* Room for at least one more element; 0 where memory is out. */
int chunks_grow(struct chunks *chunks);

static inline void *chunks_at(const struct chunks *chunks, uint64_t i)
{
    return chunks->table[i >> CHUNK_SHIFT] + (i & (CHUNK_ELEMENTS - 1)) * chunks->element_size;
}

/* How many of the elements from i on, up to n, lie in one piece. */
static inline uint64_t chunks_span(uint64_t i, uint64_t n)
{
    uint64_t in_chunk = CHUNK_ELEMENTS - (i & (CHUNK_ELEMENTS - 1));
    return n < in_chunk ? n : in_chunk;
}

/* One more element, uninitialised; NULL where memory is out. */
static inline void *chunks_push(struct chunks *chunks)
{
    if (chunks->n == chunks->n_room && !chunks_grow(chunks))
        return NULL;
    return chunks_at(chunks, chunks->n++);
}

/* The first n elements as one array that memory_release(allocator, array, n, element_size) takes;
 * the list is empty afterwards. NULL where memory is out (the list stays). */
void *chunks_take(struct chunks *chunks);

#endif
