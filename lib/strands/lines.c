#include "strands/lines.h"

#include <string.h>

#define NONE UINT32_MAX
enum { USED = 1, HAS_PREVIOUS = 2, WHOLE = 4 /* of a polyline that nothing joins */, PLACED = 8 };

void lines_init(struct lines *lines, struct builder *out, const struct groom_allocator *allocator)
{
    *lines = (struct lines){.out = out, .last = NONE};
    chunks_init(&lines->next, allocator, sizeof(uint32_t));
    chunks_init(&lines->flags, allocator, 1);
    chunks_init(&lines->roots, allocator, sizeof(uint32_t));
}

void lines_finish(struct lines *lines)
{
    chunks_finish(&lines->next);
    chunks_finish(&lines->flags);
    chunks_finish(&lines->roots);
}

static uint32_t *next_of(struct lines *lines, uint32_t i) { return chunks_at(&lines->next, i); }
static unsigned char *flags_of(struct lines *lines, uint32_t i) { return chunks_at(&lines->flags, i); }

/* One entry for each point that the builder has. */
static int keep_up(struct lines *lines)
{
    while (lines->next.n < lines->out->points.n) {
        uint32_t *next = chunks_push(&lines->next);
        unsigned char *flags = next ? chunks_push(&lines->flags) : NULL;
        if (!flags) {
            lines->out->status = GROOM_ENOMEM;
            return 0;
        }
        *next = NONE;
        *flags = 0;
    }
    return 1;
}

static int repeat(struct lines *lines, uint32_t *index)
{
    if (lines->out->points.n >= NONE) {
        lines->out->status = GROOM_ETOOBIG;
        return 0;
    }
    if (!builder_repeat(lines->out, *index))
        return 0;
    *index = (uint32_t)(lines->out->points.n - 1);
    lines->n_repeated++;
    return keep_up(lines);
}

int lines_edge(struct lines *lines, uint32_t from, uint32_t to)
{
    if (!keep_up(lines))
        return 0;
    if ((*next_of(lines, from) != NONE || (*flags_of(lines, from) & WHOLE)) && !repeat(lines, &from))
        return 0;
    if ((*flags_of(lines, to) & (HAS_PREVIOUS | WHOLE) || to == from) && !repeat(lines, &to))
        return 0;
    *next_of(lines, from) = to;
    *flags_of(lines, from) |= USED;
    *flags_of(lines, to) |= USED | HAS_PREVIOUS;
    return 1;
}

static int push_index(struct lines *lines, struct chunks *list, uint32_t index)
{
    uint32_t *slot = chunks_push(list);
    if (!slot) {
        lines->out->status = GROOM_ENOMEM;
        return 0;
    }
    *slot = index;
    return 1;
}

int lines_begin(struct lines *lines, uint32_t from)
{
    if (!keep_up(lines) || ((*flags_of(lines, from) & USED) && !repeat(lines, &from)))
        return 0;
    uint64_t n = lines->roots.n;
    lines->descends |= n > 0 && *(uint32_t *)chunks_at(&lines->roots, n - 1) > from;
    if (!push_index(lines, &lines->roots, from))
        return 0;
    *flags_of(lines, from) |= USED | WHOLE;
    lines->last = from;
    return 1;
}

int lines_continue(struct lines *lines, uint32_t to)
{
    if ((*flags_of(lines, to) & USED) && !repeat(lines, &to))
        return 0;
    *next_of(lines, lines->last) = to;
    *flags_of(lines, to) |= USED | HAS_PREVIOUS | WHOLE;
    lines->last = to;
    return 1;
}

/* --- putting in order -------------------------------------------------------------- */

/* Walk a strand from its root; each `next` on the way becomes the point's place. */
static uint32_t place_strand(struct lines *lines, uint32_t root, uint32_t place)
{
    for (uint32_t i = root; i != NONE && !(*flags_of(lines, i) & PLACED);) {
        uint32_t *next = next_of(lines, i), following = *next;
        *flags_of(lines, i) |= PLACED;
        *next = place++;
        i = following;
    }
    return place;
}

