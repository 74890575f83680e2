/* Strand files: readers recognised by content, streaming writers.
 *
 * Memory while reading stays within twice the strands' own float32 size, JSON
 * included. A reader believes nothing: counts are checked against the bytes
 * that are there, values against NaN and infinity; what cannot be read is
 * refused with its byte offset, what cannot be used (a strand of fewer than two
 * vertices, of no length, with a value that is not finite) is dropped and counted. */
#ifndef GROOM_FORMAT_H
#define GROOM_FORMAT_H

#include <stddef.h>
#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/io.h"
#include "groom/strands.h"

#ifdef __cplusplus
extern "C" {
#endif

/* X(constant, name in options and URLs, media type, file extension, readable, writable, what it is) */
#define GROOM_FORMAT_LIST(X)                                                                         \
    X(GROOM_FORMAT_HAIR,        "hair",        "application/x-hair",         "hair", 1, 1, "Cem Yuksel HAIR")            \
    X(GROOM_FORMAT_MONOHAIR,    "monohair",    "application/x-monohair",     "hair", 1, 0, "MonoHair .hair")             \
    X(GROOM_FORMAT_DATA,        "data",        "application/x-hair-data",    "data", 1, 1, "USC-HairSalon .data")        \
    X(GROOM_FORMAT_CT2HAIR,     "ct2hair",     "application/x-ct2hair",      "bin",  1, 0, "CT2Hair .bin")               \
    X(GROOM_FORMAT_PLY,         "ply",         "application/x-ply",          "ply",  1, 1, "PLY")                        \
    X(GROOM_FORMAT_TFX,         "tfx",         "application/x-tressfx",      "tfx",  1, 0, "TressFX .tfx")               \
    X(GROOM_FORMAT_OBJ,         "obj",         "model/obj",                  "obj",  1, 1, "OBJ polylines")              \
    X(GROOM_FORMAT_JSON,        "json",        "application/json",           "json", 1, 1, "JSON strands")               \
    X(GROOM_FORMAT_NPY,         "npy",         "application/x-npy",          "npy",  1, 0, "NumPy .npy")                 \
    X(GROOM_FORMAT_NPZ,         "npz",         "application/x-npz",          "npz",  1, 0, "NumPy .npz of DiffLocks")    \
    X(GROOM_FORMAT_USDA,        "usda",        "model/vnd.usda",             "usda", 0, 1, "USD ASCII BasisCurves")

typedef enum groom_format {
    GROOM_FORMAT_AUTO = 0,
#define GROOM_FORMAT_ENUM(name, slug, media, extension, r, w, text) name,
    GROOM_FORMAT_LIST(GROOM_FORMAT_ENUM)
#undef GROOM_FORMAT_ENUM
    GROOM_FORMAT_COUNT
} groom_format;

const char *groom_format_name(groom_format format);       /* "hair"; "auto" for GROOM_FORMAT_AUTO */
const char *groom_format_media_type(groom_format format);
const char *groom_format_extension(groom_format format);
int groom_format_readable(groom_format format);
int groom_format_writable(groom_format format);

/* "hair" -> GROOM_FORMAT_HAIR. "usd" is taken for "usda", "bin" for "ct2hair".
 * returns  GROOM_OK, GROOM_EINVAL with the list of names in diag */
GROOM_MUST_CHECK groom_status groom_format_parse(const char *name, groom_format *format,
                                                 struct groom_diag *diag);

/* --- reading -------------------------------------------------------------- */

struct groom_read_options {
    groom_format format;      /* GROOM_FORMAT_AUTO: recognised from the bytes */
    struct groom_frame frame; /* {0}: metres, y up */
    uint64_t max_vertices;    /* refuse more with GROOM_ETOOBIG; 0: 2^32-1 */
};

#define GROOM_READ_MAX_WARNINGS 8
struct groom_read_report {
    groom_format format;       /* what it was read as */
    uint64_t n_strands_in_file;
    uint64_t n_dropped_short;      /* 0 or 1 vertex */
    uint64_t n_dropped_zero_length;
    uint64_t n_dropped_not_finite;
    uint32_t n_warnings;
    char warnings[GROOM_READ_MAX_WARNINGS][160]; /* sentences, the counts above among them */
};

/* Read strands, convert to metres and y up (in double, rounded once to float).
 *
 * A coordinate beyond 1000 km counts as not finite: no head is there, and its square would overflow later.
 * JSON's null, NaN and Infinity are values that are not finite; "strands" is read, other members are
 * passed over, and the array of strands alone is taken as well. PLY that says nothing of strands is taken
 * for 100 points each (NeuralHaircut, GaussianHaircut). Lines of two indices (OBJ, PLY edges) are rejoined
 * in any order. Scalp coordinates come with .tfx and .npz (root_uv). Memory beyond twice the strands'
 * own arrays is some 160 KiB of windows.
 *
 * source   read from where it stands, front to back; it may be a pipe
 * report   may be NULL
 * returns  GROOM_OK; GROOM_EUNKNOWN, GROOM_EFORMAT, GROOM_ETRUNCATED, GROOM_ETOOBIG, GROOM_EEMPTY
 *          (no strand is usable), GROOM_EIO, GROOM_ENOMEM, each with a diag that names the byte
 *          offset and what was expected there */
GROOM_MUST_CHECK groom_status groom_strands_read(const struct groom_source *source,
                                                 const struct groom_read_options *options,
                                                 const struct groom_context *context,
                                                 struct groom_strands **strands,
                                                 struct groom_read_report *report,
                                                 struct groom_diag *diag);

/* --- writing -------------------------------------------------------------- */

struct groom_write_options {
    groom_format format;
    struct groom_frame frame; /* of the file to write; {0}: metres, y up */
    float width_m;            /* of a hair, where the format carries one; 0: 0.00008 */
};

struct groom_writer;

/* What is written: HAIR with its list of segments; PLY, binary little-endian, with elements vertex (x y z),
 * strand (nsegs) and edge (vertex1 vertex2), which is what reads back and what viewers without strands show;
 * OBJ with one `l` after the vertices of each strand; numbers in text as %.9g, which every float survives.
 *
 * Start a file whose layout is known: the vertex count of each strand. Points follow in order,
 * in any number of pieces, so that a groom is written while it is evaluated; memory is bounded
 * whatever the size.
 * vertex_counts  [n_strands], borrowed until finish; NULL where all have uniform_count
 * returns        GROOM_OK, GROOM_EINVAL (format not writable; a strand too long for the format,
 *                65 536 vertices in HAIR and PLY; a strand of fewer than 2), GROOM_ENOMEM, what the sink answers */
GROOM_MUST_CHECK groom_status groom_writer_create(const struct groom_write_options *options,
                                                  uint32_t n_strands, const uint32_t *vertex_counts,
                                                  uint32_t uniform_count, struct groom_sink sink,
                                                  const struct groom_context *context,
                                                  struct groom_writer **writer,
                                                  struct groom_diag *diag);
GROOM_MUST_CHECK groom_status groom_writer_points(struct groom_writer *writer,
                                                  const float (*points)[3], size_t n_points,
                                                  struct groom_diag *diag);
/* Writes the rest; fails with GROOM_EINVAL where points are missing. The writer stays to be destroyed. */
GROOM_MUST_CHECK groom_status groom_writer_finish(struct groom_writer *writer, struct groom_diag *diag);
void groom_writer_destroy(struct groom_writer *writer); /* takes NULL */

/* The exact size of the file that these would write, or -1 for a text format. */
int64_t groom_writer_size(groom_format format, uint32_t n_strands, uint64_t n_vertices);

/* All in one call. */
GROOM_MUST_CHECK groom_status groom_strands_write(const struct groom_strands *strands,
                                                  const struct groom_write_options *options,
                                                  struct groom_sink sink,
                                                  const struct groom_context *context,
                                                  struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
