/* Source over target: by landmarks or by texture coordinates, then step by step softer. */
#include "groom/correspondence.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "groom/body.h"
#include "retarget/registration.h"
#include "retarget/rotation.h"

#define MOST_OFF 0.03         /* metres: of a landmark from its surface */
#define LEAST_SPREAD 1e-3     /* volume of landmarks' box over its diagonal cubed that is not a plane */
#define LEAST_SHARED 0.9      /* of the source's texture coordinates that must lie in the target's charts */
#define LEAST_WHOLE 0.95      /* of its sides that must not be torn by following them */
#define TORN 8.0              /* times the median change of length */
#define MOST_DISTANCE 0.02    /* of the extent: mean distance of a result that is taken */
#define MOST_FOLDED 0.02      /* of the triangles: a mouth's inside and the backs of ears fold a little */
#define LEAST_COVERED 0.2
#define MOST_APART 0.2        /* of the extent: of a landmark from its partner under the best similarity */

struct pairs {
    uint32_t n;
    struct vec *source, *target; /* [n] */
};

struct correspondence {
    const struct groom_mesh *source, *target;
    const struct groom_landmarks *landmarks;
    const struct groom_context *context;
    const struct groom_allocator *allocator;
    struct registration registration;
    uint32_t n_room;       /* of anchors and pairs */
    struct anchor *anchors;
    struct pairs pairs;
    double extent;         /* metres: of the anchors on the target */
};

static groom_status no_memory(struct groom_diag *diag) { return groom_fail(diag, GROOM_ENOMEM, "no memory to lay one mesh over the other"); }

/* --- the similarity that fits pairs best ------------------------------------------------------------------- */

static struct vec mean_of(const struct vec *points, uint32_t n)
{
    struct vec sum = {0, 0, 0};
    for (uint32_t i = 0; i < n; i++)
        sum = vec_add(sum, points[i]);
    return vec_scale(sum, 1.0 / n);
}

static void fit_similarity(const struct pairs *pairs, double map[3][4])
{
    struct vec a = mean_of(pairs->source, pairs->n), b = mean_of(pairs->target, pairs->n);
    double s[3][3] = {{0}}, r[3][3], from = 0, to = 0;
    for (uint32_t i = 0; i < pairs->n; i++) {
        struct vec x = vec_sub(pairs->source[i], a), y = vec_sub(pairs->target[i], b);
        const double p[3] = {x.x, x.y, x.z}, q[3] = {y.x, y.y, y.z};
        from += vec_dot(x, x);
        to += vec_dot(y, y);
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++)
                s[k][l] += q[k] * p[l];
    }
    rotation_fit((const double (*)[3])s, r);
    double scale = from > 0 ? sqrt(to / from) : 1;
    const double o[3] = {a.x, a.y, a.z}, t[3] = {b.x, b.y, b.z};
    for (int k = 0; k < 3; k++) {
        map[k][3] = t[k];
        for (int l = 0; l < 3; l++) {
            map[k][l] = scale * r[k][l];
            map[k][3] -= map[k][l] * o[l];
        }
    }
}

static double extent_of(const struct vec *points, uint32_t n)
{
    struct vec low = points[0], high = points[0];
    for (uint32_t i = 1; i < n; i++) {
        low = (struct vec){fmin(low.x, points[i].x), fmin(low.y, points[i].y), fmin(low.z, points[i].z)};
        high = (struct vec){fmax(high.x, points[i].x), fmax(high.y, points[i].y), fmax(high.z, points[i].z)};
    }
    return vec_length(vec_sub(high, low));
}

