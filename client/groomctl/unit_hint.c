#include "client/groomctl/unit_hint.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct unit {
    const char *name;
    double metres;
} units[] = {{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"dm", 0.1}, {"in", 0.0254}};
enum { N_UNITS = sizeof units / sizeof units[0] };

/* Metres across: what is taken as it is, and what is most likely. A lock may be small, and floor-length
 * hair long; a head mesh may be a whole body. */
static const struct size_range {
    double smallest, likely, largest;
} ranges[] = {
    [SIZED_HAIR] = {0.04, 0.4, 2.5},
    [SIZED_HEAD] = {0.12, 0.6, 2.6},
};

double unit_in_metres(const char *unit)
{
    char *end;
    if (!unit)
        return 1;
    for (int i = 0; i < N_UNITS; i++)
        if (!strcmp(units[i].name, unit))
            return units[i].metres;
    double metres = strtod(unit, &end);
    return end != unit && !*end && metres > 0 && isfinite(metres) ? metres : 0;
}

const char *unit_guess(enum sized_thing thing, double extent_m, double unit_m)
{
    const struct size_range *range = &ranges[thing];
    const char *best = NULL;
    double least = INFINITY;
    if (!(extent_m > 0) || !(unit_m > 0) || (extent_m >= range->smallest && extent_m <= range->largest))
        return NULL;
    for (int i = 0; i < N_UNITS; i++) {
        double size = extent_m / unit_m * units[i].metres, off = fabs(log(size / range->likely));
        if (size < range->smallest || size > range->largest || off >= least)
            continue;
        least = off;
        best = units[i].name;
    }
    return best;
}

void unit_hint_text(enum sized_thing thing, double extent_m, double unit_m, char *text, size_t size)
{
    const char *unit = unit_guess(thing, extent_m, unit_m),
               *what = thing == SIZED_HAIR ? "the hair" : "the mesh";
    snprintf(text, size, "%s", "");
    if (!unit)
        return;
    snprintf(text, size,
             "%s is %.3g m across in the unit given; in %s it would be %.3g m. If that is meant, upload it "
             "again with --unit %s",
             what, extent_m, unit, extent_m / unit_m * unit_in_metres(unit), unit);
}
