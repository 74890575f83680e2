/* Strands adapted together as Section 4.6 has it: in each iteration the quadratic programme of held lengths, to its
 * exact solution; and Eq. 1's energies. */
#include "retarget/coupled.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"

#define ROUNDS 30            /* of the active set */
#define ROUNDS_RELEASING 12  /* after these nothing is let go any more */
#define MOST_STEPS 400       /* of conjugate gradients */
#define EXACT 1e-7           /* share of its start that an error may keep */
#define SLACK 1e-9           /* metres by which a half-space may be missed */

/* --- contacts ------------------------------------------------------------------------------- */

static void find_plane(struct system *s, uint32_t i)
{
    s->away[i] = (float)contact_plane(s->job, s->hair->p[i], &s->plane[i]);
    if (s->state[i] == COUPLED_FREE)
        s->state[i] = COUPLED_KNOWN;
}

static float moved(const float x[3]) { return sqrtf(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

static double beyond(const struct system *s, uint32_t i)
{
    const struct plane *plane = &s->plane[i];
    return plane->normal[0] * s->x[i][0] + plane->normal[1] * s->x[i][1] + plane->normal[2] * s->x[i][2] - plane->height;
}

static int misses(struct system *s, uint32_t i)
{
    if (s->state[i] == COUPLED_FREE) {
        float way = moved(s->x[i]) + (float)s->job->options->clearance;
        if (way < s->away[i])
            return 0;
        s->away[i] = contact_away(s->job, s->hair->p[i]);
        if (way < s->away[i])
            return 0;
        find_plane(s, i);
    }
    return beyond(s, i) < -SLACK;
}

/* Brings an active particle's movement onto its plane. */
static void onto_plane(struct system *s, uint32_t i)
{
    double off = beyond(s, i);
    for (int c = 0; c < 3; c++)
        s->x[i][c] = (float)(s->x[i][c] - off * s->plane[i].normal[c]);
}

struct round {
    struct system *s;
    int releasing;
    uint32_t *n_changed; /* [n_pieces] */
};

/* ad = A x: an active plane pushes with normal . (A x - b). */
static void contacts_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct round *round = user;
    struct system *s = round->s;
    uint32_t end = s->hair->first[system_piece_end(s, piece)], n_changed = 0;
    (void)thread;
    for (uint32_t i = s->hair->first[piece * COUPLED_PIECE]; i < end; i++) {
        if (s->state[i] == COUPLED_FIXED)
            continue;
        if (s->state[i] == COUPLED_ACTIVE) {
            double push = 0;
            for (int c = 0; c < 3; c++)
                push += s->plane[i].normal[c] * ((double)s->ad[i][c] - s->b[i][c]);
            if (push < 0 && round->releasing) {
                s->state[i] = COUPLED_KNOWN;
                n_changed++;
            }
        } else if (misses(s, i)) {
            s->state[i] = COUPLED_ACTIVE;
            onto_plane(s, i);
            n_changed++;
        }
    }
    round->n_changed[piece] = n_changed;
}

/* Last iteration's contacts are tried first. */
static void renew_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct system *s = user;
    uint32_t end = s->hair->first[system_piece_end(s, piece)];
    (void)thread;
    for (uint32_t i = s->hair->first[piece * COUPLED_PIECE]; i < end; i++) {
        memset(s->x[i], 0, sizeof s->x[i]);
        if (s->state[i] == COUPLED_ACTIVE) {
            find_plane(s, i);
            onto_plane(s, i);
        } else if (s->state[i] != COUPLED_FIXED) {
            s->state[i] = COUPLED_FREE;
        }
    }
}

static void move_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct system *s = user;
    uint32_t end = s->hair->first[system_piece_end(s, piece)];
    double sum = 0;
    (void)thread;
    for (uint32_t i = s->hair->first[piece * COUPLED_PIECE]; i < end; i++) {
        float way = s->state[i] == COUPLED_FIXED ? 0 : moved(s->x[i]);
        s->away[i] -= way * 1.00001f;
        sum += way;
        for (int c = 0; way > 0 && c < 3; c++)
            s->hair->p[i][c] += s->x[i][c];
    }
    s->sums[piece] = sum;
}

/* --- one iteration --------------------------------------------------------------------------- */

/* returns the mean movement */
static double iterate(struct system *s, uint32_t *n_changed)
{
    const struct groom_context *context = s->job->context;
    double scale = 0, sum = 0;
    struct round round = {.s = s, .n_changed = n_changed};
    system_linearise(s);
    parallel_for(context, s->n_pieces, renew_piece, s);
    for (int i = 0; i < ROUNDS; i++) {
        uint32_t n = 0;
        scale = system_solve(s, scale, EXACT, MOST_STEPS);
        system_apply(s, s->x, s->ad);
        round.releasing = i < ROUNDS_RELEASING;
        parallel_for(context, s->n_pieces, contacts_piece, &round);
        for (uint32_t piece = 0; piece < s->n_pieces; piece++)
            n += n_changed[piece];
        if (n == 0 || progress_cancelled(context))
            break;
    }
    parallel_for(context, s->n_pieces, move_piece, s);
    for (uint32_t piece = 0; piece < s->n_pieces; piece++)
        sum += s->sums[piece];
    return sum / s->hair->n;
}

