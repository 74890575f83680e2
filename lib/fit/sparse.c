#include "fit/sparse.h"

#include <string.h>

#include "base/memory.h"

#define NONE UINT32_MAX

int sparse_init(struct sparse *matrix, uint32_t n, const struct groom_allocator *allocator)
{
    *matrix = (struct sparse){.n = n, .capacity = 32 * n, .allocator = allocator};
    matrix->first = memory_array_zero(allocator, (size_t)n + 1, sizeof *matrix->first);
    matrix->slot = memory_array(allocator, n, sizeof *matrix->slot);
    matrix->column = memory_array(allocator, matrix->capacity, sizeof *matrix->column);
    matrix->value = memory_array(allocator, matrix->capacity, sizeof *matrix->value);
    for (uint32_t i = 0; matrix->slot && i < n; i++)
        matrix->slot[i] = NONE;
    return matrix->first && matrix->slot && matrix->column && matrix->value;
}

void sparse_finish(struct sparse *matrix)
{
    if (!matrix->allocator)
        return;
    memory_release(matrix->allocator, matrix->first, (size_t)matrix->n + 1, sizeof *matrix->first);
    memory_release(matrix->allocator, matrix->slot, matrix->n, sizeof *matrix->slot);
    memory_release(matrix->allocator, matrix->column, matrix->capacity, sizeof *matrix->column);
    memory_release(matrix->allocator, matrix->value, matrix->capacity, sizeof *matrix->value);
}

static int grow(struct sparse *matrix)
{
    uint32_t capacity = 2 * matrix->capacity;
    uint32_t *column = memory_array(matrix->allocator, capacity, sizeof *column);
    double (*value)[SPARSE_WIDTH] = memory_array(matrix->allocator, capacity, sizeof *value);
    if (!column || !value) {
        memory_release(matrix->allocator, column, capacity, sizeof *column);
        memory_release(matrix->allocator, value, capacity, sizeof *value);
        return 0;
    }
    memcpy(column, matrix->column, matrix->capacity * sizeof *column);
    memcpy(value, matrix->value, matrix->capacity * sizeof *value);
    memory_release(matrix->allocator, matrix->column, matrix->capacity, sizeof *column);
    memory_release(matrix->allocator, matrix->value, matrix->capacity, sizeof *value);
    matrix->column = column;
    matrix->value = value;
    matrix->capacity = capacity;
    return 1;
}

double *sparse_entry(struct sparse *matrix, uint32_t row, uint32_t column)
{
    uint32_t at = matrix->slot[column];
    if (at == NONE) {
        at = matrix->first[row + 1];
        if (at == matrix->capacity && !grow(matrix))
            return NULL;
        matrix->slot[column] = at;
        matrix->column[at] = column;
        memset(matrix->value[at], 0, sizeof matrix->value[at]);
        matrix->first[row + 1]++;
    }
    return matrix->value[at];
}

void sparse_end_row(struct sparse *matrix, uint32_t row)
{
    for (uint32_t at = matrix->first[row]; at < matrix->first[row + 1]; at++)
        matrix->slot[matrix->column[at]] = NONE;
    if (row + 1 < matrix->n)
        matrix->first[row + 2] = matrix->first[row + 1];
}
