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

/* Write the chain with its new layer at `index` as a revision, or as a new groom. `replaced`: one of this place
 * was there before.
 * node     the layer as it now stands in the document, for the key behind it; malloc'ed */
groom_status subject_commit(struct subject *subject, const struct groom *groom, uint32_t index, bool replaced,
                            const struct grooms_layer_edit *edit, char groom_id[STORE_ID_SIZE], uint32_t *revision,
                            char **node, struct groom_diag *diag);

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

#endif
