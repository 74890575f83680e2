#include "model/block.h"

#include "model/quad.h"

struct block block_of(const uint32_t *strand, uint32_t n)
{
    struct block block = {.n = n};
    for (uint32_t l = 0; l < LANES; l++)
        block.strand[l] = strand[l < n ? l : n - 1];
    return block;
}

#define MOST_BLENDED 4 /* guides a strand: with more, blends are added up in memory */

/* What four lanes blend: their guides and weights. */
struct blend {
    const float *guide[QUAD][MOST_BLENDED];
    quad weight[QUAD][MOST_BLENDED];
};

static void blend_of(const struct groom *groom, const float *relative, const uint32_t *strand, uint32_t first, uint32_t k,
                     struct blend *blend)
{
    for (uint32_t l = 0; l < QUAD; l++)
        for (uint32_t a = 0; a < k; a++) {
            size_t at = (size_t)strand[l] * groom->n_instancing + first + a;
            blend->guide[l][a] = relative + (size_t)3 * groom->n_vertices * groom->instancing_guide[at];
            blend->weight[l][a] = quad_of(groom->instancing_weight[at]);
        }
}

/* x = [x +] sum over k guides of weight guide, four points of four lanes at a time. */
LANES_INLINE void blend_quads(const struct blend *blend, uint32_t k, uint32_t n, int add, lanes *restrict x)
{
    uint32_t i = 0;
    for (; i + QUAD <= n; i += QUAD) {
        quad r[QUAD];
        for (uint32_t l = 0; l < QUAD; l++) {
            r[l] = blend->weight[l][0] * quad_load(blend->guide[l][0] + i);
            for (uint32_t a = 1; a < k; a++)
                r[l] += blend->weight[l][a] * quad_load(blend->guide[l][a] + i);
        }
        quad_transpose(r);
        for (uint32_t t = 0; t < QUAD; t++)
            quad_store(x[i + t], add ? quad_load(x[i + t]) + r[t] : r[t]);
    }
    for (; i < n; i++)
        for (uint32_t l = 0; l < QUAD; l++) {
            float sum = blend->weight[l][0][0] * blend->guide[l][0][i];
            for (uint32_t a = 1; a < k; a++)
                sum += blend->weight[l][a][0] * blend->guide[l][a][i];
            x[i][l] = add ? x[i][l] + sum : sum;
        }
}

/* Bodies for each number of guides, which stay in registers. */
static void blend_some(const struct blend *blend, uint32_t k, uint32_t n, int add, lanes *x)
{
    switch (k) {
    case 1: blend_quads(blend, 1, n, add, x); break;
    case 2: blend_quads(blend, 2, n, add, x); break;
    case 3: blend_quads(blend, 3, n, add, x); break;
    default: blend_quads(blend, MOST_BLENDED, n, add, x);
    }
}

void block_instance(const struct groom *groom, const float *relative, const struct block *block, lanes *x)
{
    uint32_t k = groom->n_instancing, n = 3 * groom->n_vertices;
    struct blend blend;
    for (uint32_t lane = 0; lane < LANES; lane += QUAD)
        for (uint32_t a = 0; a < k; a += MOST_BLENDED) {
            uint32_t some = k - a < MOST_BLENDED ? k - a : MOST_BLENDED;
            blend_of(groom, relative, block->strand + lane, a, some, &blend);
            blend_some(&blend, some, n, a > 0, (lanes *)(x[0] + lane)); /* the lines keep their width */
        }
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
                r[l] = quad_load(row[lane + l] + i);
            quad_transpose(r);
            for (uint32_t t = 0; t < QUAD; t++)
                quad_store(&x[i + t][lane], r[t] - coordinate[c + t]);
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
                r[t] = quad_load(&x[i + t][lane]) + coordinate[c + t];
            quad_transpose(r);
            for (uint32_t l = 0; l < n_here; l++)
                quad_store(row[lane + l] + i, r[l]);
        }
        for (; i < n; i++)
            for (uint32_t l = 0; l < n_here; l++)
                row[lane + l][i] = x[i][lane + l] + coordinate[i % 3][l];
    }
}
