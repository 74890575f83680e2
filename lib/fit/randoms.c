/* Stage `randoms`: the random number of each strand, for curls of each operator guide (Chang et al. 2025,
 * Section 5.6, reached another way).
 *
 * The paper descends Eq. 19 by gradients, with noise on them against local minima (Eqs. 20, 21). But each
 * strand's problem is independent of the others', has one bounded number an operator, and costs microseconds
 * to evaluate: so all of the range is looked at (random_search.h), operator by operator along the chain, and
 * again in the next round with what the others have found. What is brought down are Eq. 19's directions and
 * lengths with the distances of vertices; its spectra follow, as they can be no farther apart than directions.
 *
 * A strand may also follow another operator guide near it, whose curl or clump it belongs to by its looks; one that is
 * far off looks for all of this at once (strays.h). At the end of a round its numbers and instancing weights take
 * Newton's steps together (random_polish.c).
 *
 * All along, to be deeper in the head than its target costs a strand more than to be as far from it elsewhere; what
 * is in the head at the end is taken out by a pass of its own (head_clear.h).
 *
 * method "paper" is the paper's own, as a reference (paper_randoms.h). */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/progress.h"
#include "fit/align.h"
#include "fit/calibrate.h"
#include "fit/centre.h"
#include "fit/follow.h"
#include "fit/frequencies.h"
#include "fit/gather.h"
#include "fit/guides.h"
#include "fit/head_clear.h"
#include "fit/lengths.h"
#include "fit/loss_strands.h"
#include "fit/operators.h"
#include "fit/paper_randoms.h"
#include "fit/random_search.h"
#include "fit/regroup.h"
#include "fit/strays.h"

#define UNIT 0.1             /* metres on an ordinary head: what the paper's weights were made for */
#define LOSS_STRANDS 4000    /* of which the losses are measured */
#define SMOOTH_VALUES 24     /* of a number that the error is smooth in */
#define HALVINGS 3           /* of the step around the best value: Newton's steps do the rest */
#define STEP_WORK 1200000    /* strands times values of one step: about a second */
#define PASSES_OF_ROUND (9 * GROOM_FIT_MAX_OPERATORS + 11) /* at most */
#define MOST_PASSES (4 * PASSES_OF_ROUND)
#define FEW_STRANDS 6        /* a guide: another round for curls; */
#define SOME_STRANDS 16      /* another look at guides and curls */
#define CANDIDATES 8         /* operator guides near a strand that it may follow */
#define GAIN 0.3f            /* share of its error that another one must be better by */
#define CURL_VALUES 256      /* about: values of a curl's numbers that are tried */
#define DEPTH 10.0           /* what depth in the head costs, over distance */
#define POLISH_STEPS 2       /* at the end; 1 before */
#define STRAYS_VALUES 100    /* about: as many evaluations as a look for strays costs, over all strands */
#define CLEAR_VALUES 100     /* about: as many evaluations as a look for what is in the head costs */
#define POLISH_VALUES 48     /* about: evaluations of them */

/* --- the row of passes ------------------------------------------------------------------------- */

/* What is looked for: which operator guide each strand follows, the numbers of strands in one operator, both at once of
 * strands that are far off, the numbers of operator guides, what the strands of these are long, the law that these
 * follow, the axes that all lean on, the last digits of all that a strand has, which bundles are two, what numbers tell of
 * guides, the guides that go with them, or these and the operators' parameters for them; at the end, how strong frizz is for all that
 * was found, and what is in the head. */
struct pass {
    enum { FOLLOW, STRANDS, STRAYS, CURLS, LENGTHS, LAW, ALIGN, POLISH, REGROUP, CENTRE, GUIDES, RESHAPE, CALIBRATE, CLEAR } kind;
    uint32_t round;
    uint32_t op, active; /* of STRANDS, CURLS, LENGTHS and LAW: its index in the chain, and among those that are enabled */
    enum { AROUND, WHOLE, BEYOND } look; /* of CURLS and LAW: around what was found, at the whole range, or at more
                                          * frequencies than there may be, for the law to begin with */
    int last; /* of POLISH, STRAYS and CENTRE: guides and whom strands follow are what they will be */
};

