#include "model/scatter.h"

#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "model/frames.h"

#define GUIDES_A_PIECE 16

/* --- memory ----------------------------------------------------------------------- */

#define N_ARRAYS 10

struct array {
    void **memory;
    size_t count, size;
};

/* A count of 0 is an array that this chain does not need. */
static void list_arrays(struct scatter *s, struct array arrays[N_ARRAYS])
{
    const struct groom *groom = s->plan->groom;
    size_t points = (size_t)3 * groom->n_vertices, frame = s->plan->curls ? (size_t)FRAME_WIDTH * groom->n_vertices : 0;
    size_t axis = s->plan->bends ? AXIS_WIDTH : 0, n_gop = groom->n_operator_guides;
    const struct array list[N_ARRAYS] = {
        {(void **)&s->instance, WAVE * points, sizeof(float)},
        {(void **)&s->guide, s->plan->clumps ? WAVE * points : 0, sizeof(float)},
        {(void **)&s->frame, WAVE * frame, sizeof(float)},
        {(void **)&s->axis, WAVE * axis, sizeof(float)},
        {(void **)&s->d_frame, n_gop * frame, sizeof(float)},
        {(void **)&s->d_axis, n_gop * axis, sizeof(float)},
        {(void **)&s->guide_first, (size_t)groom->n_guides + 1, sizeof(uint32_t)},
        {(void **)&s->entry, WAVE * ((size_t)groom->n_instancing + 1), sizeof *s->entry},
        {(void **)&s->operator_first, n_gop + 1, sizeof(uint32_t)},
        {(void **)&s->member, WAVE, sizeof(uint32_t)},
    };
    memcpy(arrays, list, sizeof list);
}

groom_status scatter_init(struct scatter *s, const struct plan *plan, const struct groom_context *context)
{
    struct array arrays[N_ARRAYS];
    *s = (struct scatter){.plan = plan, .allocator = memory_allocator(context)};
    list_arrays(s, arrays);
    for (int i = 0; i < N_ARRAYS; i++) {
        if (arrays[i].count == 0)
            continue;
        *arrays[i].memory = memory_array_zero(s->allocator, arrays[i].count, arrays[i].size);
        if (!*arrays[i].memory) {
            scatter_finish(s);
            return GROOM_ENOMEM;
        }
    }
    return GROOM_OK;
}

void scatter_finish(struct scatter *s)
{
    if (!s->plan)
        return;
    struct array arrays[N_ARRAYS];
    list_arrays(s, arrays);
    for (int i = 0; i < N_ARRAYS; i++)
        memory_release(s->allocator, *arrays[i].memory, arrays[i].count, arrays[i].size);
    *s = (struct scatter){0};
}

/* --- one wave ---------------------------------------------------------------------- */

/* Counts in first[1 + key] become where each key begins; returns nothing lost: first[n] is the total. */
static void counts_to_firsts(uint32_t *first, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        first[i + 1] += first[i];
}

/* After filling with first[key]++, put the beginnings back. */
static void restore_firsts(uint32_t *first, uint32_t n)
{
    memmove(first + 1, first, n * sizeof *first);
    first[0] = 0;
}

static void sort_by_guide(struct scatter *s, const uint32_t *strand, uint32_t n)
{
    const struct groom *groom = s->plan->groom;
    uint32_t k = groom->n_instancing, *first = s->guide_first;
    size_t points = (size_t)3 * groom->n_vertices;
    memset(first, 0, ((size_t)groom->n_guides + 1) * sizeof *first);
    for (uint32_t v = 0; v < n; v++) {
        for (uint32_t a = 0; a < k; a++)
            first[1 + groom->instancing_guide[(size_t)strand[v] * k + a]]++;
        if (s->guide)
            first[1 + groom->operator_guide[groom->operator_guide_of[strand[v]]]]++;
    }
    counts_to_firsts(first, groom->n_guides);
    for (uint32_t v = 0; v < n; v++) {
        for (uint32_t a = 0; a < k; a++) {
            size_t at = (size_t)strand[v] * k + a;
            s->entry[first[groom->instancing_guide[at]]++] =
                (struct scatter_entry){s->instance + v * points, groom->instancing_weight[at]};
        }
        if (s->guide)
            s->entry[first[groom->operator_guide[groom->operator_guide_of[strand[v]]]]++] =
                (struct scatter_entry){s->guide + v * points, 1.0f};
    }
    restore_firsts(first, groom->n_guides);
}

static void sort_by_operator_guide(struct scatter *s, const uint32_t *strand, uint32_t n)
{
    const struct groom *groom = s->plan->groom;
    uint32_t *first = s->operator_first;
    memset(first, 0, ((size_t)groom->n_operator_guides + 1) * sizeof *first);
    for (uint32_t v = 0; v < n; v++)
        first[1 + groom->operator_guide_of[strand[v]]]++;
    counts_to_firsts(first, groom->n_operator_guides);
    for (uint32_t v = 0; v < n; v++)
        s->member[first[groom->operator_guide_of[strand[v]]]++] = v;
    restore_firsts(first, groom->n_operator_guides);
}

