/* What kind of hair it is: Shi et al. 2026, Section 4 (Eqs. 12-14). */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "curvature/centre.h"
#include "curvature/chain.h"
#include "curvature/pieces.h"

/* A curl that is wider than this fills the last bin of the radius histogram. */
#define WIDEST_CURL_M 0.1

struct groom_analysis_options groom_analysis_options_default(void)
{
    return (struct groom_analysis_options){.n_samples = 65, .n_bins = 3, .straight_below = 5.0, .wavy_below = 0.5,
                                           .switchback_turn = M_PI};
}

/* --- elements ------------------------------------------------------------------------ */

/* Eq. 12 and the step; beta and kind come later. */
static struct groom_element_shape shape_of(const double q[3])
{
    double bend = q[1] * q[1] + q[2] * q[2], square = q[0] * q[0] + bend;
    struct groom_element_shape s = {.omega = INFINITY};
    if (square > 0.0) {
        s.radius_m = (float)(sqrt(bend) / square);
        s.step_m = (float)(2.0 * M_PI * q[0] / square);
        s.frequency = (float)(sqrt(square) / (2.0 * M_PI));
    }
    if (q[0] != 0.0)
        s.omega = (float)(square / q[0]);
    s.hand = (int8_t)((q[0] > 0.0) - (q[0] < 0.0));
    return s;
}

static uint8_t kind_of(const struct groom_element_shape *s, const struct groom_analysis_options *o)
{
    if (!((double)s->frequency >= o->straight_below))
        return GROOM_HAIR_STRAIGHT;
    return fabs((double)s->beta) <= o->wavy_below ? GROOM_HAIR_WAVY : GROOM_HAIR_COILED;
}

/* --- one strand ------------------------------------------------------------------------ */

struct analysis_space {
    double (*points)[3], (*centre)[3], *arc; /* [n_samples] */
};

struct tally;

struct analysis_job {
    const struct groom_superhelices *helices;
    const struct groom_analysis_options *options;
    struct groom_analysis *out;
    double *wave;
    struct analysis_space *spaces;
    uint32_t n_spaces;
    struct tally *tally;
};

/* Direction of the centre curve at a fraction of the arc: central differences at samples, between them
 * linear. */
static vec3 centre_slope(const double (*centre)[3], uint32_t n, uint32_t i)
{
    uint32_t a = i ? i - 1 : 0, b = i + 1 < n ? i + 1 : n - 1;
    return vec_scale(1.0 / (b - a), vec_sub(vec_of(centre[b]), vec_of(centre[a])));
}

static vec3 centre_direction(const double (*centre)[3], uint32_t n, double fraction)
{
    double at = fmin(fmax(fraction, 0.0), 1.0) * (n - 1);
    uint32_t i = (uint32_t)at < n - 1 ? (uint32_t)at : n - 2;
    vec3 a = centre_slope(centre, n, i), b = centre_slope(centre, n, i + 1);
    vec3 d = vec_add(vec_scale(1.0 - (at - i), a), vec_scale(at - i, b));
    double norm = sqrt(vec_dot(d, d));
    return vec_scale(norm > 0.0 ? 1.0 / norm : 0.0, d);
}

/* Eq. 14 with the centre curve's unit tangent, which is what bounds it by 1. */
static float beta_of(vec3 direction, vec3 omega)
{
    double norm = sqrt(vec_dot(omega, omega));
    return norm > 0.0 ? (float)(vec_dot(direction, omega) / norm) : 0.0f;
}

static void analyze_elements(const struct analysis_job *job, uint32_t i, const double (*centre)[3], double length)
{
    struct chain chain = chain_of(job->helices, i);
    struct chain_state at = chain.root;
    struct groom_element_shape *out = job->out->elements + job->helices->first[i];
    double begin = 0.0, turns = 0.0;
    for (uint32_t j = 0; j < chain.n; j++) {
        double l = chain.length[j], middle = length > 0.0 ? (begin + 0.5 * l) / length : 0.0;
        vec3 q = vec_of(chain.q[j]);
        out[j] = shape_of(chain.q[j]);
        out[j].beta = beta_of(centre_direction(centre, job->options->n_samples, middle), mat_vec(at.F, q));
        out[j].kind = kind_of(&out[j], job->options);
        turns += sqrt(vec_dot(q, q)) * l / (2.0 * M_PI);
        at = chain_step(at, q, l);
        begin += l;
    }
    job->out->turns[i] = (float)turns;
}

