#include "retarget/embedded.h"

#include <math.h>
#include <string.h>

#include "base/cholesky.h"
#include "base/memory.h"

#define LAMBDA 8.0       /* over mu: area is kept rather than shape, which is what density asks for */
#define FIRST_LOAD 0.125
#define LEAST_LOAD (1.0 / 2048)
#define LOAD_NEWTONS 4   /* iterations in a load step */
#define LAST_NEWTONS 60  /* in the last */
#define TOLERANCE 1e-7   /* relative decrease of energy that ends them */
#define KEPT_AREA 0.1    /* of a triangle's area in the plane, for one step */

groom_status embedded_init(struct embedded *membrane, const struct groom_scalp_region *region, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = region->allocator;
    const struct sheet *scalp = &region->scalp;
    *membrane = (struct embedded){.region = region, .material = {1, LAMBDA}, .allocator = allocator};
    membrane->rest = memory_array_zero(allocator, scalp->n_triangles, sizeof *membrane->rest);
    membrane->u = memory_array_zero(allocator, scalp->n_vertices, sizeof *membrane->u);
    membrane->place = memory_array_zero(allocator, scalp->n_vertices, sizeof *membrane->place);
    membrane->x = memory_array_zero(allocator, scalp->n_vertices, sizeof *membrane->x);
    if (!membrane->rest || !membrane->u || !membrane->place || !membrane->x)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the scalp's membrane");
    for (uint32_t t = 0; t < scalp->n_triangles; t++) {
        struct vec corner[3];
        for (int i = 0; i < 3; i++)
            corner[i] = surface_point(&region->surface, scalp->vertex_of[scalp->triangles[t][i]]);
        if (!membrane_rest(&membrane->rest[t], corner))
            membrane->rest[t] = (struct membrane_triangle){0};
    }
    for (uint32_t t = 0; t < scalp->n_triangles; t++)
        for (int i = 0; i < 3; i++)
            membrane->place[scalp->triangles[t][i]].triangle = region->patch.local_triangle[scalp->triangle_of[t]];
    for (uint32_t v = 0; v < scalp->n_vertices; v++)
        memcpy(membrane->u[v], region->flat.u[region->patch_vertex[v]], sizeof membrane->u[v]);
    embedded_place(membrane, (const double (*)[2])membrane->u);
    return GROOM_OK;
}

void embedded_finish(struct embedded *membrane)
{
    const struct groom_allocator *allocator = membrane->allocator;
    if (!allocator)
        return;
    const struct sheet *scalp = &membrane->region->scalp;
    memory_release(allocator, membrane->rest, scalp->n_triangles, sizeof *membrane->rest);
    memory_release(allocator, membrane->u, scalp->n_vertices, sizeof *membrane->u);
    memory_release(allocator, membrane->place, scalp->n_vertices, sizeof *membrane->place);
    memory_release(allocator, membrane->x, scalp->n_vertices, sizeof *membrane->x);
    *membrane = (struct embedded){0};
}

void embedded_place(struct embedded *membrane, const double (*u)[2])
{
    const struct flat *flat = &membrane->region->flat;
    for (uint32_t v = 0; v < membrane->region->scalp.n_vertices; v++) {
        memmove(membrane->u[v], u[v], sizeof membrane->u[v]);
        flat_locate(flat, u[v], membrane->place[v].triangle, &membrane->place[v]);
        membrane->x[v] = flat_point(flat, &membrane->place[v]);
    }
}

static void corners_of(const struct embedded *membrane, uint32_t t, struct vec x[3])
{
    for (int i = 0; i < 3; i++)
        x[i] = membrane->x[membrane->region->scalp.triangles[t][i]];
}

double embedded_energy(const struct embedded *membrane)
{
    double sum = 0;
    for (uint32_t t = 0; t < membrane->region->scalp.n_triangles; t++) {
        struct vec x[3];
        corners_of(membrane, t, x);
        if (membrane->rest[t].area > 0)
            sum += membrane_energy(&membrane->rest[t], membrane->material, x);
    }
    return sum;
}

/* --- orientation in the plane ---------------------------------------------------------------------- */

static double cross2(const double a[2], const double b[2]) { return a[0] * b[1] - a[1] * b[0]; }

