/* Up-looking Cholesky (Davis, "Direct Methods for Sparse Linear Systems", 2006, chapter 4). */
#include "base/cholesky.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"

#define NONE UINT32_MAX
#define LEAF 24 /* parts this small are not dissected further */

struct cholesky {
    uint32_t n;
    const uint32_t *first, *column;  /* the pattern */
    uint32_t *order, *place;         /* [n] the variable at each place, and its inverse */
    uint32_t *parent;                /* [n] elimination tree, by place */
    uint64_t *start;                 /* [n + 1] of each column of L */
    uint32_t *row;                   /* [start[n]] diagonal first, then ascending */
    double *value;                   /* [start[n]] */
    uint64_t *fill;                  /* [n] where the next entry of a column goes */
    uint32_t *mark, *stack, *pattern; /* [n] scratch */
    double *x;                       /* [n] scratch */
    const struct groom_allocator *allocator;
};

/* --- ordering ------------------------------------------------------------------------------ */

/* Scratch of the dissection: `part` names the part that a vertex is in. */
struct dissection {
    const uint32_t *first, *column;
    uint32_t *part, *level, *queue; /* [n] */
    uint32_t *order;                /* filled from the end */
    uint32_t n_placed, n_parts, n;
};

/* Breadth-first levels of the part of `seed`; fills queue. returns how many were reached */
static uint32_t levels_from(struct dissection *d, uint32_t seed)
{
    uint32_t count = 0, part = d->part[seed];
    d->queue[count++] = seed;
    d->level[seed] = 0;
    d->part[seed] = NONE - 1; /* seen */
    for (uint32_t at = 0; at < count; at++) {
        uint32_t v = d->queue[at];
        for (uint32_t e = d->first[v]; e < d->first[v + 1]; e++) {
            uint32_t w = d->column[e];
            if (d->part[w] != part)
                continue;
            d->part[w] = NONE - 1;
            d->level[w] = d->level[v] + 1;
            d->queue[count++] = w;
        }
    }
    for (uint32_t i = 0; i < count; i++)
        d->part[d->queue[i]] = part;
    return count;
}

static void place_last(struct dissection *d, uint32_t v)
{
    d->part[v] = NONE;
    d->order[d->n - ++d->n_placed] = v;
}

/* The thinnest level among those that leave a third on either side, never the last. queue holds the
 * part by levels, the deepest at its end. */
static uint32_t thinnest_level(const struct dissection *d, uint32_t count)
{
    uint32_t best = d->level[d->queue[count / 2]], size = NONE;
    for (uint32_t i = 0, next; i < count; i = next) {
        for (next = i; next < count && d->level[d->queue[next]] == d->level[d->queue[i]]; next++)
            ;
        if (i >= count / 3 && next <= count - count / 3 && next - i < size) {
            size = next - i;
            best = d->level[d->queue[i]];
        }
    }
    uint32_t last = d->level[d->queue[count - 1]];
    return best < last ? best : last - 1;
}

static int touches(const struct dissection *d, uint32_t v, uint32_t part)
{
    for (uint32_t e = d->first[v]; e < d->first[v + 1]; e++)
        if (d->part[d->column[e]] == part)
            return 1;
    return 0;
}

/* One connected part that starts at `seed`: its separator goes last, then the two sides are dissected. */
static void dissect(struct dissection *d, uint32_t seed, uint32_t *todo, uint32_t *n_todo)
{
    uint32_t count = levels_from(d, seed);
    count = levels_from(d, d->queue[count - 1]); /* from the far end: long and thin levels */
    uint32_t depth = d->level[d->queue[count - 1]];
    if (count <= LEAF || depth < 2) {
        for (uint32_t i = count; i-- > 0;)
            place_last(d, d->queue[i]);
        return;
    }
    uint32_t middle = thinnest_level(d, count), low = d->n_parts++, high = d->n_parts++;
    for (uint32_t i = 0; i < count; i++)
        d->part[d->queue[i]] = d->level[d->queue[i]] <= middle ? low : high;
    for (uint32_t i = 0; i < count; i++) /* of the level only what reaches the far side need part the two */
        if (d->level[d->queue[i]] == middle && touches(d, d->queue[i], high))
            place_last(d, d->queue[i]);
    for (uint32_t i = 0; i < count; i++) /* a seed for every piece of the two sides; most are met twice */
        if (d->part[d->queue[i]] != NONE && (i == 0 || d->level[d->queue[i]] == middle + 1 || d->level[d->queue[i]] == middle))
            todo[(*n_todo)++] = d->queue[i];
}

