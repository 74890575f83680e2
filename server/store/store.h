/* What groomd remembers: uploads, jobs and their attempts, grooms and their revisions.
 *
 * One interface in front of a database that the daemon alone owns (SQLite in WAL mode with
 * synchronous=FULL). A call that returned GROOM_OK is on the disk. A call is one transaction: after a crash
 * it has happened or not.
 *
 * A second backend (PostgreSQL, for several daemons) fits behind this without touching a caller, who knows no
 * SQL, no connection and no file of it (tests/lint.sh sees to that), and who may not suppose more than is said here:
 *   - what is taken (store_job_take, store_webhook_take) is the taker's alone, whoever else takes at that moment;
 *   - sequences and `next` only grow, without being dense;
 *   - GROOM_ECONFLICT from any write means that another was first: look again;
 *   - "all that are running" of store_attempts_list are this daemon's own, taken through its store. SQLite has one
 *     daemon, so it has them all. A backend of several notes in store_job_take which daemon took;
 *   - a change that another daemon made wakes nobody here: such a backend calls jobs_notify for what it hears
 *     (LISTEN), from a thread of its own.
 *
 * threads   every function may be called from any thread; writes take turns, reads wait for no write
 * blocking  a write waits for the disk (a few ms): call from service threads, not from an event loop
 * strings   rows own what they point to; `*_finish` releases it, takes NULL and zeroed rows, and
 *           leaves a zeroed row. JSON is passed and kept as text.
 * times     milliseconds since 1970 UTC; 0: it has not happened
 * errors    GROOM_ENOSPC (disk full), GROOM_EIO, GROOM_ENOMEM, GROOM_EINTERNAL from any of them;
 *           what a function adds to these is said there. Outputs are set only on GROOM_OK. */
#ifndef STORE_STORE_H
#define STORE_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "groom/diag.h"

#define STORE_ID_SIZE   32 /* "job_" and the like with 20 characters, and room */
#define STORE_HASH_SIZE 65 /* SHA-256 in lower-case hexadecimal */

/* Every upload, groom and job belongs to a project. "" and NULL name the default one where something is
 * made and where there is a list; where one thing is looked for, NULL means any (the daemon's own look). */
#define STORE_PROJECT_SIZE    64
#define STORE_DEFAULT_PROJECT "default"
/* Who made it, for limits and fair turns: a token's id, or the project where no token was asked for. */
#define STORE_OWNER_SIZE 64

struct store;

#define STORE_PLACE_SIZE 1400
/* Where the state of a data folder is: for SQLite a file in it. What the functions here call `path`. */
void store_place(const char *folder, char place[STORE_PLACE_SIZE]);
/* Is there state in the folder? */
bool store_is_in(const char *folder);
/* Does this entry of a data folder hold state? Then it is copied by store_copy, not as a file. */
bool store_has_entry(const char *name);

/* Open or make the database at `path`, mend it to the present schema, check it.
 * returns  GROOM_EFORMAT (not a database, damaged, or of a newer schema: detail says which) */
GROOM_MUST_CHECK groom_status store_open(const char *path, struct store **store, struct groom_diag *diag);
void store_close(struct store *store); /* takes NULL */

/* Does the database read and write? For /readyz; what was found holds for a second. */
GROOM_MUST_CHECK groom_status store_ping(struct store *store, struct groom_diag *diag);

/* --- ids and times ------------------------------------------------------------------ */

/* prefix ("job_", "grm_") and 20 random characters a-z2-7 (100 bits). */
GROOM_MUST_CHECK groom_status store_make_id(const char *prefix, char id[STORE_ID_SIZE]);
int64_t store_now_ms(void);
/* RFC 3339 in UTC with milliseconds: "2026-01-31T12:00:00.250Z". */
void store_time_text(int64_t time_ms, char text[32]);

/* --- projects ----------------------------------------------------------------------- */

