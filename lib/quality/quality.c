/* The quality report: distributions by halves, places one by one, the head, pairs. */
#include "groom/quality.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "groom/random.h"
#include "quality/half.h"
#include "quality/inside.h"
#include "quality/nearest.h"

#define STREAM_HALVES 0x71750003u
#define DEFAULT_VERTICES 100
#define DEFAULT_STRANDS 10000
#define DEFAULT_PLACES 60000
#define FEWEST_PLACES 2000
#define CLOSEST_PLACES_M 0.25e-3 /* a quarter of the least tolerance */
#define PIECE 256u /* strands */

struct groom_quality_target {
    const struct groom_allocator *allocator;
    struct groom_quality_options options; /* defaults filled in */
    struct quality_set set;
    uint32_t m_bend;        /* vertices at which curvature and torsion are looked at */
    struct groom_bvh *head; /* or NULL */
    struct groom_quality_head inside;
    struct half_distances floor;    /* of the largest halves */
    struct nearest_result floor_of_places[2]; /* A to B, B to A */
};

static uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }

/* --- halves ------------------------------------------------------------------------------- */

/* A random order of n strands; its first half is A, the rest B. */
static groom_status draw_order(uint32_t n, uint64_t seed, const struct groom_context *context, uint32_t **order,
                               struct groom_diag *diag)
{
    struct groom_random_key key = {seed, STREAM_HALVES};
    uint32_t *drawn = memory_array_zero(memory_allocator(context), n, sizeof *drawn);
    if (!drawn)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to draw %u strands", n);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t j = groom_random_below(key, i, 0, i + 1);
        drawn[i] = drawn[j];
        drawn[j] = i;
    }
    *order = drawn;
    return GROOM_OK;
}

struct halves { struct quality_half a, b; };

static void halves_finish(struct halves *halves)
{
    quality_half_finish(&halves->a);
    quality_half_finish(&halves->b);
}

/* Two halves of k strands each, 2 k <= n. Finish them in any case. */
static groom_status halves_init(struct halves *halves, const struct quality_set *set, uint32_t k, uint32_t m_bend, uint64_t seed,
                                const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t *order = NULL;
    memset(halves, 0, sizeof *halves);
    groom_status st = draw_order(set->n, seed, context, &order, diag);
    if (st != GROOM_OK)
        return st;
    if ((st = quality_half_init(&halves->a, set, order, k, m_bend, context, diag)) == GROOM_OK)
        st = quality_half_init(&halves->b, set, order + set->n / 2, k, m_bend, context, diag);
    memory_release(memory_allocator(context), order, set->n, sizeof *order);
    return st;
}

static double mean_of(double a, double b) { return 0.5 * (a + b); }

/* One half of the target against the other of the groom, both ways. */
static groom_status compare_across(const struct halves *target, const struct halves *groom, uint64_t seed,
                                   struct half_distances *distances, const struct groom_context *context,
                                   struct groom_diag *diag)
{
    struct half_distances x, y;
    groom_status st;
    if ((st = quality_half_compare(&target->a, &groom->b, seed, context, &x, diag)) != GROOM_OK ||
        (st = quality_half_compare(&target->b, &groom->a, seed, context, &y, diag)) != GROOM_OK)
        return st;
    *distances = (struct half_distances){mean_of(x.spectra, y.spectra), mean_of(x.segments, y.segments),
                                         mean_of(x.curvature, y.curvature), mean_of(x.torsion, y.torsion),
                                         mean_of(x.length, y.length)};
    return GROOM_OK;
}

static void note_distances(const struct half_distances *distances, const struct half_distances *floor,
                           struct groom_quality *quality)
{
    quality->spectra = (struct groom_quality_distance){distances->spectra, floor->spectra};
    quality->segments = (struct groom_quality_distance){distances->segments, floor->segments};
    quality->curvature = (struct groom_quality_distance){distances->curvature, floor->curvature};
    quality->torsion = (struct groom_quality_distance){distances->torsion, floor->torsion};
    quality->length = (struct groom_quality_distance){distances->length, floor->length};
}

static uint32_t most_in_half(const struct groom_quality_target *target, uint32_t n)
{
    return least(target->options.strands, n / 2);
}

