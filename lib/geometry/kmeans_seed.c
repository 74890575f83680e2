/* Each next centre is drawn with probability proportional to a row's squared distance from the centres before: by a
 * race, in which the row with the largest of distance / E wins, E a number of an exponential distribution that the row
 * keeps. Who wins by a little more than rounding still wins when the rows are rounded another way; of a fraction of
 * the sum of all distances, which is the usual draw, neighbouring rows would share the rounding of all. */
#include "geometry/kmeans.h"

#include <math.h>
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
    float *pace;             /* [n] */
    uint32_t *piece_best;    /* [n_pieces] the row that leads, or n where none has a distance */
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
    uint32_t best = s->n;
    float most = 0;
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
        float score = s->distance[i] * s->pace[i];
        if (score > most) {
            most = score;
            best = i;
        }
    }
    s->piece_best[piece] = best;
}

static void add_centre(struct seeding *s, uint32_t i, const struct groom_context *context)
{
    for (uint32_t c = 0; c < s->n_chosen; c++)
        s->between[c] = squared_distance(row(s, i), row(s, s->chosen[c]), s->d);
    s->chosen[s->n_chosen++] = i;
    parallel_for(context, s->n_pieces, visit_piece, s);
}

/* 1 / E, E of an exponential distribution. */
static void draw_paces(struct seeding *s, struct groom_random_key key)
{
    for (uint32_t i = 0; i < s->n; i++)
        s->pace[i] = (float)(-1 / log1p(-fmin(fmax((double)groom_random_uniform(key, i, 1), 1e-9), 1 - 1e-9)));
}

/* The row that leads the race; n where all are at places that were chosen. */
static uint32_t winner(const struct seeding *s)
{
    uint32_t best = s->n;
    for (uint32_t p = 0; p < s->n_pieces; p++) {
        uint32_t i = s->piece_best[p];
        if (i < s->n && (best == s->n || s->distance[i] * s->pace[i] > s->distance[best] * s->pace[best]))
            best = i;
    }
    return best;
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
    s.pace = memory_array(allocator, n, sizeof *s.pace);
    s.piece_best = memory_array(allocator, s.n_pieces, sizeof *s.piece_best);
    s.between = memory_array(allocator, k, sizeof *s.between);
    if (!s.distance || !s.nearest || !s.pace || !s.piece_best || !s.between) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to seed %u clusters", k);
        goto out;
    }
    draw_paces(&s, key);
    add_centre(&s, groom_random_below(key, 0, 0, n), context);
    while (s.n_chosen < k) {
        if (progress_cancelled(context)) {
            st = groom_fail(diag, GROOM_ECANCELLED, "cancelled while clusters were seeded");
            goto out;
        }
        uint32_t next = winner(&s);
        if (next == n)
            break;
        add_centre(&s, next, context);
    }
    *n_chosen = s.n_chosen;
out:
    memory_release(allocator, s.distance, n, sizeof *s.distance);
    memory_release(allocator, s.nearest, n, sizeof *s.nearest);
    memory_release(allocator, s.pace, n, sizeof *s.pace);
    memory_release(allocator, s.piece_best, s.n_pieces, sizeof *s.piece_best);
    memory_release(allocator, s.between, k, sizeof *s.between);
    return st;
}
