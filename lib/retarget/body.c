#include "groom/body.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "geometry/sides.h"
#include "geometry/vec.h"

#define NONE UINT32_MAX
#define MAX_OPEN (1.0 / 3)         /* of a body's surface */
#define MAX_NON_MANIFOLD (1.0 / 50) /* of its edges */

/* One connected piece. */
struct shell {
    double area, volume; /* volume: its holes closed flat */
    double gap;          /* area of those closures */
    uint32_t n_triangles, n_boundary_edges;
    double middle[3];    /* of its boundary: what its holes are closed towards */
};

struct check {
    struct groom_mesh *mesh;
    struct mesh_sides sides;
    uint32_t *across;     /* [3 n_triangles] the triangle across each side where exactly two meet; NONE */
    uint32_t *shell_of;   /* [n_triangles] */
    uint32_t *queue;      /* [n_triangles] */
    unsigned char *turn;  /* [n_triangles] against the triangle that the shell was grown from */
    uint32_t *loop;       /* [n_vertices] union-find of boundary vertices; the way up */
    struct shell *shells; /* [n_shells]; room for n_triangles */
    struct groom_body_report *report;
    const struct groom_allocator *allocator;
};

static void warn(struct groom_body_report *report, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void warn(struct groom_body_report *report, const char *format, ...)
{
    va_list arguments;
    if (report->n_warnings == GROOM_BODY_MAX_WARNINGS)
        return;
    va_start(arguments, format);
    vsnprintf(report->warnings[report->n_warnings++], sizeof report->warnings[0], format, arguments);
    va_end(arguments);
}

/* --- shells ----------------------------------------------------------------------------- */

/* Does the triangle run along its side from the edge's low to its high vertex? */
static int runs_up(const struct check *check, const struct mesh_side *side)
{
    return check->sides.welded[check->mesh->triangles[side->triangle][(side->corner + 1) % 3]] == side->low;
}

static void join_across(struct check *check)
{
    const struct mesh_sides *sides = &check->sides;
    memset(check->across, 0xff, sides->n * sizeof *check->across);
    for (size_t first = 0, end; first < sides->n; first = end) {
        const struct mesh_side *s = &sides->sides[first];
        end = mesh_edge_end(sides, first);
        check->report->n_boundary_edges += end - first == 1;
        check->report->n_non_manifold_edges += end - first > 2;
        if (end - first == 2) {
            check->across[(size_t)3 * s[0].triangle + s[0].corner] = s[1].triangle;
            check->across[(size_t)3 * s[1].triangle + s[1].corner] = s[0].triangle;
        }
    }
}

static int agree(const struct check *check, uint32_t t, uint32_t corner, uint32_t other)
{
    const uint32_t *w = check->sides.welded, *p = check->mesh->triangles[t], *q = check->mesh->triangles[other];
    uint32_t from = w[p[(corner + 1) % 3]], to = w[p[(corner + 2) % 3]];
    for (int i = 0; i < 3; i++)
        if (w[q[i]] == to && w[q[(i + 1) % 3]] == from)
            return 1;
    return 0;
}

/* Everything that hangs together with triangle `seed`, each turned to agree with the one it was reached from.
 * returns 0 where two ways around say different things: the surface has one side only */
static int grow_shell(struct check *check, uint32_t seed, uint32_t shell)
{
    uint32_t n = 0, at = 0;
    int two_sided = 1;
    check->queue[n++] = seed;
    check->shell_of[seed] = shell;
    while (at < n) {
        uint32_t t = check->queue[at++];
        for (uint32_t corner = 0; corner < 3; corner++) {
            uint32_t other = check->across[(size_t)3 * t + corner];
            if (other == NONE)
                continue;
            unsigned char turn = check->turn[t] ^ !agree(check, t, corner, other);
            if (check->shell_of[other] == NONE) {
                check->shell_of[other] = shell;
                check->turn[other] = turn;
                check->queue[n++] = other;
            } else if (check->turn[other] != turn) {
                two_sided = 0;
            }
        }
    }
    check->shells[shell].n_triangles = n;
    return two_sided;
}

static groom_status find_shells(struct check *check, struct groom_diag *diag)
{
    memset(check->shell_of, 0xff, check->mesh->n_triangles * sizeof *check->shell_of);
    for (uint32_t t = 0; t < check->mesh->n_triangles; t++)
        if (check->shell_of[t] == NONE) {
            uint32_t shell = check->report->n_shells++;
            check->shells[shell] = (struct shell){0};
            if (!grow_shell(check, t, shell))
                return groom_fail(diag, GROOM_EDEGENERATE, "the surface around triangle %u has one side only (a Moebius "
                                  "band): cut it, or make its normals agree in the modelling program", t);
        }
    return GROOM_OK;
}

/* --- what a shell encloses ---------------------------------------------------------------- */

/* The corners of a triangle after it is turned to agree with its shell. */
static void corners_of(const struct check *check, uint32_t t, struct vec corner[3])
{
    const uint32_t *v = check->mesh->triangles[t];
    int turn = check->turn[t];
    corner[0] = vec_of(check->mesh->points[v[0]]);
    corner[1] = vec_of(check->mesh->points[v[turn ? 2 : 1]]);
    corner[2] = vec_of(check->mesh->points[v[turn ? 1 : 2]]);
}

static uint32_t loop_root(struct check *check, uint32_t v)
{
    while (check->loop[v] != v)
        v = check->loop[v] = check->loop[check->loop[v]];
    return v;
}

static void find_boundary(struct check *check)
{
    const struct mesh_sides *sides = &check->sides;
    uint32_t n_vertices = 0, n_joined = 0;
    memset(check->loop, 0xff, sides->n_vertices * sizeof *check->loop);
    for (size_t first = 0, end; first < sides->n; first = end) {
        const struct mesh_side *s = &sides->sides[first];
        end = mesh_edge_end(sides, first);
        if (end - first != 1)
            continue;
        struct shell *shell = &check->shells[check->shell_of[s->triangle]];
        const uint32_t ends[2] = {s->low, s->high};
        shell->n_boundary_edges++;
        for (int i = 0; i < 2; i++) {
            for (int c = 0; c < 3; c++)
                shell->middle[c] += 0.5 * (double)check->mesh->points[ends[i]][c];
            if (check->loop[ends[i]] == NONE) {
                check->loop[ends[i]] = ends[i];
                n_vertices++;
            }
        }
        uint32_t a = loop_root(check, s->low), b = loop_root(check, s->high);
        n_joined += a != b;
        check->loop[a > b ? a : b] = a > b ? b : a;
    }
    check->report->n_holes = n_vertices - n_joined;
    for (uint32_t i = 0; i < check->report->n_shells; i++)
        for (int c = 0; c < 3; c++)
            check->shells[i].middle[c] /= check->shells[i].n_boundary_edges ? check->shells[i].n_boundary_edges : 1;
}

static struct vec middle_of(const struct shell *shell)
{
    return (struct vec){shell->middle[0], shell->middle[1], shell->middle[2]};
}

/* Sums of area and volume, the latter against the middle of the boundary. A flat cap through that middle
 * adds nothing to it, so one hole is closed exactly so; several by cones towards their common middle. */
static void measure_shells(struct check *check)
{
    for (uint32_t t = 0; t < check->mesh->n_triangles; t++) {
        struct shell *shell = &check->shells[check->shell_of[t]];
        struct vec corner[3], o = middle_of(shell);
        corners_of(check, t, corner);
        struct vec a = vec_sub(corner[0], o), b = vec_sub(corner[1], o), c = vec_sub(corner[2], o);
        shell->area += 0.5 * vec_length(vec_cross(vec_sub(b, a), vec_sub(c, a)));
        shell->volume += vec_dot(a, vec_cross(b, c)) / 6;
    }
}

/* The flat area of every hole, by its loop: half the length of the sum of cross products around it.
 * sums [n_vertices] zero */
static void measure_holes(struct check *check, struct vec *sums, uint32_t *shell_of_loop)
{
    const struct mesh_sides *sides = &check->sides;
    for (size_t first = 0, end; first < sides->n; first = end) {
        const struct mesh_side *s = &sides->sides[first];
        end = mesh_edge_end(sides, first);
        if (end - first != 1)
            continue;
        int up = runs_up(check, s) ^ check->turn[s->triangle];
        struct vec a = vec_of(check->mesh->points[up ? s->low : s->high]), b = vec_of(check->mesh->points[up ? s->high : s->low]);
        uint32_t root = loop_root(check, s->low);
        struct vec o = vec_of(check->mesh->points[root]);
        sums[root] = vec_add(sums[root], vec_cross(vec_sub(a, o), vec_sub(b, o)));
        shell_of_loop[root] = check->shell_of[s->triangle];
    }
    for (uint32_t v = 0; v < sides->n_vertices; v++)
        if (check->loop[v] == v)
            check->shells[shell_of_loop[v]].gap += 0.5 * vec_length(sums[v]);
}

/* --- the verdict --------------------------------------------------------------------------- */

static int is_sheet(const struct shell *shell)
{
    return shell->gap > MAX_OPEN * shell->area || shell->area == 0;
}

static uint32_t largest_shell(const struct check *check)
{
    uint32_t best = 0;
    for (uint32_t i = 1; i < check->report->n_shells; i++)
        if (check->shells[i].area > check->shells[best].area)
            best = i;
    return best;
}

static void exchange(uint32_t triangle[3])
{
    uint32_t second = triangle[1];
    triangle[1] = triangle[2];
    triangle[2] = second;
}

/* Sheets have no inside: as a whole they stay as they came. */
static void turn_right_side_out(struct check *check)
{
    for (uint32_t t = 0; t < check->mesh->n_triangles; t++) {
        const struct shell *shell = &check->shells[check->shell_of[t]];
        if (!(check->turn[t] ^ (!is_sheet(shell) && shell->volume < 0)))
            continue;
        exchange(check->mesh->triangles[t]);
        if (check->mesh->uv_triangles)
            exchange(check->mesh->uv_triangles[t]);
        check->report->n_turned++;
    }
}

static void tell(struct check *check, uint32_t body)
{
    struct groom_body_report *report = check->report;
    uint32_t n_sheets = 0;
    for (uint32_t i = 0; i < report->n_shells; i++)
        n_sheets += is_sheet(&check->shells[i]);
    if (report->n_turned)
        warn(report, "%u of %u triangles were turned right side out", report->n_turned, check->mesh->n_triangles);
    if (report->n_boundary_edges)
        warn(report, "the mesh is open: %u hole%s of %u edges together; inside is told by winding numbers there",
             report->n_holes, report->n_holes == 1 ? "" : "s", report->n_boundary_edges);
    if (report->n_shells > 1)
        warn(report, "the mesh has %u shells; the largest, of %u triangles, is taken for the body's own skin",
             report->n_shells, check->shells[body].n_triangles);
    if (n_sheets)
        warn(report, "%u of the shells are open sheets, which have no inside", n_sheets);
    if (report->n_non_manifold_edges)
        warn(report, "%u edges belong to more than two triangles", report->n_non_manifold_edges);
}

static groom_status judge(struct check *check, struct groom_diag *diag)
{
    struct groom_body_report *report = check->report;
    uint32_t body = largest_shell(check);
    const struct shell *shell = &check->shells[body];
    double n_edges = 1.5 * check->mesh->n_triangles;
    report->open = shell->area > 0 ? shell->gap / shell->area : 1;
    if (report->n_non_manifold_edges > MAX_NON_MANIFOLD * n_edges)
        return groom_fail(diag, GROOM_EDEGENERATE, "%u edges belong to more than two triangles, of about %.0f: remove the "
                          "doubled or inner faces of the mesh", report->n_non_manifold_edges, n_edges);
    if (is_sheet(shell))
        return groom_fail(diag, GROOM_EDEGENERATE, "the mesh is an open sheet: closing its holes would take %.0f %% of its "
                          "area, and it has no inside; a body may be open at neck or waist, not more", 100 * report->open);
    double size = shell->area * sqrt(shell->area);
    if (fabs(shell->volume) < 1e-3 * size)
        return groom_fail(diag, GROOM_EDEGENERATE, "the mesh encloses no volume (%.3g litres)", 1e3 * fabs(shell->volume));
    turn_right_side_out(check);
    report->volume = fabs(shell->volume);
    tell(check, body);
    return GROOM_OK;
}

static groom_status run(struct check *check, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = check->allocator;
    uint32_t n_vertices = check->mesh->n_vertices;
    struct vec *sums = memory_array_zero(allocator, n_vertices, sizeof *sums);
    uint32_t *shell_of_loop = memory_array(allocator, n_vertices, sizeof *shell_of_loop);
    groom_status st = sums && shell_of_loop ? mesh_sides_init(&check->sides, check->mesh, allocator, diag)
                                            : groom_fail(diag, GROOM_ENOMEM, "no memory to check the body");
    if (st == GROOM_OK) {
        join_across(check);
        st = find_shells(check, diag);
    }
    if (st == GROOM_OK) {
        find_boundary(check);
        measure_shells(check);
        measure_holes(check, sums, shell_of_loop);
        st = judge(check, diag);
    }
    mesh_sides_finish(&check->sides);
    memory_release(allocator, sums, n_vertices, sizeof *sums);
    memory_release(allocator, shell_of_loop, n_vertices, sizeof *shell_of_loop);
    return st;
}

groom_status groom_body_check(struct groom_mesh *mesh, const struct groom_context *context,
                              struct groom_body_report *report, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_body_report own = {0};
    struct check check = {.mesh = mesh, .report = report ? report : &own, .allocator = allocator};
    uint32_t n = mesh->n_triangles;
    groom_status st = groom_mesh_validate(mesh, diag);
    if (st != GROOM_OK)
        return st;
    if (n == 0)
        return groom_fail(diag, GROOM_EEMPTY, "the mesh has no triangle");
    *check.report = (struct groom_body_report){0};
    check.across = memory_array(allocator, (size_t)3 * n, sizeof *check.across);
    check.shell_of = memory_array(allocator, n, sizeof *check.shell_of);
    check.queue = memory_array(allocator, n, sizeof *check.queue);
    check.turn = memory_array_zero(allocator, n, sizeof *check.turn);
    check.loop = memory_array(allocator, mesh->n_vertices, sizeof *check.loop);
    check.shells = memory_array(allocator, n, sizeof *check.shells);
    st = check.across && check.shell_of && check.queue && check.turn && check.loop && check.shells
             ? run(&check, diag)
             : groom_fail(diag, GROOM_ENOMEM, "no memory to check the body");
    memory_release(allocator, check.across, (size_t)3 * n, sizeof *check.across);
    memory_release(allocator, check.shell_of, n, sizeof *check.shell_of);
    memory_release(allocator, check.queue, n, sizeof *check.queue);
    memory_release(allocator, check.turn, n, sizeof *check.turn);
    memory_release(allocator, check.loop, mesh->n_vertices, sizeof *check.loop);
    memory_release(allocator, check.shells, n, sizeof *check.shells);
    return st;
}

/* --- two meshes ------------------------------------------------------------------------------ */

static int same_corners(const uint32_t a[3], const uint32_t b[3])
{
    for (int shift = 0; shift < 3; shift++)
        if (a[0] == b[shift] && ((a[1] == b[(shift + 1) % 3] && a[2] == b[(shift + 2) % 3]) ||
                                 (a[2] == b[(shift + 1) % 3] && a[1] == b[(shift + 2) % 3])))
            return 1;
    return 0;
}

int groom_topology_same(const struct groom_mesh *a, const struct groom_mesh *b, char difference[160])
{
    char own[160], *text = difference ? difference : own;
    text[0] = 0;
    if (a->n_vertices != b->n_vertices || a->n_triangles != b->n_triangles) {
        snprintf(text, 160, "the source has %u vertices and %u triangles, the target %u and %u", a->n_vertices,
                 a->n_triangles, b->n_vertices, b->n_triangles);
        return 0;
    }
    for (uint32_t t = 0; t < a->n_triangles; t++)
        if (!same_corners(a->triangles[t], b->triangles[t])) {
            const uint32_t *p = a->triangles[t], *q = b->triangles[t];
            snprintf(text, 160, "triangle %u is of vertices %u, %u, %u in the source and %u, %u, %u in the target", t, p[0],
                     p[1], p[2], q[0], q[1], q[2]);
            return 0;
        }
    return 1;
}
