#include "curvature/convert_strand.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "curvature/helix.h"
#include "curvature/helix_rows.h"

#define ELEMENTS_A_TURN 3.5
/* Handedness flips where the torsion angle has gone at least this far both ways (radians). */
#define FLIP_ANGLE 0.6
/* Strands that smooth elements miss by more than this many tolerances are taken with their corners: curvatures
 * there are as large as corners are short. */
#define CORNERS_BEYOND 2.0
/* An element that turns so many times as far as the strand's do in the mean goes round once too often. */
#define LOOP_EXCESS 4.0
/* Planes of less bending than this (radians) have no torsion worth the name. */
#define LEAST_BEND 0.03

uint32_t convert_max_elements(const struct groom_conversion_options *options, uint32_t n_vertices)
{
    if (options->n_elements)
        return options->n_elements;
    uint32_t most = options->max_elements ? options->max_elements : 2 * n_vertices;
    return most > options->min_elements ? most : options->min_elements;
}

/* --- the polyline as it is ------------------------------------------------------------- */

/* Vertices relative to the root; knots are those that stand apart from the one before. */
static void load(struct convert_space *space, const float (*points)[3], uint32_t n)
{
    struct spline *s = &space->spline;
    double length = 0.0;
    for (uint32_t k = 0; k < n; k++) {
        for (int i = 0; i < 3; i++)
            ((double *)&space->vertex[k])[i] = (double)points[k][i] - (double)points[0][i];
        if (k) {
            vec3 d = vec_sub(space->vertex[k], space->vertex[k - 1]);
            length += sqrt(vec_dot(d, d));
        }
    }
    s->n = 0;
    for (uint32_t k = 0; k < n; k++) {
        vec3 d = s->n ? vec_sub(space->vertex[k], s->point[s->n - 1]) : (vec3){length, 0.0, 0.0};
        double h = sqrt(vec_dot(d, d));
        if (h > 1e-6 * length) {
            if (s->n)
                s->h[s->n - 1] = h;
            s->point[s->n++] = space->vertex[k];
        }
        space->knot[k] = s->n ? s->n - 1 : 0;
    }
}

static double angle_between(vec3 a, vec3 b)
{
    vec3 c = vec_cross(a, b);
    return atan2(sqrt(vec_dot(c, c)), vec_dot(a, b));
}

/* All the turning of the polyline, in turns. */
static double count_turns(const struct spline *s)
{
    double sum = 0.0;
    for (uint32_t k = 1; k + 1 < s->n; k++)
        sum += angle_between(vec_sub(s->point[k], s->point[k - 1]), vec_sub(s->point[k + 1], s->point[k]));
    return sum / (2.0 * M_PI);
}

/* The angle by which the plane of bending turns over segment k; 0 where it is not defined (hardly any
 * bending) or where bending changes sides (an inflection). */
static double torsion_angle(const struct spline *s, uint32_t k)
{
    vec3 a = vec_sub(s->point[k], s->point[k - 1]), b = vec_sub(s->point[k + 1], s->point[k]);
    vec3 c = vec_sub(s->point[k + 2], s->point[k + 1]);
    vec3 n0 = vec_cross(a, b), n1 = vec_cross(b, c);
    double la = s->h[k - 1], lb = s->h[k], lc = s->h[k + 1];
    if (vec_dot(n0, n0) < LEAST_BEND * LEAST_BEND * la * la * lb * lb ||
        vec_dot(n1, n1) < LEAST_BEND * LEAST_BEND * lb * lb * lc * lc)
        return 0.0;
    double y = vec_dot(vec_cross(n0, n1), b) / lb, x = vec_dot(n0, n1), t = y / x;
    if (x > 0.0 && fabs(t) < 0.5) /* the usual case without a call: within 0.2 % */
        return t * (1.0 - t * t * (1.0 / 3 - t * t * (1.0 / 5 - t * t / 7)));
    double angle = atan2(y, x);
    return fabs(angle) < 2.0 ? angle : 0.0;
}

