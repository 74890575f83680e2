#include "client/groomctl/unit_hint.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Few files are in the last two: with one of them the size must come twice as close. */
static const struct unit {
    const char *name;
    double metres, rarity;
} units[] = {{"m", 1, 1}, {"cm", 0.01, 1}, {"mm", 0.001, 1}, {"dm", 0.1, 2}, {"in", 0.0254, 2}};
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
        double size = extent_m / unit_m * units[i].metres, off = fabs(log(size / range->likely)) + log(units[i].rarity);
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

/* --- hair beside its head ------------------------------------------------------------------------ */

static int touch(const struct sized_box *a, const struct sized_box *b)
{
    for (int k = 0; k < 3; k++)
        if (a->low[k] > b->high[k] || b->low[k] > a->high[k])
            return 0;
    return 1;
}

/* The box of the same file read with the other up axis: (x, y, z) with z up is (x, z, -y). */
static struct sized_box turned(const struct sized_box *box, int was_z)
{
    struct sized_box out = *box;
    int from = was_z ? 2 : 1, to = was_z ? 1 : 2; /* the axis that keeps its sign is y or z */
    out.low[to] = -box->high[from];
    out.high[to] = -box->low[from];
    out.low[from] = box->low[to];
    out.high[from] = box->high[to];
    return out;
}

static double extent(const struct sized_box *box)
{
    double most = 0;
    for (int k = 0; k < 3; k++)
        most = fmax(most, box->high[k] - box->low[k]);
    return most;
}

void apart_hint_text(const struct sized_box *hair, const struct sized_box *head, char *text, size_t size)
{
    double ratio = extent(hair) / extent(head);
    snprintf(text, size, "%s", "");
    if (!isfinite(ratio) || (touch(hair, head) && ratio <= 8))
        return;
    if (ratio > 8 || ratio < 0.02) {
        snprintf(text, size, "the hair is %.3g m across and the head %.3g m: was one of them given another unit?", extent(hair),
                 extent(head));
        return;
    }
    for (int was_z = 0; was_z < 2; was_z++) {
        struct sized_box hair_turned = turned(hair, was_z), head_turned = turned(head, was_z);
        if (touch(&hair_turned, head) || touch(hair, &head_turned)) {
            snprintf(text, size, "the hair and the head lie apart; with the other up axis for one of them (--up, --head-up) they would meet");
            return;
        }
    }
    snprintf(text, size, "the hair (around %.3g %.3g %.3g m) and the head (around %.3g %.3g %.3g m) lie apart: are they of one capture?",
             0.5 * (hair->low[0] + hair->high[0]), 0.5 * (hair->low[1] + hair->high[1]), 0.5 * (hair->low[2] + hair->high[2]),
             0.5 * (head->low[0] + head->high[0]), 0.5 * (head->low[1] + head->high[1]), 0.5 * (head->low[2] + head->high[2]));
}
