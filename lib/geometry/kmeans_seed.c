#include "geometry/kmeans.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"

#define ROWS_PER_PIECE 2048

struct seeding {
    const float *x;
    uint32_t n, d, n_pieces;
    float *distance;         /* [n] squared, to the nearest centre */
    uint32_t *nearest;       /* [n] which of the chosen that is */
    double *piece_sum;       /* [n_pieces] of distance */
    uint32_t *chosen;
    uint32_t n_chosen;
    float *between;          /* [n_chosen] squared distance of the newest centre to each earlier one */
};

static float squared_distance(const float *restrict a, const float *restrict b, uint32_t d)
{
    float sum[8] = {0};
    uint32_t i = 0;
    for (; i + 8 <= d; i += 8)
        for (uint32_t l = 0; l < 8; l++) {
            float difference = a[i + l] - b[i + l];
            sum[l] += difference * difference;
        }
    for (; i < d; i++) {
        float difference = a[i] - b[i];
        sum[0] += difference * difference;
    }
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

static const float *row(const struct seeding *s, uint32_t i) { return s->x + (size_t)i * s->d; }

/* Rows closer to their own centre than half the way from it to the newest can't be closer to the
 * newest: they need no distance. (The sums are of rounded numbers; 0.999 leaves room for that.) */
static void visit_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct seeding *s = user;
    uint32_t begin = piece * ROWS_PER_PIECE;
    uint32_t end = s->n - begin < ROWS_PER_PIECE ? s->n : begin + ROWS_PER_PIECE;
    const float *newest = row(s, s->chosen[s->n_chosen - 1]);
    double sum = 0;
    (void)thread;
    for (uint32_t i = begin; i < end; i++) {
        int first = s->n_chosen == 1;
        if (first || 4.0f * s->distance[i] > 0.999f * s->between[s->nearest[i]]) {
            float distance = squared_distance(row(s, i), newest, s->d);
            if (first || distance < s->distance[i]) {
                s->distance[i] = distance;
                s->nearest[i] = s->n_chosen - 1;
            }
        }
        sum += s->distance[i];
    }
    s->piece_sum[piece] = sum;
}

static void add_centre(struct seeding *s, uint32_t i, const struct groom_context *context)
{
    for (uint32_t c = 0; c < s->n_chosen; c++)
        s->between[c] = squared_distance(row(s, i), row(s, s->chosen[c]), s->d);
    s->chosen[s->n_chosen++] = i;
    parallel_for(context, s->n_pieces, visit_piece, s);
}

/* U(0,1), 53 bits: single precision could not reach every row of a large capture. */
static double uniform53(struct groom_random_key key, uint32_t draw)
{
    uint32_t block[4];
    groom_random_block(key, 0, draw, block);
    return (double)(((uint64_t)block[0] << 32 | block[1]) >> 11) * 0x1p-53;
}

/* The piece in which *rest of the sum of all pieces lies, and what of *rest lies in it; the last one
 * with any weight where rounding leaves none; n_pieces where all weigh nothing. */
static uint32_t draw_piece(const struct seeding *s, double *rest)
{
    uint32_t last = s->n_pieces;
    double before = 0, within = *rest;
    for (uint32_t p = 0; p < s->n_pieces; p++) {
        if (s->piece_sum[p] <= 0)
            continue;
        last = p;
        within = *rest - before;
        before += s->piece_sum[p];
        if (*rest < before)
            break;
    }
    *rest = within;
    return last;
}

/* The row at a fraction u of all squared distances together; n where they are all 0. */
static uint32_t draw_row(const struct seeding *s, double u)
{
    double total = 0;
    uint32_t last = s->n;
    for (uint32_t p = 0; p < s->n_pieces; p++)
        total += s->piece_sum[p];
    double rest = u * total;
    uint32_t piece = draw_piece(s, &rest);
    if (piece == s->n_pieces)
        return s->n;
    for (uint32_t i = piece * ROWS_PER_PIECE; i < s->n && i < (piece + 1) * ROWS_PER_PIECE; i++) {
        if (s->distance[i] <= 0)
            continue;
        last = i;
        rest -= s->distance[i];
        if (rest < 0)
            break;
    }
    return last;
}

groom_status kmeans_seed(const float *x, uint32_t n, uint32_t d, uint32_t k, struct groom_random_key key,
                         const struct groom_context *context, uint32_t *chosen, uint32_t *n_chosen,
                         struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct seeding s = {.x = x, .n = n, .d = d, .chosen = chosen};
    groom_status st = GROOM_OK;

    s.n_pieces = (n + ROWS_PER_PIECE - 1) / ROWS_PER_PIECE;
    s.distance = memory_array(allocator, n, sizeof *s.distance);
    s.nearest = memory_array(allocator, n, sizeof *s.nearest);
    s.piece_sum = memory_array(allocator, s.n_pieces, sizeof *s.piece_sum);
    s.between = memory_array(allocator, k, sizeof *s.between);
    if (!s.distance || !s.nearest || !s.piece_sum || !s.between) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to seed %u clusters", k);
        goto out;
    }
    add_centre(&s, groom_random_below(key, 0, 0, n), context);
    while (s.n_chosen < k) {
        if (progress_cancelled(context)) {
            st = groom_fail(diag, GROOM_ECANCELLED, "cancelled while clusters were seeded");
            goto out;
        }
        uint32_t next = draw_row(&s, uniform53(key, s.n_chosen));
        if (next == n)
            break;
        add_centre(&s, next, context);
    }
    *n_chosen = s.n_chosen;
out:
    memory_release(allocator, s.distance, n, sizeof *s.distance);
    memory_release(allocator, s.nearest, n, sizeof *s.nearest);
    memory_release(allocator, s.piece_sum, s.n_pieces, sizeof *s.piece_sum);
    memory_release(allocator, s.between, k, sizeof *s.between);
    return st;
}
