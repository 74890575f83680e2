/* groom_retarget_run: initial transfer, coarse scale, fine scale, the exact last pass, the report. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "base/sort.h"
#include "groom/body.h"
#include "retarget/job.h"

#define FIELD_NODES 400000
#define PIECE 256 /* strands */

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* --- checks ---------------------------------------------------------------------------------- */

static groom_status check_target(const struct groom_retarget_source *source, const struct groom_retarget_target *target,
                                 struct groom_diag *diag)
{
    const struct groom_mesh *from = source->body, *to = target->body;
    groom_status st = groom_mesh_validate(to, diag);
    if (st != GROOM_OK)
        return st;
    if (from->n_vertices != to->n_vertices || from->n_triangles != to->n_triangles ||
        memcmp(from->triangles, to->triangles, from->n_triangles * sizeof *from->triangles) != 0) {
        char difference[160];
        int same = groom_topology_same(from, to, difference);
        return groom_fail(diag, GROOM_EINVAL, "the target's triangles are not those of the source (%s); lay the source's mesh over the target first",
                          same ? "their corners stand in another order" : difference);
    }
    if (target->skeleton->n_bones != source->skeleton.n_bones)
        return groom_fail_field(diag, GROOM_EINVAL, "/bones", "the target's skeleton has %u bones, the source's %u",
                                target->skeleton->n_bones, source->skeleton.n_bones);
    for (uint32_t i = 0; target->roots && i < source->strands->n_strands; i++)
        for (int c = 0; c < 3; c++)
            if (!isfinite(target->roots[i][c]))
                return groom_fail(diag, GROOM_EINVAL, "the new root of strand %u is not finite", i);
    return GROOM_OK;
}

static groom_status check_run(const struct groom_retarget_source *source, const struct groom_retarget_options *options,
                              struct groom_diag *diag)
{
    groom_status st = retarget_options_check(options, diag);
    if (st != GROOM_OK)
        return st;
    if (options->mode != source->options.mode)
        return groom_fail_field(diag, GROOM_EINVAL, "/mode", "the source was prepared for the other mode");
    if (options->sweeps > 0 && source_has_fine(source) && source->among_all.k == 0)
        return groom_fail_field(diag, GROOM_EINVAL, "/sweeps", "the source was prepared without sweeps");
    return GROOM_OK;
}

/* --- the job -------------------------------------------------------------------------------------- */

/* How far a strand of the source is from its root at most: no strand of the target will be much farther. */
static void hair_box(const struct groom_retarget_source *source, const struct groom_mesh *body, float low[3], float high[3])
{
    float was[2][3], is[2][3];
    groom_mesh_bounds(source->body, was[0], was[1]);
    groom_mesh_bounds(body, is[0], is[1]);
    for (int c = 0; c < 3; c++) {
        float least = INFINITY, most = -INFINITY;
        for (uint32_t i = 0; i < source->strands->n_vertices; i++) {
            least = fminf(least, source->strands->points[i][c]);
            most = fmaxf(most, source->strands->points[i][c]);
        }
        float size = was[1][c] - was[0][c], scale = size > 0 ? (is[1][c] - is[0][c]) / size : 1;
        low[c] = is[0][c] + (least - was[0][c]) * scale;
        high[c] = is[0][c] + (most - was[0][c]) * scale;
    }
}

groom_status job_init(struct job *job, const struct groom_retarget_source *source,
                      const struct groom_retarget_target *target, const struct groom_retarget_options *options,
                      const struct groom_context *context, struct groom_retarget_report *report, struct groom_diag *diag)
{
    uint32_t n_nodes = source->strands->n_vertices / 8 < FIELD_NODES ? source->strands->n_vertices / 8 + 1000 : FIELD_NODES;
    float low[3], high[3];
    groom_status st;
    *job = (struct job){.source = source, .target = target, .options = options, .context = context, .report = report,
                        .allocator = memory_allocator(context)};
    source_centre(target->body, job->centre);
    if ((st = groom_bvh_create(target->body, context, &job->bvh, diag)) != GROOM_OK)
        return st;
    hair_box(source, target->body, low, high);
    if ((st = field_init(&job->field, job->bvh, low, high, 0.05f, n_nodes, context, diag)) != GROOM_OK)
        return st;
    job->hat = memory_array(job->allocator, source->strands->n_vertices, sizeof *job->hat);
    job->standing = memory_array_zero(job->allocator, source->strands->n_strands, 1);
    if (target->roots)
        job->shift = memory_array(job->allocator, source->strands->n_strands, sizeof *job->shift);
    return job->hat && job->standing && (job->shift || !target->roots)
               ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to retarget %u particles", source->strands->n_vertices);
}

