#include "fit/checkpoint.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/checksum.h"
#include "fit/axes.h"
#include "fit/state.h"

#define MOST_GUIDES 10000 /* that options can ask for */

static const char magic[8] = {'G', 'R', 'O', 'O', 'M', 'F', 'I', 'T'};

/* One walk over the state serves both ways: with a pen that writes, counts or reads, so that what is
 * saved and what is loaded can't fall apart. */
struct pen {
    enum { COUNT, WRITE, READ } mode;
    groom_status status;
    uint64_t n_bytes;                /* so far */
    struct checksum checksum;        /* WRITE */
    struct groom_sink sink;          /* WRITE */
    const unsigned char *at, *end;   /* READ */
};

static void pen_bytes(struct pen *pen, void *bytes, size_t n)
{
    if (pen->status != GROOM_OK || n == 0)
        return;
    if (pen->mode == READ) {
        if ((size_t)(pen->end - pen->at) < n) {
            pen->status = GROOM_EFORMAT;
            return;
        }
        memcpy(bytes, pen->at, n);
        pen->at += n;
    } else if (pen->mode == WRITE) {
        pen->status = pen->sink.write(pen->sink.user, bytes, n);
        checksum_add(&pen->checksum, bytes, n);
    }
    pen->n_bytes += n;
}

static void pen_u32(struct pen *pen, uint32_t *value) { pen_bytes(pen, value, sizeof *value); }

/* --- the state ---------------------------------------------------------------------- */

static size_t random_count(const struct groom *groom, groom_operator_type type)
{
    return groom_operator_random_per_guide(type) ? groom->n_operator_guides : groom->n_strands;
}

static void pen_operator(struct pen *pen, struct groom *groom, uint32_t index)
{
    uint32_t type = pen->mode == READ ? 0 : groom->operators[index].type, enabled = 0;
    pen_u32(pen, &type);
    if (pen->mode == READ && pen->status == GROOM_OK) {
        pen->status = type < GROOM_OPERATOR_COUNT ? GROOM_OK : GROOM_EFORMAT;
        if (pen->status == GROOM_OK)
            pen->status = groom_insert_operator(groom, index, (groom_operator_type)type, 0, NULL);
    }
    if (pen->status != GROOM_OK)
        return;
    struct groom_operator *op = &groom->operators[index];
    enabled = op->enabled != 0;
    pen_u32(pen, &enabled);
    op->enabled = enabled != 0;
    pen_bytes(pen, &op->seed, sizeof op->seed);
    pen_u32(pen, &op->id);
    pen_bytes(pen, op->parameter, sizeof op->parameter);
    for (uint32_t r = 0; r < groom_operator_random_arrays(op->type); r++)
        pen_bytes(pen, op->random[r], random_count(groom, op->type) * sizeof *op->random[r]);
}

static void pen_shape(struct pen *pen, struct groom_fit *fit, struct groom_shape *shape)
{
    if (pen->mode != READ)
        *shape = (struct groom_shape){fit->n, fit->m, fit->groom->n_guides, fit->groom->n_operator_guides,
                                      fit->groom->n_instancing};
    pen_bytes(pen, shape, sizeof *shape);
}

/* A groom of the shape that was read, if that can be one of this fit. */
static void make_groom(struct pen *pen, struct groom_fit *fit, const struct groom_shape *shape)
{
    struct groom_context own = {.allocator = fit->allocator};
    if (pen->status != GROOM_OK)
        return;
    if (shape->n_strands != fit->n || shape->n_vertices != fit->m || shape->n_guides != fit->n_guides ||
        shape->n_operator_guides > shape->n_guides || shape->n_instancing > shape->n_guides ||
        shape->n_operator_guides == 0 || shape->n_instancing == 0 || shape->n_instancing > 16) {
        pen->status = GROOM_EFORMAT;
        return;
    }
    if ((pen->status = groom_create(*shape, &own, &fit->groom, NULL)) != GROOM_OK)
        return;
    memcpy(fit->groom->roots, fit->roots, fit->n * sizeof *fit->roots);
    memcpy(fit->groom->root_uv, fit->root_uv, fit->n * sizeof *fit->root_uv);
    fit->groom->scalp = fit->report.scalp;
    axes_give(fit);
}

