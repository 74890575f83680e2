/* Text to double: digits into a 64-bit integer, then one exact multiplication or division by a
 * power of ten (Clinger 1990, "How to read floating point numbers accurately", the fast path),
 * in 64-bit-mantissa long double where a double would not be exact. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/number.h"

static const double power_of_ten[23] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                        1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                        1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
/* 10^27 is the last that 64 bits of mantissa hold exactly. */
static const long double long_power_of_ten[28] = {
    1e0L,  1e1L,  1e2L,  1e3L,  1e4L,  1e5L,  1e6L,  1e7L,  1e8L,  1e9L,  1e10L, 1e11L, 1e12L, 1e13L,
    1e14L, 1e15L, 1e16L, 1e17L, 1e18L, 1e19L, 1e20L, 1e21L, 1e22L, 1e23L, 1e24L, 1e25L, 1e26L, 1e27L};

static double scale_slowly(uint64_t digits, int exponent)
{
    long double value = digits;
    if (exponent < -400) /* 19 digits and this are below the least double */
        return 0;
    if (exponent > 400)
        return INFINITY;
    for (; exponent < -27; exponent += 27)
        value /= 1e27L;
    for (; exponent > 27; exponent -= 27)
        value *= 1e27L;
    return (double)(exponent < 0 ? value / long_power_of_ten[-exponent]
                                 : value * long_power_of_ten[exponent]);
}

static inline double scale(uint64_t digits, int exponent)
{
    if (digits < UINT64_C(1) << 53 && exponent >= -22 && exponent <= 22)
        return exponent < 0 ? (double)digits / power_of_ten[-exponent]
                            : (double)digits * power_of_ten[exponent];
    return digits ? scale_slowly(digits, exponent) : 0;
}

/* Only the first 19 significant digits count; the others move the point. */
#define DIGITS_LIMIT UINT64_C(1000000000000000000)

static inline int is_digit(unsigned char c) { return (unsigned)c - '0' < 10; }

static const unsigned char *scan_exponent(const unsigned char *text, int *exponent)
{
    const unsigned char *p = text + 1;
    int negative = *p == '-', value = 0;
    if (*p == '-' || *p == '+')
        p++;
    if (!is_digit(*p))
        return text; /* the e belongs to something else */
    for (; is_digit(*p); p++)
        value = value < 100000 ? value * 10 + (*p - '0') : value;
    *exponent += negative ? -value : value;
    return p;
}

/* Eight digits at once, in a 64-bit register: pairs, then fours, then all (little-endian). */
static inline int scan_eight(const unsigned char *p, uint64_t *digits)
{
    uint64_t block, digit;
    memcpy(&block, p, sizeof block);
    digit = block - UINT64_C(0x3030303030303030);
    if (((block + UINT64_C(0x4646464646464646)) | digit) & UINT64_C(0x8080808080808080))
        return 0;
    digit = digit * 10 + (digit >> 8);
    *digits = (((digit & UINT64_C(0x000000ff000000ff)) * UINT64_C(0x000f424000000064)) +
               ((digit >> 16 & UINT64_C(0x000000ff000000ff)) * UINT64_C(0x0000271000000001))) >>
              32;
    return 1;
}

static inline const unsigned char *scan(const unsigned char *p, double *value, int padded)
{
    uint64_t digits = 0, eight;
    int exponent = 0, negative = *p == '-';
    const unsigned char *first, *point;
    if (*p == '-' || *p == '+')
        p++;
    first = p;
    for (; is_digit(*p); p++) {
        if (digits < DIGITS_LIMIT)
            digits = digits * 10 + (*p - '0');
        else
            exponent++;
    }
    size_t n_digits = (size_t)(p - first);
    if (*p == '.') {
        point = ++p;
        while (padded && digits < UINT64_C(10000000000) && scan_eight(p, &eight)) {
            digits = digits * 100000000 + eight;
            exponent -= 8;
            p += 8;
        }
        for (; is_digit(*p); p++)
            if (digits < DIGITS_LIMIT) {
                digits = digits * 10 + (*p - '0');
                exponent--;
            }
        n_digits += (size_t)(p - point);
    }
    if (n_digits == 0)
        return NULL;
    if (*p == 'e' || *p == 'E')
        p = scan_exponent(p, &exponent);
    *value = scale(digits, exponent);
    if (negative)
        *value = -*value;
    return p;
}

const unsigned char *number_scan(const unsigned char *text, double *value) { return scan(text, value, 0); }
const unsigned char *number_scan_padded(const unsigned char *text, double *value)
{
    return scan(text, value, 1);
}

static int matches(const unsigned char *text, const char *word)
{
    for (; *word; word++, text++)
        if ((*text | 0x20) != *word)
            return 0;
    return 1;
}

static const unsigned char *skip_word(const unsigned char *p)
{
    while (is_digit(*p) || (unsigned)(*p | 0x20) - 'a' < 26 || *p == '#' || *p == '(' || *p == ')')
        p++;
    return p;
}

static const unsigned char *scan_special(const unsigned char *p, double *value)
{
    int negative = *p == '-';
    if (*p == '-' || *p == '+')
        p++;
    *value = matches(p, "nan") ? NAN : negative ? -INFINITY : INFINITY;
    return matches(p, "nan") || matches(p, "inf") ? skip_word(p) : NULL;
}

const unsigned char *number_scan_any(const unsigned char *text, double *value)
{
    const unsigned char *after = number_scan_padded(text, value);
    if (!after)
        return scan_special(text, value);
    if (*after != '#' || after[-1] != '.')
        return after;
    *value = NAN;
    return skip_word(after);
}

const unsigned char *number_scan_integer(const unsigned char *p, long long *value)
{
    int negative = *p == '-';
    const unsigned char *first;
    long long sum = 0;
    if (*p == '-' || *p == '+')
        p++;
    for (first = p; is_digit(*p); p++) {
        if (p - first == 18)
            return NULL;
        sum = sum * 10 + (*p - '0');
    }
    if (p == first)
        return NULL;
    *value = negative ? -sum : sum;
    return p;
}
