/* Buffered input: a source seen through a window of fixed size, with the offset of every byte.
 *
 * The window holds INPUT_CAPACITY bytes and is followed by zero bytes, so that a scanner may run
 * to the end of it without counting, and read eight bytes at once. Failures of the source and a cancelled
 * context are kept, and are what every later call answers. */
#ifndef STRANDS_INPUT_H
#define STRANDS_INPUT_H

#include <stddef.h>
#include <stdint.h>

#include "groom/format.h"

#define INPUT_CAPACITY 65536
#define INPUT_PADDING  16

struct input {
    struct groom_source source;
    const struct groom_context *context;
    unsigned char *buffer; /* [INPUT_CAPACITY + INPUT_PADDING], zero from buffer[end] on */
    size_t at, end;        /* unread: buffer[at .. end - 1] */
    uint64_t base;         /* offset in the source of buffer[0] */
    int at_end;            /* the source has given its last byte */
    groom_status status;   /* GROOM_OK, or why no more bytes come */
};

GROOM_MUST_CHECK groom_status input_init(struct input *input, const struct groom_source *source,
                                         const struct groom_context *context, struct groom_diag *diag);
void input_finish(struct input *input); /* takes a zeroed struct */

static inline uint64_t input_offset(const struct input *input) { return input->base + input->at; }
static inline size_t input_available(const struct input *input) { return input->end - input->at; }

/* Bytes still to come, or -1 where the source's size is unknown. */
int64_t input_remaining(const struct input *input);

/* Have at least n (at most INPUT_CAPACITY) bytes in the window, or all there are; returns how many
 * there are now. Pointers into the window are stale afterwards. */
size_t input_fill(struct input *input, size_t n);

/* The next n bytes (n <= INPUT_CAPACITY), consumed; valid until the next call.
 * `what` completes "..., where WHAT was expected". returns GROOM_ETRUNCATED or why reading failed */
GROOM_MUST_CHECK groom_status input_take(struct input *input, size_t n, const char *what,
                                         const unsigned char **bytes, struct groom_diag *diag);

/* As many whole records of `size` bytes as the window holds, at least 1 and at most `limit`, consumed. */
GROOM_MUST_CHECK groom_status input_records(struct input *input, size_t size, uint64_t limit,
                                            const char *what, const unsigned char **records, size_t *n,
                                            struct groom_diag *diag);

GROOM_MUST_CHECK groom_status input_skip(struct input *input, uint64_t n, const char *what,
                                         struct groom_diag *diag);

/* The failure that the end of the input means where `what` should stand. */
groom_status input_fail(const struct input *input, const char *what, struct groom_diag *diag);

/* Little-endian numbers from bytes of any alignment (the library runs on little-endian machines). */
uint16_t input_u16(const unsigned char *bytes);
uint32_t input_u32(const unsigned char *bytes);
uint64_t input_u64(const unsigned char *bytes);
float input_f32(const unsigned char *bytes);

#endif
