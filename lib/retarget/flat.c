#include "retarget/flat.h"

#include <math.h>
#include <string.h>

#include "base/cholesky.h"
#include "base/memory.h"

#define PI 3.14159265358979323846
#define LEAST_WEIGHT 1e-3 /* of a side: half the sum of cotangents */

/* --- harmonic spreading ------------------------------------------------------------------------ */

static double cotangent(struct vec at, struct vec b, struct vec c)
{
    struct vec p = vec_sub(b, at), q = vec_sub(c, at);
    double area = vec_length(vec_cross(p, q));
    return area > 0 ? vec_dot(p, q) / area : 0;
}

static void find_weights(struct spread *spread, const struct surface *surface)
{
    const struct sheet *sheet = spread->sheet;
    memset(spread->weight, 0, sheet->row_first[sheet->n_vertices] * sizeof *spread->weight);
    for (uint32_t t = 0; t < sheet->n_triangles; t++)
        for (int i = 0; i < 3; i++) {
            uint32_t a = sheet->triangles[t][i], b = sheet->triangles[t][(i + 1) % 3], c = sheet->triangles[t][(i + 2) % 3];
            double w = 0.5 * cotangent(surface_point(surface, sheet->vertex_of[a]), surface_point(surface, sheet->vertex_of[b]),
                                       surface_point(surface, sheet->vertex_of[c]));
            spread->weight[sheet_entry(sheet, b, c)] += w;
            spread->weight[sheet_entry(sheet, c, b)] += w;
        }
    for (uint32_t v = 0; v < sheet->n_vertices; v++) {
        double sum = 0;
        for (uint32_t e = sheet->row_first[v]; e < sheet->row_first[v + 1]; e++) {
            if (sheet->row[e] == v)
                continue;
            spread->weight[e] = -fmax(spread->weight[e], LEAST_WEIGHT);
            sum -= spread->weight[e];
        }
        spread->weight[sheet_entry(sheet, v, v)] = sum;
    }
}

static void find_pattern(struct spread *spread)
{
    const struct sheet *sheet = spread->sheet;
    uint32_t at = 0;
    for (uint32_t v = 0; v < sheet->n_vertices; v++) {
        if (spread->unknown[v] == SURFACE_NONE)
            continue;
        spread->first[spread->unknown[v]] = at;
        for (uint32_t e = sheet->row_first[v]; e < sheet->row_first[v + 1]; e++)
            if (spread->unknown[sheet->row[e]] != SURFACE_NONE) {
                spread->column[at] = spread->unknown[sheet->row[e]];
                spread->value[at++] = spread->weight[e];
            }
    }
    spread->first[spread->n_unknowns] = at;
}

groom_status spread_init(struct spread *spread, const struct surface *surface, const struct sheet *sheet,
                         const unsigned char *given, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = surface->allocator;
    uint32_t n = sheet->n_vertices, n_entries = sheet->row_first[n];
    *spread = (struct spread){.sheet = sheet, .allocator = allocator};
    spread->weight = memory_array(allocator, n_entries, sizeof *spread->weight);
    spread->unknown = memory_array(allocator, n, sizeof *spread->unknown);
    spread->first = memory_array(allocator, (size_t)n + 1, sizeof *spread->first);
    spread->column = memory_array(allocator, n_entries, sizeof *spread->column);
    spread->value = memory_array(allocator, n_entries, sizeof *spread->value);
    spread->x = memory_array(allocator, n, sizeof *spread->x);
    if (!spread->weight || !spread->unknown || !spread->first || !spread->column || !spread->value || !spread->x)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to spread a displacement over the scalp");
    for (uint32_t v = 0; v < n; v++)
        spread->unknown[v] = given[v] ? SURFACE_NONE : spread->n_unknowns++;
    find_weights(spread, surface);
    find_pattern(spread);
    spread->factor = cholesky_create(spread->n_unknowns, spread->first, spread->column, allocator);
    if (!spread->factor)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to spread a displacement over the scalp");
    if (!cholesky_factor(spread->factor, spread->value))
        return groom_fail(diag, GROOM_EDEGENERATE, "the surface of the head around the scalp is too broken to be laid flat");
    return GROOM_OK;
}

