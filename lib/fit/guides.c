/* Stage `guides`: Chang et al. 2025, Section 5.4.
 *
 * The expectation of a strand is linear in the shapes of the guides (fit/mean_strands.h), so the paper's
 * loss (Eq. 7) is a linear least-squares problem. Alone it would bake the strands' random variation into
 * the guides, which the paper stops by filtering the gradient across the scalp (Eq. 9), and by taking
 * curvatures instead of vertices as what is moved (Eq. 10; Crane et al. 2013), whose length is that of a
 * bending energy. Here both stand in the problem itself, as what it costs a guide to turn unevenly and to
 * be unlike its neighbours, and its minimum is found by conjugate gradients. Each guide then gets vertices
 * at equal steps of arc length: one length a guide, no ripples.
 *
 * Guides that end up in the head where their strands are out are held at its surface, and the problem is
 * solved again.
 *
 * method "paper" is the paper's own, as a reference (paper_guides.h). */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "fit/bundles.h"
#include "fit/guide_laplacian.h"
#include "fit/guide_system.h"
#include "fit/guides.h"
#include "fit/loss_guides.h"
#include "fit/mean_strands.h"
#include "fit/paper_guides.h"
#include "fit/roughness.h"
#include "fit/sites.h"
#include "fit/state.h"
#include "geometry/side.h"

enum phase { SOLVE, ASSIGN, ENDED };

#define TOLERANCE 1e-6
#define MOST_ITERATIONS 300
#define USUAL_ACROSS 4.0        /* where strands cannot tell */
#define HELD 5                  /* one strand of so many is foretold */
#define TOLERANCE_CHOOSING 1e-3 /* where it only shows what weights do: the solution comes after */
#define ITERATIONS_CHOOSING 40
#define CURLS_UNKNOWN (2.0 / 3) /* of the waves along a guide, while it could take those of curls for its own */
#define ROOT_PART 6            /* of so many of a guide, where it turns out of the scalp */
#define LOOSEST 0.001          /* of the usual weight along it, there */
#define WEIGHINGS 3            /* of roughness: what was smoothed away shows bit by bit */
#define TIGHTEST 16.0          /* times the usual weight along it, where neighbours share nothing: two waves a guide, for three */
#define FEW_STRANDS 8.0        /* of an operator guide tell little of where it stands */
#define ROUNDS_AT_HEAD 2
#define ROUNDS_KNOWN 1          /* of guides that were out of the head already */
#define HOLD_ROOT_EXPECTED 0.1 /* of an operator guide at its likeliest place, over the weight of its strands' vertices; */
#define HOLD_ROOT_KNOWN 0.03   /* where it was found so far, where random numbers are known, and scatter less; */
#define HOLD_ROOT_THERE 0.8    /* then, at its likeliest place, over the weight of one strand's, by the root of their number: the more
                                * strands it has, the farther are the borders that tell that place */
#define HOLD 1.0      /* of a vertex at the head, over the weight of a guide's strands */
#define ASKED 8       /* strands of a guide that are asked whether they are in the head */
#define FARTHEST 100.0 /* vertex from its root, over the size of the hair */
#define EVENINGS 3    /* resampling passes until chords are as even as arcs */

struct solution {
    struct groom_fit *fit;
    struct mean_strands mean;
    struct sparse laplacian;
    struct guide_system system;
    double (*shape)[3];     /* [n_guides * m] of the target's size, from the root; while solving rows 0: its move */
    double (*move)[3];      /* [n_guides] of the roots, then */
    double (*line)[3];      /* [m] */
    struct roughness *roughness; /* [m] */
    double along;           /* of the system, where nothing is known of roughness */
    double *partial;        /* of the loss */
    float (*direction)[3];  /* [n_guides] at the root, unit */
    float (*point)[3];      /* [n_guides * m] metres */
    struct groom_surface_point *surface; /* [n_guides * m] nearest to those that are in the head */
};

/* --- shapes ------------------------------------------------------------------------------ */

