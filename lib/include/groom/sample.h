/* Reconstructions with known truth: a head, a groom on it, and what a capture would make of it.
 *
 * The truth is a procedural groom on a generated head: roots spread over the scalp, guides that
 * grow out of it, part, fall under gravity and slide around the head, operators with known
 * parameters. The capture is the truth's dense strands with the defects of reconstructions: noise,
 * missing regions, short inner strands, strands that start a little off the scalp, duplicates.
 * Everything is a function of the options: the same options give the same bits. */
#ifndef GROOM_SAMPLE_H
#define GROOM_SAMPLE_H

#include <stdint.h>

#include "groom/camera.h"
#include "groom/context.h"
#include "groom/diag.h"

#ifdef __cplusplus
extern "C" {
#endif

struct groom;
struct groom_strands;
struct groom_mesh;

/* X(constant, name, what it is); the letter is the groom of Chang et al. 2025, Table 1, it is like */
#define GROOM_SAMPLE_STYLE_LIST(X)                                                                 \
    X(GROOM_SAMPLE_STRAIGHT, "straight", "shoulder-length, parted, straight (e)")                  \
    X(GROOM_SAMPLE_WAVY,     "wavy",     "chin-length, parted, in loose waves (a)")                \
    X(GROOM_SAMPLE_CURLY,    "curly",    "shoulder-length, in curls (b)")                          \
    X(GROOM_SAMPLE_COILY,    "coily",    "very short tight coils that stand off the head (f)")     \
    X(GROOM_SAMPLE_SHORT,    "short",    "short, combed to the front, fading down the sides (c)")  \
    X(GROOM_SAMPLE_SPIKY,    "spiky",    "ear-length clumps that stand out (d)")                   \
    X(GROOM_SAMPLE_BENT,     "bent",     "shoulder-length, strands bent away from their guides (g)")

typedef enum groom_sample_style {
#define GROOM_SAMPLE_ENUM(constant, name, text) constant,
    GROOM_SAMPLE_STYLE_LIST(GROOM_SAMPLE_ENUM)
#undef GROOM_SAMPLE_ENUM
    GROOM_SAMPLE_STYLE_COUNT
} groom_sample_style;

struct groom_sample_options {
    groom_sample_style style;
    uint32_t n_strands;         /* of the truth, 1.. */
    uint32_t n_vertices;        /* of each strand, 3.. */
    uint32_t n_guides;          /* 1..n_strands */
    uint32_t n_operator_guides; /* 1..n_guides */
    uint64_t seed;
    double noise_m;             /* standard deviation of the vertices' smooth error, metres */
    double missing;             /* fraction of strands gone, in patches of the scalp, 0..0.9 */
    double inner_short;         /* fraction of strands cut short: those that others hide, 0..1 */
    double off_scalp_m;         /* strands start at 0..off_scalp_m of arc length from the scalp, metres */
    double duplicates;          /* fraction of strands that come a second time, 0..1 */
    uint32_t n_cameras;         /* around the head, 0..256 */
};

const char *groom_sample_style_name(groom_sample_style style);
/* returns GROOM_OK, or GROOM_EINVAL with the list of names in diag */
GROOM_MUST_CHECK groom_status groom_sample_style_parse(const char *name, groom_sample_style *style,
                                                       struct groom_diag *diag);

/* The style's own counts, no defects, 16 cameras, seed 1. */
void groom_sample_options_init(groom_sample_style style, struct groom_sample_options *options);
/* The same with the defects of a plausible reconstruction. */
void groom_sample_options_capture(groom_sample_style style, struct groom_sample_options *options);

struct groom_sample {
    struct groom_mesh *head;       /* with texture coordinates over the scalp */
    struct groom *truth;           /* has passed groom_validate */
    struct groom_strands *capture; /* metres; strands in the order of the truth, duplicates at the end */
    uint32_t *strand_of;           /* [capture->n_strands] the truth's strand */
    uint32_t n_cameras;
    struct groom_camera *cameras;  /* [n_cameras] */
    const struct groom_allocator *allocator;
};

/* returns  GROOM_OK, GROOM_EINVAL (an option out of range, its name in diag->pointer: "/missing"),
 *          GROOM_ENOMEM, GROOM_ECANCELLED
 * threads  same bits for any pool */
GROOM_MUST_CHECK groom_status groom_sample_create(const struct groom_sample_options *options,
                                                  const struct groom_context *context,
                                                  struct groom_sample **sample, struct groom_diag *diag);
void groom_sample_destroy(struct groom_sample *sample); /* takes NULL */

/* {"cameras":[...]} as groom/camera.h says; malloc'd and ended by 0, for the caller to free(). */
GROOM_MUST_CHECK groom_status groom_sample_cameras_print(const struct groom_sample *sample, char **json,
                                                         struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
