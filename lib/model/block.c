/* Vectors of four floats, which every processor we build for has, written with the compiler's own
 * vector type; the arithmetic is element by element, so that the bits do not depend on it. */
#include "model/block.h"

#include <string.h>

#define QUAD 4

typedef float quad __attribute__((vector_size(16)));

LANES_INLINE quad load(const float *from)
{
    quad q;
    memcpy(&q, from, sizeof q);
    return q;
}

LANES_INLINE void store(float *to, quad q) { memcpy(to, &q, sizeof q); }

/* Four consecutive floats of a row of points repeat a 3-vector from coordinate 0, 1 or 2. */
struct repeated {
    quad from[3];
};

LANES_INLINE struct repeated repeat(const float v[3])
{
    return (struct repeated){{{v[0], v[1], v[2], v[0]}, {v[1], v[2], v[0], v[1]}, {v[2], v[0], v[1], v[2]}}};
}

struct block block_of(const uint32_t *strand, uint32_t n)
{
    struct block block = {.n = n};
    for (uint32_t l = 0; l < LANES; l++)
        block.strand[l] = strand[l < n ? l : n - 1];
    return block;
}

LANES_INLINE void blend_quad(const float *restrict guide, quad root, quad weight, float *restrict row, int first)
{
    quad term = weight * (load(guide) - root);
    store(row, first ? term : load(row) + term);
}

/* row = [row +] weight (guide - its root), a cycle of four points at a time */
LANES_INLINE void blend(const float *restrict guide, float weight, uint32_t n, float *restrict row, int first)
{
    struct repeated root = repeat(guide);
    quad w = {weight, weight, weight, weight};
    uint32_t i = 0;
    for (; i + 3 * QUAD <= n; i += 3 * QUAD)
        for (uint32_t c = 0; c < 3; c++)
            blend_quad(guide + i + c * QUAD, root.from[c], w, row + i + c * QUAD, first);
    for (; i < n; i++) {
        float term = weight * (guide[i] - guide[i % 3]);
        row[i] = first ? term : row[i] + term;
    }
}

void block_instance(const struct groom *groom, uint32_t strand, float *row)
{
    uint32_t n = 3 * groom->n_vertices;
    size_t at = (size_t)strand * groom->n_instancing;
    for (uint32_t k = 0; k < groom->n_instancing; k++) {
        const float *guide = groom->guides[(size_t)groom->instancing_guide[at + k] * groom->n_vertices];
        blend(guide, groom->instancing_weight[at + k], n, row, k == 0);
    }
}

LANES_INLINE void transpose(quad r[QUAD])
{
    quad a = __builtin_shufflevector(r[0], r[1], 0, 4, 1, 5), b = __builtin_shufflevector(r[0], r[1], 2, 6, 3, 7);
    quad c = __builtin_shufflevector(r[2], r[3], 0, 4, 1, 5), d = __builtin_shufflevector(r[2], r[3], 2, 6, 3, 7);
    r[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
    r[1] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
    r[2] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
    r[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

/* Coordinate c = 0, 1, 2, 0, 1, 2 of the vectors of four lanes, or zeroes. */
LANES_INLINE void gather_vectors(const float *const vector[LANES], uint32_t lane, quad coordinate[6])
{
    for (int c = 0; c < 6; c++)
        for (uint32_t l = 0; l < QUAD; l++)
            coordinate[c][l] = vector ? vector[lane + l][c % 3] : 0.0f;
}

void block_from_rows(const float *const row[LANES], const float *const subtract[LANES], uint32_t n,
                     lanes *restrict x)
{
    for (uint32_t lane = 0; lane < LANES; lane += QUAD) {
        quad coordinate[6], r[QUAD];
        uint32_t i = 0, c = 0;
        gather_vectors(subtract, lane, coordinate);
        for (; i + QUAD <= n; i += QUAD, c = c == 2 ? 0 : c + 1) {
            for (uint32_t l = 0; l < QUAD; l++)
                r[l] = load(row[lane + l] + i);
            transpose(r);
            for (uint32_t t = 0; t < QUAD; t++)
                store(&x[i + t][lane], r[t] - coordinate[c + t]);
        }
        for (; i < n; i++)
            for (uint32_t l = 0; l < QUAD; l++)
                x[i][lane + l] = row[lane + l][i] - coordinate[i % 3][l];
    }
}

void block_to_rows(const lanes *restrict x, const float *const add[LANES], uint32_t n, float *const row[LANES],
                   uint32_t n_rows)
{
    for (uint32_t lane = 0; lane < n_rows; lane += QUAD) {
        quad coordinate[6], r[QUAD];
        uint32_t i = 0, c = 0, n_here = n_rows - lane < QUAD ? n_rows - lane : QUAD;
        gather_vectors(add, lane, coordinate);
        for (; i + QUAD <= n; i += QUAD, c = c == 2 ? 0 : c + 1) {
            for (uint32_t t = 0; t < QUAD; t++)
                r[t] = load(&x[i + t][lane]) + coordinate[c + t];
            transpose(r);
            for (uint32_t l = 0; l < n_here; l++)
                store(row[lane + l] + i, r[l]);
        }
        for (; i < n; i++)
            for (uint32_t l = 0; l < n_here; l++)
                row[lane + l][i] = x[i][lane + l] + coordinate[i % 3][l];
    }
}