static void pen_groom(struct pen *pen, struct groom_fit *fit)
{
    struct groom_shape shape = {0};
    uint32_t n_operators = fit->groom ? fit->groom->n_operators : 0;
    pen_shape(pen, fit, &shape);
    if (pen->mode == READ)
        make_groom(pen, fit, &shape);
    if (pen->status != GROOM_OK)
        return;
    struct groom *groom = fit->groom;
    size_t n = shape.n_strands, k = shape.n_instancing, n_g = shape.n_guides;
    pen_bytes(pen, groom->guides, n_g * shape.n_vertices * sizeof *groom->guides);
    pen_bytes(pen, groom->guide_uv, n_g * sizeof *groom->guide_uv);
    pen_bytes(pen, groom->instancing_guide, n * k * sizeof *groom->instancing_guide);
    pen_bytes(pen, groom->instancing_weight, n * k * sizeof *groom->instancing_weight);
    pen_bytes(pen, groom->operator_guide, shape.n_operator_guides * sizeof *groom->operator_guide);
    pen_bytes(pen, groom->operator_guide_of, n * sizeof *groom->operator_guide_of);
    pen_u32(pen, &n_operators);
    if (n_operators > GROOM_FIT_MAX_OPERATORS)
        pen->status = GROOM_EFORMAT;
    for (uint32_t i = 0; pen->status == GROOM_OK && i < n_operators; i++)
        pen_operator(pen, groom, i);
}

static void pen_clusters(struct pen *pen, struct groom_fit *fit)
{
    if (pen->mode == READ && pen->status == GROOM_OK) {
        if (fit->n_guides > fit->n) {
            fit->n_guides = 0;
            pen->status = GROOM_EFORMAT;
            return;
        }
        fit->centroids = memory_array(fit->allocator, (size_t)fit->n_guides * fit->m, sizeof *fit->centroids);
        fit->cluster_of = memory_array(fit->allocator, fit->n, sizeof *fit->cluster_of);
        if (!fit->centroids || !fit->cluster_of)
            pen->status = GROOM_ENOMEM;
    }
    pen_bytes(pen, fit->centroids, (size_t)fit->n_guides * fit->m * sizeof *fit->centroids);
    pen_bytes(pen, fit->cluster_of, fit->n * sizeof *fit->cluster_of);
}

/* Numbers that a descent keeps at most: two for each random number of strands and operator guides, or nine
 * for each vertex of the guides (paper_guides.h). */
static uint64_t most_moments(const struct groom_fit *fit)
{
    uint64_t n_guides = fit->n < MOST_GUIDES ? fit->n : MOST_GUIDES;
    return (uint64_t)fit->n * GROOM_FIT_MAX_OPERATORS * 4 + n_guides * fit->m * 9;
}

static void pen_moments(struct pen *pen, struct groom_fit *fit)
{
    uint32_t n = fit->n_moments;
    pen_u32(pen, &n);
    if (pen->mode == READ && pen->status == GROOM_OK) {
        if (n > most_moments(fit) || (size_t)(pen->end - pen->at) < n * sizeof *fit->moments) {
            pen->status = GROOM_EFORMAT;
            return;
        }
        if (n > 0 && !(fit->moments = memory_array(fit->allocator, n, sizeof *fit->moments))) {
            pen->status = GROOM_ENOMEM;
            return;
        }
        fit->n_moments = n;
    }
    pen_bytes(pen, fit->moments, fit->n_moments * sizeof *fit->moments);
}

static void pen_state(struct pen *pen, struct groom_fit *fit)
{
    uint32_t has_groom = fit->groom != NULL, report_bytes = sizeof fit->report;
    pen_u32(pen, &report_bytes);
    if (report_bytes != sizeof fit->report)
        pen->status = GROOM_EFORMAT;
    pen_bytes(pen, &fit->report, sizeof fit->report);
    pen_u32(pen, &fit->stage);
    pen_u32(pen, &fit->phase);
    pen_u32(pen, &fit->iteration);
    pen_bytes(pen, fit->frame, sizeof fit->frame);
    pen_u32(pen, &fit->axes);
    pen_u32(pen, &fit->axes_looks);
    pen_u32(pen, &fit->n_guides);
    if (fit->n_guides > 0)
        pen_clusters(pen, fit);
    pen_u32(pen, &has_groom);
    if (has_groom && pen->status == GROOM_OK)
        pen_groom(pen, fit);
    pen_moments(pen, fit);
    if (pen->mode == READ && pen->at != pen->end)
        pen->status = pen->status == GROOM_OK ? GROOM_EFORMAT : pen->status;
}

/* --- saving ---------------------------------------------------------------------------- */

