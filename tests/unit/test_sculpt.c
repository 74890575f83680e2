/* Eq. 15: gradients against vectors and finite differences, the solver against the vectors' minima. */
#include <cJSON.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "curvature/energy.h"
#include "groom/random.h"
#include "tests/support/superhelix.h"
#include "tests/support/test.h"

/* --- one case of the vectors --------------------------------------------------------------- */

struct case_data {
    const char *name;
    struct groom_superhelices *helices;
    uint32_t n, m;
    struct groom_anchor *anchors;
    struct located_anchor *located;
    struct sculpt_problem problem;
};

static struct case_data case_load(const struct cJSON *object)
{
    struct case_data d = {.name = vectors_get(object, "name")->valuestring, .helices = superhelix_from_case(object)};
    d.n = d.helices->n_elements;
    d.m = (uint32_t)vectors_size(vectors_get(object, "anchors_lambda"));
    double *lambda = calloc(d.m, sizeof *lambda), (*target)[3] = calloc(d.m, sizeof *target);
    double length = groom_superhelix_length(d.helices, 0);
    d.anchors = calloc(d.m, sizeof *d.anchors);
    d.located = calloc(d.m, sizeof *d.located);
    vectors_read(vectors_get(object, "anchors_lambda"), lambda, d.m);
    vectors_read(vectors_get(object, "anchors"), target[0], (size_t)d.m * 3);
    struct chain chain = chain_of(d.helices, 0);
    for (uint32_t k = 0; k < d.m; k++) {
        d.anchors[k] = (struct groom_anchor){.strand = 0, .at = fmin(lambda[k] / length, 1.0),
                                             .position = {target[k][0], target[k][1], target[k][2]}};
        d.located[k] = energy_locate(&chain, lambda[k], target[k]);
    }
    d.problem = (struct sculpt_problem){.chain = chain, .n_anchors = d.m, .anchor = d.located,
                                        .rest = (const double(*)[3])d.helices->q, .c = vectors_number(object, "c")};
    free(lambda), free(target);
    return d;
}

static void case_free(struct case_data *d)
{
    groom_superhelices_destroy(d->helices);
    free(d->anchors), free(d->located);
}

typedef void case_check(const struct cJSON *object, struct case_data *d);

static void each_case(case_check *check)
{
    struct cJSON *json = vectors_load("superhelix-sculpt.json");
    if (!json)
        return;
    const struct cJSON *object;
    cJSON_ArrayForEach(object, vectors_get(json, "cases"))
    {
        struct case_data d = case_load(object);
        check(object, &d);
        case_free(&d);
    }
    cJSON_Delete(json);
}

static void check_location(const struct cJSON *object, struct case_data *d)
{
    double *element = calloc(d->m, sizeof *element), *s = calloc(d->m, sizeof *s);
    vectors_read(vectors_get(object, "anchor_element"), element, d->m);
    vectors_read(vectors_get(object, "anchor_local_s"), s, d->m);
    for (uint32_t k = 0; k < d->m; k++) {
        ck_assert_msg(d->located[k].element == (uint32_t)element[k], "%s, anchor %u", d->name, k);
        ck_assert_double_eq_tol(d->located[k].s, s[k], 1e-12);
    }
    free(element), free(s);
}

START_TEST(anchors_lie_on_the_elements_of_the_vectors) { each_case(check_location); }
END_TEST

/* The control points of q against those of the vectors, within `tolerance`. */
static void compare_control_points(const struct cJSON *object, struct case_data *d, const double (*q)[3], const char *name,
                                   double tolerance)
{
    double(*want)[3] = calloc(d->m, sizeof *want);
    struct chain_state *junction = calloc(d->n + 1, sizeof *junction);
    vectors_read(vectors_get(object, name), want[0], 3 * (size_t)d->m);
    energy_junctions(&d->problem.chain, q, junction);
    for (uint32_t k = 0; k < d->m; k++) {
        uint32_t j = d->located[k].element;
        vec3 got = chain_point(junction[j], vec_of(q[j]), d->located[k].s);
        double miss = sqrt(pow(got.x - want[k][0], 2) + pow(got.y - want[k][1], 2) + pow(got.z - want[k][2], 2));
        ck_assert_msg(miss <= tolerance, "%s, %s[%u]: %.3g off", d->name, name, k, miss);
    }
    free(want), free(junction);
}

