/* A layer at work: strands in blocks, each from vertices to vertices before the next, so that what lies between
 * (super-helices, anchors, samples) stays small and in the cache. A layer that looks from strand to strand has
 * one block of all. */
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "layers/room.h"

#define BLOCK 128         /* strands */
#define BLOCKS_A_CHUNK 64 /* between two looks at whether to go on */

struct block {
    groom_status status;
    struct groom_diag diag;
    struct groom_layer_report report;
    struct groom_layer_anchors contact;
};

struct blocks {
    const struct work *work; /* of the whole layer */
    uint32_t size, n, begin; /* strands a block; blocks; the first of the present chunk */
    struct block *block;     /* [n] */
};

/* --- one block ------------------------------------------------------------------------ */

static groom_status change(const struct work *work, struct groom_superhelices **changed)
{
    switch (work->op->type) {
    case GROOM_OPERATOR_RUFFLE: return layer_ruffle(work, changed);
    case GROOM_OPERATOR_SCULPT: return layer_sculpt(work, changed);
    case GROOM_OPERATOR_INTERPOLATE: return layer_interpolate(work, changed);
    case GROOM_OPERATOR_CURL_SCALE: return layer_curl_scale(work, changed);
    default: return groom_fail(work->diag, GROOM_EINVAL, "operator %u is not a layer", work->index);
    }
}

static void tell_input(const struct work *work)
{
    const struct groom_layer_input *input = work->input;
    work->report->n_strands = input->n;
    for (uint32_t k = 0; k < input->n; k++)
        if (input->conversion->reports[k].error_rms_m > work->report->conversion_error_m)
            work->report->conversion_error_m = input->conversion->reports[k].error_rms_m;
}

static int is_same(const struct groom_superhelices *a, const struct groom_superhelices *b, uint32_t i)
{
    uint32_t n = a->first[i + 1] - a->first[i];
    return n == b->first[i + 1] - b->first[i] && memcmp(a->root[i], b->root[i], sizeof a->root[i]) == 0 &&
           memcmp(a->frame[i], b->frame[i], sizeof a->frame[i]) == 0 &&
           memcmp(a->q[a->first[i]], b->q[b->first[i]], n * sizeof *a->q) == 0 &&
           memcmp(&a->length[a->first[i]], &b->length[b->first[i]], n * sizeof *a->length) == 0;
}

/* Strands that changed get their new vertices; the others keep their own. */
static groom_status scatter(const struct work *work, const struct groom_superhelices *changed)
{
    const struct groom_allocator *allocator = memory_allocator(work->context);
    const struct groom_layer_input *input = work->input;
    const struct groom_conversion *c = input->conversion;
    struct groom_strands *after = work->after;
    float(*sampled)[3] = memory_array(allocator, c->n_vertices, sizeof *sampled);
    if (!sampled)
        return groom_fail(work->diag, GROOM_ENOMEM, "no memory to sample %u strands", input->n);
    groom_status status = groom_superhelices_sample_at(changed, c->first, c->at, sampled, work->context, work->diag);
    for (uint32_t k = 0; status == GROOM_OK && k < input->n; k++) {
        uint32_t i = input->strand[k];
        if (is_same(c->helices, changed, k))
            continue;
        memcpy(after->points + after->first[i], sampled + c->first[k], (c->first[k + 1] - c->first[k]) * sizeof *sampled);
        work->report->n_changed++;
    }
    memory_release(allocator, sampled, c->n_vertices, sizeof *sampled);
    return status;
}

static groom_status run_part(const struct work *work)
{
    struct groom_superhelices *changed = NULL;
    tell_input(work);
    groom_status status = change(work, &changed);
    if (status == GROOM_OK)
        status = scatter(work, changed);
    groom_superhelices_destroy(changed);
    return status;
}

static void run_block(const struct blocks *blocks, uint32_t index, const struct groom_context *context)
{
    const struct work *whole = blocks->work;
    struct block *block = &blocks->block[index];
    struct input_part part;
    struct work work = *whole;
    uint32_t left = whole->input->n - index * blocks->size;
    work.begin = index * blocks->size;
    work.context = context;
    work.report = &block->report;
    work.diag = &block->diag;
    work.contact = whole->contact ? &block->contact : NULL;
    work.outcomes = whole->outcomes ? whole->outcomes + work.begin : NULL;
    block->status = input_part_init(&part, whole->input, work.begin, left < blocks->size ? left : blocks->size,
                                    whole->before, context, &block->diag);
    work.input = &part.input;
    if (block->status == GROOM_OK)
        block->status = run_part(&work);
    input_part_finish(&part);
}

