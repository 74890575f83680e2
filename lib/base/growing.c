#include "base/growing.h"

#include <stdint.h>
#include <string.h>

#include "base/memory.h"

struct growing growing_of(size_t item_size) { return (struct growing){.item_size = item_size}; }

void growing_finish(struct growing *array, const struct groom_allocator *allocator)
{
    memory_release(allocator, array->items, array->capacity, array->item_size);
    array->items = NULL;
    array->count = array->capacity = 0;
}

static int grow(struct growing *array, size_t capacity, const struct groom_allocator *allocator)
{
    void *items = memory_array(allocator, capacity, array->item_size);
    if (!items)
        return -1;
    if (array->count)
        memcpy(items, array->items, array->count * array->item_size);
    memory_release(allocator, array->items, array->capacity, array->item_size);
    array->items = items;
    array->capacity = capacity;
    return 0;
}

void *growing_add(struct growing *array, size_t n, const struct groom_allocator *allocator)
{
    if (!array->items || n > array->capacity - array->count) {
        size_t wanted, doubled = array->capacity < SIZE_MAX / 2 ? array->capacity * 2 : SIZE_MAX;
        if (__builtin_add_overflow(array->count, n, &wanted))
            return NULL;
        wanted = wanted > doubled ? wanted : doubled;
        if (grow(array, wanted > 64 ? wanted : 64, allocator) != 0)
            return NULL;
    }
    char *added = (char *)array->items + array->count * array->item_size;
    array->count += n;
    return added;
}

/* What a source says of its size is believed up to this much before the bytes are there. */
#define BELIEVED_BYTES ((size_t)64 << 20)
#define PIECE_BYTES ((size_t)1 << 16)

groom_status growing_read_all(struct growing *bytes, const struct groom_source *source, size_t max_bytes,
                              const struct groom_allocator *allocator, struct groom_diag *diag)
{
    size_t expected = source->size > 0 ? (size_t)source->size : 0;
    if (expected > max_bytes)
        return groom_fail(diag, GROOM_ETOOBIG, "the file has %zu bytes; the limit is %zu", expected, max_bytes);
    if (grow(bytes, (expected < BELIEVED_BYTES ? expected : BELIEVED_BYTES) + PIECE_BYTES, allocator) != 0)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the file's bytes");
    for (;;) {
        char *room = growing_add(bytes, PIECE_BYTES, allocator);
        if (!room)
            return groom_fail(diag, GROOM_ENOMEM, "no memory for the file's bytes");
        bytes->count -= PIECE_BYTES;
        int64_t n = source->read(source->user, room, PIECE_BYTES);
        if (n < 0)
            return groom_fail_at(diag, GROOM_EIO, (int64_t)bytes->count, "reading failed after %zu bytes", bytes->count);
        if (n == 0) {
            memset(room, 0, GROWING_PADDING);
            return GROOM_OK;
        }
        bytes->count += (size_t)n;
        if (bytes->count > max_bytes)
            return groom_fail(diag, GROOM_ETOOBIG, "the file has more than %zu bytes, the limit", max_bytes);
    }
}
