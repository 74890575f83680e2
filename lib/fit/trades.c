#include "fit/trades.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/sort.h"
#include "fit/follow.h"

#define NEAR 8      /* operator guides around a strand that it may follow next */
#define FEWEST 3    /* strands of a bundle that can be two */
#define FAR_OFF 1.5 /* times the usual error: of the mean of its strands */
#define WORTH 1.0   /* of what a bundle has to gain: what others may lose by it */
#define MOST 256    /* trades at once: each looks at all strands for its own */

struct account { double excess, error, loss, n; }; /* over the strands of an operator guide */
struct ranked { double key; uint32_t id; };

struct choosing {
    struct trades *trades;
    struct random_search *search;
    struct groom *groom;
    uint32_t k, *near;        /* [n][k] */
    uint32_t *own;            /* [n] whom strands follow */
    float *now, *next, *sorted; /* [n] errors with one of them, and with the best of them but the own; scratch */
    struct account *account;  /* [n_gop] */
    struct ranked *bundle, *spare; /* [n_gop] */
};

/* --- what strands would do --------------------------------------------------------------------- */

static void follow(struct choosing *c, uint32_t k)
{
    for (uint32_t i = 0; i < c->groom->n_strands; i++) {
        uint32_t guide = c->near[(size_t)i * c->k + k];
        c->groom->operator_guide_of[i] = guide == UINT32_MAX ? c->own[i] : guide;
    }
}

static void ask_strands(struct choosing *c, const struct groom_context *context)
{
    uint32_t n = c->groom->n_strands;
    random_search_errors(c->search, n, c->trades->error, context);
    for (uint32_t i = 0; i < n; i++) {
        c->next[i] = INFINITY;
        c->trades->other[i] = c->own[i];
    }
    for (uint32_t k = 0; k < c->k; k++) {
        follow(c, k);
        random_search_errors(c->search, n, c->now, context);
        for (uint32_t i = 0; i < n; i++)
            if (c->groom->operator_guide_of[i] != c->own[i] && c->now[i] < c->next[i]) {
                c->next[i] = c->now[i];
                c->trades->other[i] = c->groom->operator_guide_of[i];
            }
    }
    memcpy(c->groom->operator_guide_of, c->own, n * sizeof *c->own);
}

/* --- who trades ------------------------------------------------------------------------------------ */

static int compare_ranked(const void *a, const void *b)
{
    const struct ranked *x = a, *y = b;
    if (x->key != y->key)
        return x->key < y->key ? -1 : 1;
    return (x->id > y->id) - (x->id < y->id);
}

static double usual_error(struct choosing *c)
{
    uint32_t n = c->groom->n_strands;
    memcpy(c->sorted, c->trades->error, n * sizeof *c->sorted);
    return (double)median_of_floats(c->sorted, n);
}

static void make_accounts(struct choosing *c, double usual)
{
    for (uint32_t i = 0; i < c->groom->n_strands; i++) {
        struct account *account = &c->account[c->own[i]];
        double error = (double)c->trades->error[i];
        account->n++;
        account->error += error;
        account->excess += fmax(error - usual, 0);
        account->loss += fmax((double)c->next[i] - error, 0);
    }
}

static int looks_like_two(const struct account *account, double usual)
{
    return account->n >= FEWEST && account->error > FAR_OFF * usual * account->n;
}

/* The worst bundles first, and the operator guides that strands miss least. returns how many bundles there are */
static uint32_t rank(struct choosing *c, double usual)
{
    uint32_t n_bundles = 0, n_op = c->groom->n_operator_guides;
    for (uint32_t o = 0; o < n_op; o++) {
        if (looks_like_two(&c->account[o], usual))
            c->bundle[n_bundles++] = (struct ranked){-c->account[o].excess, o};
        c->spare[o] = (struct ranked){c->account[o].loss, o};
    }
    qsort(c->bundle, n_bundles, sizeof *c->bundle, compare_ranked);
    qsort(c->spare, n_op, sizeof *c->spare, compare_ranked);
    return n_bundles;
}

static void pair(struct choosing *c, uint32_t n_bundles)
{
    struct trades *t = c->trades;
    uint32_t at = 0, n_op = c->groom->n_operator_guides;
    for (uint32_t o = 0; o < n_op; o++)
        t->of[o] = TRADES_NONE;
    for (uint32_t b = 0; b < n_bundles && t->n < MOST; b++) {
        uint32_t bundle = c->bundle[b].id;
        if (t->of[bundle] != TRADES_NONE)
            continue;
        while (at < n_op && (t->of[c->spare[at].id] != TRADES_NONE || c->spare[at].id == bundle))
            at++;
        if (at == n_op || c->spare[at].key > WORTH * c->account[bundle].excess)
            return;
        t->of[bundle] = t->of[c->spare[at].id] = t->n;
        t->trade[t->n++] = (struct trade){bundle, c->spare[at].id};
    }
}

