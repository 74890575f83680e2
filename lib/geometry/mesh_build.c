#include "geometry/mesh_build.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "geometry/polygon.h"

/* Farther than this (metres) squares of distances would leave float. */
#define FARTHEST_M 1e9f
/* A texture coordinate beyond this is none. */
#define FARTHEST_UV 1e6f

void mesh_build_init(struct mesh_build *build, const struct groom_context *context)
{
    *build = (struct mesh_build){
        .context = context,
        .allocator = memory_allocator(context),
        .points = growing_of(sizeof(float[3])),
        .uvs = growing_of(sizeof(float[2])),
        .corners = growing_of(sizeof(struct mesh_corner)),
        .faces = growing_of(sizeof(struct mesh_face)),
    };
}

void mesh_build_finish(struct mesh_build *build)
{
    growing_finish(&build->points, build->allocator);
    growing_finish(&build->uvs, build->allocator);
    growing_finish(&build->corners, build->allocator);
    growing_finish(&build->faces, build->allocator);
}

groom_status mesh_no_memory(struct groom_diag *diag)
{
    return groom_fail(diag, GROOM_ENOMEM, "no memory for the mesh");
}

static groom_status check_indices(const struct mesh_build *build, struct groom_diag *diag)
{
    const struct mesh_face *faces = build->faces.items;
    const struct mesh_corner *corners = build->corners.items;
    for (size_t f = 0; f < build->faces.count; f++) {
        for (uint32_t i = 0; i < faces[f].n; i++) {
            struct mesh_corner c = corners[faces[f].first + i];
            if (c.vertex >= build->points.count)
                return groom_fail_at(diag, GROOM_EFORMAT, faces[f].byte_offset,
                                     "face %zu names vertex %u (from 0) of %zu", f, c.vertex, build->points.count);
            if (c.uv != MESH_NO_UV && c.uv >= build->uvs.count)
                return groom_fail_at(diag, GROOM_EFORMAT, faces[f].byte_offset,
                                     "face %zu names texture coordinate %u (from 0) of %zu", f, c.uv, build->uvs.count);
        }
    }
    return GROOM_OK;
}

/* Metres in place; what is not finite, or out of this world, becomes NaN. */
static void convert_points(struct mesh_build *build, struct groom_frame frame)
{
    float(*points)[3] = build->points.items;
    for (size_t i = 0; i < build->points.count; i++) {
        groom_frame_to_metres(frame, points[i], points[i]);
        for (int axis = 0; axis < 3; axis++)
            if (!(fabsf(points[i][axis]) <= FARTHEST_M))
                points[i][axis] = NAN;
    }
}

static int is_finite_point(const float p[3]) { return !isnan(p[0]) && !isnan(p[1]) && !isnan(p[2]); }

static int has_area(const float *a, const float *b, const float *c)
{
    double u[3], v[3];
    for (int i = 0; i < 3; i++) {
        u[i] = (double)b[i] - a[i];
        v[i] = (double)c[i] - a[i];
    }
    return u[1] * v[2] - u[2] * v[1] != 0 || u[2] * v[0] - u[0] * v[2] != 0 || u[0] * v[1] - u[1] * v[0] != 0;
}

struct cutter {
    struct mesh_build *build;
    struct polygon_scratch scratch;
    uint32_t *corner_vertex; /* [capacity] */
    uint32_t *corner_uv;
    uint32_t (*cut)[3];
    struct growing triangles, uv_triangles; /* uint32_t[3] */
    int uv_missing;
    struct groom_mesh_read_report *report;
};

static int cutter_init(struct cutter *cutter, struct mesh_build *build, struct groom_mesh_read_report *report)
{
    const struct mesh_face *faces = build->faces.items;
    size_t most = 4;
    for (size_t f = 0; f < build->faces.count; f++)
        most = faces[f].n > most ? faces[f].n : most;
    *cutter = (struct cutter){.build = build, .report = report, .triangles = growing_of(sizeof(uint32_t[3])),
                              .uv_triangles = growing_of(sizeof(uint32_t[3]))};
    cutter->scratch.capacity = most;
    cutter->scratch.effort = ((uint64_t)1 << 27) + 64 * build->corners.count;
    cutter->scratch.flat = memory_array(build->allocator, most, sizeof *cutter->scratch.flat);
    cutter->scratch.next = memory_array(build->allocator, most, sizeof *cutter->scratch.next);
    cutter->scratch.previous = memory_array(build->allocator, most, sizeof *cutter->scratch.previous);
    cutter->corner_vertex = memory_array(build->allocator, most, sizeof *cutter->corner_vertex);
    cutter->corner_uv = memory_array(build->allocator, most, sizeof *cutter->corner_uv);
    cutter->cut = memory_array(build->allocator, most, sizeof *cutter->cut);
    return cutter->scratch.flat && cutter->scratch.next && cutter->scratch.previous && cutter->corner_vertex &&
           cutter->corner_uv && cutter->cut;
}