static void analyze_strand(const struct analysis_job *job, struct analysis_space *space, uint32_t i)
{
    uint32_t n = job->options->n_samples;
    double length = groom_superhelix_length(job->helices, i);
    for (uint32_t k = 0; k < n; k++)
        space->arc[k] = length * k / (n - 1);
    groom_superhelix_sample(job->helices, i, space->arc, n, space->points, NULL);
    centre_curve((const double (*)[3])space->points, n, job->options->n_bins, job->wave, space->centre);
    for (uint32_t k = 0; k < n; k++)
        for (int c = 0; c < 3; c++)
            job->out->centre[(size_t)i * n + k][c] = (float)space->centre[k][c];
    analyze_elements(job, i, (const double (*)[3])space->centre, length);
}

static void analyze_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct analysis_job *job = user;
    uint32_t begin, end;
    piece_bounds(job->helices->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++)
        analyze_strand(job, &job->spaces[thread], i);
}

/* --- switchbacks -------------------------------------------------------------------------- */

/* Runs of one hand; a run counts once it has wound far enough, and it is a switchback where the last
 * run that counted had the other hand. Writes to out unless NULL; returns how many. */
static uint32_t find_switchbacks(const struct groom_superhelices *h, const struct groom_element_shape *shapes,
                                 uint32_t i, double enough, struct groom_switchback *out)
{
    uint32_t n = 0, run_begin = 0;
    int hand = 0, run = 0;
    double wound = 0.0, arc = 0.0, run_arc = 0.0, length = groom_superhelix_length(h, i);
    for (uint32_t j = h->first[i]; j < h->first[i + 1]; arc += h->length[j++]) {
        int side = shapes[j].hand;
        if (side == 0)
            continue;
        if (side != run) {
            run = side, wound = 0.0;
            run_begin = j, run_arc = arc;
        }
        wound += 2.0 * M_PI * (double)shapes[j].frequency * h->length[j];
        if (wound < enough || run == hand)
            continue;
        if (hand != 0) {
            if (out)
                out[n] = (struct groom_switchback){i, run_begin - h->first[i], (float)(run_arc / length)};
            n++;
        }
        hand = run;
    }
    return n;
}

static groom_status list_switchbacks(const struct analysis_job *job, struct groom_diag *diag)
{
    struct groom_analysis *out = job->out;
    const struct groom_superhelices *h = job->helices;
    uint32_t n = 0;
    for (uint32_t i = 0; i < h->n_strands; i++)
        n += find_switchbacks(h, out->elements, i, job->options->switchback_turn, NULL);
    out->switchbacks = memory_array(out->allocator, n, sizeof *out->switchbacks);
    if (!out->switchbacks)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %u switchbacks", n);
    out->n_switchbacks = n;
    n = 0;
    for (uint32_t i = 0; i < h->n_strands; i++)
        n += find_switchbacks(h, out->elements, i, job->options->switchback_turn, out->switchbacks + n);
    return GROOM_OK;
}

/* --- summary --------------------------------------------------------------------------------- */

/* A pass over values with weights: sums for the mean, a fine histogram for where most of it ends. */
#define FINE_BINS 4096

struct tally {
    double limit, sum, weight;  /* values above limit count as it */
    double fine[FINE_BINS];
};

static void tally_add(struct tally *t, double value, double weight)
{
    double part = t->limit > 0.0 ? fmin(value / t->limit, 1.0) * FINE_BINS : 0.0;
    t->sum += weight * value;
    t->weight += weight;
    t->fine[part < FINE_BINS ? (int)part : FINE_BINS - 1] += weight;
}

/* The upper end of a histogram that a few wild values do not press flat. */
static double tally_most(const struct tally *t)
{
    double below = 0.0;
    int k = 0;
    for (; k < FINE_BINS; k++)
        if ((below += t->fine[k]) >= 0.98 * t->weight)
            break;
    return t->limit * fmin((k + 1.0) / FINE_BINS, 1.0);
}

static void count(struct groom_histogram *h, double value, double weight)
{
    double part = h->high > h->low ? (value - h->low) / (h->high - h->low) : 0.0;
    int bin = (int)(fmin(fmax(part, 0.0), 1.0) * GROOM_HISTOGRAM_BINS);
    h->weight[bin < GROOM_HISTOGRAM_BINS ? bin : GROOM_HISTOGRAM_BINS - 1] += weight;
}

