/* Ruffling: Shi et al. 2026, Section 4.3.1. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "curvature/pieces.h"
#include "curvature/ruffle.h"
#include "groom/curvature.h"
#include "groom/random.h"

struct ruffle_job {
    const struct groom_superhelices *in;
    const struct groom_ruffle_options *options;
    const struct ruffle_draws *draws; /* NULL: Philox */
    const struct groom_allocator *allocator;
    struct groom_superhelices *out;
    uint32_t n_groups;
    uint32_t *first;      /* [n_groups + 1] */
    uint32_t *member;     /* [n_strands] by group, most elements first, then by index */
    double (*phase)[2];   /* [n_strands] cosine and sine of the strand's mean bending direction */
};

static uint32_t elements_of(const struct groom_superhelices *h, uint32_t i) { return h->first[i + 1] - h->first[i]; }

static uint32_t group_of(const struct ruffle_job *job, uint32_t i) { return job->options->group ? job->options->group[i] : 0; }

/* --- groups ---------------------------------------------------------------------------- */

/* By group, within it by falling element count, within that by index: a radix sort of two digits.
 * scratch  [n_elements + 2] counts, then [n_strands] */
static void sort_members(struct ruffle_job *job, uint32_t *count)
{
    const struct groom_superhelices *h = job->in;
    uint32_t most = 0;
    for (uint32_t i = 0; i < h->n_strands; i++) {
        job->first[group_of(job, i) + 1]++;
        most = elements_of(h, i) > most ? elements_of(h, i) : most;
    }
    for (uint32_t g = 0; g < job->n_groups; g++)
        job->first[g + 1] += job->first[g];
    uint32_t *order = count + h->n_elements + 2;
    memset(count, 0, ((size_t)most + 2) * sizeof *count);
    for (uint32_t i = 0; i < h->n_strands; i++)
        count[most - elements_of(h, i) + 1]++;
    for (uint32_t k = 0; k <= most; k++)
        count[k + 1] += count[k];
    for (uint32_t i = 0; i < h->n_strands; i++)
        order[count[most - elements_of(h, i)]++] = i;
    for (uint32_t k = h->n_strands; k-- > 0;) {
        uint32_t i = order[k];
        job->member[--job->first[group_of(job, i) + 1]] = i;
    }
    for (uint32_t g = 0; g < job->n_groups; g++)
        job->first[g] = job->first[g + 1];
    job->first[job->n_groups] = h->n_strands;
}

/* How many members of a group have more than j elements: they come first. */
static uint32_t long_enough(const struct ruffle_job *job, uint32_t group, uint32_t j)
{
    uint32_t low = job->first[group], high = job->first[group + 1];
    if (low < high && elements_of(job->in, job->member[high - 1]) > j)
        return high - low;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (elements_of(job->in, job->member[middle]) > j)
            low = middle + 1;
        else
            high = middle;
    }
    return low - job->first[group];
}

/* --- strands ----------------------------------------------------------------------------- */

static void find_phase(const struct ruffle_job *job, uint32_t i)
{
    const struct groom_superhelices *h = job->in;
    double c = 0.0, s = 0.0;
    for (uint32_t j = h->first[i]; j < h->first[i + 1]; j++) {
        c += h->length[j] * h->q[j][1];
        s += h->length[j] * h->q[j][2];
    }
    double norm = sqrt(c * c + s * s);
    job->phase[i][0] = norm > 0.0 ? c / norm : 1.0;
    job->phase[i][1] = norm > 0.0 ? s / norm : 0.0;
}

