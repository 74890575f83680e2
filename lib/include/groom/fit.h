/* The fit: dense strands in, a procedural groom out.
 *
 * Chang et al. 2025, Sections 4-6. The work is a row of stages, each a row of bounded steps, so
 * that whoever drives it can report, save and stop between any two:
 *
 *     groom_fit_create(strands, head, &options, context, &fit, diag)
 *     while (!groom_fit_done(fit)) groom_fit_step(fit, context, diag), groom_fit_save(fit, sink, diag)
 *     groom_fit_result(fit, context, &groom, diag)
 *
 * The result depends on the strands, the head and the options alone: neither on threads, nor on
 * where the work was interrupted, saved and taken up again. */
#ifndef GROOM_FIT_H
#define GROOM_FIT_H

#include <stddef.h>
#include <stdint.h>

#include "groom/camera.h"
#include "groom/context.h"
#include "groom/diag.h"
#include "groom/io.h"
#include "groom/groom.h"

#ifdef __cplusplus
extern "C" {
#endif

struct groom_strands;
struct groom_mesh;

/* --- options ---------------------------------------------------------------- */

#define GROOM_FIT_AUTO 0            /* a count that the fit chooses */
#define GROOM_FIT_MAX_OPERATORS 16
#define GROOM_FIT_MAX_CAMERAS 256

typedef enum groom_fit_quality {
    GROOM_FIT_DRAFT,
    GROOM_FIT_STANDARD,
    GROOM_FIT_HIGH
} groom_fit_quality;

/* How a stage is gone through. */
typedef enum groom_fit_method {
    GROOM_FIT_DIRECT, /* as this library does it */
    GROOM_FIT_PAPER   /* the recipe of Chang et al. 2025, as a reference: its steps of gradient descent */
} groom_fit_method;

/* Plain data: copy it, keep it. Each member's name, default, range and meaning stand in one table
 * (lib/fit/options.c) from which defaults, parsing, printing and the JSON Schema are made.
 * The paths in JSON are the members': /stages/initialize/lambda_smooth. */
struct groom_fit_options {
    uint32_t vertices;
    uint32_t guides;               /* or GROOM_FIT_AUTO */
    uint32_t operator_guides;      /* or GROOM_FIT_AUTO */
    int operators_auto;            /* then operators holds all five in the contract's order */
    uint32_t n_operators;
    groom_operator_type operators[GROOM_FIT_MAX_OPERATORS];
    uint32_t interpolation_guides; /* k of Eq. 3 */
    uint64_t seed;
    groom_fit_quality quality;
    uint32_t n_cameras;            /* of "visibility"; 0 where it is null */
    struct groom_camera cameras[GROOM_FIT_MAX_CAMERAS];
    double least_seen;             /* share of a strand's vertices that cameras must see; fewer: it leaves the fit */

    struct groom_fit_stages {
        struct {
            double lambda_smooth;       /* Section 5.2: 1 */
            uint32_t n_smooth;          /* 80 */
            double fixed_fraction;      /* m_fixed = floor(0.05 m) */
            uint32_t cluster_iterations;
            uint32_t medoid_iterations;
            double sigma_instance;      /* Eq. 3; 0 is "auto" */
            double head_clearance;      /* metres inside the head that are not yet a penetration */
            int estimate_operators;
        } initialize;
        struct {
            groom_fit_method method;
            uint32_t candidates;        /* guides near a strand among which it chooses */
            double distance_pull;       /* towards the weights by distance */
            uint32_t iterations;        /* Section 6: 2000 */
            double learning_rate;       /* 30 */
        } instance_weights;
        struct {
            groom_fit_method method;
            uint32_t iterations;        /* 3000 */
            double learning_rate_curvature, learning_rate_length, learning_rate_angle;
            double lambda, sigma_d, sigma_phi; /* gradient filter: 10, 0.3, 0.4 */
            double cycles;  /* waves along a guide that keep half of their size: 3 */
            double across;  /* pull of neighbours on the scalp, over that of a guide's strands, or GROOM_FIT_AUTO */
        } guides;
        struct {
            groom_fit_method method;
            uint32_t pairs;             /* of neighbouring strands, of which statistics are matched */
            uint32_t refinements;       /* steps at most; 0 leaves the operators as they are */
            uint32_t iterations;        /* of each loss: 3000 */
            uint32_t alternate;         /* iterations of one loss at a time: 200 */
            double learning_rate;       /* 0.01 */
            double lambda_e;            /* Eq. 12: 400 */
            double sigma_scale, sigma_clump; /* Eqs. 14, 16: 0.1 */
            double batch_fraction;      /* |B_k| = min(n / 100, 200) */
            uint32_t batch_maximum;
            uint32_t batches, batches_late; /* 5, and 50 in the last quarter */
        } operators;
        struct {
            groom_fit_method method;
            uint32_t rounds;            /* over the chain; from 2 on, one more for curls of few strands a guide; 0: as drawn */
            uint32_t values;            /* of a strand's number that are tried over its range */
            uint32_t strands;           /* of an operator guide that are asked about its curl */
            double lambda_x;            /* of vertices over directions: 3 */
            double hold;                /* of the instancing weights to where they are */
            double across;              /* of guides that are solved again between rounds */
            uint32_t refinements;       /* of the operators after that */
            uint32_t iterations;        /* 3000 */
            double learning_rate;       /* 0.1 */
            double lambda_d, lambda_l;  /* Eq. 19: 2, 0.01 */
            double noise_first, noise_last; /* Eq. 21: 1.5, 0.5 */
        } randoms;
    } stages;
};

/* The defaults of a quality. */
void groom_fit_options_init(groom_fit_quality quality, struct groom_fit_options *options);

/* Options from a JSON object; what it leaves out has its default (n = 0: all). visibility.cameras may be an array of
 * cameras (groom/camera.h), a transforms.json, or {"cameras_txt","images_txt"} with COLMAP's texts; the last two with
 * "unit" and "up" of the capture where it is not in metres, y up.
 * returns  GROOM_OK, or GROOM_EINVAL (not JSON, a name that is not known, a value of the wrong type or
 *          out of range) with the JSON pointer of the culprit and, for a name, the nearest known one;
 *          GROOM_ENOMEM. out is untouched on error */
GROOM_MUST_CHECK groom_status groom_fit_options_parse(const char *json, size_t n,
                                                      struct groom_fit_options *out, struct groom_diag *diag);

/* All options as JSON, defaults filled in; parsing it gives the same options.
 * json  malloc'd and ended by 0, for the caller to free() */
GROOM_MUST_CHECK groom_status groom_fit_options_print(const struct groom_fit_options *options, char **json,
                                                      struct groom_diag *diag);

/* The JSON Schema (2020-12) of the options. malloc'd, for the caller to free(). */
GROOM_MUST_CHECK groom_status groom_fit_options_schema(char **json, struct groom_diag *diag);

/* --- the fit ---------------------------------------------------------------- */

struct groom_fit;

/* Conditions the target: every strand is resampled to options->vertices and joined to the scalp
 * where it starts a little off it; lengths are divided by the capture's own size, so that nothing
 * depends on the unit. Strands keep their indices.
 * strands  borrowed for the call; each has at least 2 finite vertices
 * head     may be NULL; borrowed until groom_fit_destroy
 * options  copied
 * context  its allocator must live as long as the fit
 * returns  GROOM_OK, GROOM_EINVAL (a strand of fewer than 2 vertices or with a value that is not
 *          finite; a head that would meet the strands in another unit or axis alone), GROOM_EEMPTY (no strands), GROOM_ENOMEM, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status groom_fit_create(const struct groom_strands *strands,
                                               const struct groom_mesh *head,
                                               const struct groom_fit_options *options,
                                               const struct groom_context *context, struct groom_fit **fit,
                                               struct groom_diag *diag);
void groom_fit_destroy(struct groom_fit *fit); /* takes NULL */

/* The next piece of work, at most a few seconds long. Streams losses through the context.
 * returns  GROOM_OK; GROOM_ECANCELLED, GROOM_ENOMEM: the fit stands as before the step and the step
 *          may be tried again; GROOM_EINVAL where the fit is done */
GROOM_MUST_CHECK groom_status groom_fit_step(struct groom_fit *fit, const struct groom_context *context,
                                             struct groom_diag *diag);
int groom_fit_done(const struct groom_fit *fit);

struct groom_fit_progress {
    const char *stage;     /* "initialize"; the last one where the fit is done. Static */
    uint32_t index, count; /* of the stage, and how many stages this fit has */
    double stage_fraction; /* 0..1 of the stage */
    double fraction;       /* 0..1 of the whole fit */
};
void groom_fit_progress(const struct groom_fit *fit, struct groom_fit_progress *progress);

/* The names of all stages of the library, in order. index 0.. ; NULL beyond the last. */
const char *groom_fit_stage_name(uint32_t index);

/* What was lost or chosen on the way, for the report with the groom. */
#define GROOM_FIT_MAX_NOTES 16
#define GROOM_FIT_MAX_LOSSES 32
/* A loss of a stage, before and after it. With lengths in units of 10 cm on a head of ordinary size (scaled with
 * the head: what the paper's weights fit) where it does not say metres, by stage and name:
 *   initialize        cluster    mean square distance of a vertex from its cluster's mean strand, square metres
 *                     medoids    mean distance of guides from their operator guides, a vertex, metres
 *   instance_weights  L_x        Eq. 5, square metres, of unsmoothed mean strands without operators
 *   guides            L_g        Eq. 7 over the number of vertices, square metres: of the expectation, in which clump
 *                                alone takes part, from the one strand that there is
 *   operators         spectra    Eq. 11 of magnitudes of the segments' transforms, over the number of strands
 *                     segments   Eq. 11 of the segments, over the number of strands
 *                     shape      Eq. 12: spectra + lambda_e segments
 *                     scale      Eqs. 13-15, 18: mean over batches_late batches
 *                     clump      Eqs. 13, 16-18, likewise
 *                     misfit     what method direct brings down instead: squared differences of statistics over their
 *                                scatter (no equation of the paper)
 *   randoms           L_rand     Eq. 19: spectra + lambda_d direction + lambda_l length
 *                     spectra    its first term: of unit directions, summed over waves and coordinates
 *                     direction  its second: 1 - the mean over segments of their products
 *                     length     its third
 *                     vertex     mean distance of vertices, metres (no part of Eq. 19)
 * Transforms are one-sided and not normalised. The shape losses look at 1 500 strands at most, those of randoms
 * at 4 000. Losses that are streamed have the same names; method paper streams those of its own steps. */
struct groom_fit_loss {
    char stage[24], name[24];
    double before, after;
};
struct groom_fit_report {
    uint32_t n_guides, n_operator_guides;
    groom_scalp_source scalp;
    uint32_t n_joined;      /* strands that started off the scalp and were joined to it */
    uint32_t n_detached;    /* that start too far from it and were left as they are */
    uint32_t n_outliers;    /* that start or reach too far from the others: left out of the stages */
    uint32_t n_unseen;      /* that no camera sees enough of: left out of the stages */
    uint32_t n_reassigned;  /* moved to another operator guide, away from the head */
    uint32_t n_penetrating; /* for which no operator guide keeps them out of the head */
    uint32_t n_in_head;     /* that stage randoms leaves in the head, by more than 1 mm of an ordinary one, ... */
    uint32_t n_beyond_target; /* ... and those of them that are by as much deeper in it than their targets */
    uint32_t n_losses;
    struct groom_fit_loss losses[GROOM_FIT_MAX_LOSSES];
    uint32_t n_notes;
    char notes[GROOM_FIT_MAX_NOTES][160]; /* sentences */
};
const struct groom_fit_report *groom_fit_get_report(const struct groom_fit *fit); /* borrowed */
/* {"guides":..,"losses":[{"stage","name","before","after"}],"notes":[..],...}; malloc'd, for the caller to free(). */
GROOM_MUST_CHECK groom_status groom_fit_report_print(const struct groom_fit *fit, char **json,
                                                     struct groom_diag *diag);

/* --- checkpoints ------------------------------------------------------------ */

/* Write the state after any step: versioned, with a checksum of itself and of the inputs and
 * options. Little-endian.
 * returns  GROOM_OK, GROOM_ENOMEM, what the sink answers */
GROOM_MUST_CHECK groom_status groom_fit_save(const struct groom_fit *fit, struct groom_sink sink,
                                             struct groom_diag *diag);
/* Take up a saved state in a fit that was created from the same inputs and options; it then ends
 * with the same bits as the fit that was saved, on an x86-64 processor of another kind as well (by the methods of this
 * library; the paper's multiply matrices by the BLAS of the machine, and losses that are only told do).
 * returns  GROOM_OK; GROOM_ECONFLICT (saved by other inputs, options or another version),
 *          GROOM_EFORMAT, GROOM_ETRUNCATED, GROOM_EIO, GROOM_ENOMEM: the fit stands as before */
GROOM_MUST_CHECK groom_status groom_fit_load(struct groom_fit *fit, const struct groom_source *source,
                                             const struct groom_context *context, struct groom_diag *diag);

/* --- the result ------------------------------------------------------------- */

/* A copy of the groom as far as the fit has come; whole from the end of stage `initialize` on.
 * It has passed groom_validate.
 * returns  GROOM_OK, GROOM_EINVAL (stage `initialize` has not ended), GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_fit_result(const struct groom_fit *fit, const struct groom_context *context,
                                               struct groom **groom, struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