static int has_effect(const struct groom_operator *op)
{
    return op->enabled && op->parameter[op->type == GROOM_OPERATOR_FRIZZ] != 0; /* sizes; the profile of a clump */
}

static int clumps(const struct groom *groom)
{
    int any = 0;
    for (uint32_t o = 0; o < groom->n_operators; o++)
        any |= groom->operators[o].type == GROOM_OPERATOR_CLUMP && has_effect(&groom->operators[o]);
    return any && groom->n_operator_guides > 1;
}

static int draws(const struct groom_operator *op, int per_guide)
{
    return has_effect(op) && groom_operator_random_arrays(op->type) > 0 && groom_operator_random_per_guide(op->type) == per_guide;
}

/* The index of the scale that stands last before an operator, or UINT32_MAX. */
static uint32_t scale_before(const struct groom *groom, uint32_t op)
{
    uint32_t found = UINT32_MAX;
    for (uint32_t o = 0; o < op; o++)
        if (groom->operators[o].type == GROOM_OPERATOR_SCALE && has_effect(&groom->operators[o]))
            found = o;
    return found;
}

/* The numbers of one curl, and what they tell. */
static uint32_t list_curl(const struct groom *groom, const struct pass *look, struct pass *passes)
{
    uint32_t n = 0;
    passes[n] = *look;
    passes[n++].kind = CURLS;
    if (look->look == AROUND && scale_before(groom, look->op) != UINT32_MAX) {
        passes[n] = *look;
        passes[n++].kind = LENGTHS;
    }
    if (frequencies_tell(groom)) {
        passes[n] = *look;
        passes[n++].kind = LAW;
    }
    return n;
}

static uint32_t list_curls(const struct groom *groom, uint32_t round, int again, struct pass *passes)
{
    uint32_t n = 0, active = 0;
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        struct pass look = {.round = round, .op = o, .active = active, .look = BEYOND};
        active += groom->operators[o].enabled != 0;
        if (!draws(&groom->operators[o], 1))
            continue;
        if (!again && frequencies_tell(groom))
            n += list_curl(groom, &look, passes + n);
        look.look = again ? AROUND : WHOLE;
        n += list_curl(groom, &look, passes + n);
    }
    return n;
}

/* Numbers that the error is smooth in are where Newton's steps have brought them since, or of a stray. */
static uint32_t list_strands(const struct groom *groom, uint32_t round, struct pass *passes)
{
    uint32_t n = 0, active = 0;
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        int rugged = groom->operators[o].type == GROOM_OPERATOR_FRIZZ;
        if (draws(&groom->operators[o], 0) && (round == 0 || rugged))
            passes[n++] = (struct pass){.kind = STRANDS, .round = round, .op = o, .active = active};
        active += groom->operators[o].enabled != 0;
    }
    return n;
}

static int draws_anything(const struct groom *groom)
{
    int any = 0;
    for (uint32_t o = 0; o < groom->n_operators; o++)
        any |= draws(&groom->operators[o], 0) || draws(&groom->operators[o], 1);
    return any;
}

static int winds(const struct groom *groom)
{
    int any = 0;
    for (uint32_t o = 0; o < groom->n_operators; o++)
        any |= groom->operators[o].type == GROOM_OPERATOR_CURL && has_effect(&groom->operators[o]);
    return any;
}

/* Where few strands tell a guide, and these of one curl, it takes on what is wrong with their numbers, which are looked for
 * around it: each round takes away but a part of that. There is one more then; and where they are not quite as few, guides
 * and curls are asked of each other once more in a round. */
