/* From a drawn hairline to new places of the roots. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "retarget/embedded.h"
#include "retarget/hairline_curve.h"
#include "retarget/thin_plate.h"

#define EAR_REACH 0.03   /* metres: how far a front's ends may be drawn from the scalp's edge at the ears */
#define EDGE_REACH 0.02  /* and those of other curves from the edge */
#define N_PINS 24        /* places inside the scalp that the thin plate is held at */

struct relocation {
    const struct groom_scalp_region *region;
    const struct groom_hairline *hairline;
    const struct groom_context *context;
    const struct groom_allocator *allocator;
    struct embedded membrane;
    struct spread spread;
    unsigned char *given;   /* [scalp.n_vertices] of the boundary */
    unsigned char *moved;   /* [n_vertices] of a stretch that a curve takes the place of */
    double (*target)[2];    /* [n_vertices] where given */
    double (*polygon)[2];   /* [n_loop] scratch */
    struct stretch stretches[GROOM_HAIRLINE_MAX_CURVES];
    struct curve curves[GROOM_HAIRLINE_MAX_CURVES];
    struct turns turns[GROOM_HAIRLINE_MAX_CURVES];
    char pointers[GROOM_HAIRLINE_MAX_CURVES][32];
};

static groom_status no_memory(struct groom_diag *diag) { return groom_fail(diag, GROOM_ENOMEM, "no memory to move the hairline"); }

/* --- which stretch a curve takes the place of --------------------------------------------------- */

static groom_status between_ends(struct relocation *r, uint32_t c, struct groom_diag *diag)
{
    const struct curve *curve = &r->curves[c];
    uint32_t n = r->region->scalp.n_loop, at[2];
    char field[64];
    snprintf(field, sizeof field, "%s/points", r->pointers[c]);
    for (int end = 0; end < 2; end++) {
        double distance;
        at[end] = region_loop_nearest(r->region, curve->point[end ? curve->n - 1 : 0], &distance);
        if (distance > EDGE_REACH)
            return groom_fail_field(diag, GROOM_EINVAL, field, "the %s point of the curve is %.1f cm from the scalp's edge; at most "
                                    "%.0f cm are", end ? "last" : "first", 100 * distance, 100 * EDGE_REACH);
    }
    uint32_t ahead = (at[1] + n - at[0]) % n;
    if (ahead < 2 || n - ahead < 2)
        return groom_fail_field(diag, GROOM_EINVAL, field, "both ends of the curve lie at the same place of the scalp's edge");
    return stretch_init(&r->stretches[c], r->region, at[0], at[1], ahead <= n - ahead ? 1 : -1, diag);
}

static groom_status find_stretch(struct relocation *r, uint32_t c, struct groom_diag *diag)
{
    const struct groom_scalp_region *region = r->region;
    int front = r->hairline->kind != GROOM_HAIRLINE_SIDEBURNS;
    groom_status st = front ? stretch_init(&r->stretches[c], region, region->ear_at[0], region->ear_at[1], region->forward, diag)
                            : between_ends(r, c, diag);
    if (st == GROOM_OK)
        st = curve_fasten(&r->curves[c], region, &r->stretches[c], front ? EAR_REACH : EDGE_REACH, r->pointers[c], diag);
    return st;
}

/* The drawing's turning points, turned with the curve; or found. */
static void find_turns(struct relocation *r, uint32_t c)
{
    const struct groom_hairline_curve *drawn = &r->hairline->curves[c];
    struct turns *turns = &r->turns[c];
    if (drawn->n_turns == 0) {
        turns_match(&r->stretches[c], &r->curves[c], turns);
        return;
    }
    turns->n = drawn->n_turns;
    for (uint32_t i = 0; i < drawn->n_turns; i++) {
        struct groom_hairline_turn turn = drawn->turns[i];
        if (r->curves[c].reversed)
            turns->at[drawn->n_turns - 1 - i] = (struct groom_hairline_turn){1 - turn.from, 1 - turn.to};
        else
            turns->at[i] = turn;
    }
}

