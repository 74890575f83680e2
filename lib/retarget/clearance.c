/* The exact last pass: iterations hold half-spaces of the surface as it was seen from where particles came;
 * here everything is looked at where it is. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/vec.h"
#include "retarget/job.h"

#define PIECE 64             /* strands */
#define BATCH 32             /* pieces between two looks at progress */
#define ROUNDS 60
#define ROUNDS_GENTLE 12     /* after these each push goes farther than the one before: out of creases */
#define BEYOND 1.001         /* pushed to so many clearances, so that what was pushed is clear */
#define JUST_CLEAR 2e-6      /* metres that stubble stands off the surface at least */
#define ROOT_SEGMENT 0.25    /* share of the clearance for the middle of a segment that begins on the surface */

/* Where a point is: how far outside (negative inside) and which way leads out. */
struct place {
    double outside;
    struct vec out;
};

/* A walk along a strand: where the last point was that was measured, and how far outside. */
struct walk {
    float p[3];
    double outside;
};

static struct walk walk_begin(void) { return (struct walk){{0, 0, 0}, -INFINITY}; }

static double apart(const float a[3], const float b[3]) { return vec_length(vec_sub(vec_of(a), vec_of(b))); }

/* Points that are surely more than `enough` outside are not asked for: INFINITY. From a point that is far enough
 * outside the next ones on the strand are, too. */
static struct place place_of(const struct job *job, const float p[3], double enough, struct walk *walk)
{
    struct groom_surface_point near;
    struct place place = {INFINITY, {0, 0, 0}};
    if (walk->outside - apart(walk->p, p) > enough || field_away(&job->field, p) > enough)
        return place;
    place.outside = field_signed(&job->field, p, &near);
    memcpy(walk->p, p, sizeof walk->p);
    walk->outside = 0.99999 * place.outside;
    if (place.outside == INFINITY)
        return place;
    struct vec d = vec_sub(vec_of(p), vec_of(near.position)), normal = vec_of(near.normal);
    double distance = vec_length(d);
    place.out = distance > 1e-7 ? vec_scale(d, (place.outside < 0 ? -1 : 1) / distance) : normal;
    return place;
}

static void push(float p[3], struct vec out, double way)
{
    p[0] = (float)(p[0] + way * out.x);
    p[1] = (float)(p[1] + way * out.y);
    p[2] = (float)(p[2] + way * out.z);
}

static void middle(const float a[3], const float b[3], float out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = 0.5f * (a[c] + b[c]);
}

/* --- counting ---------------------------------------------------------------------------------- */

static void count_strand(const struct job *job, const float (*p)[3], uint32_t n, double clearance, struct groom_retarget_inside *inside)
{
    struct walk walk = walk_begin();
    for (uint32_t i = 0; i + 1 < n; i++) {
        float m[3];
        middle(p[i], p[i + 1], m);
        struct place between = place_of(job, m, 0, &walk), at = place_of(job, p[i + 1], clearance, &walk);
        inside->near_vertices += at.outside < clearance;
        inside->vertices += at.outside < 0;
        inside->segments += between.outside < 0;
        inside->deepest = fmax(inside->deepest, -at.outside);
    }
}

/* --- pushing -------------------------------------------------------------------------------- */

static int clear_vertices(const struct job *job, float (*p)[3], uint32_t n, double effort)
{
    double clearance = job->options->clearance;
    struct walk walk = walk_begin();
    int n_pushed = 0;
    for (uint32_t i = 1; i < n; i++) {
        struct place place = place_of(job, p[i], clearance, &walk);
        if (place.outside >= clearance)
            continue;
        push(p[i], place.out, effort * (BEYOND * clearance - place.outside));
        n_pushed++;
    }
    return n_pushed;
}

static int clear_middles(const struct job *job, float (*p)[3], uint32_t n, double effort)
{
    struct walk walk = walk_begin();
    int n_pushed = 0;
    for (uint32_t i = 0; i + 1 < n; i++) {
        double wanted = job->options->clearance * (i ? 1 : ROOT_SEGMENT), way;
        float m[3];
        middle(p[i], p[i + 1], m);
        struct place place = place_of(job, m, wanted, &walk);
        if (place.outside >= wanted)
            continue;
        way = effort * (BEYOND * wanted - place.outside);
        if (i)
            push(p[i], place.out, way);
        push(p[i + 1], place.out, i ? way : 2 * way);
        n_pushed++;
    }
    return n_pushed;
}

/* Whether the strand can be anywhere near: one look at each vertex, as most strands need no more. */
static int may_touch(const struct job *job, const float (*p)[3], uint32_t n)
{
    for (uint32_t i = 0; i + 1 < n; i++) {
        double half = vec_length(vec_sub(vec_of(p[i + 1]), vec_of(p[i]))) / 2;
        if (field_away(&job->field, p[i + 1]) <= job->options->clearance + half)
            return 1;
    }
    return 0;
}

/* returns 1 where nothing is left that is too near */
static int clear_strand(const struct job *job, float (*p)[3], uint32_t n)
{
    if (!may_touch(job, (const float(*)[3])p, n))
        n = 2; /* but for the segment at the root */
    for (int round = 0; round < ROUNDS; round++) {
        double effort = round < ROUNDS_GENTLE ? 1 : 1 + 0.25 * (round - ROUNDS_GENTLE);
        int n_pushed = clear_vertices(job, p, n, effort);
        n_pushed += clear_middles(job, p, n, effort);
        if (n_pushed == 0)
            return 1;
    }
    return 0;
}

