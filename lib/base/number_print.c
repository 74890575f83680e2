/* Float to text, the same bytes as printf's %.9g and several times faster.
 *
 * Nine digits of m * 2^e are found exactly in integers, of 64 bits for what coordinates usually are
 * and of 128 otherwise: for 10^-27 <= |x| as
 * floor(m * 5^k * 2^(e+k)) with its remainder, where 10^8 <= x * 10^k < 10^9, rounded half to even
 * as printf does. What is smaller is left to snprintf. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"

typedef unsigned __int128 u128;

/* 5^k for k < 45: 103 bits at most, so that 24 bits of mantissa may join it (35 is the largest here). */

static const uint64_t powers_of_five[28] = {1,
                                            5,
                                            25,
                                            125,
                                            625,
                                            3125,
                                            15625,
                                            78125,
                                            390625,
                                            1953125,
                                            9765625,
                                            48828125,
                                            244140625,
                                            1220703125,
                                            6103515625,
                                            30517578125,
                                            152587890625,
                                            762939453125,
                                            3814697265625,
                                            19073486328125,
                                            95367431640625,
                                            476837158203125,
                                            2384185791015625,
                                            11920928955078125,
                                            59604644775390625,
                                            298023223876953125,
                                            1490116119384765625,
                                            7450580596923828125};

static u128 power_of_five(unsigned k)
{
    return k < 28 ? powers_of_five[k] : (u128)powers_of_five[27] * powers_of_five[k - 27];
}

/* quotient of value / 2^shift, rounded half to even */
static uint64_t shift_rounding(u128 value, unsigned shift)
{
    if (shift == 0)
        return (uint64_t)value;
    if (shift > 127)
        return 0;
    u128 quotient = value >> shift, rest = value - (quotient << shift), half = (u128)1 << (shift - 1);
    return (uint64_t)quotient + (rest > half || (rest == half && (quotient & 1)));
}

static uint64_t divide_rounding(u128 value, u128 divisor)
{
    u128 quotient = value / divisor, rest = value % divisor;
    return (uint64_t)quotient + (rest * 2 > divisor || (rest * 2 == divisor && (quotient & 1)));
}

/* m * 2^e * 10^k, rounded to a whole number: 0 <= k <= 13, so that m * 5^k has 55 bits at most, and e + k < 0
 */
static inline uint64_t scaled_small(uint32_t m, int e, int k)
{
    unsigned shift = (unsigned)-(e + k);
    uint64_t value = m * powers_of_five[k], quotient = value >> shift;
    uint64_t rest = value - (quotient << shift), half = (uint64_t)1 << (shift - 1);
    return quotient + (rest > half || (rest == half && (quotient & 1)));
}

/* The same for any k. */
static uint64_t scaled_large(uint32_t m, int e, int k)
{
    if (k >= 0) {
        u128 value = (u128)m * power_of_five((unsigned)k);
        return e + k < 0 ? shift_rounding(value, (unsigned)-(e + k)) : (uint64_t)(value << (e + k));
    }
    /* x >= 10^9: m * 2^e / 10^-k, where m * 2^e < 2^128 */
    u128 divisor = power_of_five((unsigned)-k);
    return e + k < 0 ? divide_rounding(m, divisor << -(e + k)) : divide_rounding((u128)m << (e + k), divisor);
}

static inline uint64_t scaled(uint32_t m, int e, int k)
{
    return k >= 0 && k <= 13 && e + k < 0 && e + k > -64 ? scaled_small(m, e, k) : scaled_large(m, e, k);
}

static const char digit_pairs[201] =
    "00010203040506070809101112131415161718192021222324252627282930313233343536373839404142434445464748"
    "4950515253545556575859606162636465666768697071727374757677787980818283848586878889909192939495969798"
    "99";

static void print_pair(char *out, uint32_t pair) { memcpy(out, digit_pairs + 2 * pair, 2); }

/* nine digits, leading zeros kept */
static void print_nine(char out[9], uint32_t digits)
{
    uint32_t high = digits / 10000, low = digits % 10000;
    print_pair(out + 5, low / 100);
    print_pair(out + 7, low % 100);
    out[0] = (char)('0' + high / 10000);
    high %= 10000;
    print_pair(out + 1, high / 100);
    print_pair(out + 3, high % 100);
}

/* Nine digits whose first stands for 10^decimal, laid out as %g does. */
static size_t lay_out(char *out, const char digits[9], int decimal)
{
    char *p = out;
    int n = 9;
    while (n > 1 && digits[n - 1] == '0')
        n--;
    if (decimal < -4 || decimal > 8) {
        *p++ = digits[0];
        if (n > 1) {
            *p++ = '.';
            memcpy(p, digits + 1, (size_t)n - 1);
            p += n - 1;
        }
        *p++ = 'e';
        *p++ = decimal < 0 ? '-' : '+';
        print_pair(p, (uint32_t)(decimal < 0 ? -decimal : decimal));
        return (size_t)(p + 2 - out);
    }
    if (decimal < 0) {
        memcpy(p, "0.0000", 6);
        p += 1 - decimal;
        memcpy(p, digits, 9);
        return (size_t)(p + n - out);
    }
    memcpy(p, digits, (size_t)decimal + 1);
    p += decimal + 1;
    if (n > decimal + 1) {
        *p++ = '.';
        memcpy(p, digits + decimal + 1, (size_t)(n - decimal - 1));
        p += n - decimal - 1;
    }
    return (size_t)(p - out);
}

size_t number_print(char *out, float value)
{
    char digits[9], *p = out;
    uint32_t bits;
    int decimal;
    memcpy(&bits, &value, sizeof bits);
    if (!(fabsf(value) >= 1e-27f) || !isfinite(value)) {
        if (value == 0) {
            memcpy(out, "-0", 2);
            out[0] = bits >> 31 ? '-' : '0';
            return bits >> 31 ? 2 : 1;
        }
        return (size_t)snprintf(out, NUMBER_MAX, "%.9g", (double)value);
    }
    if (bits >> 31)
        *p++ = '-';
    int e = (int)(bits >> 23 & 255) - 150;
    uint32_t m = (bits & 0x7fffff) | 0x800000;
    /* floor(log10 2^(e+23)), at most one too low for x */
    decimal = ((e + 23) * 78913) >> 18;
    uint64_t nine = scaled(m, e, 8 - decimal);
    if (nine >= 1000000000)
        nine = scaled(m, e, 8 - ++decimal);
    print_nine(digits, (uint32_t)nine);
    return (size_t)(p - out) + lay_out(p, digits, decimal);
}

size_t number_print_integer(char *out, unsigned long long value)
{
    char reversed[20];
    size_t n = 0;
    do
        reversed[n++] = (char)('0' + value % 10);
    while (value /= 10);
    for (size_t i = 0; i < n; i++)
        out[i] = reversed[n - 1 - i];
    return n;
}
