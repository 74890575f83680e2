/* The header of a NumPy array, and its values as doubles. */
#ifndef STRANDS_NPY_H
#define STRANDS_NPY_H

#include "strands/reader.h"

#define NPY_MAX_DIMENSIONS 4

struct npy {
    char kind;     /* 'f' */
    unsigned size; /* bytes of a value: 2, 4 or 8 */
    int big_endian;
    int n_dimensions;
    uint64_t shape[NPY_MAX_DIMENSIONS];
    uint64_t n; /* values: the product of the shape */
};

/* Read magic and header; the input then stands at the first value. Refuses what is not an array of
 * floats in row-major order. */
GROOM_MUST_CHECK groom_status npy_read_header(struct input *in, struct npy *npy, struct groom_diag *diag);

/* The same, without the refusal, for arrays that are only passed over: n * size is the length of the data. */
GROOM_MUST_CHECK groom_status npy_read_any_header(struct input *in, struct npy *npy, struct groom_diag *diag);

/* Positions [strands, vertices, 3] from `in` (which may be an archive's entry) into the builder. */
GROOM_MUST_CHECK groom_status npy_read_positions(struct reader *reader, struct input *in,
                                                 const struct npy *npy);

/* Scalp coordinates [strands, 2]. */
GROOM_MUST_CHECK groom_status npy_read_root_uv(struct reader *reader, struct input *in,
                                               const struct npy *npy);

#endif
