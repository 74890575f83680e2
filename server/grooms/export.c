/* Strands of a revision, evaluated piece by piece into a file. */
#include <stdlib.h>

#include "server/grooms/room.h"

/* Strands evaluated at a time: a few megabytes, enough to keep the pool busy. */
#define PIECE_STRANDS 4096

static int compare_indices(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return x < y ? -1 : x > y;
}

groom_status select_fairly(const struct groom *groom, uint32_t count, struct groom **selected, uint32_t **index,
                           struct groom_diag *diag)
{
    uint32_t *order = malloc(groom->n_strands * sizeof *order);
    if (!order)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to choose %u strands", count);
    groom_fair_order(groom->n_strands, order);
    qsort(order, count, sizeof *order, compare_indices);
    groom_status status = groom_select(groom, order, count, NULL, selected, diag);
    if (status == GROOM_OK && index)
        *index = order;
    else
        free(order);
    return status;
}

static groom_status write_pieces(struct grooms *grooms, const struct groom *groom, struct groom_writer *writer,
                                 struct groom_diag *diag)
{
    float(*points)[3] = malloc(PIECE_STRANDS * (size_t)groom->n_vertices * sizeof *points);
    groom_status status = GROOM_OK;
    if (!points)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to evaluate strands");
    for (uint32_t first = 0; first < groom->n_strands && status == GROOM_OK; first += PIECE_STRANDS) {
        uint32_t left = groom->n_strands - first, count = left < PIECE_STRANDS ? left : PIECE_STRANDS;
        size_t n_points = groom_first_vertex(groom, first + count) - groom_first_vertex(groom, first);
        status = groom_evaluate(groom, first, count, points, &grooms->context, diag);
        if (status == GROOM_OK)
            status = groom_writer_points(writer, (const float(*)[3])points, n_points, diag);
    }
    free(points);
    return status;
}

/* How many vertices each strand has, or NULL where that is no question. */
static groom_status count_vertices(const struct groom *groom, uint32_t **counts)
{
    *counts = NULL;
    if (!groom->base)
        return GROOM_OK;
    if (!(*counts = malloc(groom->n_strands * sizeof **counts)))
        return GROOM_ENOMEM;
    for (uint32_t i = 0; i < groom->n_strands; i++)
        (*counts)[i] = groom->first[i + 1] - groom->first[i];
    return GROOM_OK;
}

static groom_status write_groom(struct grooms *grooms, const struct groom *groom,
                                const struct groom_write_options *options, struct groom_sink sink,
                                struct groom_diag *diag)
{
    struct groom_writer *writer = NULL;
    uint32_t *counts;
    if (count_vertices(groom, &counts) != GROOM_OK)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to write %u strands", groom->n_strands);
    groom_status status = groom_writer_create(options, groom->n_strands, counts, groom->n_vertices, sink,
                                              &grooms->context, &writer, diag);
    if (status == GROOM_OK)
        status = write_pieces(grooms, groom, writer, diag);
    if (status == GROOM_OK)
        status = groom_writer_finish(writer, diag);
    groom_writer_destroy(writer);
    free(counts);
    return status;
}

/* The groom with random numbers as they were before a fit, or an edit, moved them. */
static groom_status draw_randoms(struct grooms *grooms, const struct groom *groom, struct groom **drawn,
                                 struct groom_diag *diag)
{
    struct groom *copy = NULL;
    groom_status status = groom_clone(groom, &grooms->context, &copy, diag);
    if (status != GROOM_OK)
        return status;
    for (uint32_t o = 0; o < copy->n_operators; o++)
        groom_draw_random(copy, &copy->operators[o], copy->operators[o].seed);
    *drawn = copy;
    return GROOM_OK;
}

groom_status grooms_write_strands(struct grooms *grooms, const char *groom_id, const struct grooms_export *what,
                                  struct groom_sink sink, struct groom_diag *diag)
{
    struct model *model = NULL;
    struct groom *fewer = NULL, rest = {0};
    struct state *state = NULL;
    groom_status status = models_acquire(grooms, groom_id, what->revision, &model, diag);
    if (status != GROOM_OK)
        return status;
    if (what->drawn)
        status = draw_randoms(grooms, model->groom, &fewer, diag);
    else if (what->count > model->groom->n_strands)
        status = groom_fail_field(diag, GROOM_EINVAL, "/count", "the groom has %u strands: ask for at most as many",
                                  model->groom->n_strands);
    if (status == GROOM_OK && !what->drawn)
        status = evaluate_rest(grooms, model, &rest, &state, diag);
    if (status == GROOM_OK && what->count && what->count < rest.n_strands)
        status = select_fairly(&rest, what->count, &fewer, NULL, diag);
    if (status == GROOM_OK)
        status = write_groom(grooms, fewer ? fewer : &rest, &what->write, sink, diag);
    groom_destroy(fewer);
    states_release(grooms->states, state);
    models_release(grooms, model);
    return status;
}

groom_status grooms_write_guides(struct grooms *grooms, const char *groom_id, const struct grooms_export *what,
                                 struct groom_sink sink, struct groom_diag *diag)
{
    struct model *model = NULL;
    struct groom_writer *writer = NULL;
    groom_status status = models_acquire(grooms, groom_id, what->revision, &model, diag);
    if (status != GROOM_OK)
        return status;
    const struct groom *groom = model->groom;
    if (groom->n_guides == 0) {
        models_release(grooms, model);
        return groom_fail(diag, GROOM_ENOTFOUND, "this groom is made of uploaded strands: it has no guides");
    }
    status = groom_writer_create(&what->write, groom->n_guides, NULL, groom->n_vertices, sink, &grooms->context,
                                 &writer, diag);
    if (status == GROOM_OK)
        status = groom_writer_points(writer, (const float(*)[3])groom->guides,
                                     (size_t)groom->n_guides * groom->n_vertices, diag);
    if (status == GROOM_OK)
        status = groom_writer_finish(writer, diag);
    groom_writer_destroy(writer);
    models_release(grooms, model);
    return status;
}