void job_finish(struct job *job)
{
    const struct groom_strands *strands = job->source->strands;
    memory_release(job->allocator, job->hat, strands->n_vertices, sizeof *job->hat);
    memory_release(job->allocator, job->standing, strands->n_strands, 1);
    memory_release(job->allocator, job->shift, strands->n_strands, sizeof *job->shift);
    field_finish(&job->field);
    groom_bvh_destroy(job->bvh);
}

/* --- strands that are adapted together ---------------------------------------------------------------- */

/* Copies of some strands, one after the other. */
struct gathered {
    struct coupled hair;
    uint32_t *first, *order;
    uint8_t *standing;
    float (*rest)[3], (*hat)[3], *gamma;
};

static void gathered_finish(struct gathered *g, const struct groom_allocator *allocator)
{
    uint32_t n = g->hair.n;
    memory_release(allocator, g->first, (size_t)g->hair.n_strands + 1, sizeof *g->first);
    memory_release(allocator, g->order, g->hair.n_strands, sizeof *g->order);
    memory_release(allocator, g->standing, g->hair.n_strands, 1);
    memory_release(allocator, g->rest, n, sizeof *g->rest);
    memory_release(allocator, g->hat, n, sizeof *g->hat);
    memory_release(allocator, g->gamma, n, sizeof *g->gamma);
    memory_release(allocator, g->hair.p, n, sizeof *g->hair.p);
}

static void gather_strand(const struct job *job, struct gathered *g, uint32_t index, uint32_t strand)
{
    const struct groom_strands *strands = job->source->strands;
    const float *shift = job->shift ? job->shift[strand] : NULL;
    uint32_t from = strands->first[strand], n = strands->first[strand + 1] - from, to = g->first[index];
    double arc = 0, travel = 0;
    for (int c = 0; shift && c < 3; c++)
        travel += (double)shift[c] * shift[c];
    for (uint32_t i = 0; i < n; i++) {
        double gamma = adaptive_weight(arc, sqrt(travel), job->options->sigma_root), square = 0;
        for (int c = 0; c < 3; c++) {
            g->rest[to + i][c] = (float)(strands->points[from + i][c] - job->source->centre[c]);
            g->hat[to + i][c] = job->hat[from + i][c];
            g->hair.p[to + i][c] = (float)(job->hat[from + i][c] + (shift ? (1 - gamma) * shift[c] : 0));
            double d = i + 1 < n ? (double)strands->points[from + i + 1][c] - strands->points[from + i][c] : 0;
            square += d * d;
        }
        if (g->gamma)
            g->gamma[to + i] = (float)gamma;
        arc += sqrt(square);
    }
}

/* which [n_strands]: their indices, or NULL: all. */
static groom_status gather(const struct job *job, const uint32_t *which, uint32_t n_strands, const struct graph *graph,
                           struct gathered *g, struct groom_diag *diag)
{
    const struct groom_strands *strands = job->source->strands;
    uint32_t n = 0;
    *g = (struct gathered){0};
    for (uint32_t i = 0; i < n_strands; i++) {
        uint32_t strand = which ? which[i] : i;
        n += strands->first[strand + 1] - strands->first[strand];
    }
    g->hair = (struct coupled){.n_strands = n_strands, .n = n, .graph = graph};
    g->first = memory_array(job->allocator, (size_t)n_strands + 1, sizeof *g->first);
    g->order = memory_array(job->allocator, n_strands, sizeof *g->order);
    g->standing = memory_array(job->allocator, n_strands, 1);
    g->rest = memory_array(job->allocator, n, sizeof *g->rest);
    g->hat = memory_array(job->allocator, n, sizeof *g->hat);
    g->gamma = job->shift ? memory_array(job->allocator, n, sizeof *g->gamma) : NULL;
    g->hair.p = memory_array(job->allocator, n, sizeof *g->hair.p);
    if (!g->first || !g->order || !g->standing || !g->rest || !g->hat || (job->shift && !g->gamma) || !g->hair.p)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to adapt %u particles together", n);
    g->first[0] = 0;
    for (uint32_t i = 0; i < n_strands; i++) {
        uint32_t strand = which ? which[i] : i;
        g->first[i + 1] = g->first[i] + strands->first[strand + 1] - strands->first[strand];
        g->standing[i] = job->standing[strand];
        gather_strand(job, g, i, strand);
    }
    g->hair.first = g->first;
    g->hair.order = g->order;
    g->hair.standing = g->standing;
    g->hair.rest = (const float(*)[3])g->rest;
    g->hair.hat = (const float(*)[3])g->hat;
    g->hair.gamma = g->gamma;
    return coupled_order(&g->hair, g->order, job->allocator, diag);
}