static void cutter_finish(struct cutter *cutter)
{
    const struct groom_allocator *allocator = cutter->build->allocator;
    size_t capacity = cutter->scratch.capacity;
    memory_release(allocator, cutter->scratch.flat, capacity, sizeof *cutter->scratch.flat);
    memory_release(allocator, cutter->scratch.next, capacity, sizeof *cutter->scratch.next);
    memory_release(allocator, cutter->scratch.previous, capacity, sizeof *cutter->scratch.previous);
    memory_release(allocator, cutter->corner_vertex, capacity, sizeof *cutter->corner_vertex);
    memory_release(allocator, cutter->corner_uv, capacity, sizeof *cutter->corner_uv);
    memory_release(allocator, cutter->cut, capacity, sizeof *cutter->cut);
    growing_finish(&cutter->triangles, allocator);
    growing_finish(&cutter->uv_triangles, allocator);
}

/* The corners of a face without repetitions of the one before, into the cutter; 0 where one is not finite. */
static int take_corners(struct cutter *cutter, const struct mesh_face *face, uint32_t *n_out)
{
    const struct mesh_corner *corners = cutter->build->corners.items;
    const float(*points)[3] = cutter->build->points.items;
    const float(*uvs)[2] = cutter->build->uvs.items;
    uint32_t n = 0;
    for (uint32_t i = 0; i < face->n; i++) {
        struct mesh_corner c = corners[face->first + i];
        if (!is_finite_point(points[c.vertex]))
            return 0;
        if (n && cutter->corner_vertex[n - 1] == c.vertex)
            continue;
        if (c.uv != MESH_NO_UV && !(fabsf(uvs[c.uv][0]) <= FARTHEST_UV && fabsf(uvs[c.uv][1]) <= FARTHEST_UV))
            c.uv = MESH_NO_UV;
        cutter->corner_vertex[n] = c.vertex;
        cutter->corner_uv[n++] = c.uv;
    }
    while (n > 1 && cutter->corner_vertex[n - 1] == cutter->corner_vertex[0])
        n--;
    *n_out = n;
    return 1;
}

/* Keep one triangle of the present face unless it has no area: 1 kept, 0 not, -1 memory. */
static int keep_triangle(struct cutter *cutter, const uint32_t cut[3])
{
    const float(*points)[3] = cutter->build->points.items;
    const uint32_t *v = cutter->corner_vertex;
    if (v[cut[0]] == v[cut[2]])
        return 0;
    if (!cutter->build->by_faces_alone && !has_area(points[v[cut[0]]], points[v[cut[1]]], points[v[cut[2]]]))
        return 0;
    uint32_t *triangle = growing_add(&cutter->triangles, 1, cutter->build->allocator);
    uint32_t *uv_triangle = growing_add(&cutter->uv_triangles, 1, cutter->build->allocator);
    if (!triangle || !uv_triangle)
        return -1;
    for (int i = 0; i < 3; i++) {
        triangle[i] = v[cut[i]];
        uv_triangle[i] = cutter->corner_uv[cut[i]];
        cutter->uv_missing |= uv_triangle[i] == MESH_NO_UV;
    }
    return 1;
}

static void fan(uint32_t n, uint32_t (*cut)[3])
{
    for (uint32_t i = 0; i + 2 < n; i++) {
        cut[i][0] = 0;
        cut[i][1] = i + 1;
        cut[i][2] = i + 2;
    }
}

static groom_status cut_face(struct cutter *cutter, const struct mesh_face *face, struct groom_diag *diag)
{
    uint32_t n = 0, n_kept = 0;
    if (!take_corners(cutter, face, &n)) {
        cutter->report->n_dropped_not_finite++;
        return GROOM_OK;
    }
    if (cutter->build->by_faces_alone)
        fan(n, cutter->cut);
    else if (n >= 3)
        polygon_triangulate((const float(*)[3])cutter->build->points.items, cutter->corner_vertex, n,
                            &cutter->scratch, cutter->cut);
    for (uint32_t i = 0; i + 2 < n; i++) {
        int kept = keep_triangle(cutter, cutter->cut[i]);
        if (kept < 0)
            return mesh_no_memory(diag);
        n_kept += (uint32_t)kept;
    }
    cutter->report->n_dropped_degenerate += n_kept == 0;
    return GROOM_OK;
}