/* Turning points of the running torsion, with hysteresis so that noise makes none. */
static uint32_t find_flips(struct convert_space *space)
{
    const struct spline *s = &space->spline;
    double now = 0.0, high = 0.0, low = 0.0, high_at = 0.0, low_at = 0.0;
    int side = 0; /* 1 rising, -1 falling, 0 not known yet */
    uint32_t n = 0;
    for (uint32_t k = 1; k + 2 < s->n; k++) {
        now += torsion_angle(s, k);
        if (now > high)
            high = now, high_at = s->arc[k + 1];
        if (now < low)
            low = now, low_at = s->arc[k + 1];
        int turned = side >= 0 && now < high - FLIP_ANGLE ? -1 : side <= 0 && now > low + FLIP_ANGLE ? 1 : 0;
        if (!turned)
            continue;
        if (side)
            space->flips[n++] = turned < 0 ? high_at : low_at;
        side = turned;
        high = low = now;
        high_at = low_at = s->arc[k + 1];
    }
    return n;
}

/* --- breaks ---------------------------------------------------------------------------- */

/* n elements, uniform in arc length, the nearest inner break moved to each flip. */
static void uniform_breaks(struct convert_space *space, uint32_t n, uint32_t n_flips)
{
    double length = space->spline.arc[space->spline.n - 1], last = 0.0;
    for (uint32_t i = 0; i <= n; i++)
        space->breaks[i] = length * i / n;
    for (uint32_t f = 0; f < n_flips; f++) {
        double want = space->flips[f];
        uint32_t i = (uint32_t)(want / length * n + 0.5);
        if (i == 0 || i >= n || want - last < 0.5 * length / n)
            continue;
        space->breaks[i] = want;
        last = want;
    }
}

/* An element around each vertex. Not one to a segment: like a quadratic spline with its knots on the
 * data, that would have to swing from vertex to vertex. */
static uint32_t middle_breaks(struct convert_space *space)
{
    const struct spline *s = &space->spline;
    space->breaks[0] = 0.0;
    for (uint32_t k = 1; k < s->n; k++)
        space->breaks[k] = 0.5 * (s->arc[k - 1] + s->arc[k]);
    space->breaks[s->n] = s->arc[s->n - 1];
    return s->n;
}

/* Two elements to each segment. */
static uint32_t double_breaks(struct convert_space *space)
{
    const struct spline *s = &space->spline;
    for (uint32_t k = 0; k + 1 < s->n; k++) {
        space->breaks[2 * k] = s->arc[k];
        space->breaks[2 * k + 1] = 0.5 * (s->arc[k] + s->arc[k + 1]);
    }
    space->breaks[2 * s->n - 2] = s->arc[s->n - 1];
    return 2 * s->n - 2;
}

/* --- the closed form --------------------------------------------------------------------- */

/* Eq. 9, k the axis farthest from the tangent. */
static mat3 root_frame(vec3 t)
{
    double x = fabs(t.x), y = fabs(t.y), z = fabs(t.z);
    vec3 k = {0.0, 0.0, 0.0};
    if (x <= y && x <= z)
        k.x = 1.0;
    else if (y <= z)
        k.y = 1.0;
    else
        k.z = 1.0;
    vec3 u = vec_cross(k, t);
    u = vec_scale(1.0 / sqrt(vec_dot(u, u)), u);
    return (mat3){t, u, vec_cross(t, u)};
}

static void place_vertices(const struct convert_space *space, struct refine_strand *strand, uint32_t n_vertices)
{
    const double *arc = space->spline.arc;
    uint32_t j = 0;
    for (uint32_t k = 0; k < n_vertices; k++) {
        double s = arc[space->knot[k]];
        while (j + 1 < strand->n_elements && s > space->breaks[j + 1])
            j++;
        double part = (s - space->breaks[j]) / (space->breaks[j + 1] - space->breaks[j]);
        strand->element[k] = j;
        strand->fraction[k] = part > 0.0 ? fmin(part, 1.0) : 0.0;
    }
}