static void check_control_points(const struct cJSON *object, struct case_data *d)
{
    compare_control_points(object, d, d->problem.chain.q, "control_points", 1e-10);
}

START_TEST(control_points_meet_the_vectors) { each_case(check_control_points); }
END_TEST

/* Where the last element begins. */
static void check_junction(const struct cJSON *object, struct case_data *d)
{
    struct chain_state *junction = calloc(d->n + 1, sizeof *junction), *last = &junction[d->n];
    double p[3], rows[3][3], got[3];
    vectors_read(vectors_get(object, "junction_last"), p, 3);
    vectors_read(vectors_get(object, "frame_last_rows"), rows[0], 9);
    energy_junctions(&d->problem.chain, d->problem.chain.q, junction);
    vec_store(last->p, got);
    const double(*columns)[3] = (const double(*)[3])&last->F;
    for (int r = 0; r < 3; r++) {
        ck_assert_msg(fabs(got[r] - p[r]) <= 1e-10, "%s: junction %g, not %g", d->name, got[r], p[r]);
        for (int c = 0; c < 3; c++)
            ck_assert_msg(fabs(columns[c][r] - rows[r][c]) <= 1e-10, "%s: frame %d %d", d->name, r, c);
    }
    free(junction);
}

START_TEST(the_last_junction_meets_the_vectors) { each_case(check_junction); }
END_TEST

static void check_jacobian(const struct cJSON *object, struct case_data *d)
{
    struct chain_state *junction = calloc(d->n + 1, sizeof *junction);
    const struct cJSON *block;
    energy_junctions(&d->problem.chain, d->problem.chain.q, junction);
    cJSON_ArrayForEach(block, vectors_get(object, "jac_blocks"))
    {
        uint32_t k = (uint32_t)vectors_number(block, "k"), j = (uint32_t)vectors_number(block, "j");
        double rows[3][3];
        vectors_read(vectors_get(block, "rows"), rows[0], 9);
        mat3 got = energy_jacobian_block(&d->problem.chain, d->problem.chain.q, junction, d->located[k].element,
                                         d->located[k].s, j);
        const double(*columns)[3] = (const double(*)[3])&got;
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                ck_assert_msg(fabs(columns[c][r] - rows[r][c]) <= 1e-8, "%s, block %u %u", d->name, k, j);
    }
    free(junction);
}

START_TEST(jacobian_blocks_meet_the_vectors) { each_case(check_jacobian); }
END_TEST

static void compare_gradient(const struct cJSON *object, struct case_data *d, const char *at, const char *energy,
                             const char *gradient)
{
    double(*q)[3] = calloc(d->n, sizeof *q), (*want)[3] = calloc(d->n, sizeof *want);
    double(*got)[3] = calloc(d->n, sizeof *got), most = 0.0;
    struct chain_state *junction = calloc(d->n + 1, sizeof *junction);
    vectors_read(vectors_get(object, at), q[0], 3 * (size_t)d->n);
    vectors_read(vectors_get(object, gradient), want[0], 3 * (size_t)d->n);
    double E = energy_gradient(&d->problem, (const double(*)[3])q, got, junction), want_E = vectors_number(object, energy);
    ck_assert_msg(fabs(E - want_E) <= 1e-10 * fmax(want_E, 1.0), "%s: energy %.15g, not %.15g", d->name, E, want_E);
    ck_assert_double_eq_tol(energy_value(&d->problem, (const double(*)[3])q, NULL), E, 1e-12 * fmax(E, 1.0));
    for (uint32_t i = 0; i < 3 * d->n; i++)
        most = fmax(most, fabs(want[i / 3][i % 3]));
    for (uint32_t i = 0; i < 3 * d->n; i++)
        ck_assert_msg(fabs(got[i / 3][i % 3] - want[i / 3][i % 3]) <= 1e-8 * most, "%s, %s[%u]", d->name, gradient, i);
    free(q), free(want), free(got), free(junction);
}

