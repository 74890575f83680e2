/* Closest points and rays on Embree. Embree culls; what counts is decided here in double, so that
 * the answer does not depend on the shape of its tree. */
#include <float.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/bvh.h"

#define POINTS_A_PIECE 1024

/* --- building --------------------------------------------------------------- */

/* One thread, not pinned: a worker brings threads of its own, and a tree built by one is the same
 * tree every time. */
static const char device_options[] = "threads=1,set_affinity=0,start_threads=0";

static void *share(RTCGeometry geometry, enum RTCBufferType type, enum RTCFormat format, const void *items,
                   size_t stride, size_t count)
{
    void *copy = rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, count);
    if (copy)
        memcpy(copy, items, stride * count);
    return copy;
}

static groom_status embree_failed(RTCDevice device, struct groom_diag *diag)
{
    enum RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_OUT_OF_MEMORY)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for Embree's tree");
    return groom_fail(diag, GROOM_EINTERNAL, "Embree failed with its error %d", (int)error);
}

static groom_status build_scene(struct groom_bvh *bvh, struct groom_diag *diag)
{
    const struct groom_mesh *mesh = bvh->mesh;
    bvh->device = rtcNewDevice(device_options);
    if (!bvh->device)
        return embree_failed(NULL, diag);
    bvh->scene = rtcNewScene(bvh->device);
    RTCGeometry geometry = rtcNewGeometry(bvh->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!bvh->scene || !geometry)
        return embree_failed(bvh->device, diag);
    rtcSetSceneFlags(bvh->scene, RTC_SCENE_FLAG_ROBUST);
    int shared = share(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh->points, sizeof *mesh->points, mesh->n_vertices) &&
                 share(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh->triangles, sizeof *mesh->triangles, mesh->n_triangles);
    if (shared) {
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(bvh->scene, geometry);
        rtcCommitScene(bvh->scene);
    }
    rtcReleaseGeometry(geometry);
    enum RTCError error = shared ? rtcGetDeviceError(bvh->device) : RTC_ERROR_OUT_OF_MEMORY;
    if (error != RTC_ERROR_NONE)
        return groom_fail(diag, error == RTC_ERROR_OUT_OF_MEMORY ? GROOM_ENOMEM : GROOM_EINTERNAL,
                          "Embree could not index the mesh (its error %d)", (int)error);
    return GROOM_OK;
}

groom_status groom_bvh_create(const struct groom_mesh *mesh, const struct groom_context *context,
                              struct groom_bvh **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_bvh *bvh = NULL;
    groom_status st = groom_mesh_validate(mesh, diag);
    if (st != GROOM_OK)
        return st;
    if (mesh->n_triangles == 0)
        return groom_fail(diag, GROOM_EEMPTY, "the mesh has no triangle");
    bvh = memory_array_zero(allocator, 1, sizeof *bvh);
    if (!bvh)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the index of the mesh");
    bvh->mesh = mesh;
    bvh->allocator = allocator;
    bvh->face_normals = memory_array(allocator, mesh->n_triangles, sizeof *bvh->face_normals);
    bvh->edge_normals = memory_array(allocator, mesh->n_triangles, sizeof *bvh->edge_normals);
    bvh->vertex_normals = memory_array(allocator, mesh->n_vertices, sizeof *bvh->vertex_normals);
    st = bvh->face_normals && bvh->edge_normals && bvh->vertex_normals
             ? bvh_pseudo_normals(bvh, diag)
             : groom_fail(diag, GROOM_ENOMEM, "no memory for the normals of the mesh");
    if (st == GROOM_OK)
        st = winding_tree_create(mesh, allocator, &bvh->winding, diag);
    if (st == GROOM_OK)
        st = build_scene(bvh, diag);
    if (st == GROOM_OK)
        *out = bvh;
    else
        groom_bvh_destroy(bvh);
    return st;
}

void groom_bvh_destroy(struct groom_bvh *bvh)
{
    if (!bvh)
        return;
    if (bvh->scene)
        rtcReleaseScene(bvh->scene);
    if (bvh->device)
        rtcReleaseDevice(bvh->device);
    winding_tree_destroy(bvh->winding);
    memory_release(bvh->allocator, bvh->face_normals, bvh->mesh->n_triangles, sizeof *bvh->face_normals);
    memory_release(bvh->allocator, bvh->edge_normals, bvh->mesh->n_triangles, sizeof *bvh->edge_normals);
    memory_release(bvh->allocator, bvh->vertex_normals, bvh->mesh->n_vertices, sizeof *bvh->vertex_normals);
    memory_release(bvh->allocator, bvh, 1, sizeof *bvh);
}

