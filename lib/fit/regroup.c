#include "fit/regroup.h"

#include <string.h>

#include "base/memory.h"
#include "fit/random_search.h"
#include "fit/spare_guides.h"
#include "fit/strand_state.h"
#include "fit/trades.h"

#define ASKED 16         /* strands of a bundle that decide for it, about */
#define BETTER 0.9       /* share of their error that all strands concerned may keep */
#define VALUES 12        /* of a number, over its range; */
#define RUGGED_VALUES 40 /* where the error is rugged in it */
#define HALVINGS 3

struct account { double before, after, n; }; /* sums over strands, and how many these are */

struct regrouping {
    struct groom_fit *fit;
    struct groom *groom;         /* the fit's, as it becomes */
    const struct groom *was;
    struct strand_error_weights weights;
    const struct trades *trades;
    uint32_t n, *strand;         /* [n] strands that are asked */
    uint32_t *trade_of;          /* [n] for which trade */
    uint32_t *begin, *member;    /* [n_gop + 1], [n] the same by the operator guide that they follow */
    struct strand_state before;
    float *error, *other_error;  /* [n] */
    double (*shape)[3];          /* [m] scratch */
    uint32_t *followers;         /* [n_gop] */
    struct account *account;     /* [trades.n] errors of strands that are asked */
    uint8_t *kept;               /* [trades.n] */
};

/* --- who is asked ------------------------------------------------------------------------------- */

static const struct trade *trade_at(const struct regrouping *r, uint32_t at) { return &r->trades->trade[r->trade_of[at]]; }

/* A strand that followed a spare: it is to follow another one. */
static int was_spare(const struct regrouping *r, uint32_t strand)
{
    return trades_spare(r->trades, r->was->operator_guide_of[strand]);
}

static int is_dispossessed(const struct regrouping *r, uint32_t at) { return was_spare(r, r->strand[at]); }

/* Some strands of each, evenly. begin and member [n_gop] count here */
static void list_strands(struct regrouping *r)
{
    uint32_t *count = r->begin, *seen = r->member, n_op = r->was->n_operator_guides;
    memset(count, 0, n_op * sizeof *count);
    memset(seen, 0, n_op * sizeof *seen);
    for (uint32_t i = 0; i < r->fit->n; i++)
        count[r->was->operator_guide_of[i]]++;
    for (uint32_t i = 0; i < r->fit->n; i++) {
        uint32_t guide = r->was->operator_guide_of[i], trade = r->trades->of[guide], step = (count[guide] + ASKED - 1) / ASKED;
        if (trade == TRADES_NONE || seen[guide]++ % step != 0)
            continue;
        r->trade_of[r->n] = trade;
        r->strand[r->n++] = i;
    }
}

/* Those that follow an operator guide that trades, in order. */
static void sort_by_guide(struct regrouping *r)
{
    uint32_t n_op = r->groom->n_operator_guides;
    const uint32_t *follows = r->groom->operator_guide_of;
    memset(r->begin, 0, ((size_t)n_op + 1) * sizeof *r->begin);
    for (uint32_t at = 0; at < r->n; at++)
        r->begin[follows[r->strand[at]] + 1] += r->trades->of[follows[r->strand[at]]] != TRADES_NONE;
    for (uint32_t o = 0; o < n_op; o++)
        r->begin[o + 1] += r->begin[o];
    for (uint32_t at = 0; at < r->n; at++)
        if (r->trades->of[follows[r->strand[at]]] != TRADES_NONE)
            r->member[r->begin[follows[r->strand[at]]]++] = r->strand[at];
    memmove(r->begin + 1, r->begin, n_op * sizeof *r->begin);
    r->begin[0] = 0;
}

/* --- what is tried ------------------------------------------------------------------------------ */