/* The project of an upload, a groom or a job. What belongs to another project than asks for it is to be
 * answered as what does not exist.
 * returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_project_of(struct store *store, const char *id,
                                               char project[STORE_PROJECT_SIZE], struct groom_diag *diag);

struct store_usage {
    uint64_t n_bytes;  /* of the owner's uploads */
    uint32_t n_queued; /* of its jobs */
};
GROOM_MUST_CHECK groom_status store_usage_of(struct store *store, const char *owner, struct store_usage *usage,
                                             struct groom_diag *diag);

/* --- pages ---------------------------------------------------------------------------- */

/* Lists go from the newest to the oldest. `before` is the `next` of the page before, or 0 for the
 * first; limit 0 means 100. A list's `next` is 0 where nothing is left. */
struct store_page {
    int64_t before;
    uint32_t limit;
};

/* --- uploads: strands and heads --------------------------------------------------------- */

enum store_asset_kind { STORE_STRANDS, STORE_HEAD };

struct store_asset {
    char id[STORE_ID_SIZE];       /* "str_…", "head_…" */
    enum store_asset_kind kind;
    char project[STORE_PROJECT_SIZE], owner[STORE_OWNER_SIZE]; /* "": the default */
    char sha256[STORE_HASH_SIZE]; /* its blob */
    uint64_t n_bytes;
    char *format;                 /* as recognised: "hair" */
    double unit_m;                /* metres of one unit of the file */
    char up;                      /* 'y' or 'z' */
    char *name;                   /* "" where none was given */
    char *metadata;               /* JSON object of the answer: counts, bbox, warnings */
    int64_t created_ms;
};

struct store_asset_list {
    struct store_asset *items;
    size_t n;
    int64_t next;
};

/* The id of these bytes read in this way in this project, always the same: "str_" and a hash of all of
 * these. `format` is what was asked for ("" or NULL: recognise it). Projects that upload the same bytes
 * share the blob and neither ids nor rows, so that none learns what another has. */
void store_asset_id(const char *project, enum store_asset_kind kind, const char *sha256, const char *format, double unit_m,
                    char up, char id[STORE_ID_SIZE]);
/* Insert unless a row of this id is there already; *created says which. created_ms 0 means now.
 * Its blob must be committed before. max_bytes: of all that its owner has; 0: no limit.
 * returns  GROOM_ELIMIT */
GROOM_MUST_CHECK groom_status store_asset_put(struct store *store, const struct store_asset *asset,
                                              uint64_t max_bytes, bool *created, struct groom_diag *diag);
/* returns  GROOM_ENOTFOUND, also where the id is of the other kind or another project */
GROOM_MUST_CHECK groom_status store_asset_get(struct store *store, const char *project, enum store_asset_kind kind,
                                              const char *id, struct store_asset *asset, struct groom_diag *diag);
GROOM_MUST_CHECK groom_status store_assets_list(struct store *store, const char *project,
                                                enum store_asset_kind kind, struct store_page page, struct store_asset_list *list,
                                                struct groom_diag *diag);
/* `garbage` is its blob, for the caller to collect. Grooms that were made of it have what they need.
 * returns  GROOM_ENOTFOUND, GROOM_ECONFLICT (a job that has not ended needs it; detail names one) */
GROOM_MUST_CHECK groom_status store_asset_remove(struct store *store, enum store_asset_kind kind, const char *id,
                                                 char garbage[STORE_HASH_SIZE], struct groom_diag *diag);
void store_asset_finish(struct store_asset *asset);
void store_asset_list_finish(struct store_asset_list *list);

/* --- uploads that come in pieces ------------------------------------------------------------ */

/* An upload under way (server/uploads): a file of its own until it is used, then a blob. */
struct store_upload {
    char id[STORE_ID_SIZE];       /* "upl_…" */
    char project[STORE_PROJECT_SIZE], owner[STORE_OWNER_SIZE]; /* "": the default */
    uint64_t n_bytes;             /* what it is to be */
    uint64_t n_durable;           /* of them on the disk: what its sender is told */
    char sha256[STORE_HASH_SIZE]; /* its blob once it was used; "": still a file */
    char *metadata;               /* Upload-Metadata as it was sent; "" */
    int64_t created_ms, expires_ms;
};

struct store_upload_list {
    struct store_upload *items;
    size_t n;
};

