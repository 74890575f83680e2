#include "base/number.h"

#include <ctype.h>
#include <limits.h>
#include <math.h>
#include <stddef.h>
#include <strings.h>

/* 10^0 .. 10^22 are doubles exactly. */
static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

static int is_digit(char c) { return c >= '0' && c <= '9'; }

static double scale_by_ten(uint64_t digits, int exponent)
{
    if (digits == 0)
        return 0.0;
    if (digits <= (1ull << 53) && exponent >= -22 && exponent <= 22)
        return exponent < 0 ? (double)digits / powers[-exponent] : (double)digits * powers[exponent];
    if (exponent < -400)
        return 0.0;
    if (exponent > 400)
        return INFINITY;
    return (double)((long double)digits * powl(10.0L, exponent));
}

struct decimal {
    uint64_t digits;
    int exponent;
    int n_seen;
};

/* Digits beyond the 19th only move the exponent. */
static const char *take_digits(const char *at, const char *end, int fraction, struct decimal *d)
{
    for (; at < end && is_digit(*at); at++) {
        d->n_seen = 1;
        if (d->digits < 1000000000000000000ull) {
            d->digits = d->digits * 10 + (uint64_t)(*at - '0');
            d->exponent -= fraction;
        } else if (!fraction && d->exponent < INT_MAX / 2) {
            d->exponent++;
        }
    }
    return at;
}

/* e+12, or nothing where no digit follows the e */
static const char *take_exponent(const char *at, const char *end, int *exponent)
{
    const char *p = at;
    if (p >= end || (*p != 'e' && *p != 'E'))
        return at;
    p++;
    int negative = p < end && *p == '-', value = 0;
    if (p < end && (*p == '-' || *p == '+'))
        p++;
    if (p >= end || !is_digit(*p))
        return at;
    for (; p < end && is_digit(*p); p++)
        if (value < 100000)
            value = value * 10 + (*p - '0');
    *exponent += negative ? -value : value;
    return p;
}

/* nan, nan(0x1), inf, infinity; and what a C run-time of old printed for them after "1." */
static const char *take_word(const char *at, const char *end, double *value)
{
    size_t left = (size_t)(end - at);
    if (left >= 3 && strncasecmp(at, "inf", 3) == 0)
        *value = INFINITY;
    else if ((left >= 3 && strncasecmp(at, "nan", 3) == 0) || (left >= 1 && *at == '#'))
        *value = NAN;
    else
        return NULL;
    while (at < end && (isalnum((unsigned char)*at) || *at == '#' || *at == '(' || *at == ')'))
        at++;
    return at;
}

const char *number_parse(const char *at, const char *end, double *value)
{
    struct decimal d = {0};
    int negative = at < end && *at == '-';
    if (at < end && (*at == '-' || *at == '+'))
        at++;
    const char *after = take_digits(at, end, 0, &d);
    if (after < end && *after == '.')
        after = take_digits(after + 1, end, 1, &d);
    if (!d.n_seen || (after < end && *after == '#')) {
        after = take_word(d.n_seen ? after : at, end, value);
    } else {
        after = take_exponent(after, end, &d.exponent);
        *value = scale_by_ten(d.digits, d.exponent);
    }
    if (after && negative)
        *value = -*value;
    return after;
}

const char *number_parse_int(const char *at, const char *end, int64_t *value)
{
    int negative = at < end && *at == '-';
    if (at < end && (*at == '-' || *at == '+'))
        at++;
    if (at >= end || !is_digit(*at))
        return NULL;
    int64_t v = 0;
    for (; at < end && is_digit(*at); at++)
        if (__builtin_mul_overflow(v, 10, &v) || __builtin_add_overflow(v, *at - '0', &v))
            return NULL;
    *value = negative ? -v : v;
    return at;
}
