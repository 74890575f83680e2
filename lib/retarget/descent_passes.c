/* The passes of descent.c. Strands are taken in the hair's order, so that neighbours are in the cache. */
#include <math.h>
#include <string.h>

#include "base/parallel.h"
#include "retarget/descent.h"

#define SHORTEST 0.02f      /* of the source's length: a segment counts as this long at least */
#define LEAST_LENGTH 1e-6f  /* metres */
#define LEAST_BUDGET 1e-4f  /* metres a particle moves at least before its plane is found anew */

typedef void strand_pass(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums);

struct pass {
    struct descent *s;
    strand_pass *of_strand;
    int of_all; /* strands, those that stay as well */
};

static void pass_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct pass *pass = user;
    const struct coupled *hair = pass->s->hair;
    struct descent_sums sums = {0};
    for (uint32_t o = piece * DESCENT_PIECE; o < hair->n_strands && o < (piece + 1) * DESCENT_PIECE; o++) {
        uint32_t strand = hair->order[o];
        if (pass->of_all || !hair->standing || !(hair->standing[strand] & STANDING_STAYS))
            pass->of_strand(pass->s, hair->first[strand], hair->first[strand + 1], thread, &sums);
    }
    pass->s->sums[piece] = sums;
}

static void pass_run(struct descent *s, strand_pass *of_strand, int of_all)
{
    struct pass pass = {s, of_strand, of_all};
    parallel_for(s->job->context, s->n_pieces, pass_piece, &pass);
}

struct descent_sums descent_total(const struct descent *s)
{
    struct descent_sums total = {0};
    for (uint32_t i = 0; i < s->n_pieces; i++) {
        const struct descent_sums *one = &s->sums[i];
        total.product += one->product;
        total.change += one->change;
        total.linear += one->linear;
        total.movement += one->movement;
        total.shape += one->shape;
        total.body += one->body;
        total.n_put_back += one->n_put_back;
    }
    return total;
}

/* --- half-spaces ------------------------------------------------------------------------------- */

static float length_of(quad v) { return sqrtf(point_dot(v, v)); }
static quad normal_of(const struct descent *s, uint32_t i) { return (quad){s->plane[i][0], s->plane[i][1], s->plane[i][2], 0}; }

static quad tangential(const struct descent *s, uint32_t i, quad v)
{
    return v - quad_of(point_dot(s->plane[i], v)) * normal_of(s, i);
}

/* The plane at p; a particle that is far from the surface has none. */
static void find_plane(struct descent *s, uint32_t i)
{
    const struct job *job = s->job;
    const float *p = s->hair->p[i];
    float budget = fmaxf((float)job->options->clearance, LEAST_BUDGET);
    struct plane plane;
    double level = 0, away = contact_plane(job, p, &plane);
    if (away > job->options->clearance + 2 * budget) {
        s->contact[i] = CONTACT_FREE;
        s->away[i] = (float)away;
        return;
    }
    for (int c = 0; c < 3; c++)
        level += plane.normal[c] * p[c];
    s->plane[i] = (quad){(float)plane.normal[0], (float)plane.normal[1], (float)plane.normal[2], (float)(level + plane.height)};
    s->away[i] = budget;
    if (s->contact[i] == CONTACT_FREE)
        s->contact[i] = CONTACT_KNOWN;
}

static void look_out(struct descent *s, uint32_t i)
{
    float clearance = (float)s->job->options->clearance;
    if (s->contact[i] != CONTACT_FREE) {
        if (s->away[i] < 0)
            find_plane(s, i);
    } else if (s->away[i] < clearance && (s->away[i] = contact_away(s->job, s->hair->p[i])) < clearance) {
        find_plane(s, i);
    }
}

/* Onto the plane, where p is behind it or slides on it. kd: how far that was. */
static int put_back(struct descent *s, uint32_t i)
{
    if (s->contact[i] != CONTACT_KNOWN && s->contact[i] != CONTACT_SLIDES)
        return 0;
    quad p = point_load(s->hair->p[i]);
    float above = point_dot(s->plane[i], p) - s->plane[i][3];
    if (above >= 0 && s->contact[i] == CONTACT_KNOWN)
        return 0;
    quad off = quad_of(-above) * normal_of(s, i);
    s->contact[i] = CONTACT_SLIDES;
    point_store(s->hair->p[i], p + off);
    point_store(s->kd[i], off);
    return 1;
}