static uint32_t rounds_of(const struct groom_fit *fit)
{
    uint32_t rounds = fit->options.stages.randoms.rounds;
    return rounds > 1 && winds(fit->groom) && fit->n < FEW_STRANDS * fit->n_guides ? rounds + 1 : rounds;
}

/* In a round: what strands share, then whom they follow in it, then what each has of its own, and, for that, what they
 * share once more: how often strands wind and how long they are crawl towards each other else. Between rounds, other
 * bundles where these are not what they seemed, guides for these numbers, for those before were for any, and parameters
 * for the guides. */
static uint32_t list_round(const struct groom_fit *fit, uint32_t round, int last, struct pass *passes)
{
    uint32_t n = 0, n_curls = list_curls(fit->groom, round, round > 0, passes);
    n += n_curls;
    if (round > 0 && n_curls > 0 && fit->n < SOME_STRANDS * fit->n_guides) {
        passes[n++] = (struct pass){.kind = GUIDES, .round = round};
        n += list_curls(fit->groom, round, 1, passes + n);
    }
    if (n_curls > 0 || clumps(fit->groom))
        passes[n++] = (struct pass){.kind = FOLLOW, .round = round};
    n += list_strands(fit->groom, round, passes + n);
    if (n == 0 && !draws_anything(fit->groom))
        return 0;
    passes[n++] = (struct pass){.kind = STRAYS, .round = round};
    if (n_curls > 0)
        passes[n++] = (struct pass){.kind = POLISH, .round = round};
    passes[n++] = (struct pass){.kind = ALIGN, .round = round};
    if (n_curls > 0)
        n += list_curls(fit->groom, round, 1, passes + n);
    passes[n++] = (struct pass){.kind = POLISH, .round = round, .last = last};
    if (last) { /* with weights of their own, strands tell better what is wrong with their numbers */
        passes[n++] = (struct pass){.kind = STRAYS, .round = round, .last = 1};
        if (!clumps(fit->groom)) /* longer guides of clumps move strands */
            passes[n++] = (struct pass){.kind = CENTRE, .round = round, .last = 1};
        passes[n++] = (struct pass){.kind = POLISH, .round = round, .last = 1};
    }
    if (last && fit->options.stages.randoms.refinements > 0)
        passes[n++] = (struct pass){.kind = CALIBRATE, .round = round};
    if (last && fit->bvh)
        passes[n++] = (struct pass){.kind = CLEAR, .round = round};
    if (!last) {
        if (n_curls > 0 || clumps(fit->groom))
            passes[n++] = (struct pass){.kind = REGROUP, .round = round};
        passes[n++] = (struct pass){.kind = CENTRE, .round = round};
        passes[n++] = (struct pass){.kind = RESHAPE, .round = round};
    }
    return n;
}

static uint32_t list_passes(const struct groom_fit *fit, struct pass passes[MOST_PASSES])
{
    uint32_t n = 0, n_rounds = rounds_of(fit);
    for (uint32_t round = 0; round < n_rounds && n + PASSES_OF_ROUND <= MOST_PASSES; round++)
        n += list_round(fit, round, round + 1 == n_rounds, passes + n);
    return n;
}

/* What is done in one go, not strand by strand or curl by curl. */
static int is_whole(const struct pass *pass)
{
    switch (pass->kind) {
    case LENGTHS:
    case LAW:
    case ALIGN:
    case REGROUP:
    case CENTRE:
    case GUIDES:
    case RESHAPE:
    case CALIBRATE: return 1;
    default: return 0;
    }
}

static uint32_t size_of(const struct groom_fit *fit, const struct pass *pass)
{
    return is_whole(pass) ? 1 : pass->kind == CURLS ? fit->groom->n_operator_guides : fit->n;
}

/* --- one step --------------------------------------------------------------------------------------- */