/* Element j of strand i becomes the one of `donor`, in i's gauge. */
static void replace(const struct ruffle_job *job, uint32_t i, uint32_t donor, uint32_t j)
{
    const struct groom_superhelices *h = job->in;
    uint32_t to = h->first[i] + j, from = h->first[donor] + j;
    const double *a = job->phase[i], *b = job->phase[donor], *q = h->q[from], blend = job->options->blend;
    double c = a[0] * b[0] + a[1] * b[1], s = a[1] * b[0] - a[0] * b[1]; /* turn by phase i minus phase donor */
    double turned[3] = {q[0], c * q[1] - s * q[2], s * q[1] + c * q[2]};
    for (int k = 0; k < 3; k++)
        job->out->q[to][k] += blend * (turned[k] - h->q[to][k]);
    job->out->length[to] += blend * (h->length[from] - h->length[to]);
}

/* Donors lie anywhere in memory: replacements are gathered first, so that their numbers can be on the
 * way from memory all at once. */
struct pick {
    uint32_t strand, element, donor;
};

struct picks {
    uint32_t n;
    struct pick list[256];
};

static void apply_picks(const struct ruffle_job *job, struct picks *picks)
{
    for (uint32_t k = 0; k < picks->n; k++) {
        size_t from = (size_t)job->in->first[picks->list[k].donor] + picks->list[k].element;
        __builtin_prefetch(job->in->q[from]);
        __builtin_prefetch(&job->in->length[from]);
        __builtin_prefetch(job->phase[picks->list[k].donor]);
    }
    for (uint32_t k = 0; k < picks->n; k++)
        replace(job, picks->list[k].strand, picks->list[k].donor, picks->list[k].element);
    picks->n = 0;
}

static void add_pick(const struct ruffle_job *job, struct picks *picks, uint32_t i, uint32_t donor, uint32_t j)
{
    if (picks->n == sizeof picks->list / sizeof picks->list[0])
        apply_picks(job, picks);
    __builtin_prefetch(&job->in->first[donor]);
    picks->list[picks->n++] = (struct pick){i, j, donor};
}

/* Draws of a strand: one Philox block holds the chances of four elements; donors, which are few, have
 * draws of their own from here on. */
#define DONOR_DRAWS (1u << 19)

/* The numbers of one strand. */
struct strand_draws {
    const struct ruffle_job *job;
    struct groom_random_key key;
    uint32_t strand, drawn, block[4]; /* which block */
};

static double draw_chance(struct strand_draws *d, uint32_t j)
{
    if (d->job->draws)
        return d->job->draws->uniform(d->job->draws->user, d->strand, j, RUFFLE_CHANCE);
    if (d->drawn != j / 4)
        groom_random_block(d->key, d->strand, d->drawn = j / 4, d->block);
    return (d->block[j % 4] + 0.5) * 0x1p-32;
}

static uint32_t draw_below(const struct strand_draws *d, uint32_t j, uint32_t n)
{
    const struct ruffle_draws *draws = d->job->draws;
    return draws ? (uint32_t)(n * draws->uniform(draws->user, d->strand, j, RUFFLE_DONOR))
                 : groom_random_below(d->key, d->strand, DONOR_DRAWS + j, n);
}

static void ruffle_strand(const struct ruffle_job *job, uint32_t i, struct picks *picks)
{
    const struct groom_ruffle_options *o = job->options;
    struct strand_draws draws = {.job = job, .key = {o->seed, o->stream}, .strand = i, .drawn = UINT32_MAX};
    uint32_t n = elements_of(job->in, i), group = group_of(job, i);
    const uint32_t *members = job->member + job->first[group];
    for (uint32_t j = o->match_elements; j < n; j++) {
        if (draw_chance(&draws, j) >= o->rho)
            continue;
        uint32_t donor = members[draw_below(&draws, j, long_enough(job, group, j))];
        if (donor != i)
            add_pick(job, picks, i, donor, j);
    }
}

static void copy_strands(const struct ruffle_job *job, uint32_t begin, uint32_t end)
{
    const struct groom_superhelices *h = job->in;
    struct groom_superhelices *out = job->out;
    uint32_t e = h->first[begin], n = h->first[end] - e;
    memcpy(out->first + begin, h->first + begin, (end - begin) * sizeof *out->first);
    memcpy(out->root + begin, h->root + begin, (end - begin) * sizeof *out->root);
    memcpy(out->frame + begin, h->frame + begin, (end - begin) * sizeof *out->frame);
    memcpy(out->length + e, h->length + e, n * sizeof *out->length);
    memcpy(out->q + e, h->q + e, n * sizeof *out->q);
}

