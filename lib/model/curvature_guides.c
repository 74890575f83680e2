/* Guides by their curvatures: Chang et al. 2025, Eq. 10, after Crane et al. 2013. Equal steps in these
 * parameters move a guide smoothly, which steps of its vertices do not.
 *
 * Spherical angles are singular at their poles and wrap around in azimuth. Each guide therefore has a
 * frame of its own, whose pole is where the hair does not point, and the azimuth is unwrapped along
 * the strand, so that no curvature comes from a wrap. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "groom/groom.h"

#define GUIDES_A_PIECE 16
#define LENGTH_FLOOR 1e-6 /* metres */
#define POLES 128

/* --- memory ---------------------------------------------------------------------------- */

#define N_ARRAYS 5

struct array {
    void **memory;
    size_t count, size;
};

static void list_arrays(struct groom_curvature_guides *g, struct array arrays[N_ARRAYS])
{
    size_t n = g->n_guides, m = g->n_vertices;
    const struct array list[N_ARRAYS] = {
        {(void **)&g->root, n, sizeof *g->root},
        {(void **)&g->pole, n, sizeof *g->pole},
        {(void **)&g->angle, n, sizeof *g->angle},
        {(void **)&g->length, n * (m - 1), sizeof *g->length},
        {(void **)&g->curvature, n * (m - 2), sizeof *g->curvature},
    };
    memcpy(arrays, list, sizeof list);
}

groom_status groom_curvature_guides_create(uint32_t n_guides, uint32_t n_vertices, const struct groom_context *context,
                                           struct groom_curvature_guides **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    if (n_guides == 0 || n_vertices < 3)
        return groom_fail(diag, GROOM_EINVAL, "%u guides of %u vertices: at least one guide of 3 is needed", n_guides,
                          n_vertices);
    struct groom_curvature_guides *guides = memory_array_zero(allocator, 1, sizeof *guides);
    if (!guides)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for guides");
    *guides = (struct groom_curvature_guides){.n_guides = n_guides, .n_vertices = n_vertices, .allocator = allocator};
    struct array arrays[N_ARRAYS];
    list_arrays(guides, arrays);
    for (int i = 0; i < N_ARRAYS; i++)
        if (!(*arrays[i].memory = memory_array_zero(allocator, arrays[i].count, arrays[i].size))) {
            groom_curvature_guides_destroy(guides);
            return groom_fail(diag, GROOM_ENOMEM, "no memory for the curvatures of %u guides", n_guides);
        }
    *out = guides;
    return GROOM_OK;
}

void groom_curvature_guides_destroy(struct groom_curvature_guides *guides)
{
    if (!guides)
        return;
    struct array arrays[N_ARRAYS];
    list_arrays(guides, arrays);
    for (int i = 0; i < N_ARRAYS; i++)
        memory_release(guides->allocator, *arrays[i].memory, arrays[i].count, arrays[i].size);
    memory_release(guides->allocator, guides, 1, sizeof *guides);
}

/* One guide's part of the arrays. */
struct view {
    uint32_t m;
    float *root, *pole, *angle, *length;
    float (*curvature)[2];
};

static struct view view_of(const struct groom_curvature_guides *guides, uint32_t g)
{
    size_t m = guides->n_vertices;
    return (struct view){guides->n_vertices, guides->root[g], guides->pole[g], guides->angle[g],
                         guides->length + g * (m - 1), guides->curvature + g * (m - 2)};
}

/* --- vectors ------------------------------------------------------------------------------ */

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void to_local(const float pole[9], const double v[3], double local[3])
{
    for (int r = 0; r < 3; r++)
        local[r] = pole[3 * r] * v[0] + pole[3 * r + 1] * v[1] + pole[3 * r + 2] * v[2];
}

static void to_world(const float pole[9], const double local[3], double v[3])
{
    for (int c = 0; c < 3; c++)
        v[c] = pole[c] * local[0] + pole[3 + c] * local[1] + pole[6 + c] * local[2];
}

/* --- points to parameters --------------------------------------------------------------------- */

/* Segment j's length, and its direction; a segment without one leaves `direction` as it was. */
static double segment(const float (*points)[3], uint32_t j, double direction[3])
{
    double e[3], length;
    for (int c = 0; c < 3; c++)
        e[c] = (double)points[j + 1][c] - points[j][c];
    length = sqrt(dot(e, e));
    if (length < LENGTH_FLOOR)
        return LENGTH_FLOOR;
    for (int c = 0; c < 3; c++)
        direction[c] = e[c] / length;
    return length;
}

/* The direction of the first segment that has one, or up. */
static void first_direction(const float (*points)[3], uint32_t m, double direction[3])
{
    direction[0] = direction[2] = 0.0, direction[1] = 1.0;
    for (uint32_t j = 0; j + 1 < m; j++)
        if (segment(points, j, direction) > LENGTH_FLOOR)
            return;
}