/* todo [4 n] holds seeds, those placed meanwhile among them; where it gets full it is emptied, and what
 * is forgotten by that is found from the first vertex that is left. */
static void order_all(struct dissection *d, uint32_t *todo)
{
    for (uint32_t seed = 0; seed < d->n; seed++)
        while (d->part[seed] != NONE) {
            uint32_t n_todo = 0;
            todo[n_todo++] = seed;
            while (n_todo) {
                uint32_t v = todo[--n_todo];
                if (d->part[v] != NONE)
                    dissect(d, v, todo, &n_todo);
                if (n_todo > 3 * (size_t)d->n)
                    n_todo = 0;
            }
        }
}

static int find_order(struct cholesky *factor)
{
    const struct groom_allocator *allocator = factor->allocator;
    uint32_t n = factor->n;
    uint32_t *scratch = memory_array_zero(allocator, (size_t)7 * n + 8, sizeof *scratch);
    if (!scratch)
        return 0;
    struct dissection d = {factor->first, factor->column, scratch, scratch + n, scratch + 2 * (size_t)n, factor->order, 0, 1, n};
    order_all(&d, scratch + 3 * (size_t)n);
    for (uint32_t i = 0; i < n; i++)
        factor->place[factor->order[i]] = i;
    memory_release(allocator, scratch, (size_t)7 * n + 8, sizeof *scratch);
    return 1;
}

/* --- the pattern of L ------------------------------------------------------------------------ */

static void find_tree(struct cholesky *factor)
{
    uint32_t *ancestor = factor->mark;
    for (uint32_t k = 0; k < factor->n; k++) {
        uint32_t v = factor->order[k];
        factor->parent[k] = ancestor[k] = NONE;
        for (uint32_t e = factor->first[v]; e < factor->first[v + 1]; e++)
            for (uint32_t i = factor->place[factor->column[e]], next; i < k; i = next) {
                next = ancestor[i];
                ancestor[i] = k;
                if (next == NONE) {
                    factor->parent[i] = k;
                    break;
                }
            }
    }
}

/* The columns of row k of L, in an order that eliminates each before those it reaches:
 * pattern[top .. n - 1]. returns top */
static uint32_t row_pattern(struct cholesky *factor, uint32_t k)
{
    uint32_t top = factor->n, v = factor->order[k];
    factor->mark[k] = k;
    for (uint32_t e = factor->first[v]; e < factor->first[v + 1]; e++) {
        uint32_t n = 0;
        for (uint32_t i = factor->place[factor->column[e]]; i < k && factor->mark[i] != k; i = factor->parent[i]) {
            factor->stack[n++] = i;
            factor->mark[i] = k;
        }
        while (n > 0)
            factor->pattern[--top] = factor->stack[--n];
    }
    return top;
}

static int size_columns(struct cholesky *factor)
{
    uint32_t n = factor->n;
    memset(factor->mark, 0xff, n * sizeof *factor->mark);
    memset(factor->start, 0, ((size_t)n + 1) * sizeof *factor->start);
    for (uint32_t k = 0; k < n; k++) {
        factor->start[k + 1]++;
        for (uint32_t at = row_pattern(factor, k); at < n; at++)
            factor->start[factor->pattern[at] + 1]++;
    }
    for (uint32_t k = 0; k < n; k++)
        factor->start[k + 1] += factor->start[k];
    factor->row = memory_array(factor->allocator, factor->start[n], sizeof *factor->row);
    factor->value = memory_array(factor->allocator, factor->start[n], sizeof *factor->value);
    return factor->row && factor->value;
}

