/* Retargeting of a procedural groom: guides are strands that are adapted together; roots, control points and what
 * else has a place are carried as particles are (Eq. 3); operators, instancing and random numbers stay. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "groom/groom.h"
#include "groom/scalp.h"
#include "retarget/job.h"

#define FIELD_NODES 200000

struct carrying {
    const struct groom_mesh *body;
    const struct groom_skeleton *skeleton;
    const uint32_t *regions;
    const struct groom_retarget_target *target;
    const struct groom_retarget_options *options;
    const struct groom_context *context;
    const struct groom_allocator *allocator;
    struct groom_diag *diag;
};

/* --- points ------------------------------------------------------------------------------- */

/* Points are carried as the vertices of one strand of which nothing but the places counts. */
static groom_status carry_points(const struct carrying *c, const float (*points)[3], uint32_t n, int are_roots, float (*out)[3])
{
    struct groom_strands *strands = NULL;
    struct groom_retarget_source *source = NULL;
    struct groom_retarget_options options = *c->options;
    options.mode = GROOM_RETARGET_GLOBAL; /* no guides */
    groom_status st = n ? groom_strands_create(1, n > 1 ? n : 2, c->context, &strands, c->diag) : GROOM_OK;
    if (st != GROOM_OK || n == 0)
        return st;
    memcpy(strands->points, points, n * sizeof *points);
    memcpy(strands->points[strands->n_vertices - 1], points[n - 1], sizeof *points);
    strands->first[1] = strands->n_vertices;
    st = source_init(&source, strands, c->body, c->skeleton, c->regions, &options, c->context, c->diag);
    if (st == GROOM_OK)
        st = source_find_anchors(source, c->regions, c->context, c->diag);
    if (st == GROOM_OK) {
        struct job job = {.source = source, .target = c->target};
        for (uint32_t i = 0; i < n; i++) {
            double p[3] = {0, 0, 0};
            (are_roots ? transfer_root : transfer_anchor)(&job, i, p);
            for (int k = 0; k < 3; k++)
                out[i][k] = (float)p[k];
        }
    }
    groom_retarget_source_destroy(source);
    groom_strands_destroy(strands);
    return st;
}

/* --- strands -------------------------------------------------------------------------------- */

/* In place. roots [n_strands] where they go, or NULL. */
static groom_status carry_strands(const struct carrying *c, struct groom_strands *strands, const float (*roots)[3],
                                  const struct groom_retarget_options *options, struct groom_retarget_report *report)
{
    struct groom_retarget_target target = {c->target->body, c->target->skeleton, roots};
    struct groom_retarget_source *source = NULL;
    float(*out)[3] = memory_array(c->allocator, strands->n_vertices, sizeof *out);
    groom_status st = GROOM_OK;
    if (!out)
        return groom_fail(c->diag, GROOM_ENOMEM, "no memory to carry %u vertices", strands->n_vertices);
    st = groom_retarget_source_create(strands, c->body, c->skeleton, c->regions, options, c->context, &source, c->diag);
    if (st == GROOM_OK)
        st = groom_retarget_run(source, &target, options, c->context, out, NULL, report, c->diag);
    if (st == GROOM_OK)
        memcpy(strands->points, out, strands->n_vertices * sizeof *out);
    groom_retarget_source_destroy(source);
    memory_release(c->allocator, out, strands->n_vertices, sizeof *out);
    return st;
}

/* The guides as strands, all of them adapted together. */
static groom_status carry_guides(const struct carrying *c, struct groom *groom, const float (*roots)[3],
                                 struct groom_retarget_report *report)
{
    struct groom_retarget_options options = *c->options;
    uint32_t n = groom->n_guides, m = groom->n_vertices;
    uint32_t *first = memory_array(c->allocator, (size_t)n + 1, sizeof *first);
    struct groom_strands guides = {.n_strands = n, .n_vertices = n * m, .first = first, .points = groom->guides};
    if (!first)
        return groom_fail(c->diag, GROOM_ENOMEM, "no memory to carry %u guides", n);
    for (uint32_t i = 0; i <= n; i++)
        first[i] = i * m;
    options.guides = n;
    options.mode = GROOM_RETARGET_MULTISCALE;
    groom_status st = carry_strands(c, &guides, roots, &options, report);
    memory_release(c->allocator, first, (size_t)n + 1, sizeof *first);
    return st;
}

static groom_status carry_base(const struct carrying *c, struct groom *groom, const float (*roots)[3],
                               struct groom_retarget_report *report)
{
    struct groom_strands base = {.n_strands = groom->n_strands, .n_vertices = groom->n_base, .first = groom->first, .points = groom->base};
    groom_status st = carry_strands(c, &base, roots, c->options, report);
    for (uint32_t i = 0; st == GROOM_OK && i < groom->n_strands; i++)
        memcpy(groom->roots[i], groom->base[groom->first[i]], sizeof groom->roots[i]);
    return st;
}

