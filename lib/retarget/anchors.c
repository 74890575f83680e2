/* Which bone a particle hangs on, and where on the surface: Yu et al., Section 4.1, Eq. 2.
 *
 * Costs are compared by their logarithms, ln|p - q| + sigma <r, v>^2, since e^100 is beyond floats' use. The
 * exponent is known before the ray is cast and |p - q| is at least p's distance from the surface, so that
 * most bones are ruled out without a ray. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/vec.h"
#include "retarget/field.h"
#include "retarget/batches.h"
#include "retarget/source.h"

#define PIECE 2048            /* particles */
#define ROOT_ANCHOR 0.02f /* metres: a root's anchor is nearer, unless nothing else is */
#define BATCH 64              /* pieces between two looks at progress */
#define FIELD_NODES 300000
#define MOST_HITS 64
#define SMALLEST 1e-12        /* metres: a shorter vector has no direction */

struct search {
    struct groom_retarget_source *source;
    const uint32_t *regions;
    const struct groom_bvh *bvh;
    struct field field;
    uint64_t *without;        /* [pieces] particles that no ray reached */
};

/* A bone seen from a particle. */
struct view {
    uint32_t bone, along;
    struct vec o, r;          /* nearest point of the bone; unit vector from it to the particle */
    double exponent, bound;   /* sigma <r, v>^2; the least that the cost can be */
};

struct choice {
    struct anchor anchor;
    double cost;
};

static struct vec bone_point(const struct groom_bone *bone, uint32_t along)
{
    struct vec head = vec_of(bone->head), tail = vec_of(bone->tail);
    return vec_add(head, vec_scale(vec_sub(tail, head), (double)along / UINT32_MAX));
}

static int view_bone(const struct groom_retarget_source *source, uint32_t b, struct vec p, double log_away, struct view *view)
{
    const struct groom_bone *bone = &source->skeleton.bones[b];
    struct vec head = vec_of(bone->head), v = vec_sub(vec_of(bone->tail), head);
    double t = vec_dot(vec_sub(p, head), v) / vec_dot(v, v);
    view->bone = b;
    view->along = (uint32_t)((t < 0 ? 0 : t > 1 ? 1 : t) * UINT32_MAX + 0.5);
    view->o = bone_point(bone, view->along);
    view->r = vec_sub(p, view->o);
    if (!(vec_length(view->r) > SMALLEST))
        return 0;
    view->r = vec_unit(view->r);
    double c = vec_dot(view->r, vec_unit(v));
    view->exponent = source->options.sigma_bone * c * c;
    view->bound = view->exponent + log_away;
    return 1;
}

/* Where the line o + t r meets the plane of a triangle, in double: t, and the weights as they are stored. */
static double meet(const struct groom_mesh *mesh, uint32_t triangle, struct vec o, struct vec r, struct anchor *anchor)
{
    const uint32_t *i = mesh->triangles[triangle];
    struct vec a = vec_of(mesh->points[i[0]]);
    struct vec e = vec_sub(vec_of(mesh->points[i[1]]), a), f = vec_sub(vec_of(mesh->points[i[2]]), a);
    struct vec s = vec_sub(o, a), h = vec_cross(r, f), k = vec_cross(s, e);
    double determinant = vec_dot(e, h);
    anchor->triangle = triangle;
    anchor->v = (float)(vec_dot(s, h) / determinant);
    anchor->w = (float)(vec_dot(r, k) / determinant);
    return vec_dot(f, k) / determinant;
}

static struct vec surface_point(const struct groom_mesh *mesh, const struct anchor *anchor)
{
    const uint32_t *i = mesh->triangles[anchor->triangle];
    struct vec a = vec_of(mesh->points[i[0]]);
    struct vec e = vec_sub(vec_of(mesh->points[i[1]]), a), f = vec_sub(vec_of(mesh->points[i[2]]), a);
    return vec_add(a, vec_add(vec_scale(e, anchor->v), vec_scale(f, anchor->w)));
}

/* One place where the ray leaves the body. */
static void weigh(const struct search *search, const struct view *view, struct vec p, uint32_t triangle, int anywhere,
                  struct choice *best)
{
    const struct groom_retarget_source *source = search->source;
    struct anchor anchor = {.bone = view->bone, .along = view->along};
    if (!anywhere && !(search->regions[triangle] >> view->bone & 1))
        return;
    if (!isfinite(meet(source->body, triangle, view->o, view->r, &anchor)))
        return;
    struct vec q = surface_point(source->body, &anchor), r = vec_sub(q, view->o);
    if (!(vec_length(r) > SMALLEST))
        return;
    double eta = vec_dot(vec_sub(p, q), vec_unit(r));
    double cost = log(fabs(eta) > SMALLEST ? fabs(eta) : SMALLEST) + view->exponent;
    anchor.eta = (float)eta;
    if (cost < best->cost)
        *best = (struct choice){anchor, cost};
}

/* The places where the ray leaves the body, as far from p as the best cost so far lets them be. */
static void cast(const struct search *search, const struct view *view, struct vec p, int anywhere, struct choice *best)
{
    float o[3], r[3];
    double length = vec_length(vec_sub(p, view->o)), reach = exp(best->cost - view->exponent) * 1.0001 + 1e-6;
    float from = (float)fmax(0, length - reach), to = (float)(length + reach);
    vec_store(view->o, o);
    vec_store(view->r, r);
    for (int i = 0; i < MOST_HITS; i++) {
        struct groom_surface_point hit;
        if (!groom_bvh_ray(search->bvh, o, r, from, to, &hit))
            break;
        if (vec_dot(view->r, vec_of(hit.normal)) > 0)
            weigh(search, view, p, hit.triangle, anywhere, best);
        from = nextafterf(hit.distance, INFINITY) + 1e-6f;
    }
}