/* Where bending changes sides, the helix through a pair may go once round an axis that it hardly leaves: right
 * at both ends, a turn too many between. An element that turns by more than half a circle and by far more than
 * the strand does in the mean is taken as a plain arc. */
static void take_out_loops(struct convert_space *space, struct refine_strand *strand, uint32_t n)
{
    double usual = -1.0;
    for (uint32_t j = 0; j < n; j++) {
        vec3 omega = vec_of(strand->q[j]);
        double turn = sqrt(vec_dot(omega, omega)) * strand->length[j];
        if (turn <= M_PI)
            continue;
        if (usual < 0.0)
            usual = 2.0 * M_PI * count_turns(&space->spline) / n;
        vec3 way = vec_sub(space->p[j + 1], space->p[j]);
        struct helix arc = helix_plain_arc(sqrt(vec_dot(way, way)), space->t[j], space->t[j + 1]);
        if (turn > LOOP_EXCESS * usual) {
            vec_store(arc.omega, strand->q[j]);
            strand->length[j] = arc.length;
        }
    }
}

/* Darboux vectors in the world (in q) to those in the material frame, which is carried along. */
static void into_frames(const struct trig_rows *trig, struct refine_strand *strand, uint32_t n)
{
    mat3 F = strand->root;
    for (uint32_t j = 0; j < n; j++) {
        vec3 theta = vec_scale(strand->length[j], vec_of(strand->q[j]));
        trig->x[j] = vec_dot(theta, theta);
    }
    memset(trig->x + n, 0, 3 * sizeof *trig->x);
    trig_rows(trig, n);
    for (uint32_t j = 0; j < n; j++) {
        vec3 omega = vec_of(strand->q[j]), theta = vec_scale(strand->length[j], omega);
        vec_store(mat_transposed_vec(F, omega), strand->q[j]);
        F = mat_mul(element_turn(trig->A[j], trig->B[j], trig->x[j], theta), F);
    }
}

/* Floating tangents on the breaks, then one helix after the other. */
static void closed_form(struct convert_space *space, struct refine_strand *strand, uint32_t n)
{
    spline_at(&space->spline, space->breaks, n + 1, space->p, space->t);
    helix_float_points(n, space->p, space->t, space->work);
    helix_chain(n, (const double (*)[3])space->p, (const double (*)[3])space->t, strand->q, strand->length);
    take_out_loops(space, strand, n);
    strand->root = root_frame(space->t[0]);
    into_frames(&space->refine.trig, strand, n);
}

/* Fit n elements on the breaks at hand into fits[which]. */
static void fit_breaks(struct convert_space *space, uint32_t which, uint32_t n, uint32_t n_vertices,
                       uint32_t n_steps, double tolerance)
{
    struct convert_fit *fit = &space->fits[which];
    fit->strand.n_elements = n;
    fit->strand.n_vertices = n_vertices;
    fit->strand.vertex = space->vertex;
    closed_form(space, &fit->strand, n);
    place_vertices(space, &fit->strand, n_vertices);
    fit->sum = refine_fit(&fit->strand, &space->refine, n_steps, tolerance, &fit->worst);
}

/* --- corners ------------------------------------------------------------------------------- */

/* Corners take so little of a mean segment, and of each one. */
#define CORNER_SHARE 1e-3

struct walk {
    vec3 p;
    mat3 F;
    uint32_t n_elements;
};

static void walk_element(struct walk *w, struct refine_strand *strand, vec3 q, double length)
{
    vec_store(q, strand->q[w->n_elements]);
    strand->length[w->n_elements++] = length;
    struct chain_state end = chain_step((struct chain_state){w->p, w->F}, q, length);
    w->p = end.p;
    w->F = end.F;
}

