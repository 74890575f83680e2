#include "fit/prune.h"

#include <math.h>

#include "fit/trial.h"

#define FLOOR 0.01      /* of the statistics */
#define FEWEST_STRANDS 200 /* that tell what chance does from what operators do: with fewer, all stay */
#define PAIRS_SHARE 3   /* one pair in so many tells */
#define ROUNDS 2        /* of slopes, without an operator, */
#define STEPS 4         /* and steps by each, */
#define LEAST_GAIN 1e-2 /* which are to gain this share of the misfit */
#define MISSED 20.0     /* how much larger the misfit is without an operator that is missed: chance makes it a few larger for each
                         * parameter, while one that hair was made with is missed by a hundred at least */
#define SORELY 200.0    /* the same of one that no other could stand in for, which is not asked of again */
#define NONE UINT32_MAX

int prune_tells(const struct groom_fit *fit) { return fit->options.operators_auto && fit->n >= FEWEST_STRANDS; }

static int may_go(const struct groom_operator *op)
{
    int type = op->type == GROOM_OPERATOR_BEND || op->type == GROOM_OPERATOR_CURL || op->type == GROOM_OPERATOR_CLUMP;
    return type && op->enabled && op->parameter[0] != 0;
}

/* The others' parameters without one. */
static groom_status try_without(struct groom_fit *fit, struct matching *matching, uint32_t op, struct trial *trial, double hopeless,
                                double *square, const struct groom_context *context, struct groom_diag *diag)
{
    float *size = &fit->groom->operators[op].parameter[0], kept = *size;
    int ended = 0;
    groom_status st = GROOM_OK;
    *size = 0;
    trial_begin(fit, 0, trial);
    *size = kept;
    for (int round = 0; st == GROOM_OK && !ended && round < ROUNDS; round++) {
        st = trial_refine(matching, trial, 0, STEPS, LEAST_GAIN, square, &ended, context, diag);
        ended |= *square > hopeless;
    }
    return st;
}

/* What is known of a fit's operators as they go one by one. */
struct pruning {
    struct groom_fit *fit;
    struct matching *matching;
    double square;      /* the misfit with those that are left */
    uint32_t kept;      /* bits of those that are sorely missed, */
    uint32_t dropped;   /* and of those that went */
    struct trial least; /* without the one that is missed least, */
    uint32_t weakest;   /* which is this one; NONE: none may go */
    double without;     /* and the misfit then */
};

static groom_status find_weakest(struct pruning *p, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom *groom = p->fit->groom;
    p->weakest = NONE;
    p->without = INFINITY;
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        struct trial trial;
        double square = INFINITY, hopeless = p->square + SORELY;
        if (!may_go(&groom->operators[o]) || p->kept >> o & 1)
            continue;
        groom_status st = try_without(p->fit, p->matching, o, &trial, hopeless, &square, context, diag);
        if (st != GROOM_OK)
            return st;
        p->kept |= (uint32_t)(square > hopeless) << o;
        if (square < p->without) {
            p->without = square;
            p->weakest = o;
            trial_copy(&trial, &p->least);
        }
    }
    return GROOM_OK;
}

/* Its other parameters are those that operators begin with: who turns it up has it as it is known. */
static void drop(struct pruning *p)
{
    struct groom_operator *op = &p->fit->groom->operators[p->weakest];
    uint32_t n;
    const struct groom_operator_parameter *parameters = groom_operator_parameters(op->type, &n);
    trial_keep(&p->least, p->fit);
    for (uint32_t k = 1; k < n; k++)
        op->parameter[k] = parameters[k].initial;
    p->square = p->without;
    p->dropped |= 1u << p->weakest;
}

static void note_dropped(const struct pruning *p)
{
    for (uint32_t o = 0; o < p->fit->groom->n_operators; o++)
        if (p->dropped >> o & 1)
            report_note(&p->fit->report, "The hair is explained as well without %s, which is left at 0.",
                        groom_operator_name(p->fit->groom->operators[o].type));
}

static groom_status prune(struct pruning *p, const struct groom_context *context, struct groom_diag *diag)
{
    struct trial all;
    trial_begin(p->fit, 0, &all);
    groom_status st = trial_average(p->matching, &all, context, diag);
    if (st == GROOM_OK)
        st = trial_misfit(p->matching, &all, &p->square, context, diag);
    while (st == GROOM_OK) {
        st = find_weakest(p, context, diag);
        if (st != GROOM_OK || p->weakest == NONE || p->without > p->square + MISSED)
            break;
        drop(p);
    }
    return st;
}

groom_status prune_operators(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct matching_wanted wanted = {.n_pairs = 1 + (fit->options.stages.operators.pairs - 1) / PAIRS_SHARE, .floor = FLOOR};
    struct pruning p = {.fit = fit};
    groom_status st = matching_create(fit, &wanted, context, &p.matching, diag);
    if (st == GROOM_OK)
        st = prune(&p, context, diag);
    matching_destroy(p.matching);
    if (st == GROOM_OK)
        note_dropped(&p);
    return st;
}
