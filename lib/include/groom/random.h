/* Counter-based random numbers (Philox 4x32-10, Salmon et al. 2011).
 *
 * A number depends on (seed, stream, index, draw) and on nothing else: not on
 * the order in which strands are visited, not on the thread. A stream is a use
 * (an operator of the chain, a sampling step), an index is a strand or guide. */
#ifndef GROOM_RANDOM_H
#define GROOM_RANDOM_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct groom_random_key {
    uint64_t seed;
    uint32_t stream;
};

/* The draw-th block of four 32-bit numbers of (key, index). Pure; any thread. */
void groom_random_block(struct groom_random_key key, uint32_t index, uint32_t draw, uint32_t out[4]);

/* U(0,1), open at both ends, 23 bits. `draw` is below 2^20 in every call. */
float groom_random_uniform(struct groom_random_key key, uint32_t index, uint32_t draw);

/* N(0,1) truncated to [-1,1]: redrawn until it falls inside, never clipped
 * (Chang et al. 2025, Appendix A). */
float groom_random_truncated_normal(struct groom_random_key key, uint32_t index, uint32_t draw);

/* N(0,1), double precision. */
double groom_random_normal(struct groom_random_key key, uint32_t index, uint32_t draw);

/* A whole number 0..n-1, without modulo bias worth naming (n < 2^32). */
uint32_t groom_random_below(struct groom_random_key key, uint32_t index, uint32_t draw, uint32_t n);

#ifdef __cplusplus
}
#endif
#endif