/* Whether a scale's numbers are taken off the lengths of strands. */
static int is_by_length(const struct groom_fit *fit, const struct pass *pass)
{
    return pass->kind == STRANDS && pass->round == 0 && fit->groom->operators[pass->op].type == GROOM_OPERATOR_SCALE;
}

/* In the first round: operators that were not looked at yet and are 0 on average. */
static uint32_t leave_out(const struct groom_fit *fit, const struct pass *pass)
{
    uint32_t bits = 0, active = 0;
    int looks = pass->kind == FOLLOW || pass->kind == STRANDS || ((pass->kind == CURLS || pass->kind == LAW) && pass->look != AROUND);
    if (pass->round > 0 || !looks || is_by_length(fit, pass))
        return 0;
    for (uint32_t o = 0; o < fit->groom->n_operators; o++) {
        const struct groom_operator *op = &fit->groom->operators[o];
        int later = pass->kind != STRANDS || o > pass->op;
        if (later && (op->type == GROOM_OPERATOR_BEND || op->type == GROOM_OPERATOR_FRIZZ))
            bits |= 1u << active;
        active += op->enabled != 0;
    }
    return bits;
}

/* What a loss of this stage was with the numbers as they were drawn. */
static double loss_before(const struct groom_fit *fit, const char *name)
{
    const struct groom_fit_report *report = &fit->report;
    for (uint32_t i = 0; i < report->n_losses; i++)
        if (strcmp(report->losses[i].stage, "randoms") == 0 && strcmp(report->losses[i].name, name) == 0)
            return report->losses[i].before;
    return 0;
}

/* Distances weigh against directions as both were with the numbers as they were drawn, so that neither is
 * bought at the other's expense, whatever the style. */
static struct strand_error_weights weights_of(const struct groom_fit *fit, const struct pass *pass)
{
    const double unit = UNIT * fit->ordinary, squared = unit * unit;
    double lambda_d = fit->options.stages.randoms.lambda_d, vertex = loss_before(fit, "vertex");
    double balance = vertex > 0 ? loss_before(fit, "direction") / (vertex * vertex) : 0;
    if (is_by_length(fit, pass))
        return (struct strand_error_weights){0, 0, (float)(1 / squared), 0};
    double apart = lambda_d * balance * fit->options.stages.randoms.lambda_x;
    return (struct strand_error_weights){(float)lambda_d, (float)apart, (float)(fit->options.stages.randoms.lambda_l / squared),
                                         (float)(DEPTH * apart)};
}

/* Strands by operator guide. begin [n_gop + 1], member [n] */
static void sort_by_guide(const struct groom *groom, uint32_t *begin, uint32_t *member)
{
    uint32_t n = groom->n_operator_guides;
    memset(begin, 0, ((size_t)n + 1) * sizeof *begin);
    for (uint32_t i = 0; i < groom->n_strands; i++)
        begin[groom->operator_guide_of[i] + 1]++;
    for (uint32_t o = 0; o < n; o++)
        begin[o + 1] += begin[o];
    for (uint32_t i = 0; i < groom->n_strands; i++)
        member[begin[groom->operator_guide_of[i]]++] = i;
    memmove(begin + 1, begin, n * sizeof *begin);
    begin[0] = 0;
}

/* The same among operators that are enabled. */
static uint32_t active_scale_before(const struct groom *groom, uint32_t op)
{
    uint32_t scale = scale_before(groom, op), active = 0;
    for (uint32_t o = 0; scale != UINT32_MAX && o < scale; o++)
        active += groom->operators[o].enabled != 0;
    return scale != UINT32_MAX ? active : UINT32_MAX;
}

