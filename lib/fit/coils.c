#include "fit/coils.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "groom/groom.h"

#define STRANDS 1500         /* that are asked, at most */
#define RANKS 64             /* of neighbours */
#define LEAST_STRANDS (4 * RANKS)
#define STRANDS_PER_PIECE 16
#define WINDOW 6             /* of a strand, one part in so many: slower turns are of its shape */
#define IN_STEP 0.5          /* correlation */
#define LEAST_SHARE 0.15     /* more of the nearest than of far neighbours are in step; with frizz alone it is a hundredth */
#define LEVEL 0.1            /* of this, that the share may still fall by where it is taken to have come down */
#define MORE 1.2             /* the nearest neighbour is not always of the curl, which makes curls look larger */

struct counting {
    const struct groom_fit *fit;
    const uint32_t *strand;  /* [n] asked */
    const uint32_t *nearest; /* [n][RANKS + 1] itself among them */
    uint32_t n;
    double (*scratch)[3];    /* for each thread: [3 m] */
    unsigned char *in_step;  /* [n][RANKS] */
};

/* --- one strand ----------------------------------------------------------------------------- */

/* Directions of segments, less their mean around: what winds. sum [m]; returns how long a segment is, on average */
static double windings_of(const struct groom_fit *fit, uint32_t i, double (*sum)[3], double (*wind)[3])
{
    const float (*x)[3] = (const float (*)[3])fit->target + (size_t)i * fit->m;
    uint32_t n = fit->m - 1, reach = n / WINDOW / 2;
    double length = 0;
    memset(sum[0], 0, sizeof sum[0]);
    for (uint32_t j = 0; j < n; j++) {
        double square = 0;
        for (int c = 0; c < 3; c++) {
            wind[j][c] = (double)x[j + 1][c] - x[j][c];
            square += wind[j][c] * wind[j][c];
        }
        for (int c = 0; c < 3; c++) {
            wind[j][c] /= square > 0 ? sqrt(square) : 1;
            sum[j + 1][c] = sum[j][c] + wind[j][c];
        }
        length += sqrt(square);
    }
    for (uint32_t j = 0; j < n; j++) {
        uint32_t from = j > reach ? j - reach : 0, to = j + reach < n - 1 ? j + reach + 1 : n;
        for (int c = 0; c < 3; c++)
            wind[j][c] -= (sum[to][c] - sum[from][c]) / (to - from);
    }
    return length / n;
}

/* As far as both go. */
static int are_in_step(uint32_t n, const double (*a)[3], double a_segment, const double (*b)[3], double b_segment)
{
    double product = 0, of_a = 0, of_b = 0, ratio = b_segment > 0 ? a_segment / b_segment : 0;
    for (uint32_t j = 0; j < n && ratio * j < n - 1; j++) {
        uint32_t k = (uint32_t)(ratio * j);
        double t = ratio * j - k;
        for (int c = 0; c < 3; c++) {
            double other = (1 - t) * b[k][c] + t * b[k + 1][c];
            product += a[j][c] * other;
            of_a += a[j][c] * a[j][c];
            of_b += other * other;
        }
    }
    return product > IN_STEP * sqrt(of_a * of_b);
}

/* The kth neighbour of the strand at place `at`. */
static uint32_t neighbour_of(const struct counting *job, uint32_t at, uint32_t k)
{
    const uint32_t *nearest = job->nearest + (size_t)at * (RANKS + 1);
    for (uint32_t r = 0; r <= k; r++) /* itself is no neighbour, wherever those at its own root have put it */
        if (nearest[r] == job->strand[at])
            return nearest[k + 1];
    return nearest[k];
}

static void compare_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct counting *job = user;
    uint32_t m = job->fit->m, first = piece * STRANDS_PER_PIECE;
    uint32_t end = job->n - first < STRANDS_PER_PIECE ? job->n : first + STRANDS_PER_PIECE;
    double (*sum)[3] = job->scratch + (size_t)thread * 3 * m, (*own)[3] = sum + m, (*other)[3] = own + m;
    for (uint32_t at = first; at < end; at++) {
        double segment = windings_of(job->fit, job->strand[at], sum, own);
        for (uint32_t k = 0; k < RANKS; k++) {
            double other_segment = windings_of(job->fit, neighbour_of(job, at, k), sum, other);
            job->in_step[(size_t)at * RANKS + k] = are_in_step(m - 1, (const double (*)[3])own, segment,
                                                                (const double (*)[3])other, other_segment) != 0;
        }
    }
}

