/* A sparse square matrix whose entries are short vectors. */
#ifndef FIT_SPARSE_H
#define FIT_SPARSE_H

#include <stdint.h>

#include "groom/context.h"

#define SPARSE_WIDTH 5

struct sparse {
    uint32_t n;
    uint32_t *first;                /* [n + 1] */
    uint32_t *column;               /* [first[n]] of a row in the order in which they were first added */
    double (*value)[SPARSE_WIDTH];
    uint32_t capacity;              /* of column and value */
    uint32_t *slot;                 /* [n] where the open row has a column; UINT32_MAX: it has none */
    const struct groom_allocator *allocator;
};

/* No row yet: they are filled in order, each by sparse_entry, and ended by sparse_end_row.
 * returns 0 where memory is out; finish it in any case */
int sparse_init(struct sparse *matrix, uint32_t n, const struct groom_allocator *allocator);
void sparse_finish(struct sparse *matrix);
/* The entry of the open row and this column, made 0 where it is new; NULL where memory is out. */
double *sparse_entry(struct sparse *matrix, uint32_t row, uint32_t column);
void sparse_end_row(struct sparse *matrix, uint32_t row);

#endif
