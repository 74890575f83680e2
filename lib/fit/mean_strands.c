#include "fit/mean_strands.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"

#define STRANDS_PER_PIECE 128

uint32_t mean_strands_pieces(uint32_t n) { return n / STRANDS_PER_PIECE + (n % STRANDS_PER_PIECE != 0); }

/* --- the model --------------------------------------------------------------------- */

static double total_profile(const struct groom *groom)
{
    double profile = 0;
    for (uint32_t i = 0; i < groom->n_operators; i++)
        if (groom->operators[i].enabled && groom->operators[i].type == GROOM_OPERATOR_CLUMP)
            profile += groom->operators[i].parameter[0];
    return profile;
}

static void fill_parts(struct mean_strands *mean, const struct groom_fit *fit, int clumps)
{
    const struct groom *groom = fit->groom;
    uint32_t k = groom->n_instancing;
    for (uint32_t i = 0; i < mean->n; i++) {
        struct mean_part *part = mean->part + (size_t)i * mean->n_parts;
        uint32_t operator_guide = groom->operator_guide[groom->operator_guide_of[i]];
        const float *root = groom->guides[(size_t)operator_guide * groom->n_vertices];
        for (uint32_t a = 0; a < k; a++)
            part[a] = (struct mean_part){groom->instancing_guide[(size_t)i * k + a],
                                         groom->instancing_weight[(size_t)i * k + a], 0};
        if (clumps)
            part[k] = (struct mean_part){operator_guide, 0, 1};
        for (int c = 0; c < 3; c++)
            mean->origin[i][c] = ((double)root[c] - fit->centre[c]) / fit->scale;
    }
}

/* Counting sort of the parts by guide. */
static void list_members(struct mean_strands *mean)
{
    size_t n = (size_t)mean->n * mean->n_parts;
    memset(mean->first, 0, (mean->n_guides + 1) * sizeof *mean->first);
    for (size_t p = 0; p < n; p++)
        mean->first[mean->part[p].guide + 1]++;
    for (uint32_t g = 0; g < mean->n_guides; g++)
        mean->first[g + 1] += mean->first[g];
    for (size_t p = 0; p < n; p++)
        mean->member[mean->first[mean->part[p].guide]++] = (uint32_t)p;
    memmove(mean->first + 1, mean->first, mean->n_guides * sizeof *mean->first);
    mean->first[0] = 0;
}

groom_status mean_strands_init(struct mean_strands *mean, const struct groom_fit *fit,
                               const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    double profile = total_profile(fit->groom);
    size_t n_parts = fit->groom->n_instancing + (profile > 0);
    *mean = (struct mean_strands){.n = fit->n, .m = fit->m, .n_guides = fit->n_guides, .n_parts = (uint32_t)n_parts,
                                  .target = (const float (*)[3])fit->target, .allocator = allocator};
    mean->part = memory_array(allocator, fit->n * n_parts, sizeof *mean->part);
    mean->origin = memory_array(allocator, fit->n, sizeof *mean->origin);
    mean->rest = memory_array(allocator, fit->m, sizeof *mean->rest);
    mean->first = memory_array(allocator, fit->n_guides + 1, sizeof *mean->first);
    mean->member = memory_array(allocator, fit->n * n_parts, sizeof *mean->member);
    if (!mean->part || !mean->origin || !mean->rest || !mean->first || !mean->member)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the mean of %u strands", fit->n);
    double trust = (double)fit->groom->n_operator_guides / fit->n_guides;
    for (uint32_t j = 0; j < fit->m; j++)
        mean->rest[j] = 1 - trust * (1 - exp(-profile * j / (fit->m - 1)));
    fill_parts(mean, fit, profile > 0);
    list_members(mean);
    return GROOM_OK;
}

void mean_strands_finish(struct mean_strands *mean)
{
    size_t n_parts = (size_t)mean->n * mean->n_parts;
    if (!mean->allocator)
        return;
    memory_release(mean->allocator, mean->part, n_parts, sizeof *mean->part);
    memory_release(mean->allocator, mean->origin, mean->n, sizeof *mean->origin);
    memory_release(mean->allocator, mean->rest, mean->m, sizeof *mean->rest);
    memory_release(mean->allocator, mean->first, mean->n_guides + 1, sizeof *mean->first);
    memory_release(mean->allocator, mean->member, n_parts, sizeof *mean->member);
}

/* --- loss ----------------------------------------------------------------------------- */

struct losing {
    const struct mean_strands *mean;
    const double (*shape)[3];
    double *partial; /* [pieces] */
};

/* What the guides' shapes must sum up to, at vertex j of strand i. */
static double wanted(const struct mean_strands *mean, uint32_t i, uint32_t j, int c)
{
    const float (*target)[3] = mean->target + (size_t)i * mean->m;
    double rest = mean->rest[j];
    return target[j][c] - rest * target[0][c] - (1 - rest) * mean->origin[i][c];
}

static double strand_loss(const struct losing *job, uint32_t i)
{
    const struct mean_strands *mean = job->mean;
    const struct mean_part *part = mean->part + (size_t)i * mean->n_parts;
    double sum = 0;
    for (uint32_t j = 0; j < mean->m; j++) {
        double rest = mean->rest[j];
        for (int c = 0; c < 3; c++) {
            double left = wanted(mean, i, j, c);
            for (uint32_t p = 0; p < mean->n_parts; p++)
                left -= (rest * part[p].shape + (1 - rest) * part[p].clumped) *
                        job->shape[(size_t)part[p].guide * mean->m + j][c];
            sum += left * left;
        }
    }
    return sum;
}

static void loss_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct losing *job = user;
    double sum = 0;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < job->mean->n && i - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; i++)
        sum += strand_loss(job, i);
    job->partial[piece] = sum;
}

double mean_strands_loss(const struct mean_strands *mean, const double (*shape)[3], double *partial,
                         const struct groom_context *context)
{
    struct losing job = {mean, shape, partial};
    uint32_t n_pieces = mean_strands_pieces(mean->n);
    double sum = 0;
    parallel_for(context, n_pieces, loss_piece, &job);
    for (uint32_t piece = 0; piece < n_pieces; piece++)
        sum += partial[piece];
    return sum / ((double)mean->n * mean->m);
}

/* --- pull -------------------------------------------------------------------------------- */

struct pulling {
    const struct mean_strands *mean;
    double (*out)[3];
};

static void pull_piece(void *user, uint32_t g, uint32_t thread)
{
    const struct pulling *job = user;
    const struct mean_strands *mean = job->mean;
    double (*out)[3] = job->out + (size_t)g * mean->m;
    (void)thread;
    memset(out, 0, mean->m * sizeof *out);
    for (uint32_t at = mean->first[g]; at < mean->first[g + 1]; at++) {
        const struct mean_part *part = mean->part + mean->member[at];
        uint32_t i = mean->member[at] / mean->n_parts;
        for (uint32_t j = 1; j < mean->m; j++) {
            double rest = mean->rest[j], weight = rest * part->shape + (1 - rest) * part->clumped;
            for (int c = 0; c < 3; c++)
                out[j][c] += weight * wanted(mean, i, j, c);
        }
    }
}

void mean_strands_pull(const struct mean_strands *mean, double (*out)[3], const struct groom_context *context)
{
    struct pulling job = {mean, out};
    parallel_for(context, mean->n_guides, pull_piece, &job);
}
