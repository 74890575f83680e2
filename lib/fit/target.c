/* The target of a fit: the capture's strands, joined to the scalp, resampled, centred, of size 1. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "fit/canonical.h"
#include "fit/head_frame.h"
#include "fit/head_planes.h"
#include "fit/outliers.h"
#include "fit/refine.h"
#include "fit/state.h"
#include "fit/unseen.h"
#include "groom/strands.h"

#define STRANDS_PER_PIECE 256

/* Metres on a head of ordinary size; scaled with the spread of the roots, so that a capture in a unit
 * that was named wrongly is treated alike. */
#define ORDINARY_ROOT_SPREAD 0.08 /* root mean square distance of roots from their mean */
#define JOIN_LEAST 1e-4           /* closer roots count as on the scalp */
#define JOIN_MOST 0.02            /* strands that start further off are left as they are */

static uint32_t pieces_of(uint32_t n) { return n / STRANDS_PER_PIECE + (n % STRANDS_PER_PIECE != 0); }

static uint32_t end_of(uint32_t piece, uint32_t n)
{
    return n - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE ? n : (piece + 1) * STRANDS_PER_PIECE;
}

/* --- what is refused ------------------------------------------------------------ */

static groom_status check_strands(const struct groom_strands *strands, struct groom_diag *diag)
{
    if (strands->n_strands == 0)
        return groom_fail(diag, GROOM_EEMPTY, "there is no strand to fit");
    for (uint32_t i = 0; i < strands->n_strands; i++) {
        uint32_t first = strands->first[i], end = strands->first[i + 1];
        if (end < first + 2)
            return groom_fail(diag, GROOM_EINVAL, "strand %u has %u vertices; 2 are the least", i, end - first);
        for (uint32_t v = first; v < end; v++)
            for (int c = 0; c < 3; c++)
                if (!isfinite(strands->points[v][c]))
                    return groom_fail(diag, GROOM_EINVAL, "vertex %u of strand %u is not finite", v - first, i);
    }
    return GROOM_OK;
}

/* --- sizes ------------------------------------------------------------------------- */

/* Points of strands, outliers left out; first NULL: m of each. */
struct cloud {
    const float (*points)[3];
    const uint32_t *first;
    uint32_t n, m;
    const unsigned char *outlier;
};

/* The mean of roots alone or of all points, and the root mean square distance from it. */
static double spread_of(const struct cloud *cloud, int roots_alone, double mean[3])
{
    double square = 0;
    size_t count = 0;
    mean[0] = mean[1] = mean[2] = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t i = 0; i < cloud->n; i++) {
            size_t begin = cloud->first ? cloud->first[i] : (size_t)i * cloud->m;
            size_t end = roots_alone ? begin + 1 : cloud->first ? cloud->first[i + 1] : begin + cloud->m;
            for (size_t v = begin; v < end && !cloud->outlier[i]; v++, count += pass == 0)
                for (int c = 0; c < 3; c++) {
                    double d = (double)cloud->points[v][c] - mean[c];
                    if (pass == 0)
                        mean[c] += (double)cloud->points[v][c];
                    else
                        square += d * d;
                }
        }
        for (int c = 0; c < 3 && pass == 0; c++)
            mean[c] /= (double)count;
    }
    return sqrt(square / (double)count);
}

static float ordinary_of(const struct groom_strands *strands, const unsigned char *outlier)
{
    struct cloud cloud = {(const float (*)[3])strands->points, strands->first, strands->n_strands, 0, outlier};
    double mean[3], roots = spread_of(&cloud, 1, mean), all = spread_of(&cloud, 0, mean);
    /* one place for all roots: hair is about twice as far from its middle as roots are from theirs */
    double spread = roots > 1e-3 * all ? roots : all / 2;
    return spread > 0 ? (float)(spread / ORDINARY_ROOT_SPREAD) : 1;
}

/* --- joining to the scalp --------------------------------------------------------------- */