/* Volume of the parallelepiped of principal spreads over the cube of the extent: sqrt(det of the covariance). */
static double spread_of(const struct vec *points, uint32_t n)
{
    struct vec mean = mean_of(points, n), row[3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    for (uint32_t i = 0; i < n; i++) {
        struct vec d = vec_sub(points[i], mean);
        row[0] = vec_add(row[0], vec_scale(d, d.x / n));
        row[1] = vec_add(row[1], vec_scale(d, d.y / n));
        row[2] = vec_add(row[2], vec_scale(d, d.z / n));
    }
    double extent = extent_of(points, n), det = vec_dot(row[0], vec_cross(row[1], row[2]));
    return extent > 0 ? sqrt(fmax(det, 0)) / (extent * extent * extent) : 0;
}

/* --- anchors from landmarks ------------------------------------------------------------------------------------ */

static groom_status on_surface(const struct groom_bvh *bvh, const float point[3], uint32_t i, const char *side,
                               struct groom_surface_point *at, struct groom_diag *diag)
{
    char pointer[48];
    if (groom_bvh_closest(bvh, point, INFINITY, at) && at->distance <= (float)MOST_OFF)
        return GROOM_OK;
    snprintf(pointer, sizeof pointer, "/landmarks/%u/%s", i, side);
    return groom_fail_field(diag, GROOM_EINVAL, pointer, "this landmark lies off the %s's surface: at most %.0f cm are", side, 100 * MOST_OFF);
}

static groom_status check_spread(const struct pairs *pairs, struct groom_diag *diag)
{
    const char *side = spread_of(pairs->source, pairs->n) < LEAST_SPREAD ? "source" : "target";
    if (spread_of(pairs->source, pairs->n) >= LEAST_SPREAD && spread_of(pairs->target, pairs->n) >= LEAST_SPREAD)
        return GROOM_OK;
    return groom_fail_field(diag, GROOM_EINVAL, "/landmarks", "the landmarks lie in a plane on the %s, or nearly: give some on the face, "
                            "at the ears, on the crown and at the back of the head", side);
}

static groom_status anchor_landmarks(struct correspondence *c, struct groom_diag *diag)
{
    struct registration *r = &c->registration;
    struct groom_bvh *bvh = NULL;
    groom_status st = groom_bvh_create(c->source, c->context, &bvh, diag);
    for (uint32_t i = 0; st == GROOM_OK && i < c->landmarks->n; i++) {
        struct groom_surface_point from, to;
        st = on_surface(bvh, c->landmarks->pairs[i].source, i, "source", &from, diag);
        if (st == GROOM_OK)
            st = on_surface(r->bvh, c->landmarks->pairs[i].target, i, "target", &to, diag);
        if (st != GROOM_OK)
            break;
        for (int k = 0; k < 3; k++) {
            c->anchors[i].vertex[k] = r->sheet.triangles[from.triangle][k];
            c->anchors[i].barycentric[k] = from.barycentric[k];
        }
        c->anchors[i].target = c->pairs.target[i] = vec_of(to.position);
        c->pairs.source[i] = vec_of(from.position);
    }
    groom_bvh_destroy(bvh);
    c->pairs.n = r->n_anchors = c->landmarks->n;
    return st == GROOM_OK ? check_spread(&c->pairs, diag) : st;
}

/* --- anchors from texture coordinates ---------------------------------------------------------------------------- */

/* The target's charts as a flat mesh in space. */
static groom_status lay_charts(const struct groom_mesh *mesh, const struct groom_context *context, struct groom_mesh **charts,
                               struct groom_diag *diag)
{
    groom_status st = groom_mesh_create(mesh->n_uvs, mesh->n_triangles, 0, context, charts, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t i = 0; i < mesh->n_uvs; i++) {
        (*charts)->points[i][0] = mesh->uvs[i][0];
        (*charts)->points[i][1] = mesh->uvs[i][1];
        (*charts)->points[i][2] = 0;
    }
    memcpy((*charts)->triangles, mesh->uv_triangles, mesh->n_triangles * sizeof *mesh->uv_triangles);
    return GROOM_OK;
}

static struct vec place_on(const struct groom_mesh *mesh, const struct groom_surface_point *at)
{
    struct vec sum = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        sum = vec_add(sum, vec_scale(vec_of(mesh->points[mesh->triangles[at->triangle][i]]), at->barycentric[i]));
    return sum;
}

/* An anchor for each vertex whose first corner's coordinates lie in a chart of the target. taken [n_vertices] zero */
static void follow_charts(struct correspondence *c, const struct groom_bvh *charts, unsigned char *taken)
{
    struct registration *r = &c->registration;
    for (uint32_t t = 0; t < c->source->n_triangles; t++)
        for (int k = 0; k < 3; k++) {
            const float *uv = c->source->uvs[c->source->uv_triangles[t][k]];
            const float flat[3] = {uv[0], uv[1], 0};
            uint32_t v = r->sheet.triangles[t][k];
            struct groom_surface_point at;
            if (taken[v] || !groom_bvh_closest(charts, flat, 1e-3f, &at))
                continue;
            taken[v] = 1;
            c->anchors[r->n_anchors] = (struct anchor){{v, v, v}, {1, 0, 0}, place_on(c->target, &at)};
            c->pairs.source[r->n_anchors] = surface_point(&r->surface, r->sheet.vertex_of[v]);
            c->pairs.target[r->n_anchors] = c->anchors[r->n_anchors].target;
            r->n_anchors++;
        }
    c->pairs.n = r->n_anchors;
}

/* The fraction of sides between anchored vertices that keep their length within TORN, to a common scale.
 * partner [n_vertices] the anchor of each vertex, SURFACE_NONE without */
static double whole_sides(const struct correspondence *c, uint32_t *partner)
{
    const struct registration *r = &c->registration;
    uint64_t n = 0, n_whole = 0;
    double from = 0, to = 0;
    memset(partner, 0xff, r->sheet.n_vertices * sizeof *partner);
    for (uint32_t a = 0; a < r->n_anchors; a++)
        partner[r->anchors[a].vertex[0]] = a;
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t t = 0; t < r->sheet.n_triangles; t++)
            for (int k = 0; k < 3; k++) {
                uint32_t a = partner[r->sheet.triangles[t][k]], b = partner[r->sheet.triangles[t][(k + 1) % 3]];
                if (a == SURFACE_NONE || b == SURFACE_NONE)
                    continue;
                double x = vec_length(vec_sub(c->pairs.source[a], c->pairs.source[b])), y = vec_length(vec_sub(c->pairs.target[a], c->pairs.target[b]));
                if (pass == 0) { /* sums of logarithms: the mean of ratios as such */
                    from += log(fmax(x, 1e-9));
                    to += log(fmax(y, 1e-9));
                    n++;
                } else {
                    n_whole += fabs(log(fmax(y, 1e-9) / fmax(x, 1e-9)) - (to - from) / (double)n) < log(TORN);
                }
            }
    return n ? (double)n_whole / (double)n : 0;
}

