/* Sculpt: a layer's anchors and frames as the solver takes them, and what holds strands outside the head. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "layers/room.h"

#define PAPER_ELEMENTS 45 /* of a strand, where the paper says its c = 10 */

struct sculpt {
    const struct work *work;
    const struct groom_allocator *allocator;
    struct groom_anchor *anchors; /* [n_room]; strands numbered as in the input */
    size_t n, n_room;
    size_t n_own;                 /* the layer's, before its contact */
    struct groom_sculpt_options options;
};

/* Where a strand of the groom is in the input, which has it. */
static uint32_t place_of(const struct groom_layer_input *input, uint32_t strand)
{
    uint32_t low = 0, high = input->n;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (input->strand[middle] <= strand)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* --- lists by strand ----------------------------------------------------------------------- */

/* Counting sort: a strand's anchors stay in the list's order. */
static groom_status sort_list(const struct work *work, const struct groom_layer_anchors *list, struct by_strand *out)
{
    const struct groom_allocator *allocator = memory_allocator(work->context);
    const struct groom_layer_input *input = work->input;
    *out = (struct by_strand){.n = list->n, .n_strands = input->n,
                              .first = memory_array_zero(allocator, (size_t)input->n + 2, sizeof *out->first),
                              .order = memory_array(allocator, list->n, sizeof *out->order)};
    if (!out->first || !out->order)
        return groom_fail(work->diag, GROOM_ENOMEM, "no memory for %u anchors", list->n);
    for (uint32_t i = 0; i < list->n; i++)
        out->first[place_of(input, list->strand[i]) + 2]++;
    for (uint32_t k = 0; k < input->n; k++)
        out->first[k + 2] += out->first[k + 1];
    for (uint32_t i = 0; i < list->n; i++) /* first[k + 1] runs from where strand k begins to where it ends */
        out->order[out->first[place_of(input, list->strand[i]) + 1]++] = i;
    return GROOM_OK;
}

static void release_list(struct by_strand *list, const struct groom_allocator *allocator)
{
    memory_release(allocator, list->first, (size_t)list->n_strands + 2, sizeof *list->first);
    memory_release(allocator, list->order, list->n, sizeof *list->order);
}

static uint32_t count_of(const struct work *work, const struct by_strand *list)
{
    return list->first[work->begin + work->input->n] - list->first[work->begin];
}

static void add_anchor(struct sculpt *sculpt, const struct groom_layer_anchors *from, uint32_t i, uint32_t strand)
{
    struct groom_anchor *to = &sculpt->anchors[sculpt->n++];
    *to = (struct groom_anchor){.strand = strand, .at = (double)from->at[i]};
    for (int c = 0; c < 3; c++)
        to->position[c] = (double)from->position[i][c];
}

/* Those of the block's strands. */
static void add_anchors(struct sculpt *sculpt, const struct groom_layer_anchors *from, const struct by_strand *list)
{
    const struct work *work = sculpt->work;
    for (uint32_t k = 0; k < work->input->n; k++)
        for (uint32_t i = list->first[work->begin + k]; i < list->first[work->begin + k + 1]; i++)
            add_anchor(sculpt, from, list->order[i], k);
}

/* --- frames --------------------------------------------------------------------------- */

/* The clusters of the input's strands alone, under their numbers there. */
static groom_status narrow_clusters(const struct sculpt *sculpt, struct groom_clusters *few)
{
    const struct groom_layer_input *input = sculpt->work->input;
    const struct groom_clusters *all = input->clusters;
    *few = (struct groom_clusters){.n_clusters = all->n_clusters, .n_strands = input->n, .allocator = sculpt->allocator,
                                   .of_strand = memory_array(sculpt->allocator, input->n, sizeof *few->of_strand),
                                   .first = memory_array_zero(sculpt->allocator, (size_t)all->n_clusters + 1, sizeof *few->first),
                                   .strands = memory_array(sculpt->allocator, input->n, sizeof *few->strands)};
    if (!few->of_strand || !few->first || !few->strands)
        return GROOM_ENOMEM;
    for (uint32_t i = 0; i < input->n; i++) {
        few->of_strand[i] = all->of_strand[input->strand[i]];
        few->first[few->of_strand[i] + 1]++;
    }
    for (uint32_t k = 0; k < all->n_clusters; k++)
        few->first[k + 1] += few->first[k];
    for (uint32_t i = input->n; i > 0; i--) /* from the end, so that `first` can count down and back */
        few->strands[--few->first[few->of_strand[i - 1] + 1]] = i - 1;
    for (uint32_t k = 0; k < all->n_clusters; k++)
        few->first[k] = few->first[k + 1];
    few->first[all->n_clusters] = input->n;
    return GROOM_OK;
}

static void release_clusters(struct groom_clusters *few)
{
    memory_release(few->allocator, few->of_strand, few->n_strands, sizeof *few->of_strand);
    memory_release(few->allocator, few->first, (size_t)few->n_clusters + 1, sizeof *few->first);
    memory_release(few->allocator, few->strands, few->n_strands, sizeof *few->strands);
}

/* The frames that move strands of this block; *place: their indices in the layer. */
static uint32_t list_moves(const struct sculpt *sculpt, const struct groom_clusters *few, struct groom_frame_move *moves,
                           uint32_t *place)
{
    const struct groom_layer *layer = sculpt->work->layer;
    uint32_t n = 0;
    for (uint32_t i = 0; i < layer->n_frames; i++) {
        const struct groom_layer_frame *frame = &layer->frames[i];
        if (few->first[frame->cluster] == few->first[frame->cluster + 1])
            continue;
        place[n] = i;
        moves[n].cluster = frame->cluster;
        moves[n].at = (double)frame->at;
        for (int k = 0; k < 12; k++)
            moves[n].map[k / 4][k % 4] = (double)frame->transform[k / 4][k % 4];
        n++;
    }
    return n;
}

/* "/frames/i/..." of the moves is that of the layer's frame. */
static void name_frame(struct groom_diag *diag, const uint32_t *place, uint32_t n)
{
    unsigned i;
    int end = 0;
    char pointer[sizeof diag->pointer];
    if (!diag || sscanf(diag->pointer, "/frames/%u%n", &i, &end) != 1 || i >= n)
        return;
    snprintf(pointer, sizeof pointer, "/frames/%u%.100s", place[i], diag->pointer + end);
    memcpy(diag->pointer, pointer, sizeof pointer);
}

static groom_status move_clusters(const struct sculpt *sculpt, const struct groom_clusters *few,
                                  struct groom_anchors **anchors)
{
    const struct work *work = sculpt->work;
    uint32_t most = work->layer->n_frames, *place = memory_array(sculpt->allocator, most, sizeof *place);
    struct groom_frame_move *moves = memory_array(sculpt->allocator, most, sizeof *moves);
    groom_status status = GROOM_ENOMEM;
    if (moves && place) {
        uint32_t n = list_moves(sculpt, few, moves, place);
        status = groom_clusters_move(few, work->input->conversion->helices, moves, n, work->context, anchors, work->diag);
        if (status != GROOM_OK)
            name_frame(work->diag, place, n);
    } else {
        groom_fail(work->diag, status, "no memory for %u frames", most);
    }
    memory_release(sculpt->allocator, moves, most, sizeof *moves);
    memory_release(sculpt->allocator, place, most, sizeof *place);
    return status;
}

static groom_status frame_anchors(const struct sculpt *sculpt, struct groom_anchors **anchors)
{
    struct groom_clusters few;
    if (sculpt->work->layer->n_frames == 0)
        return GROOM_OK;
    groom_status status = narrow_clusters(sculpt, &few);
    if (status == GROOM_OK)
        status = move_clusters(sculpt, &few, anchors);
    else
        groom_fail(sculpt->work->diag, status, "no memory for the clusters of %u strands", sculpt->work->input->n);
    release_clusters(&few);
    return status;
}

/* --- anchors ------------------------------------------------------------------------------ */

/* Room for what contact may add as well. */
static groom_status gather_anchors(struct sculpt *sculpt, int with_contact)
{
    const struct groom_layer *layer = sculpt->work->layer;
    struct groom_anchors *framed = NULL;
    groom_status status = frame_anchors(sculpt, &framed);
    if (status != GROOM_OK)
        return status;
    size_t n_own = count_of(sculpt->work, &sculpt->work->anchors);
    size_t n_contact = with_contact ? count_of(sculpt->work, &sculpt->work->held) : (size_t)sculpt->work->input->n * GROOM_CONTACT_MOST_HELD;
    sculpt->n_room = n_own + (framed ? framed->n : 0) + n_contact;
    sculpt->anchors = memory_array(sculpt->allocator, sculpt->n_room, sizeof *sculpt->anchors);
    if (sculpt->anchors) {
        add_anchors(sculpt, &layer->anchors, &sculpt->work->anchors);
        if (framed)
            memcpy(sculpt->anchors + sculpt->n, framed->anchor, framed->n * sizeof *framed->anchor);
        sculpt->n_own = sculpt->n += framed ? framed->n : 0;
        if (with_contact)
            add_anchors(sculpt, &layer->contact, &sculpt->work->held);
    } else {
        status = groom_fail(sculpt->work->diag, GROOM_ENOMEM, "no memory for %zu anchors", sculpt->n_room);
    }
    groom_anchors_destroy(framed);
    return status;
}

static groom_status solve(const struct sculpt *sculpt, struct groom_superhelices *helices)
{
    const struct work *work = sculpt->work;
    const double(*rest)[3] = (const double(*)[3])work->input->conversion->helices->q;
    memcpy(helices->q, rest, helices->n_elements * sizeof *helices->q);
    return groom_superhelices_sculpt(helices, rest, sculpt->anchors, sculpt->n, &sculpt->options, work->context,
                                     work->outcomes, work->diag);
}

/* --- contact ---------------------------------------------------------------------------------- */

static void note_contact(const struct groom_contact_report *reports, uint32_t n, struct groom_layer_report *to, int first)
{
    float before = to->contact.depth_before_m;
    uint32_t entered = to->contact.n_entered;
    memset(&to->contact, 0, sizeof to->contact);
    for (uint32_t i = 0; i < n; i++) {
        const struct groom_contact_report *r = &reports[i];
        to->contact.n_checked += r->checked;
        to->contact.n_entered += r->depth_before_m > 0.0f;
        to->contact.n_inside += r->depth_after_m > 0.0f;
        if (r->depth_before_m > to->contact.depth_before_m)
            to->contact.depth_before_m = r->depth_before_m;
        if (r->depth_after_m > to->contact.depth_after_m)
            to->contact.depth_after_m = r->depth_after_m;
    }
    if (!first) {
        to->contact.n_entered = entered;
        to->contact.depth_before_m = before;
    }
}

/* What held strands outside becomes the layer's contact, and anchors of the last solution, from the
 * layer's own numbers: a later evaluation has no others. */
static groom_status keep_contact(struct sculpt *sculpt, const struct groom_contact_report *reports)
{
    const struct groom_layer_input *input = sculpt->work->input;
    struct groom_layer_anchors *contact = sculpt->work->contact;
    uint32_t n = 0;
    for (uint32_t i = 0; i < input->n; i++)
        n += reports[i].n_held;
    if (groom_layer_anchors_resize(contact, n, sculpt->work->groom->allocator) != GROOM_OK)
        return groom_fail(sculpt->work->diag, GROOM_ENOMEM, "no memory for %u points of contact", n);
    n = 0;
    for (uint32_t i = 0; i < input->n; i++)
        for (uint32_t k = 0; k < reports[i].n_held; k++, n++) {
            contact->strand[n] = input->strand[i];
            contact->at[n] = reports[i].held[k].at;
            memcpy(contact->position[n], reports[i].held[k].position, sizeof contact->position[n]);
            add_anchor(sculpt, contact, n, i);
        }
    return GROOM_OK;
}

static groom_status push(const struct sculpt *sculpt, struct groom_superhelices *helices, uint32_t rounds,
                         struct groom_contact_report *reports)
{
    const struct work *work = sculpt->work;
    struct groom_contact_options options = groom_contact_options_default();
    options.max_rounds = rounds;
    return groom_superhelices_push_out(helices, (const double(*)[3])work->input->conversion->helices->q, sculpt->anchors,
                                       sculpt->n_own, work->head, &options, &sculpt->options, work->context, reports,
                                       work->diag);
}

/* A strand that was pushed is solved again from rest, with what held it: that is what every evaluation
 * will do, and what is reported. */
static groom_status stay_outside(struct sculpt *sculpt, struct groom_superhelices *helices)
{
    uint32_t n = helices->n_strands;
    struct groom_contact_report *reports = memory_array(sculpt->allocator, n, sizeof *reports);
    if (!reports)
        return groom_fail(sculpt->work->diag, GROOM_ENOMEM, "no memory to check %u strands against the head", n);
    groom_status status = push(sculpt, helices, groom_contact_options_default().max_rounds, reports);
    if (status == GROOM_OK) {
        note_contact(reports, n, sculpt->work->report, 1);
        status = keep_contact(sculpt, reports);
    }
    if (status == GROOM_OK && sculpt->work->contact->n > 0) {
        if ((status = solve(sculpt, helices)) == GROOM_OK && (status = push(sculpt, helices, 0, reports)) == GROOM_OK)
            note_contact(reports, n, sculpt->work->report, 0);
    }
    memory_release(sculpt->allocator, reports, n, sizeof *reports);
    return status;
}

/* --- the report -------------------------------------------------------------------------------- */

static int compare(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return x < y ? -1 : x > y;
}

groom_status layer_sculpt_tell(const struct work *work)
{
    const struct groom_allocator *allocator = memory_allocator(work->context);
    const struct groom_sculpt_outcome *o = work->outcomes;
    struct groom_layer_report *report = work->report;
    uint32_t n = work->input->n, n_solved = 0, *iterations = memory_array(allocator, n, sizeof *iterations);
    double sum = 0.0;
    if (!iterations)
        return groom_fail(work->diag, GROOM_ENOMEM, "no memory for the report of %u strands", n);
    for (uint32_t i = 0; i < n; i++) {
        if (o[i].end == GROOM_SCULPT_UNTOUCHED)
            continue;
        iterations[n_solved++] = o[i].iterations;
        report->sculpt.energy_before += o[i].energy_before;
        report->sculpt.energy_after += o[i].energy_after;
        report->sculpt.n_stopped += o[i].end == GROOM_SCULPT_STOPPED;
        sum += o[i].anchor_error_mean_m;
        if (o[i].anchor_error_max_m > report->sculpt.anchor_error_max_m)
            report->sculpt.anchor_error_max_m = o[i].anchor_error_max_m;
    }
    qsort(iterations, n_solved, sizeof *iterations, compare);
    if (n_solved) {
        report->sculpt.anchor_error_mean_m = sum / n_solved;
        report->sculpt.iterations_median = iterations[n_solved / 2];
        report->sculpt.iterations_max = iterations[n_solved - 1];
    }
    memory_release(allocator, iterations, n, sizeof *iterations);
    return GROOM_OK;
}

/* --- the layer ---------------------------------------------------------------------------------- */

groom_status layer_sculpt_begin(struct work *work)
{
    work->outcomes = memory_array_zero(memory_allocator(work->context), work->input->n, sizeof *work->outcomes);
    if (!work->outcomes)
        return groom_fail(work->diag, GROOM_ENOMEM, "no memory to sculpt %u strands", work->input->n);
    groom_status status = sort_list(work, &work->layer->anchors, &work->anchors);
    return status == GROOM_OK ? sort_list(work, &work->layer->contact, &work->held) : status;
}

void layer_sculpt_end(struct work *work)
{
    const struct groom_allocator *allocator = memory_allocator(work->context);
    release_list(&work->anchors, allocator);
    release_list(&work->held, allocator);
    memory_release(allocator, work->outcomes, work->input->n, sizeof *work->outcomes);
}

groom_status layer_sculpt(const struct work *work, struct groom_superhelices **changed)
{
    struct sculpt sculpt = {.work = work, .allocator = memory_allocator(work->context),
                            .options = groom_sculpt_options_default()};
    sculpt.options.stiffness = groom_sculpt_stiffness((double)work->op->parameter[0], PAPER_ELEMENTS);
    groom_status status = groom_superhelices_copy(work->input->conversion->helices, work->context, changed, work->diag);
    if (status != GROOM_OK)
        return status;
    status = gather_anchors(&sculpt, !work->contact);
    if (status == GROOM_OK)
        status = solve(&sculpt, *changed);
    if (status == GROOM_OK && work->contact)
        status = stay_outside(&sculpt, *changed);
    work->report->sculpt.n_anchors = (uint32_t)sculpt.n_own;
    memory_release(sculpt.allocator, sculpt.anchors, sculpt.n_room, sizeof *sculpt.anchors);
    return status;
}
