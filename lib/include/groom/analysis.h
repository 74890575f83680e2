/* Strands analysed in curvature space (groom/curvature.h) and told: as JSON, as values for colouring. */
#ifndef GROOM_ANALYSIS_H
#define GROOM_ANALYSIS_H

#include "groom/curvature.h"
#include "groom/io.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Polylines as super-helices, and what these are like. */
struct groom_strand_analysis {
    struct groom_conversion *conversion;
    struct groom_analysis *analysis;
    float *error_share; /* [n_strands] each strand's largest distance from its super-helix over its mean segment length */
    const struct groom_allocator *allocator;
};

/* strands  borrowed for the call, and by the writers below
 * returns  GROOM_OK, and what groom_strands_convert and groom_superhelices_analyze answer
 * threads  deterministic for any pool */
GROOM_MUST_CHECK groom_status groom_strands_analyze(const struct groom_strands *strands,
                                                    const struct groom_conversion_options *conversion,
                                                    const struct groom_analysis_options *options,
                                                    const struct groom_context *context,
                                                    struct groom_strand_analysis **analysis, struct groom_diag *diag);
void groom_strand_analysis_destroy(struct groom_strand_analysis *analysis); /* takes NULL */

/* Large parts of the JSON, to be asked for. */
enum groom_analysis_part {
    GROOM_ANALYSIS_ELEMENTS = 1,    /* "elements": first u32[n+1]; length, radius, step, frequency, omega, beta, hand f32[e]; kind u32[e] */
    GROOM_ANALYSIS_VERTICES = 2,    /* "vertices": first u32[n+1]; radius, frequency, hand, beta f32[v] of the element under each vertex */
    GROOM_ANALYSIS_CENTRE = 4,      /* "centre": f32[n, samples, 3] */
    GROOM_ANALYSIS_SWITCHBACKS = 8, /* "switchbacks" whole: strand u32[k], element u32[k], at f32[k] beside the list */
    GROOM_ANALYSIS_STRANDS = 16     /* "per_strand": turns, error_share f32[n]; elements, index u32[n] */
};
#define GROOM_ANALYSIS_LISTED 100 /* switchbacks that the list holds at most */

struct groom_analysis_telling {
    const char *id_name, *id; /* a first member, "groom":"grm_..."; NULL: none */
    uint32_t revision;        /* 0: none */
    uint32_t n_of;            /* strands that the analysed ones are a sample of */
    const uint32_t *index;    /* [n_strands] which these are, rising; NULL: all */
    unsigned parts;           /* of enum groom_analysis_part */
};

/* One JSON object: what was analysed and how well the super-helices meet it, shares of length, histograms,
 * switchbacks; the parts that were asked for. Strands are named by their index among all n_of; elements
 * by their place in their strand. Numbers in metres, turns, turns per metre. hand is -1, 0, 1; kind is groom_hair_kind;
 * omega is infinite where there is no torsion.
 * returns  GROOM_OK, GROOM_ENOMEM, what the sink answers */
GROOM_MUST_CHECK groom_status groom_strand_analysis_write(const struct groom_strand_analysis *analysis,
                                                          const struct groom_analysis_telling *telling,
                                                          struct groom_sink sink, const struct groom_context *context,
                                                          struct groom_diag *diag);

/* radius, frequency, hand and beta of each vertex, f32[n_vertices][4], little-endian: what a viewer puts into a
 * vertex buffer.
 * returns  GROOM_OK, GROOM_ENOMEM, what the sink answers */
GROOM_MUST_CHECK groom_status groom_strand_analysis_write_vertices(const struct groom_strand_analysis *analysis,
                                                                   struct groom_sink sink,
                                                                   const struct groom_context *context,
                                                                   struct groom_diag *diag);

/* Clusters and the frames of their armatures as one JSON object:
 * {ID, "revision", "count", "seed", "strands", "clusters":[{"cluster","strands","root","frames":[{"at","position",
 * "axes","extent"},...]},...], "of_strand":u32[n]}.
 * frames   [n_clusters][n_frames] as groom_clusters_frames gives them
 * strands  those that the clusters are of: for the mean roots, from which an armature is drawn */
GROOM_MUST_CHECK groom_status groom_clusters_write(const struct groom_clusters *clusters,
                                                   const struct groom_strands *strands,
                                                   const struct groom_cluster_frame *frames, uint32_t n_frames,
                                                   uint64_t seed, const struct groom_analysis_telling *telling,
                                                   struct groom_sink sink, struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