/* --- stubble ---------------------------------------------------------------------------------- */

/* Whether a strand of the source is shorter than the clearance: it can have its length or be clear, not both. A groomer
 * shaves to a length, so that is what it keeps. */
static int is_short(const struct job *job, uint32_t strand)
{
    const struct groom_strands *strands = job->source->strands;
    double length = 0;
    for (uint32_t i = strands->first[strand]; i + 1 < strands->first[strand + 1] && length < job->options->clearance; i++)
        length += apart(strands->points[i], strands->points[i + 1]);
    return length < job->options->clearance;
}

/* On the surface floats cannot tell in from out: all but the root are a little above it. */
static void stand_up(const struct job *job, uint32_t strand, float (*p)[3], uint32_t n)
{
    const float(*rest)[3] = (const float(*)[3])job->source->strands->points + job->source->strands->first[strand];
    struct groom_surface_point near;
    double outside = field_signed(&job->field, p[0], &near), arc;
    if (outside == INFINITY)
        return;
    arc = JUST_CLEAR + 2.1 * fmax(0, -outside); /* the first segment's middle, too */
    for (uint32_t i = 1; i < n; i++) {
        arc += apart(rest[i - 1], rest[i]);
        memcpy(p[i], p[0], sizeof p[i]);
        push(p[i], vec_of(near.normal), arc);
    }
}

/* --- all strands --------------------------------------------------------------------------------- */

struct clearing {
    struct job *job;
    float (*points)[3];
    int push;
    struct groom_retarget_inside *inside; /* [pieces] */
};

static void count_before(struct job *job, const float (*p)[3], uint32_t n, uint32_t strand, struct groom_retarget_inside *inside)
{
    uint64_t last = inside->near_vertices + inside->segments;
    count_strand(job, p, n, job->options->clearance, inside);
    if (job->standing && inside->near_vertices + inside->segments > last)
        job->standing[strand] = STANDING_IN_CONFLICT;
}

static void clear_one(struct job *job, uint32_t strand, float (*p)[3], uint32_t n, struct groom_retarget_inside *inside)
{
    if (job->standing[strand] & STANDING_STAYS)
        return;
    if (is_short(job, strand)) {
        job->standing[strand] |= STANDING_SHORT;
        stand_up(job, strand, p, n);
        count_strand(job, (const float(*)[3])p, n, 0, inside);
    } else if (!clear_strand(job, p, n)) {
        count_strand(job, (const float(*)[3])p, n, job->options->clearance, inside);
    }
}

/* What was cleared to the end has nothing to count. */
static void clear_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct clearing *clearing = user;
    const struct groom_strands *strands = clearing->job->source->strands;
    (void)thread;
    clearing->inside[piece] = (struct groom_retarget_inside){0};
    for (uint32_t i = piece * PIECE; i < strands->n_strands && i - piece * PIECE < PIECE; i++) {
        float(*p)[3] = clearing->points + strands->first[i];
        uint32_t n = strands->first[i + 1] - strands->first[i];
        if (clearing->push)
            clear_one(clearing->job, i, p, n, &clearing->inside[piece]);
        else
            count_before(clearing->job, (const float(*)[3])p, n, i, &clearing->inside[piece]);
    }
}

static groom_status run(struct clearing *clearing, double from, double to, struct groom_retarget_inside *inside,
                        struct groom_diag *diag)
{
    struct job *job = clearing->job;
    struct batches batches = {.n_pieces = job->source->strands->n_strands / PIECE + 1, .batch = BATCH, .from = from, .to = to,
                              .doing = clearing->push ? "strands were moved out of the body" : "what is inside was counted"};
    if (!(clearing->inside = memory_array(job->allocator, batches.n_pieces, sizeof *clearing->inside)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to count what is inside");
    groom_status st = batches_run(job->context, &batches, clear_piece, clearing, diag);
    *inside = (struct groom_retarget_inside){0};
    for (uint32_t i = 0; st == GROOM_OK && i < batches.n_pieces; i++) {
        inside->vertices += clearing->inside[i].vertices;
        inside->segments += clearing->inside[i].segments;
        inside->near_vertices += clearing->inside[i].near_vertices;
        inside->deepest = fmax(inside->deepest, clearing->inside[i].deepest);
    }
    memory_release(job->allocator, clearing->inside, batches.n_pieces, sizeof *clearing->inside);
    return st;
}

groom_status clearance_apply(struct job *job, float (*points)[3], struct groom_retarget_inside *left, struct groom_diag *diag)
{
    struct clearing clearing = {.job = job, .points = points, .push = 1};
    return run(&clearing, ADAPTED, CLEARED, left, diag);
}

groom_status clearance_count(struct job *job, float (*points)[3], struct groom_retarget_inside *inside, struct groom_diag *diag)
{
    struct clearing clearing = {.job = job, .points = points};
    return run(&clearing, TRANSFERRED, COUNTED, inside, diag);
}
