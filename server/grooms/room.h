/* What the files of this room share: the service, the arrays of a document, decoded models. */
#ifndef GROOMS_ROOM_H
#define GROOMS_ROOM_H

#include <pthread.h>
#include <cjson/cJSON.h>

#include "groom/document.h"
#include "groom/groom.h"
#include "groom/layers.h"
#include "server/cache.h"
#include "server/grooms/grooms.h"

struct grooms {
    struct grooms_options options;
    struct groom_context context; /* for evaluation: the pool */
    struct cache *models;
    struct states *states;
    struct cache *heads;
    pthread_mutex_t comparing;    /* one comparison at a time: each uses all processors */
};

/* --- the arrays of one document (arrays.c) --------------------------------------------- */

/* Those that a document names, read from the store when asked for, and those that were written anew.
 * Neither more nor less can be referred to: a client cannot name another groom's array. */
struct arrays {
    struct store *store;
    struct arrays_item {
        char sha256[STORE_HASH_SIZE];
        void *bytes;    /* owned; NULL until it is needed */
        size_t n_bytes;
        bool stored;    /* it is in the store already */
        bool used;      /* the document that is being written names it */
    } *items;
    size_t n;
};

void arrays_init(struct arrays *arrays, struct store *store);
void arrays_finish(struct arrays *arrays);
/* Allow every array that this document refers to. */
groom_status arrays_allow(struct arrays *arrays, const cJSON *document);
struct groom_array_finder arrays_finder(struct arrays *arrays);
struct groom_array_keeper arrays_keeper(struct arrays *arrays);
/* What the written document refers to, for the store; the list is malloc'ed, its bytes borrowed. */
groom_status arrays_list(const struct arrays *arrays, struct store_array **list, size_t *n);
/* Mark every array that this document refers to as used by what is written. */
void arrays_use(struct arrays *arrays, const cJSON *document);

/* --- decoded models (models.c) ------------------------------------------------------------ */

struct model {
    struct cache_entry entry;
    char groom_id[STORE_ID_SIZE];
    uint32_t revision;
    char head[STORE_ID_SIZE]; /* of its document's source, or "" */
    struct groom *groom;
    char (*keys)[STORE_HASH_SIZE]; /* [n_operators + 1] of the strands before each operator, and behind the last */
};

groom_status models_create(size_t max_bytes, struct cache **models);
/* The model of a revision (0: the latest), to be released. */
groom_status models_acquire(struct grooms *grooms, const char *groom_id, uint32_t revision, struct model **model,
                            struct groom_diag *diag);
void models_release(struct grooms *grooms, struct model *model);

/* --- fewer strands (export.c) ---------------------------------------------------------------- */

/* The first `count` strands of the fair order, back in the order of the groom.
 * index  which these are, malloc'ed; or NULL where nobody asks */
groom_status select_fairly(const struct groom *groom, uint32_t count, struct groom **selected, uint32_t **index,
                           struct groom_diag *diag);

/* --- dense strands that were computed (states.c) ----------------------------------------------- */

/* Strands at a place of a chain, under the hash of all that they come from: another revision, or another
 * groom, with the same beginning finds them. */
struct state {
    struct cache_entry entry;
    struct groom_strands *strands;
    struct groom_layer_input *input; /* of a layer that was tried here last; states_take_input */
};

groom_status states_create(size_t max_bytes, struct states **states);
void states_destroy(struct states *states);
/* The state of this key, to be released, or NULL. */
struct state *states_find(struct states *states, const char *key);
/* strands is taken over, also on GROOM_ENOMEM. The state is to be released. */
groom_status states_keep(struct states *states, const char *key, struct groom_strands *strands, struct state **state);
void states_release(struct states *states, struct state *state); /* takes NULL */
/* Take what was kept for a layer (or NULL); give it back, or another, when done: the last one stays. */
struct groom_layer_input *states_take_input(struct states *states, struct state *state);
void states_give_input(struct states *states, struct state *state, struct groom_layer_input *input);

