/* Polylines to super-helices, in parallel: each piece of strands fills a buffer of its own, and the
 * buffers are joined in order. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "curvature/convert_strand.h"
#include "curvature/pieces.h"

struct groom_conversion_options groom_conversion_options_default(void)
{
    return (struct groom_conversion_options){.min_elements = 6, .refinements = 12};
}

/* --- scratch ------------------------------------------------------------------------------ */

/* Every array of convert_space, with its length, once: X(member, count). */
#define SPACE_ARRAYS(X)                                                                            \
    X(spline.point, nv) X(spline.slope, nv) X(spline.h, nv + 3) X(spline.arc, nv) X(spline.work, nv)   \
    X(spline.rate, 9 * (nv + 3))                                                                   \
    X(vertex, nv) X(knot, nv) X(flips, nv) X(breaks, ne + 1) X(p, ne + 1) X(t, ne + 1)             \
    X(work, 2 * ne) X(refine.element, ne) X(refine.kept, 4 * ne) X(refine.junction, ne + 1)        \
    X(refine.moved, ne + 1) X(refine.trig.x, ne + nv + 3) X(refine.trig.A, ne + nv + 3)                    \
    X(refine.trig.B, ne + nv + 3) X(refine.trig.C, ne + nv + 3) X(refine.trig.B1, ne + nv + 3)                 \
    X(refine.trig.C1, ne + nv + 3)                                                                     \
    X(fits[0].strand.length, ne) X(fits[0].strand.q, ne) X(fits[0].strand.element, nv)             \
    X(fits[0].strand.fraction, nv) X(fits[0].strand.fitted, nv)                                    \
    X(fits[1].strand.length, ne) X(fits[1].strand.q, ne) X(fits[1].strand.element, nv)             \
    X(fits[1].strand.fraction, nv) X(fits[1].strand.fitted, nv)

static void space_finish(struct convert_space *space, const struct groom_allocator *a)
{
    size_t nv = space->max_vertices, ne = space->max_elements;
#define SPACE_RELEASE(member, count) memory_release(a, space->member, count, sizeof *space->member);
    SPACE_ARRAYS(SPACE_RELEASE)
#undef SPACE_RELEASE
}

static int space_init(struct convert_space *space, const struct groom_allocator *a)
{
    size_t nv = space->max_vertices, ne = space->max_elements;
    int good = 1;
#define SPACE_ALLOCATE(member, count) \
    good &= (space->member = memory_array(a, count, sizeof *space->member)) != NULL;
    SPACE_ARRAYS(SPACE_ALLOCATE)
#undef SPACE_ALLOCATE
    return good;
}

/* --- pieces ------------------------------------------------------------------------------- */

/* The elements of one piece's strands. */
struct piece {
    uint32_t n_elements, capacity;
    double *length, (*q)[3];
};

struct conversion_job {
    const struct groom_strands *strands;
    const struct groom_conversion_options *options;
    const struct groom_allocator *allocator;
    struct groom_conversion *out;
    double (*root)[3], (*frame)[3][3]; /* [n_strands] */
    struct convert_space *spaces;      /* one a thread */
    uint32_t n_spaces, n_pieces;
    struct piece *pieces;
    int out_of_memory;                 /* any piece sets it; read after the loop */
};

static uint32_t vertices_of(const struct groom_strands *strands, uint32_t i)
{
    return strands->first[i + 1] - strands->first[i];
}

static void piece_finish(struct piece *p, const struct groom_allocator *a)
{
    memory_release(a, p->length, p->capacity, sizeof *p->length);
    memory_release(a, p->q, p->capacity, sizeof *p->q);
    *p = (struct piece){0};
}

static int piece_init(const struct conversion_job *job, struct piece *p, uint32_t begin, uint32_t end)
{
    size_t capacity = 0;
    for (uint32_t i = begin; i < end; i++)
        capacity += convert_max_elements(job->options, vertices_of(job->strands, i));
    if (capacity > UINT32_MAX)
        return 0;
    p->capacity = (uint32_t)capacity;
    p->length = memory_array(job->allocator, capacity, sizeof *p->length);
    p->q = memory_array(job->allocator, capacity, sizeof *p->q);
    return p->length && p->q;
}

static void store_stations(const struct refine_strand *strand, double *begin, float *at)
{
    double total = 0.0;
    for (uint32_t j = 0; j < strand->n_elements; j++) {
        begin[j] = total;
        total += strand->length[j];
    }
    for (uint32_t k = 0; k < strand->n_vertices; k++) {
        uint32_t j = strand->element[k];
        double s = begin[j] + strand->fraction[k] * strand->length[j];
        at[k] = total > 0.0 ? (float)fmin(s / total, 1.0) : 0.0f;
    }
}

