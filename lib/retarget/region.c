/* The scalp: from roots to a piece of surface with a hairline. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/sort.h"
#include "retarget/region.h"

#define SPACINGS 3.0         /* of roots: gaps up to twice so many are closed */
#define LEAST_CLOSING 0.002
#define MOST_CLOSING 0.03
#define DEFAULT_REACH 0.08
#define SMOOTHINGS 16        /* of today's line: jags of a few triangles go, turning points stay */

static groom_status no_memory(struct groom_diag *diag) { return groom_fail(diag, GROOM_ENOMEM, "no memory for the scalp"); }

/* --- roots --------------------------------------------------------------------------------- */

static groom_status host_roots(struct groom_scalp_region *region, const float (*roots)[3], uint32_t n,
                               const struct groom_context *context, struct groom_diag *diag)
{
    if (n == 0)
        return groom_fail(diag, GROOM_EEMPTY, "there is no root: no scalp can be found");
    for (uint32_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            if (!isfinite(roots[i][c]))
                return groom_fail(diag, GROOM_EINVAL, "root %u is not finite", i);
    region->n_roots = n;
    region->hosts = memory_array(region->allocator, n, sizeof *region->hosts);
    region->heights = memory_array(region->allocator, n, sizeof *region->heights);
    if (!region->hosts || !region->heights)
        return no_memory(diag);
    groom_bvh_closest_points(region->bvh, roots, n, region->hosts, context);
    for (uint32_t i = 0; i < n; i++)
        region->heights[i] = (float)vec_dot(vec_sub(vec_of(roots[i]), vec_of(region->hosts[i].position)), vec_of(region->hosts[i].normal));
    return GROOM_OK;
}

/* The median distance from a root to the next at another place. */
static groom_status find_spacing(const float (*roots)[3], uint32_t n, const struct groom_context *context, double *spacing,
                                 struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_neighbours *neighbours = NULL;
    uint32_t *ids = memory_array(allocator, (size_t)2 * n, sizeof *ids);
    float *squared = memory_array(allocator, (size_t)2 * n, sizeof *squared);
    groom_status st = ids && squared ? groom_neighbours_create(&roots[0][0], n, 3, context, &neighbours, diag) : no_memory(diag);
    if (st == GROOM_OK)
        st = groom_neighbours_find(neighbours, &roots[0][0], n, 2, ids, squared, context, diag);
    if (st == GROOM_OK) {
        uint32_t kept = 0;
        for (uint32_t i = 0; i < n; i++)
            if (squared[2 * i + 1] > 0 && isfinite(squared[2 * i + 1]))
                squared[kept++] = squared[2 * i + 1];
        *spacing = sqrt(median_of_floats(squared, kept));
    }
    groom_neighbours_destroy(neighbours);
    memory_release(allocator, ids, (size_t)2 * n, sizeof *ids);
    memory_release(allocator, squared, (size_t)2 * n, sizeof *squared);
    return st;
}

/* --- triangles --------------------------------------------------------------------------------- */

/* Triangles within `closing` of roots, less what is within `opening` of the others: a morphological
 * closing, which bridges gaps and hardly moves the outline. distance [n_vertices] */
static int close_gaps(struct groom_scalp_region *region, double closing, double opening, unsigned char *set, double *distance)
{
    const struct surface *surface = &region->surface;
    for (uint32_t v = 0; v < surface->n_vertices; v++)
        distance[v] = INFINITY;
    for (uint32_t i = 0; i < region->n_roots; i++)
        for (int c = 0; c < 3; c++) {
            uint32_t v = surface->corners[region->hosts[i].triangle][c];
            struct vec off = vec_sub(surface_point(surface, v), vec_of(region->hosts[i].position));
            distance[v] = fmin(distance[v], vec_length(off));
        }
    if (!surface_distances(surface, closing, distance))
        return 0;
    for (uint32_t v = 0; v < surface->n_vertices; v++)
        distance[v] = distance[v] <= closing ? INFINITY : 0;
    if (!surface_distances(surface, opening, distance))
        return 0;
    for (uint32_t t = 0; t < surface->n_triangles; t++) {
        const uint32_t *v = surface->corners[t];
        set[t] = distance[v[0]] > opening && distance[v[1]] > opening && distance[v[2]] > opening;
    }
    for (uint32_t i = 0; i < region->n_roots; i++)
        set[region->hosts[i].triangle] = 1;
    return 1;
}

/* The set and what lies within `reach` of it, without holes. */
static int widen(const struct groom_scalp_region *region, double reach, unsigned char *set, double *distance)
{
    const struct surface *surface = &region->surface;
    for (uint32_t v = 0; v < surface->n_vertices; v++)
        distance[v] = INFINITY;
    for (uint32_t v = 0; v < region->scalp.n_vertices; v++)
        distance[region->scalp.vertex_of[v]] = 0;
    if (!surface_distances(surface, reach, distance))
        return 0;
    for (uint32_t t = 0; t < surface->n_triangles; t++) {
        const uint32_t *v = surface->corners[t];
        set[t] = distance[v[0]] <= reach && distance[v[1]] <= reach && distance[v[2]] <= reach;
    }
    return surface_fill(surface, set);
}

/* The mean side of triangles with roots. */
static double side_length(const struct groom_scalp_region *region)
{
    double area = 0;
    for (uint32_t i = 0; i < region->n_roots; i++)
        area += surface_area(&region->surface, region->hosts[i].triangle);
    return sqrt(4 / sqrt(3) * area / region->n_roots);
}

static groom_status need_boundary(const struct sheet *sheet, struct groom_diag *diag)
{
    return sheet->n_loop ? GROOM_OK : groom_fail(diag, GROOM_EDEGENERATE, "the scalp has no boundary: it covers the whole surface");
}

static groom_status find_scalp(struct groom_scalp_region *region, double closing, unsigned char *set, double *distance,
                               struct groom_diag *diag)
{
    uint32_t n = region->surface.n_triangles;
    uint32_t *n_roots_in = memory_array_zero(region->allocator, n, sizeof *n_roots_in);
    for (uint32_t i = 0; n_roots_in && i < region->n_roots; i++)
        n_roots_in[region->hosts[i].triangle]++;
    /* where roots are sparse, half a gap is left around the outermost, which would be islands else */
    double opening = closing - fmin(side_length(region), closing / (2 * SPACINGS));
    int sound = n_roots_in && close_gaps(region, closing, opening, set, distance) && surface_fill(&region->surface, set) &&
                surface_keep_largest(&region->surface, set, n_roots_in) && surface_fill(&region->surface, set);
    memory_release(region->allocator, n_roots_in, n, sizeof *n_roots_in);
    groom_status st = sound ? sheet_init(&region->scalp, &region->surface, set, diag) : no_memory(diag);
    return st == GROOM_OK ? need_boundary(&region->scalp, diag) : st;
}

static groom_status find_patch(struct groom_scalp_region *region, double reach, unsigned char *set, double *distance,
                               struct groom_diag *diag)
{
    groom_status st = GROOM_ENOMEM;
    for (int halvings = 0; halvings < 5; halvings++, reach /= 2) { /* a closed ball must not be covered whole */
        sheet_finish(&region->patch);
        if (!widen(region, reach, set, distance))
            return no_memory(diag);
        st = sheet_init(&region->patch, &region->surface, set, diag);
        if (st == GROOM_OK)
            st = need_boundary(&region->patch, diag);
        if (st != GROOM_EDEGENERATE)
            break;
    }
    if (st != GROOM_OK)
        return st;
    region->patch_vertex = memory_array(region->allocator, region->scalp.n_vertices, sizeof *region->patch_vertex);
    if (!region->patch_vertex)
        return no_memory(diag);
    for (uint32_t v = 0; v < region->scalp.n_vertices; v++)
        region->patch_vertex[v] = region->patch.local_vertex[region->scalp.vertex_of[v]];
    return flat_init(&region->flat, &region->surface, &region->patch, diag);
}

/* --- ears ------------------------------------------------------------------------------------------- */

static const struct groom_bone *head_bone(const struct groom_skeleton *skeleton)
{
    const struct groom_bone *best = &skeleton->bones[0];
    for (uint32_t b = 0; b < skeleton->n_bones; b++) {
        const struct groom_bone *bone = &skeleton->bones[b];
        if (strcmp(bone->name, "head") == 0)
            return bone;
        if (fmaxf(bone->head[1], bone->tail[1]) > fmaxf(best->head[1], best->tail[1]))
            best = bone;
    }
    return best;
}

static groom_status find_ears(struct groom_scalp_region *region, const struct groom_skeleton *given,
                              const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_skeleton made;
    groom_status st = given ? GROOM_OK : groom_skeleton_make(region->mesh, context, &made, diag);
    if (st != GROOM_OK)
        return st;
    const struct groom_bone *bone = head_bone(given ? given : &made);
    struct vec foot = vec_of(bone->head), along = vec_sub(vec_of(bone->tail), foot);
    double squared = vec_dot(along, along), widest[2] = {-INFINITY, -INFINITY};
    for (uint32_t v = 0; v < region->surface.n_vertices; v++) {
        struct vec p = surface_point(&region->surface, v), off = vec_sub(p, foot);
        double t = vec_dot(off, along) / squared;
        struct vec across = vec_sub(off, vec_scale(along, t));
        if (t < 1.0 / 3 || t > 1 || vec_dot(across, across) > squared)
            continue;
        for (int side = 0; side < 2; side++)
            if ((side ? -across.x : across.x) > widest[side]) {
                widest[side] = side ? -across.x : across.x;
                region->ears[side] = p;
            }
    }
    if (!(widest[0] > 0) || !(widest[1] > 0))
        return groom_fail(diag, GROOM_EDEGENERATE, "no ears are found beside the bone \"%s\": is the skeleton that of this mesh?", bone->name);
    return GROOM_OK;
}

uint32_t region_loop_nearest(const struct groom_scalp_region *region, struct vec point, double *distance)
{
    uint32_t best = 0;
    *distance = INFINITY;
    for (uint32_t i = 0; i < region->scalp.n_loop; i++) {
        double d = vec_length(vec_sub(surface_point(&region->surface, region->scalp.vertex_of[region->scalp.loop[i]]), point));
        if (d < *distance) {
            *distance = d;
            best = i;
        }
    }
    return best;
}

/* The front is the way between the ears that lies farther to +z on the mean. */
static groom_status part_boundary(struct groom_scalp_region *region, struct groom_diag *diag)
{
    double mean[2], distance;
    uint32_t n = region->scalp.n_loop;
    for (int side = 0; side < 2; side++)
        region->ear_at[side] = region_loop_nearest(region, region->ears[side], &distance);
    if (region->ear_at[0] == region->ear_at[1])
        return groom_fail(diag, GROOM_EDEGENERATE, "the scalp lies to one side of both ears: its hairline has no front");
    for (int way = 0; way < 2; way++) {
        uint32_t count = 0;
        mean[way] = 0;
        for (uint32_t i = region->ear_at[0]; i != region->ear_at[1]; i = (i + (way ? n - 1 : 1)) % n, count++)
            mean[way] += surface_point(&region->surface, region->scalp.vertex_of[region->scalp.loop[i]]).z;
        mean[way] /= count;
    }
    region->forward = mean[0] > mean[1] ? 1 : -1;
    return GROOM_OK;
}

/* --- all of it ------------------------------------------------------------------------------------------- */

static groom_status build(struct groom_scalp_region *region, const struct groom_skeleton *skeleton, double closing,
                          double reach, const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t n_vertices = region->surface.n_vertices, n_triangles = region->surface.n_triangles;
    unsigned char *set = memory_array_zero(region->allocator, n_triangles, sizeof *set);
    double *distance = memory_array(region->allocator, n_vertices, sizeof *distance);
    groom_status st = set && distance ? find_scalp(region, closing, set, distance, diag) : no_memory(diag);
    if (st == GROOM_OK)
        st = find_patch(region, reach, set, distance, diag);
    if (st == GROOM_OK)
        st = find_ears(region, skeleton, context, diag);
    if (st == GROOM_OK)
        st = part_boundary(region, diag);
    if (st == GROOM_OK)
        st = stretch_init(&region->front, region, region->ear_at[0], region->ear_at[1], region->forward, diag);
    memory_release(region->allocator, set, n_triangles, sizeof *set);
    memory_release(region->allocator, distance, n_vertices, sizeof *distance);
    return st;
}

static void tell(const struct groom_scalp_region *region, double closing, struct groom_scalp_region_report *report)
{
    *report = (struct groom_scalp_region_report){.n_triangles = region->scalp.n_triangles, .n_vertices = region->scalp.n_vertices,
                                                 .n_boundary = region->scalp.n_loop, .closing_m = (float)closing};
    for (uint32_t i = 0; i < region->n_roots; i++)
        report->n_roots_outside += region->scalp.local_triangle[region->hosts[i].triangle] == SURFACE_NONE;
    for (uint32_t t = 0; t < region->scalp.n_triangles; t++)
        report->area += surface_area(&region->surface, region->scalp.triangle_of[t]);
    for (int side = 0; side < 2; side++)
        vec_store(region->ears[side], report->ears[side]);
}

groom_status groom_scalp_region_create(const struct groom_mesh *mesh, const float (*roots)[3], uint32_t n,
                                       const struct groom_skeleton *skeleton, const struct groom_scalp_region_options *options,
                                       const struct groom_context *context, struct groom_scalp_region **out,
                                       struct groom_scalp_region_report *report, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    double closing = options ? options->closing_m : 0, reach = options && options->reach_m != 0 ? options->reach_m : DEFAULT_REACH;
    double spacing = 0;
    if (!(closing >= 0 && closing <= 0.2))
        return groom_fail_field(diag, GROOM_EINVAL, "/closing_m", "closing_m must be 0 to 0.2 m");
    if (!(reach > 0 && reach <= 0.5))
        return groom_fail_field(diag, GROOM_EINVAL, "/reach_m", "reach_m must be above 0, to 0.5 m");
    struct groom_scalp_region *region = memory_array_zero(allocator, 1, sizeof *region);
    if (!region)
        return no_memory(diag);
    region->mesh = mesh;
    region->allocator = allocator;
    groom_status st = groom_bvh_create(mesh, context, &region->bvh, diag);
    if (st == GROOM_OK)
        st = host_roots(region, roots, n, context, diag);
    if (st == GROOM_OK && closing == 0) {
        st = find_spacing(roots, n, context, &spacing, diag);
        closing = fmin(fmax(SPACINGS * spacing, LEAST_CLOSING), MOST_CLOSING);
    }
    if (st == GROOM_OK)
        st = surface_init(&region->surface, mesh, allocator, diag);
    if (st == GROOM_OK)
        st = build(region, skeleton, closing, reach, context, diag);
    if (st != GROOM_OK) {
        groom_scalp_region_destroy(region);
        return st;
    }
    if (report)
        tell(region, closing, report);
    *out = region;
    return GROOM_OK;
}

void groom_scalp_region_destroy(struct groom_scalp_region *region)
{
    if (!region)
        return;
    const struct groom_allocator *allocator = region->allocator;
    stretch_finish(&region->front);
    memory_release(allocator, region->patch_vertex, region->scalp.n_vertices, sizeof *region->patch_vertex);
    flat_finish(&region->flat);
    sheet_finish(&region->patch);
    sheet_finish(&region->scalp);
    surface_finish(&region->surface);
    groom_bvh_destroy(region->bvh);
    memory_release(allocator, region->hosts, region->n_roots, sizeof *region->hosts);
    memory_release(allocator, region->heights, region->n_roots, sizeof *region->heights);
    memory_release(allocator, region, 1, sizeof *region);
}

uint32_t groom_scalp_region_triangles(const struct groom_scalp_region *region, const uint32_t **triangles)
{
    *triangles = region->scalp.triangle_of;
    return region->scalp.n_triangles;
}

void groom_scalp_region_front(const struct groom_scalp_region *region, uint32_t n, float (*points)[3])
{
    const struct stretch *front = &region->front;
    for (uint32_t i = 0, k = 0; i < n; i++) {
        double arc = (double)i / (n - 1);
        while (k + 2 < front->n && front->arc[k + 1] < arc)
            k++;
        double span = front->arc[k + 1] - front->arc[k], t = span > 0 ? (arc - front->arc[k]) / span : 0;
        vec_store(vec_add(vec_scale(front->smooth[k], 1 - t), vec_scale(front->smooth[k + 1], t)), points[i]);
        struct groom_surface_point at;
        if (groom_bvh_closest(region->bvh, points[i], INFINITY, &at))
            memcpy(points[i], at.position, sizeof at.position);
    }
}

/* --- lines along the boundary ------------------------------------------------------------------------------- */

static void smooth_line(const struct vec *point, uint32_t n, struct vec *smooth, struct vec *scratch)
{
    memcpy(smooth, point, n * sizeof *smooth);
    for (int round = 0; round < SMOOTHINGS; round++) {
        memcpy(scratch, smooth, n * sizeof *scratch);
        for (uint32_t i = 1; i + 1 < n; i++)
            smooth[i] = vec_add(vec_scale(scratch[i], 0.5), vec_scale(vec_add(scratch[i - 1], scratch[i + 1]), 0.25));
    }
}

static void project_line(struct stretch *stretch, const struct groom_scalp_region *region)
{
    for (uint32_t i = 0; i < stretch->n; i++) {
        float p[3];
        struct groom_surface_point at;
        vec_store(stretch->smooth[i], p);
        if (!groom_bvh_closest(region->bvh, p, INFINITY, &at))
            continue;
        stretch->smooth[i] = vec_of(at.position);
        stretch->normal[i] = vec_of(at.normal);
    }
    stretch->length = 0;
    for (uint32_t i = 0; i < stretch->n; i++) {
        stretch->length += i ? vec_length(vec_sub(stretch->smooth[i], stretch->smooth[i - 1])) : 0;
        stretch->arc[i] = stretch->length;
    }
    for (uint32_t i = 0; i < stretch->n; i++)
        stretch->arc[i] /= stretch->length > 0 ? stretch->length : 1;
}

groom_status stretch_init(struct stretch *stretch, const struct groom_scalp_region *region, uint32_t from, uint32_t to,
                          int step, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = region->allocator;
    uint32_t n = region->scalp.n_loop;
    *stretch = (struct stretch){.allocator = allocator, .capacity = n};
    stretch->vertex = memory_array(allocator, n, sizeof *stretch->vertex);
    stretch->point = memory_array(allocator, n, sizeof *stretch->point);
    stretch->smooth = memory_array(allocator, n, sizeof *stretch->smooth);
    stretch->normal = memory_array_zero(allocator, n, sizeof *stretch->normal);
    stretch->arc = memory_array(allocator, n, sizeof *stretch->arc);
    if (!stretch->vertex || !stretch->point || !stretch->smooth || !stretch->normal || !stretch->arc)
        return no_memory(diag);
    for (uint32_t i = from;; i = (i + (step > 0 ? 1 : n - 1)) % n) {
        stretch->vertex[stretch->n] = region->scalp.loop[i];
        stretch->point[stretch->n++] = surface_point(&region->surface, region->scalp.vertex_of[region->scalp.loop[i]]);
        if (i == to)
            break;
    }
    smooth_line(stretch->point, stretch->n, stretch->smooth, stretch->normal);
    project_line(stretch, region);
    return GROOM_OK;
}

void stretch_finish(struct stretch *stretch)
{
    const struct groom_allocator *allocator = stretch->allocator;
    if (!allocator)
        return;
    memory_release(allocator, stretch->vertex, stretch->capacity, sizeof *stretch->vertex);
    memory_release(allocator, stretch->point, stretch->capacity, sizeof *stretch->point);
    memory_release(allocator, stretch->smooth, stretch->capacity, sizeof *stretch->smooth);
    memory_release(allocator, stretch->normal, stretch->capacity, sizeof *stretch->normal);
    memory_release(allocator, stretch->arc, stretch->capacity, sizeof *stretch->arc);
    *stretch = (struct stretch){0};
}