struct cholesky *cholesky_create(uint32_t n, const uint32_t *first, const uint32_t *column,
                                 const struct groom_allocator *allocator)
{
    struct cholesky *factor = memory_array_zero(allocator, 1, sizeof *factor);
    if (!factor)
        return NULL;
    *factor = (struct cholesky){.n = n, .first = first, .column = column, .allocator = allocator};
    uint32_t **arrays[] = {&factor->order, &factor->place, &factor->parent, &factor->mark, &factor->stack, &factor->pattern};
    int sound = 1;
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++)
        sound &= (*arrays[i] = memory_array(allocator, n, sizeof **arrays[i])) != NULL;
    factor->start = memory_array(allocator, (size_t)n + 1, sizeof *factor->start);
    factor->fill = memory_array(allocator, n, sizeof *factor->fill);
    factor->x = memory_array_zero(allocator, n, sizeof *factor->x);
    if (sound && factor->start && factor->fill && factor->x && find_order(factor)) {
        find_tree(factor);
        if (size_columns(factor))
            return factor;
    }
    cholesky_destroy(factor);
    return NULL;
}

void cholesky_destroy(struct cholesky *factor)
{
    if (!factor)
        return;
    const struct groom_allocator *allocator = factor->allocator;
    uint32_t *arrays[] = {factor->order, factor->place, factor->parent, factor->mark, factor->stack, factor->pattern};
    uint64_t n_entries = factor->row || factor->value ? factor->start[factor->n] : 0;
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++)
        memory_release(allocator, arrays[i], factor->n, sizeof *arrays[i]);
    memory_release(allocator, factor->row, n_entries, sizeof *factor->row);
    memory_release(allocator, factor->value, n_entries, sizeof *factor->value);
    memory_release(allocator, factor->start, (size_t)factor->n + 1, sizeof *factor->start);
    memory_release(allocator, factor->fill, factor->n, sizeof *factor->fill);
    memory_release(allocator, factor->x, factor->n, sizeof *factor->x);
    memory_release(allocator, factor, 1, sizeof *factor);
}

/* --- numbers ------------------------------------------------------------------------------------ */

/* Row k: x holds the matrix's row; each column it meets takes its part away. returns the diagonal left */
static double eliminate_row(struct cholesky *factor, uint32_t k, uint32_t top, double diagonal)
{
    double *x = factor->x;
    for (uint32_t at = top; at < factor->n; at++) {
        uint32_t i = factor->pattern[at];
        double l = x[i] / factor->value[factor->start[i]];
        x[i] = 0;
        for (uint64_t p = factor->start[i] + 1; p < factor->fill[i]; p++)
            x[factor->row[p]] -= factor->value[p] * l;
        diagonal -= l * l;
        factor->row[factor->fill[i]] = k;
        factor->value[factor->fill[i]++] = l;
    }
    return diagonal;
}

int cholesky_factor(struct cholesky *factor, const double *value)
{
    memset(factor->mark, 0xff, factor->n * sizeof *factor->mark);
    memset(factor->x, 0, factor->n * sizeof *factor->x);
    for (uint32_t k = 0; k < factor->n; k++)
        factor->fill[k] = factor->start[k];
    for (uint32_t k = 0; k < factor->n; k++) {
        uint32_t v = factor->order[k], top = row_pattern(factor, k);
        double diagonal = 0;
        for (uint32_t e = factor->first[v]; e < factor->first[v + 1]; e++) {
            uint32_t i = factor->place[factor->column[e]];
            if (i < k)
                factor->x[i] = value[e];
            else if (i == k)
                diagonal = value[e];
        }
        diagonal = eliminate_row(factor, k, top, diagonal);
        if (!(diagonal > 0) || !isfinite(diagonal))
            return 0;
        factor->row[factor->fill[k]] = k;
        factor->value[factor->fill[k]++] = sqrt(diagonal);
    }
    return 1;
}

void cholesky_solve(const struct cholesky *factor, double *x)
{
    double *y = factor->x;
    for (uint32_t k = 0; k < factor->n; k++)
        y[k] = x[factor->order[k]];
    for (uint32_t k = 0; k < factor->n; k++) {
        double v = y[k] /= factor->value[factor->start[k]];
        for (uint64_t p = factor->start[k] + 1; p < factor->start[k + 1]; p++)
            y[factor->row[p]] -= factor->value[p] * v;
    }
    for (uint32_t k = factor->n; k-- > 0;) {
        double v = y[k];
        for (uint64_t p = factor->start[k] + 1; p < factor->start[k + 1]; p++)
            v -= factor->value[p] * y[factor->row[p]];
        y[k] = v / factor->value[factor->start[k]];
    }
    for (uint32_t k = 0; k < factor->n; k++)
        x[factor->order[k]] = y[k];
}
