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

#define WIDE 3 /* quads at a time: an address a guide serves them all, and coordinates come round in step */

/* Number i and on of lane l: `wide` quads, each into its row l. */
LANES_INLINE void blend_lane(const struct blend *blend, uint32_t k, uint32_t l, uint32_t i, uint32_t wide, quad r[WIDE][QUAD])
{
    const float *guide = blend->guide[l][0] + i;
    for (uint32_t q = 0; q < wide; q++)
        r[q][l] = blend->weight[l][0] * quad_load(guide + QUAD * q);
    for (uint32_t a = 1; a < k; a++) {
        guide = blend->guide[l][a] + i;
        for (uint32_t q = 0; q < wide; q++)
            r[q][l] += blend->weight[l][a] * quad_load(guide + QUAD * q);
    }
}

LANES_INLINE void blend_lines(const struct blend *blend, uint32_t k, uint32_t i, uint32_t wide, int add, quad factor,
                              lanes *restrict x)
{
    quad r[WIDE][QUAD];
    blend_lane(blend, k, 0, i, wide, r), blend_lane(blend, k, 1, i, wide, r);
    blend_lane(blend, k, 2, i, wide, r), blend_lane(blend, k, 3, i, wide, r);
    for (uint32_t q = 0; q < wide; q++) {
        quad_transpose(r[q]);
        for (uint32_t t = 0; t < QUAD; t++) {
            float *line = x[i + QUAD * q + t];
            quad_store(line, factor * (add ? quad_load(line) + r[q][t] : r[q][t]));
        }
    }
}

/* x = factor ([x +] sum over k guides of weight guide), of four lanes. */
LANES_INLINE void blend_quads(const struct blend *blend, uint32_t k, uint32_t n, int add, quad factor, lanes *restrict x)
{
    uint32_t i = 0;
    for (; i + WIDE * QUAD <= n; i += WIDE * QUAD)
        blend_lines(blend, k, i, WIDE, add, factor, x);
    for (; i + QUAD <= n; i += QUAD)
        blend_lines(blend, k, i, 1, add, factor, x);
    for (; i < n; i++)
        for (uint32_t l = 0; l < QUAD; l++) {
            float sum = blend->weight[l][0][0] * blend->guide[l][0][i];
            for (uint32_t a = 1; a < k; a++)
                sum += blend->weight[l][a][0] * blend->guide[l][a][i];
            x[i][l] = factor[l] * (add ? x[i][l] + sum : sum);
        }
}

/* Bodies for each number of guides, which stay in registers. */
static void blend_some(const struct blend *blend, uint32_t k, uint32_t n, int add, quad factor, lanes *x)
{
    if (add)
        blend_quads(blend, k, n, 1, factor, x);
    else if (k == 1)
        blend_quads(blend, 1, n, 0, factor, x);
    else if (k == 2)
        blend_quads(blend, 2, n, 0, factor, x);
    else if (k == 3)
        blend_quads(blend, 3, n, 0, factor, x);
    else
        blend_quads(blend, MOST_BLENDED, n, 0, factor, x);
}

void block_instance(const struct groom *groom, const float *relative, const struct block *block, const float *factor,
                    lanes *x)
{
    uint32_t k = groom->n_instancing, n = 3 * groom->n_vertices;
    struct blend blend;
    for (uint32_t lane = 0; lane < LANES; lane += QUAD)
        for (uint32_t a = 0; a < k; a += MOST_BLENDED) {
            uint32_t some = k - a < MOST_BLENDED ? k - a : MOST_BLENDED;
            quad once = factor && a + some == k ? quad_load(factor + lane) : quad_of(1.0f);
            blend_of(groom, relative, block->strand + lane, a, some, &blend);
            blend_some(&blend, some, n, a > 0, once, (lanes *)(x[0] + lane)); /* the lines keep their width */
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

/* Lines x[0 .. 3] of four lanes, each with something added, to number i of the lanes' rows. */
LANES_INLINE void store_lines(const lanes *restrict x, uint32_t lane, quad a, quad b, quad c, quad d, float *const row[QUAD],
                              uint32_t i, uint32_t n_rows)
{
    quad r[QUAD] = {quad_load(&x[0][lane]) + a, quad_load(&x[1][lane]) + b, quad_load(&x[2][lane]) + c,
                    quad_load(&x[3][lane]) + d};
    quad_transpose(r);
    quad_store(row[0] + i, r[0]);
    if (n_rows > 1)
        quad_store(row[1] + i, r[1]);
    if (n_rows > 2)
        quad_store(row[2] + i, r[2]);
    if (n_rows > 3)
        quad_store(row[3] + i, r[3]);
}

LANES_INLINE void store_rows(const lanes *restrict x, uint32_t lane, const quad add[6], uint32_t n, float *const row[QUAD],
                             uint32_t n_rows)
{
    uint32_t i = 0;
    quad ax = add[0], ay = add[1], az = add[2];
    for (; i + WIDE * QUAD <= n; i += WIDE * QUAD, x += WIDE * QUAD) {
        store_lines(x, lane, ax, ay, az, ax, row, i, n_rows);
        store_lines(x + QUAD, lane, ay, az, ax, ay, row, i + QUAD, n_rows);
        store_lines(x + 2 * QUAD, lane, az, ax, ay, az, row, i + 2 * QUAD, n_rows);
    }
    for (; i < n; i++, x++)
        for (uint32_t l = 0; l < n_rows; l++)
            row[l][i] = x[0][lane + l] + add[i % 3][l];
}

void block_to_rows(const lanes *restrict x, const float *const add[LANES], uint32_t n, float *const row[LANES],
                   uint32_t n_rows)
{
    for (uint32_t lane = 0; lane < n_rows; lane += QUAD) {
        quad coordinate[6];
        gather_vectors(add, lane, coordinate);
        if (n_rows - lane >= QUAD)
            store_rows(x, lane, coordinate, n, row + lane, QUAD);
        else
            store_rows(x, lane, coordinate, n, row + lane, n_rows - lane);
    }
}
