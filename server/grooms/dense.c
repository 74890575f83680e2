/* The dense strands of a revision in memory, for what looks at them all at once. */
#include <stdlib.h>

#include "server/grooms/room.h"

const struct groom_context *grooms_context(const struct grooms *grooms) { return &grooms->context; }

groom_status grooms_dense(struct grooms *grooms, const char *groom_id, uint32_t revision, uint32_t count,
                          struct grooms_dense *out, struct groom_diag *diag)
{
    struct model *model = NULL;
    struct groom *fewer = NULL, rest;
    struct state *state = NULL;
    struct grooms_dense dense = {0};
    groom_status status = models_acquire(grooms, groom_id, revision, &model, diag);
    if (status != GROOM_OK)
        return status;
    dense.revision = model->revision;
    dense.n_of = model->groom->n_strands;
    status = evaluate_rest(grooms, model, &rest, &state, diag);
    if (status == GROOM_OK && count && count < dense.n_of)
        status = select_fairly(&rest, count, &fewer, &dense.index, diag);
    if (status == GROOM_OK) {
        const struct groom *groom = fewer ? fewer : &rest;
        status = groom_evaluate_between(groom, 0, groom->n_operators, NULL, &grooms->context, &dense.strands, diag);
    }
    groom_destroy(fewer);
    states_release(grooms->states, state);
    models_release(grooms, model);
    if (status == GROOM_OK)
        *out = dense;
    else
        grooms_dense_finish(&dense);
    return status;
}

void grooms_dense_finish(struct grooms_dense *dense)
{
    groom_strands_destroy(dense->strands);
    free(dense->index);
    *dense = (struct grooms_dense){0};
}
