/* What a call may use: memory, threads, and a way to report and be stopped.
 *
 * Every function that allocates, runs long or runs in parallel takes a
 * `const struct groom_context *`; NULL, or any NULL member, means the default
 * (malloc, the calling thread alone, silence). Results never depend on it:
 * the same input gives the same bits for any pool. */
#ifndef GROOM_CONTEXT_H
#define GROOM_CONTEXT_H

#include <stddef.h>
#include <stdint.h>

#include "groom/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- memory ------------------------------------------------------------- */

/* All memory of the library goes through one of these, so that a test can pass
 * one that fails at the nth call. `release` gets the size that was allocated
 * and must take NULL. Memory is aligned to 64 bytes. Must be thread-safe. */
struct groom_allocator {
    void *(*allocate)(void *user, size_t bytes); /* NULL where there is none left */
    void (*release)(void *user, void *memory, size_t bytes);
    void *user;
};

/* malloc and free. */
extern const struct groom_allocator groom_default_allocator;

/* --- threads ------------------------------------------------------------ */

struct groom_pool;

/* A pool of `n_threads` workers (0: one for each processor; the caller of a
 * parallel loop always works too, so n_threads counts it). Owned by the caller.
 * One loop runs at a time in a pool; loops from several threads take turns, and
 * a loop started inside a loop runs in its thread. */
GROOM_MUST_CHECK groom_status groom_pool_create(uint32_t n_threads, struct groom_pool **pool);
void groom_pool_destroy(struct groom_pool *pool); /* takes NULL */
uint32_t groom_pool_threads(const struct groom_pool *pool); /* 1 for NULL */

/* --- progress and cancellation ------------------------------------------- */

/* Long calls report through this and ask it whether to go on. Both callbacks
 * may be NULL, and are called only from the thread that called the library. */
struct groom_progress {
    /* fraction 0..1 of the present call */
    void (*report)(void *user, double fraction);
    /* a value of a loss curve */
    void (*loss)(void *user, const char *name, uint64_t iteration, double value);
    /* nonzero: stop soon with GROOM_ECANCELLED */
    int (*cancelled)(void *user);
    void *user;
};

/* --- the three together --------------------------------------------------- */

struct groom_context {
    const struct groom_allocator *allocator;
    struct groom_pool *pool;
    const struct groom_progress *progress;
};

#ifdef __cplusplus
}
#endif
#endif
