/* The same few strands in every encoding that is read, made here byte by byte; what readers are
 * tested and fuzzed with. */
#ifndef SUPPORT_STRAND_FILES_H
#define SUPPORT_STRAND_FILES_H

#include <stddef.h>

#include "groom/format.h"

/* A growing byte string. */
struct test_bytes {
    unsigned char *bytes;
    size_t n, capacity;
};
void test_bytes_finish(struct test_bytes *bytes);
void test_put(struct test_bytes *bytes, const void *more, size_t n);
void test_put_text(struct test_bytes *bytes, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* A sink that appends; user is a struct test_bytes. */
groom_status test_sink_write(void *user, const void *bytes, size_t n);

struct strand_file {
    const char *name; /* a file name: "hair_segments.hair" */
    groom_format format;
    void (*make)(struct test_bytes *out);
    int has_root_uv;
    int n_points; /* of each of its strands: 4, or 100 */
};
extern const struct strand_file strand_files[];
extern const size_t n_strand_files;

/* The point k of strand i that each of them holds. */
void strand_file_point(int strand, int k, float out[3]);
#define STRAND_FILE_STRANDS 3

/* Read from memory, in pieces of at most `piece` bytes (0: at once, size known; else size unknown). */
groom_status test_read(const void *bytes, size_t n, size_t piece, const struct groom_read_options *options,
                       const struct groom_context *context, struct groom_strands **strands,
                       struct groom_read_report *report, struct groom_diag *diag);

#endif