/* Points spread evenly over half a sphere: a pole and its opposite are one. */
static void candidate_pole(int i, double pole[3])
{
    double z = (i + 0.5) / POLES, ring = sqrt(1.0 - z * z), turn = 2.399963229728653 * i; /* golden angle */
    pole[0] = ring * cos(turn), pole[1] = ring * sin(turn), pole[2] = z;
}

/* The candidate whose line is farthest from every direction of the guide. */
static void farthest_pole(const float (*points)[3], uint32_t m, double (*candidates)[3], double pole[3])
{
    double direction[3], nearest[POLES] = {0};
    first_direction(points, m, direction);
    for (uint32_t j = 0; j + 1 < m; j++) {
        segment(points, j, direction);
        for (int i = 0; i < POLES; i++)
            nearest[i] = fmax(nearest[i], fabs(dot(candidates[i], direction)));
    }
    int best = 0;
    for (int i = 1; i < POLES; i++)
        if (nearest[i] < nearest[best])
            best = i;
    memcpy(pole, candidates[best], 3 * sizeof *pole);
}

/* A rotation whose last row is the pole. */
static void frame_of_pole(const double z[3], float rotation[9])
{
    double x[3] = {0}, y[3];
    int least = fabs(z[0]) < fabs(z[1]) ? 0 : 1;
    least = fabs(z[2]) < fabs(z[least]) ? 2 : least;
    for (int c = 0; c < 3; c++)
        x[c] = (c == least ? 1.0 : 0.0) - z[least] * z[c];
    double length = sqrt(dot(x, x));
    for (int c = 0; c < 3; c++)
        x[c] /= length;
    y[0] = z[1] * x[2] - z[2] * x[1], y[1] = z[2] * x[0] - z[0] * x[2], y[2] = z[0] * x[1] - z[1] * x[0];
    for (int c = 0; c < 3; c++)
        rotation[c] = (float)x[c], rotation[3 + c] = (float)y[c], rotation[6 + c] = (float)z[c];
}

/* Angles of a direction, the azimuth within half a turn of `near`. */
static void angles_of(const float pole[9], const double direction[3], double near, double phi[2])
{
    double local[3];
    to_local(pole, direction, local);
    phi[0] = atan2(hypot(local[0], local[1]), local[2]);
    phi[1] = near + remainder(atan2(local[1], local[0]) - near, 2.0 * M_PI);
}

/* Each angle is taken from where the stored parameters really lead, so that rounding does not add up
 * along the strand. */
static void parameters_of(const float (*points)[3], struct view view)
{
    double direction[3], phi[2] = {0}, next[2];
    first_direction(points, view.m, direction);
    memcpy(view.root, points[0], sizeof points[0]);
    for (uint32_t j = 0; j + 1 < view.m; j++) {
        view.length[j] = (float)segment(points, j, direction);
        angles_of(view.pole, direction, phi[1], next);
        if (j == 0)
            view.angle[0] = (float)next[0], view.angle[1] = (float)next[1];
        double step = j ? 0.5 * ((double)view.length[j - 1] + view.length[j]) : 0.0;
        for (int i = 0; i < 2; i++) {
            if (j > 0)
                view.curvature[j - 1][i] = (float)((next[i] - phi[i]) / step);
            phi[i] = j ? phi[i] + step * view.curvature[j - 1][i] : view.angle[i];
        }
    }
}

/* --- parameters to points ------------------------------------------------------------------------ */

static double joint_step(struct view view, uint32_t j)
{
    return 0.5 * ((double)view.length[j] + view.length[j + 1]);
}

static void points_of(struct view view, float (*points)[3])
{
    double phi[2] = {view.angle[0], view.angle[1]}, x[3] = {view.root[0], view.root[1], view.root[2]};
    memcpy(points[0], view.root, sizeof points[0]);
    for (uint32_t j = 0; j + 1 < view.m; j++) {
        for (int i = 0; i < 2 && j > 0; i++)
            phi[i] += joint_step(view, j - 1) * view.curvature[j - 1][i];
        double d[3], local[3] = {sin(phi[0]) * cos(phi[1]), sin(phi[0]) * sin(phi[1]), cos(phi[0])};
        to_world(view.pole, local, d);
        for (int c = 0; c < 3; c++) {
            x[c] += view.length[j] * d[c];
            points[j + 1][c] = (float)x[c];
        }
    }
}

/* --- gradient ---------------------------------------------------------------------------------------- */

