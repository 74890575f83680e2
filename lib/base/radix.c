/* Radix sort by digits of 11 bits. */
#include "base/radix.h"

#include <string.h>

/* Floats as whole numbers of the same order, and back. */
static uint32_t key_of(uint32_t bits) { return bits ^ (bits >> 31 ? 0xffffffffu : 0x80000000u); }
static uint32_t bits_of_key(uint32_t key) { return key ^ (key >> 31 ? 0x80000000u : 0xffffffffu); }

void radix_sort_floats(float *values, float *spare, uint32_t n)
{
    uint32_t *from = (uint32_t *)(void *)values, *to = (uint32_t *)(void *)spare;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        from[i] = key_of(bits);
    }
    for (int shift = 0; shift < 33; shift += 11) {
        uint32_t first[2049] = {0}, *swap = from;
        for (uint32_t i = 0; i < n; i++)
            first[(from[i] >> shift & 2047) + 1]++;
        for (int d = 0; d < 2048; d++)
            first[d + 1] += first[d];
        for (uint32_t i = 0; i < n; i++)
            to[first[from[i] >> shift & 2047]++] = from[i];
        from = to;
        to = swap;
    }
    for (uint32_t i = 0; i < n; i++) { /* after three passes they are in spare */
        uint32_t bits = bits_of_key(from[i]);
        memcpy(&values[i], &bits, sizeof bits);
    }
}

/* One pass over the digit of the values' keys (the high 32 bits) that begins at `shift`. */
static void order_pass(const uint64_t *from, uint64_t *to, uint32_t n, int shift)
{
    uint32_t first[2049] = {0};
    for (uint32_t i = 0; i < n; i++)
        first[(from[i] >> (32 + shift) & 2047) + 1]++;
    for (int d = 0; d < 2048; d++)
        first[d + 1] += first[d];
    for (uint32_t i = 0; i < n; i++)
        to[first[from[i] >> (32 + shift) & 2047]++] = from[i];
}

void radix_sort_order(const float *values, uint64_t *order, uint64_t *spare, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        spare[i] = (uint64_t)key_of(bits) << 32 | i;
    }
    order_pass(spare, order, n, 0);
    order_pass(order, spare, n, 11);
    order_pass(spare, order, n, 22);
}
