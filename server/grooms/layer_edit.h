/* A layer that is being edited: what the files of the edit share. */
#ifndef GROOMS_LAYER_EDIT_H
#define GROOMS_LAYER_EDIT_H

#include "server/grooms/room.h"

/* What the body asks for beside the layer itself. */
struct wish {
    uint32_t layer;      /* id of the operator that is changed; 0: a new one at the end */
    bool commit, points, avoid_head;
    const char *head;    /* of a new groom, or NULL; these four into the body */
    const char *groom;   /* interpolate's other side */
    const char *strands;
    uint32_t revision;
};

/* What is edited: a groom's revision, or one that is being made of an upload. */
struct subject {
    const char *project; /* what ids may name; NULL: any */
    struct grooms *grooms;
    const struct groom *groom;
    char (*keys)[STORE_HASH_SIZE];
    const char *head;                /* id or "" */
    struct edit edit;                /* of a groom; its arrays serve both */
    bool editing;                    /* edit was begun */
    struct model *model;             /* of a groom */
    struct groom *own;               /* of an upload */
    struct state *upload;
    char upload_key[2][STORE_HASH_SIZE];
};

groom_status subject_open(struct grooms *grooms, const struct grooms_layer_edit *edit, const struct wish *wish,
                          struct subject *subject, struct groom_diag *diag);
void subject_close(struct subject *subject);

/* The dense strands of the other side of an interpolation, into the layer's target. */
groom_status subject_target(const struct subject *subject, const struct wish *wish, struct groom *groom, uint32_t index,
                            struct groom_diag *diag);

/* What is to be stored: the chain with its new layer, as a revision or as a new groom. */
struct written {
    struct store_revision_new next;
    uint32_t expected;               /* 0: a new groom */
    char *node;                      /* the layer as it stands in the document; NULL: subject->keys[1] tells the key */
    char *text;
    struct store_array *list;
    struct grooms_prepared prepared;
};

/* `replaced`: a layer stood at `index` before. */
groom_status subject_write(struct subject *subject, const struct groom *groom, uint32_t index, bool replaced,
                           const struct grooms_layer_edit *edit, struct written *written, struct groom_diag *diag);
void written_finish(struct written *written); /* takes zeroed */

/* The answer: what was done, and the strands that the layer looked at where they are wanted. */
struct layer_answer {
    const char *groom_id;
    uint32_t revision, index, layer;
    groom_operator_type type;
    bool committed, has_head;
    double seconds;
    const struct groom_layer_report *report;
    const struct groom_strands *after;  /* with */
    const uint32_t *strand;             /* [n_strands] of it; NULL: no points */
    uint32_t n_strands;
};
/* malloc'ed; NULL: no memory */
char *layer_answer_text(const struct layer_answer *answer);

/* --- one edit (layer_edit.c) ------------------------------------------------------------- */

/* One under way. */
struct layer_trial {
    struct grooms *grooms;
    const struct grooms_layer_edit *edit;
    struct groom_diag *diag;
    cJSON *body;          /* the layer's members; what belongs to the wish is taken out */
    cJSON *control;       /* ... and is here */
    const cJSON *contact; /* sculpt: what a worker has found, or NULL */
    struct wish wish;
    struct subject subject;
    struct groom work;    /* borrows the subject's, with the layer at `index` */
    uint32_t index;
    bool borrowed, replaced;
    struct state *before;
    struct groom_layer_input *input;
    struct groom_strands *after;
    struct groom_layer_report report;
    struct head *head;
    double started_s;
};

/* Read the body, open what it edits, read the layer, and have the strands that come into it. */
groom_status layer_trial_begin(struct layer_trial *trial);
void layer_trial_end(struct layer_trial *trial); /* also where layer_trial_begin has failed */

/* How a revision is stored: now, or with the end of a job. */
typedef groom_status (*layer_trial_store)(void *user, const struct store_revision_new *next, uint32_t expected,
                                          const char *answer, struct groom_diag *diag);
/* With `after` and `report` in the trial. */
groom_status layer_trial_finish(struct layer_trial *trial, layer_trial_store store, void *user, struct grooms_layer_edited *edited);

#endif