static void check_gradient(const struct cJSON *object, struct case_data *d)
{
    compare_gradient(object, d, "q", "E_q0", "grad_q0");
    compare_gradient(object, d, "q_pert", "E_pert", "grad_pert");
}

START_TEST(energies_and_gradients_meet_the_vectors) { each_case(check_gradient); }
END_TEST

/* The curvatures at a minimum that the energy fixes: c |q - q_min|^2 is what being off costs at least. */
static void compare_curvatures(const struct cJSON *object, const struct case_data *d, const double (*q)[3])
{
    double(*want)[3] = calloc(d->n, sizeof *want), square = 0.0;
    double c = vectors_number(object, "c"), energy = vectors_number(object, "E_min");
    vectors_read(vectors_get(object, "q_min"), want[0], 3 * (size_t)d->n);
    for (uint32_t j = 0; j < d->n; j++)
        for (int k = 0; k < 3; k++)
            square += (q[j][k] - want[j][k]) * (q[j][k] - want[j][k]);
    ck_assert_msg(square <= 1e-8 * energy / c, "%s: curvatures %.3g off, at most %.3g", d->name, sqrt(square),
                  sqrt(1e-8 * energy / c));
    free(want);
}

static void check_minimum(const struct cJSON *object, struct case_data *d)
{
    struct groom_sculpt_options options = groom_sculpt_options_default();
    struct groom_sculpt_outcome outcome;
    struct groom_superhelices *h;
    double want = vectors_number(object, "E_min"), before = vectors_number(object, "E_q0");
    ck_ok(groom_superhelices_copy(d->helices, NULL, &h, NULL));
    options.stiffness = vectors_number(object, "c") * d->n;
    options.tolerance = 1e-12;
    ck_ok(groom_superhelices_sculpt(h, NULL, d->anchors, d->m, &options, NULL, &outcome, NULL));
    ck_assert_double_eq_tol(outcome.energy_before, before, 1e-10 * before);
    ck_assert_msg(outcome.energy_after <= want * (1.0 + 1e-6) + 1e-15, "%s: %.12g, not %.12g (%u iterations)", d->name,
                  outcome.energy_after, want, outcome.iterations);
    if (vectors_number(object, "agree") >= 3 && want > 1e-9)
        ck_assert_msg(outcome.energy_after >= want * (1.0 - 1e-6), "%s: %.12g below %.12g", d->name,
                      outcome.energy_after, want);
    ck_assert_double_eq_tol(energy_value(&d->problem, (const double(*)[3])h->q, NULL), outcome.energy_after,
                            1e-9 * outcome.energy_after + 1e-15);
    ck_assert_mem_eq(h->length, d->helices->length, d->n * sizeof *h->length);
    if (vectors_number(object, "agree") >= 3) /* one minimum: its points too, as well as its energy tells them */
        compare_control_points(object, d, (const double(*)[3])h->q, "control_points_min", 1e-3 * sqrt(want) + 1e-4);
    if (vectors_number(object, "agree") >= 3 && vectors_number(object, "c") > 0.0) /* without stiffness many q do */
        compare_curvatures(object, d, (const double(*)[3])h->q);
    groom_superhelices_destroy(h);
}

START_TEST(the_solver_reaches_the_minima_of_the_vectors) { each_case(check_minimum); }
END_TEST

/* --- finite differences --------------------------------------------------------------------- */