/* --- all of them --------------------------------------------------------------------------------- */

static double share_at(const struct counting *job, uint32_t first, uint32_t end)
{
    uint32_t count = 0;
    for (uint32_t at = 0; at < job->n; at++)
        for (uint32_t k = first; k < end; k++)
            count += job->in_step[(size_t)at * RANKS + k];
    return (double)count / job->n / (end - first);
}

/* Strands of a curl, or 0. The farthest neighbours that were looked at have to be of other curls all: their share has come
 * down then, to what strands nearby have in common that is no curl. */
static double curl_size(const struct counting *job)
{
    double nearest = share_at(job, 0, 1), before = share_at(job, RANKS / 2, 3 * RANKS / 4), far = share_at(job, 3 * RANKS / 4, RANKS);
    if (nearest - far < LEAST_SHARE || before - far > LEVEL * (nearest - far))
        return 0;
    return 1 + RANKS * (share_at(job, 0, RANKS) - far) / (nearest - far);
}

static groom_status find_nearest(const struct groom_fit *fit, const uint32_t *strand, uint32_t n, float (*query)[3],
                                 uint32_t *nearest, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_neighbours *neighbours = NULL;
    for (uint32_t at = 0; at < n; at++)
        memcpy(query[at], fit->roots[strand[at]], sizeof query[at]);
    groom_status st = groom_neighbours_create(fit->roots[0], fit->n, 3, context, &neighbours, diag);
    if (st == GROOM_OK)
        st = groom_neighbours_find(neighbours, query[0], n, RANKS + 1, nearest, NULL, context, diag);
    groom_neighbours_destroy(neighbours);
    return st;
}

groom_status coils_count(const struct groom_fit *fit, const struct groom_context *context, uint32_t *n_coils,
                         struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = fit->n < STRANDS ? fit->n : STRANDS;
    size_t n_scratch = (size_t)parallel_threads(context) * 3 * fit->m, n_nearest = (size_t)n * (RANKS + 1);
    *n_coils = 0;
    if (fit->n < LEAST_STRANDS || fit->m < 2 * WINDOW)
        return GROOM_OK;
    uint32_t *strand = memory_array(allocator, fit->n, sizeof *strand), *nearest = memory_array(allocator, n_nearest, sizeof *nearest);
    float (*query)[3] = memory_array(allocator, n, sizeof *query);
    double (*scratch)[3] = memory_array(allocator, n_scratch, sizeof *scratch);
    unsigned char *in_step = memory_array(allocator, (size_t)n * RANKS, sizeof *in_step);
    struct counting job = {fit, strand, nearest, n, scratch, in_step};
    groom_status st = strand && nearest && query && scratch && in_step ? GROOM_OK
                                                                       : groom_fail(diag, GROOM_ENOMEM, "no memory to count curls");
    if (st == GROOM_OK) {
        groom_fair_order(fit->n, strand);
        st = find_nearest(fit, strand, n, query, nearest, context, diag);
    }
    if (st == GROOM_OK) {
        parallel_for(context, (n + STRANDS_PER_PIECE - 1) / STRANDS_PER_PIECE, compare_piece, &job);
        double size = curl_size(&job);
        *n_coils = size > 0 ? (uint32_t)(MORE * fit->n / size) : 0;
    }
    memory_release(allocator, strand, fit->n, sizeof *strand);
    memory_release(allocator, nearest, n_nearest, sizeof *nearest);
    memory_release(allocator, query, n, sizeof *query);
    memory_release(allocator, scratch, n_scratch, sizeof *scratch);
    memory_release(allocator, in_step, (size_t)n * RANKS, sizeof *in_step);
    return st;
}
