/* Grooms as the HTTP side sees them: documents, revisions, edits, and what is evaluated from them.
 *
 * A groom is a row of immutable revisions. Each is a document whose large arrays are kept once by
 * their SHA-256 (server/store), so that turning a knob writes a few kilobytes. Models that were
 * lately used stay decoded in memory.
 *
 * threads   any; every call may wait for the disk or compute: call from service threads
 * text      malloc'ed, zero-terminated, the caller's to free
 * errors    GROOM_ENOTFOUND (groom or revision), GROOM_EINVAL with a JSON pointer, GROOM_ECONFLICT
 *           (the expected revision is not the latest: HTTP 412), and what the store answers */
#ifndef GROOMS_GROOMS_H
#define GROOMS_GROOMS_H

#include "groom/format.h"
#include "groom/groom.h"
#include "groom/render.h"
#include "server/blobs/blobs.h"
#include "server/store/store.h"

struct grooms;

struct grooms_options {
    struct store *store;            /* borrowed */
    struct blobs *blobs;            /* borrowed: where uploaded heads are */
    struct groom_pool *pool;        /* borrowed; evaluation takes turns in it */
    const char *worker_path;        /* groom-worker: draws previews, for it parses uploaded heads */
    const char *temporary_folder;   /* for files that have no name; borrowed */
    size_t max_cache_bytes;         /* of decoded models; 0: 512 MiB */
};

GROOM_MUST_CHECK groom_status grooms_create(const struct grooms_options *options, struct grooms **grooms,
                                            struct groom_diag *diag);
void grooms_destroy(struct grooms *grooms); /* takes NULL */

/* --- new grooms --------------------------------------------------------------------- */

/* Where a groom comes from: the document's "source". Members may be NULL. */
struct grooms_source {
    const char *strands, *head, *job; /* ids */
    const char *note;                 /* what made it: "fit", "import" */
};

/* A checked first revision, ready to be stored: by store_groom_create, or in one transaction with the
 * end of its job (work_result). */
struct grooms_prepared {
    struct store_revision_new revision; /* points into what follows */
    char groom_id[STORE_ID_SIZE];
    struct grooms_kept *kept;           /* owns document, name and arrays */
};

/* document  a groom document with inline arrays; its id, revision, parent and source are replaced
 *           (source is kept where `source` is NULL, as far as it names things)
 * prepared  the caller's, grooms_prepared_finish */
GROOM_MUST_CHECK groom_status grooms_prepare(struct grooms *grooms, const char *document, size_t n_bytes,
                                             const struct grooms_source *source,
                                             struct grooms_prepared *prepared, struct groom_diag *diag);
void grooms_prepared_finish(struct grooms_prepared *prepared); /* takes zeroed */

/* POST /v1/grooms: prepare and store. The document has passed `groom-worker check-groom`. What its source
 * names is looked for in this project alone. */
GROOM_MUST_CHECK groom_status grooms_import(struct grooms *grooms, const char *project, const char *document,
                                            size_t n_bytes, char groom_id[STORE_ID_SIZE], struct groom_diag *diag);

/* --- reading ---------------------------------------------------------------------------- */

/* The document of a revision (0: the latest), arrays inline or, with arrays false, only their dtype
 * and shape. *number is the revision that it is: the ETag is "<number>". */
GROOM_MUST_CHECK groom_status grooms_document(struct grooms *grooms, const char *groom_id, uint32_t revision,
                                              bool arrays, char **json, size_t *n_bytes, uint32_t *number,
                                              struct groom_diag *diag);
/* {"grooms":[{"id","name","revision","created_at","changed_at"},…],"next":…} */
GROOM_MUST_CHECK groom_status grooms_list_json(struct grooms *grooms, const char *project, struct store_page page,
                                               char **json, struct groom_diag *diag);
/* {"revisions":[{"revision","parent","name","note","created_at"},…],"next":…} */
GROOM_MUST_CHECK groom_status grooms_revisions_json(struct grooms *grooms, const char *groom_id,
                                                    struct store_page page, char **json,
                                                    struct groom_diag *diag);

/* --- edits: each makes the revision after `expected` ---------------------------------------- */

enum grooms_patch_kind {
    GROOMS_JSON_PATCH, /* RFC 6902 */
    GROOMS_MERGE_PATCH /* RFC 7396 */
};