/* --- d, and K d ------------------------------------------------------------------------------------ */

void descent_turn_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums)
{
    (void)thread;
    for (uint32_t i = first + 1; i < end; i++) {
        quad d = point_load(s->z[i]) + quad_of(s->turn) * point_load(s->d[i]);
        if (s->contact[i] == CONTACT_SLIDES)
            d = tangential(s, i, d);
        point_store(s->d[i], d);
        sums->product += point_dot(point_load(s->r[i]), d);
    }
}

void descent_turn(struct descent *s) { pass_run(s, descent_turn_strand, 0); }

static void difference_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums)
{
    (void)thread;
    (void)sums;
    for (uint32_t i = first; i < end; i++)
        point_store(s->z[i], links_difference(&s->links, i, (const float(*)[3])s->d));
}

LANES_INLINE void rest_of(const struct coupled *hair, uint32_t i, struct segment *segment)
{
    quad rest = point_load(hair->rest[i + 1]) - point_load(hair->rest[i]);
    float was = length_of(rest);
    segment->rest = rest * quad_of(was > 0 ? 1 / was : 0);
    segment->least = fmaxf(SHORTEST * was, LEAST_LENGTH);
}

LANES_INLINE void along_of(const struct coupled *hair, uint32_t i, struct segment *segment)
{
    quad step = point_load(hair->p[i + 1]) - point_load(hair->p[i]);
    segment->length = length_of(step);
    segment->free = segment->length >= segment->least;
    segment->inverse = 1 / (segment->free ? segment->length : segment->least);
    segment->along = step * quad_of(segment->free ? segment->inverse : 1 / fmaxf(segment->length, LEAST_LENGTH));
}

void descent_rest_strand(struct descent *s, uint32_t first, uint32_t end)
{
    for (uint32_t i = first; i + 1 < end; i++)
        rest_of(s->hair, i, &s->segments[i]);
}

/* The segment at p, kept where there is room to. */
LANES_INLINE struct segment renewed(const struct descent *s, uint32_t i)
{
    struct segment segment;
    if (s->segments)
        segment = s->segments[i];
    else
        rest_of(s->hair, i, &segment);
    along_of(s->hair, i, &segment);
    if (s->segments)
        s->segments[i] = segment;
    return segment;
}

/* The shape's second derivative across the segment; along it there is none. */
double descent_bend(const struct descent *s, uint32_t i)
{
    struct segment segment = s->segments ? s->segments[i] : renewed(s, i);
    quad across = point_load(s->d[i + 1]) - point_load(s->d[i]);
    if (segment.free)
        across -= quad_of(point_dot(across, segment.along)) * segment.along;
    return (double)point_dot(across, across) * segment.inverse * segment.inverse;
}

static void curve_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums)
{
    (void)thread;
    for (uint32_t i = first; i < end; i++) {
        quad d = point_load(s->d[i]);
        quad kd = links_pull(&s->links, i, (const float(*)[3])s->z) + quad_of(s->links.beta * links_gamma(&s->links, i)) * d;
        point_store(s->kd[i], kd);
        sums->product += point_dot(kd, d);
        if (i + 1 < end)
            sums->product += descent_bend(s, i);
    }
}

void descent_curve(struct descent *s)
{
    pass_run(s, difference_strand, 1);
    pass_run(s, curve_strand, 1);
}

/* --- p and q ------------------------------------------------------------------------------------------ */

void descent_move_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums)
{
    (void)thread;
    for (uint32_t i = first + 1; i < end; i++) {
        quad step = quad_of(s->along) * point_load(s->d[i]), before = point_load(s->q[i]);
        quad after = before - quad_of(s->along) * point_load(s->kd[i]);
        float way = length_of(step);
        point_store(s->hair->p[i], point_load(s->hair->p[i]) + step);
        point_store(s->q[i], after);
        sums->linear += point_dot(before + after, step);
        sums->movement += way;
        s->away[i] -= way * 1.00001f;
        look_out(s, i);
        s->put_back[i] = (uint8_t)put_back(s, i);
        sums->n_put_back += s->put_back[i];
    }
}