static void store_strand(struct conversion_job *job, struct convert_space *space, struct piece *p, uint32_t i)
{
    const struct refine_strand *strand = &space->best->strand;
    const float *root = job->strands->points[job->strands->first[i]];
    for (int k = 0; k < 3; k++)
        job->root[i][k] = (double)root[k];
    mat_store(frame_mend(strand->root), job->frame[i]);
    memcpy(p->length + p->n_elements, strand->length, strand->n_elements * sizeof *p->length);
    memcpy(p->q + p->n_elements, strand->q, strand->n_elements * sizeof *p->q);
    p->n_elements += strand->n_elements;
    store_stations(strand, space->breaks, job->out->at + job->strands->first[i]);
}

/* Give back what the piece did not use: the sum over a head matters. */
static int piece_shrink(const struct conversion_job *job, struct piece *p)
{
    struct piece exact = {.n_elements = p->n_elements, .capacity = p->n_elements};
    exact.length = memory_array(job->allocator, exact.capacity, sizeof *exact.length);
    exact.q = memory_array(job->allocator, exact.capacity, sizeof *exact.q);
    if (!exact.length || !exact.q) {
        piece_finish(&exact, job->allocator);
        return 0;
    }
    memcpy(exact.length, p->length, p->n_elements * sizeof *p->length);
    memcpy(exact.q, p->q, p->n_elements * sizeof *p->q);
    piece_finish(p, job->allocator);
    *p = exact;
    return 1;
}

static void convert_piece(void *user, uint32_t index, uint32_t thread)
{
    struct conversion_job *job = user;
    struct piece *p = &job->pieces[index];
    uint32_t begin, end;
    piece_bounds(job->strands->n_strands, index, &begin, &end);
    if (!piece_init(job, p, begin, end)) {
        __atomic_store_n(&job->out_of_memory, 1, __ATOMIC_RELAXED);
        return;
    }
    for (uint32_t i = begin; i < end; i++) {
        convert_strand(&job->spaces[thread], job->options,
                       (const float (*)[3])job->strands->points + job->strands->first[i],
                       vertices_of(job->strands, i), &job->out->reports[i]);
        store_strand(job, &job->spaces[thread], p, i);
    }
    if (!piece_shrink(job, p))
        __atomic_store_n(&job->out_of_memory, 1, __ATOMIC_RELAXED);
}

/* --- before and after ----------------------------------------------------------------------- */

static groom_status check_input(const struct groom_strands *strands,
                                const struct groom_conversion_options *options, struct groom_diag *diag)
{
    if (!(options->tolerance_m >= 0.0) || !isfinite(options->tolerance_m))
        return groom_fail_field(diag, GROOM_EINVAL, "/tolerance", "the tolerance is %g: it must be 0 or more metres",
                                options->tolerance_m);
    if (options->n_elements > 65536 || options->min_elements > 65536)
        return groom_fail_field(diag, GROOM_EINVAL, "/elements", "%u elements a strand: 65536 is the most",
                                options->n_elements > 65536 ? options->n_elements : options->min_elements);
    for (uint32_t i = 0; i < strands->n_strands; i++) {
        if (strands->first[i] >= strands->first[i + 1])
            return groom_fail(diag, GROOM_EINVAL, "strand %u has no vertices", i);
        for (uint32_t k = strands->first[i]; k < strands->first[i + 1]; k++)
            for (int c = 0; c < 3; c++)
                if (!isfinite(strands->points[k][c]))
                    return groom_fail(diag, GROOM_EINVAL, "vertex %u of strand %u is not finite",
                                      k - strands->first[i], i);
    }
    return GROOM_OK;
}

void groom_conversion_destroy(struct groom_conversion *c)
{
    if (!c)
        return;
    groom_superhelices_destroy(c->helices);
    memory_release(c->allocator, c->first, (size_t)c->n_strands + 1, sizeof *c->first);
    memory_release(c->allocator, c->at, c->n_vertices, sizeof *c->at);
    memory_release(c->allocator, c->reports, c->n_strands, sizeof *c->reports);
    memory_release(c->allocator, c, 1, sizeof *c);
}

