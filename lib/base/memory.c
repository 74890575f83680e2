#include "base/memory.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define ALIGNMENT 64

static void *allocate_default(void *user, size_t bytes)
{
    (void)user;
    if (bytes > SIZE_MAX - ALIGNMENT)
        return NULL;
    return aligned_alloc(ALIGNMENT, (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT);
}

static void release_default(void *user, void *memory, size_t bytes)
{
    (void)user;
    (void)bytes;
    free(memory);
}

const struct groom_allocator groom_default_allocator = {allocate_default, release_default, NULL};

const struct groom_allocator *memory_allocator(const struct groom_context *context)
{
    return context && context->allocator ? context->allocator : &groom_default_allocator;
}

/* bytes of an array, or 0 on overflow */
static size_t array_bytes(size_t count, size_t size)
{
    size_t bytes;
    if (count == 0)
        count = 1;
    return __builtin_mul_overflow(count, size, &bytes) ? 0 : bytes;
}

void *memory_array(const struct groom_allocator *allocator, size_t count, size_t size)
{
    size_t bytes = array_bytes(count, size);
    return bytes ? allocator->allocate(allocator->user, bytes) : NULL;
}

void *memory_array_zero(const struct groom_allocator *allocator, size_t count, size_t size)
{
    void *memory = memory_array(allocator, count, size);
    if (memory)
        memset(memory, 0, array_bytes(count, size));
    return memory;
}

void memory_release(const struct groom_allocator *allocator, void *memory, size_t count, size_t size)
{
    if (memory)
        allocator->release(allocator->user, memory, array_bytes(count, size));
}