void spread_finish(struct spread *spread)
{
    const struct groom_allocator *allocator = spread->allocator;
    if (!allocator)
        return;
    uint32_t n = spread->sheet->n_vertices, n_entries = spread->sheet->row_first[n];
    memory_release(allocator, spread->weight, n_entries, sizeof *spread->weight);
    memory_release(allocator, spread->unknown, n, sizeof *spread->unknown);
    memory_release(allocator, spread->first, (size_t)n + 1, sizeof *spread->first);
    memory_release(allocator, spread->column, n_entries, sizeof *spread->column);
    memory_release(allocator, spread->value, n_entries, sizeof *spread->value);
    memory_release(allocator, spread->x, n, sizeof *spread->x);
    cholesky_destroy(spread->factor);
    *spread = (struct spread){0};
}

void spread_solve(struct spread *spread, double *values, uint32_t width)
{
    const struct sheet *sheet = spread->sheet;
    for (uint32_t c = 0; c < width; c++) {
        for (uint32_t v = 0; v < sheet->n_vertices; v++) {
            double sum = 0;
            if (spread->unknown[v] == SURFACE_NONE)
                continue;
            for (uint32_t e = sheet->row_first[v]; e < sheet->row_first[v + 1]; e++)
                if (spread->unknown[sheet->row[e]] == SURFACE_NONE)
                    sum -= spread->weight[e] * values[(size_t)width * sheet->row[e] + c];
            spread->x[spread->unknown[v]] = sum;
        }
        cholesky_solve(spread->factor, spread->x);
        for (uint32_t v = 0; v < sheet->n_vertices; v++)
            if (spread->unknown[v] != SURFACE_NONE)
                values[(size_t)width * v + c] = spread->x[spread->unknown[v]];
    }
}

/* --- the map -------------------------------------------------------------------------------------- */

static void place_on_circle(struct flat *flat)
{
    const struct sheet *sheet = flat->sheet;
    double length = 0, at = 0;
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t i = 0; i < sheet->n_loop; i++) {
            uint32_t v = sheet->loop[i], next = sheet->loop[(i + 1) % sheet->n_loop];
            double side = vec_length(vec_sub(surface_point(flat->surface, sheet->vertex_of[next]),
                                             surface_point(flat->surface, sheet->vertex_of[v])));
            if (pass == 0) {
                length += side;
                continue;
            }
            flat->u[v][0] = cos(2 * PI * at / length);
            flat->u[v][1] = sin(2 * PI * at / length);
            at += side;
        }
}

groom_status flat_init(struct flat *flat, const struct surface *surface, const struct sheet *sheet, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = surface->allocator;
    struct spread spread = {0};
    *flat = (struct flat){.surface = surface, .sheet = sheet, .allocator = allocator};
    flat->u = memory_array_zero(allocator, sheet->n_vertices, sizeof *flat->u);
    unsigned char *given = memory_array_zero(allocator, sheet->n_vertices, sizeof *given);
    groom_status st = GROOM_ENOMEM;
    if (flat->u && given) {
        for (uint32_t i = 0; i < sheet->n_loop; i++)
            given[sheet->loop[i]] = 1;
        place_on_circle(flat);
        st = spread_init(&spread, surface, sheet, given, diag);
        if (st == GROOM_OK)
            spread_solve(&spread, &flat->u[0][0], 2);
        spread_finish(&spread);
    } else {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to lay the head flat");
    }
    memory_release(allocator, given, sheet->n_vertices, sizeof *given);
    return st;
}

void flat_finish(struct flat *flat)
{
    if (!flat->allocator)
        return;
    memory_release(flat->allocator, flat->u, flat->sheet->n_vertices, sizeof *flat->u);
    *flat = (struct flat){0};
}