struct joining {
    const struct groom_strands *in;
    struct groom_strands *out;    /* room for one vertex more a strand; used: count[i] */
    uint32_t *count;
    const struct groom_bvh *bvh;
    float least, most;            /* metres */
    unsigned char *joined;        /* [n] 0 on the scalp, 1 joined, 2 too far */
};

static float distance_between(const float a[3], const float b[3])
{
    float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrtf(x * x + y * y + z * z);
}

/* How many vertices at the root are inside the head and near enough to it to be left out. */
static uint32_t buried_vertices(const struct joining *job, const float (*points)[3], uint32_t n)
{
    uint32_t buried = 0;
    float walked = 0;
    while (buried + 1 < n && walked <= job->most && groom_bvh_inside(job->bvh, points[buried])) {
        walked += distance_between(points[buried], points[buried + 1]);
        buried++;
    }
    /* inside all along: the first one goes, so that the strand keeps its vertices */
    return walked <= job->most && buried + 1 < n ? buried : 1;
}

static void join_strand(const struct joining *job, uint32_t i)
{
    uint32_t n = job->in->first[i + 1] - job->in->first[i], skip = 0, begin = 0;
    const float (*points)[3] = (const float (*)[3])(job->in->points + job->in->first[i]);
    float (*out)[3] = job->out->points + job->in->first[i] + i;
    struct groom_surface_point scalp;

    job->joined[i] = 0;
    if (job->bvh) {
        if (!groom_bvh_closest(job->bvh, points[0], job->most, &scalp))
            job->joined[i] = 2;
        else if (scalp.distance > job->least)
            job->joined[i] = 1;
    }
    if (job->joined[i] == 1) {
        skip = groom_bvh_inside(job->bvh, points[0]) ? buried_vertices(job, points, n) : 0;
        memcpy(out[0], scalp.position, sizeof out[0]);
        begin = 1;
    }
    memcpy(out + begin, points + skip, (n - skip) * sizeof out[0]);
    job->count[i] = begin + n - skip;
}

static void join_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct joining *job = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < end_of(piece, job->in->n_strands); i++)
        join_strand(job, i);
}

/* Closes the gaps that strands shorter than their room leave. */
static void compact(struct groom_strands *out, const struct groom_strands *in, const uint32_t *count)
{
    uint32_t at = 0;
    for (uint32_t i = 0; i < in->n_strands; i++) {
        memmove(out->points + at, out->points + in->first[i] + i, count[i] * sizeof out->points[0]);
        out->first[i] = at;
        at += count[i];
    }
    out->first[in->n_strands] = at;
}

/* out is a container of its own whose arrays have room for more than out->first says. */
static groom_status join_to_scalp(struct groom_fit *fit, const struct groom_strands *strands,
                                  const struct groom_context *context, struct groom_strands **out,
                                  struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = strands->n_strands;
    struct joining job = {.in = strands, .bvh = fit->bvh, .least = (float)JOIN_LEAST * fit->ordinary,
                          .most = (float)JOIN_MOST * fit->ordinary};
    groom_status st = groom_strands_create(n, (uint64_t)strands->n_vertices + n, context, &job.out, diag);
    if (st != GROOM_OK)
        return st;
    job.count = memory_array(allocator, n, sizeof *job.count);
    job.joined = memory_array(allocator, n, sizeof *job.joined);
    if (!job.count || !job.joined) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to join %u strands to the scalp", n);
        goto out;
    }
    parallel_for(context, pieces_of(n), join_piece, &job);
    compact(job.out, strands, job.count);
    for (uint32_t i = 0; i < n; i++) {
        fit->report.n_joined += job.joined[i] == 1;
        fit->report.n_detached += job.joined[i] == 2;
    }
    *out = job.out;
    job.out = NULL;
out:
    memory_release(allocator, job.count, n, sizeof *job.count);
    memory_release(allocator, job.joined, n, sizeof *job.joined);
    groom_strands_destroy(job.out);
    return st;
}

