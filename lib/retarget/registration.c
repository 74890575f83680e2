#include "retarget/registration.h"

#include <math.h>
#include <string.h>

#include "base/cholesky.h"
#include "base/memory.h"
#include "geometry/sides.h"
#include "retarget/rotation.h"

#define LEAST_WEIGHT 1e-2  /* of a side: half the sum of cotangents */
#define LEAST_AGREEMENT 0.5 /* cosine between normals of partners */
#define ON_EDGE 1e-4f      /* a barycentric coordinate below this lies on the side */

/* --- set-up -------------------------------------------------------------------------------------- */

static groom_status no_memory(struct groom_diag *diag) { return groom_fail(diag, GROOM_ENOMEM, "no memory to lay one mesh over the other"); }

static groom_status find_edges(struct registration *r, struct groom_diag *diag)
{
    struct mesh_sides sides = {0};
    groom_status st = mesh_sides_init(&sides, r->target, r->allocator, diag);
    if (st == GROOM_OK) {
        for (size_t first = 0, end; first < sides.n; first = end) {
            end = mesh_edge_end(&sides, first);
            if (end - first == 1)
                r->edge[sides.sides[first].low] = r->edge[sides.sides[first].high] = 1;
        }
        for (uint32_t v = 0; v < r->target->n_vertices; v++)
            r->edge[v] = r->edge[sides.welded[v]];
    }
    mesh_sides_finish(&sides);
    return st;
}

static struct vec corner_of(const struct registration *r, const struct vec *points, uint32_t t, int i)
{
    return points[r->sheet.triangles[t][i % 3]];
}

/* Cotangent weights and vertex areas of the source. */
static void weigh(struct registration *r)
{
    const struct sheet *sheet = &r->sheet;
    double total = 0, sides = 0;
    memset(r->laplacian, 0, sheet->row_first[sheet->n_vertices] * sizeof *r->laplacian);
    memset(r->area, 0, sheet->n_vertices * sizeof *r->area);
    for (uint32_t t = 0; t < sheet->n_triangles; t++)
        for (int i = 0; i < 3; i++) {
            struct vec o = corner_of(r, r->position, t, i), p = vec_sub(corner_of(r, r->position, t, i + 1), o), q = vec_sub(corner_of(r, r->position, t, i + 2), o);
            uint32_t b = sheet->triangles[t][(i + 1) % 3], c = sheet->triangles[t][(i + 2) % 3];
            double twice = vec_length(vec_cross(p, q)), w = twice > 0 ? 0.5 * vec_dot(p, q) / twice : 0;
            r->laplacian[sheet_entry(sheet, b, c)] += w;
            r->laplacian[sheet_entry(sheet, c, b)] += w;
            r->area[sheet->triangles[t][i]] += twice / 6;
            total += twice / 6;
            sides += vec_length(p);
        }
    for (uint32_t v = 0; v < sheet->n_vertices; v++) {
        r->area[v] = fmax(r->area[v] * sheet->n_vertices / total, 1e-3);
        for (uint32_t e = sheet->row_first[v]; e < sheet->row_first[v + 1]; e++)
            r->laplacian[e] = sheet->row[e] == v ? 0 : fmin(fmax(r->laplacian[e], LEAST_WEIGHT), 10);
    }
    r->side = sides / (3.0 * sheet->n_triangles);
}

static groom_status allocate(struct registration *r, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = r->allocator;
    uint32_t n = r->sheet.n_vertices, n_entries = r->sheet.row_first[n];
    r->edge = memory_array_zero(allocator, r->target->n_vertices, sizeof *r->edge);
    r->laplacian = memory_array(allocator, n_entries, sizeof *r->laplacian);
    r->value = memory_array(allocator, n_entries, sizeof *r->value);
    r->area = memory_array(allocator, n, sizeof *r->area);
    r->rest = memory_array(allocator, n, sizeof *r->rest);
    r->position = memory_array(allocator, n, sizeof *r->position);
    r->goal = memory_array(allocator, n, sizeof *r->goal);
    r->matched = memory_array_zero(allocator, n, sizeof *r->matched);
    r->rotation = memory_array(allocator, n, sizeof *r->rotation);
    r->x = memory_array(allocator, (size_t)3 * n, sizeof *r->x);
    r->query = memory_array(allocator, n, sizeof *r->query);
    r->nearest = memory_array(allocator, n, sizeof *r->nearest);
    r->normal = memory_array(allocator, n, sizeof *r->normal);
    r->factor = cholesky_create(n, r->sheet.row_first, r->sheet.row, allocator);
    return r->edge && r->laplacian && r->value && r->area && r->rest && r->position && r->goal && r->matched && r->rotation &&
                   r->x && r->query && r->nearest && r->normal && r->factor
               ? GROOM_OK
               : no_memory(diag);
}