static void scatter(const struct job *job, const uint32_t *which, const struct coupled *hair, float (*result)[3])
{
    for (uint32_t i = 0; i < hair->n_strands; i++) {
        uint32_t to = job->source->strands->first[which ? which[i] : i];
        memcpy(result + to, hair->p + hair->first[i], (hair->first[i + 1] - hair->first[i]) * sizeof *result);
    }
}

static void add(struct groom_retarget_energy *sum, const struct groom_retarget_energy *one)
{
    sum->shape += one->shape;
    sum->inter += one->inter;
    sum->body += one->body;
    sum->total += one->total;
}

/* --- the two modes ---------------------------------------------------------------------------------------- */

/* Where no tolerance is given, the paper's own iterations are wanted. */
static groom_status solve(struct job *job, const struct coupled *hair, uint32_t iterations, uint32_t *n_iterations,
                          struct groom_retarget_step *history, struct groom_diag *diag)
{
    return job->options->tolerance > 0 ? descent_solve(job, hair, iterations, n_iterations, history, diag)
                                       : coupled_solve(job, hair, iterations, n_iterations, history, diag);
}

static groom_status adapt_together(struct job *job, const uint32_t *which, uint32_t n_strands, const struct graph *graph,
                                   float (*result)[3], struct gathered *g, struct groom_diag *diag)
{
    struct groom_retarget_report *report = job->report;
    groom_status st = gather(job, which, n_strands, graph, g, diag);
    if (st == GROOM_OK)
        st = coupled_energy(job, &g->hair, g->hair.hat, &report->before, diag);
    if (st == GROOM_OK)
        st = solve(job, &g->hair, job->options->iterations, &report->iterations_coarse, report->coarse, diag);
    if (st == GROOM_OK)
        st = coupled_energy(job, &g->hair, (const float(*)[3])g->hair.p, &report->after, diag);
    if (st == GROOM_OK)
        scatter(job, which, &g->hair, result);
    return st;
}

/* How far each particle of the guides went; over what was their rest. */
static void guides_moved(struct gathered *g)
{
    for (uint32_t i = 0; i < g->hair.n; i++)
        for (int c = 0; c < 3; c++)
            g->rest[i][c] = g->hair.p[i][c] - g->rest[i][c];
}

static groom_status adapt_fine(struct job *job, struct gathered *guides, float (*result)[3], struct groom_diag *diag)
{
    struct groom_retarget_energy before, after;
    const float(*moved)[3] = (const float(*)[3])guides->rest;
    guides_moved(guides);
    groom_status st = fine_energy(job, moved, (const float(*)[3])job->hat, &before, diag);
    if (st == GROOM_OK)
        st = fine_solve(job, moved, result, &after, diag);
    if (st == GROOM_OK) {
        add(&job->report->before, &before);
        add(&job->report->after, &after);
    }
    return st;
}

/* Past the paper: from the two scales' result on, all strands together. Guides come from the coarse scale too stiff,
 * and the others hang on them; a few iterations on the whole hairstyle let both go where Eq. 1 wants them. */
static groom_status adapt_whole(struct job *job, float (*result)[3], struct groom_diag *diag)
{
    struct groom_retarget_report *report = job->report;
    const struct groom_strands *strands = job->source->strands;
    struct gathered g;
    groom_status st = gather(job, NULL, strands->n_strands, &job->source->among_all, &g, diag);
    if (st == GROOM_OK) {
        memcpy(g.hair.p, result, strands->n_vertices * sizeof *result);
        st = coupled_energy(job, &g.hair, g.hair.hat, &report->before, diag);
    }
    if (st == GROOM_OK)
        st = coupled_energy(job, &g.hair, (const float(*)[3])g.hair.p, &report->two_scales, diag);
    if (st == GROOM_OK)
        st = solve(job, &g.hair, job->options->sweeps, &report->iterations_whole, NULL, diag);
    if (st == GROOM_OK)
        st = coupled_energy(job, &g.hair, (const float(*)[3])g.hair.p, &report->after, diag);
    if (st == GROOM_OK)
        scatter(job, NULL, &g.hair, result);
    gathered_finish(&g, job->allocator);
    return st;
}