static groom_status refuse_layout(double shared, double whole, struct groom_diag *diag)
{
    return groom_fail_field(diag, GROOM_EINVAL, "/landmarks", "the meshes have texture coordinates of different layouts: %.0f %% of the "
                            "source's vertices lie in the target's charts, and %.0f %% of its sides stay whole; give landmarks",
                            100 * shared, 100 * whole);
}

static groom_status anchor_charts(struct correspondence *c, struct groom_diag *diag)
{
    struct registration *r = &c->registration;
    struct groom_mesh *charts = NULL;
    struct groom_bvh *bvh = NULL;
    unsigned char *taken = memory_array_zero(c->allocator, r->sheet.n_vertices, sizeof *taken);
    uint32_t *partner = memory_array(c->allocator, r->sheet.n_vertices, sizeof *partner);
    groom_status st = taken && partner ? lay_charts(c->target, c->context, &charts, diag) : no_memory(diag);
    if (st == GROOM_OK)
        st = groom_bvh_create(charts, c->context, &bvh, diag);
    if (st == GROOM_OK) {
        follow_charts(c, bvh, taken);
        double shared = (double)r->n_anchors / r->sheet.n_vertices, whole = whole_sides(c, partner);
        if (shared < LEAST_SHARED || whole < LEAST_WHOLE)
            st = refuse_layout(shared, whole, diag);
    }
    groom_bvh_destroy(bvh);
    groom_mesh_destroy(charts);
    memory_release(c->allocator, taken, r->sheet.n_vertices, sizeof *taken);
    memory_release(c->allocator, partner, r->sheet.n_vertices, sizeof *partner);
    return st;
}

