/* A parallel loop over strands, in pieces of a fixed size. */
#ifndef CURVATURE_PIECES_H
#define CURVATURE_PIECES_H

#include <stdint.h>

#include "base/parallel.h"

#define PIECE_STRANDS 64

static inline uint32_t piece_count(uint32_t n_strands)
{
    return n_strands / PIECE_STRANDS + (n_strands % PIECE_STRANDS != 0);
}

static inline void piece_bounds(uint32_t n_strands, uint32_t piece, uint32_t *begin, uint32_t *end)
{
    *begin = piece * PIECE_STRANDS;
    *end = n_strands - *begin < PIECE_STRANDS ? n_strands : *begin + PIECE_STRANDS;
}

#endif