/* --- there and back ----------------------------------------------------------------------------------- */

/* Barycentric coordinates of u; the corner of the least is what it lies beyond. */
static int coordinates(const struct flat *flat, uint32_t t, const double u[2], double b[3])
{
    const uint32_t *v = flat->sheet->triangles[t];
    const double *p = flat->u[v[0]], *q = flat->u[v[1]], *r = flat->u[v[2]];
    double area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    b[1] = ((u[0] - p[0]) * (r[1] - p[1]) - (u[1] - p[1]) * (r[0] - p[0])) / area;
    b[2] = ((q[0] - p[0]) * (u[1] - p[1]) - (q[1] - p[1]) * (u[0] - p[0])) / area;
    b[0] = 1 - b[1] - b[2];
    return b[0] <= b[1] ? (b[0] <= b[2] ? 0 : 2) : (b[1] <= b[2] ? 1 : 2);
}

#define INSIDE (-1e-12) /* a coordinate not below this counts as inside */

int flat_locate(const struct flat *flat, const double u[2], uint32_t hint, struct flat_place *place)
{
    const struct sheet *sheet = flat->sheet;
    double best = -INFINITY;
    for (uint32_t t = hint, steps = 0; t != SURFACE_NONE && steps < 200; steps++) {
        int least = coordinates(flat, t, u, place->barycentric);
        if (place->barycentric[least] >= INSIDE) {
            place->triangle = t;
            return 1;
        }
        t = sheet->across[t][least];
    }
    for (uint32_t t = 0; t < sheet->n_triangles; t++) { /* around a hole of the mesh, or outside */
        double b[3];
        int least = coordinates(flat, t, u, b);
        if (b[least] > best) {
            best = b[least];
            place->triangle = t;
            memcpy(place->barycentric, b, sizeof b);
        }
    }
    return best >= INSIDE;
}

struct vec flat_point(const struct flat *flat, const struct flat_place *place)
{
    struct vec sum = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        sum = vec_add(sum, vec_scale(surface_point(flat->surface, flat->sheet->vertex_of[flat->sheet->triangles[place->triangle][i]]),
                                     place->barycentric[i]));
    return sum;
}

void flat_jacobian(const struct flat *flat, uint32_t triangle, double jacobian[3][2])
{
    const uint32_t *v = flat->sheet->triangles[triangle];
    const double *p = flat->u[v[0]], *q = flat->u[v[1]], *r = flat->u[v[2]];
    struct vec x0 = surface_point(flat->surface, flat->sheet->vertex_of[v[0]]);
    struct vec x1 = vec_sub(surface_point(flat->surface, flat->sheet->vertex_of[v[1]]), x0);
    struct vec x2 = vec_sub(surface_point(flat->surface, flat->sheet->vertex_of[v[2]]), x0);
    double a = q[0] - p[0], b = r[0] - p[0], c = q[1] - p[1], d = r[1] - p[1], det = a * d - b * c;
    struct vec along_u = vec_scale(vec_sub(vec_scale(x1, d), vec_scale(x2, c)), 1 / det);
    struct vec along_v = vec_scale(vec_sub(vec_scale(x2, a), vec_scale(x1, b)), 1 / det);
    const double columns[2][3] = {{along_u.x, along_u.y, along_u.z}, {along_v.x, along_v.y, along_v.z}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 2; j++)
            jacobian[i][j] = columns[j][i];
}

int flat_parameters(const struct flat *flat, uint32_t surface_triangle, const float barycentric[3], double u[2])
{
    uint32_t t = flat->sheet->local_triangle[surface_triangle];
    u[0] = u[1] = 0;
    if (t == SURFACE_NONE)
        return 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++)
            u[k] += (double)barycentric[i] * flat->u[flat->sheet->triangles[t][i]][k];
    return 1;
}