/* One number of each element (or strand, with h NULL) that counts. */
typedef double measured(const struct groom_analysis *out, uint32_t j);
static double radius_of(const struct groom_analysis *out, uint32_t j) { return (double)out->elements[j].radius_m; }
static double frequency_of(const struct groom_analysis *out, uint32_t j) { return (double)out->elements[j].frequency; }
static double turns_of(const struct groom_analysis *out, uint32_t i) { return (double)out->turns[i]; }

static double weight_of(const struct groom_superhelices *h, const struct groom_analysis *out, uint32_t j)
{
    return !h ? 1.0 : out->elements[j].kind == GROOM_HAIR_STRAIGHT ? 0.0 : h->length[j];
}

/* Fills a histogram and the mean; values above `limit` lie in the last bin in any case. */
static void distribution(const struct groom_superhelices *h, const struct groom_analysis *out, measured *value,
                         double limit, struct tally *t, struct groom_histogram *histogram, double *mean)
{
    uint32_t n = h ? out->n_elements : out->n_strands;
    double widest = 0.0;
    for (uint32_t j = 0; j < n; j++)
        if (weight_of(h, out, j) > 0.0)
            widest = fmax(widest, value(out, j));
    *t = (struct tally){.limit = fmin(widest, limit)};
    for (uint32_t j = 0; j < n; j++)
        if (weight_of(h, out, j) > 0.0)
            tally_add(t, value(out, j), weight_of(h, out, j));
    *mean = t->weight > 0.0 ? t->sum / t->weight : 0.0;
    histogram->high = tally_most(t);
    for (uint32_t j = 0; j < n; j++)
        if (weight_of(h, out, j) > 0.0)
            count(histogram, value(out, j), weight_of(h, out, j));
}

static void share_length(const struct groom_superhelices *h, struct groom_analysis *out)
{
    double by_kind[3] = {0.0, 0.0, 0.0}, by_hand[3] = {0.0, 0.0, 0.0};
    for (uint32_t j = 0; j < h->n_elements; j++) {
        by_kind[out->elements[j].kind] += h->length[j];
        if (out->elements[j].kind != GROOM_HAIR_STRAIGHT)
            by_hand[out->elements[j].hand + 1] += h->length[j];
    }
    double length = out->summary.length_m = by_kind[0] + by_kind[1] + by_kind[2];
    double winding = by_hand[0] + by_hand[1] + by_hand[2];
    for (int k = 0; k < 3; k++) {
        out->summary.share[k] = length > 0.0 ? by_kind[k] / length : 0.0;
        out->summary.share_hand[k] = winding > 0.0 ? by_hand[k] / winding : 0.0;
    }
}

static void summarize(const struct groom_superhelices *h, struct groom_analysis *out, struct tally *t)
{
    share_length(h, out);
    distribution(h, out, radius_of, WIDEST_CURL_M, t, &out->summary.radius, &out->summary.radius_mean_m);
    distribution(h, out, frequency_of, INFINITY, t, &out->summary.frequency, &out->summary.frequency_mean);
    distribution(NULL, out, turns_of, INFINITY, t, &out->summary.turns, &out->summary.turns_mean);
}

/* --- the whole -------------------------------------------------------------------------------- */

void groom_analysis_destroy(struct groom_analysis *a)
{
    if (!a)
        return;
    memory_release(a->allocator, a->first, (size_t)a->n_strands + 1, sizeof *a->first);
    memory_release(a->allocator, a->elements, a->n_elements, sizeof *a->elements);
    memory_release(a->allocator, a->centre, (size_t)a->n_strands * a->n_samples, sizeof *a->centre);
    memory_release(a->allocator, a->turns, a->n_strands, sizeof *a->turns);
    memory_release(a->allocator, a->switchbacks, a->n_switchbacks, sizeof *a->switchbacks);
    memory_release(a->allocator, a, 1, sizeof *a);
}

static groom_status check_options(const struct groom_analysis_options *o, struct groom_diag *diag)
{
    if (o->n_samples < 3 || o->n_samples > 4096)
        return groom_fail_field(diag, GROOM_EINVAL, "/samples", "%u samples: 3..4096 are possible", o->n_samples);
    if (o->n_bins < 1 || o->n_bins > 8)
        return groom_fail_field(diag, GROOM_EINVAL, "/bins", "%u bins: 1..8 are possible", o->n_bins);
    return GROOM_OK;
}