groom_status groom_fit_save(const struct groom_fit *fit, struct groom_sink sink, struct groom_diag *diag)
{
    /* the walk changes nothing unless its pen reads */
    struct groom_fit *state = (struct groom_fit *)(uintptr_t)fit;
    struct pen count = {.mode = COUNT}, pen = {.mode = WRITE, .sink = sink};
    struct checkpoint_header header = {.version = CHECKPOINT_VERSION, .inputs = fit->inputs};
    uint64_t checksum;
    groom_status st;

    pen_state(&count, state);
    memcpy(header.magic, magic, sizeof magic);
    header.payload_bytes = count.n_bytes;
    if ((st = sink.write(sink.user, &header, sizeof header)) != GROOM_OK)
        goto out;
    pen_state(&pen, state);
    if ((st = pen.status) != GROOM_OK)
        goto out;
    checksum = checksum_finish(&pen.checksum);
    st = sink.write(sink.user, &checksum, sizeof checksum);
out:
    return st == GROOM_OK ? st : groom_fail(diag, st, "a checkpoint of %llu bytes could not be written",
                                            (unsigned long long)(sizeof header + count.n_bytes + 8));
}

/* --- loading ---------------------------------------------------------------------------- */

static int indices_below(const uint32_t *indices, size_t n, uint32_t limit)
{
    for (size_t i = 0; i < n; i++)
        if (indices[i] >= limit)
            return 0;
    return 1;
}

static int all_finite(const float *values, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(values[i]))
            return 0;
    return 1;
}

static int sound_groom(const struct groom_fit *fit)
{
    const struct groom *groom = fit->groom;
    size_t n = groom->n_strands, k = groom->n_instancing;
    return indices_below(groom->instancing_guide, n * k, groom->n_guides) &&
           indices_below(groom->operator_guide, groom->n_operator_guides, groom->n_guides) &&
           indices_below(groom->operator_guide_of, n, groom->n_operator_guides) &&
           all_finite(groom->guides[0], (size_t)groom->n_guides * groom->n_vertices * 3) &&
           all_finite(groom->guide_uv[0], groom->n_guides * 2) && all_finite(groom->instancing_weight, n * k);
}

static int sound_report(const struct groom_fit_report *report)
{
    int sound = report->n_losses <= GROOM_FIT_MAX_LOSSES && report->n_notes <= GROOM_FIT_MAX_NOTES &&
                report->scalp <= GROOM_SCALP_FILE;
    for (int i = 0; i < GROOM_FIT_MAX_LOSSES; i++)
        sound &= memchr(report->losses[i].stage, 0, sizeof report->losses[i].stage) != NULL &&
                 memchr(report->losses[i].name, 0, sizeof report->losses[i].name) != NULL;
    for (int i = 0; i < GROOM_FIT_MAX_NOTES; i++)
        sound &= memchr(report->notes[i], 0, sizeof report->notes[i]) != NULL;
    return sound;
}

static int sound_axes(const struct groom_fit *fit)
{
    int sound = fit->axes <= AXES_FOUND && fit->axes_looks <= 2;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            sound &= fabs(fit->frame[i][j]) <= 1.001;
    return sound;
}

static int sound_state(const struct groom_fit *fit)
{
    if (!sound_report(&fit->report) || fit->stage > FIT_N_STAGES || !sound_axes(fit))
        return 0;
    if (fit->n_guides > 0 && (!indices_below(fit->cluster_of, fit->n, fit->n_guides) ||
                              !all_finite(fit->centroids[0], (size_t)fit->n_guides * fit->m * 3)))
        return 0;
    if (fit->groom && !sound_groom(fit))
        return 0;
    if (!all_finite(fit->moments, fit->n_moments))
        return 0;
    if (fit->stage > 0 && !(fit->groom && groom_validate(fit->groom, NULL) == GROOM_OK && fit->n_guides > 0))
        return 0;
    return fit->stage == FIT_N_STAGES || fit_stages[fit->stage].sound(fit);
}

/* What can be in a checkpoint of this fit at most. */
static uint64_t most_bytes(const struct groom_fit *fit)
{
    uint64_t n = fit->n, points = n * fit->m * 12;
    return 4096 + sizeof fit->report + 2 * points + n * (16 * 8 + 64 + GROOM_FIT_MAX_OPERATORS * 8) +
           4 * most_moments(fit);
}

static groom_status read_all(const struct groom_source *source, unsigned char *bytes, uint64_t n)
{
    while (n > 0) {
        int64_t got = source->read(source->user, bytes, n);
        if (got < 0)
            return GROOM_EIO;
        if (got == 0)
            return GROOM_ETRUNCATED;
        bytes += got;
        n -= (uint64_t)got;
    }
    return GROOM_OK;
}

