#include "groom/scalp.h"

#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/chart.h"
#include "geometry/uv_judge.h"

#define POINTS_A_PIECE 1024
/* What one unit of the chart is worth where all roots share one place. */
#define LONE_ROOT_METRES 0.1

struct groom_scalp {
    const struct groom_allocator *allocator;
    const struct groom_bvh *head; /* or NULL */
    groom_scalp_source source;
    struct chart chart;           /* but for GROOM_SCALP_MESH_UV */
    double middle[2], scale;      /* from the raw chart into [0,1]^2 */
    double metres;                /* of one unit of the finished chart */
    char note[256];
};

static int is_finite(const float p[3]) { return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]); }

static void mesh_uv(const struct groom_mesh *mesh, const struct groom_surface_point *s, double out[2])
{
    const uint32_t *v = mesh->uv_triangles[s->triangle];
    for (int axis = 0; axis < 2; axis++) {
        out[axis] = 0;
        for (int i = 0; i < 3; i++)
            out[axis] += (double)s->barycentric[i] * mesh->uvs[v[i]][axis];
    }
}

/* Before it is moved into [0,1]^2. 0 where the point is not finite. */
static int raw_coordinates(const struct groom_scalp *scalp, const float point[3], double out[2])
{
    struct groom_surface_point s;
    if (!is_finite(point))
        return 0;
    if (!scalp->head) {
        chart_map(&scalp->chart, vec_of(point), out);
        return 1;
    }
    if (!groom_bvh_closest(scalp->head, point, INFINITY, &s))
        return 0;
    if (scalp->source == GROOM_SCALP_MESH_UV)
        mesh_uv(groom_bvh_mesh(scalp->head), &s, out);
    else
        chart_map(&scalp->chart, vec_of(s.position), out);
    return 1;
}

/* --- drawing the chart ----------------------------------------------------------- */

/* Roots on the surface, and what the surface says of them. */
struct roots {
    uint32_t n, capacity;
    float (*points)[3];
    float (*uvs)[2];      /* of the mesh, where it has them */
    struct vec outward;   /* sum of normals; zero without a head */
};

static void drop_on_surface(struct roots *roots, const float (*points)[3], uint32_t n, const struct groom_bvh *head,
                            struct groom_surface_point *surface, const struct groom_context *context)
{
    const struct groom_mesh *mesh = groom_bvh_mesh(head);
    groom_bvh_closest_points(head, points, n, surface, context);
    for (uint32_t i = 0; i < n; i++) {
        double uv[2] = {0, 0};
        if (surface[i].triangle == UINT32_MAX)
            continue;
        memcpy(roots->points[roots->n], surface[i].position, sizeof *roots->points);
        roots->outward = vec_add(roots->outward, vec_of(surface[i].normal));
        if (mesh->n_uvs)
            mesh_uv(mesh, &surface[i], uv);
        roots->uvs[roots->n][0] = (float)uv[0];
        roots->uvs[roots->n++][1] = (float)uv[1];
    }
}

static void keep_finite(struct roots *roots, const float (*points)[3], uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        if (is_finite(points[i]))
            memcpy(roots->points[roots->n++], points[i], sizeof *roots->points);
}

static groom_status gather_roots(struct roots *roots, const float (*points)[3], uint32_t n, const struct groom_bvh *head,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_surface_point *surface = head ? memory_array(allocator, n, sizeof *surface) : NULL;
    groom_status st = GROOM_OK;
    roots->capacity = n;
    roots->points = memory_array(allocator, n, sizeof *roots->points);
    roots->uvs = memory_array(allocator, n, sizeof *roots->uvs);
    if (!roots->points || !roots->uvs || (head && !surface))
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the scalp coordinates of %u roots", n);
    else if (head)
        drop_on_surface(roots, points, n, head, surface, context);
    else
        keep_finite(roots, points, n);
    memory_release(allocator, surface, n, sizeof *surface);
    if (st == GROOM_OK && roots->n == 0)
        st = groom_fail(diag, GROOM_EEMPTY, "none of the %u roots is finite; scalp coordinates need one", n);
    return st;
}

static void roots_finish(struct roots *roots, const struct groom_allocator *allocator)
{
    memory_release(allocator, roots->points, roots->capacity, sizeof *roots->points);
    memory_release(allocator, roots->uvs, roots->capacity, sizeof *roots->uvs);
}

static void compute_chart(struct groom_scalp *scalp, const struct roots *roots, const char *why)
{
    chart_fit(&scalp->chart, (const float(*)[3])roots->points, roots->n, roots->outward);
    char shape[64] = "projected on a plane";
    if (!scalp->chart.planar)
        snprintf(shape, sizeof shape, "laid out around a sphere of radius %.3g m", scalp->chart.radius);
    snprintf(scalp->note, sizeof scalp->note, "scalp coordinates were computed, %s, because %s", shape, why);
    scalp->source = scalp->head ? GROOM_SCALP_COMPUTED : GROOM_SCALP_ROOTS;
    scalp->metres = 1;
}