static void sort_views(struct view *views, uint32_t n)
{
    for (uint32_t i = 1; i < n; i++) {
        struct view one = views[i];
        uint32_t at = i;
        for (; at > 0 && views[at - 1].bound > one.bound; at--)
            views[at] = views[at - 1];
        views[at] = one;
    }
}

static void settle_for_nearest(const struct search *search, const float point[3], struct choice *best)
{
    struct groom_surface_point near;
    if (!groom_bvh_closest(search->bvh, point, INFINITY, &near))
        return;
    best->anchor = (struct anchor){.triangle = near.triangle, .v = near.barycentric[1], .w = near.barycentric[2], .bone = ANCHOR_NO_BONE};
    best->cost = 0;
}

/* returns 1 where some bone's ray was found */
static int choose(const struct search *search, const float point[3], struct anchor *anchor)
{
    const struct groom_skeleton *skeleton = &search->source->skeleton;
    struct view views[GROOM_SKELETON_MAX_BONES];
    struct choice best = {.cost = INFINITY};
    struct vec p = vec_of(point);
    double away = field_away(&search->field, point), log_away = away > SMALLEST ? log(away) : log(SMALLEST);
    uint32_t n = 0;
    for (uint32_t b = 0; b < skeleton->n_bones; b++)
        n += (uint32_t)view_bone(search->source, b, p, log_away, &views[n]);
    sort_views(views, n);
    for (int anywhere = 0; anywhere < 2 && best.cost == INFINITY; anywhere++)
        for (uint32_t i = 0; i < n && views[i].bound < best.cost; i++)
            cast(search, &views[i], p, anywhere, &best);
    int found = best.cost < INFINITY;
    if (!found)
        settle_for_nearest(search, point, &best);
    *anchor = best.anchor;
    return found;
}

static void anchor_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct search *search = user;
    const struct groom_strands *strands = search->source->strands;
    (void)thread;
    for (uint32_t i = piece * PIECE; i < strands->n_vertices && i - piece * PIECE < PIECE; i++)
        search->without[piece] += !choose(search, strands->points[i], &search->source->anchors[i]);
}

/* Eq. 2 puts e^100 on a bone that points at the particle: straight above the head's bone an arm is preferred, a foot
 * away, which may do for what hangs there. A root grows where it is: one whose anchor is far from it has the surface
 * beside it. */
static void seat_root(const struct search *search, uint32_t vertex)
{
    struct anchor *anchor = &search->source->anchors[vertex];
    struct groom_surface_point near;
    if (fabsf(anchor->eta) < ROOT_ANCHOR)
        return;
    double outside = field_signed(&search->field, search->source->strands->points[vertex], &near);
    if (fabs(outside) < 0.5 * fabsf(anchor->eta))
        *anchor = (struct anchor){.triangle = near.triangle, .v = near.barycentric[1], .w = near.barycentric[2],
                                  .bone = ANCHOR_NO_BONE, .eta = (float)outside};
}

static void root_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct search *search = user;
    const struct groom_strands *strands = search->source->strands;
    (void)thread;
    for (uint32_t i = piece * PIECE; i < strands->n_strands && i - piece * PIECE < PIECE; i++)
        seat_root(search, strands->first[i]);
}

static groom_status search_all(struct search *search, const struct groom_context *context, struct groom_diag *diag)
{
    struct batches batches = {.n_pieces = search->source->strands->n_vertices / PIECE + 1, .batch = BATCH, .to = 0.5,
                              .doing = "the bones of strands were looked for"};
    groom_status st = batches_run(context, &batches, anchor_piece, search, diag);
    if (st != GROOM_OK)
        return st;
    parallel_for(context, search->source->strands->n_strands / PIECE + 1, root_piece, search);
    for (uint32_t i = 0; i < batches.n_pieces; i++)
        search->source->n_without_bone += search->without[i];
    return GROOM_OK;
}

static void strands_box(const struct groom_strands *strands, float low[3], float high[3])
{
    for (int c = 0; c < 3; c++)
        low[c] = INFINITY, high[c] = -INFINITY;
    for (uint32_t i = 0; i < strands->n_vertices; i++)
        for (int c = 0; c < 3; c++) {
            low[c] = fminf(low[c], strands->points[i][c]);
            high[c] = fmaxf(high[c], strands->points[i][c]);
        }
}

groom_status anchors_find(struct groom_retarget_source *source, const uint32_t *regions,
                          const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_strands *strands = source->strands;
    struct search search = {.source = source, .regions = regions};
    struct groom_bvh *bvh = NULL;
    uint32_t n_pieces = strands->n_vertices / PIECE + 1;
    float low[3], high[3];
    groom_status st = groom_bvh_create(source->body, context, &bvh, diag);
    if (st != GROOM_OK)
        goto out;
    search.bvh = bvh;
    strands_box(strands, low, high);
    uint32_t n_nodes = strands->n_vertices / 8 < FIELD_NODES ? strands->n_vertices / 8 + 1000 : FIELD_NODES;
    if ((st = field_init(&search.field, bvh, low, high, 0.1f, n_nodes, context, diag)) != GROOM_OK)
        goto out;
    if (!(search.without = memory_array_zero(source->allocator, n_pieces, sizeof *search.without))) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to look for the bones of strands");
        goto out;
    }
    st = search_all(&search, context, diag);
out:
    memory_release(source->allocator, search.without, n_pieces, sizeof *search.without);
    field_finish(&search.field);
    groom_bvh_destroy(bvh);
    return st;
}
