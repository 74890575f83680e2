/* The fine scale: every strand by itself between the guides, which stay (Section 5, Eq. 14).
 *
 * With the guides fixed, L_i is p_i less a point: Eq. 14's term pulls a particle to where its neighbours on the
 * guides moved it, aim_i = p-bar_i + sum_j omega_j (moved of j). Iterations of one strand need no other, so each
 * strand is carried to its end while it is in the cache. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "retarget/descent.h"

#define PIECE 64             /* strands */
#define BATCH 32             /* pieces between two looks at progress */
#define SHORTEST 0.02        /* of the source's length: a segment counts as this long at least */
#define LEAST_LENGTH 1e-6    /* metres */
#define ROUNDS 40            /* of the active set */
#define ROUNDS_RELEASING 20  /* after these nothing is let go any more */
#define SLACK 1e-12          /* metres by which a half-space may be missed */

struct fine_space {
    struct strand strand;
    double (*rest)[3];       /* p-bar, relative to the source's centre */
    double (*hat)[3];
    double (*aim)[3];
    double (*direction)[3];  /* of the source's segment from i to i + 1, unit or 0 */
    double *length;          /* ... and its length */
    double *gamma;
    double (*p)[3];
    double *away;            /* the surface is so far from p at least */
    struct coupled one;      /* the strand as descent.h has it */
    struct descent descent;
};

struct fine {
    struct job *job;
    const float (*guide_moved)[3];
    const float (*at)[3];    /* energies: of these positions */
    float (*result)[3];      /* solving */
    struct fine_space *spaces;
    struct groom_retarget_energy *energies; /* [pieces] */
    uint32_t *iterations;    /* [pieces] */
};

/* --- a strand's numbers ---------------------------------------------------------------- */

static void load_rest(const struct groom_retarget_source *source, struct fine_space *s, uint32_t first, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            s->rest[i][c] = source->strands->points[first + i][c] - source->centre[c];
    for (uint32_t i = 0; i + 1 < n; i++) {
        double square = 0;
        for (int c = 0; c < 3; c++) {
            s->direction[i][c] = s->rest[i + 1][c] - s->rest[i][c];
            square += s->direction[i][c] * s->direction[i][c];
        }
        s->length[i] = sqrt(square);
        for (int c = 0; c < 3; c++)
            s->direction[i][c] = square > 0 ? s->direction[i][c] / s->length[i] : 0;
    }
}

static void load_aim(const struct fine *fine, struct fine_space *s, uint32_t first, uint32_t n)
{
    const struct graph *graph = &fine->job->source->to_guides;
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t *neighbour = graph->neighbour + (size_t)(first + i) * graph->k;
        const float *weight = graph->weight + (size_t)(first + i) * graph->k;
        memcpy(s->aim[i], s->rest[i], sizeof s->aim[i]);
        for (uint32_t j = 0; j < graph->k; j++)
            for (int c = 0; c < 3; c++)
                s->aim[i][c] += (double)weight[j] * fine->guide_moved[neighbour[j]][c];
    }
}

static void load(const struct fine *fine, struct fine_space *s, uint32_t strand)
{
    const struct job *job = fine->job;
    const struct groom_retarget_source *source = job->source;
    uint32_t first = source->strands->first[strand], n = source->strands->first[strand + 1] - first;
    double travel = 0, arc = 0;
    s->strand.n = n;
    load_rest(source, s, first, n);
    load_aim(fine, s, first, n);
    for (int c = 0; job->shift && c < 3; c++)
        travel += (double)job->shift[strand][c] * job->shift[strand][c];
    for (uint32_t i = 0; i < n; i++) {
        s->gamma[i] = adaptive_weight(arc, sqrt(travel), job->options->sigma_root);
        arc += i + 1 < n ? s->length[i] : 0;
        for (int c = 0; c < 3; c++) {
            s->hat[i][c] = job->hat[first + i][c];
            s->p[i][c] = s->hat[i][c] + (job->shift ? (1 - s->gamma[i]) * job->shift[strand][c] : 0);
        }
    }
}

/* --- one iteration of Section 4.6 -------------------------------------------------------- */

