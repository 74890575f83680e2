#include "strands/chunks.h"

#include <string.h>

void chunks_init(struct chunks *chunks, const struct groom_allocator *allocator, size_t element_size)
{
    *chunks = (struct chunks){.allocator = allocator, .element_size = element_size};
}

void chunks_finish(struct chunks *chunks)
{
    if (!chunks->allocator)
        return;
    for (size_t i = chunks->n_slab_chunks; i < chunks->n_chunks; i++)
        memory_release(chunks->allocator, chunks->table[i], CHUNK_ELEMENTS, chunks->element_size);
    memory_release(chunks->allocator, chunks->slab, chunks->n_slab, chunks->element_size);
    memory_release(chunks->allocator, chunks->table, chunks->table_capacity, sizeof *chunks->table);
    chunks_init(chunks, chunks->allocator, chunks->element_size);
}

static int table_reserve(struct chunks *chunks, size_t n)
{
    if (n <= chunks->table_capacity)
        return 1;
    size_t capacity = n > 2 * chunks->table_capacity ? n : 2 * chunks->table_capacity;
    unsigned char **table = memory_array(chunks->allocator, capacity, sizeof *table);
    if (!table)
        return 0;
    if (chunks->n_chunks)
        memcpy(table, chunks->table, chunks->n_chunks * sizeof *table);
    memory_release(chunks->allocator, chunks->table, chunks->table_capacity, sizeof *table);
    chunks->table = table;
    chunks->table_capacity = capacity;
    return 1;
}

int chunks_reserve(struct chunks *chunks, uint64_t n)
{
    size_t n_chunks = (size_t)((n + CHUNK_ELEMENTS - 1) >> CHUNK_SHIFT);
    if (n == 0)
        return 1;
    if (!table_reserve(chunks, n_chunks))
        return 0;
    chunks->slab = memory_array(chunks->allocator, n, chunks->element_size);
    if (!chunks->slab)
        return 0;
    for (size_t i = 0; i < n_chunks; i++)
        chunks->table[i] = chunks->slab + i * CHUNK_ELEMENTS * chunks->element_size;
    chunks->n_chunks = chunks->n_slab_chunks = n_chunks;
    chunks->n_slab = chunks->n_room = n;
    return 1;
}

/* The slab may end inside a chunk: that chunk moves to memory of its own and is filled up. */
static void complete_last_chunk(struct chunks *chunks, unsigned char *chunk)
{
    uint64_t n = chunks->n_slab & (CHUNK_ELEMENTS - 1);
    chunks->n_slab_chunks--;
    memcpy(chunk, chunks->table[chunks->n_slab_chunks], n * chunks->element_size);
    chunks->table[chunks->n_slab_chunks] = chunk;
    chunks->n_room += CHUNK_ELEMENTS - n;
}

int chunks_grow(struct chunks *chunks)
{
    unsigned char *chunk;
    if (!table_reserve(chunks, chunks->n_chunks + 1))
        return 0;
    chunk = memory_array(chunks->allocator, CHUNK_ELEMENTS, chunks->element_size);
    if (!chunk)
        return 0;
    if (chunks->n_room & (CHUNK_ELEMENTS - 1)) {
        complete_last_chunk(chunks, chunk);
        return 1;
    }
    chunks->table[chunks->n_chunks++] = chunk;
    chunks->n_room += CHUNK_ELEMENTS;
    return 1;
}

static void gather(const struct chunks *chunks, unsigned char *out)
{
    for (uint64_t i = 0, n; i < chunks->n; i += n) {
        n = chunks_span(i, chunks->n - i);
        memcpy(out + i * chunks->element_size, chunks_at(chunks, i), n * chunks->element_size);
    }
}

void *chunks_take(struct chunks *chunks)
{
    unsigned char *out;
    if (chunks->slab && chunks->n == chunks->n_slab && chunks->n == chunks->n_room) {
        out = chunks->slab; /* exactly what was foreseen: nothing to copy */
        chunks->slab = NULL;
    } else {
        out = memory_array(chunks->allocator, chunks->n, chunks->element_size);
        if (!out)
            return NULL;
        gather(chunks, out);
    }
    chunks_finish(chunks);
    return out;
}