/* The strands that are being put in order. */
struct order {
    struct chunks lengths; /* uint32_t of each strand */
    uint32_t place;        /* the next one */
};

static int place_next(struct lines *lines, struct order *order, uint32_t root)
{
    uint32_t end = place_strand(lines, root, order->place);
    if (!push_index(lines, &order->lengths, end - order->place))
        return 0;
    order->place = end;
    return 1;
}

static int place_polylines(struct lines *lines, struct order *order)
{
    for (uint64_t i = 0; i < lines->roots.n; i++)
        if (!place_next(lines, order, *(uint32_t *)chunks_at(&lines->roots, i)))
            return 0;
    return 1;
}

/* By vertex, those whose flags under the mask are USED alone. */
static int place_by_vertex(struct lines *lines, struct order *order, unsigned mask)
{
    for (uint32_t i = 0; i < lines->next.n; i++)
        if ((*flags_of(lines, i) & mask) == USED && !place_next(lines, order, i))
            return 0;
    return 1;
}

/* The rest, so that places are a permutation. */
static void place_unused(struct lines *lines, uint32_t place)
{
    for (uint32_t i = 0; i < lines->next.n; i++)
        if (!(*flags_of(lines, i) & PLACED))
            *next_of(lines, i) = place++;
}

static void swap_points(struct chunks *points, uint32_t i, uint32_t j)
{
    float rest[3], *a = chunks_at(points, i), *b = chunks_at(points, j);
    memcpy(rest, a, sizeof rest);
    memcpy(a, b, sizeof rest);
    memcpy(b, rest, sizeof rest);
}

/* Follow each cycle of the permutation; every swap brings one point to its place. */
static void permute(struct lines *lines)
{
    for (uint32_t i = 0; i < lines->next.n; i++)
        for (uint32_t *place = next_of(lines, i); *place != i;) {
            uint32_t to = *place, *place_of_other = next_of(lines, to);
            swap_points(&lines->out->points, i, to);
            *place = *place_of_other;
            *place_of_other = to;
        }
}

static int cut_all(struct lines *lines, const struct chunks *lengths)
{
    for (uint64_t i = 0; i < lengths->n; i++)
        if (!builder_cut(lines->out, *(uint32_t *)chunks_at(lengths, i)))
            return 0;
    return 1;
}

static void warn(const struct lines *lines, uint64_t n_loops, uint64_t n_unused)
{
    struct groom_read_report *report = lines->out->report;
    if (n_unused)
        report_warn(report, "%llu vertices belong to no line", (unsigned long long)n_unused);
    if (lines->n_repeated)
        report_warn(report, "%llu vertices are shared by lines that are not one strand, and were repeated",
                    (unsigned long long)lines->n_repeated);
    if (n_loops)
        report_warn(report, "%llu closed lines were opened at their first vertex",
                    (unsigned long long)n_loops);
}

int lines_cut(struct lines *lines)
{
    struct order order = {0};
    uint64_t n_open;
    int done = 0;
    chunks_init(&order.lengths, lines->next.allocator, sizeof(uint32_t));
    if (!keep_up(lines) || (lines->descends && !place_polylines(lines, &order)) ||
        !place_by_vertex(lines, &order, USED | HAS_PREVIOUS | PLACED))
        goto out;
    n_open = order.lengths.n;
    if (!place_by_vertex(lines, &order, USED | PLACED)) /* what is left has no beginning: closed lines */
        goto out;
    warn(lines, order.lengths.n - n_open, lines->next.n - order.place);
    place_unused(lines, order.place);
    permute(lines);
    lines_finish(lines);
    done = cut_all(lines, &order.lengths);
out:
    chunks_finish(&order.lengths);
    return done;
}