/* --- layers ----------------------------------------------------------------------------------- */

/* The map that takes the one body's box to the other's, axis by axis. */
struct box_map {
    double scale[3], offset[3];
};

static struct box_map map_boxes(const struct groom_mesh *from, const struct groom_mesh *to)
{
    struct box_map map;
    float was[2][3], is[2][3];
    groom_mesh_bounds(from, was[0], was[1]);
    groom_mesh_bounds(to, is[0], is[1]);
    for (int c = 0; c < 3; c++) {
        double size = (double)was[1][c] - was[0][c];
        map.scale[c] = size > 0 ? ((double)is[1][c] - is[0][c]) / size : 1;
        map.scale[c] = map.scale[c] > 0 ? map.scale[c] : 1;
        map.offset[c] = is[0][c] - map.scale[c] * was[0][c];
    }
    return map;
}

/* x' = A M A^-1 x, where A is the map of the boxes and M the frame's. */
static void carry_frame(const struct box_map *map, struct groom_layer_frame *frame)
{
    for (int i = 0; i < 3; i++) {
        double moved = frame->transform[i][3];
        for (int j = 0; j < 3; j++) {
            double m = frame->transform[i][j];
            moved -= m * map->offset[j] / map->scale[j];
            frame->transform[i][j] = (float)(map->scale[i] * m / map->scale[j]);
        }
        frame->transform[i][3] = (float)(map->scale[i] * moved + map->offset[i]);
    }
}

static groom_status carry_layer(const struct carrying *c, struct groom_layer *layer)
{
    struct box_map map = map_boxes(c->body, c->target->body);
    groom_status st = carry_points(c, (const float(*)[3])layer->anchors.position, layer->anchors.n, 0, layer->anchors.position);
    if (st == GROOM_OK)
        st = carry_points(c, (const float(*)[3])layer->contact.position, layer->contact.n, 0, layer->contact.position);
    for (uint32_t i = 0; i < layer->n_frames; i++)
        carry_frame(&map, &layer->frames[i]);
    if (st == GROOM_OK && layer->target)
        st = carry_strands(c, layer->target, NULL, c->options, NULL);
    return st;
}

/* --- scalp coordinates -------------------------------------------------------------------------- */

/* Coordinates that came with a file are names of places rather than places: they stay. */
static groom_status chart(const struct carrying *c, struct groom *groom)
{
    struct groom_bvh *bvh = NULL;
    struct groom_scalp *scalp = NULL;
    uint32_t n = groom->n_guides;
    float(*guide_roots)[3] = memory_array(c->allocator, n, sizeof *guide_roots);
    groom_status st = guide_roots ? GROOM_OK : groom_fail(c->diag, GROOM_ENOMEM, "no memory for scalp coordinates");
    if (st == GROOM_OK)
        st = groom_bvh_create(c->target->body, c->context, &bvh, c->diag);
    if (st == GROOM_OK)
        st = groom_scalp_create((const float(*)[3])groom->roots, groom->n_strands, bvh, c->context, &scalp, c->diag);
    if (st == GROOM_OK) {
        for (uint32_t i = 0; i < n; i++)
            memcpy(guide_roots[i], groom->guides[(size_t)i * groom->n_vertices], sizeof *guide_roots);
        groom_scalp_coordinates(scalp, (const float(*)[3])groom->roots, groom->n_strands, groom->root_uv, c->context);
        if (n > 0)
            groom_scalp_coordinates(scalp, (const float(*)[3])guide_roots, n, groom->guide_uv, c->context);
        groom->scalp = groom_scalp_source_of(scalp);
    }
    groom_scalp_destroy(scalp);
    groom_bvh_destroy(bvh);
    memory_release(c->allocator, guide_roots, n, sizeof *guide_roots);
    return st;
}

/* --- what the operators make of it ----------------------------------------------------------------- */

/* Layers look at whole hairstyles and are not this room's to evaluate: a view without them. */
static groom_status evaluate(const struct carrying *c, const struct groom *groom, struct groom_operator *operators,
                             struct groom_strands *dense)
{
    struct groom view = *groom;
    if (groom->n_operators) /* of none there is no array to copy */
        memcpy(operators, groom->operators, groom->n_operators * sizeof *operators);
    for (uint32_t i = 0; i < groom->n_operators; i++)
        operators[i].enabled = operators[i].enabled && !groom_operator_is_layer(operators[i].type);
    view.operators = operators;
    for (uint32_t i = 0; i <= groom->n_strands; i++)
        dense->first[i] = (uint32_t)groom_first_vertex(groom, i);
    return groom_evaluate(&view, 0, groom->n_strands, dense->points, c->context, c->diag);
}

