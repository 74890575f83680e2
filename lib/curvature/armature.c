/* The armature of each cluster: oriented frames along its mean strand (Shi et al. 2026, Section 5.3). */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "curvature/chain.h"
#include "curvature/pieces.h"

/* Below this share of their sum, the variances of the two directions across do not tell them apart. */
#define LEAST_ANISOTROPY 0.1

/* --- points of the strands ------------------------------------------------------------------ */

struct armature {
    const struct groom_clusters *clusters;
    const struct groom_strands *strands;
    const double *at;
    uint32_t n_frames;
    float (*points)[3]; /* [n_strands][n_frames] */
    struct groom_cluster_frame *frames;
};

/* Points at rising fractions of a polyline's arc length. */
static void polyline_points(const float (*p)[3], uint32_t n, const double *at, uint32_t n_at, float (*out)[3])
{
    double length = groom_polyline_length(p, n), begin = 0.0, segment = n > 1 ? groom_polyline_length(p, 2) : 0.0;
    uint32_t j = 0;
    for (uint32_t k = 0; k < n_at; k++) {
        double s = at[k] * length;
        for (; j + 2 < n && s > begin + segment; segment = groom_polyline_length(p + j, 2)) {
            begin += segment;
            j++;
        }
        double t = segment > 0.0 ? fmin((s - begin) / segment, 1.0) : 0.0;
        for (int c = 0; c < 3; c++)
            out[k][c] = n > 1 ? (float)(p[j][c] + t * ((double)p[j + 1][c] - p[j][c])) : p[0][c];
    }
}

static void points_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct armature *a = user;
    const struct groom_strands *s = a->strands;
    uint32_t begin, end;
    (void)thread;
    piece_bounds(s->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++)
        polyline_points((const float (*)[3])s->points + s->first[i], s->first[i + 1] - s->first[i], a->at, a->n_frames,
                        a->points + (size_t)i * a->n_frames);
}

/* --- frames ------------------------------------------------------------------------------------ */

/* Mean over a cluster of its strands' points at frame k; of their roots where k is n_frames. */
static vec3 mean_point(const struct armature *a, uint32_t cluster, uint32_t k)
{
    const struct groom_clusters *c = a->clusters;
    uint32_t begin = c->first[cluster], end = c->first[cluster + 1];
    vec3 sum = {0.0, 0.0, 0.0};
    for (uint32_t m = begin; m < end; m++) {
        uint32_t i = c->strands[m];
        const float *p = k < a->n_frames ? a->points[(size_t)i * a->n_frames + k] : a->strands->points[a->strands->first[i]];
        sum = vec_add(sum, (vec3){p[0], p[1], p[2]});
    }
    return vec_scale(1.0 / (end - begin), sum);
}

static double vec_norm(vec3 a) { return sqrt(vec_dot(a, a)); }

/* Any right-handed frame whose first axis is along t. */
static mat3 frame_along(vec3 t)
{
    vec3 k = fabs(t.x) <= fabs(t.y) && fabs(t.x) <= fabs(t.z)   ? (vec3){1.0, 0.0, 0.0}
             : fabs(t.y) <= fabs(t.z)                           ? (vec3){0.0, 1.0, 0.0}
                                                                : (vec3){0.0, 0.0, 1.0};
    vec3 u = vec_cross(k, t);
    u = vec_scale(1.0 / vec_norm(u), u);
    return (mat3){t, u, vec_cross(t, u)};
}

/* F, turned as little as may be so that its first axis is t. */
static mat3 frame_transport(mat3 F, vec3 t)
{
    vec3 w = vec_cross(F.t, t);
    double cosine = vec_dot(F.t, t);
    if (cosine < -0.9999)
        return frame_along(t);
    vec3 u = vec_add(vec_add(vec_scale(cosine, F.u), vec_cross(w, F.u)), vec_scale(vec_dot(w, F.u) / (1.0 + cosine), w));
    u = vec_sub(u, vec_scale(vec_dot(u, t), t));
    u = vec_scale(1.0 / vec_norm(u), u);
    return (mat3){t, u, vec_cross(t, u)};
}

static mat3 frame_spin(mat3 F, double angle)
{
    double c = cos(angle), s = sin(angle);
    return (mat3){F.t, vec_add(vec_scale(c, F.u), vec_scale(s, F.v)), vec_sub(vec_scale(c, F.v), vec_scale(s, F.u))};
}

/* Second moments of a cluster's points at frame k in the axes of F: tt uu vv uv. */
static void moments(const struct armature *a, uint32_t cluster, uint32_t k, vec3 origin, mat3 F, double out[4])
{
    const struct groom_clusters *c = a->clusters;
    uint32_t begin = c->first[cluster], end = c->first[cluster + 1];
    memset(out, 0, 4 * sizeof *out);
    for (uint32_t m = begin; m < end; m++) {
        const float *p = a->points[(size_t)c->strands[m] * a->n_frames + k];
        vec3 local = mat_transposed_vec(F, vec_sub((vec3){p[0], p[1], p[2]}, origin));
        out[0] += local.x * local.x / (end - begin);
        out[1] += local.y * local.y / (end - begin);
        out[2] += local.z * local.z / (end - begin);
        out[3] += local.y * local.z / (end - begin);
    }
}