static void run_piece(void *user, uint32_t piece, uint32_t thread)
{
    (void)thread;
    const struct blocks *blocks = user;
    const struct groom_context alone = {.allocator = memory_allocator(blocks->work->context)};
    run_block(blocks, blocks->begin + piece, &alone);
}

/* --- all ------------------------------------------------------------------------------ */

int layer_is_strand_by_strand(groom_operator_type type)
{
    return type == GROOM_OPERATOR_SCULPT || type == GROOM_OPERATOR_CURL_SCALE;
}

static groom_status run_chunks(struct blocks *blocks)
{
    const struct work *work = blocks->work;
    for (blocks->begin = 0; blocks->begin < blocks->n; blocks->begin += BLOCKS_A_CHUNK) {
        uint32_t left = blocks->n - blocks->begin, here = left < BLOCKS_A_CHUNK ? left : BLOCKS_A_CHUNK;
        if (progress_cancelled(work->context))
            return groom_fail(work->diag, GROOM_ECANCELLED, "the layer was cancelled");
        parallel_for(work->context, here, run_piece, blocks);
        progress_report(work->context, (double)(blocks->begin + here) / blocks->n);
    }
    return GROOM_OK;
}

static void add_report(const struct groom_layer_report *from, struct groom_layer_report *to)
{
    to->n_strands += from->n_strands;
    to->n_changed += from->n_changed;
    to->conversion_error_m = from->conversion_error_m > to->conversion_error_m ? from->conversion_error_m : to->conversion_error_m;
    to->sculpt.n_anchors += from->sculpt.n_anchors;
    to->contact.n_checked += from->contact.n_checked;
    to->contact.n_entered += from->contact.n_entered;
    to->contact.n_inside += from->contact.n_inside;
    if (from->contact.depth_before_m > to->contact.depth_before_m)
        to->contact.depth_before_m = from->contact.depth_before_m;
    if (from->contact.depth_after_m > to->contact.depth_after_m)
        to->contact.depth_after_m = from->contact.depth_after_m;
}

/* What held strands of each block, one block after the other: rising, as in one of all. */
static groom_status join_contact(const struct blocks *blocks)
{
    const struct work *work = blocks->work;
    uint32_t n = 0;
    for (uint32_t b = 0; b < blocks->n; b++)
        n += blocks->block[b].contact.n;
    if (groom_layer_anchors_resize(work->contact, n, work->groom->allocator) != GROOM_OK)
        return groom_fail(work->diag, GROOM_ENOMEM, "no memory for %u points of contact", n);
    n = 0;
    for (uint32_t b = 0; b < blocks->n; b++) {
        const struct groom_layer_anchors *from = &blocks->block[b].contact;
        if (from->n == 0)
            continue;
        memcpy(work->contact->strand + n, from->strand, from->n * sizeof *from->strand);
        memcpy(work->contact->at + n, from->at, from->n * sizeof *from->at);
        memcpy(work->contact->position + n, from->position, from->n * sizeof *from->position);
        n += from->n;
    }
    return GROOM_OK;
}

/* The first block that failed speaks for all. */
static groom_status gather(const struct blocks *blocks)
{
    const struct work *work = blocks->work;
    for (uint32_t b = 0; b < blocks->n; b++) {
        const struct block *block = &blocks->block[b];
        if (block->status != GROOM_OK) {
            if (work->diag)
                *work->diag = block->diag;
            return block->status;
        }
        add_report(&block->report, work->report);
    }
    return work->contact ? join_contact(blocks) : GROOM_OK;
}

groom_status layer_run_blocks(const struct work *work)
{
    const struct groom_allocator *allocator = memory_allocator(work->context);
    struct blocks blocks = {.work = work, .size = layer_is_strand_by_strand(work->op->type) ? BLOCK : work->input->n};
    blocks.n = work->input->n / blocks.size + (work->input->n % blocks.size != 0);
    blocks.block = memory_array_zero(allocator, blocks.n, sizeof *blocks.block);
    if (!blocks.block)
        return groom_fail(work->diag, GROOM_ENOMEM, "no memory for a layer over %u strands", work->input->n);
    groom_status status = GROOM_OK;
    if (blocks.n == 1)
        run_block(&blocks, 0, work->context);
    else
        status = run_chunks(&blocks);
    if (status == GROOM_OK)
        status = gather(&blocks);
    for (uint32_t b = 0; b < blocks.n; b++) {
        groom_status ignored = groom_layer_anchors_resize(&blocks.block[b].contact, 0, work->groom->allocator);
        (void)ignored; /* to none: that cannot fail */
    }
    memory_release(allocator, blocks.block, blocks.n, sizeof *blocks.block);
    return status;
}
