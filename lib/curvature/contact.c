/* Sculpted strands and the head: the paper has no contact; here what entered the surface is pushed out
 * by anchors of its own, or told. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "curvature/pieces.h"
#include "groom/curvature.h"
#include "groom/spatial.h"

#define MOST_PUSHES GROOM_CONTACT_MOST_HELD

struct groom_contact_options groom_contact_options_default(void)
{
    return (struct groom_contact_options){.n_samples = 32, .max_rounds = 8, .root_share = 0.05, .margin_m = 0.001};
}

/* A station that is held outside: moved on each time it is found inside again. */
struct push {
    uint32_t station;
    double target[3];
};

/* The least deep of all that was tried for a strand, and what held it there. */
struct best {
    float depth;
    uint8_t n_pushes;
    struct push pushes[MOST_PUSHES];
};

struct contact_space {
    double *arc, (*points)[3]; /* [n_samples] */
};

struct contact_job {
    struct groom_superhelices *helices;
    const struct groom_bvh *bvh;
    const struct groom_contact_options *options;
    struct groom_contact_report *reports;
    float *allowed;         /* [n_strands][n_samples] depth that the rest shape has there already */
    struct push *pushes;    /* [n_strands][MOST_PUSHES] */
    uint8_t *n_pushes;      /* [n_strands] */
    struct best *best;      /* [n_strands] */
    double (*best_q)[3];    /* [n_elements] */
    struct contact_space *spaces;
    uint32_t n_spaces, round;
};

/* --- depth ------------------------------------------------------------------------------ */

/* Depth of a point below the surface; negative outside. Nearest surface point and its outward normal. */
static double depth_of(const struct groom_bvh *bvh, const double p[3], struct groom_surface_point *near)
{
    const float point[3] = {(float)p[0], (float)p[1], (float)p[2]};
    if (!groom_bvh_closest(bvh, point, INFINITY, near))
        return -INFINITY;
    double along = 0.0;
    for (int c = 0; c < 3; c++)
        along += (p[c] - (double)near->position[c]) * (double)near->normal[c];
    /* the pseudo-normal tells the side cheaply; the winding number, which bad meshes cannot fool,
     * confirms an entry */
    return along < 0.0 && groom_bvh_inside(bvh, point) ? (double)near->distance : -(double)near->distance;
}

static void sample(const struct contact_job *job, struct contact_space *space, uint32_t i)
{
    uint32_t n = job->options->n_samples;
    double length = groom_superhelix_length(job->helices, i);
    for (uint32_t k = 0; k < n; k++)
        space->arc[k] = length * (job->options->root_share + (1.0 - job->options->root_share) * k / (n - 1));
    groom_superhelix_sample(job->helices, i, space->arc, n, space->points, NULL);
}

/* Depth changes no faster than arc length: from a point well outside the next stations need not be asked. */
static uint32_t next_station(const struct contact_space *space, uint32_t k, uint32_t n, double depth)
{
    double free_until = space->arc[k] - depth;
    uint32_t next = k + 1;
    while (depth < 0.0 && next < n && space->arc[next] < free_until)
        next++;
    return next;
}

/* --- before: what was inside already may stay so --------------------------------------------- */

static void allow_strand(const struct contact_job *job, struct contact_space *space, uint32_t i)
{
    uint32_t n = job->options->n_samples, next;
    float *allowed = job->allowed + (size_t)i * n;
    struct groom_surface_point near;
    memset(allowed, 0, n * sizeof *allowed);
    sample(job, space, i);
    for (uint32_t k = 0; k < n; k = next) {
        double depth = depth_of(job->bvh, space->points[k], &near);
        allowed[k] = depth > 0.0 ? (float)depth : 0.0f;
        next = next_station(space, k, n, depth);
    }
}

static void allow_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct contact_job *job = user;
    uint32_t begin, end;
    piece_bounds(job->helices->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++)
        if (job->reports[i].checked)
            allow_strand(job, &job->spaces[thread], i);
}