groom_status registration_init(struct registration *r, const struct groom_mesh *source, const struct groom_mesh *target,
                               const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    *r = (struct registration){.target = target, .allocator = allocator};
    unsigned char *all = memory_array(allocator, source->n_triangles, sizeof *all);
    groom_status st = all ? surface_init(&r->surface, source, allocator, diag) : no_memory(diag);
    if (st == GROOM_OK) {
        memset(all, 1, source->n_triangles);
        st = sheet_init(&r->sheet, &r->surface, all, diag);
    }
    if (st == GROOM_OK)
        st = allocate(r, diag);
    if (st == GROOM_OK)
        st = find_edges(r, diag);
    if (st == GROOM_OK)
        st = groom_bvh_create(target, context, &r->bvh, diag);
    memory_release(allocator, all, source->n_triangles, sizeof *all);
    return st;
}

void registration_finish(struct registration *r)
{
    const struct groom_allocator *allocator = r->allocator;
    if (!allocator)
        return;
    uint32_t n = r->sheet.n_vertices, n_entries = n ? r->sheet.row_first[n] : 0;
    memory_release(allocator, r->edge, r->target->n_vertices, sizeof *r->edge);
    memory_release(allocator, r->laplacian, n_entries, sizeof *r->laplacian);
    memory_release(allocator, r->value, n_entries, sizeof *r->value);
    memory_release(allocator, r->area, n, sizeof *r->area);
    memory_release(allocator, r->rest, n, sizeof *r->rest);
    memory_release(allocator, r->position, n, sizeof *r->position);
    memory_release(allocator, r->goal, n, sizeof *r->goal);
    memory_release(allocator, r->matched, n, sizeof *r->matched);
    memory_release(allocator, r->rotation, n, sizeof *r->rotation);
    memory_release(allocator, r->x, (size_t)3 * n, sizeof *r->x);
    memory_release(allocator, r->query, n, sizeof *r->query);
    memory_release(allocator, r->nearest, n, sizeof *r->nearest);
    memory_release(allocator, r->normal, n, sizeof *r->normal);
    cholesky_destroy(r->factor);
    groom_bvh_destroy(r->bvh);
    sheet_finish(&r->sheet);
    surface_finish(&r->surface);
    *r = (struct registration){0};
}

void registration_map(struct registration *r, const double map[3][4])
{
    for (uint32_t v = 0; v < r->sheet.n_vertices; v++) {
        struct vec p = surface_point(&r->surface, r->sheet.vertex_of[v]);
        double q[3];
        for (int i = 0; i < 3; i++)
            q[i] = map[i][0] * p.x + map[i][1] * p.y + map[i][2] * p.z + map[i][3];
        r->position[v] = r->rest[v] = (struct vec){q[0], q[1], q[2]};
    }
    weigh(r);
}

/* --- partners --------------------------------------------------------------------------------------- */

static void find_normals(struct registration *r)
{
    memset(r->normal, 0, r->sheet.n_vertices * sizeof *r->normal);
    for (uint32_t t = 0; t < r->sheet.n_triangles; t++) {
        struct vec o = corner_of(r, r->position, t, 0);
        struct vec n = vec_cross(vec_sub(corner_of(r, r->position, t, 1), o), vec_sub(corner_of(r, r->position, t, 2), o));
        for (int i = 0; i < 3; i++)
            r->normal[r->sheet.triangles[t][i]] = vec_add(r->normal[r->sheet.triangles[t][i]], n);
    }
    for (uint32_t v = 0; v < r->sheet.n_vertices; v++)
        r->normal[v] = vec_unit(r->normal[v]);
}

/* Whether the nearest point lies on an open edge of the target: then nothing is opposite. */
static int on_open_edge(const struct registration *r, const struct groom_surface_point *at)
{
    const uint32_t *v = r->target->triangles[at->triangle];
    for (int i = 0; i < 3; i++)
        if (at->barycentric[i] < ON_EDGE && r->edge[v[(i + 1) % 3]] && r->edge[v[(i + 2) % 3]])
            return 1;
    return 0;
}