/* --- softer and softer ------------------------------------------------------------------------------------------------ */

struct stage {
    double length, pull, reach; /* length and reach of the extent */
    uint32_t iterations;
};

static groom_status run_stages(struct correspondence *c, struct groom_diag *diag)
{
    static const struct stage by_landmarks[] = {{0.5, 10, 0.2, 5}, {0.25, 10, 0.2, 5}, {0.12, 10, 0.15, 5}, {0.06, 10, 0.12, 5},
                                                {0.03, 10, 0.08, 5}, {0.02, 10, 0.05, 5}, {0.01, 10, 0.03, 5}};
    static const struct stage by_charts[] = {{0.06, 1, 0.03, 3}, {0.03, 4, 0.03, 3}, {0.01, 40, 0.03, 3}};
    const struct stage *stages = c->landmarks ? by_landmarks : by_charts;
    uint32_t n = c->landmarks ? sizeof by_landmarks / sizeof *by_landmarks : sizeof by_charts / sizeof *by_charts;
    const struct groom_progress *progress = c->context ? c->context->progress : NULL;
    groom_status st = GROOM_OK;
    for (uint32_t i = 0; i < n && st == GROOM_OK; i++) {
        st = registration_step(&c->registration, stages[i].length * c->extent, stages[i].pull, stages[i].reach * c->extent,
                               stages[i].iterations, c->context, diag);
        if (progress && progress->report)
            progress->report(progress->user, (i + 1.0) / n);
    }
    if (st == GROOM_OK)
        registration_project(&c->registration, 0.02 * c->extent, c->context);
    if (st == GROOM_OK)
        registration_unfold(&c->registration);
    return st;
}

/* --- the report ------------------------------------------------------------------------------------------------------------ */

static uint32_t count_folded(const struct registration *r)
{
    uint32_t n = 0;
    for (uint32_t t = 0; t < r->sheet.n_triangles; t++)
        for (int i = 0; i < 3; i++)
            n += registration_folds(r, t, i);
    return n / 2;
}

static uint32_t count_flipped(const struct registration *r, double reach)
{
    uint32_t n = 0;
    for (uint32_t t = 0; t < r->sheet.n_triangles; t++) {
        const uint32_t *v = r->sheet.triangles[t];
        struct groom_surface_point at;
        float middle[3];
        if (!r->matched[v[0]] || !r->matched[v[1]] || !r->matched[v[2]])
            continue;
        vec_store(vec_scale(vec_add(r->position[v[0]], vec_add(r->position[v[1]], r->position[v[2]])), 1.0 / 3), middle);
        n += groom_bvh_closest(r->bvh, middle, (float)reach, &at) && vec_dot(vec_of(at.normal), registration_normal(r, r->position, t)) < 0;
    }
    return n;
}

static double landmark_error(const struct registration *r, uint32_t a)
{
    struct vec p = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        p = vec_add(p, vec_scale(r->position[r->anchors[a].vertex[i]], r->anchors[a].barycentric[i]));
    return vec_length(vec_sub(p, r->anchors[a].target));
}