static groom_status count(const struct carrying *c, const struct groom_strands *dense, struct groom_retarget_inside *inside)
{
    struct groom_retarget_source source = {.strands = dense};
    struct job job = {.source = &source, .target = c->target, .options = c->options, .context = c->context, .allocator = c->allocator};
    float low[3], high[3];
    groom_mesh_bounds(c->target->body, low, high);
    groom_status st = groom_bvh_create(c->target->body, c->context, &job.bvh, c->diag);
    if (st == GROOM_OK)
        st = field_init(&job.field, job.bvh, low, high, 0.02f, FIELD_NODES, c->context, c->diag);
    if (st == GROOM_OK)
        st = clearance_count(&job, dense->points, inside, c->diag);
    field_finish(&job.field);
    groom_bvh_destroy(job.bvh);
    return st;
}

static groom_status count_evaluated(const struct carrying *c, const struct groom *groom, struct groom_retarget_inside *inside)
{
    struct groom_strands *dense = NULL;
    uint32_t n = groom->n_operators;
    struct groom_operator *operators = memory_array(c->allocator, n, sizeof *operators);
    groom_status st = operators ? GROOM_OK : groom_fail(c->diag, GROOM_ENOMEM, "no memory for the operators");
    if (st == GROOM_OK)
        st = groom_strands_create(groom->n_strands, groom_first_vertex(groom, groom->n_strands), c->context, &dense, c->diag);
    if (st == GROOM_OK)
        st = evaluate(c, groom, operators, dense);
    if (st == GROOM_OK)
        st = count(c, dense, inside);
    groom_strands_destroy(dense);
    memory_release(c->allocator, operators, n, sizeof *operators);
    return st;
}

/* --- the groom ------------------------------------------------------------------------------------------ */

/* target.roots: of the strands, then of the guides. */
static groom_status carry(const struct carrying *c, struct groom *groom, struct groom_retarget_report *report)
{
    const float(*roots)[3] = c->target->roots;
    groom_status st;
    if (groom->base) {
        st = carry_base(c, groom, roots, report);
    } else {
        st = carry_guides(c, groom, roots ? roots + groom->n_strands : NULL, report);
        if (st == GROOM_OK && roots)
            memcpy(groom->roots, roots, groom->n_strands * sizeof *roots);
        else if (st == GROOM_OK)
            st = carry_points(c, (const float(*)[3])groom->roots, groom->n_strands, 1, groom->roots);
    }
    for (uint32_t i = 0; st == GROOM_OK && i < groom->n_operators; i++)
        if (groom->operators[i].layer)
            st = carry_layer(c, groom->operators[i].layer);
    if (st == GROOM_OK && groom->scalp != GROOM_SCALP_FILE)
        st = chart(c, groom);
    if (st == GROOM_OK)
        st = count_evaluated(c, groom, &report->inside_after);
    return st;
}

groom_status groom_retarget_groom(const struct groom *groom, const struct groom_mesh *body,
                                  const struct groom_skeleton *skeleton, const uint32_t *regions,
                                  const struct groom_retarget_target *target, const struct groom_retarget_options *options,
                                  const struct groom_context *context, struct groom **out,
                                  struct groom_retarget_report *report_out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct carrying c = {body, skeleton, regions, target, options, context, allocator, diag};
    struct groom_retarget_report *report = memory_array_zero(allocator, 1, sizeof *report);
    struct groom *copy = NULL;
    groom_status st = report ? groom_clone(groom, context, &copy, diag) : groom_fail(diag, GROOM_ENOMEM, "no memory to retarget");
    if (st == GROOM_OK)
        st = carry(&c, copy, report);
    if (st == GROOM_OK && report_out)
        *report_out = *report;
    if (st == GROOM_OK)
        *out = copy;
    else
        groom_destroy(copy);
    memory_release(allocator, report, 1, sizeof *report);
    return st;
}

groom_status groom_retarget_groom_roots(const struct groom *groom, const struct groom_mesh *body,
                                        const struct groom_skeleton *skeleton, const uint32_t *regions,
                                        const struct groom_retarget_target *target, const struct groom_context *context,
                                        float (*roots)[3], struct groom_diag *diag)
{
    struct groom_retarget_options options;
    struct carrying c = {body, skeleton, regions, target, &options, context, memory_allocator(context), diag};
    groom_retarget_options_init(&options);
    for (uint32_t i = 0; i < groom->n_strands; i++)
        memcpy(roots[i], groom->base ? groom->base[groom->first[i]] : groom->roots[i], sizeof *roots);
    for (uint32_t i = 0; i < groom->n_guides; i++)
        memcpy(roots[groom->n_strands + i], groom->guides[(size_t)i * groom->n_vertices], sizeof *roots);
    return carry_points(&c, (const float(*)[3])roots, groom->n_strands + groom->n_guides, 1, roots);
}