static void load_shapes(struct solution *solution)
{
    const struct groom_fit *fit = solution->fit;
    for (uint32_t g = 0; g < fit->n_guides; g++) {
        const float (*x)[3] = (const float (*)[3])(fit->groom->guides + (size_t)g * fit->m);
        for (uint32_t j = 0; j < fit->m; j++)
            for (int c = 0; c < 3; c++)
                solution->shape[(size_t)g * fit->m + j][c] = ((double)x[j][c] - x[0][c]) / fit->scale;
    }
}

/* Guide g in metres. */
static void points_of(const struct solution *solution, uint32_t g, float (*out)[3])
{
    const struct groom_fit *fit = solution->fit;
    float root[3];
    for (int c = 0; c < 3; c++)
        root[c] = (float)(fit->groom->guides[(size_t)g * fit->m][c] + fit->scale * solution->move[g][c]);
    for (uint32_t j = 0; j < fit->m; j++)
        for (int c = 0; c < 3; c++)
            out[j][c] = (float)(root[c] + fit->scale * solution->shape[(size_t)g * fit->m + j][c]);
}

/* Whether a solution is one: weights of a damaged or odd groom may leave none. */
static int is_sane(const struct solution *solution, uint32_t g)
{
    const double (*s)[3] = (const double (*)[3])(solution->shape + (size_t)g * solution->fit->m);
    for (uint32_t j = 0; j < solution->fit->m; j++)
        for (int c = 0; c < 3; c++)
            if (!(fabs(s[j][c]) < FARTHEST))
                return 0;
    return 1;
}

/* Where the guide leaves the scalp: over the first twentieth, for one segment is too little. */
static void root_direction(const struct solution *solution, uint32_t g)
{
    uint32_t m = solution->fit->m, at = m / 20 > 1 ? m / 20 : 1;
    const double *s = solution->shape[(size_t)g * m + at];
    double length = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    for (int c = 0; c < 3; c++)
        solution->direction[g][c] = length > 0 ? (float)(s[c] / length) : 0;
}

static double distance(const double a[3], const double b[3])
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

/* Vertices at equal steps along the polyline they make. */
static void even_out(double (*shape)[3], double (*line)[3], uint32_t m)
{
    double all = 0, begin = 0, length = distance(shape[0], shape[1]);
    uint32_t at = 0;
    memcpy(line, shape, m * sizeof *shape);
    for (uint32_t j = 0; j + 1 < m; j++)
        all += distance(line[j], line[j + 1]);
    for (uint32_t j = 1; j + 1 < m; j++) {
        double wanted = all * j / (m - 1);
        while (at + 2 < m && begin + length < wanted) {
            begin += length;
            at++;
            length = distance(line[at], line[at + 1]);
        }
        double t = length > 0 ? fmin((wanted - begin) / length, 1) : 0;
        for (int c = 0; c < 3; c++)
            shape[j][c] = line[at][c] + t * (line[at + 1][c] - line[at][c]);
    }
}

/* --- where operator guides stand -------------------------------------------------------------------- */

/* Strands close in on their operator guide: where it stands shows in how. It is looked for around the place that who
 * follows it tells (fit/sites.h), the farther from there the less likely; where random numbers are known between that and
 * where it was found so far. */
static groom_status expect_roots(struct solution *solution, int known, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_fit *fit = solution->fit;
    const struct groom_allocator *allocator = memory_allocator(context);
    struct site *site = memory_array(allocator, fit->groom->n_operator_guides, sizeof *site);
    if (!site)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the places of %u operator guides", fit->groom->n_operator_guides);
    groom_status st = sites_find(fit, fit->groom->operator_guide_of, fit->groom->n_operator_guides, site, context, diag);
    for (uint32_t o = 0; st == GROOM_OK && o < fit->groom->n_operator_guides; o++) {
        size_t root = (size_t)fit->groom->operator_guide[o] * fit->m;
        double strands = site[o].n + FEW_STRANDS, all = strands * fit->m;
        double here = known ? HOLD_ROOT_KNOWN * all : 0;
        double there = known ? HOLD_ROOT_THERE * fit->m / sqrt(strands) : HOLD_ROOT_EXPECTED * all;
        solution->system.hold[root] = here + there;
        for (int c = 0; site[o].n > 0 && c < 3; c++)
            solution->system.pull[root][c] += there * (site[o].at[c] - (double)fit->groom->guides[root][c]) / (double)fit->scale;
    }
    memory_release(allocator, site, fit->groom->n_operator_guides, sizeof *site);
    return st;
}