void registration_match(struct registration *r, double reach, const struct groom_context *context)
{
    uint32_t n = r->sheet.n_vertices;
    find_normals(r);
    for (uint32_t v = 0; v < n; v++)
        vec_store(r->position[v], r->query[v]);
    groom_bvh_closest_points(r->bvh, (const float (*)[3])r->query, n, r->nearest, context);
    for (uint32_t v = 0; v < n; v++) {
        const struct groom_surface_point *at = &r->nearest[v];
        r->matched[v] = at->triangle != UINT32_MAX && at->distance <= reach && vec_dot(vec_of(at->normal), r->normal[v]) > LEAST_AGREEMENT &&
                        !on_open_edge(r, at);
        r->goal[v] = r->matched[v] ? vec_of(at->position) : r->position[v];
    }
}

/* --- as rigid as possible ---------------------------------------------------------------------------------- */

static void add_product(double s[3][3], struct vec y, struct vec x, double w)
{
    const double a[3] = {w * y.x, w * y.y, w * y.z}, b[3] = {x.x, x.y, x.z};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            s[i][j] += a[i] * b[j];
}

static struct vec turn(const double r[3][3], struct vec p)
{
    return (struct vec){r[0][0] * p.x + r[0][1] * p.y + r[0][2] * p.z, r[1][0] * p.x + r[1][1] * p.y + r[1][2] * p.z,
                        r[2][0] * p.x + r[2][1] * p.y + r[2][2] * p.z};
}

static void find_rotations(struct registration *r)
{
    const struct sheet *sheet = &r->sheet;
    for (uint32_t v = 0; v < sheet->n_vertices; v++) {
        double s[3][3] = {{0}};
        for (uint32_t e = sheet->row_first[v]; e < sheet->row_first[v + 1]; e++)
            add_product(s, vec_sub(r->position[sheet->row[e]], r->position[v]), vec_sub(r->rest[sheet->row[e]], r->rest[v]), r->laplacian[e]);
        rotation_fit((const double (*)[3])s, r->rotation[v]);
    }
}

/* stiffness * Laplacian + areas + anchors; the same for x, y and z. */
static int factor_matrix(struct registration *r, double stiffness, double pull)
{
    const struct sheet *sheet = &r->sheet;
    for (uint32_t v = 0; v < sheet->n_vertices; v++) {
        double sum = 0;
        for (uint32_t e = sheet->row_first[v]; e < sheet->row_first[v + 1]; e++) {
            r->value[e] = -stiffness * r->laplacian[e];
            sum += r->laplacian[e];
        }
        r->value[sheet_entry(sheet, v, v)] = stiffness * sum + r->area[v];
    }
    for (uint32_t a = 0; a < r->n_anchors; a++)
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                const struct anchor *anchor = &r->anchors[a];
                r->value[sheet_entry(sheet, anchor->vertex[i], anchor->vertex[j])] += pull * anchor->barycentric[i] * anchor->barycentric[j];
            }
    return cholesky_factor(r->factor, r->value);
}

static void add_to(double *x, uint32_t n, uint32_t v, struct vec p, double w)
{
    x[v] += w * p.x;
    x[n + v] += w * p.y;
    x[2 * (size_t)n + v] += w * p.z;
}

static void solve(struct registration *r, double stiffness, double pull)
{
    const struct sheet *sheet = &r->sheet;
    uint32_t n = sheet->n_vertices;
    memset(r->x, 0, (size_t)3 * n * sizeof *r->x);
    for (uint32_t v = 0; v < n; v++) {
        add_to(r->x, n, v, r->goal[v], r->area[v]);
        for (uint32_t e = sheet->row_first[v]; e < sheet->row_first[v + 1]; e++) {
            struct vec side = vec_sub(r->rest[v], r->rest[sheet->row[e]]);
            struct vec turned = vec_add(turn((const double (*)[3])r->rotation[v], side), turn((const double (*)[3])r->rotation[sheet->row[e]], side));
            add_to(r->x, n, v, turned, 0.5 * stiffness * r->laplacian[e]);
        }
    }
    for (uint32_t a = 0; a < r->n_anchors; a++)
        for (int i = 0; i < 3; i++)
            add_to(r->x, n, r->anchors[a].vertex[i], r->anchors[a].target, pull * r->anchors[a].barycentric[i]);
    for (int c = 0; c < 3; c++)
        cholesky_solve(r->factor, r->x + (size_t)c * n);
    for (uint32_t v = 0; v < n; v++)
        r->position[v] = (struct vec){r->x[v], r->x[n + v], r->x[2 * (size_t)n + v]};
}