/* --- evaluation with layers (evaluate.c) ---------------------------------------------------------- */

/* Keys of a chain's places from its document, whose arrays are references: [n_operators + 1], malloc'ed. */
groom_status evaluate_keys(const cJSON *document, char (**keys)[STORE_HASH_SIZE]);
/* The key behind an operator that stands at a place with this key. */
void evaluate_next_key(const char *key, const char *operator_json, char next[STORE_HASH_SIZE]);
/* The dense strands that come into operator `index` (n_operators: that come out of the chain). */
groom_status evaluate_state(struct grooms *grooms, const struct groom *groom, char (*keys)[STORE_HASH_SIZE],
                            uint32_t index, struct state **state, struct groom_diag *diag);
/* What is left of the chain behind its last layer: a view, and the state it stands on (NULL where there
 * is no layer), to be released. */
groom_status evaluate_rest(struct grooms *grooms, const struct model *model, struct groom *rest, struct state **state,
                           struct groom_diag *diag);

/* --- heads (heads.c) -------------------------------------------------------------------------------- */

/* The surface of an uploaded head, read by groom-worker; the last few stay. *head NULL: there is none of
 * this id here. To be released. */
struct head;
groom_status heads_acquire(struct grooms *grooms, const char *id, struct head **head, struct groom_diag *diag);
void heads_release(struct grooms *grooms, struct head *head); /* takes NULL */
const struct groom_bvh *head_surface(const struct head *head);
groom_status heads_create(struct cache **heads);

/* --- one edit under way (edit.c) ---------------------------------------------------------------------- */

struct edit {
    struct grooms *grooms;
    const char *groom_id;
    uint32_t expected;              /* 0: the latest, whatever it is */
    const char *note;
    struct store_revision revision; /* the one that is changed */
    cJSON *document;                /* its tree */
    struct arrays arrays;
    struct groom_diag *diag;
};

/* Also refuses an edit that has come too late before any work is done; the store has the last word. */
groom_status edit_begin(struct edit *edit);
void edit_finish(struct edit *edit);
/* The tree as the next revision, as it stands: what was changed in it has been checked, and its arrays
 * are references. */
groom_status edit_prepare_tree(struct edit *edit, char **text, struct store_array **list,
                               struct store_revision_new *next);

/* --- first revisions (grooms.c) ----------------------------------------------------------------------- */

/* As grooms_prepare, of a groom; `document` has the members around it. */
groom_status prepare_groom(struct grooms *grooms, const struct groom *groom, const char *document, size_t n_bytes,
                           const struct grooms_source *source, struct grooms_prepared *prepared,
                           struct groom_diag *diag);

/* --- uploaded strands (uploads.c) ------------------------------------------------------------------------ */

/* The strands of an upload, read by groom-worker, under the key of its id; *name is malloc'ed.
 * returns  GROOM_ENOTFOUND */
groom_status uploads_acquire(struct grooms *grooms, const char *id, struct state **state, char **name,
                             struct groom_diag *diag);

/* --- projects (documents.c) ------------------------------------------------------------------ */

/* GROOM_ENOTFOUND where the id names nothing of this project (NULL: any). */
groom_status project_has(struct grooms *grooms, const char *project, const char *id, struct groom_diag *diag);

/* --- documents as trees (documents.c) ------------------------------------------------------- */

/* The stored revision (0: the latest) and its document's tree. On GROOM_OK both are the caller's. */
groom_status documents_load(struct grooms *grooms, const char *groom_id, uint32_t number,
                            struct store_revision *revision, cJSON **document, struct groom_diag *diag);
/* Take out what struct groom holds; what is left goes around a new document. */
void documents_strip_model(cJSON *document);
/* A tree from JSON text that came from the store or passed groom_document_read. */
groom_status documents_parse(const char *json, size_t n_bytes, cJSON **document, struct groom_diag *diag);
/* Sets or replaces a member; string NULL: null. */
groom_status documents_set_string(cJSON *document, const char *name, const char *string);
groom_status documents_set_number(cJSON *document, const char *name, double number);

#endif
