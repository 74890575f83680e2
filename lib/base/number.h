/* Decimal numbers from text and into text, independent of the locale. */
#ifndef BASE_NUMBER_H
#define BASE_NUMBER_H

#include <stddef.h>

/* The number at `text`, which ends in a byte that is no part of a number (the input's zero byte):
 * [+-] digits [. digits] [e [+-] digits], with a digit at least before or after the point.
 * Correctly rounded where the digits without point are below 2^53 and the power of ten within 22
 * (every %.9g float); otherwise within 0.51 units in the last place of a double.
 * returns  the first byte after it, or NULL where no number stands there */
const unsigned char *number_scan(const unsigned char *text, double *value);

/* The same, faster, where NUMBER_PADDING bytes after the end of the text may be read (the input's buffer). */
#define NUMBER_PADDING 8
const unsigned char *number_scan_padded(const unsigned char *text, double *value);

/* The same, padded as well, that also takes what files hold in place of numbers: nan, inf, infinity in
 * either case, nan(0x1), and the 1.#IND, 1.#INF of an older C library (all of which are read as NaN). */
const unsigned char *number_scan_any(const unsigned char *text, double *value);

/* A whole number of up to 18 digits with an optional sign. */
const unsigned char *number_scan_integer(const unsigned char *text, long long *value);

#define NUMBER_MAX 24
/* Writes what printf's %.9g writes, without the terminating zero; returns the length (below NUMBER_MAX). */
size_t number_print(char *out, float value);

/* Decimal digits of a whole number (at most 20); returns the length. */
size_t number_print_integer(char *out, unsigned long long value);

#endif