/* --- after: what entered -------------------------------------------------------------------------- */

/* Hold a station outside: as far above the surface as it was found below it, and the margin. */
static void add_push(const struct contact_job *job, uint32_t i, uint32_t station,
                     const struct groom_surface_point *near, double depth)
{
    struct push *pushes = job->pushes + (size_t)i * MOST_PUSHES;
    uint32_t at = 0;
    while (at < job->n_pushes[i] && pushes[at].station != station)
        at++;
    if (at == MOST_PUSHES)
        return;
    int known = at < job->n_pushes[i];
    for (int c = 0; c < 3; c++) {
        double normal = (double)near->normal[c];
        if (known) /* it gave way: aim higher by what is missing */
            pushes[at].target[c] += 1.5 * (depth + job->options->margin_m) * normal;
        else
            pushes[at].target[c] = (double)near->position[c] + (job->options->margin_m + 0.5 * depth) * normal;
    }
    pushes[at].station = station;
    job->n_pushes[i] += !known;
}

/* The deepest station of each run inside gets a push. returns the depth of the deepest */
static double push_strand(const struct contact_job *job, struct contact_space *space, uint32_t i)
{
    uint32_t n = job->options->n_samples, next, worst_station = 0;
    const float *allowed = job->allowed + (size_t)i * n;
    struct groom_surface_point near, worst = {0};
    double most = 0.0, deepest = 0.0;
    for (uint32_t k = 0; k < n; k = next) {
        double depth = depth_of(job->bvh, space->points[k], &near), excess = depth - (double)allowed[k];
        next = next_station(space, k, n, depth);
        if (depth > 0.0 && excess > most)
            most = excess, worst = near, worst_station = k;
        if (most > 0.0 && (depth <= 0.0 || next >= n)) {
            add_push(job, i, worst_station, &worst, most);
            deepest = most > deepest ? most : deepest;
            most = 0.0;
        }
    }
    return deepest;
}

/* A push may turn a strand into the head somewhere else: what is kept is the best of all rounds. */
static void find_strand(const struct contact_job *job, struct contact_space *space, uint32_t i)
{
    const struct groom_superhelices *h = job->helices;
    struct groom_contact_report *r = &job->reports[i];
    struct best now = {.n_pushes = job->n_pushes[i]};
    memcpy(now.pushes, job->pushes + (size_t)i * MOST_PUSHES, sizeof now.pushes);
    sample(job, space, i);
    double deepest = push_strand(job, space, i);
    now.depth = (float)deepest;
    if (job->round == 0 || now.depth < job->best[i].depth) {
        job->best[i] = now;
        memcpy(job->best_q + h->first[i], h->q + h->first[i], (h->first[i + 1] - h->first[i]) * sizeof *h->q);
    }
    if (job->round == 0)
        r->depth_before_m = (float)deepest;
    r->depth_after_m = (float)deepest;
}

static void find_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct contact_job *job = user;
    uint32_t begin, end;
    piece_bounds(job->helices->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++)
        if (job->reports[i].checked && (job->round == 0 || job->reports[i].depth_after_m > 0.0f))
            find_strand(job, &job->spaces[thread], i);
}

/* --- rounds ---------------------------------------------------------------------------------------- */

static size_t count_inside(const struct contact_job *job)
{
    size_t n = 0;
    for (uint32_t i = 0; i < job->helices->n_strands; i++)
        n += job->reports[i].depth_after_m > 0.0f;
    return n;
}

/* The caller's anchors and the pushes, of strands that are inside now. */
static size_t gather_anchors(const struct contact_job *job, const struct groom_anchor *anchors, size_t n_anchors,
                             struct groom_anchor *out)
{
    uint32_t n_samples = job->options->n_samples;
    double share = job->options->root_share;
    size_t n = 0;
    for (size_t k = 0; k < n_anchors; k++)
        if (job->reports[anchors[k].strand].depth_after_m > 0.0f)
            out[n++] = anchors[k];
    for (uint32_t i = 0; i < job->helices->n_strands; i++)
        for (uint32_t k = 0; job->reports[i].depth_after_m > 0.0f && k < job->n_pushes[i]; k++) {
            const struct push *p = &job->pushes[(size_t)i * MOST_PUSHES + k];
            out[n] = (struct groom_anchor){.strand = i, .at = share + (1.0 - share) * p->station / (n_samples - 1)};
            memcpy(out[n++].position, p->target, sizeof p->target);
        }
    return n;
}