/* Turn the tangent to where the knot lies, within a length that is next to nothing. */
static void walk_corner(struct walk *w, struct refine_strand *strand, vec3 to, double length)
{
    vec3 local = mat_transposed_vec(w->F, vec_sub(to, w->p)); /* forward, and aside */
    double aside = sqrt(local.y * local.y + local.z * local.z), angle = atan2(aside, local.x);
    vec3 axis = aside > 0.0 ? (vec3){0.0, -local.z / aside, local.y / aside} : (vec3){0.0, 1.0, 0.0};
    walk_element(w, strand, vec_scale(angle / length, axis), length);
}

/* The polyline as it is: a straight element for each segment, and between them short ones that turn. Each aims
 * anew, so that what a corner is long does not add up. For strands that fold back on themselves so
 * often that no smooth curve comes near. */
static void fit_corners(struct convert_space *space, uint32_t which, uint32_t n_vertices)
{
    const struct spline *s = &space->spline;
    struct refine_strand *strand = &space->fits[which].strand;
    double length = 0.0;
    for (uint32_t k = 0; k + 1 < s->n; k++)
        length += s->h[k];
    struct walk w = {.p = s->point[0]};
    vec3 t = vec_sub(s->point[1], s->point[0]);
    w.F = strand->root = root_frame(vec_scale(1.0 / s->h[0], t));
    for (uint32_t k = 0, v = 0; k + 1 < s->n; k++) {
        if (k)
            walk_corner(&w, strand, s->point[k + 1], CORNER_SHARE * fmin(s->h[k], length / (s->n - 1)));
        for (; v < n_vertices && space->knot[v] <= k + 1; v++) {
            strand->element[v] = w.n_elements;
            strand->fraction[v] = space->knot[v] == k + 1;
        }
        t = vec_sub(s->point[k + 1], w.p);
        walk_element(&w, strand, (vec3){0.0, 0.0, 0.0}, sqrt(vec_dot(t, t)));
    }
    strand->n_elements = w.n_elements;
    strand->n_vertices = n_vertices;
    strand->vertex = space->vertex;
    space->fits[which].sum = refine_fit(strand, &space->refine, 0, 0.0, &space->fits[which].worst);
}

/* --- how many elements -------------------------------------------------------------------- */

struct request {
    uint32_t n_vertices, n_flips, n_steps;
    double tolerance;
};

static int is_better(const struct convert_fit *a, const struct convert_fit *b)
{
    return a->worst < b->worst || !(b->worst < DBL_MAX);
}

/* Fit once more; the best so far is kept. */
static void attempt(struct convert_space *space, const struct request *r, uint32_t n)
{
    uint32_t which = space->best == &space->fits[0];
    fit_breaks(space, which, n, r->n_vertices, r->n_steps, r->tolerance);
    if (!space->best || is_better(&space->fits[which], space->best))
        space->best = &space->fits[which];
}

static void attempt_corners(struct convert_space *space, const struct request *r)
{
    uint32_t which = space->best == &space->fits[0];
    fit_corners(space, which, r->n_vertices);
    if (is_better(&space->fits[which], space->best))
        space->best = &space->fits[which];
}

static int is_met(const struct convert_space *space, const struct request *r)
{
    return space->best && space->best->worst <= r->tolerance;
}

/* The error falls with the second to third power of the count: less often asked than right is cheaper. */
static uint32_t next_count(uint32_t n, double excess)
{
    double more = n * fmin(fmax(pow(excess, 1.0 / 2.2), 1.15), 2.5);
    return (uint32_t)ceil(more) + 1;
}

