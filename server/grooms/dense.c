/* The dense strands of a revision in memory, for what looks at them all at once. */
#include <stdlib.h>

#include "server/grooms/room.h"

const struct groom_context *grooms_context(const struct grooms *grooms) { return &grooms->context; }

static groom_status evaluate(struct grooms *grooms, const struct groom *groom, struct groom_strands **strands,
                             struct groom_diag *diag)
{
    struct groom_strands *made = NULL;
    uint32_t n = groom->n_strands, m = groom->n_vertices;
    groom_status status = groom_strands_create(n, (uint64_t)n * m, &grooms->context, &made, diag);
    if (status != GROOM_OK)
        return status;
    for (uint32_t i = 0; i < n; i++)
        made->first[i + 1] = made->first[i] + m;
    status = groom_evaluate(groom, 0, n, made->points, &grooms->context, diag);
    if (status != GROOM_OK) {
        groom_strands_destroy(made);
        return status;
    }
    *strands = made;
    return GROOM_OK;
}

groom_status grooms_dense(struct grooms *grooms, const char *groom_id, uint32_t revision, uint32_t count,
                          struct grooms_dense *out, struct groom_diag *diag)
{
    struct model *model = NULL;
    struct groom *fewer = NULL;
    struct grooms_dense dense = {0};
    groom_status status = models_acquire(grooms, groom_id, revision, &model, diag);
    if (status != GROOM_OK)
        return status;
    dense.revision = model->revision;
    dense.n_of = model->groom->n_strands;
    if (count && count < dense.n_of)
        status = select_fairly(model->groom, count, &fewer, &dense.index, diag);
    if (status == GROOM_OK)
        status = evaluate(grooms, fewer ? fewer : model->groom, &dense.strands, diag);
    groom_destroy(fewer);
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