/* Give each index that triangles use a new number, in order of the old; returns how many there are. */
static uint32_t renumber(uint32_t *indices, size_t n, uint32_t *number, size_t n_numbers)
{
    uint32_t n_used = 0;
    memset(number, 0, n_numbers * sizeof *number);
    for (size_t i = 0; i < n; i++)
        number[indices[i]] = 1;
    for (size_t i = 0; i < n_numbers; i++)
        number[i] = number[i] ? n_used++ : UINT32_MAX;
    for (size_t i = 0; i < n; i++)
        indices[i] = number[indices[i]];
    return n_used;
}

static void copy_used(const float *from, size_t n, const uint32_t *number, int width, float *to)
{
    for (size_t i = 0; i < n; i++)
        if (number[i] != UINT32_MAX)
            memcpy(to + (size_t)number[i] * (size_t)width, from + i * (size_t)width, (size_t)width * sizeof *to);
}

static groom_status pack(struct cutter *cutter, struct groom_mesh **mesh, struct groom_diag *diag)
{
    struct mesh_build *build = cutter->build;
    size_t n_points = build->points.count, n_uvs = cutter->uv_missing ? 0 : build->uvs.count;
    size_t n_corners = cutter->triangles.count * 3;
    uint32_t *number = memory_array(build->allocator, n_points, sizeof *number);
    uint32_t *uv_number = memory_array(build->allocator, n_uvs, sizeof *uv_number);
    groom_status st = mesh_no_memory(diag);
    if (!number || !uv_number)
        goto out;
    uint32_t n_used = renumber(cutter->triangles.items, n_corners, number, n_points);
    uint32_t n_uvs_used = n_uvs ? renumber(cutter->uv_triangles.items, n_corners, uv_number, n_uvs) : 0;
    st = groom_mesh_create(n_used, (uint32_t)cutter->triangles.count, n_uvs_used, build->context, mesh, diag);
    if (st != GROOM_OK)
        goto out;
    memcpy((*mesh)->triangles, cutter->triangles.items, n_corners * sizeof(uint32_t));
    copy_used(build->points.items, n_points, number, 3, (float *)(*mesh)->points);
    if (n_uvs_used) {
        memcpy((*mesh)->uv_triangles, cutter->uv_triangles.items, n_corners * sizeof(uint32_t));
        copy_used(build->uvs.items, n_uvs, uv_number, 2, (float *)(*mesh)->uvs);
    }
out:
    memory_release(build->allocator, number, n_points, sizeof *number);
    memory_release(build->allocator, uv_number, n_uvs, sizeof *uv_number);
    return st;
}

__attribute__((format(printf, 2, 3))) static void warn(struct groom_mesh_read_report *report, const char *format, ...)
{
    va_list arguments;
    size_t room = sizeof report->warnings / sizeof report->warnings[0];
    if (report->n_warnings == room)
        return;
    va_start(arguments, format);
    vsnprintf(report->warnings[report->n_warnings++], sizeof report->warnings[0], format, arguments);
    va_end(arguments);
}

static void warn_of_losses(const struct cutter *cutter, struct groom_mesh_read_report *report)
{
    if (report->n_dropped_not_finite)
        warn(report, "%llu faces were dropped: a corner is not finite or farther than 1e9 m", (unsigned long long)report->n_dropped_not_finite);
    if (report->n_dropped_degenerate)
        warn(report, "%llu faces were dropped: they have no area", (unsigned long long)report->n_dropped_degenerate);
    if (cutter->uv_missing && cutter->build->uvs.count)
        warn(report, "the texture coordinates were dropped: some faces have none");
}

groom_status mesh_build_mesh(struct mesh_build *build, struct groom_frame frame, struct groom_mesh **mesh,
                             struct groom_mesh_read_report *report, struct groom_diag *diag)
{
    struct cutter cutter;
    groom_status st = check_indices(build, diag);
    if (st != GROOM_OK)
        return st;
    report->n_vertices_in_file = build->points.count;
    report->n_faces_in_file = build->faces.count;
    convert_points(build, frame);
    if (!cutter_init(&cutter, build, report)) {
        st = mesh_no_memory(diag);
        goto out;
    }
    for (size_t f = 0; f < build->faces.count; f++)
        if ((st = cut_face(&cutter, (const struct mesh_face *)build->faces.items + f, diag)) != GROOM_OK)
            goto out;
    warn_of_losses(&cutter, report);
    if (cutter.triangles.count == 0)
        st = groom_fail(diag, GROOM_EEMPTY, "no face is usable: of %llu, %llu are not finite and %llu have no area",
                        (unsigned long long)build->faces.count, (unsigned long long)report->n_dropped_not_finite,
                        (unsigned long long)report->n_dropped_degenerate);
    else
        st = pack(&cutter, mesh, diag);
out:
    cutter_finish(&cutter);
    return st;
}
