#include "groom/random.h"

#include <math.h>
#include <Random123/philox.h>

void groom_random_block(struct groom_random_key key, uint32_t index, uint32_t draw, uint32_t out[4])
{
    philox4x32_ctr_t counter = {{index, draw, key.stream, 0x67726f6fu}};
    philox4x32_key_t philox_key = {{(uint32_t)key.seed, (uint32_t)(key.seed >> 32)}};
    philox4x32_ctr_t block = philox4x32(counter, philox_key);
    for (int i = 0; i < 4; i++)
        out[i] = block.v[i];
}

/* 24 bits at the middles of their intervals, so that neither 0 nor 1 comes up: 24 bits and a half
 * do not fit a float's mantissa near 1, hence 23 bits and the half. */
static float open_unit(uint32_t bits) { return ((float)(bits >> 9) + 0.5f) * 0x1p-23f; }

static double open_unit_double(uint32_t high, uint32_t low)
{
    uint64_t bits = ((uint64_t)high << 32 | low) >> 12;
    return ((double)bits + 0.5) * 0x1p-52;
}

float groom_random_uniform(struct groom_random_key key, uint32_t index, uint32_t draw)
{
    uint32_t block[4];
    groom_random_block(key, index, draw, block);
    return open_unit(block[0]);
}

/* Box-Muller, double precision throughout: the same libm gives the same bits. */
static double normal_of(uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    double radius = sqrt(-2.0 * log(open_unit_double(a, b)));
    return radius * cos(6.283185307179586 * open_unit_double(c, d));
}

double groom_random_normal(struct groom_random_key key, uint32_t index, uint32_t draw)
{
    uint32_t block[4];
    groom_random_block(key, index, draw, block);
    return normal_of(block[0], block[1], block[2], block[3]);
}

float groom_random_truncated_normal(struct groom_random_key key, uint32_t index, uint32_t draw)
{
    /* 68 % of draws are kept; redraws use the upper bits of the draw counter, which callers leave
     * alone. 64 failures in a row have probability 1e-32. */
    for (uint32_t attempt = 0; attempt < 64; attempt++) {
        double value = groom_random_normal(key, index, draw + (attempt << 20));
        if (value >= -1.0 && value <= 1.0)
            return (float)value;
    }
    return 0.0f;
}

uint32_t groom_random_below(struct groom_random_key key, uint32_t index, uint32_t draw, uint32_t n)
{
    uint32_t block[4];
    groom_random_block(key, index, draw, block);
    return (uint32_t)((uint64_t)block[0] * n >> 32);
}