static void measure(struct correspondence *c, struct groom_correspondence_report *report)
{
    struct registration *r = &c->registration;
    uint32_t n = r->sheet.n_vertices, n_matched = 0;
    *report = (struct groom_correspondence_report){.by_texture = c->landmarks == NULL, .iterations = r->iterations};
    registration_match(r, 0.03 * c->extent, c->context);
    for (uint32_t v = 0; v < n; v++) {
        if (!r->matched[v])
            continue;
        n_matched++;
        report->mean_distance += r->nearest[v].distance;
        report->max_distance = fmax(report->max_distance, r->nearest[v].distance);
    }
    report->mean_distance /= n_matched ? n_matched : 1;
    report->covered = (double)n_matched / n;
    for (uint32_t a = 0; a < r->n_anchors && c->landmarks; a++) {
        double error = landmark_error(r, a);
        report->mean_landmark_error += error / r->n_anchors;
        report->max_landmark_error = fmax(report->max_landmark_error, error);
    }
    report->n_flipped = count_flipped(r, 0.03 * c->extent);
    report->n_folded = count_folded(r);
}

static groom_status judge(const struct correspondence *c, const struct groom_correspondence_report *report, struct groom_diag *diag)
{
    uint32_t n = c->source->n_triangles;
    if (report->n_folded + report->n_flipped > MOST_FOLDED * n)
        return groom_fail(diag, GROOM_EDEGENERATE, "the source folds on the target: %u of its %u triangles are turned over; give more "
                          "landmarks, or check that left and right are not exchanged", report->n_folded + report->n_flipped, n);
    if (report->covered < LEAST_COVERED || report->mean_distance > MOST_DISTANCE * c->extent)
        return groom_fail(diag, GROOM_EDEGENERATE, "the source does not come to lie on the target: %.0f %% of its vertices have a partner "
                          "there, %.1f mm away on the mean; give more landmarks", 100 * report->covered, 1e3 * report->mean_distance);
    return GROOM_OK;
}

/* --- all of it -------------------------------------------------------------------------------------------------------------------- */

static groom_status make_mesh(const struct correspondence *c, struct groom_mesh **out, struct groom_diag *diag)
{
    const struct registration *r = &c->registration;
    const struct groom_mesh *source = c->source;
    struct groom_mesh *mesh;
    groom_status st = groom_mesh_create(source->n_vertices, source->n_triangles, source->n_uvs, c->context, &mesh, diag);
    if (st != GROOM_OK)
        return st;
    memcpy(mesh->triangles, source->triangles, source->n_triangles * sizeof *mesh->triangles);
    if (source->n_uvs) {
        memcpy(mesh->uvs, source->uvs, source->n_uvs * sizeof *mesh->uvs);
        memcpy(mesh->uv_triangles, source->uv_triangles, source->n_triangles * sizeof *mesh->uv_triangles);
    }
    for (uint32_t v = 0; v < source->n_vertices; v++) {
        uint32_t local = r->sheet.local_vertex[r->surface.welded[v]];
        if (local == SURFACE_NONE)
            memcpy(mesh->points[v], source->points[v], sizeof *mesh->points); /* of no triangle */
        else
            vec_store(r->position[local], mesh->points[v]);
    }
    *out = mesh;
    return GROOM_OK;
}

static struct vec mapped(const double map[3][4], struct vec p)
{
    double q[3];
    for (int i = 0; i < 3; i++)
        q[i] = map[i][0] * p.x + map[i][1] * p.y + map[i][2] * p.z + map[i][3];
    return (struct vec){q[0], q[1], q[2]};
}

/* Landmarks that no similarity brings near each other are of another place, or of the other side. */
static groom_status check_apart(const struct correspondence *c, const double map[3][4], struct groom_diag *diag)
{
    double worst = 0;
    uint32_t at = 0;
    char pointer[32];
    for (uint32_t i = 0; i < c->pairs.n; i++) {
        double apart = vec_length(vec_sub(mapped(map, c->pairs.source[i]), c->pairs.target[i]));
        if (apart <= worst)
            continue;
        worst = apart;
        at = i;
    }
    if (worst <= MOST_APART * c->extent || !c->landmarks)
        return GROOM_OK;
    snprintf(pointer, sizeof pointer, "/landmarks/%u", at);
    return groom_fail_field(diag, GROOM_EINVAL, pointer, "the landmarks contradict each other: laid over each other as well as can be, this "
                            "one is still %.1f cm from its partner; are left and right exchanged?", 100 * worst);
}