/* Lengths as they are now, the matrix, and the force that the energies have on each particle. */
static void linearise(const struct fine_space *s, const struct groom_retarget_options *options)
{
    const struct strand *q = &s->strand;
    uint32_t n = q->n;
    double tension[2][3] = {{0}};
    for (uint32_t i = 0; i < n; i++) {
        double *before = tension[i % 2], *after = tension[1 - i % 2], step[3] = {0, 0, 0}, length = 0;
        for (int c = 0; i + 1 < n && c < 3; c++) {
            step[c] = s->p[i + 1][c] - s->p[i][c];
            length += step[c] * step[c];
        }
        length = i + 1 < n ? fmax(fmax(sqrt(length), SHORTEST * s->length[i]), LEAST_LENGTH) : INFINITY;
        q->w[i] = 1 / (length * length);
        q->diagonal[i] = (i ? q->w[i - 1] : 0) + q->w[i] + (options->alpha + options->beta) * s->gamma[i];
        for (int c = 0; c < 3; c++) {
            after[c] = i + 1 < n ? q->w[i] * step[c] - s->direction[i][c] / length : 0;
            q->force[i][c] = after[c] - (i ? before[c] : 0) - options->alpha * s->gamma[i] * (s->p[i][c] - s->aim[i][c]) -
                             options->beta * s->gamma[i] * (s->p[i][c] - s->hat[i][c]);
        }
    }
}

static void to_floats(const double p[3], float out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = (float)p[c];
}

static void find_plane(const struct job *job, const struct fine_space *s, uint32_t i)
{
    float p[3];
    to_floats(s->p[i], p);
    s->away[i] = contact_plane(job, p, &s->strand.plane[i]);
    if (s->strand.state[i] == PLANE_UNKNOWN)
        s->strand.state[i] = PLANE_KNOWN;
}

static double moved(const double d[3]) { return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]); }

/* Whether particle i's movement would bring it through its half-space. A particle that moves less than its
 * distance from the surface less the clearance cannot be. */
static int misses(const struct job *job, const struct fine_space *s, uint32_t i)
{
    const struct strand *q = &s->strand;
    double way = moved(q->d[i]) + job->options->clearance;
    if (q->state[i] == PLANE_UNKNOWN) {
        float p[3];
        if (way < s->away[i])
            return 0;
        to_floats(s->p[i], p);
        s->away[i] = contact_away(job, p);
        if (way < s->away[i])
            return 0;
        find_plane(job, s, i);
    }
    double along = 0;
    for (int c = 0; c < 3; c++)
        along += q->plane[i].normal[c] * q->d[i][c];
    return along < q->plane[i].height - SLACK;
}

/* Which half-spaces hold: those that are missed are added, those that pull let go, until none changes. */
static void settle_contacts(const struct job *job, const struct fine_space *s, uint32_t n_active)
{
    const struct strand *q = &s->strand;
    for (int round = 0; round < ROUNDS; round++) {
        uint32_t n_changed = 0;
        if (n_active > 0)
            strand_solve_active(q);
        for (uint32_t i = 1; i < q->n; i++) {
            if (q->state[i] == PLANE_ACTIVE) {
                if (round < ROUNDS_RELEASING && strand_push(q, i) < 0) {
                    q->state[i] = PLANE_KNOWN;
                    n_active--;
                    n_changed++;
                }
            } else if (misses(job, s, i)) {
                q->state[i] = PLANE_ACTIVE;
                n_active++;
                n_changed++;
            }
        }
        if (n_changed == 0)
            return;
        if (n_active == 0)
            strand_solve(q);
    }
}

/* Last iteration's contacts are tried first. */
static uint32_t renew_contacts(const struct job *job, const struct fine_space *s)
{
    uint32_t n_active = 0;
    for (uint32_t i = 1; i < s->strand.n; i++) {
        if (s->strand.state[i] == PLANE_ACTIVE) {
            find_plane(job, s, i);
            n_active++;
        } else {
            s->strand.state[i] = PLANE_UNKNOWN;
        }
    }
    return n_active;
}

/* returns the mean movement */
static double move(const struct fine_space *s)
{
    double sum = 0;
    for (uint32_t i = 1; i < s->strand.n; i++) {
        double way = moved(s->strand.d[i]);
        s->away[i] -= way;
        sum += way;
        for (int c = 0; c < 3; c++)
            s->p[i][c] += s->strand.d[i][c];
    }
    return sum / s->strand.n;
}