START_TEST(the_gradient_agrees_with_finite_differences)
{
    for (uint32_t n = 1; n <= 40; n += 13) {
        struct groom_superhelices *h = superhelix_coils(1, n, n, 1);
        struct chain chain = chain_of(h, 0);
        struct located_anchor located[3];
        double(*rest)[3] = calloc(n, sizeof *rest), (*g)[3] = calloc(n, sizeof *g);
        struct chain_state *junction = calloc(n + 1, sizeof *junction);
        for (int k = 0; k < 3; k++)
            located[k] = energy_locate(&chain, 0.2 * (k + 1) / 3.2, (double[3]){0.05 * k, -0.1, 0.03});
        for (uint32_t i = 0; i < 3 * n; i++)
            rest[i / 3][i % 3] = h->q[i / 3][i % 3] + 5.0 * groom_random_normal((struct groom_random_key){n, 5}, i, 0);
        struct sculpt_problem p = {.chain = chain, .n_anchors = 3, .anchor = located,
                                   .rest = (const double(*)[3])rest, .c = 1e-8};
        energy_gradient(&p, (const double(*)[3])h->q, g, junction);
        for (uint32_t i = 0; i < 3 * n; i++) {
            double *q = &h->q[i / 3][i % 3], kept = *q, step = 1e-3, slope = g[i / 3][i % 3];
            *q = kept + step;
            double more = energy_value(&p, (const double(*)[3])h->q, NULL);
            *q = kept - step;
            double less = energy_value(&p, (const double(*)[3])h->q, NULL);
            *q = kept;
            ck_assert_double_eq_tol(slope, (more - less) / (2.0 * step), 1e-10 + 1e-6 * fabs(slope));
        }
        free(rest), free(g), free(junction);
        groom_superhelices_destroy(h);
    }
}
END_TEST

/* --- many strands ---------------------------------------------------------------------------- */

/* Coils of differing counts, anchors on most, up to three. */
static struct groom_superhelices *mixed(uint32_t n_strands, struct groom_anchor *anchors, size_t *n_anchors)
{
    struct groom_superhelices *all, *coils = superhelix_coils(n_strands, 40, 8, 1);
    size_t m = 0;
    ck_ok(groom_superhelices_create(n_strands, coils->n_elements, NULL, &all, NULL));
    for (uint32_t i = 0; i < n_strands; i++) {
        uint32_t n = 20 + (i * 7) % 21;
        all->first[i + 1] = all->first[i] + n;
        memcpy(all->root[i], coils->root[i], sizeof *all->root);
        memcpy(all->frame[i], coils->frame[i], sizeof *all->frame);
        memcpy(all->q + all->first[i], coils->q + coils->first[i], n * sizeof *all->q);
        memcpy(all->length + all->first[i], coils->length + coils->first[i], n * sizeof *all->length);
        for (uint32_t k = 0; k < i % 4; k++)
            anchors[m++] = (struct groom_anchor){.strand = i, .at = 1.0 - 0.25 * k,
                .position = {coils->root[i][0] + 0.03 * (k + 1), coils->root[i][1] - 0.05, coils->root[i][2]}};
    }
    all->n_elements = all->first[n_strands];
    *n_anchors = m;
    groom_superhelices_destroy(coils);
    return all;
}

/* The container's arrays are released by their counts: give the true one back first. */
static void mixed_free(struct groom_superhelices *h, uint32_t n_strands)
{
    h->n_elements = n_strands * 40;
    groom_superhelices_destroy(h);
}

START_TEST(strands_without_anchors_are_left_alone_and_others_move_nearer)
{
    struct groom_anchor anchors[64];
    size_t m;
    struct groom_superhelices *h = mixed(21, anchors, &m), *was;
    struct groom_sculpt_outcome outcomes[21];
    struct groom_sculpt_options options = groom_sculpt_options_default();
    ck_ok(groom_superhelices_copy(h, NULL, &was, NULL));
    ck_ok(groom_superhelices_sculpt(h, NULL, anchors, m, &options, NULL, outcomes, NULL));
    for (uint32_t i = 0; i < 21; i++) {
        if (i % 4 == 0) {
            ck_assert_int_eq(outcomes[i].end, GROOM_SCULPT_UNTOUCHED);
            ck_assert_mem_eq(h->q + h->first[i], was->q + h->first[i],
                             (h->first[i + 1] - h->first[i]) * sizeof *h->q);
            continue;
        }
        ck_assert_int_eq(outcomes[i].end, GROOM_SCULPT_CONVERGED);
        ck_assert_double_lt(outcomes[i].energy_after, outcomes[i].energy_before);
        ck_assert_uint_gt(outcomes[i].iterations, 0);
    }
    groom_superhelices_destroy(was);
    mixed_free(h, 21);
}
END_TEST