/* Curls first .. first + count - 1; half: NULL, or by halves of all curls' strands. */
static groom_status search_curls(struct groom_fit *fit, struct random_search *search, const struct pass *pass,
                                 uint32_t count, float (*half)[2], const struct groom_context *context,
                                 struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_begin = (size_t)fit->groom->n_operator_guides + 1;
    uint32_t *begin = memory_array(allocator, n_begin, sizeof *begin);
    uint32_t *member = memory_array(allocator, fit->n, sizeof *member);
    groom_status st = begin && member ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to sort strands");
    uint32_t n_asked = fit->options.stages.randoms.strands;
    n_asked = n_asked > 1 && (half || pass->look == BEYOND) ? n_asked / 2 : n_asked; /* of each half; the first look is a rough one */
    if (st == GROOM_OK) {
        struct random_search_groups groups = {member, begin, n_asked, pass->look != AROUND,
                                              active_scale_before(fit->groom, pass->op)};
        sort_by_guide(fit->groom, begin, member);
        if (!half && pass->look == BEYOND && fit->iteration == 0)
            frequencies_widen(fit->groom, &fit->groom->operators[pass->op]);
        if (half)
            random_search_halves(search, pass->active, &groups, half, context);
        else
            random_search_curls(search, pass->active, fit->iteration, count, &groups, context);
    }
    memory_release(allocator, begin, n_begin, sizeof *begin);
    memory_release(allocator, member, fit->n, sizeof *member);
    return st;
}

static groom_status restate_frequencies(struct groom_fit *fit, struct random_search *search, const struct pass *pass,
                                        const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = fit->groom->n_operator_guides;
    float (*half)[2] = memory_array(allocator, n, sizeof *half);
    groom_status st = half ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for the frequencies of %u curls", n);
    if (st == GROOM_OK && pass->look != BEYOND)
        st = search_curls(fit, search, pass, n, half, context, diag);
    if (st == GROOM_OK)
        st = frequencies_restate(fit->groom, &fit->groom->operators[pass->op],
                                 pass->look == BEYOND ? NULL : (const float (*)[2])half, allocator, diag);
    memory_release(allocator, half, n, sizeof *half);
    return st;
}

static groom_status search_guides(struct groom_fit *fit, struct random_search *search, uint32_t count,
                                  const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const float (*uv)[2] = (const float (*)[2])(fit->groom->root_uv + fit->iteration);
    uint32_t *candidate = memory_array(allocator, (size_t)count * CANDIDATES, sizeof *candidate);
    groom_status st = candidate ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to choose operator guides");
    if (st == GROOM_OK)
        st = follow_candidates(fit->groom, uv, count, CANDIDATES, candidate, context, diag);
    if (st == GROOM_OK)
        random_search_guides(search, fit->iteration, count, candidate, CANDIDATES, GAIN, context);
    memory_release(allocator, candidate, (size_t)count * CANDIDATES, sizeof *candidate);
    return st;
}

/* Values that are tried over the whole range: noise wants many. */
static uint32_t grid_of(const struct groom_fit *fit, const struct pass *pass)
{
    uint32_t values = fit->options.stages.randoms.values;
    int rugged = fit->groom->operators[pass->op].type == GROOM_OPERATOR_FRIZZ;
    values = rugged || values < SMOOTH_VALUES ? values : SMOOTH_VALUES;
    return pass->round == 0 ? values : (values + 1) / 2; /* what is better is near, or was found before */
}

/* Strands or operator guides of the next step. */
static uint32_t step_size(const struct groom_fit *fit, const struct pass *pass)
{
    uint32_t values = 1, wanted, left = size_of(fit, pass) - fit->iteration;
    if (is_whole(pass))
        return left;
    switch (pass->kind) {
    case FOLLOW: values = 2 * CANDIDATES; break;
    case STRANDS: values = grid_of(fit, pass); break;
    case STRAYS: values = STRAYS_VALUES; break;
    case CURLS: values = CURL_VALUES * fit->options.stages.randoms.strands; break;
    case POLISH: values = POLISH_VALUES; break;
    case CLEAR: values = CLEAR_VALUES; break;
    default: break;
    }
    wanted = STEP_WORK / values > 1 ? STEP_WORK / values : 1;
    return wanted < left ? wanted : left;
}