GROOM_MUST_CHECK groom_status store_upload_create(struct store *store, const struct store_upload *upload,
                                                  struct groom_diag *diag);
/* returns  GROOM_ENOTFOUND, also where it has expired */
GROOM_MUST_CHECK groom_status store_upload_get(struct store *store, const char *id, struct store_upload *upload,
                                               struct groom_diag *diag);
/* At least n_durable bytes are on the disk, and it expires no earlier than that. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_upload_advance(struct store *store, const char *id, uint64_t n_durable,
                                                   int64_t expires_ms, struct groom_diag *diag);
/* Its bytes are this blob, which is committed and pinned. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_upload_set_blob(struct store *store, const char *id, const char *sha256,
                                                    int64_t expires_ms, struct groom_diag *diag);
/* `garbage` is its blob ("" for none) for the caller to collect. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_upload_remove(struct store *store, const char *id,
                                                  char garbage[STORE_HASH_SIZE], struct groom_diag *diag);
/* Those that expire before that time; INT64_MAX: all. */
GROOM_MUST_CHECK groom_status store_uploads_list(struct store *store, int64_t before_ms,
                                                 struct store_upload_list *list, struct groom_diag *diag);
void store_upload_finish(struct store_upload *upload);
void store_upload_list_finish(struct store_upload_list *list);

/* --- grooms and their revisions ----------------------------------------------------------- */

/* A large array of a document, stored once whatever number of revisions hold it. Documents refer to
 * it as {"$array":"<sha256>"}. `bytes` NULL: the array is in the store already. */
struct store_array {
    char sha256[STORE_HASH_SIZE];
    const void *bytes;
    size_t n_bytes;
};

/* A revision to write; everything borrowed for the call. */
struct store_revision_new {
    const char *groom_id;             /* "grm_…" */
    const char *project;              /* of a new groom */
    const char *name;                 /* of the groom from now on */
    const char *document;             /* JSON, large arrays replaced by references */
    const char *note;                 /* what made it: "fit", "import", "patch"; NULL: "" */
    const struct store_array *arrays; /* every array that the document refers to */
    size_t n_arrays;
    const char *compared_with, *quality; /* its quality report (JSON) against these strands; or NULL */
};

struct store_revision {
    char groom_id[STORE_ID_SIZE];
    uint32_t number;    /* from 1 */
    uint32_t parent;    /* 0: none */
    uint32_t latest;    /* of the groom, when this was read */
    char *name;         /* of the groom at this revision */
    char *document;     /* NULL in lists */
    char *note;
    int64_t created_ms;
};

struct store_revision_list {
    struct store_revision *items;
    size_t n;
    int64_t next;
};

struct store_groom {
    char id[STORE_ID_SIZE];
    char *name;
    uint32_t latest;
    int64_t created_ms, changed_ms;
};

struct store_groom_list {
    struct store_groom *items;
    size_t n;
    int64_t next;
};

/* A new groom with revision 1.
 * returns  GROOM_ECONFLICT (the id is taken), GROOM_EINVAL (an array without bytes is not stored) */
GROOM_MUST_CHECK groom_status store_groom_create(struct store *store, const struct store_revision_new *revision,
                                                 struct groom_diag *diag);
/* The next revision of a groom; its number is expected_latest + 1, its parent expected_latest.
 * returns  GROOM_ECONFLICT where the latest is another by now, GROOM_ENOTFOUND, GROOM_EINVAL as above */
GROOM_MUST_CHECK groom_status store_revision_add(struct store *store, const struct store_revision_new *revision,
                                                 uint32_t expected_latest, struct groom_diag *diag);
/* number 0: the latest. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_revision_get(struct store *store, const char *groom_id, uint32_t number,
                                                 struct store_revision *revision, struct groom_diag *diag);
/* *bytes is malloc'ed, the caller's to free. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_array_get(struct store *store, const char *sha256, void **bytes,
                                              size_t *n_bytes, struct groom_diag *diag);
/* Without their documents. returns  GROOM_ENOTFOUND for an unknown groom */
GROOM_MUST_CHECK groom_status store_revisions_list(struct store *store, const char *groom_id,
                                                   struct store_page page, struct store_revision_list *list,
                                                   struct groom_diag *diag);