static groom_status check_header(const struct groom_fit *fit, const struct checkpoint_header *header,
                                 struct groom_diag *diag)
{
    if (memcmp(header->magic, magic, sizeof magic) != 0)
        return groom_fail_at(diag, GROOM_EFORMAT, 0, "this is no checkpoint of a fit");
    if (header->version != CHECKPOINT_VERSION)
        return groom_fail_at(diag, GROOM_ECONFLICT, 8, "the checkpoint is of version %llu; this program writes %d",
                             (unsigned long long)header->version, CHECKPOINT_VERSION);
    if (header->inputs != fit->inputs)
        return groom_fail_at(diag, GROOM_ECONFLICT, 16, "the checkpoint is of other strands, head or options");
    if (header->payload_bytes > most_bytes(fit))
        return groom_fail_at(diag, GROOM_EFORMAT, 24, "the checkpoint claims %llu bytes, more than this fit can have",
                             (unsigned long long)header->payload_bytes);
    return GROOM_OK;
}

/* Takes over what a sound state has; the target stays. */
static void adopt(struct groom_fit *fit, struct groom_fit *state)
{
    memory_release(fit->allocator, fit->centroids, (size_t)fit->n_guides * fit->m, sizeof *fit->centroids);
    memory_release(fit->allocator, fit->cluster_of, fit->n, sizeof *fit->cluster_of);
    memory_release(fit->allocator, fit->moments, fit->n_moments, sizeof *fit->moments);
    groom_destroy(fit->groom);
    *fit = *state;
    state->centroids = NULL;
    state->moments = NULL;
    state->n_moments = 0;
    state->cluster_of = NULL;
    state->groom = NULL;
}

static groom_status parse(struct groom_fit *fit, const unsigned char *payload, uint64_t n, struct groom_diag *diag)
{
    struct pen pen = {.mode = READ, .at = payload, .end = payload + n};
    struct groom_fit state = *fit;
    state.centroids = NULL;
    state.moments = NULL;
    state.n_moments = 0;
    state.cluster_of = NULL;
    state.groom = NULL;
    state.n_guides = 0;
    pen_state(&pen, &state);
    if (pen.status == GROOM_OK && !sound_state(&state))
        pen.status = GROOM_EFORMAT;
    if (pen.status == GROOM_OK)
        adopt(fit, &state);
    else
        groom_fail_at(diag, pen.status, (int64_t)sizeof(struct checkpoint_header) + (pen.at - payload),
                      pen.status == GROOM_ENOMEM ? "no memory to load a checkpoint" : "the checkpoint is damaged");
    memory_release(fit->allocator, state.moments, state.n_moments, sizeof *state.moments);
    memory_release(fit->allocator, state.centroids, (size_t)state.n_guides * fit->m, sizeof *state.centroids);
    memory_release(fit->allocator, state.cluster_of, fit->n, sizeof *state.cluster_of);
    groom_destroy(state.groom);
    return pen.status;
}

groom_status groom_fit_load(struct groom_fit *fit, const struct groom_source *source,
                            const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct checkpoint_header header;
    unsigned char *payload = NULL;
    struct checksum sum = {0};
    uint64_t n = 0, checksum;
    groom_status st;

    if ((st = read_all(source, (unsigned char *)&header, sizeof header)) != GROOM_OK)
        return groom_fail(diag, st, "the checkpoint ends within its header");
    if ((st = check_header(fit, &header, diag)) != GROOM_OK)
        return st;
    n = header.payload_bytes + sizeof checksum;
    if (!(payload = memory_array(allocator, n, 1)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory to load a checkpoint of %llu bytes", (unsigned long long)n);
    if ((st = read_all(source, payload, n)) != GROOM_OK) {
        st = groom_fail(diag, st, "the checkpoint ends before its %llu bytes", (unsigned long long)n);
        goto out;
    }
    memcpy(&checksum, payload + header.payload_bytes, sizeof checksum);
    checksum_add(&sum, payload, header.payload_bytes);
    if (checksum != checksum_finish(&sum)) {
        st = groom_fail(diag, GROOM_EFORMAT, "the checkpoint is damaged: its checksum is wrong");
        goto out;
    }
    st = parse(fit, payload, header.payload_bytes, diag);
out:
    memory_release(allocator, payload, n, 1);
    return st;
}