/* Each strand at its best, and what held it there. */
static void keep_best(const struct contact_job *job)
{
    struct groom_superhelices *h = job->helices;
    double share = job->options->root_share;
    for (uint32_t i = 0; i < h->n_strands; i++) {
        struct groom_contact_report *r = &job->reports[i];
        if (!r->checked)
            continue;
        memcpy(h->q + h->first[i], job->best_q + h->first[i], (h->first[i + 1] - h->first[i]) * sizeof *h->q);
        r->depth_after_m = job->best[i].depth;
        for (uint32_t k = 0; k < job->best[i].n_pushes; k++) {
            const struct push *p = &job->best[i].pushes[k];
            r->held[k].at = (float)(share + (1.0 - share) * p->station / (job->options->n_samples - 1));
            for (int c = 0; c < 3; c++)
                r->held[k].position[c] = (float)p->target[c];
            r->n_held = k + 1;
        }
    }
}

/* Each round begins where the first did: what comes out then depends on the anchors alone, so that who
 * has kept what held a strand gets the same strand again. */
static void start_again(const struct contact_job *job, const double (*rest_q)[3])
{
    struct groom_superhelices *h = job->helices;
    for (uint32_t i = 0; i < h->n_strands; i++)
        if (job->reports[i].depth_after_m > 0.0f)
            memcpy(h->q + h->first[i], rest_q + h->first[i], (h->first[i + 1] - h->first[i]) * sizeof *h->q);
}

static int job_init(struct contact_job *job, const struct groom_context *context)
{
    const struct groom_allocator *a = memory_allocator(context);
    size_t n = job->helices->n_strands, m = job->options->n_samples;
    job->n_spaces = parallel_threads(context);
    job->allowed = memory_array_zero(a, n * m, sizeof *job->allowed);
    job->pushes = memory_array_zero(a, n * MOST_PUSHES, sizeof *job->pushes);
    job->best = memory_array(a, n, sizeof *job->best);
    job->best_q = memory_array(a, job->helices->n_elements, sizeof *job->best_q);
    job->n_pushes = memory_array_zero(a, n, sizeof *job->n_pushes);
    job->reports = memory_array_zero(a, n, sizeof *job->reports);
    job->spaces = memory_array_zero(a, job->n_spaces, sizeof *job->spaces);
    int good = job->allowed && job->pushes && job->best && job->best_q && job->n_pushes && job->reports && job->spaces;
    for (uint32_t k = 0; good && k < job->n_spaces; k++) {
        job->spaces[k].arc = memory_array(a, m, sizeof *job->spaces[k].arc);
        job->spaces[k].points = memory_array(a, m, sizeof *job->spaces[k].points);
        good = job->spaces[k].arc && job->spaces[k].points;
    }
    return good;
}

static void job_finish(struct contact_job *job, const struct groom_context *context)
{
    const struct groom_allocator *a = memory_allocator(context);
    size_t n = job->helices->n_strands, m = job->options->n_samples;
    for (uint32_t k = 0; job->spaces && k < job->n_spaces; k++) {
        memory_release(a, job->spaces[k].arc, m, sizeof *job->spaces[k].arc);
        memory_release(a, job->spaces[k].points, m, sizeof *job->spaces[k].points);
    }
    memory_release(a, job->spaces, job->n_spaces, sizeof *job->spaces);
    memory_release(a, job->allowed, n * m, sizeof *job->allowed);
    memory_release(a, job->pushes, n * MOST_PUSHES, sizeof *job->pushes);
    memory_release(a, job->best, n, sizeof *job->best);
    memory_release(a, job->best_q, job->helices->n_elements, sizeof *job->best_q);
    memory_release(a, job->n_pushes, n, sizeof *job->n_pushes);
    memory_release(a, job->reports, n, sizeof *job->reports);
}