/* The longest step along `move`, up to 1, that leaves every triangle KEPT_AREA of its area in the plane. */
static double longest_step(const struct embedded *membrane, const double (*move)[2])
{
    const struct sheet *scalp = &membrane->region->scalp;
    double longest = 1;
    for (uint32_t t = 0; t < scalp->n_triangles; t++) {
        const uint32_t *v = scalp->triangles[t];
        double p[2], q[2], dp[2], dq[2];
        for (int k = 0; k < 2; k++) {
            p[k] = membrane->u[v[1]][k] - membrane->u[v[0]][k];
            q[k] = membrane->u[v[2]][k] - membrane->u[v[0]][k];
            dp[k] = move[v[1]][k] - move[v[0]][k];
            dq[k] = move[v[2]][k] - move[v[0]][k];
        }
        /* area(s) = a s^2 + b s + c must stay above KEPT_AREA c; c > 0 */
        double a = cross2(dp, dq), b = cross2(p, dq) + cross2(dp, q), c = cross2(p, q);
        for (int halvings = 0; halvings < 60 && a * longest * longest + b * longest + (1 - KEPT_AREA) * c < 0; halvings++)
            longest /= 2;
        /* the parabola may dip below in between */
        double dip = a > 0 ? -b / (2 * a) : 0;
        if (dip > 0 && dip < longest && a * dip * dip + b * dip + (1 - KEPT_AREA) * c < 0)
            longest = (-b - sqrt(b * b - 4 * a * (1 - KEPT_AREA) * c)) / (2 * a);
    }
    return longest;
}

/* --- Newton ---------------------------------------------------------------------------------------------- */

struct newton {
    struct embedded *membrane;
    const uint32_t *unknown;   /* [n_vertices] the number of a free vertex; SURFACE_NONE: held */
    uint32_t n_unknowns;
    uint32_t *first, *column;  /* [2 n_unknowns + 1], pattern of the Hessian */
    double *value, *step;      /* [first[2 n_unknowns]], [2 n_unknowns] */
    double (*move)[2], (*from)[2]; /* [n_vertices] */
    double (*gradient)[2];     /* [n_vertices] */
    struct cholesky *factor;
    uint32_t n_entries;
};

static void find_pattern(struct newton *newton)
{
    const struct sheet *scalp = &newton->membrane->region->scalp;
    uint32_t at = 0;
    for (uint32_t v = 0; v < scalp->n_vertices; v++) {
        if (newton->unknown[v] == SURFACE_NONE)
            continue;
        for (uint32_t k = 0; k < 2; k++) {
            newton->first[2 * newton->unknown[v] + k] = at;
            for (uint32_t e = scalp->row_first[v]; e < scalp->row_first[v + 1]; e++) {
                uint32_t other = newton->unknown[scalp->row[e]];
                if (other == SURFACE_NONE)
                    continue;
                newton->column[at++] = 2 * other;
                newton->column[at++] = 2 * other + 1;
            }
        }
    }
    newton->first[2 * newton->n_unknowns] = at;
}

static groom_status newton_init(struct newton *newton, struct embedded *membrane, const struct spread *spread, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = membrane->allocator;
    const struct sheet *scalp = &membrane->region->scalp;
    uint32_t n = scalp->n_vertices;
    *newton = (struct newton){.membrane = membrane, .unknown = spread->unknown, .n_unknowns = spread->n_unknowns};
    newton->n_entries = 4 * scalp->row_first[n];
    newton->first = memory_array(allocator, (size_t)2 * n + 1, sizeof *newton->first);
    newton->column = memory_array(allocator, newton->n_entries, sizeof *newton->column);
    newton->value = memory_array(allocator, newton->n_entries, sizeof *newton->value);
    newton->step = memory_array(allocator, (size_t)2 * n, sizeof *newton->step);
    newton->move = memory_array_zero(allocator, n, sizeof *newton->move);
    newton->from = memory_array(allocator, n, sizeof *newton->from);
    newton->gradient = memory_array(allocator, n, sizeof *newton->gradient);
    if (!newton->first || !newton->column || !newton->value || !newton->step || !newton->move ||
        !newton->from || !newton->gradient)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to deform the scalp");
    find_pattern(newton);
    newton->factor = cholesky_create(2 * newton->n_unknowns, newton->first, newton->column, allocator);
    return newton->factor ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to deform the scalp");
}