GROOM_MUST_CHECK groom_status store_grooms_list(struct store *store, const char *project, struct store_page page,
                                                struct store_groom_list *list, struct groom_diag *diag);
/* With all its revisions, and the arrays that no other groom has. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_groom_remove(struct store *store, const char *id, struct groom_diag *diag);
void store_revision_finish(struct store_revision *revision);
void store_revision_list_finish(struct store_revision_list *list);
void store_groom_list_finish(struct store_groom_list *list);

/* --- quality reports --------------------------------------------------------------------------- */

/* How alike a revision of a groom (or uploaded strands: number 0) is to a target, which is the id of strands
 * or "grm_…/<revision>". Nothing that is compared ever changes, so neither does a report. */
struct store_quality {
    const char *subject;
    uint32_t number;
    const char *target;
};
/* *report is malloc'ed, JSON as groom/quality.h prints it. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_quality_get(struct store *store, const struct store_quality *key, char **report,
                                                struct groom_diag *diag);
/* Replaces one that is there. */
GROOM_MUST_CHECK groom_status store_quality_put(struct store *store, const struct store_quality *key, const char *report,
                                                struct groom_diag *diag);

/* --- jobs ------------------------------------------------------------------------------------ */

/*            take                succeed
 *   queued ────────▶ running ─────────────▶ succeeded
 *     │  ◀──────────    │ ├───────────────▶ failed        (its error, or too many attempts died)
 *     │    requeue      │ └───────────────▶ cancelled     (once the worker has stopped)
 *     └─────────────────────────────────▶  cancelled / failed
 * The three on the right are end states. Only store_job_take and store_job_move change a state. */
enum store_job_state {
    STORE_JOB_QUEUED,
    STORE_JOB_RUNNING,
    STORE_JOB_SUCCEEDED,
    STORE_JOB_FAILED,
    STORE_JOB_CANCELLED,
    STORE_JOB_STATES
};
const char *store_job_state_name(enum store_job_state state); /* "queued" */
/* returns  GROOM_EINVAL with the list of names */
GROOM_MUST_CHECK groom_status store_job_state_parse(const char *name, enum store_job_state *state,
                                                    struct groom_diag *diag);
bool store_job_state_is_end(enum store_job_state state);

struct store_job {
    char id[STORE_ID_SIZE];
    char *kind;             /* "fit" */
    char project[STORE_PROJECT_SIZE], owner[STORE_OWNER_SIZE];
    enum store_job_state state;
    int32_t priority;       /* larger first; then owners in turn; then the older first */
    int64_t queue_position; /* jobs ahead of it; -1 where it is not queued */
    char *request;          /* JSON object of inputs: {"strands":"str_…","head":"head_…"}; ids may stand deeper in it */
    char *options;          /* JSON object, defaults filled in */
    char *stage;            /* "" before the first */
    uint32_t stage_index, stage_count;
    double progress;        /* 0..1 */
    double eta_s;           /* negative: unknown */
    char *loss;             /* JSON object: the last value of each loss */
    uint32_t attempt;       /* number of the last attempt begun; 0: none yet */
    uint32_t n_failures;    /* attempts that died by themselves since the job last got further */
    bool cancel_requested;
    char *result, *error;   /* JSON objects or NULL */
    int64_t created_ms, started_ms, finished_ms;
};

struct store_job_list {
    struct store_job *items;
    size_t n;
    int64_t next;
};

/* Somebody who is to be told of a job's end; everything borrowed. */
struct store_webhook_new {
    const char *url, *secret;
};

struct store_job_new {
    const char *id; /* from store_make_id */
    const char *kind;
    const char *request, *options; /* JSON objects */
    int32_t priority;
    const struct store_webhook_new *webhooks; /* or NULL */
    size_t n_webhooks;
    const char *project, *owner;   /* NULL: the default */
    uint32_t max_queued;           /* jobs that may wait, of all owners; 0: no limit */
    uint32_t max_queued_of_owner;  /* 0: no limit */
};