static struct groom_analysis *create_analysis(const struct groom_superhelices *h, uint32_t n_samples,
                                              const struct groom_allocator *a)
{
    struct groom_analysis *out = memory_array_zero(a, 1, sizeof *out);
    if (!out)
        return NULL;
    out->allocator = a;
    out->n_strands = h->n_strands;
    out->n_elements = h->n_elements;
    out->n_samples = n_samples;
    out->first = memory_array(a, (size_t)h->n_strands + 1, sizeof *out->first);
    out->elements = memory_array(a, h->n_elements, sizeof *out->elements);
    out->centre = memory_array(a, (size_t)h->n_strands * n_samples, sizeof *out->centre);
    out->turns = memory_array(a, h->n_strands, sizeof *out->turns);
    if (!out->first || !out->elements || !out->centre || !out->turns) {
        groom_analysis_destroy(out);
        return NULL;
    }
    memcpy(out->first, h->first, ((size_t)h->n_strands + 1) * sizeof *out->first);
    return out;
}

static int job_init(struct analysis_job *job, const struct groom_context *context)
{
    const struct groom_allocator *a = memory_allocator(context);
    uint32_t n = job->options->n_samples;
    job->n_spaces = parallel_threads(context);
    job->out = create_analysis(job->helices, n, a);
    job->wave = memory_array(a, 2 * (size_t)n, sizeof *job->wave);
    job->spaces = memory_array_zero(a, job->n_spaces, sizeof *job->spaces);
    job->tally = memory_array(a, 1, sizeof *job->tally);
    int good = job->out && job->wave && job->spaces && job->tally;
    for (uint32_t k = 0; good && k < job->n_spaces; k++) {
        struct analysis_space *s = &job->spaces[k];
        s->points = memory_array(a, n, sizeof *s->points);
        s->centre = memory_array(a, n, sizeof *s->centre);
        s->arc = memory_array(a, n, sizeof *s->arc);
        good = s->points && s->centre && s->arc;
    }
    return good;
}

static void job_finish(struct analysis_job *job, const struct groom_context *context)
{
    const struct groom_allocator *a = memory_allocator(context);
    uint32_t n = job->options->n_samples;
    for (uint32_t k = 0; job->spaces && k < job->n_spaces; k++) {
        memory_release(a, job->spaces[k].points, n, sizeof *job->spaces[k].points);
        memory_release(a, job->spaces[k].centre, n, sizeof *job->spaces[k].centre);
        memory_release(a, job->spaces[k].arc, n, sizeof *job->spaces[k].arc);
    }
    memory_release(a, job->spaces, job->n_spaces, sizeof *job->spaces);
    memory_release(a, job->wave, 2 * (size_t)n, sizeof *job->wave);
    memory_release(a, job->tally, 1, sizeof *job->tally);
    groom_analysis_destroy(job->out);
}

groom_status groom_superhelices_analyze(const struct groom_superhelices *helices,
                                        const struct groom_analysis_options *options,
                                        const struct groom_context *context, struct groom_analysis **analysis,
                                        struct groom_diag *diag)
{
    struct analysis_job job = {.helices = helices, .options = options};
    groom_status st = check_options(options, diag);
    if (st != GROOM_OK)
        return st;
    if (!job_init(&job, context)) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to analyse %u strands", helices->n_strands);
        goto out;
    }
    centre_wave(options->n_samples, job.wave);
    parallel_for(context, piece_count(helices->n_strands), analyze_piece, &job);
    if ((st = list_switchbacks(&job, diag)) != GROOM_OK)
        goto out;
    summarize(helices, job.out, job.tally);
    *analysis = job.out;
    job.out = NULL;
out:
    job_finish(&job, context);
    return st;
}

/* --- stations to elements ------------------------------------------------------------------------ */

struct lookup_job {
    const struct groom_superhelices *helices;
    const uint32_t *first;
    const float *at;
    uint32_t *out;
};

static void lookup_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct lookup_job *job = user;
    const struct groom_superhelices *h = job->helices;
    uint32_t begin, end;
    (void)thread;
    piece_bounds(h->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++) {
        double length = groom_superhelix_length(h, i), passed = 0.0;
        uint32_t j = h->first[i];
        for (uint32_t k = job->first[i]; k < job->first[i + 1]; k++) {
            double s = (double)job->at[k] * length;
            if (s < passed)
                j = h->first[i], passed = 0.0;
            while (j + 1 < h->first[i + 1] && s >= passed + h->length[j])
                passed += h->length[j++];
            job->out[k] = j;
        }
    }
}

void groom_superhelices_elements_at(const struct groom_superhelices *helices, const uint32_t *first, const float *at,
                                    uint32_t *out, const struct groom_context *context)
{
    struct lookup_job job = {helices, first, at, out};
    parallel_for(context, piece_count(helices->n_strands), lookup_piece, &job);
}