/* The same without held lengths, in floats. */
static uint32_t descend(const struct job *job, struct fine_space *s)
{
    const struct groom_retarget_options *options = job->options;
    float(*rest)[3] = (float(*)[3])s->one.rest;
    for (uint32_t i = 0; i < s->strand.n; i++) {
        to_floats(s->rest[i], rest[i]);
        to_floats(s->p[i], s->one.p[i]);
        s->descent.links.diagonal[i] = (float)((options->alpha + options->beta) * s->gamma[i]);
        for (int c = 0; c < 3; c++)
            s->descent.q[i][c] = (float)-(s->gamma[i] * (options->alpha * (s->p[i][c] - s->aim[i][c]) +
                                                         options->beta * (s->p[i][c] - s->hat[i][c])));
    }
    uint32_t iterations = descent_strand_solve(&s->descent, s->strand.n);
    for (uint32_t i = 0; i < s->strand.n; i++)
        for (int c = 0; c < 3; c++)
            s->p[i][c] = s->one.p[i][c];
    return iterations;
}

/* returns how many iterations it took */
static uint32_t adapt(const struct job *job, const struct fine_space *s)
{
    const struct groom_retarget_options *options = job->options;
    uint32_t iteration = 0;
    memset(s->strand.state, PLANE_UNKNOWN, s->strand.n);
    for (uint32_t i = 0; i < s->strand.n; i++)
        s->away[i] = 0;
    while (iteration < options->iterations) {
        linearise(s, options);
        uint32_t n_active = iteration ? renew_contacts(job, s) : 0;
        if (n_active == 0)
            strand_solve(&s->strand);
        settle_contacts(job, s, n_active);
        iteration++;
        if (move(s) < options->tolerance)
            break;
    }
    return iteration;
}

static uint32_t carry_on(const struct job *job, struct fine_space *s, uint32_t strand)
{
    if (job->standing[strand] & STANDING_STAYS)
        return 0;
    return job->options->tolerance > 0 ? descend(job, s) : adapt(job, s);
}

/* --- energies -------------------------------------------------------------------------------- */

static void add_energy(const struct fine_space *s, struct groom_retarget_energy *energy)
{
    for (uint32_t i = 0; i < s->strand.n; i++) {
        double length = 0, step[3] = {0, 0, 0};
        for (int c = 0; i + 1 < s->strand.n && c < 3; c++) {
            step[c] = s->p[i + 1][c] - s->p[i][c];
            length += step[c] * step[c];
        }
        length = fmax(sqrt(length), LEAST_LENGTH);
        for (int c = 0; c < 3; c++) {
            double turn = i + 1 < s->strand.n ? step[c] / length - s->direction[i][c] : 0;
            double off = s->p[i][c] - s->aim[i][c], away = s->p[i][c] - s->hat[i][c];
            energy->shape += turn * turn;
            energy->inter += s->gamma[i] * off * off;
            energy->body += s->gamma[i] * away * away;
        }
    }
}

/* --- all strands ------------------------------------------------------------------------------- */

static void fine_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct fine *fine = user;
    const struct groom_retarget_source *source = fine->job->source;
    struct fine_space *s = &fine->spaces[thread];
    for (uint32_t i = piece * PIECE; i < source->strands->n_strands && i - piece * PIECE < PIECE; i++) {
        uint32_t first = source->strands->first[i];
        if (source->is_guide[i])
            continue;
        load(fine, s, i);
        if (fine->result) {
            uint32_t n = carry_on(fine->job, s, i);
            fine->iterations[piece] = n > fine->iterations[piece] ? n : fine->iterations[piece];
            for (uint32_t j = 0; j < s->strand.n; j++)
                to_floats(s->p[j], fine->result[first + j]);
        } else {
            for (uint32_t j = 0; j < s->strand.n; j++)
                for (int c = 0; c < 3; c++)
                    s->p[j][c] = fine->at[first + j][c];
        }
        add_energy(s, &fine->energies[piece]);
    }
}