groom_status job_adapt(struct job *job, float (*result)[3], struct groom_diag *diag)
{
    const struct groom_retarget_source *source = job->source;
    int global = job->options->mode == GROOM_RETARGET_GLOBAL;
    struct gathered g;
    double start = now();
    job->progress_from = COUNTED;
    job->progress_to = global ? ADAPTED : 0.2f;
    groom_status st = global ? adapt_together(job, NULL, source->strands->n_strands, &source->among_all, result, &g, diag)
                             : adapt_together(job, source->guides, source->n_guides, &source->among_guides, result, &g, diag);
    job->report->seconds_coarse = now() - start;
    job->progress_from = 0.2f;
    job->progress_to = ADAPTED;
    start = now();
    if (st == GROOM_OK && source_has_fine(source))
        st = adapt_fine(job, &g, result, diag);
    job->report->seconds_fine = now() - start;
    gathered_finish(&g, job->allocator);
    start = now();
    if (st == GROOM_OK && source_has_fine(source) && job->options->sweeps > 0)
        st = adapt_whole(job, result, diag);
    job->report->seconds_whole = now() - start;
    return st;
}

/* --- the result ------------------------------------------------------------------------------------------ */

/* From relative to the centre to metres; what stays and a root of its own are kept to the bit. */
static void to_metres(const struct job *job, float (*points)[3])
{
    const struct groom_strands *strands = job->source->strands;
    for (uint32_t i = 0; i < strands->n_vertices; i++)
        for (int c = 0; c < 3; c++)
            points[i][c] = (float)(points[i][c] + job->centre[c]);
    for (uint32_t i = 0; i < strands->n_strands; i++) {
        uint32_t first = strands->first[i];
        if (job->shift)
            memcpy(points[first], job->target->roots[i], sizeof *points);
        if (job->standing[i] & STANDING_STAYS)
            memcpy(points + first, strands->points + first, (strands->first[i + 1] - first) * sizeof *points);
    }
}

static groom_status measure_lengths(const struct job *job, const float (*points)[3], struct groom_diag *diag)
{
    const struct groom_strands *strands = job->source->strands;
    struct groom_retarget_report *report = job->report;
    float *ratio = memory_array(job->allocator, strands->n_strands, sizeof *ratio);
    if (!ratio)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to measure lengths");
    for (uint32_t i = 0; i < strands->n_strands; i++) {
        uint32_t first = strands->first[i], n = strands->first[i + 1] - first;
        double was = groom_polyline_length((const float(*)[3])strands->points + first, n);
        ratio[i] = was > 0 ? (float)(groom_polyline_length(points + first, n) / was) : 1;
    }
    sort_floats(ratio, strands->n_strands);
    report->length_ratio_min = ratio[0];
    report->length_ratio_median = ratio[strands->n_strands / 2];
    report->length_ratio_max = ratio[strands->n_strands - 1];
    memory_release(job->allocator, ratio, strands->n_strands, sizeof *ratio);
    return GROOM_OK;
}

static double distance(const float a[3], const float b[3])
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += ((double)a[c] - b[c]) * ((double)a[c] - b[c]);
    return sqrt(sum);
}