/* Strands with anchors are the ones that a sculpt has moved. */
static void mark_checked(struct contact_job *job, const struct groom_anchor *anchors, size_t n_anchors)
{
    for (size_t k = 0; k < n_anchors; k++)
        job->reports[anchors[k].strand].checked = 1;
}

/* Measure the rest shape: the strands wear it for the while. */
static void measure_rest(struct contact_job *job, const double (*rest_q)[3], const struct groom_context *context)
{
    double(*now)[3] = job->helices->q;
    job->helices->q = (double (*)[3])rest_q; /* read only */
    parallel_for(context, piece_count(job->helices->n_strands), allow_piece, job);
    job->helices->q = now;
}

static groom_status check_input(const struct groom_superhelices *h, const struct groom_anchor *anchors, size_t n_anchors,
                                const struct groom_contact_options *o, struct groom_diag *diag)
{
    if (o->n_samples < 2 || o->n_samples > 4096 || !(o->root_share >= 0.0 && o->root_share < 1.0) ||
        !(o->margin_m >= 0.0) || !isfinite(o->margin_m))
        return groom_fail(diag, GROOM_EINVAL, "contact needs 2..4096 samples, a root share in 0..1 and a margin of 0 or more");
    for (size_t k = 0; k < n_anchors; k++)
        if (anchors[k].strand >= h->n_strands)
            return groom_fail(diag, GROOM_EINVAL, "anchor %zu is on strand %u; there are %u strands", k, anchors[k].strand,
                              h->n_strands);
    return GROOM_OK;
}

groom_status groom_superhelices_push_out(struct groom_superhelices *helices, const double (*rest_q)[3],
                                         const struct groom_anchor *anchors, size_t n_anchors,
                                         const struct groom_bvh *bvh, const struct groom_contact_options *options,
                                         const struct groom_sculpt_options *sculpt,
                                         const struct groom_context *context, struct groom_contact_report *reports,
                                         struct groom_diag *diag)
{
    const struct groom_allocator *a = memory_allocator(context);
    struct contact_job job = {.helices = helices, .bvh = bvh, .options = options};
    size_t n = helices->n_strands, most = n_anchors + n * MOST_PUSHES;
    struct groom_anchor *all = NULL;
    double(*kept)[3] = NULL;
    groom_status st = check_input(helices, anchors, n_anchors, options, diag);
    if (st != GROOM_OK)
        return st;
    all = memory_array(a, most, sizeof *all);
    kept = memory_array(a, helices->n_elements, sizeof *kept);
    if (!job_init(&job, context) || !all || !kept) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to check %zu strands against the head", n);
        goto out;
    }
    memcpy(kept, helices->q, helices->n_elements * sizeof *kept);
    mark_checked(&job, anchors, n_anchors);
    measure_rest(&job, rest_q, context);
    for (job.round = 0;; job.round++) {
        parallel_for(context, piece_count(helices->n_strands), find_piece, &job);
        if (job.round >= options->max_rounds || count_inside(&job) == 0)
            break;
        size_t m = gather_anchors(&job, anchors, n_anchors, all);
        start_again(&job, rest_q);
        if ((st = groom_superhelices_sculpt(helices, rest_q, all, m, sculpt, context, NULL, diag)) != GROOM_OK) {
            memcpy(helices->q, kept, helices->n_elements * sizeof *kept);
            goto out;
        }
    }
    keep_best(&job);
    memcpy(reports, job.reports, n * sizeof *reports);
out:
    job_finish(&job, context);
    memory_release(a, all, most, sizeof *all);
    memory_release(a, kept, helices->n_elements, sizeof *kept);
    return st;
}