static groom_status correspond(struct correspondence *c, struct groom_mesh **registered, struct groom_correspondence_report *report,
                               struct groom_diag *diag)
{
    double map[3][4];
    groom_status st = registration_init(&c->registration, c->source, c->target, c->context, diag);
    if (st != GROOM_OK)
        return st;
    c->registration.anchors = c->anchors;
    st = c->landmarks ? anchor_landmarks(c, diag) : anchor_charts(c, diag);
    if (st != GROOM_OK)
        return st;
    c->extent = extent_of(c->pairs.target, c->pairs.n);
    fit_similarity(&c->pairs, map);
    st = check_apart(c, (const double (*)[4])map, diag);
    if (st != GROOM_OK)
        return st;
    registration_map(&c->registration, (const double (*)[4])map);
    st = run_stages(c, diag);
    if (st != GROOM_OK)
        return st;
    measure(c, report);
    st = judge(c, report, diag);
    return st == GROOM_OK ? make_mesh(c, registered, diag) : st;
}

static groom_status check_request(const struct groom_mesh *source, const struct groom_mesh *target,
                                  const struct groom_landmarks *landmarks, struct groom_diag *diag)
{
    char difference[160];
    groom_status st = groom_mesh_validate(source, diag);
    if (st == GROOM_OK)
        st = groom_mesh_validate(target, diag);
    if (st != GROOM_OK)
        return st;
    if (source->n_triangles == 0 || target->n_triangles == 0)
        return groom_fail(diag, GROOM_EEMPTY, "a mesh without a triangle cannot be laid over another");
    if (landmarks && (landmarks->n < GROOM_MIN_LANDMARKS || landmarks->n > GROOM_MAX_LANDMARKS))
        return groom_fail_field(diag, GROOM_EINVAL, "/landmarks", "there must be %d to %d landmarks, not %u", GROOM_MIN_LANDMARKS,
                                GROOM_MAX_LANDMARKS, landmarks->n);
    if (landmarks || (source->n_uvs && target->n_uvs))
        return GROOM_OK;
    if (groom_topology_same(source, target, difference))
        strcpy(difference, "their triangles are the same");
    return groom_fail_field(diag, GROOM_EINVAL, "/landmarks", "the meshes differ (%s), and %s no texture coordinates: give landmarks",
                            difference, source->n_uvs ? "the target has" : target->n_uvs ? "the source has" : "both have");
}

groom_status groom_correspondence_create(const struct groom_mesh *source, const struct groom_mesh *target,
                                         const struct groom_landmarks *landmarks, const struct groom_context *context,
                                         struct groom_mesh **registered, struct groom_correspondence_report *report,
                                         struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_correspondence_report own = {0};
    groom_status st = check_request(source, target, landmarks, diag);
    if (st != GROOM_OK)
        return st;
    struct correspondence c = {.source = source, .target = target, .landmarks = landmarks, .context = context, .allocator = allocator};
    c.n_room = landmarks ? landmarks->n : source->n_vertices;
    c.anchors = memory_array(allocator, c.n_room, sizeof *c.anchors);
    c.pairs.source = memory_array(allocator, c.n_room, sizeof *c.pairs.source);
    c.pairs.target = memory_array(allocator, c.n_room, sizeof *c.pairs.target);
    st = c.anchors && c.pairs.source && c.pairs.target ? correspond(&c, registered, &own, diag) : no_memory(diag);
    registration_finish(&c.registration);
    memory_release(allocator, c.anchors, c.n_room, sizeof *c.anchors);
    memory_release(allocator, c.pairs.source, c.n_room, sizeof *c.pairs.source);
    memory_release(allocator, c.pairs.target, c.n_room, sizeof *c.pairs.target);
    if (st == GROOM_OK && report)
        *report = own;
    return st;
}