static void fill_values(const struct job *job, const float (*points)[3], const struct groom_retarget_values *values)
{
    const struct groom_strands *strands = job->source->strands;
    struct groom_retarget_report *report = job->report;
    uint64_t n_conflict = 0;
    for (uint32_t s = 0; s < strands->n_strands; s++) {
        int in_conflict = job->standing[s] & STANDING_IN_CONFLICT;
        struct groom_retarget_movement *movement = in_conflict ? &report->movement_conflict : &report->movement_others;
        movement->strands++;
        n_conflict += in_conflict ? strands->first[s + 1] - strands->first[s] : 0;
        report->n_unchanged += (job->standing[s] & STANDING_STAYS) != 0;
        report->n_short += (job->standing[s] & STANDING_SHORT) != 0;
        for (uint32_t i = strands->first[s]; i < strands->first[s + 1]; i++) {
            float hat[3];
            for (int c = 0; c < 3; c++)
                hat[c] = (float)(job->hat[i][c] + job->centre[c]);
            double way = distance(points[i], hat);
            movement->mean += way;
            movement->max = fmax(movement->max, way);
            if (values && values->movement)
                values->movement[i] = (float)way;
            if (values && values->depth) {
                float away = field_away(&job->field, hat);
                away = away > job->options->clearance ? away : groom_bvh_signed_distance(job->bvh, hat);
                values->depth[i] = i > strands->first[s] ? fmaxf(0, (float)job->options->clearance - away) : 0;
            }
            if (values && values->stretch) {
                double was = i > strands->first[s] ? distance(strands->points[i], strands->points[i - 1]) : 0;
                values->stretch[i] = was > 0 ? (float)(distance(points[i], points[i - 1]) / was) : 1;
            }
        }
    }
    report->movement_mean = (report->movement_conflict.mean + report->movement_others.mean) / strands->n_vertices;
    report->movement_max = fmax(report->movement_conflict.max, report->movement_others.max);
    report->movement_conflict.mean /= n_conflict > 0 ? (double)n_conflict : 1;
    report->movement_others.mean /= n_conflict < strands->n_vertices ? (double)(strands->n_vertices - n_conflict) : 1;
}

static groom_status finish(struct job *job, float (*points)[3], const struct groom_retarget_values *values,
                           struct groom_diag *diag)
{
    double start = now();
    groom_status st;
    to_metres(job, points);
    if ((st = clearance_apply(job, points, &job->report->inside_after, diag)) != GROOM_OK)
        return st;
    job->report->seconds_clearance = now() - start;
    fill_values(job, (const float(*)[3])points, values);
    return measure_lengths(job, (const float(*)[3])points, diag);
}

/* What the initial transfer has inside; `room` is lent for it. */
static groom_status count_before(struct job *job, float (*room)[3], struct groom_diag *diag)
{
    for (uint32_t i = 0; i < job->source->strands->n_vertices; i++)
        for (int c = 0; c < 3; c++)
            room[i][c] = (float)(job->hat[i][c] + job->centre[c]);
    return clearance_count(job, room, &job->report->inside_before, diag);
}

groom_status groom_retarget_run(const struct groom_retarget_source *source, const struct groom_retarget_target *target,
                                const struct groom_retarget_options *options, const struct groom_context *context,
                                float (*out)[3], const struct groom_retarget_values *values,
                                struct groom_retarget_report *report_out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_retarget_report *report = NULL;
    struct job job = {.source = source, .allocator = allocator};
    double start = now();
    groom_status st;
    if ((st = check_run(source, options, diag)) != GROOM_OK || (st = check_target(source, target, diag)) != GROOM_OK)
        return st;
    if (!(report = memory_array_zero(allocator, 1, sizeof *report)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to retarget");
    report->n_strands = source->strands->n_strands;
    report->n_vertices = source->strands->n_vertices;
    report->n_guides = source->n_guides;
    report->n_without_bone = source->n_without_bone;
    if ((st = job_init(&job, source, target, options, context, report, diag)) != GROOM_OK ||
        (st = transfer_all(&job, diag)) != GROOM_OK || (st = count_before(&job, out, diag)) != GROOM_OK)
        goto out;
    report->seconds_initial = now() - start;
    if ((st = job_adapt(&job, out, diag)) != GROOM_OK || (st = finish(&job, out, values, diag)) != GROOM_OK)
        goto out;
    report->seconds_total = now() - start;
    progress_report(context, 1.0);
    if (report_out)
        *report_out = *report;
out:
    job_finish(&job);
    memory_release(allocator, report, 1, sizeof *report);
    return st;
}

groom_status groom_retarget_roots(const struct groom_retarget_source *source, const struct groom_retarget_target *target,
                                  const struct groom_context *context, float (*roots)[3], struct groom_diag *diag)
{
    struct job job = {.source = source, .target = target};
    groom_status st = check_target(source, target, diag);
    (void)context;
    for (uint32_t i = 0; st == GROOM_OK && i < source->strands->n_strands; i++) {
        double p[3];
        transfer_root(&job, source->strands->first[i], p);
        for (int c = 0; c < 3; c++)
            roots[i][c] = (float)p[c];
    }
    return st;
}