/* returns  GROOM_ELIMIT where a queue is full */
GROOM_MUST_CHECK groom_status store_job_create(struct store *store, const struct store_job_new *job,
                                               struct groom_diag *diag);
/* returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_job_get(struct store *store, const char *id, struct store_job *job,
                                            struct groom_diag *diag);
/* state: NULL for any. */
GROOM_MUST_CHECK groom_status store_jobs_list(struct store *store, const char *project,
                                              const enum store_job_state *state,
                                              struct store_page page, struct store_job_list *list,
                                              struct groom_diag *diag);
void store_job_finish(struct store_job *job);
void store_job_list_finish(struct store_job_list *list);

/* Note that a running job is to be cancelled; the supervisor stops its worker and then moves it.
 * *state is the job's present state (an end state: nothing was noted). returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_job_request_cancel(struct store *store, const char *id,
                                                       enum store_job_state *state, struct groom_diag *diag);

/* --- attempts ----------------------------------------------------------------------------------- */

/* Names one attempt. A call with a ref is refused with GROOM_ECONFLICT once the attempt has ended or
 * another has begun (fencing), in the same transaction as what it would write. */
struct store_attempt_ref {
    char job_id[STORE_ID_SIZE];
    uint32_t number; /* from 1 */
    /* Which run of the attempt is speaking: a cluster that loses a node starts the same attempt again
     * elsewhere, and counts. Once a run has begun (store_attempt_begin_run), those before it are fenced
     * off, too. Always 0 for a process of this machine. */
    uint32_t run;
};

enum store_attempt_state {
    STORE_ATTEMPT_RUNNING,
    STORE_ATTEMPT_SUCCEEDED,
    STORE_ATTEMPT_FAILED,    /* the worker said that the job cannot be done */
    STORE_ATTEMPT_DIED,      /* ended without a result: counts towards the job's limit */
    STORE_ATTEMPT_STOPPED,   /* by the daemon (drained, restarted): does not count */
    STORE_ATTEMPT_CANCELLED,
    STORE_ATTEMPT_STATES
};
const char *store_attempt_state_name(enum store_attempt_state state);

struct store_attempt {
    struct store_attempt_ref ref;
    enum store_attempt_state state;
    char *handle;     /* the launcher's name for its process; "" before it was launched */
    char *last_words; /* the tail of its stderr, with how it ended; "" */
    int64_t started_ms;
    int64_t finished_ms; /* of a running one: its process has said that it ends (store_attempt_ended) */
};

struct store_attempt_list {
    struct store_attempt *items;
    size_t n;
};

/* Take the first queued job whose time has come: it is running from now on with a new attempt, whose
 * token has this SHA-256.
 * *taken false: there was none; then *next_ms is when the next back-off ends (0: nothing waits) */
GROOM_MUST_CHECK groom_status store_job_take(struct store *store, const char *token_hash,
                                             struct store_attempt_ref *ref, bool *taken, int64_t *next_ms,
                                             struct groom_diag *diag);
/* The handle that the launcher gave. */
GROOM_MUST_CHECK groom_status store_attempt_launched(struct store *store, const struct store_attempt_ref *ref,
                                                     const char *handle, struct groom_diag *diag);
/* The attempt whose token has this hash, as its `run`th run speaks.
 * returns  GROOM_ENOTFOUND (no such token), GROOM_ECONFLICT (it has ended, or another has begun) */
GROOM_MUST_CHECK groom_status store_attempt_find(struct store *store, const char *token_hash, uint32_t run,
                                                 struct store_attempt_ref *ref, struct groom_diag *diag);
/* ref->run begins: runs before it are refused from now on. returns  GROOM_ECONFLICT (fenced) */
GROOM_MUST_CHECK groom_status store_attempt_begin_run(struct store *store, const struct store_attempt_ref *ref,
                                                      struct groom_diag *diag);
/* Its process says that it ends without a result, and why; the supervisor draws the conclusion.
 * returns  GROOM_ECONFLICT (fenced) */
GROOM_MUST_CHECK groom_status store_attempt_ended(struct store *store, const struct store_attempt_ref *ref,
                                                  const char *last_words, struct groom_diag *diag);