const struct groom_mesh *groom_bvh_mesh(const struct groom_bvh *bvh) { return bvh->mesh; }

/* --- closest points ---------------------------------------------------------- */

struct closest_query {
    const struct groom_bvh *bvh;
    struct vec point;
    double squared; /* of the best so far */
    uint32_t triangle;
    double weight[3];
};

static void corners_of(const struct groom_mesh *mesh, uint32_t t, struct vec c[3])
{
    for (int i = 0; i < 3; i++)
        c[i] = vec_of(mesh->points[mesh->triangles[t][i]]);
}

static struct vec blend(const struct vec c[3], const double w[3])
{
    return vec_add(vec_add(vec_scale(c[0], w[0]), vec_scale(c[1], w[1])), vec_scale(c[2], w[2]));
}

/* The ball is shrunk to a little more than the best distance, so that every triangle as near is seen
 * and the lowest index wins. */
static bool visit_triangle(struct RTCPointQueryFunctionArguments *arguments)
{
    struct closest_query *query = arguments->userPtr;
    struct vec c[3];
    double weight[3];
    corners_of(query->bvh->mesh, arguments->primID, c);
    closest_on_triangle(query->point, c, weight);
    struct vec d = vec_sub(query->point, blend(c, weight));
    double squared = vec_dot(d, d);
    if (squared > query->squared || (squared == query->squared && arguments->primID >= query->triangle))
        return false;
    query->squared = squared;
    query->triangle = arguments->primID;
    memcpy(query->weight, weight, sizeof weight);
    float radius = (float)(sqrt(squared) * 1.00001 + FLT_MIN);
    if (radius >= arguments->query->radius)
        return false;
    arguments->query->radius = radius;
    return true;
}

/* The pseudo-normal of the feature on which the weights lie. */
static const float *feature_normal(const struct groom_bvh *bvh, uint32_t t, const double weight[3])
{
    int n_zero = 0, zero = 0, one = 0;
    for (int i = 0; i < 3; i++) {
        if (weight[i] == 0) {
            n_zero++;
            zero = i;
        } else {
            one = i;
        }
    }
    if (n_zero == 0)
        return bvh->face_normals[t];
    return n_zero == 1 ? bvh->edge_normals[t][zero] : bvh->vertex_normals[bvh->mesh->triangles[t][one]];
}

static void answer(const struct closest_query *query, struct groom_surface_point *closest)
{
    struct vec c[3];
    corners_of(query->bvh->mesh, query->triangle, c);
    closest->triangle = query->triangle;
    for (int i = 0; i < 3; i++)
        closest->barycentric[i] = (float)query->weight[i];
    vec_store(blend(c, query->weight), closest->position);
    memcpy(closest->normal, feature_normal(query->bvh, query->triangle, query->weight), sizeof closest->normal);
    closest->distance = (float)sqrt(query->squared);
}

static int is_finite(const float p[3]) { return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]); }

int groom_bvh_closest(const struct groom_bvh *bvh, const float point[3], float max_distance,
                      struct groom_surface_point *closest)
{
    if (!is_finite(point) || !(max_distance >= 0))
        return 0;
    struct closest_query query = {.bvh = bvh, .point = vec_of(point), .triangle = UINT32_MAX,
                                  .squared = (double)max_distance * max_distance};
    struct RTCPointQuery ball = {.x = point[0], .y = point[1], .z = point[2], .radius = max_distance * 1.00001f + FLT_MIN};
    struct RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(bvh->scene, &ball, &context, visit_triangle, &query);
    if (query.triangle == UINT32_MAX)
        return 0;
    answer(&query, closest);
    return 1;
}

/* --- rays -------------------------------------------------------------------- */