/* Moves of roots out of the shapes, which begin at 0 then; and back. */
static void take_moves(struct solution *solution)
{
    const struct groom_fit *fit = solution->fit;
    for (uint32_t g = 0; g < fit->n_guides; g++) {
        double *first = solution->shape[(size_t)g * fit->m];
        memcpy(solution->move[g], first, sizeof solution->move[g]);
        memset(first, 0, sizeof *solution->shape);
    }
}

static void return_moves(struct solution *solution)
{
    for (uint32_t g = 0; g < solution->fit->n_guides; g++)
        memcpy(solution->shape[(size_t)g * solution->fit->m], solution->move[g], sizeof solution->move[g]);
}

/* Roots onto the head next to where they have moved, the tips not, towards which strands close in. */
static void seat_roots(struct solution *solution)
{
    const struct groom_fit *fit = solution->fit;
    for (uint32_t o = 0; fit->bvh && o < fit->groom->n_operator_guides; o++) {
        uint32_t g = fit->groom->operator_guide[o], m = fit->m;
        double (*shape)[3] = solution->shape + (size_t)g * m, *move = solution->move[g];
        const float *root = fit->groom->guides[(size_t)g * m];
        struct groom_surface_point surface;
        float at[3];
        for (int c = 0; c < 3; c++)
            at[c] = (float)(root[c] + fit->scale * move[c]);
        if ((move[0] == 0 && move[1] == 0 && move[2] == 0) || !groom_bvh_closest(fit->bvh, at, INFINITY, &surface))
            continue;
        for (int c = 0; c < 3; c++) {
            double off = ((double)surface.position[c] - root[c]) / fit->scale - move[c];
            move[c] += off;
            for (uint32_t j = 1; j < m; j++)
                shape[j][c] -= off * j / (m - 1);
        }
    }
}

/* --- out of the head -------------------------------------------------------------------------- */

/* Whether most of the strands that the guide shapes, of the first few, are in the head at vertex j. */
static int strands_are_in(const struct solution *solution, uint32_t g, uint32_t j, float clearance)
{
    const struct groom_fit *fit = solution->fit;
    const struct mean_strands *mean = &solution->mean;
    int asked = 0, in = 0;
    for (uint32_t at = mean->first[g]; at < mean->first[g + 1] && asked < ASKED; at++, asked++) {
        const float *x = fit->target[(size_t)(mean->member[at] / mean->n_parts) * fit->m + j];
        float p[3] = {fit->centre[0] + fit->scale * x[0], fit->centre[1] + fit->scale * x[1],
                      fit->centre[2] + fit->scale * x[2]};
        in += groom_bvh_signed_distance(fit->bvh, p) < -clearance;
    }
    return 2 * in > asked;
}

static void hold_at(struct solution *solution, uint32_t g, uint32_t j, const float place[3])
{
    const struct groom_fit *fit = solution->fit;
    size_t v = (size_t)g * fit->m + j;
    double weight = HOLD * fit->n / fit->n_guides;
    solution->system.hold[v] = weight;
    for (int c = 0; c < 3; c++)
        solution->system.pull[v][c] += weight * (((double)place[c] - fit->groom->guides[(size_t)g * fit->m][c]) / fit->scale -
                                                 solution->move[g][c]);
}

/* Whether the surface turns its back on a point. */
static int is_behind(const struct groom_surface_point *surface, const float p[3])
{
    float side = 0;
    for (int c = 0; c < 3; c++)
        side += (p[c] - surface->position[c]) * surface->normal[c];
    return side < 0;
}