/* The curve against the part of the boundary that is held; where they meet at its ends does not count. */
static groom_status check_held(const struct relocation *r, uint32_t c, struct groom_diag *diag)
{
    const struct sheet *scalp = &r->region->scalp;
    const struct curve *curve = &r->curves[c];
    for (uint32_t i = 0; i < scalp->n_loop; i++) {
        uint32_t v = scalp->loop[i], w = scalp->loop[(i + 1) % scalp->n_loop];
        const double *a = r->region->flat.u[r->region->patch_vertex[v]], *b = r->region->flat.u[r->region->patch_vertex[w]];
        if (r->moved[v] || r->moved[w])
            continue;
        for (uint32_t k = 0; k + 1 < curve->n; k++) {
            if (curve->arc[k] < 0.05 || curve->arc[k + 1] > 0.95 || !segments_cross(a, b, curve->u[k], curve->u[k + 1]))
                continue;
            char field[64];
            snprintf(field, sizeof field, "%s/points", r->pointers[c]);
            return groom_fail_field(diag, GROOM_EINVAL, field, "the hairline crosses the part of the scalp's edge that is held, at "
                                    "%.0f %% of its length", 100 * curve->arc[k]);
        }
    }
    return GROOM_OK;
}

static groom_status lay_curves(struct relocation *r, struct groom_diag *diag)
{
    groom_status st = GROOM_OK;
    for (uint32_t c = 0; c < r->hairline->n_curves && st == GROOM_OK; c++) {
        if (r->hairline->n_curves > 1)
            snprintf(r->pointers[c], sizeof r->pointers[c], "/curves/%u", c);
        st = curve_init(&r->curves[c], r->region, &r->hairline->curves[c], r->pointers[c], diag);
        if (st == GROOM_OK)
            st = find_stretch(r, c, diag);
        if (st != GROOM_OK)
            return st;
        for (uint32_t i = 0; i < r->stretches[c].n; i++) {
            unsigned char *moved = &r->moved[r->stretches[c].vertex[i]];
            if (*moved && i > 0 && i + 1 < r->stretches[c].n)
                return groom_fail_field(diag, GROOM_EINVAL, r->pointers[c], "two curves take the place of the same part of the hairline");
            *moved = 1;
        }
        find_turns(r, c);
    }
    for (uint32_t c = 0; c < r->hairline->n_curves && st == GROOM_OK; c++)
        st = check_held(r, c, diag);
    return st;
}

/* --- the boundary ------------------------------------------------------------------------------------ */

/* Whether the boundary's targets go round once, the way the boundary does now. */
static int boundary_is_simple(struct relocation *r)
{
    const struct sheet *scalp = &r->region->scalp;
    uint32_t first, second;
    double twice_area = 0;
    for (uint32_t i = 0; i < scalp->n_loop; i++) {
        const double *p = r->target[scalp->loop[i]], *q = r->target[scalp->loop[(i + 1) % scalp->n_loop]];
        memcpy(r->polygon[i], p, sizeof *r->polygon);
        twice_area += p[0] * q[1] - p[1] * q[0];
    }
    return twice_area > 0 && !line_crosses_itself((const double (*)[2])r->polygon, scalp->n_loop, 1, &first, &second);
}

static groom_status aim(struct relocation *r, double keep, struct groom_diag *diag)
{
    const struct sheet *scalp = &r->region->scalp;
    groom_status st = GROOM_OK;
    for (uint32_t v = 0; v < scalp->n_vertices; v++)
        memcpy(r->target[v], r->region->flat.u[r->region->patch_vertex[v]], sizeof *r->target);
    for (uint32_t c = 0; c < r->hairline->n_curves && st == GROOM_OK; c++) {
        const struct stretch *stretch = &r->stretches[c];
        st = curve_targets(&r->curves[c], r->region, stretch, &r->turns[c], keep, r->polygon, r->pointers[c], diag);
        for (uint32_t i = 1; i + 1 < stretch->n && st == GROOM_OK; i++)
            memcpy(r->target[stretch->vertex[i]], r->polygon[i], sizeof *r->target);
    }
    return st;
}

