/* A number out of text, quickly and without a locale: what the readers of text files share. */
#ifndef BASE_NUMBER_H
#define BASE_NUMBER_H

#include <stdint.h>

/* Read the decimal number that begins at `at`; `end` bounds the text (which needs no zero byte).
 * "nan", "inf" and their spellings, "1.#IND" among them, are read as NaN or infinity. Correctly
 * rounded for up to 15 digits and exponents to 22, within an ulp beyond.
 * returns  the character after it, or NULL where no number stands */
const char *number_parse(const char *at, const char *end, double *value);

/* The same for a whole number with an optional sign; NULL also where it leaves int64. */
const char *number_parse_int(const char *at, const char *end, int64_t *value);

#endif