/* Patch the document. format, unit, id, revision, parent and source are not the client's to change.
 * An operator whose seed is changed, and its random numbers not, has them drawn anew.
 * *number is the new revision. */
GROOM_MUST_CHECK groom_status grooms_patch(struct grooms *grooms, const char *groom_id, uint32_t expected,
                                           enum grooms_patch_kind kind, const char *patch, size_t n_bytes,
                                           uint32_t *number, struct groom_diag *diag);
/* PUT guides: as many strands as there are guides, in the same order; each is resampled to the groom's
 * vertices. */
GROOM_MUST_CHECK groom_status grooms_set_guides(struct grooms *grooms, const char *groom_id, uint32_t expected,
                                                const struct groom_strands *guides, uint32_t *number,
                                                struct groom_diag *diag);
/* A new revision that is the same as an earlier one. */
GROOM_MUST_CHECK groom_status grooms_revert(struct grooms *grooms, const char *groom_id, uint32_t expected,
                                            uint32_t revision, uint32_t *number, struct groom_diag *diag);

/* --- layers: edits in curvature space (layer_edit.c) ------------------------------------------- */

/* So many strands are edited while the client waits; more are a job's work. */
#define GROOMS_EDIT_MOST_NOW 5000

struct grooms_layer_edit {
    const char *project;    /* of the new groom, and of all that the body names; NULL: any */
    const char *groom_id;     /* what is edited; NULL: */
    const char *strands_id;   /* an upload, of which a new groom is made */
    uint32_t expected;        /* its revision; 0: the latest, whatever it is */
    groom_operator_type type; /* a layer */
    const char *body;         /* JSON object: the layer's members as in a document, and layer, commit, points,
                                 avoid_head, head, groom, revision, strands (openapi.yaml says what they do) */
    size_t n_body;
};

enum grooms_edited_end {
    GROOMS_EDITED,  /* a revision was made */
    GROOMS_TRIED,   /* nothing was written */
    GROOMS_TOO_MANY /* strands for one request: nothing was done. Submit a job of this kind, inputs and options */
};

struct grooms_layer_edited {
    enum grooms_edited_end end;
    char groom_id[STORE_ID_SIZE];
    uint32_t revision;
    char *json;             /* the answer; or of GROOMS_TOO_MANY the job's options */
    char *inputs;           /* of GROOMS_TOO_MANY */
    uint32_t n_strands;     /* that are edited */
};

/* edited   the caller's, grooms_layer_edited_finish */
GROOM_MUST_CHECK groom_status grooms_edit_layer(struct grooms *grooms, const struct grooms_layer_edit *edit,
                                                struct grooms_layer_edited *edited, struct groom_diag *diag);
/* The same for a worker: an edit as its job was given it. */
struct grooms_layer_job {
    const char *kind;    /* "sculpt" */
    const char *inputs;  /* as grooms_layer_edited gave them */
    const char *options;
    const char *project;          /* the job's: what it names is looked for there */
};
/* The layer on its own, with its arrays: for a groom whose base are the strands below. */
GROOM_MUST_CHECK groom_status grooms_job_layer(struct grooms *grooms, const struct grooms_layer_job *job, char **json,
                                               struct groom_diag *diag);
/* The strands that come into it, held until they are released. */
struct grooms_held {
    const struct groom_strands *strands;
    struct grooms *grooms;
    struct state *state;
};
GROOM_MUST_CHECK groom_status grooms_job_strands(struct grooms *grooms, const struct grooms_layer_job *job,
                                                 struct grooms_held *held, struct groom_diag *diag);
void grooms_release(struct grooms_held *held);
/* What the worker made of it: a line of JSON {"report":{…},"contact":{…}}, and behind it the strands
 * (proto/strand_stream.h).
 * store    stores the revision and the answer
 * returns  GROOM_EINVAL also where the groom was changed meanwhile */
GROOM_MUST_CHECK groom_status grooms_job_result(struct grooms *grooms, const struct grooms_layer_job *job,
                                                const char *bytes, size_t n_bytes,
                                                groom_status (*store)(void *user, const struct store_revision_new *next,
                                                                      uint32_t expected, const char *answer,
                                                                      struct groom_diag *diag),
                                                void *user, struct groom_diag *diag);