static void add_row(float *restrict sum, const float *restrict row, float weight, size_t n)
{
    for (size_t i = 0; i < n; i++)
        sum[i] += weight * row[i];
}

struct scattering {
    struct scatter *scatter;
    float (*d_guides)[3];
    uint32_t first; /* of a batch of operator guides, in scatter_frames */
    uint32_t n_guide_pieces;
};

static void add_to_guides(const struct scattering *job, uint32_t piece)
{
    const struct scatter *s = job->scatter;
    const struct groom *groom = s->plan->groom;
    uint32_t end = (piece + 1) * GUIDES_A_PIECE < groom->n_guides ? (piece + 1) * GUIDES_A_PIECE : groom->n_guides;
    for (uint32_t g = piece * GUIDES_A_PIECE; g < end; g++)
        for (uint32_t e = s->guide_first[g]; e < s->guide_first[g + 1]; e++)
            add_row(job->d_guides[(size_t)g * groom->n_vertices], s->entry[e].row, s->entry[e].weight,
                    (size_t)3 * groom->n_vertices);
}

static void add_to_operator_guides(const struct scattering *job, uint32_t piece)
{
    const struct scatter *s = job->scatter;
    const struct groom *groom = s->plan->groom;
    size_t frame = (size_t)FRAME_WIDTH * groom->n_vertices;
    uint32_t n = groom->n_operator_guides, end = (piece + 1) * GUIDES_A_PIECE < n ? (piece + 1) * GUIDES_A_PIECE : n;
    for (uint32_t o = piece * GUIDES_A_PIECE; o < end; o++)
        for (uint32_t e = s->operator_first[o]; e < s->operator_first[o + 1]; e++) {
            if (s->frame)
                add_row(s->d_frame + o * frame, s->frame + s->member[e] * frame, 1.0f, frame);
            if (s->axis)
                add_row(s->d_axis + (size_t)o * AXIS_WIDTH, s->axis + (size_t)s->member[e] * AXIS_WIDTH, 1.0f, AXIS_WIDTH);
        }
}

static void scatter_piece(void *user, uint32_t piece, uint32_t thread)
{
    (void)thread;
    const struct scattering *job = user;
    if (piece < job->n_guide_pieces)
        add_to_guides(job, piece);
    else
        add_to_operator_guides(job, piece - job->n_guide_pieces);
}

static uint32_t pieces_of(uint32_t n) { return n / GUIDES_A_PIECE + (n % GUIDES_A_PIECE != 0); }

void scatter_wave(struct scatter *s, const uint32_t *strand, uint32_t n, float (*d_guides)[3],
                  const struct groom_context *context)
{
    const struct groom *groom = s->plan->groom;
    struct scattering job = {.scatter = s, .d_guides = d_guides, .n_guide_pieces = pieces_of(groom->n_guides)};
    int framed = s->frame || s->axis;
    sort_by_guide(s, strand, n);
    if (framed)
        sort_by_operator_guide(s, strand, n);
    parallel_for(context, job.n_guide_pieces + (framed ? pieces_of(groom->n_operator_guides) : 0), scatter_piece, &job);
}

/* --- the frames ---------------------------------------------------------------------- */

/* Operator guides first .. first + WAVE - 1, each into a row of `instance`, which is free by now. */
static void frames_piece(void *user, uint32_t piece, uint32_t thread)
{
    (void)thread;
    const struct scattering *job = user;
    const struct scatter *s = job->scatter;
    const struct groom *groom = s->plan->groom;
    uint32_t m = groom->n_vertices;
    for (uint32_t i = piece * GUIDES_A_PIECE; i < (piece + 1) * GUIDES_A_PIECE && i < WAVE; i++) {
        uint32_t o = job->first + i;
        if (o >= groom->n_operator_guides)
            return;
        const float(*guide)[3] = (const float(*)[3])groom->guides + (size_t)groom->operator_guide[o] * m;
        float(*row)[3] = (float(*)[3])(s->instance + (size_t)i * 3 * m);
        memset(row, 0, m * sizeof *row);
        if (s->d_frame)
            frames_curl_backward(guide, m, s->plan->axes, s->d_frame + (size_t)o * FRAME_WIDTH * m, row);
        if (s->d_axis)
            frames_bend_backward(guide, s->plan->axes, s->d_axis + (size_t)o * AXIS_WIDTH, row);
    }
}

void scatter_frames(struct scatter *s, float (*d_guides)[3], const struct groom_context *context)
{
    const struct groom *groom = s->plan->groom;
    size_t points = (size_t)3 * groom->n_vertices;
    if (!s->d_frame && !s->d_axis)
        return;
    for (uint32_t first = 0; first < groom->n_operator_guides; first += WAVE) {
        struct scattering job = {.scatter = s, .first = first};
        uint32_t left = groom->n_operator_guides - first, n = left < WAVE ? left : WAVE;
        parallel_for(context, pieces_of(n), frames_piece, &job);
        for (uint32_t i = 0; i < n; i++) /* in order: two operator guides may be one guide */
            add_row(d_guides[(size_t)groom->operator_guide[first + i] * groom->n_vertices], s->instance + i * points,
                    1.0f, points);
    }
}
