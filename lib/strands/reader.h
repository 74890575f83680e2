/* What every reader gets, and the readers, one a format. Each reads from the first byte, puts the
 * strands into `out`, and returns a failure with its diag filled, byte offset included. */
#ifndef STRANDS_READER_H
#define STRANDS_READER_H

#include "strands/builder.h"
#include "strands/input.h"

struct reader {
    struct input *in;
    struct builder *out;
    struct groom_read_report *report;
    struct groom_diag *diag;
    const struct groom_context *context;
};

typedef groom_status read_function(struct reader *reader);
read_function read_hair, read_monohair, read_data, read_ct2hair, read_ply, read_tfx, read_obj, read_json,
    read_npy, read_npz;

/* n points of three floats, `stride` bytes apart, from the input into the builder. */
GROOM_MUST_CHECK groom_status read_points_f32(struct reader *reader, uint64_t n, size_t stride,
                                              const char *what);
/* The next n points are a strand. */
GROOM_MUST_CHECK groom_status read_cut(struct reader *reader, uint64_t n);
/* Refuse counts that the bytes still to come cannot hold, and more than the limit; where they can,
 * reserve. `bytes` is the least that n_strands and n_vertices take from here on. */
GROOM_MUST_CHECK groom_status read_expect(struct reader *reader, uint64_t n_strands, uint64_t n_vertices,
                                          uint64_t bytes);
/* Warn of bytes after the last one that means something. */
void read_warn_trailing(struct reader *reader);

#endif
