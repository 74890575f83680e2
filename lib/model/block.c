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

/* Where the guides of four lanes stand, from some number on. */
struct blend_rows {
    const float *at[QUAD][MOST_BLENDED];
};

/* The q-th quad from there on of lane l. No loop: the sum is a register. */
LANES_INLINE quad blend_lane(const struct blend *blend, const struct blend_rows *row, uint32_t k, uint32_t l, uint32_t q)
{
    quad sum = blend->weight[l][0] * quad_load(row->at[l][0] + QUAD * q);
    if (k > 1)
        sum += blend->weight[l][1] * quad_load(row->at[l][1] + QUAD * q);
    if (k > 2)
        sum += blend->weight[l][2] * quad_load(row->at[l][2] + QUAD * q);
    if (k > 3)
        sum += blend->weight[l][3] * quad_load(row->at[l][3] + QUAD * q);
    return sum;
}

LANES_INLINE void blend_quad(const struct blend *blend, const struct blend_rows *row, uint32_t k, uint32_t q, int add,
                             quad factor, lanes *restrict x)
{
    quad r[QUAD] = {blend_lane(blend, row, k, 0, q), blend_lane(blend, row, k, 1, q), blend_lane(blend, row, k, 2, q),
                    blend_lane(blend, row, k, 3, q)};
    quad_transpose(r);
    for (uint32_t t = 0; t < QUAD; t++)
        quad_store(x[QUAD * q + t], factor * (add ? quad_load(x[QUAD * q + t]) + r[t] : r[t]));
}

/* Numbers i and on; as whole addresses, to which a quad's offset is then a part of the load. */
LANES_INLINE void blend_some_quads(const struct blend *blend, uint32_t k, uint32_t i, uint32_t n_quads, int add,
                                   quad factor, lanes *restrict x)
{
    struct blend_rows row;
    for (uint32_t l = 0; l < QUAD; l++)
        for (uint32_t a = 0; a < k; a++)
            row.at[l][a] = (const float *)((uintptr_t)blend->guide[l][a] + i * sizeof(float));
    blend_quad(blend, &row, k, 0, add, factor, x + i);
    if (n_quads == 1)
        return;
    blend_quad(blend, &row, k, 1, add, factor, x + i);
    blend_quad(blend, &row, k, 2, add, factor, x + i);
}

/* x = factor ([x +] sum over k guides of weight guide), of four lanes. */
LANES_INLINE void blend_quads(const struct blend *blend, uint32_t k, uint32_t n, int add, quad factor, lanes *restrict x)
{
    uint32_t i = 0;
    for (; i + WIDE * QUAD <= n; i += WIDE * QUAD)
        blend_some_quads(blend, k, i, WIDE, add, factor, x);
    for (; i + QUAD <= n; i += QUAD)
        blend_some_quads(blend, k, i, 1, add, factor, x);
    for (; i < n; i++)
        for (uint32_t l = 0; l < QUAD; l++) {
            float sum = blend->weight[l][0][0] * blend->guide[l][0][i];
            for (uint32_t a = 1; a < k; a++)
                sum += blend->weight[l][a][0] * blend->guide[l][a][i];
            x[i][l] = factor[l] * (add ? x[i][l] + sum : sum);
        }
}

/* Bodies for each number of guides. */
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