static groom_status compare_distributions(const struct groom_quality_target *target, const struct quality_set *groom,
                                          struct groom_quality *quality, const struct groom_context *context,
                                          struct groom_diag *diag)
{
    uint64_t seed = target->options.seed;
    uint32_t k = least(most_in_half(target, target->set.n), most_in_half(target, groom->n));
    struct half_distances distances, floor = target->floor;
    struct halves of_target = {0}, of_groom = {0};
    groom_status st;
    if ((st = halves_init(&of_target, &target->set, k, target->m_bend, seed, context, diag)) != GROOM_OK ||
        (st = halves_init(&of_groom, groom, k, target->m_bend, seed, context, diag)) != GROOM_OK ||
        (st = compare_across(&of_target, &of_groom, seed, &distances, context, diag)) != GROOM_OK)
        goto out;
    if (k < most_in_half(target, target->set.n) &&
        (st = quality_half_compare(&of_target.a, &of_target.b, seed, context, &floor, diag)) != GROOM_OK)
        goto out;
    note_distances(&distances, &floor, quality);
    quality_half_ranges(&of_target.a, quality);
    quality_half_count(&of_target.a, 0.5, 0, quality);
    quality_half_count(&of_target.b, 0.5, 0, quality);
    quality_half_count(&of_groom.a, 0.5, 1, quality);
    quality_half_count(&of_groom.b, 0.5, 1, quality);
out:
    halves_finish(&of_target);
    halves_finish(&of_groom);
    return st;
}

/* --- places --------------------------------------------------------------------------------- */

static groom_status ask_places(const struct quality_set *from, const struct quality_set *to, uint32_t n_places,
                               struct nearest_result *result, const struct groom_context *context, struct groom_diag *diag)
{
    struct segment_grid grid;
    groom_status st = progress_cancelled(context) ? groom_fail(diag, GROOM_ECANCELLED, "the comparison was cancelled") : GROOM_OK;
    if (st != GROOM_OK)
        return st;
    if ((st = segment_grid_init(&grid, to, context, diag)) == GROOM_OK)
        st = quality_nearest(from, &grid, n_places, context, result, diag);
    segment_grid_finish(&grid);
    return st;
}

static double f_score(double precision, double recall)
{
    return precision + recall > 0 ? 2 * precision * recall / (precision + recall) : 0;
}

static groom_status compare_places(const struct groom_quality_target *target, const struct quality_set *groom,
                                   struct groom_quality *quality, const struct groom_context *context,
                                   struct groom_diag *diag)
{
    const struct nearest_result *floor = target->floor_of_places;
    struct nearest_result precision, recall;
    groom_status st;
    if ((st = ask_places(groom, &target->set, target->options.places, &precision, context, diag)) != GROOM_OK ||
        (st = ask_places(&target->set, groom, target->options.places, &recall, context, diag)) != GROOM_OK)
        return st;
    quality->to_target = precision.nearest;
    quality->to_groom = recall.nearest;
    quality->floor.mean = mean_of(floor[0].nearest.mean, floor[1].nearest.mean);
    quality->floor.p95 = mean_of(floor[0].nearest.p95, floor[1].nearest.p95);
    for (int k = 0; k < GROOM_QUALITY_TOLERANCES; k++)
        quality->scores[k] = (struct groom_quality_score){
            .distance = quality_tolerances[k][0], .angle = quality_tolerances[k][1],
            .precision = precision.any[k], .recall = recall.any[k], .f_score = f_score(precision.any[k], recall.any[k]),
            .nearest_precision = precision.strict[k], .nearest_recall = recall.strict[k],
            .nearest_f_score = f_score(precision.strict[k], recall.strict[k]),
            .floor = f_score(floor[0].any[k], floor[1].any[k]),
            .nearest_floor = f_score(floor[0].strict[k], floor[1].strict[k])};
    return GROOM_OK;
}

/* --- pairs ------------------------------------------------------------------------------------ */

struct pairing {
    const struct quality_set *a, *b;
    double (*sums)[2]; /* [pieces] of distances, of angles */
};