static groom_status choose_chart(struct groom_scalp *scalp, const struct roots *roots, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    char why[160];
    struct uv_judgement judgement;
    if (!scalp->head || !groom_bvh_mesh(scalp->head)->n_uvs) {
        compute_chart(scalp, roots, scalp->head ? "the head has no texture coordinates" : "there is no head");
        return GROOM_OK;
    }
    groom_status st = uv_judge((const float(*)[3])roots->points, (const float(*)[2])roots->uvs, roots->n, context, &judgement, diag);
    if (st != GROOM_OK)
        return st;
    if (judgement.verdict == UV_SERVES) {
        scalp->source = GROOM_SCALP_MESH_UV;
        scalp->metres = judgement.metres;
        snprintf(scalp->note, sizeof scalp->note, "scalp coordinates are the head's own texture coordinates");
    } else {
        snprintf(why, sizeof why, "the head's texture coordinates do not serve: %s", uv_verdict_words(judgement.verdict));
        compute_chart(scalp, roots, why);
    }
    return GROOM_OK;
}

/* The box of the raw coordinates of the roots, centred and scaled into [0,1]^2. */
static void fill_square(struct groom_scalp *scalp, const struct roots *roots)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (uint32_t i = 0; i < roots->n; i++) {
        double raw[2] = {0, 0};
        if (scalp->source == GROOM_SCALP_MESH_UV) {
            raw[0] = roots->uvs[i][0];
            raw[1] = roots->uvs[i][1];
        } else {
            chart_map(&scalp->chart, vec_of(roots->points[i]), raw);
        }
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], raw[k]);
            high[k] = fmax(high[k], raw[k]);
        }
    }
    double size = fmax(high[0] - low[0], high[1] - low[1]);
    for (int k = 0; k < 2; k++)
        scalp->middle[k] = 0.5 * (low[k] + high[k]);
    scalp->scale = size > 1e-9 ? 1 / size : 1 / LONE_ROOT_METRES;
    scalp->metres /= scalp->scale;
}

groom_status groom_scalp_create(const float (*roots_in)[3], uint32_t n, const struct groom_bvh *head,
                                const struct groom_context *context, struct groom_scalp **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct roots roots = {0};
    struct groom_scalp *scalp = memory_array_zero(allocator, 1, sizeof *scalp);
    if (!scalp)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for scalp coordinates");
    scalp->allocator = allocator;
    scalp->head = head;
    groom_status st = gather_roots(&roots, roots_in, n, head, context, diag);
    if (st == GROOM_OK)
        st = choose_chart(scalp, &roots, context, diag);
    if (st == GROOM_OK) {
        fill_square(scalp, &roots);
        *out = scalp;
        scalp = NULL;
    }
    roots_finish(&roots, allocator);
    groom_scalp_destroy(scalp);
    return st;
}

void groom_scalp_destroy(struct groom_scalp *scalp)
{
    if (scalp)
        memory_release(scalp->allocator, scalp, 1, sizeof *scalp);
}

groom_scalp_source groom_scalp_source_of(const struct groom_scalp *scalp) { return scalp->source; }
float groom_scalp_metres(const struct groom_scalp *scalp) { return (float)scalp->metres; }
const char *groom_scalp_note(const struct groom_scalp *scalp) { return scalp->note; }

/* --- asking it ------------------------------------------------------------------- */

struct asking {
    const struct groom_scalp *scalp;
    const float (*points)[3];
    uint32_t n;
    float (*uv)[2];
};

static void coordinates_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct asking *asking = user;
    const struct groom_scalp *scalp = asking->scalp;
    uint32_t first = piece * POINTS_A_PIECE, end = asking->n - first < POINTS_A_PIECE ? asking->n : first + POINTS_A_PIECE;
    (void)thread;
    for (uint32_t i = first; i < end; i++) {
        double raw[2];
        int found = raw_coordinates(scalp, asking->points[i], raw);
        for (int k = 0; k < 2; k++) {
            double x = found ? 0.5 + (raw[k] - scalp->middle[k]) * scalp->scale : 0.5;
            asking->uv[i][k] = (float)fmin(1, fmax(0, x));
        }
    }
}

void groom_scalp_coordinates(const struct groom_scalp *scalp, const float (*points)[3], uint32_t n, float (*uv)[2],
                             const struct groom_context *context)
{
    struct asking asking = {scalp, points, n, uv};
    parallel_for(context, n / POINTS_A_PIECE + (n % POINTS_A_PIECE != 0), coordinates_piece, &asking);
}