groom_status coupled_solve(struct job *job, const struct coupled *hair, uint32_t iterations, uint32_t *n_iterations,
                           struct groom_retarget_step *history, struct groom_diag *diag)
{
    struct system s;
    groom_status st = system_init(&s, job, hair, diag);
    uint32_t *n_changed = memory_array(job->allocator, s.n_pieces, sizeof *n_changed), i = 0;
    if (st == GROOM_OK && !n_changed)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to adapt %u particles together", hair->n);
    while (st == GROOM_OK && i < iterations) {
        struct groom_retarget_step step = {.mean_movement = iterate(&s, n_changed)};
        if (progress_cancelled(job->context)) {
            st = groom_fail(diag, GROOM_ECANCELLED, "cancelled while strands were adapted together");
            break;
        }
        if (history && i < GROOM_RETARGET_MAX_HISTORY &&
            (st = coupled_energy(job, hair, (const float(*)[3])hair->p, &step.energy, diag)) != GROOM_OK)
            break;
        if (history && i < GROOM_RETARGET_MAX_HISTORY)
            history[i] = step;
        progress_loss(job->context, "energy", i, step.energy.total);
        i++;
        progress_report(job->context, job->progress_from + (job->progress_to - job->progress_from) * i / iterations);
        if (step.mean_movement < job->options->tolerance)
            break;
    }
    *n_iterations = i;
    memory_release(job->allocator, n_changed, s.n_pieces, sizeof *n_changed);
    system_finish(&s);
    return st;
}

/* --- energies ---------------------------------------------------------------------------------- */

struct measuring {
    const struct coupled *hair;
    const float (*at)[3];
    struct groom_retarget_energy *energies; /* [pieces] */
};

static void measure_shape(const struct measuring *m, uint32_t i, struct groom_retarget_energy *energy)
{
    double step[3], rest[3], length = 0, was = 0;
    for (int c = 0; c < 3; c++) {
        step[c] = (double)m->at[i + 1][c] - m->at[i][c];
        rest[c] = (double)m->hair->rest[i + 1][c] - m->hair->rest[i][c];
        length += step[c] * step[c];
        was += rest[c] * rest[c];
    }
    length = fmax(sqrt(length), 1e-6);
    was = sqrt(was);
    for (int c = 0; c < 3; c++) {
        double turn = step[c] / length - (was > 0 ? rest[c] / was : 0);
        energy->shape += turn * turn;
    }
}

static void measure_others(const struct measuring *m, uint32_t i, struct groom_retarget_energy *energy)
{
    const struct graph *graph = m->hair->graph;
    const uint32_t *neighbour = graph->neighbour + (size_t)i * graph->k;
    const float *weight = graph->weight + (size_t)i * graph->k;
    double gamma = m->hair->gamma ? m->hair->gamma[i] : 1;
    for (int c = 0; c < 3; c++) {
        double off = weight[0] > 0 ? (double)m->at[i][c] - m->hair->rest[i][c] : 0, away = (double)m->at[i][c] - m->hair->hat[i][c];
        for (uint32_t j = 0; j < graph->k; j++)
            off -= weight[j] * ((double)m->at[neighbour[j]][c] - m->hair->rest[neighbour[j]][c]);
        energy->inter += gamma * off * off;
        energy->body += gamma * away * away;
    }
}

static void measure_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct measuring *m = user;
    struct groom_retarget_energy energy = {0};
    (void)thread;
    for (uint32_t o = piece * COUPLED_PIECE; o < m->hair->n_strands && o < (piece + 1) * COUPLED_PIECE; o++) {
        uint32_t strand = m->hair->order[o];
        for (uint32_t i = m->hair->first[strand]; i < m->hair->first[strand + 1]; i++) {
            if (i + 1 < m->hair->first[strand + 1])
                measure_shape(m, i, &energy);
            measure_others(m, i, &energy);
        }
    }
    m->energies[piece] = energy;
}

groom_status coupled_energy(struct job *job, const struct coupled *hair, const float (*at)[3],
                            struct groom_retarget_energy *energy, struct groom_diag *diag)
{
    uint32_t n_pieces = hair->n_strands / COUPLED_PIECE + 1;
    struct measuring m = {.hair = hair, .at = at};
    if (!(m.energies = memory_array(job->allocator, n_pieces, sizeof *m.energies)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to measure energies");
    parallel_for(job->context, n_pieces, measure_piece, &m);
    *energy = (struct groom_retarget_energy){0};
    for (uint32_t i = 0; i < n_pieces; i++) {
        energy->shape += m.energies[i].shape;
        energy->inter += m.energies[i].inter;
        energy->body += m.energies[i].body;
    }
    energy->total = energy->shape + job->options->alpha * energy->inter + job->options->beta * energy->body;
    memory_release(job->allocator, m.energies, n_pieces, sizeof *m.energies);
    return GROOM_OK;
}