static void add_to(float q[3], float scale, quad v) { point_store(q, point_load(q) + quad_of(scale) * v); }

/* q -= K off where only particle i went off: its own row and those that have it for a neighbour. */
static double tell_others(struct descent *s, uint32_t i)
{
    const struct links *links = &s->links;
    const struct graph *graph = s->hair->graph;
    quad off = point_load(s->kd[i]), before = point_load(s->q[i]);
    add_to(s->q[i], -links->beta * links_gamma(links, i), off);
    for (uint32_t l = links->back_first[i]; l <= links->back_first[i + 1]; l++) {
        int own = l == links->back_first[i + 1];
        uint32_t row = own ? i : links->back_row[l];
        float pull = links->alpha * links_gamma(links, row) * (own ? (float)links_any(links, i) : -links->back_weight[l]);
        add_to(s->q[row], -pull * (float)links_any(links, row), off);
        for (uint32_t j = 0; j < graph->k; j++)
            add_to(s->q[graph->neighbour[(size_t)row * graph->k + j]], pull * graph->weight[(size_t)row * graph->k + j], off);
    }
    return point_dot(before + point_load(s->q[i]), off);
}

/* One after the other, as they write to each other's neighbours; there are few. */
static void tell_piece(struct descent *s, uint32_t piece)
{
    const struct coupled *hair = s->hair;
    for (uint32_t o = piece * DESCENT_PIECE; o < hair->n_strands && o < (piece + 1) * DESCENT_PIECE; o++)
        for (uint32_t i = hair->first[hair->order[o]] + 1; i < hair->first[hair->order[o] + 1]; i++)
            if (s->put_back[i])
                s->sums[piece].linear += tell_others(s, i);
}

void descent_move(struct descent *s)
{
    pass_run(s, descent_move_strand, 0);
    for (uint32_t piece = 0; piece < s->n_pieces; piece++)
        if (s->sums[piece].n_put_back > 0)
            tell_piece(s, piece);
}

/* --- r and z --------------------------------------------------------------------------------------------- */

/* r of a strand, its matrix for the preconditioner, and the energies that are its own. change: r less what it was.
 * returns how many of its particles slide */
static uint32_t pull_strand(struct descent *s, uint32_t first, uint32_t end, float *all_w, struct descent_sums *sums)
{
    quad before = quad_of(0);
    uint32_t n_slide = 0;
    for (uint32_t i = first; i < end; i++) {
        quad after = quad_of(0), off = point_load(s->hair->p[i]) - point_load(s->hair->hat[i]);
        float w = 0;
        if (i + 1 < end) {
            struct segment segment = renewed(s, i);
            quad turn = segment.along - segment.rest;
            sums->shape += point_dot(turn, turn);
            w = segment.inverse * segment.inverse;
            after = segment.free ? segment.along * quad_of(point_dot(segment.along, segment.rest)) - segment.rest
                                 : segment.along * quad_of(segment.length * segment.inverse) - segment.rest;
            after *= quad_of(segment.inverse);
        }
        sums->body += links_gamma(&s->links, i) * point_dot(off, off);
        quad r = after - before + point_load(s->q[i]);
        before = after;
        if (s->contact[i] == CONTACT_SLIDES && point_dot(s->plane[i], r) > 0)
            s->contact[i] = CONTACT_KNOWN;
        if (s->contact[i] == CONTACT_SLIDES)
            r = tangential(s, i, r);
        n_slide += s->contact[i] == CONTACT_SLIDES;
        all_w[i - first] = w;
        point_store(s->kd[i], r - point_load(s->r[i]));
        point_store(s->r[i], r);
    }
    return n_slide;
}