START_TEST(a_strand_is_solved_the_same_alone_and_among_others)
{
    struct groom_anchor anchors[64], own[4];
    size_t m;
    struct groom_superhelices *h = mixed(21, anchors, &m), *was;
    struct groom_sculpt_options options = groom_sculpt_options_default();
    ck_ok(groom_superhelices_copy(h, NULL, &was, NULL));
    ck_ok(groom_superhelices_sculpt(h, NULL, anchors, m, &options, NULL, NULL, NULL));
    for (uint32_t i = 0; i < 21; i++) {
        size_t n = 0;
        for (size_t k = 0; k < m; k++)
            if (anchors[k].strand == i)
                own[n++] = anchors[k];
        ck_ok(groom_superhelices_sculpt(was, NULL, own, n, &options, NULL, NULL, NULL));
    }
    ck_assert_mem_eq(h->q, was->q, h->n_elements * sizeof *h->q);
    groom_superhelices_destroy(was);
    mixed_free(h, 21);
}
END_TEST

START_TEST(the_order_of_anchors_and_the_pool_do_not_matter)
{
    enum { N_STRANDS = 700 }; /* several pieces, and hard strands of each */
    static struct groom_anchor anchors[2 * N_STRANDS], turned[2 * N_STRANDS];
    static struct groom_sculpt_outcome outcomes[N_STRANDS];
    size_t m, n_hard = 0;
    struct groom_superhelices *h = mixed(N_STRANDS, anchors, &m), *b;
    struct groom_sculpt_options options = groom_sculpt_options_default();
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    for (size_t k = 0; k < m; k++)
        turned[k] = anchors[m - 1 - k];
    ck_ok(groom_superhelices_copy(h, NULL, &b, NULL));
    ck_ok(groom_superhelices_sculpt(h, NULL, anchors, m, &options, NULL, outcomes, NULL));
    for (uint32_t i = 0; i < N_STRANDS; i++)
        n_hard += outcomes[i].iterations > options.max_iterations;
    ck_assert_uint_gt(n_hard, 1);
    ck_ok(groom_superhelices_sculpt(b, NULL, turned, m, &options, &context, NULL, NULL));
    ck_assert_mem_eq(h->q, b->q, h->n_elements * sizeof *h->q);
    groom_superhelices_destroy(b);
    groom_pool_destroy(pool);
    mixed_free(h, N_STRANDS);
}
END_TEST

START_TEST(a_drag_may_start_from_its_last_result)
{
    struct groom_superhelices *h = superhelix_coils(4, 45, 2, 0), *rest;
    struct groom_sculpt_options options = groom_sculpt_options_default();
    struct groom_sculpt_outcome cold[4], warm[4];
    struct groom_anchor anchors[4];
    ck_ok(groom_superhelices_copy(h, NULL, &rest, NULL));
    for (uint32_t i = 0; i < 4; i++)
        anchors[i] = (struct groom_anchor){i, 1.0, {h->root[i][0] + 0.05, h->root[i][1], h->root[i][2]}};
    ck_ok(groom_superhelices_sculpt(h, (const double(*)[3])rest->q, anchors, 4, &options, NULL, cold, NULL));
    ck_ok(groom_superhelices_sculpt(h, (const double(*)[3])rest->q, anchors, 4, &options, NULL, warm, NULL));
    for (uint32_t i = 0; i < 4; i++) {
        ck_assert_double_le(warm[i].energy_after, cold[i].energy_after * (1.0 + 1e-12));
        ck_assert_double_eq_tol(warm[i].energy_after, cold[i].energy_after, 1e-6 * cold[i].energy_after);
        ck_assert_uint_le(warm[i].iterations, cold[i].iterations);
    }
    groom_superhelices_destroy(h);
    groom_superhelices_destroy(rest);
}
END_TEST

