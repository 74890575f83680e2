/* Skeletons on meshes: carried to another, and the regions of bones. */
#include "groom/skeleton.h"

#include <math.h>
#include <string.h>

#include "geometry/vec.h"
#include "groom/body.h"

#define MIN_WEIGHT 0.2 /* of a bone at a corner of its region's triangles */

/* --- regions --------------------------------------------------------------------------------- */

static double squared_distance(const struct groom_bone *bone, const float point[3])
{
    struct vec a = vec_of(bone->head), along = vec_sub(vec_of(bone->tail), a), p = vec_sub(vec_of(point), a);
    double t = vec_dot(p, along) / vec_dot(along, along);
    struct vec off = vec_sub(p, vec_scale(along, t < 0 ? 0 : t > 1 ? 1 : t));
    return vec_dot(off, off);
}

/* Bones whose weight at a point is above MIN_WEIGHT, the nearest in any case. */
static uint32_t serving(const struct groom_skeleton *skeleton, const float point[3])
{
    double squared[GROOM_SKELETON_MAX_BONES] = {0}, total = 0;
    uint32_t nearest = 0, mask = 0;
    for (uint32_t b = 0; b < skeleton->n_bones; b++) {
        squared[b] = squared_distance(&skeleton->bones[b], point);
        if (squared[b] < squared[nearest])
            nearest = b;
    }
    if (squared[nearest] == 0)
        return 1u << nearest;
    for (uint32_t b = 0; b < skeleton->n_bones; b++)
        total += pow(squared[nearest] / squared[b], 2);
    for (uint32_t b = 0; b < skeleton->n_bones; b++)
        if (pow(squared[nearest] / squared[b], 2) > MIN_WEIGHT * total)
            mask |= 1u << b;
    return mask | 1u << nearest;
}

void groom_skeleton_regions(const struct groom_skeleton *skeleton, const struct groom_mesh *mesh, uint32_t *mask)
{
    for (uint32_t t = 0; t < mesh->n_triangles; t++) {
        mask[t] = 0;
        for (int i = 0; i < 3; i++)
            mask[t] |= serving(skeleton, mesh->points[mesh->triangles[t][i]]);
    }
}

/* --- carrying --------------------------------------------------------------------------------- */

/* Weighted moments of the surface around a point: sources x, targets y. */
struct moments {
    double weight;
    struct vec x, y;          /* means */
    double xx[3][3], yx[3][3]; /* of deviations */
};

static void vec_array(struct vec v, double out[3])
{
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

/* area [of the whole mesh's triangles] / (distance^2 + softening^2)^2 of each triangle's middle */
static double weight_of(const struct groom_mesh *mesh, uint32_t t, struct vec point, double softening, struct vec *middle)
{
    const uint32_t *v = mesh->triangles[t];
    struct vec a = vec_of(mesh->points[v[0]]), b = vec_of(mesh->points[v[1]]), c = vec_of(mesh->points[v[2]]);
    *middle = vec_scale(vec_add(a, vec_add(b, c)), 1.0 / 3);
    struct vec off = vec_sub(*middle, point);
    double reach = vec_dot(off, off) + softening * softening;
    return 0.5 * vec_length(vec_cross(vec_sub(b, a), vec_sub(c, a))) / (reach * reach);
}

static struct vec middle_of(const struct groom_mesh *mesh, uint32_t t)
{
    struct vec sum = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        sum = vec_add(sum, vec_of(mesh->points[mesh->triangles[t][i]]));
    return vec_scale(sum, 1.0 / 3);
}

static double nearest_distance(const struct groom_mesh *mesh, struct vec point)
{
    double best = INFINITY;
    for (uint32_t v = 0; v < mesh->n_vertices; v++) {
        struct vec off = vec_sub(vec_of(mesh->points[v]), point);
        best = fmin(best, vec_dot(off, off));
    }
    return sqrt(best);
}

static void gather(const struct groom_mesh *source, const struct groom_mesh *target, struct vec point, struct moments *m)
{
    double softening = nearest_distance(source, point);
    *m = (struct moments){0};
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t t = 0; t < source->n_triangles; t++) {
            struct vec x, y = middle_of(target, t);
            double w = weight_of(source, t, point, softening, &x), dx[3], dy[3];
            if (pass == 0) {
                m->weight += w;
                m->x = vec_add(m->x, vec_scale(x, w));
                m->y = vec_add(m->y, vec_scale(y, w));
                continue;
            }
            vec_array(vec_sub(x, m->x), dx);
            vec_array(vec_sub(y, m->y), dy);
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) {
                    m->xx[i][j] += w * dx[i] * dx[j];
                    m->yx[i][j] += w * dy[i] * dx[j];
                }
        }
        if (pass == 0) {
            m->x = vec_scale(m->x, 1 / m->weight);
            m->y = vec_scale(m->y, 1 / m->weight);
        }
    }
}

/* Solve the symmetric 3 x 3 system a s = b by Cramer's rule. returns 0 where it is singular to working precision */
static int solve(const double a[3][3], const double b[3], double s[3])
{
    struct vec r0 = {a[0][0], a[0][1], a[0][2]}, r1 = {a[1][0], a[1][1], a[1][2]}, r2 = {a[2][0], a[2][1], a[2][2]};
    struct vec c0 = vec_cross(r1, r2), c1 = vec_cross(r2, r0), c2 = vec_cross(r0, r1);
    double det = vec_dot(r0, c0), trace = a[0][0] + a[1][1] + a[2][2];
    if (!(fabs(det) > 1e-9 * trace * trace * trace))
        return 0;
    vec_array(vec_scale(vec_add(vec_scale(c0, b[0]), vec_add(vec_scale(c1, b[1]), vec_scale(c2, b[2]))), 1 / det), s);
    return 1;
}

/* y + A (p - x), A = YX XX^-1; the translation alone where the surface around is flat. */
static void carry_point(const struct groom_mesh *source, const struct groom_mesh *target, const float point[3], float out[3])
{
    struct moments m;
    struct vec p = vec_of(point);
    double off[3], s[3] = {0, 0, 0}, moved[3];
    gather(source, target, p, &m);
    vec_array(vec_sub(p, m.x), off);
    if (!solve(m.xx, off, s)) {
        vec_store(vec_add(m.y, vec_sub(p, m.x)), out);
        return;
    }
    for (int i = 0; i < 3; i++)
        moved[i] = m.yx[i][0] * s[0] + m.yx[i][1] * s[1] + m.yx[i][2] * s[2];
    vec_store(vec_add(m.y, (struct vec){moved[0], moved[1], moved[2]}), out);
}

groom_status groom_skeleton_carry(const struct groom_skeleton *skeleton, const struct groom_mesh *source,
                                  const struct groom_mesh *target, struct groom_skeleton *out, struct groom_diag *diag)
{
    char difference[160];
    struct groom_skeleton carried = *skeleton;
    if (!groom_topology_same(source, target, difference))
        return groom_fail(diag, GROOM_EINVAL, "a skeleton is carried between meshes of one topology: %s", difference);
    for (uint32_t b = 0; b < skeleton->n_bones; b++) {
        carry_point(source, target, skeleton->bones[b].head, carried.bones[b].head);
        carry_point(source, target, skeleton->bones[b].tail, carried.bones[b].tail);
    }
    if (groom_skeleton_validate(&carried, diag) != GROOM_OK)
        return groom_fail(diag, GROOM_EDEGENERATE, "the skeleton cannot be carried to the target: a bone loses its length");
    *out = carried;
    return GROOM_OK;
}