static struct groom_conversion *create_result(const struct groom_strands *strands, const struct groom_allocator *a)
{
    struct groom_conversion *c = memory_array_zero(a, 1, sizeof *c);
    if (!c)
        return NULL;
    c->allocator = a;
    c->n_strands = strands->n_strands;
    c->n_vertices = strands->n_vertices;
    c->first = memory_array(a, (size_t)c->n_strands + 1, sizeof *c->first);
    c->at = memory_array(a, c->n_vertices, sizeof *c->at);
    c->reports = memory_array_zero(a, c->n_strands, sizeof *c->reports);
    if (!c->first || !c->at || !c->reports) {
        groom_conversion_destroy(c);
        return NULL;
    }
    memcpy(c->first, strands->first, ((size_t)c->n_strands + 1) * sizeof *c->first);
    return c;
}

static int job_init(struct conversion_job *job, const struct groom_context *context)
{
    const struct groom_allocator *a = job->allocator;
    uint32_t n = job->strands->n_strands, longest = 2;
    for (uint32_t i = 0; i < n; i++)
        longest = vertices_of(job->strands, i) > longest ? vertices_of(job->strands, i) : longest;
    job->n_pieces = piece_count(n);
    job->n_spaces = parallel_threads(context);
    job->pieces = memory_array_zero(a, job->n_pieces, sizeof *job->pieces);
    job->spaces = memory_array_zero(a, job->n_spaces, sizeof *job->spaces);
    job->root = memory_array(a, n, sizeof *job->root);
    job->frame = memory_array(a, n, sizeof *job->frame);
    job->out = create_result(job->strands, a);
    int good = job->pieces && job->spaces && job->root && job->frame && job->out;
    for (uint32_t k = 0; job->spaces && k < job->n_spaces; k++) {
        job->spaces[k].max_vertices = longest;
        job->spaces[k].max_elements = convert_max_elements(job->options, longest);
        good = good && space_init(&job->spaces[k], a);
    }
    return good;
}

static void job_finish(struct conversion_job *job)
{
    const struct groom_allocator *a = job->allocator;
    for (uint32_t k = 0; job->spaces && k < job->n_spaces; k++)
        space_finish(&job->spaces[k], a);
    for (uint32_t k = 0; job->pieces && k < job->n_pieces; k++)
        piece_finish(&job->pieces[k], a);
    memory_release(a, job->spaces, job->n_spaces, sizeof *job->spaces);
    memory_release(a, job->pieces, job->n_pieces, sizeof *job->pieces);
    memory_release(a, job->root, job->strands->n_strands, sizeof *job->root);
    memory_release(a, job->frame, job->strands->n_strands, sizeof *job->frame);
    groom_conversion_destroy(job->out);
}

static groom_status join_pieces(struct conversion_job *job, const struct groom_context *context,
                                struct groom_diag *diag)
{
    struct groom_superhelices *h;
    uint32_t n = job->strands->n_strands;
    size_t total = 0;
    for (uint32_t k = 0; k < job->n_pieces; k++)
        total += job->pieces[k].n_elements;
    groom_status st = groom_superhelices_create(n, total, context, &h, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t i = 0; i < n; i++)
        h->first[i + 1] = h->first[i] + job->out->reports[i].n_elements;
    memcpy(h->root, job->root, n * sizeof *h->root);
    memcpy(h->frame, job->frame, n * sizeof *h->frame);
    total = 0;
    for (uint32_t k = 0; k < job->n_pieces; k++) {
        struct piece *p = &job->pieces[k];
        memcpy(h->length + total, p->length, p->n_elements * sizeof *h->length);
        memcpy(h->q + total, p->q, p->n_elements * sizeof *h->q);
        total += p->n_elements;
        piece_finish(p, job->allocator);
    }
    job->out->helices = h;
    return GROOM_OK;
}

groom_status groom_strands_convert(const struct groom_strands *strands,
                                   const struct groom_conversion_options *options,
                                   const struct groom_context *context,
                                   struct groom_conversion **conversion, struct groom_diag *diag)
{
    struct conversion_job job = {.strands = strands, .options = options, .allocator = memory_allocator(context)};
    groom_status st = check_input(strands, options, diag);
    if (st != GROOM_OK)
        return st;
    if (!job_init(&job, context)) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to convert %u strands", strands->n_strands);
        goto out;
    }
    parallel_for(context, job.n_pieces, convert_piece, &job);
    if (job.out_of_memory) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the helical elements of %u strands", strands->n_strands);
        goto out;
    }
    if ((st = join_pieces(&job, context, diag)) != GROOM_OK)
        goto out;
    *conversion = job.out;
    job.out = NULL;
out:
    job_finish(&job);
    return st;
}
