/* A block of strands in the lanes, on its way through the chain, and its targets. */
#ifndef FIT_RANDOM_BLOCK_H
#define FIT_RANDOM_BLOCK_H

#include "fit/random_search.h"

#define RANDOM_BLOCK_PIECE 64   /* strands of a piece of a parallel loop */
#define RANDOM_BLOCK_WEIGHTS 4  /* instancing weights that are moved, the heaviest one aside */
#define RANDOM_BLOCK_MOVED 8    /* numbers of a strand that are moved at once */

/* One thread's. */
struct random_search_memory {
    struct workspace w;        /* a state before each active operator, and two to spare */
    struct kernel_inputs in[GROOM_FIT_MAX_OPERATORS];
    lanes *memory;             /* of all that follows */
    struct strand_error_target target;
    lanes *plane;              /* [4 * head_planes_of(m)] the target's, where there is a head */
    lanes *scratch;            /* of strand_error */
    lanes *blend;              /* [3m] the block with other weights, and [m] its arc lengths */
    lanes *toward;             /* [RANDOM_BLOCK_WEIGHTS][3m] what a weight of 1 more adds to it */
    lanes weight[RANDOM_BLOCK_WEIGHTS + 1]; /* as they were; the last: that which pays for the others */
    uint32_t other[LANES][RANDOM_BLOCK_WEIGHTS + 1]; /* which of a strand's k they are */
};

groom_status random_block_memory_init(struct random_search_memory *memory, uint32_t m, uint32_t n_active,
                                      const struct groom_allocator *allocator);
void random_block_memory_finish(struct random_search_memory *memory, uint32_t m, const struct groom_allocator *allocator);

/* Strands first .. first + n - 1, of `only` where it is given; LANES of them at most. */
struct block random_block_range(const struct random_search *search, uint32_t first, uint32_t n);

/* The block's strands up to the operator in question, their targets, the operators' inputs. */
void random_block_load(const struct random_search *search, struct random_search_memory *memory, const struct block *block,
                       uint32_t active);
/* What random_block_load has made: the strands before any operator. */
struct bundle random_block_start(const struct random_search_memory *memory);
/* The strands before an active operator. */
struct bundle random_block_before(const struct random_search_memory *memory, uint32_t active);
/* From x, the strands before operator `active`, on, with the inputs as they are in memory->in. error: one a lane */
void random_block_evaluate(const struct random_search *search, struct random_search_memory *memory, struct bundle x,
                           uint32_t active, float *error);

/* Again from operator `from` to the one that random_block_load was told, with the inputs as they are now. */
void random_block_advance(const struct random_search *search, struct random_search_memory *memory, uint32_t from,
                          uint32_t active);
/* The lengths that strands come out with, all operators taken as there, from operator `active` on. */
void random_block_lengths(const struct random_search *search, struct random_search_memory *memory, uint32_t active,
                          float *length);

/* --- instancing weights; n: of those that are moved, k - 1 at most ------------------------------ */

void random_block_load_weights(const struct random_search *search, struct random_search_memory *memory,
                               const struct block *block, uint32_t n);
/* The strands before any operator with weights moved by more [n]. */
struct bundle random_block_blend(const struct random_search *search, struct random_search_memory *memory, uint32_t n,
                                 lanes *more);
/* Moves such that all weights stay at least 0 and sum to what they did. */
void random_block_confine(const struct random_search_memory *memory, uint32_t n, lanes *more);
void random_block_store_weights(const struct random_search *search, const struct random_search_memory *memory,
                                const struct block *block, uint32_t n, lanes *more);

#endif