/* Uniform breaks, more and more, up to one to a vertex. */
static void search_uniform(struct convert_space *space, const struct groom_conversion_options *options,
                           const struct request *r, uint32_t most)
{
    uint32_t n = (uint32_t)ceil(ELEMENTS_A_TURN * count_turns(&space->spline));
    n = n > options->min_elements ? n : options->min_elements;
    most = most < space->spline.n ? most : space->spline.n;
    struct request quick = *r; /* two steps tell whether so many elements will do */
    quick.n_steps = r->n_steps < 2 ? r->n_steps : 2;
    while (n < most && !is_met(space, r)) {
        uniform_breaks(space, n, r->n_flips);
        attempt(space, &quick, n);
        n = next_count(n, space->best->worst / r->tolerance);
    }
}

static void search_count(struct convert_space *space, const struct groom_conversion_options *options,
                         const struct request *r)
{
    uint32_t knots = space->spline.n, most = convert_max_elements(options, r->n_vertices);
    search_uniform(space, options, r, most);
    if (!is_met(space, r) && knots <= most && knots >= options->min_elements)
        attempt(space, r, middle_breaks(space));
    if (!is_met(space, r) && 2 * knots - 2 <= most && 2 * knots - 2 >= options->min_elements)
        attempt(space, r, double_breaks(space));
    if (!is_met(space, r)) {
        uniform_breaks(space, most, r->n_flips);
        attempt(space, r, most);
    }
    if (space->best->worst > CORNERS_BEYOND * r->tolerance && 2 * knots - 3 <= most &&
        2 * knots - 3 >= options->min_elements)
        attempt_corners(space, r);
}

/* --- one strand ----------------------------------------------------------------------------- */

static void stand_in(struct convert_space *space, uint32_t n_vertices)
{
    struct refine_strand *strand = &space->fits[0].strand;
    space->best = &space->fits[0];
    strand->n_elements = 1;
    strand->n_vertices = n_vertices;
    strand->root = root_frame((vec3){0.0, 1.0, 0.0});
    strand->length[0] = 0.0;
    memset(strand->q, 0, sizeof *strand->q);
    memset(strand->element, 0, n_vertices * sizeof *strand->element);
    memset(strand->fraction, 0, n_vertices * sizeof *strand->fraction);
    memset(strand->fitted, 0, n_vertices * sizeof *strand->fitted);
    space->best->sum = space->best->worst = 0.0;
}

static double polyline_length(const vec3 *p, uint32_t n)
{
    double sum = 0.0;
    for (uint32_t k = 1; k < n; k++) {
        vec3 d = vec_sub(p[k], p[k - 1]);
        sum += sqrt(vec_dot(d, d));
    }
    return sum;
}

static void fill_report(const struct convert_space *space, double length, uint32_t n_flips,
                        struct groom_conversion_report *report)
{
    const struct refine_strand *strand = &space->best->strand;
    double now = polyline_length(strand->fitted, strand->n_vertices);
    *report = (struct groom_conversion_report){
        .error_max_m = (float)space->best->worst,
        .error_rms_m = (float)sqrt(space->best->sum / strand->n_vertices),
        .length_change = length > 0.0 ? (float)(now / length - 1.0) : 0.0f,
        .n_elements = strand->n_elements,
        .n_flips = n_flips,
        .degenerate = space->spline.n < 2,
    };
}

void convert_strand(struct convert_space *space, const struct groom_conversion_options *options,
                    const float (*points)[3], uint32_t n, struct groom_conversion_report *report)
{
    struct request r = {.n_vertices = n, .n_steps = options->refinements};
    load(space, points, n);
    space->best = NULL;
    double length = polyline_length(space->vertex, n);
    if (space->spline.n < 2) {
        stand_in(space, n);
        fill_report(space, length, 0, report);
        return;
    }
    spline_solve(&space->spline);
    r.n_flips = find_flips(space);
    r.tolerance = options->tolerance_m > 0.0 ? options->tolerance_m : 0.01 * length / (space->spline.n - 1);
    if (options->n_elements) {
        uniform_breaks(space, options->n_elements, r.n_flips);
        attempt(space, &r, options->n_elements);
    } else {
        search_count(space, options, &r);
    }
    fill_report(space, length, r.n_flips, report);
}