static double angle_between(const float *a, const float *b)
{
    double x[3], y[3], cross = 0, dot = 0;
    for (int c = 0; c < 3; c++) {
        x[c] = (double)a[3 + c] - a[c];
        y[c] = (double)b[3 + c] - b[c];
        dot += x[c] * y[c];
    }
    for (int c = 0; c < 3; c++) {
        double part = x[c] * y[(c + 1) % 3] - x[(c + 1) % 3] * y[c];
        cross += part * part;
    }
    return atan2(sqrt(cross), dot);
}

static double distance_between(const float *a, const float *b)
{
    double x = (double)b[0] - a[0], y = (double)b[1] - a[1], z = (double)b[2] - a[2];
    return sqrt(x * x + y * y + z * z);
}

static void pair_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct pairing *job = user;
    uint32_t m = job->a->m, first = piece * PIECE;
    (void)thread;
    for (uint32_t i = first; i < job->a->n && i < first + PIECE; i++)
        for (uint32_t j = 0; j < m; j++) {
            const float *a = job->a->points[(size_t)i * m + j], *b = job->b->points[(size_t)i * m + j];
            job->sums[piece][0] += distance_between(a, b);
            job->sums[piece][1] += j + 1 < m ? angle_between(a, b) : 0;
        }
}

static groom_status compare_pairs(const struct quality_set *a, const struct quality_set *b, struct groom_quality *quality,
                                  const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n_pieces = a->n / PIECE + (a->n % PIECE != 0);
    struct pairing job = {a, b, memory_array_zero(allocator, n_pieces, sizeof *job.sums)};
    if (!job.sums)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to compare %u pairs of strands", a->n);
    parallel_for(context, n_pieces, pair_piece, &job);
    for (uint32_t p = 0; p < n_pieces; p++) {
        quality->pair_distance += job.sums[p][0] / ((double)a->n * a->m);
        quality->pair_direction += job.sums[p][1] / ((double)a->n * (a->m - 1));
    }
    quality->has_pairs = 1;
    memory_release(allocator, job.sums, n_pieces, sizeof *job.sums);
    return GROOM_OK;
}

/* --- the target --------------------------------------------------------------------------------- */

static groom_status measure_floor_of_places(struct groom_quality_target *target, const struct groom_context *context,
                                            struct groom_diag *diag)
{
    uint32_t n = target->set.n, *order = NULL;
    struct quality_set a = {0}, b = {0};
    groom_status st;
    if ((st = draw_order(n, target->options.seed, context, &order, diag)) != GROOM_OK ||
        (st = quality_set_select(&a, &target->set, order, n / 2, context, diag)) != GROOM_OK ||
        (st = quality_set_select(&b, &target->set, order + n / 2, n - n / 2, context, diag)) != GROOM_OK)
        goto out;
    if (!(quality_set_length(&a) > 0 && quality_set_length(&b) > 0)) {
        st = groom_fail(diag, GROOM_EEMPTY, "half of the strands have no length");
        goto out;
    }
    if ((st = ask_places(&a, &b, target->options.places, &target->floor_of_places[0], context, diag)) == GROOM_OK)
        st = ask_places(&b, &a, target->options.places, &target->floor_of_places[1], context, diag);
out:
    quality_set_finish(&a);
    quality_set_finish(&b);
    memory_release(memory_allocator(context), order, n, sizeof *order);
    return st;
}

static groom_status measure_floor(struct groom_quality_target *target, const struct groom_context *context,
                                  struct groom_diag *diag)
{
    struct halves halves;
    uint64_t seed = target->options.seed;
    groom_status st = halves_init(&halves, &target->set, most_in_half(target, target->set.n), target->m_bend, seed, context,
                                  diag);
    if (st == GROOM_OK)
        st = quality_half_compare(&halves.a, &halves.b, seed, context, &target->floor, diag);
    halves_finish(&halves);
    return st;
}

static groom_status fill_options(const struct groom_quality_options *options, struct groom_quality_options *out,
                                 struct groom_diag *diag)
{
    *out = options ? *options : (struct groom_quality_options){0};
    out->vertices = out->vertices ? out->vertices : DEFAULT_VERTICES;
    out->strands = out->strands ? out->strands : DEFAULT_STRANDS;
    return out->vertices >= 4 ? GROOM_OK : groom_fail(diag, GROOM_EINVAL, "%u vertices a strand are too few: 4 are the least", out->vertices);
}