/* All attempts of a job, oldest first; job_id NULL: all that are running. */
GROOM_MUST_CHECK groom_status store_attempts_list(struct store *store, const char *job_id,
                                                  struct store_attempt_list *list, struct groom_diag *diag);
void store_attempt_list_finish(struct store_attempt_list *list);

/* What a worker reports now and then. */
struct store_loss {
    const char *stage;
    int64_t iteration;
    const char *name;
    double value;
};

struct store_event_new {
    const char *type; /* "stage", "progress", "loss" */
    const char *data; /* JSON */
};

struct store_progress {
    const char *stage; /* NULL: unchanged, with index and count */
    uint32_t stage_index, stage_count;
    double progress;   /* negative: unchanged */
    double eta_s;      /* negative: unknown */
    const char *loss;  /* JSON object of the last values, or NULL: unchanged */
    const struct store_loss *losses;
    size_t n_losses;
    const struct store_event_new *events;
    size_t n_events;
};

/* *cancel: the job is to be cancelled. returns  GROOM_ECONFLICT (fenced) */
GROOM_MUST_CHECK groom_status store_attempt_progress(struct store *store, const struct store_attempt_ref *ref,
                                                     const struct store_progress *progress, bool *cancel,
                                                     struct groom_diag *diag);

struct store_checkpoint {
    char sha256[STORE_HASH_SIZE];
    uint64_t n_bytes;
    uint32_t stage; /* stages that are done */
};

/* This blob is the job's checkpoint from now on; `replaced` is what it was before ("" for none). Where
 * it is another than before the job has got further: its n_failures starts from 0 again, so that a long
 * job on a bad machine ends, and one that dies again and again at the same place does not go on.
 * returns  GROOM_ECONFLICT (fenced) */
GROOM_MUST_CHECK groom_status store_attempt_checkpoint(struct store *store, const struct store_attempt_ref *ref,
                                                       const struct store_checkpoint *checkpoint,
                                                       char replaced[STORE_HASH_SIZE], struct groom_diag *diag);
/* returns  GROOM_ENOTFOUND where the job has none (or never was) */
GROOM_MUST_CHECK groom_status store_checkpoint_get(struct store *store, const char *job_id,
                                                   struct store_checkpoint *checkpoint, struct groom_diag *diag);

/* --- preparations --------------------------------------------------------------------------------- */

/* What an attempt has worked out of its inputs alone, for the next job with the same: a blob under a key that
 * names all that it depends on. It goes with its subject, or once it was not asked for in a long time
 * (store_retire); without it the work is done anew. */
struct store_preparation {
    char sha256[STORE_HASH_SIZE];
    uint64_t n_bytes;
};
/* A committed, pinned blob. It takes the place of one of this key (whose blob is left to the collector).
 * subject  the strands or the groom that it was made of
 * returns  GROOM_ECONFLICT (fenced) */
GROOM_MUST_CHECK groom_status store_attempt_preparation(struct store *store, const struct store_attempt_ref *ref,
                                                        const char *key, const char *subject,
                                                        const struct store_preparation *preparation,
                                                        struct groom_diag *diag);
/* Notes that it was asked for. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_preparation_get(struct store *store, const char *key,
                                                    struct store_preparation *preparation, struct groom_diag *diag);

/* --- the one way from state to state -------------------------------------------------------------- */

struct store_job_move {
    const char *job_id;
    enum store_job_state from, to;
    uint32_t attempt;                       /* 0: none ends; else the job's present one */
    enum store_attempt_state attempt_state; /* how it ended */
    const char *last_words;                 /* of it; NULL: "" */
    int64_t not_before_ms;                  /* back to queued: no earlier than this; 0: at once */
    const char *result, *error;             /* JSON objects for the end states, or NULL */
    /* What it has made, written in the same transaction: */
    const struct store_revision_new *grooms; /* [n_grooms] */
    size_t n_grooms;
    uint32_t groom_expected;                /* 0: they are new; else there is one: the revision after this */
    const struct store_asset *assets;       /* [n_assets] uploads that the grooms stand on; committed and pinned. One
                                             * that is there already stays as it is */
    size_t n_assets;
};