/* Where vertices of a guide that are deep in the head come out of it; at a distance of 0 where they are not. */
static void look_at_guide(void *user, uint32_t g, uint32_t thread)
{
    const struct solution *solution = user;
    const struct groom_bvh *head = solution->fit->bvh;
    size_t first = (size_t)g * solution->fit->m;
    const float (*x)[3] = (const float (*)[3])(solution->point + first);
    struct side_walk walk = side_walk_begin(head);
    (void)thread;
    points_of(solution, g, solution->point + first);
    for (uint32_t j = 1; j < solution->fit->m; j++) {
        struct groom_surface_point *out = &solution->surface[first + j];
        if (!side_walk(&walk, x[j]) || !groom_bvh_closest(head, x[j], INFINITY, out) || !is_behind(out, x[j]))
            out->distance = 0;
    }
}

/* Holds vertices that are deep in the head at the nearest point of its surface; returns how many. */
static uint32_t hold_out_of_head(struct solution *solution, const struct groom_context *context)
{
    const struct groom_fit *fit = solution->fit;
    float clearance = (float)fit->options.stages.initialize.head_clearance * fit->ordinary;
    uint32_t n_held = 0;
    parallel_for(context, fit->n_guides, look_at_guide, solution);
    for (uint32_t g = 0; g < fit->n_guides; g++)
        for (uint32_t j = 1; j < fit->m; j++) {
            size_t v = (size_t)g * fit->m + j;
            if (solution->system.hold[v] == 0 && solution->surface[v].distance > clearance &&
                !strands_are_in(solution, g, j, clearance)) {
                hold_at(solution, g, j, solution->surface[v].position);
                n_held++;
            }
        }
    return n_held;
}

/* --- the problem --------------------------------------------------------------------------------- */

/* The weight of third differences at which waves of `cycles` a guide keep half of their size. */
static double along_of(double cycles, uint32_t m) { return pow(2 * sin(M_PI * fmin(cycles / (m - 1), 0.5)), -6); }

/* A guide holds all that its strands have in common, and that of a wave of a curl is what the curl is missed by: slow
 * curls would be found shorter than they are, and other ones. So guides begin smoother where there are curls, and are
 * what they can be where numbers are known. */
static double cycles_of(const struct groom_fit *fit, int known)
{
    double cycles = fit->options.stages.guides.cycles;
    int curls = 0;
    for (uint32_t o = 0; o < fit->groom->n_operators; o++) {
        const struct groom_operator *op = &fit->groom->operators[o];
        curls |= op->enabled && op->type == GROOM_OPERATOR_CURL && op->parameter[0] != 0;
    }
    return curls && !known ? CURLS_UNKNOWN * cycles : cycles;
}

/* Hair that is combed turns sharply out of the scalp and hardly at all farther on, which one weight for all of a guide
 * smooths away near the root. So third differences weigh there by how large they usually are, as if each were drawn from
 * a normal distribution of its place. Beyond the root's part all weigh the same. */
static void loosen_roots(struct solution *solution)
{
    uint32_t m = solution->fit->m, part = m / ROOT_PART, last = m - 3;
    double usual = 0;
    for (uint32_t j = part; j < last; j++)
        usual += solution->roughness[j].square / (last - part);
    for (uint32_t j = 0; j < part; j++) {
        double here = solution->roughness[j].square;
        if (here > usual)
            solution->system.along[j] *= fmax(usual / here, LOOSEST);
    }
}

/* What is rough and not shared with neighbours is what operators have left in guides: they would keep it from one round
 * to the next, as the strands' numbers are looked for around it. */
static void tighten(struct solution *solution)
{
    uint32_t m = solution->fit->m;
    for (uint32_t j = 0; j + 3 < m; j++)
        solution->system.along[j] /= fmax(roughness_share(solution->roughness, m, j), 1 / TIGHTEST);
}

static void weigh_roughness(struct solution *solution)
{
    uint32_t m = solution->fit->m;
    if (m <= 2 * ROOT_PART)
        return;
    for (uint32_t j = 0; j < m; j++)
        solution->system.along[j] = solution->along;
    roughness_measure((const double (*)[3])solution->shape, m, &solution->laplacian, solution->roughness);
    loosen_roots(solution);
    tighten(solution);
}