/* Jags beside the line are kept as far as the new boundary stays simple with them. */
static groom_status aim_boundary(struct relocation *r, struct groom_diag *diag)
{
    static const double keeps[] = {1, 0.5, 0.25, 0};
    for (size_t i = 0; i < sizeof keeps / sizeof keeps[0]; i++) {
        groom_status st = aim(r, keeps[i], diag);
        if (st != GROOM_OK || boundary_is_simple(r))
            return st;
    }
    return groom_fail_field(diag, GROOM_EINVAL, "/points", "the hairline crosses itself or the part of the scalp's edge "
                            "that is held, or lies behind it");
}

/* --- the methods --------------------------------------------------------------------------------------- */

static groom_status place_harmonic(struct relocation *r)
{
    const struct sheet *scalp = &r->region->scalp;
    for (uint32_t v = 0; v < scalp->n_vertices; v++)
        for (int k = 0; k < 2; k++)
            r->target[v][k] -= r->membrane.u[v][k];
    spread_solve(&r->spread, &r->target[0][0], 2);
    for (uint32_t v = 0; v < scalp->n_vertices; v++)
        for (int k = 0; k < 2; k++)
            r->target[v][k] += r->membrane.u[v][k];
    embedded_place(&r->membrane, (const double (*)[2])r->target);
    return GROOM_OK;
}

/* Boundary vertices, then the vertices farthest from all chosen so far. returns how many; seeds [n_loop + N_PINS] */
static uint32_t choose_seeds(const struct relocation *r, uint32_t *seeds, double *nearest)
{
    const struct sheet *scalp = &r->region->scalp;
    uint32_t n = 0;
    for (uint32_t v = 0; v < scalp->n_vertices; v++)
        nearest[v] = INFINITY;
    for (uint32_t i = 0; i < scalp->n_loop + N_PINS; i++) {
        uint32_t next = i < scalp->n_loop ? scalp->loop[i] : 0;
        for (uint32_t v = 0; v < scalp->n_vertices && i >= scalp->n_loop; v++)
            if (nearest[v] > nearest[next])
                next = v;
        if (nearest[next] == 0)
            break;
        seeds[n++] = next;
        for (uint32_t v = 0; v < scalp->n_vertices; v++) {
            double du = r->membrane.u[v][0] - r->membrane.u[next][0], dv = r->membrane.u[v][1] - r->membrane.u[next][1];
            nearest[v] = fmin(nearest[v], du * du + dv * dv);
        }
    }
    return n;
}

static groom_status place_thin_plate(struct relocation *r, struct groom_diag *diag)
{
    const struct sheet *scalp = &r->region->scalp;
    uint32_t most = scalp->n_loop + N_PINS;
    struct thin_plate spline = {0};
    uint32_t *seeds = memory_array(r->allocator, most, sizeof *seeds);
    double *nearest = memory_array(r->allocator, scalp->n_vertices, sizeof *nearest);
    double (*centre)[2] = memory_array(r->allocator, most, sizeof *centre), (*value)[2] = memory_array(r->allocator, most, sizeof *value);
    int sound = seeds && nearest && centre && value;
    if (sound) {
        uint32_t n = choose_seeds(r, seeds, nearest);
        for (uint32_t i = 0; i < n; i++)
            for (int k = 0; k < 2; k++) {
                centre[i][k] = r->membrane.u[seeds[i]][k];
                value[i][k] = r->given[seeds[i]] ? r->target[seeds[i]][k] - centre[i][k] : 0;
            }
        sound = thin_plate_init(&spline, (const double (*)[2])centre, (const double (*)[2])value, n, r->allocator);
    }
    for (uint32_t v = 0; v < scalp->n_vertices && sound; v++) {
        double move[2];
        thin_plate_at(&spline, r->membrane.u[v], move);
        for (int k = 0; k < 2 && !r->given[v]; k++)
            r->target[v][k] = r->membrane.u[v][k] + move[k];
    }
    if (sound)
        embedded_place(&r->membrane, (const double (*)[2])r->target);
    thin_plate_finish(&spline);
    memory_release(r->allocator, seeds, most, sizeof *seeds);
    memory_release(r->allocator, nearest, scalp->n_vertices, sizeof *nearest);
    memory_release(r->allocator, centre, most, sizeof *centre);
    memory_release(r->allocator, value, most, sizeof *value);
    return sound ? GROOM_OK : no_memory(diag);
}