START_TEST(stiffness_means_the_same_at_any_count)
{
    double moved[2];
    for (int fine = 0; fine < 2; fine++) {
        struct groom_superhelices *h = superhelix_straight(fine ? 80 : 20, 0.2);
        struct groom_anchor anchor = {0, 1.0, {0.15, 0.08, 0.0}};
        struct groom_sculpt_options options = groom_sculpt_options_default();
        struct groom_sculpt_outcome outcome;
        options.stiffness = groom_sculpt_stiffness(100.0, 45);
        ck_ok(groom_superhelices_sculpt(h, NULL, &anchor, 1, &options, NULL, &outcome, NULL));
        moved[fine] = outcome.anchor_error_max_m;
        groom_superhelices_destroy(h);
    }
    ck_assert_double_eq_tol(moved[0] / moved[1], 1.0, 0.02);
}
END_TEST

/* --- what is refused ----------------------------------------------------------------------------- */

START_TEST(bad_anchors_are_named_and_nothing_changes)
{
    struct groom_superhelices *h = superhelix_coils(3, 10, 1, 0), *was;
    struct groom_sculpt_options options = groom_sculpt_options_default();
    struct groom_anchor good = {1, 0.5, {0, 0, 0}}, bad[3] = {{7, 0.5, {0, 0, 0}}, {1, 1.5, {0, 0, 0}}, {1, 0.5, {0, NAN, 0}}};
    const char *pointers[3] = {"/anchors/1/strand", "/anchors/1/at", "/anchors/1/position"};
    ck_ok(groom_superhelices_copy(h, NULL, &was, NULL));
    for (int i = 0; i < 3; i++) {
        struct groom_anchor both[2] = {good, bad[i]};
        struct groom_diag diag;
        ck_status(groom_superhelices_sculpt(h, NULL, both, 2, &options, NULL, NULL, &diag), GROOM_EINVAL);
        ck_assert_str_eq(diag.pointer, pointers[i]);
        ck_assert_mem_eq(h->q, was->q, h->n_elements * sizeof *h->q);
    }
    options.stiffness = NAN;
    ck_status(groom_superhelices_sculpt(h, NULL, &good, 1, &options, NULL, NULL, NULL), GROOM_EINVAL);
    groom_superhelices_destroy(h);
    groom_superhelices_destroy(was);
}
END_TEST

START_TEST(each_allocation_may_fail)
{
    struct groom_superhelices *h = superhelix_coils(6, 10, 1, 0);
    struct groom_sculpt_options options = groom_sculpt_options_default();
    struct groom_anchor anchors[2] = {{1, 1.0, {0.1, 0, 0}}, {4, 0.5, {0.1, 0, 0}}};
    for (size_t n = 0;; n++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        test_failing_allocator_init(&state, n, &allocator);
        struct groom_context context = {.allocator = &allocator};
        groom_status st = groom_superhelices_sculpt(h, NULL, anchors, 2, &options, &context, NULL, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
        ck_assert_uint_lt(n, 100);
    }
    groom_superhelices_destroy(h);
}
END_TEST

static int always(void *user) { return user != NULL; }

START_TEST(a_sculpt_can_be_cancelled)
{
    struct groom_superhelices *h = superhelix_coils(2, 10, 1, 0);
    struct groom_sculpt_options options = groom_sculpt_options_default();
    struct groom_anchor anchor = {1, 1.0, {0.1, 0, 0}};
    struct groom_progress progress = {.cancelled = always, .user = &anchor};
    struct groom_context context = {.progress = &progress};
    ck_status(groom_superhelices_sculpt(h, NULL, &anchor, 1, &options, &context, NULL, NULL), GROOM_ECANCELLED);
    groom_superhelices_destroy(h);
}
END_TEST

TEST_SUITE("sculpt", anchors_lie_on_the_elements_of_the_vectors, control_points_meet_the_vectors,
           the_last_junction_meets_the_vectors, jacobian_blocks_meet_the_vectors,
           energies_and_gradients_meet_the_vectors, the_solver_reaches_the_minima_of_the_vectors,
           the_gradient_agrees_with_finite_differences,
           strands_without_anchors_are_left_alone_and_others_move_nearer,
           a_strand_is_solved_the_same_alone_and_among_others, the_order_of_anchors_and_the_pool_do_not_matter,
           a_drag_may_start_from_its_last_result, stiffness_means_the_same_at_any_count,
           bad_anchors_are_named_and_nothing_changes, each_allocation_may_fail, a_sculpt_can_be_cancelled)
