/* Damerau and Levenshtein's distance, of adjacent swaps. */
#include "client/groomctl/nearest.h"

#include <string.h>

#define LONGEST 32

static size_t least(size_t a, size_t b) { return a < b ? a : b; }

static size_t distance(const char *a, size_t n, const char *b, size_t m)
{
    size_t rows[3][LONGEST + 1]; /* of i - 2, i - 1 and i */
    for (size_t j = 0; j <= m; j++)
        rows[0][j] = rows[1][j] = j;
    for (size_t i = 1; i <= n; i++) {
        size_t *row = rows[2];
        row[0] = i;
        for (size_t j = 1; j <= m; j++) {
            row[j] = least(least(row[j - 1], rows[1][j]) + 1, rows[1][j - 1] + (a[i - 1] != b[j - 1]));
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = least(row[j], rows[0][j - 2] + 1);
        }
        memcpy(rows[0], rows[1], sizeof rows[0]);
        memcpy(rows[1], rows[2], sizeof rows[1]);
    }
    return rows[1][m];
}

void nearest_init(struct nearest *nearest, const char *typed, size_t n_typed)
{
    /* a third of the letters may be wrong */
    *nearest = (struct nearest){.typed = typed, .n_typed = n_typed, .distance = n_typed / 3 + 2};
}

void nearest_offer(struct nearest *nearest, const char *name)
{
    size_t m = strlen(name);
    if (nearest->n_typed > LONGEST || m > LONGEST)
        return;
    size_t d = distance(nearest->typed, nearest->n_typed, name, m);
    /* the beginning of a longer name is as good as one wrong letter */
    if (nearest->n_typed >= 2 && m > nearest->n_typed && !strncmp(nearest->typed, name, nearest->n_typed))
        d = least(d, 1);
    if (d < nearest->distance && d < m) {
        nearest->distance = d;
        nearest->name = name;
    }
}