static groom_status place_scalp(struct relocation *r, struct groom_diag *diag)
{
    groom_status st = spread_init(&r->spread, &r->region->surface, &r->region->scalp, r->given, diag);
    if (st != GROOM_OK)
        return st;
    switch (r->hairline->method) {
    case GROOM_RELOCATE_HARMONIC:
        return place_harmonic(r);
    case GROOM_RELOCATE_THIN_PLATE:
        return place_thin_plate(r, diag);
    default:
        return embedded_deform(&r->membrane, &r->spread, r->given, (const double (*)[2])r->target, r->context, diag);
    }
}

/* --- roots ------------------------------------------------------------------------------------------------ */

static struct vec root_of(const struct groom_scalp_region *region, uint32_t i)
{
    const struct groom_surface_point *host = &region->hosts[i];
    return vec_add(vec_of(host->position), vec_scale(vec_of(host->normal), region->heights[i]));
}

static void move_root(const struct relocation *r, uint32_t i, float out[3])
{
    const struct groom_scalp_region *region = r->region;
    const struct groom_surface_point *host = &region->hosts[i];
    uint32_t t = region->scalp.local_triangle[host->triangle];
    struct groom_surface_point at;
    struct vec p = {0, 0, 0};
    float q[3];
    if (t == SURFACE_NONE) {
        vec_store(root_of(region, i), out);
        return;
    }
    for (int c = 0; c < 3; c++)
        p = vec_add(p, vec_scale(r->membrane.x[region->scalp.triangles[t][c]], host->barycentric[c]));
    vec_store(p, q);
    if (groom_bvh_closest(region->bvh, q, INFINITY, &at))
        p = vec_add(vec_of(at.position), vec_scale(vec_of(at.normal), region->heights[i]));
    vec_store(p, out);
}

static void move_roots(const struct relocation *r, float (*out)[3], struct groom_relocation_report *report)
{
    const struct groom_scalp_region *region = r->region;
    for (uint32_t i = 0; i < region->n_roots; i++) {
        move_root(r, i, out[i]);
        double moved = vec_length(vec_sub(vec_of(out[i]), root_of(region, i)));
        report->mean_move += moved / region->n_roots;
        report->max_move = fmax(report->max_move, moved);
    }
}

/* --- the report ------------------------------------------------------------------------------------------------ */

static void measure_density(const struct relocation *r, float *density, struct groom_relocation_report *report)
{
    const struct sheet *scalp = &r->region->scalp;
    for (uint32_t t = 0; t < scalp->n_triangles; t++) {
        const uint32_t *v = scalp->triangles[t];
        const double *p = r->membrane.u[v[0]], *q = r->membrane.u[v[1]], *w = r->membrane.u[v[2]];
        struct vec a = vec_sub(r->membrane.x[v[1]], r->membrane.x[v[0]]), b = vec_sub(r->membrane.x[v[2]], r->membrane.x[v[0]]);
        double area = 0.5 * vec_length(vec_cross(a, b)), change = r->membrane.rest[t].area / fmax(area, 1e-30) - 1;
        if (density)
            density[t] = (float)change;
        report->density_l1 += fabs(change) / scalp->n_triangles;
        report->density_linf = fmax(report->density_linf, fabs(change));
        report->n_flipped += (q[0] - p[0]) * (w[1] - p[1]) - (q[1] - p[1]) * (w[0] - p[0]) <= 0;
    }
}

static double distance_to_line(struct vec p, const struct vec *line, uint32_t n)
{
    double nearest = INFINITY;
    for (uint32_t k = 0; k < n; k++)
        nearest = fmin(nearest, vec_length(vec_sub(line[k], p)));
    return nearest;
}

/* How much farther or nearer the boundary's vertices are to the curve than they were to today's line. */
static void measure_boundary(const struct relocation *r, struct groom_relocation_report *report)
{
    for (uint32_t c = 0; c < r->hairline->n_curves; c++) {
        const struct stretch *stretch = &r->stretches[c];
        for (uint32_t i = 0; i < stretch->n; i++) {
            double was = vec_length(vec_sub(stretch->point[i], stretch->smooth[i]));
            double is = distance_to_line(r->membrane.x[stretch->vertex[i]], r->curves[c].point, r->curves[c].n);
            report->boundary_error = fmax(report->boundary_error, fabs(is - was));
        }
    }
}