static groom_status clear_head(struct groom_fit *fit, struct random_search *search, uint32_t count,
                               const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_fit_report *report = &fit->report;
    struct head_left left;
    groom_status st = head_clear(search, fit->iteration, count, &left, context, diag);
    if (st != GROOM_OK)
        return st;
    if (fit->iteration == 0)
        report->n_in_head = report->n_beyond_target = 0;
    report->n_in_head += left.n_deep;
    report->n_beyond_target += left.n_beyond;
    if (fit->iteration + count == fit->n && report->n_in_head > 0)
        report_note(report, "%u strands are left more than %.1f mm deep in the head, %u of them deeper than their targets.",
                    report->n_in_head, 1000 * (double)left.depth, report->n_beyond_target);
    return GROOM_OK;
}

static groom_status search_pass(struct groom_fit *fit, struct random_search *search, const struct pass *pass,
                                uint32_t count, const struct groom_context *context, struct groom_diag *diag)
{
    switch (pass->kind) {
    case FOLLOW: return search_guides(fit, search, count, context, diag);
    case STRANDS:
        random_search_strands(search, pass->active, fit->iteration, count, grid_of(fit, pass), HALVINGS, context);
        return GROOM_OK;
    case STRAYS: return strays_settle(search, fit->iteration, count, !pass->last, context, diag);
    case CURLS: return search_curls(fit, search, pass, count, NULL, context, diag);
    case LAW: return restate_frequencies(fit, search, pass, context, diag);
    case POLISH:
        /* weights only where nothing comes after that would follow to where strands have slipped */
        random_search_polish(search, fit->iteration, count, pass->last ? POLISH_STEPS : 1,
                             (float)fit->options.stages.randoms.hold, pass->last, context);
        return GROOM_OK;
    case CLEAR: return clear_head(fit, search, count, context, diag);
    case LENGTHS:
    case ALIGN:
    case REGROUP:
    case CENTRE:
    case GUIDES:
    case RESHAPE:
    case CALIBRATE: break;
    }
    return GROOM_EINTERNAL;
}

/* Guides are solved after this, but for the last time. */
static groom_status centre_step(struct groom_fit *fit, const struct pass *pass, const struct groom_context *context,
                                struct groom_diag *diag)
{
    groom_status st = pass->last ? GROOM_OK : centre_bundles(fit->groom, memory_allocator(context), diag);
    if (st == GROOM_OK)
        centre_scales(fit->groom);
    return st;
}

static groom_status lengths_step(struct groom_fit *fit, const struct pass *pass, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    struct groom *groom = fit->groom;
    return lengths_settle(groom, &groom->operators[pass->op], &groom->operators[scale_before(groom, pass->op)],
                          memory_allocator(context), diag);
}

/* Guides, then parameters for them: both, or neither. */
static groom_status reshape_step(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom *groom = fit->groom;
    size_t n = (size_t)groom->n_guides * groom->n_vertices;
    float (*guides)[3] = memory_array(allocator, n, sizeof *guides);
    float (*uv)[2] = memory_array(allocator, groom->n_guides, sizeof *uv);
    groom_status st = guides && uv ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to keep %u guides", groom->n_guides);
    if (st == GROOM_OK) {
        memcpy(guides, groom->guides, n * sizeof *guides);
        memcpy(uv, groom->guide_uv, groom->n_guides * sizeof *uv);
        st = guides_refine(fit, context, diag);
        if (st == GROOM_OK)
            st = operators_refine(fit, fit->options.stages.randoms.refinements, frequencies_tell(groom), context, diag);
        if (st != GROOM_OK) {
            memcpy(groom->guides, guides, n * sizeof *guides);
            memcpy(groom->guide_uv, uv, groom->n_guides * sizeof *uv);
        }
    }
    memory_release(allocator, guides, n, sizeof *guides);
    memory_release(allocator, uv, groom->n_guides, sizeof *uv);
    return st;
}