/* --- the frame of the target --------------------------------------------------------------- */

static void normalize_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct groom_fit *fit = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < end_of(piece, fit->n); i++)
        for (uint32_t j = 0; j < fit->m; j++)
            for (int c = 0; c < 3; c++) {
                float *x = &fit->target[(size_t)i * fit->m + j][c];
                *x = (*x - fit->centre[c]) / fit->scale;
            }
}

static void normalize_target(struct groom_fit *fit, const unsigned char *outlier, const struct groom_context *context)
{
    struct cloud cloud = {(const float (*)[3])fit->target, NULL, fit->n, fit->m, outlier};
    double mean[3], spread;
    for (uint32_t i = 0; i < fit->n; i++)
        memcpy(fit->roots[i], fit->target[(size_t)i * fit->m], sizeof fit->roots[i]);
    spread = spread_of(&cloud, 0, mean);
    for (int c = 0; c < 3; c++)
        fit->centre[c] = (float)mean[c];
    fit->scale = spread > 0 ? (float)spread : 1;
    parallel_for(context, pieces_of(fit->n), normalize_piece, fit);
}

/* --- scalp coordinates ------------------------------------------------------------------------ */

static int usable_uv(const struct groom_strands *strands)
{
    int spread = 0;
    if (!strands->root_uv)
        return 0;
    for (uint32_t i = 0; i < strands->n_strands; i++) {
        const float *uv = strands->root_uv[i];
        if (!(uv[0] >= 0 && uv[0] <= 1 && uv[1] >= 0 && uv[1] <= 1))
            return 0;
        spread |= uv[0] != strands->root_uv[0][0] || uv[1] != strands->root_uv[0][1];
    }
    return spread;
}

/* The chart of roots that are not outliers, whose own coordinates are the nearest in it. */
static groom_status chart_roots(struct groom_fit *fit, const unsigned char *outlier, const struct groom_context *context,
                                struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    float (*roots)[3] = memory_array(allocator, fit->n, sizeof *roots);
    if (!roots)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the roots of %u strands", fit->n);
    for (uint32_t i = 0; i < fit->n; i++)
        for (int c = 0; c < 3; c++)
            roots[i][c] = outlier[i] ? NAN : fit->roots[i][c]; /* not finite: left out of account */
    groom_status st = groom_scalp_create((const float (*)[3])roots, fit->n, fit->bvh, context, &fit->scalp, diag);
    memory_release(allocator, roots, fit->n, sizeof *roots);
    if (st != GROOM_OK)
        return st;
    groom_scalp_coordinates(fit->scalp, (const float (*)[3])fit->roots, fit->n, fit->root_uv, context);
    for (uint32_t i = 0; i < fit->n; i++)
        for (int c = 0; c < 2 && outlier[i]; c++)
            fit->root_uv[i][c] = fminf(fmaxf(fit->root_uv[i][c], 0), 1);
    return GROOM_OK;
}

/* A head's chart where there is a head; else what the file brought; else a chart of the roots. */
static groom_status place_roots(struct groom_fit *fit, const struct groom_strands *strands, const unsigned char *outlier,
                                const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st;
    if (!fit->bvh && usable_uv(strands)) {
        memcpy(fit->root_uv, strands->root_uv, fit->n * sizeof *fit->root_uv);
        fit->report.scalp = GROOM_SCALP_FILE;
        report_note(&fit->report, "Scalp coordinates are those of the strands' file.");
        return GROOM_OK;
    }
    if ((st = chart_roots(fit, outlier, context, diag)) != GROOM_OK)
        return st;
    fit->report.scalp = groom_scalp_source_of(fit->scalp);
    report_note(&fit->report, "%s", groom_scalp_note(fit->scalp));
    return GROOM_OK;
}

/* --- the target -------------------------------------------------------------------------------- */