/* The spares' strands follow others; of a bundle's, those that are worse off than its mean follow the spare. */
static void hand_over(struct regrouping *r)
{
    for (uint32_t i = 0; i < r->fit->n; i++)
        if (was_spare(r, i))
            r->groom->operator_guide_of[i] = r->trades->other[i];
    for (uint32_t at = 0; at < r->n; at++)
        if (!is_dispossessed(r, at)) {
            r->account[r->trade_of[at]].before += (double)r->trades->error[r->strand[at]];
            r->account[r->trade_of[at]].n++;
        }
    for (uint32_t at = 0; at < r->n; at++) {
        const struct account *account = &r->account[r->trade_of[at]];
        uint32_t i = r->strand[at];
        if (!is_dispossessed(r, at) && (double)r->trades->error[i] * account->n > account->before)
            r->groom->operator_guide_of[i] = trade_at(r, at)->spare;
    }
    for (uint32_t t = 0; t < r->trades->n; t++)
        spare_guide_take(r->groom, r->was, r->trades->trade[t].spare, r->shape);
}

static void search_curls(struct regrouping *r, struct random_search *search, int whole, const struct groom_context *context)
{
    struct random_search_groups groups = {r->member, r->begin, r->fit->options.stages.randoms.strands, whole, UINT32_MAX};
    sort_by_guide(r);
    for (uint32_t a = 0; a < search->plan.n_active; a++) {
        groom_operator_type type = r->groom->operators[search->plan.active[a]].type;
        if (type == GROOM_OPERATOR_SCALE)
            groups.scale = a;
        if (type == GROOM_OPERATOR_CURL)
            random_search_curls(search, a, 0, r->groom->n_operator_guides, &groups, context);
    }
}

/* The numbers of both curls, then those of their strands. */
static void search_numbers(struct regrouping *r, struct random_search *search, int whole, const struct groom_context *context)
{
    search_curls(r, search, whole, context);
    search->only = r->strand;
    random_search_numbers(search, 0, r->n, VALUES, RUGGED_VALUES, HALVINGS, context);
    if (!whole)
        random_search_polish(search, 0, r->n, 1, 0, 0, context);
    random_search_errors(search, r->n, r->error, context);
}

static uint32_t other_of(const struct trade *trade, uint32_t guide)
{
    return guide == trade->spare ? trade->bundle : guide == trade->bundle ? trade->spare : guide;
}

static void count_followers(struct regrouping *r)
{
    memset(r->followers, 0, r->groom->n_operator_guides * sizeof *r->followers);
    for (uint32_t i = 0; i < r->fit->n; i++)
        r->followers[r->groom->operator_guide_of[i]]++;
}

/* A search knows the operator guides that strands follow: of no others may they be asked. */
static int are_two(const struct regrouping *r, uint32_t trade)
{
    return r->followers[r->trades->trade[trade].bundle] > 0 && r->followers[r->trades->trade[trade].spare] > 0;
}

static int may_change(const struct regrouping *r, uint32_t at) { return !is_dispossessed(r, at) && are_two(r, r->trade_of[at]); }

/* The better one of the bundle and the spare. */
static void follow_better(struct regrouping *r, struct random_search *search, const struct groom_context *context)
{
    uint32_t *follows = r->groom->operator_guide_of;
    count_followers(r);
    for (uint32_t at = 0; at < r->n; at++)
        if (may_change(r, at))
            follows[r->strand[at]] = other_of(trade_at(r, at), follows[r->strand[at]]);
    random_search_errors(search, r->n, r->other_error, context);
    for (uint32_t at = 0; at < r->n; at++)
        if (may_change(r, at) && !(r->other_error[at] < r->error[at]))
            follows[r->strand[at]] = other_of(trade_at(r, at), follows[r->strand[at]]);
    for (uint32_t t = 0; t < r->trades->n; t++)
        spare_guide_stand(r->groom, r->trades->trade[t].spare, r->shape);
}

/* All at once: bundles that trade share no strands. */
static groom_status try_trades(struct regrouping *r, const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = GROOM_OK;
    hand_over(r);
    for (int whole = 1; st == GROOM_OK && whole >= 0; whole--) {
        struct random_search search; /* anew, as operator guides have moved */
        if ((st = random_search_init(&search, r->fit, context, diag)) == GROOM_OK) {
            search.weights = r->weights;
            search_numbers(r, &search, whole, context);
            if (whole)
                follow_better(r, &search, context);
        }
        random_search_finish(&search);
    }
    return st;
}