static groom_status cancelled(struct groom_diag *diag)
{
    return groom_fail(diag, GROOM_ECANCELLED, "cancelled while guides were solved for");
}

/* Every HELD-th strand is left out (held 0) or alone left in (held 1): parts of others weigh nothing. */
static void weigh_parts(struct mean_strands *mean, const struct mean_part *parts, int held)
{
    for (uint32_t i = 0; i < mean->n; i++)
        for (uint32_t p = 0; p < mean->n_parts; p++) {
            size_t at = (size_t)i * mean->n_parts + p;
            int in = (i % HELD == HELD - 1) == held;
            mean->part[at].shape = in ? parts[at].shape : 0;
            mean->part[at].clumped = in ? parts[at].clumped : 0;
        }
}

/* How well guides, solved for with this pull and without some strands, foretell those; all others add a
 * constant to it. The shapes are left as they come out. */
static groom_status foretell(struct solution *solution, const struct mean_part *parts, double along, double across,
                             double *loss, const struct groom_context *context, struct groom_diag *diag)
{
    struct guide_system system = {0};
    weigh_parts(&solution->mean, parts, 0);
    groom_status st = guide_system_init(&system, &solution->mean, &solution->laplacian, along, across, context, diag);
    if (st == GROOM_OK) {
        guide_system_solve(&system, solution->shape, TOLERANCE_CHOOSING, ITERATIONS_CHOOSING, context);
        weigh_parts(&solution->mean, parts, 1);
        *loss = mean_strands_loss(&solution->mean, (const double (*)[3])solution->shape, solution->partial, context);
    }
    guide_system_finish(&system);
    return st;
}

/* Curl and clump move strands of an operator guide together: those that are left out do not tell whether a
 * guide follows its strands or their bundle. */
static int bundles_move(const struct groom *groom)
{
    for (uint32_t o = 0; o < groom->n_operators; o++)
        if (groom->operators[o].enabled && (groom->operators[o].type == GROOM_OPERATOR_CURL ||
                                            groom->operators[o].type == GROOM_OPERATOR_CLUMP))
            return 1;
    return 0;
}

/* The pull across the scalp that foretells strands best: how much guides have to say of their own depends on
 * how many strands each has, how far operators scatter them, and how alike guides are. */
static groom_status choose_across(struct solution *solution, double along, double *across,
                                  const struct groom_context *context, struct groom_diag *diag)
{
    static const double pulls[] = {10, 3, 1, 0.3, 0.1};
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_parts = (size_t)solution->mean.n * solution->mean.n_parts;
    double least = INFINITY, loss = INFINITY;
    groom_status st = GROOM_OK;
    *across = USUAL_ACROSS;
    if (bundles_move(solution->fit->groom))
        return GROOM_OK;
    struct mean_part *parts = memory_array(allocator, n_parts, sizeof *parts);
    if (!parts)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to foretell %u strands", solution->mean.n);
    memcpy(parts, solution->mean.part, n_parts * sizeof *parts);
    for (int k = 0; st == GROOM_OK && k < 5; k++) {
        if (progress_cancelled(context))
            st = cancelled(diag);
        else if ((st = foretell(solution, parts, along, pulls[k], &loss, context, diag)) == GROOM_OK && loss < least) {
            least = loss;
            *across = pulls[k];
        }
    }
    memcpy(solution->mean.part, parts, n_parts * sizeof *parts);
    memory_release(allocator, parts, n_parts, sizeof *parts);
    load_shapes(solution);
    return st;
}