static groom_status allocate(struct groom_fit *fit, struct groom_diag *diag)
{
    fit->roots = memory_array(fit->allocator, fit->n, sizeof *fit->roots);
    fit->root_uv = memory_array(fit->allocator, fit->n, sizeof *fit->root_uv);
    fit->target = memory_array(fit->allocator, (size_t)fit->n * fit->m, sizeof *fit->target);
    if (!fit->roots || !fit->root_uv || !fit->target)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a target of %u strands of %u vertices", fit->n, fit->m);
    return GROOM_OK;
}

static groom_status index_head(struct groom_fit *fit, const struct groom_strands *strands, const struct groom_mesh *head,
                               const unsigned char *outlier, const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = head ? groom_bvh_create(head, context, &fit->bvh, diag) : GROOM_OK;
    if (st != GROOM_OK || !head)
        return st;
    return head_frame_check(fit->bvh, strands, outlier, (float)JOIN_MOST * fit->ordinary, diag);
}

static void note_joins(struct groom_fit *fit)
{
    struct groom_fit_report *report = &fit->report;
    if (report->n_joined)
        report_note(report, "%u strands started off the scalp and were joined to it.", report->n_joined);
    if (report->n_detached)
        report_note(report, "%u strands start too far from the head to be joined to it.", report->n_detached);
    if (report->n_detached > fit->n / 2)
        report_note(report, "Most strands start more than %.0f mm from the head: is it the head of this hair, in its place?",
                    1000 * JOIN_MOST * (double)fit->ordinary);
}

static groom_status fill_target(struct groom_fit *fit, const struct groom_strands *strands, const unsigned char *outlier,
                                const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_strands *joined = NULL, *refined = NULL;
    groom_status st;
    if ((st = join_to_scalp(fit, strands, context, &joined, diag)) == GROOM_OK &&
        (st = refine_strands(joined, fit->m, context, &refined, diag)) == GROOM_OK)
        st = groom_strands_resample(refined, fit->m, fit->target, context, diag);
    groom_strands_destroy(joined);
    groom_strands_destroy(refined);
    if (st != GROOM_OK)
        return st;
    if (progress_cancelled(context))
        return groom_fail(diag, GROOM_ECANCELLED, "cancelled while the target was prepared");
    normalize_target(fit, outlier, context);
    canonical_frame(fit, outlier, fit->own);
    memcpy(fit->frame, fit->own, sizeof fit->frame);
    note_joins(fit);
    return GROOM_OK;
}

groom_status target_create(struct groom_fit *fit, const struct groom_strands *strands,
                           const struct groom_mesh *head, const struct groom_context *context,
                           struct groom_diag *diag)
{
    unsigned char *outlier;
    groom_status st = check_strands(strands, diag);
    if (st != GROOM_OK)
        return st;
    fit->n = strands->n_strands;
    fit->m = fit->options.vertices;
    if ((uint64_t)fit->n * fit->m > UINT32_MAX)
        return groom_fail(diag, GROOM_ETOOBIG, "%u strands of %u vertices are more than 2^32 vertices", fit->n, fit->m);
    if (!(outlier = memory_array(memory_allocator(context), strands->n_strands, 1)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to look at %u strands", fit->n);
    if ((st = outliers_find(strands, context, outlier, &fit->report.n_outliers, diag)) != GROOM_OK)
        goto out;
    fit->ordinary = ordinary_of(strands, outlier);
    if ((st = index_head(fit, strands, head, outlier, context, diag)) != GROOM_OK ||
        (st = allocate(fit, diag)) != GROOM_OK ||
        (st = fill_target(fit, strands, outlier, context, diag)) != GROOM_OK ||
        (st = place_roots(fit, strands, outlier, context, diag)) != GROOM_OK)
        goto out;
    if ((st = unseen_remove(fit, outlier, context, diag)) == GROOM_OK)
        st = head_planes_create(fit, context, diag);
out:
    memory_release(memory_allocator(context), outlier, strands->n_strands, 1);
    return st;
}