static double rest_area(const struct embedded *membrane)
{
    double sum = 0;
    for (uint32_t t = 0; t < membrane->region->scalp.n_triangles; t++)
        sum += membrane->rest[t].area;
    return sum;
}

/* --- balding ----------------------------------------------------------------------------------------------------- */

/* Roots stay; those that the new boundary leaves outside are given up. */
static void give_up(struct relocation *r, float (*out)[3], unsigned char *bald, struct groom_relocation_report *report)
{
    const struct groom_scalp_region *region = r->region;
    const struct sheet *scalp = &region->scalp;
    for (uint32_t i = 0; i < scalp->n_loop; i++)
        memcpy(r->polygon[i], r->target[scalp->loop[i]], sizeof *r->polygon);
    for (uint32_t i = 0; i < region->n_roots; i++) {
        const struct groom_surface_point *host = &region->hosts[i];
        double u[2];
        int gone = scalp->local_triangle[host->triangle] != SURFACE_NONE && flat_parameters(&region->flat, host->triangle, host->barycentric, u) &&
                   !line_surrounds((const double (*)[2])r->polygon, scalp->n_loop, u);
        vec_store(root_of(region, i), out[i]);
        if (bald)
            bald[i] = (unsigned char)gone;
        report->n_bald += (uint32_t)gone;
    }
}

/* The drawn curve and a way back to where it began. */
static groom_status close_curve(struct relocation *r, uint32_t c, struct groom_diag *diag)
{
    const struct groom_hairline_curve *drawn = &r->hairline->curves[c];
    struct groom_hairline_curve *round = memory_array(r->allocator, 1, sizeof *round);
    if (!round)
        return no_memory(diag);
    *round = *drawn;
    if (drawn->n_points < GROOM_HAIRLINE_MAX_POINTS && drawn->n_points >= 3 &&
        memcmp(drawn->points[0], drawn->points[drawn->n_points - 1], sizeof drawn->points[0]) != 0)
        memcpy(round->points[round->n_points++], drawn->points[0], sizeof drawn->points[0]);
    groom_status st = curve_init(&r->curves[c], r->region, round, r->pointers[c], diag);
    memory_release(r->allocator, round, 1, sizeof *round);
    return st;
}

/* Roots stay; those within closed curves are given up. */
static groom_status give_up_within(struct relocation *r, float (*out)[3], unsigned char *bald, struct groom_relocation_report *report,
                                   struct groom_diag *diag)
{
    const struct groom_scalp_region *region = r->region;
    uint32_t n_within[GROOM_HAIRLINE_MAX_CURVES] = {0};
    for (uint32_t c = 0; c < r->hairline->n_curves; c++) {
        if (r->hairline->n_curves > 1)
            snprintf(r->pointers[c], sizeof r->pointers[c], "/curves/%u", c);
        groom_status st = close_curve(r, c, diag);
        if (st != GROOM_OK)
            return st;
    }
    for (uint32_t i = 0; i < region->n_roots; i++) {
        const struct groom_surface_point *host = &region->hosts[i];
        double u[2];
        int gone = 0;
        if (flat_parameters(&region->flat, host->triangle, host->barycentric, u))
            for (uint32_t c = 0; c < r->hairline->n_curves; c++) {
                int within = line_surrounds((const double (*)[2])r->curves[c].u, r->curves[c].n, u);
                n_within[c] += (uint32_t)within;
                gone |= within;
            }
        vec_store(root_of(region, i), out[i]);
        if (bald)
            bald[i] = (unsigned char)gone;
        report->n_bald += (uint32_t)gone;
    }
    for (uint32_t c = 0; c < r->hairline->n_curves; c++)
        if (n_within[c] == 0)
            return groom_fail_field(diag, GROOM_EINVAL, r->pointers[c], "no hair grows within the closed curve");
    return GROOM_OK;
}

/* --- all of it ------------------------------------------------------------------------------------------------------ */