static void space_finish(struct fine_space *s, uint32_t longest, const struct groom_allocator *allocator)
{
    descent_strand_finish(&s->descent, &s->one, longest);
    strand_finish(&s->strand, longest, allocator);
    memory_release(allocator, s->rest, longest, sizeof *s->rest);
    memory_release(allocator, s->hat, longest, sizeof *s->hat);
    memory_release(allocator, s->aim, longest, sizeof *s->aim);
    memory_release(allocator, s->direction, longest, sizeof *s->direction);
    memory_release(allocator, s->length, longest, sizeof *s->length);
    memory_release(allocator, s->gamma, longest, sizeof *s->gamma);
    memory_release(allocator, s->p, longest, sizeof *s->p);
    memory_release(allocator, s->away, longest, sizeof *s->away);
}

static int space_init(struct fine_space *s, struct job *job, uint32_t longest)
{
    const struct groom_allocator *allocator = job->allocator;
    int ready = strand_init(&s->strand, longest, allocator) && descent_strand_init(&s->descent, &s->one, job, longest);
    s->rest = memory_array(allocator, longest, sizeof *s->rest);
    s->hat = memory_array(allocator, longest, sizeof *s->hat);
    s->aim = memory_array(allocator, longest, sizeof *s->aim);
    s->direction = memory_array(allocator, longest, sizeof *s->direction);
    s->length = memory_array(allocator, longest, sizeof *s->length);
    s->gamma = memory_array(allocator, longest, sizeof *s->gamma);
    s->p = memory_array(allocator, longest, sizeof *s->p);
    s->away = memory_array(allocator, longest, sizeof *s->away);
    return ready && s->rest && s->hat && s->aim && s->direction && s->length && s->gamma && s->p && s->away;
}

static groom_status run_batches(struct fine *fine, uint32_t n_pieces, struct groom_diag *diag)
{
    const struct job *job = fine->job;
    struct batches batches = {.n_pieces = n_pieces, .batch = BATCH, .from = job->progress_from,
                              .to = fine->result ? job->progress_to : job->progress_from, .doing = "strands were adapted"};
    return batches_run(job->context, &batches, fine_piece, fine, diag);
}

static groom_status fine_run(struct fine *fine, struct groom_retarget_energy *energy, struct groom_diag *diag)
{
    struct job *job = fine->job;
    uint32_t n_threads = parallel_threads(job->context), n_pieces = job->source->strands->n_strands / PIECE + 1;
    uint32_t longest = job->source->longest;
    groom_status st = GROOM_OK;
    fine->spaces = memory_array_zero(job->allocator, n_threads, sizeof *fine->spaces);
    fine->energies = memory_array_zero(job->allocator, n_pieces, sizeof *fine->energies);
    fine->iterations = memory_array_zero(job->allocator, n_pieces, sizeof *fine->iterations);
    int ready = fine->spaces && fine->energies && fine->iterations;
    for (uint32_t i = 0; ready && i < n_threads; i++)
        ready = space_init(&fine->spaces[i], job, longest);
    st = ready ? run_batches(fine, n_pieces, diag) : groom_fail(diag, GROOM_ENOMEM, "no memory to adapt strands");
    *energy = (struct groom_retarget_energy){0};
    for (uint32_t i = 0; ready && i < n_pieces; i++) {
        energy->shape += fine->energies[i].shape;
        energy->inter += fine->energies[i].inter;
        energy->body += fine->energies[i].body;
        if (fine->iterations[i] > job->report->iterations_fine)
            job->report->iterations_fine = fine->iterations[i];
    }
    energy->total = energy->shape + job->options->alpha * energy->inter + job->options->beta * energy->body;
    for (uint32_t i = 0; fine->spaces && i < n_threads; i++)
        space_finish(&fine->spaces[i], longest, job->allocator);
    memory_release(job->allocator, fine->spaces, n_threads, sizeof *fine->spaces);
    memory_release(job->allocator, fine->energies, n_pieces, sizeof *fine->energies);
    memory_release(job->allocator, fine->iterations, n_pieces, sizeof *fine->iterations);
    return st;
}

groom_status fine_solve(struct job *job, const float (*guide_moved)[3], float (*result)[3],
                        struct groom_retarget_energy *energy, struct groom_diag *diag)
{
    struct fine fine = {.job = job, .guide_moved = guide_moved, .result = result};
    return fine_run(&fine, energy, diag);
}

groom_status fine_energy(struct job *job, const float (*guide_moved)[3], const float (*at)[3],
                         struct groom_retarget_energy *energy, struct groom_diag *diag)
{
    struct fine fine = {.job = job, .guide_moved = guide_moved, .at = at};
    return fine_run(&fine, energy, diag);
}
