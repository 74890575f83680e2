/* What the files of this room share: the service, the arrays of a document, decoded models. */
#ifndef GROOMS_ROOM_H
#define GROOMS_ROOM_H

#include <pthread.h>
#include <cjson/cJSON.h>

#include "groom/document.h"
#include "groom/groom.h"
#include "server/grooms/grooms.h"

struct models;

struct grooms {
    struct grooms_options options;
    struct groom_context context; /* for evaluation: the pool */
    struct models *models;
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

/* --- decoded models (models.c) ------------------------------------------------------------ */

/* A bounded cache, least recently used out first. A model that is in use stays. */
struct model {
    char groom_id[STORE_ID_SIZE];
    uint32_t revision;
    char head[STORE_ID_SIZE]; /* of its document's source, or "" */
    struct groom *groom;
    size_t n_bytes;
    unsigned n_users;
    uint64_t last_used;
    struct model *next;
};

groom_status models_create(size_t max_bytes, struct models **models);
void models_destroy(struct models *models);
/* The model of a revision (0: the latest), to be released. */
groom_status models_acquire(struct grooms *grooms, const char *groom_id, uint32_t revision, struct model **model,
                            struct groom_diag *diag);
void models_release(struct grooms *grooms, struct model *model);

/* --- fewer strands (export.c) ---------------------------------------------------------------- */

/* The first `count` strands of the fair order, back in the order of the groom.
 * index  which these are, malloc'ed; or NULL where nobody asks */
groom_status select_fairly(const struct groom *groom, uint32_t count, struct groom **selected, uint32_t **index,
                           struct groom_diag *diag);

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