static int make_ray(const float o[3], const float d[3], float t_min, float t_max, struct RTCRay *ray)
{
    if (!is_finite(o) || !is_finite(d) || !(t_min <= t_max) || (d[0] == 0 && d[1] == 0 && d[2] == 0))
        return 0;
    *ray = (struct RTCRay){.org_x = o[0], .org_y = o[1], .org_z = o[2], .tnear = t_min > 0 ? t_min : 0,
                           .dir_x = d[0], .dir_y = d[1], .dir_z = d[2], .tfar = t_max, .mask = UINT32_MAX};
    return 1;
}

int groom_bvh_ray(const struct groom_bvh *bvh, const float origin[3], const float direction[3], float t_min,
                  float t_max, struct groom_surface_point *hit)
{
    struct RTCRayHit ray = {.hit.geomID = RTC_INVALID_GEOMETRY_ID};
    struct RTCIntersectContext context;
    if (!make_ray(origin, direction, t_min, t_max, &ray.ray))
        return 0;
    rtcInitIntersectContext(&context);
    rtcIntersect1(bvh->scene, &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        return 0;
    struct vec c[3];
    double weight[3] = {1.0 - ray.hit.u - ray.hit.v, ray.hit.u, ray.hit.v};
    corners_of(bvh->mesh, ray.hit.primID, c);
    hit->triangle = ray.hit.primID;
    for (int i = 0; i < 3; i++)
        hit->barycentric[i] = (float)weight[i];
    vec_store(blend(c, weight), hit->position);
    memcpy(hit->normal, bvh->face_normals[ray.hit.primID], sizeof hit->normal);
    hit->distance = ray.ray.tfar;
    return 1;
}

int groom_bvh_occluded(const struct groom_bvh *bvh, const float origin[3], const float direction[3], float t_min,
                       float t_max)
{
    struct RTCRay ray;
    struct RTCIntersectContext context;
    if (!make_ray(origin, direction, t_min, t_max, &ray))
        return 0;
    rtcInitIntersectContext(&context);
    rtcOccluded1(bvh->scene, &context, &ray);
    return ray.tfar < 0;
}

/* --- inside ------------------------------------------------------------------ */

float groom_bvh_winding(const struct groom_bvh *bvh, const float point[3])
{
    return is_finite(point) ? (float)winding_number(bvh->winding, vec_of(point)) : 0.0f;
}

int groom_bvh_inside(const struct groom_bvh *bvh, const float point[3])
{
    return fabsf(groom_bvh_winding(bvh, point)) > 0.5f;
}

float groom_bvh_signed_distance(const struct groom_bvh *bvh, const float point[3])
{
    struct groom_surface_point closest;
    if (!groom_bvh_closest(bvh, point, INFINITY, &closest))
        return INFINITY;
    return groom_bvh_inside(bvh, point) ? -closest.distance : closest.distance;
}

/* --- many at once -------------------------------------------------------------- */

struct many {
    const struct groom_bvh *bvh;
    const float (*points)[3];
    uint32_t n;
    float *distances;
    struct groom_surface_point *closest;
};

static void many_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct many *many = user;
    uint32_t first = piece * POINTS_A_PIECE, end = many->n - first < POINTS_A_PIECE ? many->n : first + POINTS_A_PIECE;
    (void)thread;
    for (uint32_t i = first; i < end; i++) {
        if (many->distances)
            many->distances[i] = groom_bvh_signed_distance(many->bvh, many->points[i]);
        else if (!groom_bvh_closest(many->bvh, many->points[i], INFINITY, &many->closest[i]))
            many->closest[i] = (struct groom_surface_point){.triangle = UINT32_MAX, .distance = INFINITY};
    }
}

static uint32_t pieces_of(uint32_t n) { return n / POINTS_A_PIECE + (n % POINTS_A_PIECE != 0); }

void groom_bvh_signed_distances(const struct groom_bvh *bvh, const float (*points)[3], uint32_t n, float *out,
                                const struct groom_context *context)
{
    struct many many = {.bvh = bvh, .points = points, .n = n, .distances = out};
    parallel_for(context, pieces_of(n), many_piece, &many);
}

void groom_bvh_closest_points(const struct groom_bvh *bvh, const float (*points)[3], uint32_t n,
                              struct groom_surface_point *out, const struct groom_context *context)
{
    struct many many = {.bvh = bvh, .points = points, .n = n, .closest = out};
    parallel_for(context, pieces_of(n), many_piece, &many);
}
