/* A wrong unit shows in the size: hair is not 30 metres across. */
#ifndef GROOMCTL_UNIT_HINT_H
#define GROOMCTL_UNIT_HINT_H

#include <stddef.h>

enum sized_thing { SIZED_HAIR, SIZED_HEAD /* a head or a whole body */ };

/* The unit in which a thing that is `extent_m` metres across, read in units of unit_m metres, would
 * have a plausible size; NULL where it has one already, or in no unit. */
const char *unit_guess(enum sized_thing thing, double extent_m, double unit_m);

/* A sentence for the person who uploaded it, or "". */
void unit_hint_text(enum sized_thing thing, double extent_m, double unit_m, char *text, size_t size);

/* The box around a thing, metres, as an upload's answer says it. */
struct sized_box {
    double low[3], high[3];
};

/* Hair grows from a head. Where the two lie apart, a sentence about what sets them apart (an axis, or a
 * size), else "". */
void apart_hint_text(const struct sized_box *hair, const struct sized_box *head, char *text, size_t size);

/* "cm" or "0.01" -> 0.01; NULL -> 1; 0 where it is neither. */
double unit_in_metres(const char *unit);

#endif