static groom_status search_step(struct groom_fit *fit, const struct pass *pass, uint32_t count,
                                const struct groom_context *context, struct groom_diag *diag)
{
    struct random_search search;
    groom_status st = random_search_init(&search, fit, context, diag);
    if (st == GROOM_OK) {
        search.leave_out = leave_out(fit, pass);
        search.weights = weights_of(fit, pass);
        st = search_pass(fit, &search, pass, count, context, diag);
    }
    random_search_finish(&search);
    return st;
}

/* The next strands, operator guides or all guides of a pass. */
static groom_status pass_step(struct groom_fit *fit, const struct pass *pass, const struct groom_context *context,
                              struct groom_diag *diag)
{
    uint32_t count = step_size(fit, pass);
    groom_status st = pass->kind == CENTRE      ? centre_step(fit, pass, context, diag)
                      : pass->kind == REGROUP   ? regroup(fit, weights_of(fit, pass), context, diag)
                      : pass->kind == ALIGN     ? align_axes(fit, context, diag)
                      : pass->kind == LENGTHS   ? lengths_step(fit, pass, context, diag)
                      : pass->kind == GUIDES    ? guides_refine(fit, context, diag)
                      : pass->kind == RESHAPE   ? reshape_step(fit, context, diag)
                      : pass->kind == CALIBRATE ? calibrate_frizz(fit, context, diag)
                                                : search_step(fit, pass, count, context, diag);
    if (st == GROOM_OK)
        fit->iteration += count;
    return st;
}

/* --- losses -------------------------------------------------------------------------------------------- */

static groom_status measure(const struct groom_fit *fit, struct loss_strands *loss, const struct groom_context *context,
                            struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = fit->n < LOSS_STRANDS ? fit->n : LOSS_STRANDS;
    size_t n_points = (size_t)n * fit->m;
    uint32_t *order = memory_array(allocator, fit->n, sizeof *order);
    float (*fitted)[3] = memory_array(allocator, n_points, sizeof *fitted);
    float (*target)[3] = memory_array(allocator, n_points, sizeof *target);
    groom_status st = GROOM_ENOMEM;
    if (!order || !fitted || !target) {
        groom_fail(diag, st, "no memory to measure the losses of %u strands", n);
        goto out;
    }
    groom_fair_order(fit->n, order);
    if ((st = gather_strands(fit, order, n, fitted, target, context, diag)) == GROOM_OK)
        st = loss_strands((const float (*)[3])fitted, (const float (*)[3])target, n, fit->m, UNIT * fit->ordinary,
                          fit->options.stages.randoms.lambda_d, fit->options.stages.randoms.lambda_l, context, loss, diag);
out:
    memory_release(allocator, order, fit->n, sizeof *order);
    memory_release(allocator, fitted, n_points, sizeof *fitted);
    memory_release(allocator, target, n_points, sizeof *target);
    return st;
}

static groom_status report_losses(struct groom_fit *fit, uint64_t iteration, const struct groom_context *context,
                                  struct groom_diag *diag)
{
    struct loss_strands loss;
    groom_status st = measure(fit, &loss, context, diag);
    if (st != GROOM_OK)
        return st;
    report_progress(&fit->report, "randoms", "L_rand", loss.total, iteration, context);
    report_progress(&fit->report, "randoms", "spectra", loss.spectra, iteration, context);
    report_progress(&fit->report, "randoms", "direction", loss.direction, iteration, context);
    report_progress(&fit->report, "randoms", "length", loss.length, iteration, context);
    report_progress(&fit->report, "randoms", "vertex", loss.vertex, iteration, context);
    return GROOM_OK;
}

/* Numbers of the fit's own seed or of the operators'. */
static void draw(struct groom *groom, int own)
{
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        struct groom_operator *op = &groom->operators[o];
        uint64_t seed = op->seed;
        groom_draw_random(groom, op, own ? FIT_OWN_SEED : seed);
        op->seed = seed;
    }
}