/* --- what is kept --------------------------------------------------------------------------------- */

static void judge(struct regrouping *r)
{
    memset(r->account, 0, r->trades->n * sizeof *r->account);
    for (uint32_t at = 0; at < r->n; at++) {
        r->account[r->trade_of[at]].before += (double)r->trades->error[r->strand[at]];
        r->account[r->trade_of[at]].after += (double)r->error[at];
    }
    count_followers(r);
    for (uint32_t t = 0; t < r->trades->n; t++)
        r->kept[t] = are_two(r, t) && r->account[t].after < BETTER * r->account[t].before;
}

static void put_back_numbers(struct regrouping *r, uint32_t guide)
{
    for (uint32_t o = 0; o < r->groom->n_operators; o++) {
        struct groom_operator *op = &r->groom->operators[o];
        for (uint32_t k = 0; groom_operator_random_per_guide(op->type) && k < groom_operator_random_arrays(op->type); k++)
            op->random[k][guide] = r->was->operators[o].random[k][guide];
    }
}

static void put_back(struct regrouping *r)
{
    for (uint32_t t = 0; t < r->trades->n; t++)
        if (!r->kept[t]) {
            spare_guide_put_back(r->groom, r->was, r->trades->trade[t].spare);
            put_back_numbers(r, r->trades->trade[t].spare);
            put_back_numbers(r, r->trades->trade[t].bundle);
        }
    for (uint32_t at = 0; at < r->n; at++)
        if (!r->kept[r->trade_of[at]])
            strand_state_give_back(&r->before, r->groom, at);
    for (uint32_t i = 0; i < r->fit->n; i++) /* those that were not asked */
        if (was_spare(r, i) && !r->kept[r->trades->of[r->was->operator_guide_of[i]]])
            r->groom->operator_guide_of[i] = r->was->operator_guide_of[i];
}

/* Strands of bundles that were not asked follow the better one, too. near [n_strands][2] */
static groom_status follow_who_was_asked(struct regrouping *r, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t n = 0, all = r->fit->n;
    uint32_t *strand = memory_array(allocator, all, sizeof *strand), *near = memory_array(allocator, all, 2 * sizeof *near);
    struct random_search search;
    groom_status st = random_search_init(&search, r->fit, context, diag);
    if (st == GROOM_OK && !(strand && near))
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the strands of bundles");
    count_followers(r);
    for (uint32_t i = 0; st == GROOM_OK && i < all; i++) {
        uint32_t guide = r->groom->operator_guide_of[i], trade = r->trades->of[guide];
        if (trade == TRADES_NONE || !r->kept[trade] || !are_two(r, trade))
            continue;
        near[2 * n] = r->trades->trade[trade].bundle;
        near[2 * n + 1] = r->trades->trade[trade].spare;
        strand[n++] = i;
    }
    if (st == GROOM_OK) {
        search.weights = r->weights;
        search.only = strand;
        random_search_guides(&search, 0, n, near, 2, 0, context);
    }
    random_search_finish(&search);
    memory_release(allocator, strand, all, sizeof *strand);
    memory_release(allocator, near, all, 2 * sizeof *near);
    return st;
}

static groom_status settle(struct regrouping *r, const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t n_kept = 0;
    judge(r);
    put_back(r);
    for (uint32_t t = 0; t < r->trades->n; t++)
        n_kept += r->kept[t];
    if (n_kept == 0)
        return GROOM_OK;
    groom_status st = follow_who_was_asked(r, context, diag);
    return st == GROOM_OK ? spare_guides_settle(r->fit, r->trades, r->kept, context, diag) : st;
}

/* --- all ------------------------------------------------------------------------------------------ */