/* Tip to root: a segment's vector moves every vertex beyond it, an angle every segment from it on. */
static void gradient_of(struct view view, const float (*d_points)[3], struct view gradient)
{
    double phi[2] = {view.angle[0], view.angle[1]}, beyond[3] = {0}, d_phi[2] = {0};
    uint32_t m = view.m;
    for (uint32_t j = 0; j + 2 < m; j++)
        for (int i = 0; i < 2; i++)
            phi[i] += joint_step(view, j) * view.curvature[j][i];
    double d_length_after = 0.0; /* what joint j gave to the length of segment j + 1 */
    for (uint32_t j = m - 1; j-- > 0;) {
        double g[3], sp = sin(phi[0]), cp = cos(phi[0]), sa = sin(phi[1]), ca = cos(phi[1]), length = view.length[j];
        for (int c = 0; c < 3; c++)
            beyond[c] += d_points[j + 1][c];
        to_local(view.pole, beyond, g);
        d_phi[0] += length * (cp * (ca * g[0] + sa * g[1]) - sp * g[2]);
        d_phi[1] += length * (sp * (ca * g[1] - sa * g[0]));
        double d_length = sp * (ca * g[0] + sa * g[1]) + cp * g[2], d_joint = 0.0;
        for (int i = 0; i < 2 && j > 0; i++) {
            gradient.curvature[j - 1][i] = (float)(joint_step(view, j - 1) * d_phi[i]);
            d_joint += 0.5 * view.curvature[j - 1][i] * d_phi[i];
            phi[i] -= joint_step(view, j - 1) * view.curvature[j - 1][i];
        }
        gradient.length[j] = (float)(d_length + d_joint + d_length_after);
        d_length_after = d_joint; /* both segments of a joint have the same share */
    }
    gradient.angle[0] = (float)d_phi[0];
    gradient.angle[1] = (float)d_phi[1];
}

/* --- all guides -------------------------------------------------------------------------------------- */

struct conversion {
    const struct groom_curvature_guides *guides;
    struct groom_curvature_guides *gradient;
    const float (*from)[3];
    float (*to)[3];
    double candidates[POLES][3];
};

static uint32_t piece_end(const struct conversion *job, uint32_t piece)
{
    uint32_t end = (piece + 1) * GUIDES_A_PIECE;
    return end < job->guides->n_guides ? end : job->guides->n_guides;
}

static void from_points_piece(void *user, uint32_t piece, uint32_t thread)
{
    (void)thread;
    struct conversion *job = user;
    uint32_t m = job->guides->n_vertices;
    for (uint32_t g = piece * GUIDES_A_PIECE; g < piece_end(job, piece); g++) {
        double pole[3];
        struct view view = view_of(job->guides, g);
        farthest_pole(job->from + (size_t)g * m, m, job->candidates, pole);
        frame_of_pole(pole, view.pole);
        parameters_of(job->from + (size_t)g * m, view);
    }
}

static void to_points_piece(void *user, uint32_t piece, uint32_t thread)
{
    (void)thread;
    struct conversion *job = user;
    for (uint32_t g = piece * GUIDES_A_PIECE; g < piece_end(job, piece); g++)
        points_of(view_of(job->guides, g), job->to + (size_t)g * job->guides->n_vertices);
}

static void gradient_piece(void *user, uint32_t piece, uint32_t thread)
{
    (void)thread;
    struct conversion *job = user;
    for (uint32_t g = piece * GUIDES_A_PIECE; g < piece_end(job, piece); g++)
        gradient_of(view_of(job->guides, g), job->from + (size_t)g * job->guides->n_vertices,
                    view_of(job->gradient, g));
}

static uint32_t pieces_of(const struct groom_curvature_guides *guides)
{
    return guides->n_guides / GUIDES_A_PIECE + (guides->n_guides % GUIDES_A_PIECE != 0);
}

void groom_curvature_guides_from_points(const float (*points)[3], struct groom_curvature_guides *guides,
                                        const struct groom_context *context)
{
    struct conversion job = {.guides = guides, .from = points};
    for (int i = 0; i < POLES; i++)
        candidate_pole(i, job.candidates[i]);
    parallel_for(context, pieces_of(guides), from_points_piece, &job);
}

void groom_curvature_guides_to_points(const struct groom_curvature_guides *guides, float (*points)[3],
                                      const struct groom_context *context)
{
    struct conversion job = {.guides = guides, .to = points};
    parallel_for(context, pieces_of(guides), to_points_piece, &job);
}

void groom_curvature_guides_gradient(const struct groom_curvature_guides *guides, const float (*d_points)[3],
                                     struct groom_curvature_guides *gradient, const struct groom_context *context)
{
    struct conversion job = {.guides = guides, .gradient = gradient, .from = d_points};
    parallel_for(context, pieces_of(guides), gradient_piece, &job);
}