static groom_status solution_init(struct solution *solution, struct groom_fit *fit, int known, double across,
                                  const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t size = (size_t)fit->n_guides * fit->m;
    double cycles = cycles_of(fit, known);
    groom_status st;
    *solution = (struct solution){.fit = fit};
    solution->shape = memory_array(allocator, size, sizeof *solution->shape);
    solution->move = memory_array_zero(allocator, fit->n_guides, sizeof *solution->move);
    solution->line = memory_array(allocator, fit->m, sizeof *solution->line);
    solution->roughness = memory_array(allocator, fit->m, sizeof *solution->roughness);
    solution->partial = memory_array(allocator, mean_strands_pieces(fit->n), sizeof *solution->partial);
    solution->direction = memory_array(allocator, fit->n_guides, sizeof *solution->direction);
    solution->point = memory_array(allocator, size, sizeof *solution->point);
    solution->surface = memory_array(allocator, size, sizeof *solution->surface);
    if (!solution->shape || !solution->move || !solution->line || !solution->roughness || !solution->partial || !solution->direction || !solution->point ||
        !solution->surface)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the shapes of %u guides", fit->n_guides);
    load_shapes(solution);
    for (uint32_t g = 0; g < fit->n_guides; g++)
        root_direction(solution, g);
    st = known ? mean_strands_init_known(&solution->mean, fit, context, diag)
               : mean_strands_init(&solution->mean, fit, context, diag);
    if (st != GROOM_OK ||
        (st = guide_laplacian((const float (*)[2])fit->groom->guide_uv, (const float (*)[3])solution->direction,
                              fit->n_guides, fit->options.stages.guides.sigma_d, &solution->laplacian, context,
                              diag)) != GROOM_OK)
        return st;
    if (across == GROOM_FIT_AUTO &&
        (st = choose_across(solution, along_of(cycles, fit->m), &across, context, diag)) != GROOM_OK)
        return st;
    st = guide_system_init(&solution->system, &solution->mean, &solution->laplacian, along_of(cycles, fit->m), across,
                           context, diag);
    if (st == GROOM_OK)
        solution->along = solution->system.along[0];
    int clumps = solution->mean.n_parts > fit->groom->n_instancing;
    if (st == GROOM_OK && clumps)
        st = expect_roots(solution, known, context, diag);
    return st;
}

static void solution_finish(struct solution *solution, const struct groom_context *context)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const struct groom_fit *fit = solution->fit;
    size_t size = (size_t)fit->n_guides * fit->m;
    guide_system_finish(&solution->system);
    mean_strands_finish(&solution->mean);
    sparse_finish(&solution->laplacian);
    memory_release(allocator, solution->shape, size, sizeof *solution->shape);
    memory_release(allocator, solution->move, fit->n_guides, sizeof *solution->move);
    memory_release(allocator, solution->line, fit->m, sizeof *solution->line);
    memory_release(allocator, solution->roughness, fit->m, sizeof *solution->roughness);
    memory_release(allocator, solution->partial, mean_strands_pieces(fit->n), sizeof *solution->partial);
    memory_release(allocator, solution->direction, fit->n_guides, sizeof *solution->direction);
    memory_release(allocator, solution->point, size, sizeof *solution->point);
    memory_release(allocator, solution->surface, size, sizeof *solution->surface);
}

/* Solved shapes as points, where they are any. */
static void fill_points(struct solution *solution)
{
    const struct groom_fit *fit = solution->fit;
    for (uint32_t g = 0; g < fit->n_guides; g++) {
        size_t at = (size_t)g * fit->m;
        if (is_sane(solution, g))
            points_of(solution, g, solution->point + at);
        else
            memcpy(solution->point + at, fit->groom->guides + at, fit->m * sizeof *solution->point);
    }
}

/* The groom's guides for those in `point`, and back. */
static void exchange_guides(struct solution *solution)
{
    const struct groom_fit *fit = solution->fit;
    for (size_t v = 0; v < (size_t)fit->n_guides * fit->m; v++)
        for (int c = 0; c < 3; c++) {
            float kept = fit->groom->guides[v][c];
            fit->groom->guides[v][c] = solution->point[v][c];
            solution->point[v][c] = kept;
        }
}