/* By how much F must spin about its first axis to lie along the principal directions across: the first of an
 * armature along the widest, later ones along whichever are nearest. */
static double principal_spin(const double m[4], int is_first)
{
    double difference = m[1] - m[2], apart = hypot(difference, 2.0 * m[3]);
    if (!(apart > LEAST_ANISOTROPY * (m[1] + m[2])))
        return 0.0;
    double angle = 0.5 * atan2(2.0 * m[3], difference);
    return is_first ? angle : remainder(angle, M_PI_2);
}

/* Along the armature: from the joint before (the root for the first) to the one after. */
static vec3 direction(const vec3 *origin, uint32_t n, uint32_t k)
{
    vec3 d = vec_sub(origin[k + 2 < n ? k + 2 : n - 1], origin[k]);
    double length = vec_norm(d);
    return length > 0.0 ? vec_scale(1.0 / length, d) : (vec3){0.0, 0.0, 0.0};
}

static void store_frame(struct groom_cluster_frame *out, double at, vec3 origin, mat3 F, const double m[4])
{
    out->at = at;
    vec_store(origin, out->origin);
    mat_store(F, out->axes);
    for (int c = 0; c < 3; c++)
        out->extent[c] = sqrt(m[c]);
}

static const mat3 world_axes = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};

/* origin [1 + n_frames]: the mean root, then each joint */
static void cluster_frames(const struct armature *a, uint32_t cluster, const vec3 *origin, struct groom_cluster_frame *out)
{
    mat3 F = world_axes;
    double m[4];
    for (uint32_t k = 0, placed = 0; k < a->n_frames; k++) {
        vec3 t = direction(origin, a->n_frames + 1, k);
        if (vec_dot(t, t) > 0.5) {
            F = placed ? frame_transport(F, t) : frame_along(t);
            moments(a, cluster, k, origin[k + 1], F, m);
            F = frame_spin(F, principal_spin(m, !placed));
            placed = 1;
        }
        moments(a, cluster, k, origin[k + 1], F, m);
        store_frame(&out[k], a->at[k], origin[k + 1], F, m);
    }
}

static void frames_piece(void *user, uint32_t cluster, uint32_t thread)
{
    const struct armature *a = user;
    struct groom_cluster_frame *out = a->frames + (size_t)cluster * a->n_frames;
    vec3 origin[GROOM_CLUSTER_FRAMES_MOST + 1];
    static const double none[4];
    (void)thread;
    if (a->clusters->first[cluster] == a->clusters->first[cluster + 1]) {
        for (uint32_t k = 0; k < a->n_frames; k++)
            store_frame(&out[k], a->at[k], (vec3){0.0, 0.0, 0.0}, world_axes, none);
        return;
    }
    origin[0] = mean_point(a, cluster, a->n_frames);
    for (uint32_t k = 0; k < a->n_frames; k++)
        origin[k + 1] = mean_point(a, cluster, k);
    cluster_frames(a, cluster, origin, out);
}

static groom_status check_stations(const double *at, uint32_t n, struct groom_diag *diag)
{
    if (n > GROOM_CLUSTER_FRAMES_MOST)
        return groom_fail_field(diag, GROOM_EINVAL, "/frames", "%u frames a cluster: %d is the most", n,
                                GROOM_CLUSTER_FRAMES_MOST);
    for (uint32_t k = 0; k < n; k++)
        if (!(at[k] >= 0.0 && at[k] <= 1.0) || (k > 0 && at[k] < at[k - 1]))
            return groom_fail_field(diag, GROOM_EINVAL, "/frames", "frame %u is at %g: rising numbers of 0..1", k, at[k]);
    return GROOM_OK;
}

groom_status groom_clusters_frames(const struct groom_clusters *clusters, const struct groom_strands *strands,
                                   const double *at, uint32_t n_frames, const struct groom_context *context,
                                   struct groom_cluster_frame *frames, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct armature a = {clusters, strands, at, n_frames, NULL, frames};
    groom_status st = check_stations(at, n_frames, diag);
    if (st != GROOM_OK)
        return st;
    if (strands->n_strands != clusters->n_strands)
        return groom_fail(diag, GROOM_EINVAL, "the clusters are of %u strands, not of these %u", clusters->n_strands,
                          strands->n_strands);
    size_t n_points = (size_t)strands->n_strands * n_frames;
    if (!(a.points = memory_array(allocator, n_points, sizeof *a.points)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the points of %u frames", n_frames);
    parallel_for(context, piece_count(strands->n_strands), points_piece, &a);
    parallel_for(context, clusters->n_clusters, frames_piece, &a);
    memory_release(allocator, a.points, n_points, sizeof *a.points);
    return GROOM_OK;
}