static void newton_finish(struct newton *newton)
{
    if (!newton->membrane)
        return;
    const struct groom_allocator *allocator = newton->membrane->allocator;
    uint32_t n = newton->membrane->region->scalp.n_vertices;
    memory_release(allocator, newton->first, (size_t)2 * n + 1, sizeof *newton->first);
    memory_release(allocator, newton->column, newton->n_entries, sizeof *newton->column);
    memory_release(allocator, newton->value, newton->n_entries, sizeof *newton->value);
    memory_release(allocator, newton->step, (size_t)2 * n, sizeof *newton->step);
    memory_release(allocator, newton->move, n, sizeof *newton->move);
    memory_release(allocator, newton->from, n, sizeof *newton->from);
    memory_release(allocator, newton->gradient, n, sizeof *newton->gradient);
    cholesky_destroy(newton->factor);
}

static uint32_t entry_of(const struct newton *newton, uint32_t row, uint32_t column)
{
    uint32_t low = newton->first[row], high = newton->first[row + 1];
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (newton->column[middle] <= column)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void add_triangle(struct newton *newton, uint32_t t)
{
    const struct embedded *membrane = newton->membrane;
    const uint32_t *v = membrane->region->scalp.triangles[t];
    struct vec x[3];
    double jacobian[3][3][2], gradient[6], hessian[6][6];
    corners_of(membrane, t, x);
    for (int i = 0; i < 3; i++)
        flat_jacobian(&membrane->region->flat, membrane->place[v[i]].triangle, jacobian[i]);
    membrane_derivatives(&membrane->rest[t], membrane->material, x, (const double (*)[3][2])jacobian, gradient, hessian, 1);
    for (int i = 0; i < 3; i++) {
        if (newton->unknown[v[i]] == SURFACE_NONE)
            continue;
        for (int k = 0; k < 2; k++) {
            newton->gradient[v[i]][k] += gradient[2 * i + k];
            for (int j = 0; j < 3; j++) {
                if (newton->unknown[v[j]] == SURFACE_NONE)
                    continue;
                uint32_t e = entry_of(newton, 2 * newton->unknown[v[i]] + (uint32_t)k, 2 * newton->unknown[v[j]]);
                newton->value[e] += hessian[2 * i + k][2 * j];
                newton->value[e + 1] += hessian[2 * i + k][2 * j + 1];
            }
        }
    }
}

static void assemble(struct newton *newton)
{
    const struct sheet *scalp = &newton->membrane->region->scalp;
    memset(newton->value, 0, newton->first[2 * newton->n_unknowns] * sizeof *newton->value);
    memset(newton->gradient, 0, scalp->n_vertices * sizeof *newton->gradient);
    for (uint32_t t = 0; t < scalp->n_triangles; t++)
        if (newton->membrane->rest[t].area > 0)
            add_triangle(newton, t);
    for (uint32_t row = 0; row < 2 * newton->n_unknowns; row++) /* a whiff, for corners where projection leaves nothing */
        newton->value[entry_of(newton, row, row)] *= 1 + 1e-9;
}

/* The Newton direction into move; returns how fast the energy falls along it, 0 where there is none. */
static double find_direction(struct newton *newton)
{
    const struct sheet *scalp = &newton->membrane->region->scalp;
    double slope = 0;
    assemble(newton);
    if (!cholesky_factor(newton->factor, newton->value))
        return 0;
    for (uint32_t v = 0; v < scalp->n_vertices; v++)
        for (uint32_t k = 0; k < 2 && newton->unknown[v] != SURFACE_NONE; k++)
            newton->step[2 * newton->unknown[v] + k] = -newton->gradient[v][k];
    cholesky_solve(newton->factor, newton->step);
    for (uint32_t v = 0; v < scalp->n_vertices; v++)
        for (uint32_t k = 0; k < 2; k++) {
            newton->move[v][k] = newton->unknown[v] == SURFACE_NONE ? 0 : newton->step[2 * newton->unknown[v] + k];
            slope += newton->move[v][k] * newton->gradient[v][k];
        }
    return slope;
}

static void move_by(struct newton *newton, double step)
{
    struct embedded *membrane = newton->membrane;
    uint32_t n = membrane->region->scalp.n_vertices;
    double (*u)[2] = newton->gradient; /* free between assemblies */
    for (uint32_t v = 0; v < n; v++)
        for (int k = 0; k < 2; k++)
            u[v][k] = newton->from[v][k] + step * newton->move[v][k];
    embedded_place(membrane, (const double (*)[2])u);
}

/* One iteration; returns the relative decrease of the energy. */
static double iterate(struct newton *newton, double *energy)
{
    struct embedded *membrane = newton->membrane;
    double slope = find_direction(newton);
    if (!(slope < 0))
        return 0;
    memcpy(newton->from, membrane->u, membrane->region->scalp.n_vertices * sizeof *newton->from);
    double step = longest_step(membrane, (const double (*)[2])newton->move);
    for (int halvings = 0; halvings < 20; halvings++, step /= 2) {
        move_by(newton, step);
        double tried = embedded_energy(membrane);
        if (tried <= *energy + 1e-4 * step * slope) {
            double decrease = (*energy - tried) / fmax(fabs(*energy), 1e-30);
            *energy = tried;
            membrane->n_newton++;
            return decrease;
        }
    }
    move_by(newton, 0);
    return 0;
}

/* --- loading ---------------------------------------------------------------------------------------------------- */

/* Take the held vertices to start + load (target - start), the others along with them by the prediction.
 * returns  0, with nothing moved, where that turns a triangle over */
static int load_to(struct newton *newton, struct spread *spread, const unsigned char *given, const double (*start)[2],
                   const double (*target)[2], double load)
{
    struct embedded *membrane = newton->membrane;
    uint32_t n = membrane->region->scalp.n_vertices;
    for (uint32_t v = 0; v < n; v++)
        for (int k = 0; k < 2; k++)
            newton->move[v][k] = given[v] ? start[v][k] + load * (target[v][k] - start[v][k]) - membrane->u[v][k] : 0;
    spread_solve(spread, &newton->move[0][0], 2);
    if (longest_step(membrane, (const double (*)[2])newton->move) < 1)
        return 0;
    memcpy(newton->from, membrane->u, n * sizeof *newton->from);
    move_by(newton, 1);
    if (isfinite(embedded_energy(membrane)))
        return 1;
    move_by(newton, 0);
    return 0;
}

static groom_status deform(struct newton *newton, struct spread *spread, const unsigned char *given, const double (*start)[2],
                           const double (*target)[2], const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_progress *progress = context ? context->progress : NULL;
    struct embedded *membrane = newton->membrane;
    double load = 0, step = FIRST_LOAD;
    while (load < 1) {
        double next = fmin(1, load + step);
        if (!load_to(newton, spread, given, start, target, next)) {
            step /= 2;
            if (step < LEAST_LOAD)
                return groom_fail(diag, GROOM_EDEGENERATE, "the scalp would fold at %.0f %% of the way to the drawn hairline: "
                                  "draw it closer to today's, or smoother", 100 * load);
            continue;
        }
        double energy = embedded_energy(membrane);
        load = next;
        membrane->n_loads++;
        for (int i = 0, most = load < 1 ? LOAD_NEWTONS : LAST_NEWTONS; i < most; i++) {
            if (progress && progress->cancelled && progress->cancelled(progress->user))
                return groom_fail(diag, GROOM_ECANCELLED, "cancelled");
            if (iterate(newton, &energy) < TOLERANCE)
                break;
        }
    }
    return GROOM_OK;
}

groom_status embedded_deform(struct embedded *membrane, struct spread *spread, const unsigned char *given,
                             const double (*target)[2], const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t n = membrane->region->scalp.n_vertices;
    struct newton newton = {0};
    double (*start)[2] = memory_array(membrane->allocator, n, sizeof *start);
    groom_status st = start ? newton_init(&newton, membrane, spread, diag) : groom_fail(diag, GROOM_ENOMEM, "no memory to deform the scalp");
    if (st == GROOM_OK) {
        memcpy(start, membrane->u, n * sizeof *start);
        st = deform(&newton, spread, given, (const double (*)[2])start, target, context, diag);
    }
    newton_finish(&newton);
    memory_release(membrane->allocator, start, n, sizeof *start);
    return st;
}