static int allocate(struct regrouping *r, const struct groom_allocator *allocator)
{
    uint32_t n = r->fit->n, n_op = r->groom->n_operator_guides, n_trades = r->trades->n;
    r->strand = memory_array(allocator, n, sizeof *r->strand);
    r->trade_of = memory_array(allocator, n, sizeof *r->trade_of);
    r->begin = memory_array(allocator, (size_t)n_op + 1, sizeof *r->begin);
    r->member = memory_array(allocator, (size_t)n + n_op, sizeof *r->member);
    r->error = memory_array(allocator, n, sizeof *r->error);
    r->other_error = memory_array(allocator, n, sizeof *r->other_error);
    r->shape = memory_array(allocator, r->fit->m, sizeof *r->shape);
    r->followers = memory_array(allocator, n_op, sizeof *r->followers);
    r->account = memory_array_zero(allocator, n_trades, sizeof *r->account);
    r->kept = memory_array(allocator, n_trades, sizeof *r->kept);
    return r->strand && r->trade_of && r->begin && r->member && r->error && r->other_error && r->shape && r->followers &&
           r->account && r->kept;
}

static void release(struct regrouping *r, const struct groom_allocator *allocator)
{
    uint32_t n = r->fit->n, n_op = r->groom->n_operator_guides, n_trades = r->trades->n;
    memory_release(allocator, r->strand, n, sizeof *r->strand);
    memory_release(allocator, r->trade_of, n, sizeof *r->trade_of);
    memory_release(allocator, r->begin, (size_t)n_op + 1, sizeof *r->begin);
    memory_release(allocator, r->member, (size_t)n + n_op, sizeof *r->member);
    memory_release(allocator, r->error, n, sizeof *r->error);
    memory_release(allocator, r->other_error, n, sizeof *r->other_error);
    memory_release(allocator, r->shape, r->fit->m, sizeof *r->shape);
    memory_release(allocator, r->followers, n_op, sizeof *r->followers);
    memory_release(allocator, r->account, n_trades, sizeof *r->account);
    memory_release(allocator, r->kept, n_trades, sizeof *r->kept);
    strand_state_finish(&r->before, allocator);
}

/* In the fit's groom, which is a copy. */
static groom_status trade_places(struct groom_fit *fit, const struct groom *was, const struct trades *trades,
                                 struct strand_error_weights weights, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct regrouping r = {.fit = fit, .groom = fit->groom, .was = was, .weights = weights, .trades = trades};
    groom_status st = allocate(&r, allocator) ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to regroup %u strands", fit->n);
    if (st == GROOM_OK) {
        list_strands(&r);
        st = strand_state_init(&r.before, was, r.strand, 0, r.n, allocator, diag);
    }
    if (st == GROOM_OK && (st = try_trades(&r, context, diag)) == GROOM_OK)
        st = settle(&r, context, diag);
    release(&r, allocator);
    return st;
}

static groom_status choose(struct groom_fit *fit, struct trades *trades, struct strand_error_weights weights,
                           const struct groom_context *context, struct groom_diag *diag)
{
    struct random_search search;
    groom_status st = random_search_init(&search, fit, context, diag);
    *trades = (struct trades){0};
    search.weights = weights;
    if (st == GROOM_OK)
        st = trades_init(trades, &search, context, diag);
    random_search_finish(&search);
    return st;
}

groom_status regroup(struct groom_fit *fit, struct strand_error_weights weights, const struct groom_context *context,
                     struct groom_diag *diag)
{
    struct groom *was = fit->groom, *copy;
    struct trades trades;
    groom_status st = choose(fit, &trades, weights, context, diag);
    if (st == GROOM_OK && trades.n > 0 && (st = groom_clone(was, context, &copy, diag)) == GROOM_OK) {
        fit->groom = copy;
        st = trade_places(fit, was, &trades, weights, context, diag);
        fit->groom = st == GROOM_OK ? copy : was;
        groom_destroy(st == GROOM_OK ? was : copy);
    }
    trades_finish(&trades, memory_allocator(context));
    return st;
}