static groom_status relocate(struct relocation *r, float (*out)[3], unsigned char *bald, float *density,
                             struct groom_relocation_report *report, struct groom_diag *diag)
{
    const struct sheet *scalp = &r->region->scalp;
    for (uint32_t t = 0; density && t < scalp->n_triangles; t++)
        density[t] = 0;
    if (r->hairline->kind == GROOM_HAIRLINE_CROWN)
        return give_up_within(r, out, bald, report, diag);
    for (uint32_t i = 0; i < scalp->n_loop; i++)
        r->given[scalp->loop[i]] = 1;
    groom_status st = lay_curves(r, diag);
    if (st == GROOM_OK)
        st = aim_boundary(r, diag);
    if (st == GROOM_OK)
        st = embedded_init(&r->membrane, r->region, diag);
    if (st != GROOM_OK)
        return st;
    if (r->hairline->kind == GROOM_HAIRLINE_BALDING) {
        give_up(r, out, bald, report);
        return GROOM_OK;
    }
    st = place_scalp(r, diag);
    if (st != GROOM_OK)
        return st;
    move_roots(r, out, report);
    if (bald)
        memset(bald, 0, r->region->n_roots);
    measure_density(r, density, report);
    measure_boundary(r, report);
    report->load_steps = r->membrane.n_loads;
    report->newton_iterations = r->membrane.n_newton;
    if (r->hairline->method == GROOM_RELOCATE_MEMBRANE)
        report->energy = embedded_energy(&r->membrane) / (r->membrane.material.mu * rest_area(&r->membrane));
    return GROOM_OK;
}

static groom_status check_request(const struct groom_hairline *hairline, struct groom_diag *diag)
{
    int many = hairline->kind == GROOM_HAIRLINE_SIDEBURNS || hairline->kind == GROOM_HAIRLINE_CROWN;
    uint32_t most = many ? GROOM_HAIRLINE_MAX_CURVES : 1;
    if ((unsigned)hairline->kind >= GROOM_HAIRLINE_KIND_COUNT || (unsigned)hairline->method >= GROOM_RELOCATE_COUNT)
        return groom_fail(diag, GROOM_EINVAL, "an edit of a kind or a method that is not known");
    if (hairline->n_curves < 1 || hairline->n_curves > most)
        return groom_fail_field(diag, GROOM_EINVAL, "/curves", "%s takes 1 to %u curves, not %u", groom_hairline_kind_name(hairline->kind),
                                most, hairline->n_curves);
    return GROOM_OK;
}

groom_status groom_hairline_relocate(const struct groom_scalp_region *region, const struct groom_hairline *hairline,
                                     const struct groom_context *context, float (*roots_out)[3], unsigned char *bald,
                                     float *density, struct groom_relocation_report *report, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = region->allocator;
    struct groom_relocation_report own = {0};
    uint32_t n = region->scalp.n_vertices, n_loop = region->scalp.n_loop;
    groom_status st = check_request(hairline, diag);
    if (st != GROOM_OK)
        return st;
    struct relocation *r = memory_array_zero(allocator, 1, sizeof *r);
    if (!r)
        return no_memory(diag);
    *r = (struct relocation){.region = region, .hairline = hairline, .context = context, .allocator = allocator};
    r->given = memory_array_zero(allocator, n, sizeof *r->given);
    r->moved = memory_array_zero(allocator, n, sizeof *r->moved);
    r->target = memory_array(allocator, n, sizeof *r->target);
    r->polygon = memory_array(allocator, n_loop, sizeof *r->polygon);
    st = r->given && r->moved && r->target && r->polygon ? relocate(r, roots_out, bald, density, &own, diag) : no_memory(diag);
    spread_finish(&r->spread);
    embedded_finish(&r->membrane);
    for (uint32_t c = 0; c < GROOM_HAIRLINE_MAX_CURVES; c++) {
        stretch_finish(&r->stretches[c]);
        curve_finish(&r->curves[c]);
    }
    memory_release(allocator, r->given, n, sizeof *r->given);
    memory_release(allocator, r->moved, n, sizeof *r->moved);
    memory_release(allocator, r->target, n, sizeof *r->target);
    memory_release(allocator, r->polygon, n_loop, sizeof *r->polygon);
    memory_release(allocator, r, 1, sizeof *r);
    if (st == GROOM_OK && report)
        *report = own;
    return st;
}
