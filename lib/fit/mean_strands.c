#include "fit/mean_strands.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/sort.h"

#define STRANDS_PER_PIECE 128
#define FARTHER_THAN_USUAL 4.0 /* times the median square distance from the target */

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

static groom_status init(struct mean_strands *mean, const struct groom_fit *fit, const struct groom_context *context,
                         struct groom_diag *diag)
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
    for (uint32_t j = 0; j < fit->m; j++)
        mean->rest[j] = exp(-profile * j / (fit->m - 1));
    fill_parts(mean, fit, profile > 0);
    list_members(mean);
    return GROOM_OK;
}

groom_status mean_strands_init(struct mean_strands *mean, const struct groom_fit *fit,
                               const struct groom_context *context, struct groom_diag *diag)
{
    return init(mean, fit, context, diag);
}

void mean_strands_finish(struct mean_strands *mean)
{
    size_t n_parts = (size_t)mean->n * mean->n_parts;
    if (!mean->allocator)
        return;
    memory_release(mean->allocator, mean->given, (size_t)mean->n * mean->m, sizeof *mean->given);
    memory_release(mean->allocator, mean->part, n_parts, sizeof *mean->part);
    memory_release(mean->allocator, mean->origin, mean->n, sizeof *mean->origin);
    memory_release(mean->allocator, mean->rest, mean->m, sizeof *mean->rest);
    memory_release(mean->allocator, mean->first, mean->n_guides + 1, sizeof *mean->first);
    memory_release(mean->allocator, mean->member, n_parts, sizeof *mean->member);
}

/* --- strands as they stand ---------------------------------------------------------------- */

struct linearizing {
    struct mean_strands *mean;
    const struct groom_fit *fit;
    const double (*shape)[3];  /* [n_guides * m] of the groom's guides */
    double *error;             /* [n] */
};

/* How much scales make of the strand's own shape, and of its operator guide's. */
static void factors_of(const struct groom *groom, uint32_t i, double *own, double *clumped)
{
    *own = *clumped = 1;
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        const struct groom_operator *op = &groom->operators[o];
        if (!op->enabled)
            continue;
        double factor = op->type == GROOM_OPERATOR_SCALE ? 1 + (double)op->parameter[0] * op->random[0][i] : 1;
        *own *= factor;
        *clumped = op->type == GROOM_OPERATOR_CLUMP ? 1 : *clumped * factor;
    }
}

/* Where the target is at a fraction of its length. */
static void target_at(const struct mean_strands *mean, uint32_t i, double fraction, double out[3])
{
    const float (*x)[3] = mean->target + (size_t)i * mean->m;
    double at = fmin(fmax(fraction, 0), 1) * (mean->m - 1);
    uint32_t j = at < mean->m - 1 ? (uint32_t)at : mean->m - 2;
    for (int c = 0; c < 3; c++)
        out[c] = x[j][c] + (at - j) * ((double)x[j + 1][c] - x[j][c]);
}

static double step_length(const float a[3], const float b[3])
{
    double x = (double)a[0] - b[0], y = (double)a[1] - b[1], z = (double)a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

/* given: the strand in metres; becomes what its parts must sum up to. */
static void linearize(const struct linearizing *job, uint32_t i)
{
    struct mean_strands *mean = job->mean;
    const struct groom_fit *fit = job->fit;
    struct mean_part *part = mean->part + (size_t)i * mean->n_parts;
    float (*x)[3] = mean->given + (size_t)i * mean->m, last[3];
    uint32_t k = fit->groom->n_instancing;
    double own, clumped, length = 0, walked = 0;
    factors_of(fit->groom, i, &own, &clumped);
    for (uint32_t p = 0; p < mean->n_parts; p++) {
        part[p].shape *= (float)own;
        part[p].clumped *= p < k ? 1 : (float)clumped;
    }
    for (uint32_t j = 0; j + 1 < mean->m; j++)
        length += step_length((const float *)x[j], (const float *)x[j + 1]);
    memcpy(last, x[0], sizeof last);
    job->error[i] = 0;
    for (uint32_t j = 0; j < mean->m; j++) {
        double target[3], rest = mean->rest[j];
        walked += step_length((const float *)last, (const float *)x[j]);
        memcpy(last, x[j], sizeof last);
        target_at(mean, i, length > 0 ? walked / length : 0, target);
        for (int c = 0; c < 3; c++) {
            double off = target[c] - ((double)last[c] - fit->centre[c]) / fit->scale, sum = off;
            for (uint32_t p = 0; p < mean->n_parts; p++)
                sum += (rest * part[p].shape + (1 - rest) * part[p].clumped) *
                       job->shape[(size_t)part[p].guide * mean->m + j][c];
            x[j][c] = (float)sum;
            job->error[i] += off * off;
        }
    }
}

static void linearize_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct linearizing *job = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_PER_PIECE; i < job->mean->n && i - piece * STRANDS_PER_PIECE < STRANDS_PER_PIECE; i++)
        linearize(job, i);
}