/* The vertices that half of the strands have no more than: a polyline of few looked at more closely than it was made
 * is straight but for its corners, which no curve resembles. Within 4 .. `most`. */
static groom_status choose_bend(const struct groom_strands *strands, uint32_t most, const struct groom_context *context,
                                uint32_t *m_bend, struct groom_diag *diag)
{
    uint32_t *having = memory_array_zero(memory_allocator(context), (size_t)most + 1, sizeof *having), sum = 0, m = 0;
    if (!having)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a comparison");
    for (uint32_t i = 0; i < strands->n_strands; i++)
        having[least(strands->first[i + 1] - strands->first[i], most)]++;
    while (m < most && (sum += having[m]) < (strands->n_strands + 1) / 2)
        m++;
    memory_release(memory_allocator(context), having, (size_t)most + 1, sizeof *having);
    *m_bend = m > 4 ? m : 4;
    return GROOM_OK;
}

/* Places nearer to each other than that tell the same. */
static uint32_t places_for(const struct quality_set *set)
{
    double n = quality_set_length(set) / CLOSEST_PLACES_M;
    return n > DEFAULT_PLACES ? DEFAULT_PLACES : n < FEWEST_PLACES ? FEWEST_PLACES : (uint32_t)n;
}

groom_status groom_quality_target_create(const struct groom_strands *strands, const struct groom_mesh *head,
                                         const struct groom_quality_options *options, const struct groom_context *context,
                                         struct groom_quality_target **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_quality_target *target = memory_array_zero(allocator, 1, sizeof *target);
    groom_status st;
    if (!target)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a comparison");
    target->allocator = allocator;
    if ((st = fill_options(options, &target->options, diag)) != GROOM_OK ||
        (st = quality_set_init(&target->set, strands, target->options.vertices, context, diag)) != GROOM_OK ||
        (st = choose_bend(strands, target->options.vertices, context, &target->m_bend, diag)) != GROOM_OK ||
        (st = measure_floor(target, context, diag)) != GROOM_OK)
        goto out;
    target->options.places = target->options.places ? target->options.places : places_for(&target->set);
    if ((st = measure_floor_of_places(target, context, diag)) != GROOM_OK)
        goto out;
    if (head && ((st = groom_bvh_create(head, context, &target->head, diag)) != GROOM_OK ||
                 (st = quality_inside(&target->set, target->head, context, &target->inside, diag)) != GROOM_OK))
        goto out;
    *out = target;
    target = NULL;
out:
    groom_quality_target_destroy(target);
    return st;
}

void groom_quality_target_destroy(struct groom_quality_target *target)
{
    if (!target)
        return;
    quality_set_finish(&target->set);
    groom_bvh_destroy(target->head);
    memory_release(target->allocator, target, 1, sizeof *target);
}

/* --- all of it ------------------------------------------------------------------------------------ */

groom_status groom_quality_compare(const struct groom_quality_target *target, const struct groom_strands *strands,
                                   const struct groom_context *context, struct groom_quality *quality,
                                   struct groom_diag *diag)
{
    struct groom_quality found = {.n_target = target->set.n, .n_groom = strands->n_strands,
                                  .bend_vertices = target->m_bend};
    struct quality_set groom;
    groom_status st;
    if ((st = quality_set_init(&groom, strands, target->options.vertices, context, diag)) != GROOM_OK ||
        (st = compare_distributions(target, &groom, &found, context, diag)) != GROOM_OK)
        goto out;
    progress_report(context, 0.4);
    if ((st = compare_places(target, &groom, &found, context, diag)) != GROOM_OK)
        goto out;
    progress_report(context, 0.9);
    if (groom.n == target->set.n && (st = compare_pairs(&target->set, &groom, &found, context, diag)) != GROOM_OK)
        goto out;
    if (target->head && (st = quality_inside(&groom, target->head, context, &found.head_groom, diag)) != GROOM_OK)
        goto out;
    found.has_head = target->head != NULL;
    found.head_target = target->inside;
    found.length_target = quality_set_length(&target->set);
    found.length_groom = quality_set_length(&groom);
    *quality = found;
    progress_report(context, 1);
out:
    quality_set_finish(&groom);
    return st;
}