int trades_spare(const struct trades *t, uint32_t guide)
{
    return t->of[guide] != TRADES_NONE && t->trade[t->of[guide]].spare == guide;
}

/* Strands of a spare may have meant to follow another one: they follow the nearest that stays. */
static void follow_who_stays(struct choosing *c)
{
    struct trades *t = c->trades;
    for (uint32_t i = 0; i < c->groom->n_strands; i++) {
        for (uint32_t k = 0; k < c->k && trades_spare(t, t->other[i]); k++)
            if (c->near[(size_t)i * c->k + k] != UINT32_MAX)
                t->other[i] = c->near[(size_t)i * c->k + k];
        if (trades_spare(t, t->other[i]))
            t->other[i] = t->trade[t->of[t->other[i]]].bundle;
    }
}

/* --- all --------------------------------------------------------------------------------------------- */

static int allocate(struct choosing *c, const struct groom_allocator *allocator)
{
    struct trades *t = c->trades;
    uint32_t n = c->groom->n_strands, n_op = c->groom->n_operator_guides;
    t->trade = memory_array(allocator, n_op, sizeof *t->trade);
    t->of = memory_array(allocator, n_op, sizeof *t->of);
    t->error = memory_array(allocator, n, sizeof *t->error);
    t->other = memory_array(allocator, n, sizeof *t->other);
    c->near = memory_array(allocator, (size_t)n * c->k, sizeof *c->near);
    c->own = memory_array(allocator, n, sizeof *c->own);
    c->now = memory_array(allocator, n, sizeof *c->now);
    c->next = memory_array(allocator, n, sizeof *c->next);
    c->sorted = memory_array(allocator, n, sizeof *c->sorted);
    c->account = memory_array_zero(allocator, n_op, sizeof *c->account);
    c->bundle = memory_array(allocator, n_op, sizeof *c->bundle);
    c->spare = memory_array(allocator, n_op, sizeof *c->spare);
    return t->trade && t->of && t->error && t->other && c->near && c->own && c->now && c->next && c->sorted && c->account &&
           c->bundle && c->spare;
}

static void release(struct choosing *c, const struct groom_allocator *allocator)
{
    uint32_t n = c->groom->n_strands, n_op = c->groom->n_operator_guides;
    memory_release(allocator, c->near, (size_t)n * c->k, sizeof *c->near);
    memory_release(allocator, c->own, n, sizeof *c->own);
    memory_release(allocator, c->now, n, sizeof *c->now);
    memory_release(allocator, c->next, n, sizeof *c->next);
    memory_release(allocator, c->sorted, n, sizeof *c->sorted);
    memory_release(allocator, c->account, n_op, sizeof *c->account);
    memory_release(allocator, c->bundle, n_op, sizeof *c->bundle);
    memory_release(allocator, c->spare, n_op, sizeof *c->spare);
}

groom_status trades_init(struct trades *trades, struct random_search *search, const struct groom_context *context,
                         struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom *groom = search->fit->groom;
    uint32_t n = groom->n_strands, n_op = groom->n_operator_guides;
    struct choosing c = {.trades = trades, .search = search, .groom = groom, .k = NEAR < n_op ? NEAR : n_op};
    *trades = (struct trades){.n_strands = n, .n_guides = n_op};
    groom_status st = allocate(&c, allocator) ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for the bundles of %u strands", n);
    if (st == GROOM_OK)
        st = follow_candidates(groom, (const float (*)[2])groom->root_uv, n, c.k, c.near, context, diag);
    if (st == GROOM_OK) {
        memcpy(c.own, groom->operator_guide_of, n * sizeof *c.own);
        ask_strands(&c, context);
        double usual = usual_error(&c);
        make_accounts(&c, usual);
        pair(&c, rank(&c, usual));
        follow_who_stays(&c);
    }
    release(&c, allocator);
    return st;
}

void trades_finish(struct trades *trades, const struct groom_allocator *allocator)
{
    memory_release(allocator, trades->trade, trades->n_guides, sizeof *trades->trade);
    memory_release(allocator, trades->of, trades->n_guides, sizeof *trades->of);
    memory_release(allocator, trades->error, trades->n_strands, sizeof *trades->error);
    memory_release(allocator, trades->other, trades->n_strands, sizeof *trades->other);
}