static groom_status solve_rounds(struct solution *solution, uint32_t rounds_at_head, double tolerance, const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_fit *fit = solution->fit;
    for (uint32_t round = 0; round <= rounds_at_head; round++) {
        return_moves(solution);
        guide_system_solve(&solution->system, solution->shape, tolerance, MOST_ITERATIONS, context);
        take_moves(solution);
        if (progress_cancelled(context))
            return cancelled(diag);
        if (!fit->bvh || round == rounds_at_head || hold_out_of_head(solution, context) == 0)
            break;
    }
    seat_roots(solution);
    for (uint32_t g = 0; g < fit->n_guides; g++)
        for (int pass = 0; pass < EVENINGS; pass++)
            even_out(solution->shape + (size_t)g * fit->m, solution->line, fit->m);
    return GROOM_OK;
}

static groom_status solve(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct solution solution;
    double before, after;
    groom_status st = solution_init(&solution, fit, 0, fit->options.stages.guides.across, context, diag);
    if (st != GROOM_OK)
        goto out;
    if ((st = loss_guides(fit, &before, context, diag)) != GROOM_OK ||
        (st = solve_rounds(&solution, ROUNDS_AT_HEAD, TOLERANCE, context, diag)) != GROOM_OK)
        goto out;
    fill_points(&solution);
    exchange_guides(&solution);
    if ((st = loss_guides(fit, &after, context, diag)) != GROOM_OK || (st = bundles_coordinates(fit, context, diag)) != GROOM_OK) {
        exchange_guides(&solution);
        goto out;
    }
    report_progress(&fit->report, "guides", "L_g", before, 0, context);
    report_progress(&fit->report, "guides", "L_g", after, 1, context);
    fit->phase = ASSIGN;
out:
    solution_finish(&solution, context);
    return st;
}

groom_status guides_refine(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    struct solution solution;
    groom_status st = solution_init(&solution, fit, 1, fit->options.stages.randoms.across, context, diag);
    for (int weighing = 0; st == GROOM_OK && weighing < WEIGHINGS; weighing++) {
        weigh_roughness(&solution);
        st = weighing + 1 < WEIGHINGS ? solve_rounds(&solution, 0, TOLERANCE_CHOOSING, context, diag)
                                      : solve_rounds(&solution, ROUNDS_KNOWN, TOLERANCE, context, diag);
    }
    if (st == GROOM_OK) {
        fill_points(&solution);
        exchange_guides(&solution);
        if ((st = bundles_coordinates(fit, context, diag)) != GROOM_OK)
            exchange_guides(&solution);
    }
    solution_finish(&solution, context);
    return st;
}

/* --- the stage -------------------------------------------------------------------------------------- */

static int is_paper(const struct groom_fit *fit) { return fit->options.stages.guides.method == GROOM_FIT_PAPER; }

static groom_status paper_step(struct groom_fit *fit, const struct groom_context *context, struct groom_diag *diag)
{
    int ended = 0;
    groom_status st = paper_guides_step(fit, &ended, context, diag);
    if (st == GROOM_OK && ended) {
        fit->phase = ASSIGN;
        fit->iteration = 0;
    }
    return st;
}

groom_status guides_step(struct groom_fit *fit, int *ended, const struct groom_context *context,
                         struct groom_diag *diag)
{
    if (fit->phase == SOLVE && is_paper(fit))
        return paper_step(fit, context, diag);
    if (fit->phase == SOLVE)
        return solve(fit, context, diag);
    return assign_step(fit, ended, context, diag); /* strands have moved: ask again what is in the head */
}

double guides_fraction(const struct groom_fit *fit)
{
    double solved = fit->iteration / fmax(fit->options.stages.guides.iterations, 1);
    if (fit->phase == SOLVE)
        return is_paper(fit) ? 0.7 * fmin(solved, 1) : 0;
    return 0.7 + 0.3 * fit->iteration / fit->n;
}

int guides_sound(const struct groom_fit *fit)
{
    if (fit->phase == SOLVE && is_paper(fit) && fit->iteration > 0)
        return fit->iteration < fit->options.stages.guides.iterations && fit->n_moments == paper_guides_moments(fit);
    return fit->phase < ENDED && fit->n_moments == 0 && fit->iteration < fit->n &&
           (fit->phase == ASSIGN || fit->iteration == 0);
}