/* Move a job, end its attempt, write what it has made and its `state` event: all or nothing. Into an end
 * state, its checkpoint row goes; `garbage` is that blob ("" for none) for the caller to collect.
 * returns  GROOM_ECONFLICT (it is not in `from`, or `attempt` is not its running one),
 *          GROOM_ECANCELLED (to succeeded, but its cancellation was asked for),
 *          GROOM_ENOTFOUND, and what store_groom_create returns */
GROOM_MUST_CHECK groom_status store_job_move(struct store *store, const struct store_job_move *move,
                                             char garbage[STORE_HASH_SIZE], struct groom_diag *diag);

/* --- messages of a job's end ------------------------------------------------------------------------ */

/* Made with the job, due from its end on (in the transaction that ends it), until it is delivered or given up. */
enum store_webhook_state { STORE_WEBHOOK_WAITING, STORE_WEBHOOK_DELIVERED, STORE_WEBHOOK_GIVEN_UP, STORE_WEBHOOK_STATES };
const char *store_webhook_state_name(enum store_webhook_state state); /* "given_up" */

struct store_webhook {
    char id[STORE_ID_SIZE]; /* "msg_…": the same for every try */
    char job_id[STORE_ID_SIZE];
    char *url, *secret;
    enum store_webhook_state state;
    uint32_t n_attempts;
    int64_t due_ms;  /* the next try; 0: its job has not ended */
    int last_status; /* HTTP; 0: none was answered */
    char *last_error;
    int64_t created_ms, finished_ms;
};

struct store_webhook_list {
    struct store_webhook *items;
    size_t n;
};

/* One that is due, for lease_ms: whoever dies with it leaves it to be tried again. *taken false: none is. */
GROOM_MUST_CHECK groom_status store_webhook_take(struct store *store, int64_t lease_ms,
                                                 struct store_webhook *webhook, bool *taken,
                                                 struct groom_diag *diag);
/* What came of it; due_ms: of the next try where it goes on waiting. */
GROOM_MUST_CHECK groom_status store_webhook_tried(struct store *store, const char *id,
                                                  enum store_webhook_state state, int64_t due_ms, int last_status,
                                                  const char *last_error, struct groom_diag *diag);
/* All of a job. */
GROOM_MUST_CHECK groom_status store_webhooks_list(struct store *store, const char *job_id,
                                                  struct store_webhook_list *list, struct groom_diag *diag);
void store_webhook_finish(struct store_webhook *webhook);
void store_webhook_list_finish(struct store_webhook_list *list);

/* --- events and losses ---------------------------------------------------------------------------------- */

struct store_event {
    int64_t sequence; /* from 1 within a job, without gaps until store_retire */
    char *type;       /* "stage", "progress", "loss", "state" */
    char *data;       /* JSON */
    int64_t created_ms;
};

struct store_event_list {
    struct store_event *items;
    size_t n;
};

/* Events after sequence `after`, in order, at most `limit` (0: 1000). returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_events_since(struct store *store, const char *job_id, int64_t after,
                                                 uint32_t limit, struct store_event_list *list,
                                                 struct groom_diag *diag);
void store_event_list_finish(struct store_event_list *list);

struct store_loss_row {
    char *stage;
    int64_t iteration;
    char *name;
    double value;
};

struct store_loss_list {
    struct store_loss_row *items;
    size_t n;
};

/* All of a job, in the order in which they were reported. returns  GROOM_ENOTFOUND */
GROOM_MUST_CHECK groom_status store_losses_list(struct store *store, const char *job_id,
                                                struct store_loss_list *list, struct groom_diag *diag);
void store_loss_list_finish(struct store_loss_list *list);

/* --- idempotency keys ----------------------------------------------------------------------------------- */

/* A request that carries an Idempotency-Key (struct actor) has it written with the job or the revision
 * that it makes, in the same transaction; it stands for that until it expires. A second one that comes
 * at the same moment gets GROOM_ECONFLICT and finds what the first has made. */