/* A strand's say falls from where it is farther off than usual. sorted [n] scratch */
static void weigh_strands(struct mean_strands *mean, const double *error, double *sorted)
{
    memcpy(sorted, error, mean->n * sizeof *sorted);
    double usual = FARTHER_THAN_USUAL * median_of_doubles(sorted, mean->n);
    for (uint32_t i = 0; i < mean->n; i++) {
        float weight = error[i] > usual ? (float)sqrt(usual / error[i]) : 1;
        for (uint32_t p = 0; p < mean->n_parts; p++) {
            mean->part[(size_t)i * mean->n_parts + p].shape *= weight;
            mean->part[(size_t)i * mean->n_parts + p].clumped *= weight;
        }
        for (uint32_t j = 0; weight < 1 && j < mean->m; j++)
            for (int c = 0; c < 3; c++)
                mean->given[(size_t)i * mean->m + j][c] *= weight;
    }
}

static void shapes_of(const struct groom_fit *fit, double (*shape)[3])
{
    for (uint32_t g = 0; g < fit->n_guides; g++)
        for (uint32_t j = 0; j < fit->m; j++)
            for (int c = 0; c < 3; c++)
                shape[(size_t)g * fit->m + j][c] = ((double)fit->groom->guides[(size_t)g * fit->m + j][c] -
                                                    fit->groom->guides[(size_t)g * fit->m][c]) / fit->scale;
}

groom_status mean_strands_init_known(struct mean_strands *mean, const struct groom_fit *fit,
                                     const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_shape = (size_t)fit->n_guides * fit->m;
    double (*shape)[3] = memory_array(allocator, n_shape, sizeof *shape);
    double *error = memory_array(allocator, fit->n, 2 * sizeof *error);
    groom_status st = init(mean, fit, context, diag);
    if (st != GROOM_OK)
        goto out;
    mean->given = memory_array(allocator, (size_t)fit->n * fit->m, sizeof *mean->given);
    if (!shape || !error || !mean->given)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for %u strands as they stand", fit->n);
    else if ((st = groom_evaluate(fit->groom, 0, fit->n, mean->given, context, diag)) == GROOM_OK) {
        struct linearizing job = {mean, fit, (const double (*)[3])shape, error};
        shapes_of(fit, shape);
        parallel_for(context, mean_strands_pieces(fit->n), linearize_piece, &job);
        weigh_strands(mean, error, error + fit->n);
    }
out:
    memory_release(allocator, shape, n_shape, sizeof *shape);
    memory_release(allocator, error, fit->n, 2 * sizeof *error);
    return st;
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
    if (mean->given)
        return mean->given[(size_t)i * mean->m + j][c];
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
            for (uint32_t p = 0; p < mean->n_parts; p++) {
                const double (*shape)[3] = job->shape + (size_t)part[p].guide * mean->m;
                left -= (1 - rest) * part[p].clumped * shape[0][c];
                if (j > 0)
                    left -= (rest * part[p].shape + (1 - rest) * part[p].clumped) * shape[j][c];
            }
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
            for (int c = 0; c < 3; c++) {
                double here = wanted(mean, i, j, c);
                out[j][c] += weight * here;
                out[0][c] += (1 - rest) * part->clumped * here;
            }
        }
    }
}

void mean_strands_pull(const struct mean_strands *mean, double (*out)[3], const struct groom_context *context)
{
    struct pulling job = {mean, out};
    parallel_for(context, mean->n_guides, pull_piece, &job);
}
