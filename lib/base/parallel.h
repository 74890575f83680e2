/* The parallel loop of the library: fixed pieces, any number of threads.
 *
 * The split into pieces depends on the work alone, never on the pool, so a
 * reduction that keeps one partial result a piece and combines them in order
 * gives the same bits everywhere. */
#ifndef BASE_PARALLEL_H
#define BASE_PARALLEL_H

#include <stdint.h>

#include "groom/context.h"

/* Call body(user, piece, thread) for piece 0..n_pieces-1, each once, in any order; returns when all
 * are done. `thread` is 0..groom_pool_threads-1, for scratch memory of its own. */
typedef void parallel_body(void *user, uint32_t piece, uint32_t thread);
void parallel_for(const struct groom_context *context, uint32_t n_pieces, parallel_body *body, void *user);

/* How many threads parallel_for may use here: the number of scratch areas to allocate. */
uint32_t parallel_threads(const struct groom_context *context);

/* What is the same in the whole process: filled by the first thread that asks; whoever else asks waits for it. Static, all
 * zeroes before. */
struct parallel_once { _Atomic int filled; };
void parallel_once(struct parallel_once *once, void (*fill)(void));

#endif