void grooms_layer_edited_finish(struct grooms_layer_edited *edited); /* takes zeroed */

/* --- what is evaluated -------------------------------------------------------------------------- */

struct grooms_export {
    uint32_t revision; /* 0: the latest */
    struct groom_write_options write;
    uint32_t count;    /* of strands: a fair sample of them, the same for every revision, and each
                        * smaller one part of the larger ones. 0: all */
    bool drawn;        /* all strands, with every random number drawn from its operator's seed; GROOM_EINVAL
                        * where layers stand in the chain */
};

/* Strands 0..n-1 of a revision, evaluated piece by piece into the sink. */
GROOM_MUST_CHECK groom_status grooms_write_strands(struct grooms *grooms, const char *groom_id,
                                                   const struct grooms_export *what, struct groom_sink sink,
                                                   struct groom_diag *diag);
/* The guides; count is not used. */
GROOM_MUST_CHECK groom_status grooms_write_guides(struct grooms *grooms, const char *groom_id,
                                                  const struct grooms_export *what, struct groom_sink sink,
                                                  struct groom_diag *diag);

/* All strands of a revision at once. */
struct grooms_dense {
    struct groom_strands *strands;
    uint32_t *index;   /* [strands->n_strands] which of the groom's these are, rising; NULL: all */
    uint32_t n_of;     /* strands of the groom */
    uint32_t revision;
};
/* count  of a fair sample; 0, or as many as there are: all. */
GROOM_MUST_CHECK groom_status grooms_dense(struct grooms *grooms, const char *groom_id, uint32_t revision,
                                           uint32_t count, struct grooms_dense *dense, struct groom_diag *diag);
void grooms_dense_finish(struct grooms_dense *dense); /* takes zeroed */

/* The pool that evaluation takes turns in, for those who compute with strands. */
const struct groom_context *grooms_context(const struct grooms *grooms);

/* What is compared with what. */
struct grooms_comparison {
    const char *id;    /* "grm_…", or "str_…" with a target */
    uint32_t revision; /* of a groom; 0: the latest */
    const char *with;  /* the target, "str_…" or "grm_…" (its latest revision); NULL: the strands it was fitted to */
};

/* How alike they are (groom/quality.h): {"id","revision","target","target_revision", and the report}. A
 * report that is not in the store yet is made by `groom-worker compare`, and kept; that takes seconds.
 * returns  also GROOM_ENOTFOUND where the groom was not fitted to strands that are here, and what the
 *          comparison answers (GROOM_EEMPTY: too few strands) */
GROOM_MUST_CHECK groom_status grooms_quality(struct grooms *grooms, const struct grooms_comparison *what, char **json,
                                             size_t *n_bytes, struct groom_diag *diag);

enum grooms_picture { GROOMS_PICTURE_TARGET, GROOMS_PICTURE_GROOM, GROOMS_PICTURE_DRAWN };

/* The target, the groom, or the groom with drawn random numbers, all with the camera that the target's
 * picture has, as PNG bytes (malloc'ed). */
GROOM_MUST_CHECK groom_status grooms_quality_picture(struct grooms *grooms, const struct grooms_comparison *what,
                                                     enum grooms_picture of, groom_view view, uint32_t size, char **png,
                                                     size_t *n_bytes, struct groom_diag *diag);

/* How a groom is looked at. */
struct grooms_shot {
    const struct groom_render_camera *camera; /* borrowed; NULL: the view */
    groom_view view;
    uint32_t width, height; /* pixels */
};

/* A turn around a groom: the camera goes once around from its azimuth, in so many frames. */
struct grooms_turntable {
    uint32_t n_frames, frame_ms;
    bool one_frame; /* a still of frame number `frame`, with the camera that it has in the turn */
    uint32_t frame;
};

/* A shaded picture of the dense strands on the head that the groom was fitted with, as PNG bytes
 * (malloc'ed). turntable: an animated PNG; NULL: a still. */
GROOM_MUST_CHECK groom_status grooms_preview(struct grooms *grooms, const char *groom_id, uint32_t revision,
                                             const struct grooms_shot *shot, const struct grooms_turntable *turntable,
                                             char **png, size_t *n_bytes, struct groom_diag *diag);

#endif