/* z = M^-1 r by Thomas's elimination. */
static void answer_free(struct descent *s, uint32_t first, uint32_t n, const struct descent_scratch *scratch)
{
    const float *w = scratch->w;
    float *pivot = scratch->pivot;
    quad carried = quad_of(0);
    for (uint32_t j = 1; j < n; j++) {
        float back = j > 1 ? w[j - 1] * pivot[j - 1] : 0;
        pivot[j] = 1 / (s->links.diagonal[first + j] + w[j - 1] + w[j] - w[j - 1] * back);
        carried = point_load(s->r[first + j]) + quad_of(back) * carried;
        point_store(s->z[first + j], carried);
    }
    carried = quad_of(0);
    for (uint32_t j = n - 1; j >= 1; j--) {
        carried = (point_load(s->z[first + j]) + quad_of(w[j]) * carried) * quad_of(pivot[j]);
        point_store(s->z[first + j], carried);
    }
}

/* The same where particles slide on their planes. */
static void answer_sliding(struct descent *s, uint32_t first, uint32_t n, struct descent_scratch *scratch)
{
    struct strand *strand = &scratch->sliding;
    strand->n = n;
    for (uint32_t j = 0; j < n; j++) {
        uint32_t i = first + j;
        strand->w[j] = scratch->w[j];
        strand->diagonal[j] = (double)s->links.diagonal[i] + strand->w[j] + (j ? strand->w[j - 1] : 0);
        strand->state[j] = s->contact[i] == CONTACT_SLIDES ? PLANE_ACTIVE : PLANE_UNKNOWN;
        for (int c = 0; c < 3; c++)
            strand->force[j][c] = s->r[i][c];
        if (strand->state[j] == PLANE_ACTIVE)
            strand->plane[j] = (struct plane){{s->plane[i][0], s->plane[i][1], s->plane[i][2]}, 0};
    }
    strand_solve_active(strand);
    for (uint32_t j = 1; j < n; j++)
        for (int c = 0; c < 3; c++)
            s->z[first + j][c] = (float)strand->d[j][c];
}

void descent_force_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums)
{
    struct descent_scratch *scratch = &s->scratch[thread];
    if (pull_strand(s, first, end, scratch->w, sums) > 0)
        answer_sliding(s, first, end - first, scratch);
    else
        answer_free(s, first, end - first, scratch);
    for (uint32_t i = first + 1; i < end; i++) {
        quad z = point_load(s->z[i]);
        sums->product += point_dot(point_load(s->r[i]), z);
        sums->change += point_dot(point_load(s->kd[i]), z);
    }
}

void descent_force(struct descent *s) { pass_run(s, descent_force_strand, 0); }

/* --- the start --------------------------------------------------------------------------------------------- */

uint32_t descent_place_strand(struct descent *s, uint32_t first, uint32_t end)
{
    uint32_t n_put_back = 0;
    s->contact[first] = CONTACT_ROOT;
    for (uint32_t i = first + 1; i < end; i++) {
        s->contact[i] = CONTACT_FREE;
        s->away[i] = 0;
        look_out(s, i);
        s->put_back[i] = (uint8_t)put_back(s, i);
        n_put_back += s->put_back[i];
    }
    return n_put_back;
}

static void place_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums)
{
    (void)thread;
    (void)sums;
    (void)descent_place_strand(s, first, end);
}

static void moved_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums)
{
    (void)thread;
    (void)sums;
    memset(s->put_back + first, 0, end - first);
    for (uint32_t i = first; i < end; i++)
        point_store(s->d[i], point_load(s->hair->p[i]) - point_load(s->hair->rest[i]));
}

static void pulled_strand(struct descent *s, uint32_t first, uint32_t end, uint32_t thread, struct descent_sums *sums)
{
    const struct coupled *hair = s->hair;
    (void)thread;
    (void)sums;
    for (uint32_t i = first; i < end; i++) {
        quad off = point_load(hair->p[i]) - point_load(hair->hat[i]);
        point_store(s->q[i], -links_pull(&s->links, i, (const float(*)[3])s->z) - quad_of(s->links.beta * links_gamma(&s->links, i)) * off);
        memset(s->r[i], 0, sizeof s->r[i]);
        memset(s->d[i], 0, sizeof s->d[i]);
    }
}

void descent_begin(struct descent *s)
{
    pass_run(s, place_strand, 0);
    pass_run(s, moved_strand, 1);
    pass_run(s, difference_strand, 1);
    pass_run(s, pulled_strand, 1);
    pass_run(s, descent_force_strand, 0);
}