static void phase_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct ruffle_job *job = user;
    uint32_t begin, end;
    (void)thread;
    piece_bounds(job->in->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++)
        find_phase(job, i);
}

static void ruffle_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct ruffle_job *job = user;
    uint32_t begin, end;
    (void)thread;
    piece_bounds(job->in->n_strands, piece, &begin, &end);
    copy_strands(job, begin, end);
    struct picks picks = {.n = 0};
    for (uint32_t i = begin; i < end; i++)
        ruffle_strand(job, i, &picks);
    apply_picks(job, &picks);
}

/* --- the whole ------------------------------------------------------------------------------ */

static groom_status check_options(const struct groom_superhelices *h, const struct groom_ruffle_options *o,
                                  struct groom_diag *diag)
{
    if (!(o->rho >= 0.0 && o->rho <= 1.0))
        return groom_fail_field(diag, GROOM_EINVAL, "/rho", "rho is %g: a chance lies in 0..1", o->rho);
    if (!(o->blend >= 0.0 && o->blend <= 1.0))
        return groom_fail_field(diag, GROOM_EINVAL, "/blend", "blend is %g: it must lie in 0..1", o->blend);
    for (uint32_t i = 0; o->group && i < h->n_strands; i++)
        if (o->group[i] >= o->n_groups)
            return groom_fail_field(diag, GROOM_EINVAL, "/groups", "strand %u is in group %u; there are %u groups", i,
                                    o->group[i], o->n_groups);
    return GROOM_OK;
}

groom_status ruffle_with(const struct groom_superhelices *helices, const struct groom_ruffle_options *options,
                         const struct ruffle_draws *draws, const struct groom_context *context,
                         struct groom_superhelices **ruffled, struct groom_diag *diag)
{
    const struct groom_allocator *a = memory_allocator(context);
    struct ruffle_job job = {.in = helices, .options = options, .draws = draws, .allocator = a,
                             .n_groups = options->group ? options->n_groups : 1};
    size_t n = helices->n_strands, scratch = (size_t)helices->n_elements + n + 2;
    groom_status st = check_options(helices, options, diag);
    if (st != GROOM_OK)
        return st;
    uint32_t *count = memory_array(a, scratch, sizeof *count);
    job.first = memory_array_zero(a, (size_t)job.n_groups + 1, sizeof *job.first);
    job.member = memory_array(a, n, sizeof *job.member);
    job.phase = memory_array(a, n, sizeof *job.phase);
    if (!count || !job.first || !job.member || !job.phase) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to ruffle %zu strands", n);
        goto out;
    }
    if ((st = groom_superhelices_create(n, helices->n_elements, context, &job.out, diag)) != GROOM_OK)
        goto out;
    sort_members(&job, count);
    parallel_for(context, piece_count(helices->n_strands), phase_piece, &job);
    parallel_for(context, piece_count(helices->n_strands), ruffle_piece, &job);
    job.out->first[n] = helices->n_elements;
    *ruffled = job.out;
out:
    memory_release(a, count, scratch, sizeof *count);
    memory_release(a, job.first, (size_t)job.n_groups + 1, sizeof *job.first);
    memory_release(a, job.member, n, sizeof *job.member);
    memory_release(a, job.phase, n, sizeof *job.phase);
    return st;
}

groom_status groom_superhelices_ruffle(const struct groom_superhelices *helices,
                                       const struct groom_ruffle_options *options,
                                       const struct groom_context *context, struct groom_superhelices **ruffled,
                                       struct groom_diag *diag)
{
    return ruffle_with(helices, options, NULL, context, ruffled, diag);
}