struct store_key {
    char subject[STORE_ID_SIZE]; /* "job_…" or "grm_…" */
    uint32_t number;             /* of the revision; 0 for a job */
};
/* returns  GROOM_ENOTFOUND (a new key), GROOM_ECONFLICT (it stands for another request) */
GROOM_MUST_CHECK groom_status store_key_find(struct store *store, const char *project, const char *key,
                                             const char *request_hash, struct store_key *found,
                                             struct groom_diag *diag);

/* --- the audit --------------------------------------------------------------------------------------------- */

/* Who (struct actor) changed what, and when. The calls above write it with the change itself; nothing
 * takes a row away. */
struct store_audit_entry {
    int64_t sequence, created_ms;
    char *request, *token, *name; /* who; see server/actor.h */
    char *project;                /* whose */
    char *action;                 /* "strands.upload", "groom.revise", "job.cancel" */
    char *subject;                /* id of what was changed */
    char *detail;                 /* "revision 3", or "" */
};

struct store_audit_list {
    struct store_audit_entry *items;
    size_t n;
    int64_t next;
};

/* For changes outside of the store. */
GROOM_MUST_CHECK groom_status store_audit_add(struct store *store, const char *project, const char *action,
                                              const char *subject, const char *detail, struct groom_diag *diag);
GROOM_MUST_CHECK groom_status store_audit_list(struct store *store, struct store_page page,
                                               struct store_audit_list *list, struct groom_diag *diag);
void store_audit_list_finish(struct store_audit_list *list);

/* --- keeping house ------------------------------------------------------------------------------------------ */

struct store_counts {
    uint64_t jobs[STORE_JOB_STATES];
    uint64_t strands, heads, grooms, revisions, attempts_died;
};
GROOM_MUST_CHECK groom_status store_count(struct store *store, struct store_counts *counts,
                                          struct groom_diag *diag);

/* --- copies: for backups and checks -------------------------------------------------------------- */

/* All of the database as it is now into a new file, while others read and write. */
GROOM_MUST_CHECK groom_status store_copy(struct store *store, const char *path, struct groom_diag *diag);
/* The same of a database that nobody has open. */
GROOM_MUST_CHECK groom_status store_copy_file(const char *from, const char *path, struct groom_diag *diag);
void store_copy_remove(const char *path);

/* What a check finds, and what the rows of a copy name outside the database. */
struct store_check_sink {
    void (*problem)(void *user, const char *text); /* NULL: only name what lies outside */
    void (*blob)(void *user, const char *sha256, uint64_t n_bytes, const char *owner); /* in the order of hashes */
    void (*upload)(void *user, const char *id, uint64_t n_durable);
    void *user;
};
/* Of a copy, which is brought to the present schema first. What is wrong goes to the sink; a status is
 * returned only where the check could not be made. */
GROOM_MUST_CHECK groom_status store_copy_check(const char *path, const struct store_check_sink *sink,
                                               struct groom_diag *diag);
GROOM_MUST_CHECK groom_status store_copy_drop_upload(const char *path, const char *id, struct groom_diag *diag);

/* What goes: rows of jobs that ended before these times; 0: nothing of the kind. */
struct store_retention {
    int64_t events_before_ms; /* progress and loss events; states, stages and losses stay */
    int64_t keys_before_ms;   /* idempotency keys that expire before that */
    int64_t jobs_before_ms;   /* jobs with all that is theirs; not the grooms that they made */
    int64_t preparations_before_ms; /* preparations last asked for before that */
};
struct store_retired {
    uint64_t n_event_streams, n_keys, n_jobs, n_preparations;
};
/* One transaction, at most max_rows of each kind: call again where so many went. */
GROOM_MUST_CHECK groom_status store_retire(struct store *store, const struct store_retention *retention,
                                           uint32_t max_rows, struct store_retired *retired,
                                           struct groom_diag *diag);

/* Does any row refer to this blob? What the collector of blobs asks. */
GROOM_MUST_CHECK groom_status store_blob_referenced(struct store *store, const char *sha256, bool *referenced,
                                                    struct groom_diag *diag);

#endif