/* All numbers are looked for, and what is found is no lottery: they begin as those of the fit's own seed. The operators'
 * goes on deciding what a groom draws for other strands, and what is drawn anew. */
static groom_status begin(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    draw(fit->groom, 1);
    groom_status st = report_losses(fit, 0, context, diag);
    if (st != GROOM_OK)
        draw(fit->groom, 0);
    return st;
}

/* --- the stage ---------------------------------------------------------------------------------------------- */

static int is_paper(const struct groom_fit *fit) { return fit->options.stages.randoms.method == GROOM_FIT_PAPER; }

/* The paper's method: one phase of gradient steps between two measurements. */
static groom_status paper_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                               struct groom_diag *diag)
{
    uint32_t n = fit->options.stages.randoms.iterations;
    groom_status st = GROOM_OK;
    if (n == 0 || paper_randoms_moments(fit) == 0) {
        *ended = 1;
        return GROOM_OK;
    }
    if (fit->phase == 1 && fit->iteration < n)
        return paper_randoms_step(fit, context, diag);
    if ((st = report_losses(fit, fit->phase * n, context, diag)) != GROOM_OK)
        return st;
    fit->phase++;
    fit->iteration = 0;
    *ended = fit->phase == 2;
    return GROOM_OK;
}

/* Phase 0 measures; then comes each pass; each round ends with a measurement. */
groom_status randoms_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                          struct groom_diag *diag)
{
    struct pass passes[MOST_PASSES];
    uint32_t n = list_passes(fit, passes);
    groom_status st = GROOM_OK;
    if (is_paper(fit))
        return paper_step(fit, ended, context, diag);
    if (fit->phase == 0) {
        if (n > 0)
            st = begin(fit, context, diag);
        fit->phase += st == GROOM_OK;
    } else if (fit->iteration < size_of(fit, &passes[fit->phase - 1])) {
        st = pass_step(fit, &passes[fit->phase - 1], context, diag);
    } else {
        int last = fit->phase == n || passes[fit->phase].round != passes[fit->phase - 1].round;
        if (last)
            st = report_losses(fit, passes[fit->phase - 1].round + 1, context, diag);
        if (st == GROOM_OK) {
            fit->phase++;
            fit->iteration = 0;
        }
    }
    *ended = st == GROOM_OK && fit->phase > n;
    return st;
}

double randoms_fraction(const struct groom_fit *fit)
{
    struct pass passes[MOST_PASSES];
    uint32_t n = fit->groom ? list_passes(fit, passes) : 0;
    if (is_paper(fit))
        return fit->iteration / fmax(fit->options.stages.randoms.iterations, 1);
    if (n == 0 || fit->phase == 0)
        return 0;
    return fmin((fit->phase - 1 + (double)fit->iteration / size_of(fit, &passes[fit->phase - 1])) / n, 1);
}

/* Moments belong to steps that are under way. */
static int sound_paper(const struct groom_fit *fit)
{
    uint32_t n = fit->options.stages.randoms.iterations;
    int under_way = fit->phase == 1 && fit->iteration > 0 && fit->iteration < n;
    return fit->phase <= 1 && fit->iteration <= fit->phase * n &&
           fit->n_moments == (under_way ? paper_randoms_moments(fit) : 0);
}

int randoms_sound(const struct groom_fit *fit)
{
    struct pass passes[MOST_PASSES];
    uint32_t n = list_passes(fit, passes);
    if (fit->groom->n_operators > GROOM_FIT_MAX_OPERATORS)
        return 0;
    if (is_paper(fit))
        return sound_paper(fit);
    if (fit->phase > n || fit->n_moments != 0)
        return 0;
    return fit->phase == 0 ? fit->iteration == 0 : fit->iteration <= size_of(fit, &passes[fit->phase - 1]);
}
