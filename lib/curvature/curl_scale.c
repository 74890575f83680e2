/* Expand and shrink curls: each element's helix has a radius r = kappa/|Omega|^2 and a rise a radian
 * h = tau/|Omega|^2 (Eq. 12); scaled, they give kappa = r/(r^2 + h^2) and tau = h/(r^2 + h^2). */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "curvature/chain.h"
#include "curvature/pieces.h"

struct groom_curl_scale_options groom_curl_scale_options_default(void)
{
    return (struct groom_curl_scale_options){.radius = 1.0, .step = 1.0, .ramp = {1.0, 1.0}, .hold_direction = 1};
}

struct curl_job {
    struct groom_superhelices *helices;
    const struct groom_curl_scale_options *options;
};

/* Scale one element by these factors; how much faster it winds then. 1 where it is no curl. */
static double scale_element(double q[3], double radius, double step, double largest)
{
    double bend = sqrt(q[1] * q[1] + q[2] * q[2]), square = q[0] * q[0] + bend * bend;
    if (!(bend > 0.0))
        return 1.0;
    double r = bend / square, h = q[0] / square;
    if (largest > 0.0 && r > largest)
        return 1.0;
    double r2 = r * radius, h2 = h * step, now = r2 * r2 + h2 * h2;
    double bend_factor = r2 / now / bend;
    q[0] = h2 / now;
    q[1] *= bend_factor;
    q[2] *= bend_factor;
    return sqrt((r * r + h * h) / now);
}

static vec3 tip_of(const struct chain *chain)
{
    struct chain_state at = {{0.0, 0.0, 0.0}, chain->root.F};
    for (uint32_t j = 0; j < chain->n; j++)
        at = chain_step(at, vec_of(chain->q[j]), chain->length[j]);
    return at.p;
}

/* Turn the root frame the short way so that the tip is seen from the root where it was. */
static void hold_direction(struct groom_superhelices *h, uint32_t i, vec3 was)
{
    struct chain chain = chain_of(h, i);
    vec3 is = tip_of(&chain), axis = vec_cross(is, was);
    double sine = sqrt(vec_dot(axis, axis)), angle = atan2(sine, vec_dot(is, was));
    if (!(sine > 0.0))
        return;
    vec3 w = vec_scale(angle / sine, axis);
    double x = vec_dot(w, w);
    trig3 f = trig3_of(x);
    mat_store(frame_mend(mat_mul(element_turn(f.A, f.B, x, w), chain.root.F)), h->frame[i]);
}

static void scale_strand(const struct curl_job *job, uint32_t i)
{
    struct groom_superhelices *h = job->helices;
    const struct groom_curl_scale_options *o = job->options;
    double length = groom_superhelix_length(h, i), weight = o->weight ? (double)o->weight[i] : 1.0, begin = 0.0;
    struct chain chain = chain_of(h, i);
    vec3 tip = tip_of(&chain);
    for (uint32_t j = h->first[i]; j < h->first[i + 1]; j++) {
        double l = h->length[j], at = length > 0.0 ? (begin + 0.5 * l) / length : 0.0;
        double share = weight * (o->ramp[0] + at * (o->ramp[1] - o->ramp[0]));
        double faster = scale_element(h->q[j], pow(o->radius, share), pow(o->step, share), o->largest_radius_m);
        if (o->keep == GROOM_CURL_KEEP_TURNS)
            h->length[j] = l / faster;
        begin += l;
    }
    if (o->hold_direction)
        hold_direction(h, i, tip);
}

static void scale_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct curl_job *job = user;
    uint32_t begin, end;
    (void)thread;
    piece_bounds(job->helices->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++)
        scale_strand(job, i);
}

static int is_share(double x) { return x >= 0.0 && x <= 1.0; }

static groom_status check_options(const struct groom_superhelices *h, const struct groom_curl_scale_options *o,
                                  struct groom_diag *diag)
{
    if (!(o->radius >= 0.01 && o->radius <= 100.0))
        return groom_fail_field(diag, GROOM_EINVAL, "/radius", "the radius factor is %g: 0.01..100 are possible", o->radius);
    if (!(o->step >= 0.01 && o->step <= 100.0))
        return groom_fail_field(diag, GROOM_EINVAL, "/step", "the step factor is %g: 0.01..100 are possible", o->step);
    if (!is_share(o->ramp[0]) || !is_share(o->ramp[1]))
        return groom_fail_field(diag, GROOM_EINVAL, "/ramp", "the ramp runs from %g to %g: both must lie in 0..1",
                                o->ramp[0], o->ramp[1]);
    for (uint32_t i = 0; o->weight && i < h->n_strands; i++)
        if (!is_share((double)o->weight[i]))
            return groom_fail_field(diag, GROOM_EINVAL, "/weight", "the weight of strand %u is %g: it must lie in 0..1", i,
                                    (double)o->weight[i]);
    return GROOM_OK;
}

groom_status groom_superhelices_scale_curls(struct groom_superhelices *helices,
                                            const struct groom_curl_scale_options *options,
                                            const struct groom_context *context, struct groom_diag *diag)
{
    struct curl_job job = {helices, options};
    groom_status st = check_options(helices, options, diag);
    if (st == GROOM_OK)
        parallel_for(context, piece_count(helices->n_strands), scale_piece, &job);
    return st;
}
