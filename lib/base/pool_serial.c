/* The pool where there are no threads: the page's WebAssembly. pool.c is the one of everywhere else. */
#ifdef __wasm__
#include "base/parallel.h"

struct groom_pool {
    char unused;
};

groom_status groom_pool_create(uint32_t n_threads, struct groom_pool **pool)
{
    static struct groom_pool serial;
    (void)n_threads;
    *pool = &serial;
    return GROOM_OK;
}

void groom_pool_destroy(struct groom_pool *pool) { (void)pool; }

uint32_t groom_pool_threads(const struct groom_pool *pool)
{
    (void)pool;
    return 1;
}

uint32_t parallel_threads(const struct groom_context *context)
{
    (void)context;
    return 1;
}

void parallel_for(const struct groom_context *context, uint32_t n_pieces, parallel_body *body, void *user)
{
    (void)context;
    for (uint32_t piece = 0; piece < n_pieces; piece++)
        body(user, piece, 0);
}

void parallel_once(struct parallel_once *once, void (*fill)(void))
{
    if (!once->filled)
        fill();
    once->filled = 1;
}
#else
typedef int pool_serial_is_for_targets_without_threads;
#endif