groom_status registration_step(struct registration *r, double length, double pull, double reach, uint32_t iterations,
                               const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_progress *progress = context ? context->progress : NULL;
    double stiffness = (length / r->side) * (length / r->side);
    if (!factor_matrix(r, stiffness, pull * stiffness))
        return groom_fail(diag, GROOM_EDEGENERATE, "the source's mesh is too broken to be deformed");
    for (uint32_t i = 0; i < iterations; i++) {
        if (progress && progress->cancelled && progress->cancelled(progress->user))
            return groom_fail(diag, GROOM_ECANCELLED, "cancelled");
        registration_match(r, reach, context);
        find_rotations(r);
        solve(r, stiffness, pull * stiffness);
        r->iterations++;
    }
    memcpy(r->rest, r->position, r->sheet.n_vertices * sizeof *r->rest);
    return GROOM_OK;
}

/* --- on to the target ---------------------------------------------------------------------------------------- */

struct vec registration_normal(const struct registration *r, const struct vec *points, uint32_t t)
{
    struct vec o = corner_of(r, points, t, 0);
    return vec_unit(vec_cross(vec_sub(corner_of(r, points, t, 1), o), vec_sub(corner_of(r, points, t, 2), o)));
}

void registration_project(struct registration *r, double reach, const struct groom_context *context)
{
    registration_match(r, reach, context);
    memcpy(r->rest, r->position, r->sheet.n_vertices * sizeof *r->rest);
    memcpy(r->position, r->goal, r->sheet.n_vertices * sizeof *r->position);
    for (int round = 0, n_folding = 1; round < 20 && n_folding; round++) {
        n_folding = 0;
        for (uint32_t t = 0; t < r->sheet.n_triangles; t++) {
            if (vec_dot(registration_normal(r, r->rest, t), registration_normal(r, r->position, t)) > LEAST_AGREEMENT)
                continue;
            for (int i = 0; i < 3; i++) {
                uint32_t v = r->sheet.triangles[t][i];
                n_folding += r->matched[v];
                r->matched[v] = 0;
                r->position[v] = r->rest[v];
            }
        }
    }
}

static struct vec source_normal(const struct registration *r, uint32_t t)
{
    const uint32_t *v = r->surface.corners[r->sheet.triangle_of[t]];
    struct vec o = surface_point(&r->surface, v[0]);
    return vec_unit(vec_cross(vec_sub(surface_point(&r->surface, v[1]), o), vec_sub(surface_point(&r->surface, v[2]), o)));
}

int registration_folds(const struct registration *r, uint32_t t, int corner)
{
    uint32_t other = r->sheet.across[t][corner];
    return other != SURFACE_NONE && vec_dot(registration_normal(r, r->position, t), registration_normal(r, r->position, other)) < -0.5 &&
           vec_dot(source_normal(r, t), source_normal(r, other)) > -0.5;
}

static struct vec mean_of_neighbours(const struct registration *r, uint32_t v)
{
    struct vec sum = {0, 0, 0};
    uint32_t n = 0;
    for (uint32_t e = r->sheet.row_first[v]; e < r->sheet.row_first[v + 1]; e++)
        if (r->sheet.row[e] != v) {
            sum = vec_add(sum, r->position[r->sheet.row[e]]);
            n++;
        }
    return n ? vec_scale(sum, 1.0 / n) : r->position[v];
}

void registration_unfold(struct registration *r)
{
    for (int round = 0, n_folded = 1; round < 30 && n_folded; round++) {
        n_folded = 0;
        memset(r->matched, 0, r->sheet.n_vertices * sizeof *r->matched);
        for (uint32_t t = 0; t < r->sheet.n_triangles; t++)
            for (int i = 0; i < 3; i++) {
                if (!registration_folds(r, t, i))
                    continue;
                n_folded++;
                for (int k = 0; k < 3; k++)
                    r->matched[r->sheet.triangles[t][k]] = 1;
            }
        for (uint32_t v = 0; v < r->sheet.n_vertices; v++)
            if (r->matched[v])
                r->position[v] = vec_add(vec_scale(r->position[v], 0.5), vec_scale(mean_of_neighbours(r, v), 0.5));
    }
}
