/* the parts of stage `guides`: mean strands, neighbours, the linear system */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fit/guide_laplacian.h"
#include "fit/guide_system.h"
#include "fit/mean_strands.h"
#include "fit/roughness.h"
#include "groom/random.h"
#include "tests/support/guides.h"
#include "tests/support/test.h"

#define VERTICES 20

/* --- helpers ---------------------------------------------------------------------------- */

struct rig {
    struct groom_sample *sample;
    struct groom_fit *fit;
    struct mean_strands mean;
    struct sparse laplacian;
    struct guide_system system;
    size_t size;
};

static void rig_init(struct rig *rig, groom_sample_style style, double along, double across)
{
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    options.vertices = VERTICES;
    options.guides = 40;
    options.operator_guides = 20;
    memset(rig, 0, sizeof *rig);
    rig->sample = guides_sample(style, 200, VERTICES, 1, NULL);
    rig->fit = guides_fit(rig->sample, &options, "guides", NULL);
    rig->size = (size_t)rig->fit->n_guides * VERTICES;
    float (*direction)[3] = calloc(rig->fit->n_guides, sizeof *direction);
    ck_ok(mean_strands_init(&rig->mean, rig->fit, NULL, NULL));
    ck_ok(guide_laplacian((const float (*)[2])rig->fit->groom->guide_uv, (const float (*)[3])direction,
                          rig->fit->n_guides, 1, &rig->laplacian, NULL, NULL));
    ck_ok(guide_system_init(&rig->system, &rig->mean, &rig->laplacian, along, across, NULL, NULL));
    free(direction);
}

static void rig_finish(struct rig *rig)
{
    guide_system_finish(&rig->system);
    sparse_finish(&rig->laplacian);
    mean_strands_finish(&rig->mean);
    groom_fit_destroy(rig->fit);
    groom_sample_destroy(rig->sample);
}

/* Numbers of size 1; rows 0, the moves of roots, too. */
static double (*random_shapes(const struct rig *rig, uint32_t stream))[3]
{
    double (*shape)[3] = calloc(rig->size, sizeof *shape);
    struct groom_random_key key = {7, stream};
    for (uint32_t v = 0; v < rig->size; v++)
        for (uint32_t c = 0; c < 3; c++)
            shape[v][c] = groom_random_normal(key, v, c);
    return shape;
}

static double dot(const double (*a)[3], const double (*b)[3], size_t n)
{
    double sum = 0;
    for (size_t v = 0; v < n; v++)
        for (int c = 0; c < 3; c++)
            sum += a[v][c] * b[v][c];
    return sum;
}

static double loss(struct rig *rig, const double (*shape)[3])
{
    double partial[8];
    ck_assert_uint_le(mean_strands_pieces(rig->mean.n), 8);
    return mean_strands_loss(&rig->mean, shape, partial, NULL) * rig->mean.n * VERTICES;
}

/* --- mean strands -------------------------------------------------------------------------- */

/* With all guides as operator guides: clump alone, as evaluation has it. */
START_TEST(mean_strands_are_what_evaluation_makes_without_random_operators)
{
    struct rig rig;
    struct groom *groom;
    rig_init(&rig, GROOM_SAMPLE_SPIKY, 0, 0);
    const struct groom_fit *fit = rig.fit;
    double (*shape)[3] = calloc(rig.size, sizeof *shape), sum = 0;
    float (*dense)[3] = malloc((size_t)fit->n * fit->m * sizeof *dense);
    ck_ok(groom_clone(fit->groom, NULL, &groom, NULL));
    for (uint32_t i = 0; i < groom->n_operators; i++)
        groom->operators[i].enabled = groom->operators[i].type == GROOM_OPERATOR_CLUMP;
    ck_ok(groom_evaluate(groom, 0, fit->n, dense, NULL, NULL));
    for (size_t v = 0; v < rig.size; v++)
        for (int c = 0; c < 3; c++)
            shape[v][c] = ((double)groom->guides[v][c] - groom->guides[v - v % fit->m][c]) / fit->scale;
    for (size_t v = 0; v < (size_t)fit->n * fit->m; v++)
        for (int c = 0; c < 3; c++) {
            double d = ((double)dense[v][c] - fit->centre[c]) / fit->scale - fit->target[v][c];
            sum += d * d;
        }
    ck_assert_double_gt(sum, 0);
    ck_assert_double_eq_tol(loss(&rig, (const double (*)[3])shape) / sum, 1, 0.01); /* v_j is j / (m - 1) here */
    free(dense);
    free(shape);
    groom_destroy(groom);
    rig_finish(&rig);
}
END_TEST

/* The loss is quadratic: its central difference along any direction is exact. */
START_TEST(the_system_is_the_gradient_of_the_loss)
{
    struct rig rig;
    rig_init(&rig, _i ? GROOM_SAMPLE_BENT : GROOM_SAMPLE_CURLY, 0, 0);
    double (*at)[3] = random_shapes(&rig, 1), (*along)[3] = random_shapes(&rig, 2);
    double (*forth)[3] = calloc(rig.size, sizeof *forth), (*back)[3] = calloc(rig.size, sizeof *back);
    double (*product)[3] = calloc(rig.size, sizeof *product);
    for (size_t v = 0; v < rig.size; v++)
        for (int c = 0; c < 3; c++) {
            forth[v][c] = at[v][c] + along[v][c];
            back[v][c] = at[v][c] - along[v][c];
        }
    double difference = (loss(&rig, (const double (*)[3])forth) - loss(&rig, (const double (*)[3])back)) / 2;
    guide_system_apply(&rig.system, (const double (*)[3])at, product, NULL);
    double slope = 2 * (dot((const double (*)[3])along, (const double (*)[3])product, rig.size) -
                        dot((const double (*)[3])along, (const double (*)[3])rig.system.pull, rig.size));
    ck_assert_double_eq_tol(difference / slope, 1, 1e-9);
    free(at), free(along), free(forth), free(back), free(product);
    rig_finish(&rig);
}
END_TEST

/* --- neighbours -------------------------------------------------------------------------------- */

#define SIDE 6

static void grid_of(float uv[SIDE * SIDE][2], float direction[SIDE * SIDE][3], int parted)
{
    for (int g = 0; g < SIDE * SIDE; g++) {
        uv[g][0] = (float)(g % SIDE) / SIDE + 0.01f * (float)(g / SIDE % 2); /* skewed: one triangulation */
        uv[g][1] = (float)(g / SIDE) / SIDE;
        direction[g][0] = parted && g % SIDE < SIDE / 2 ? -1 : 1;
        direction[g][1] = direction[g][2] = 0;
    }
}

static double row_of(const struct sparse *l, uint32_t g, const double *field)
{
    double sum = 0;
    for (uint32_t at = l->first[g]; at < l->first[g + 1]; at++)
        sum += l->value[at][0] * field[l->column[at]];
    return sum;
}

START_TEST(equal_guides_cost_nothing_and_even_change_next_to_nothing)
{
    float uv[SIDE * SIDE][2], direction[SIDE * SIDE][3];
    double same[SIDE * SIDE], slope[SIDE * SIDE];
    struct sparse l = {0};
    grid_of(uv, direction, 0);
    for (int g = 0; g < SIDE * SIDE; g++)
        same[g] = 3, slope[g] = 2 * uv[g][0] - uv[g][1];
    ck_ok(guide_laplacian((const float (*)[2])uv, (const float (*)[3])direction, SIDE * SIDE, 0.3, &l, NULL, NULL));
    for (uint32_t g = 0; g < SIDE * SIDE; g++) {
        ck_assert_double_lt(fabs(row_of(&l, g, same)), 1e-12);
        ck_assert_double_lt(fabs(row_of(&l, g, slope)), 0.12); /* neighbours differ by 0.33 */
    }
    sparse_finish(&l);
}
END_TEST

/* What shares of their roughness guides have in common that all wind alike, or of which each winds in a way of its own. */
static double share_of(const struct sparse *l, int alike)
{
    double (*shape)[3] = calloc((size_t)SIDE * SIDE * VERTICES, sizeof *shape);
    struct roughness roughness[VERTICES];
    for (uint32_t g = 0; g < SIDE * SIDE; g++)
        for (uint32_t j = 0; j < VERTICES; j++)
            for (uint32_t c = 0; c < 3; c++)
                shape[g * VERTICES + j][c] = sin(j + c + (alike ? 0 : 6.28 * groom_random_uniform((struct groom_random_key){1, 1}, g, c)));
    roughness_measure((const double (*)[3])shape, VERTICES, l, roughness);
    free(shape);
    return roughness_share(roughness, VERTICES, VERTICES / 2);
}

START_TEST(guides_share_the_roughness_that_their_neighbours_have)
{
    float uv[SIDE * SIDE][2], direction[SIDE * SIDE][3];
    struct sparse l = {0};
    grid_of(uv, direction, 0);
    ck_ok(guide_laplacian((const float (*)[2])uv, (const float (*)[3])direction, SIDE * SIDE, 0.3, &l, NULL, NULL));
    ck_assert_double_gt(share_of(&l, 1), 0.999);
    ck_assert_double_lt(share_of(&l, 0), 0.2);
    sparse_finish(&l);
}
END_TEST

START_TEST(the_sides_of_a_parting_leave_each_other_alone)
{
    float uv[SIDE * SIDE][2], direction[SIDE * SIDE][3];
    double side[SIDE * SIDE];
    struct sparse l = {0};
    grid_of(uv, direction, 1);
    for (int g = 0; g < SIDE * SIDE; g++)
        side[g] = direction[g][0];
    ck_ok(guide_laplacian((const float (*)[2])uv, (const float (*)[3])direction, SIDE * SIDE, 0.3, &l, NULL, NULL));
    for (uint32_t g = 0; g < SIDE * SIDE; g++)
        ck_assert_double_lt(fabs(row_of(&l, g, side)), 1e-6);
    sparse_finish(&l);
}
END_TEST

START_TEST(few_guides_and_guides_of_one_root_have_neighbours)
{
    float uv[4][2] = {{0.5f, 0.5f}, {0.5f, 0.5f}, {0.2f, 0.1f}, {0.5f, 0.5f}}, direction[4][3] = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
    for (uint32_t n = 1; n <= 4; n++) {
        struct sparse l = {0};
        ck_ok(guide_laplacian((const float (*)[2])uv, (const float (*)[3])direction, n, 0.3, &l, NULL, NULL));
        for (uint32_t g = 0; g < n; g++) {
            double same[4] = {1, 1, 1, 1};
            ck_assert_double_lt(fabs(row_of(&l, g, same)), 1e-12);
            ck_assert_uint_ge(l.first[g + 1] - l.first[g], n > 1 ? 2 : 1);
        }
        sparse_finish(&l);
    }
}
END_TEST

/* --- the system ------------------------------------------------------------------------------------ */

START_TEST(the_matrix_is_symmetric_and_positive)
{
    struct rig rig;
    rig_init(&rig, GROOM_SAMPLE_CURLY, 50, 3);
    double (*a)[3] = random_shapes(&rig, 1), (*b)[3] = random_shapes(&rig, 2), (*out)[3] = calloc(rig.size, sizeof *out);
    rig.system.hold[5] = 2;
    guide_system_apply(&rig.system, (const double (*)[3])a, out, NULL);
    double ba = dot((const double (*)[3])b, (const double (*)[3])out, rig.size);
    ck_assert_double_gt(dot((const double (*)[3])a, (const double (*)[3])out, rig.size), 0);
    guide_system_apply(&rig.system, (const double (*)[3])b, out, NULL);
    ck_assert_double_eq_tol(dot((const double (*)[3])a, (const double (*)[3])out, rig.size) / ba, 1, 1e-9);
    free(a), free(b), free(out);
    rig_finish(&rig);
}
END_TEST

START_TEST(the_solution_is_the_minimum)
{
    struct rig rig;
    rig_init(&rig, GROOM_SAMPLE_WAVY, 100, 3);
    double (*shape)[3] = random_shapes(&rig, 1), (*out)[3] = calloc(rig.size, sizeof *out), worst = 0, largest = 0;
    uint32_t n = guide_system_solve(&rig.system, shape, 1e-10, 500, NULL);
    ck_assert_uint_lt(n, 200);
    guide_system_apply(&rig.system, (const double (*)[3])shape, out, NULL);
    for (size_t v = 0; v < rig.size; v++)
        for (int c = 0; c < 3; c++) {
            worst = fmax(worst, fabs(out[v][c] - rig.system.pull[v][c]));
            largest = fmax(largest, fabs(rig.system.pull[v][c]));
        }
    ck_assert_double_lt(worst, 1e-8 * largest);
    free(shape), free(out);
    rig_finish(&rig);
}
END_TEST

/* --- the stage ------------------------------------------------------------------------------------- */

/* Metres: how far a place is from the nearest of the truth's operator guides. */
static double off_nearest(const double place[3], const struct groom *truth)
{
    double least = INFINITY;
    for (uint32_t t = 0; t < truth->n_operator_guides; t++) {
        const float *root = truth->guides[(size_t)truth->operator_guide[t] * truth->n_vertices];
        double x = place[0] - root[0], y = place[1] - root[1], z = place[2] - root[2];
        least = fmin(least, sqrt(x * x + y * y + z * z));
    }
    return least;
}

/* Means over operator guides that some strands follow: of where they stand, and of the middles of these strands. */
static double off_truth(const struct groom *groom, const struct groom *truth, double *middles)
{
    double sum = 0, told = 0;
    *middles = 0;
    for (uint32_t o = 0; o < groom->n_operator_guides; o++) {
        const float *root = groom->guides[(size_t)groom->operator_guide[o] * groom->n_vertices];
        double middle[3] = {0}, n = 0;
        for (uint32_t i = 0; i < groom->n_strands; i++)
            if (groom->operator_guide_of[i] == o) {
                for (int c = 0; c < 3; c++)
                    middle[c] += (double)groom->roots[i][c];
                n++;
            }
        if (n == 0)
            continue;
        for (int c = 0; c < 3; c++)
            middle[c] /= n;
        *middles += off_nearest(middle, truth);
        sum += off_nearest((const double[3]){root[0], root[1], root[2]}, truth);
        told++;
    }
    *middles /= told;
    return sum / told;
}

/* Where strands of one end and those of the next begin, and what they close in on, tell; the middle of a bundle is a guess. */
START_TEST(operator_guides_are_found_where_strands_close_in)
{
    struct groom_fit_options options;
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_SPIKY, 1500, VERTICES, 1, NULL);
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    options.guides = sample->truth->n_guides;
    options.operator_guides = sample->truth->n_operator_guides;
    double middles, off;
    struct groom_fit *fit = guides_fit(sample, &options, "guides", NULL);
    off = off_truth(fit->groom, sample->truth, &middles);
    ck_assert_msg(off < 0.6 * middles, "%g mm of %g mm in bundles", 1e3 * off, 1e3 * middles);
    guides_fit_on(fit, "operators", NULL);
    off = off_truth(fit->groom, sample->truth, &middles);
    ck_assert_msg(off < 0.6 * middles, "%g mm of %g mm of guides", 1e3 * off, 1e3 * middles);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

START_TEST(the_stage_reports_its_loss_and_leaves_other_roots)
{
    struct rig rig;
    struct guides_quality after;
    rig_init(&rig, GROOM_SAMPLE_CURLY, 0, 0);
    const struct groom *groom = rig.fit->groom;
    float (*roots)[3] = malloc(groom->n_guides * sizeof *roots);
    for (uint32_t g = 0; g < groom->n_guides; g++)
        memcpy(roots[g], groom->guides[(size_t)g * VERTICES], sizeof *roots);
    ck_ok(groom_fit_step(rig.fit, NULL, NULL)); /* before operator guides are asked about the head again */
    guides_measure(rig.fit, rig.sample, &after);
    guides_fit_on(rig.fit, "operators", NULL);
    for (uint32_t g = 0, o = 0; g < groom->n_guides; g++) {
        int is_operator_guide = o < groom->n_operator_guides && groom->operator_guide[o] == g;
        o += (uint32_t)is_operator_guide;
        if (!is_operator_guide)
            ck_assert_mem_eq(roots[g], groom->guides[(size_t)g * VERTICES], sizeof *roots);
    }
    ck_assert_double_lt(after.ripple, 0.01);
    const struct groom_fit_report *report = groom_fit_get_report(rig.fit);
    int found = 0;
    for (uint32_t i = 0; i < report->n_losses; i++)
        if (strcmp(report->losses[i].stage, "guides") == 0) {
            ck_assert_double_eq_tol(report->losses[i].after / after.loss, 1, 0.02);
            found = 1;
        }
    ck_assert(found);
    free(roots);
    rig_finish(&rig);
}
END_TEST

/* Sum of squared third differences of all guides. */
static double roughness(const struct groom *groom)
{
    double sum = 0;
    for (uint32_t g = 0; g < groom->n_guides; g++)
        for (uint32_t j = 0; j + 3 < groom->n_vertices; j++) {
            const float (*x)[3] = (const float (*)[3])(groom->guides + (size_t)g * groom->n_vertices + j);
            for (int c = 0; c < 3; c++)
                sum += pow((double)x[3][c] - 3 * (double)x[2][c] + 3 * (double)x[1][c] - (double)x[0][c], 2);
        }
    return sum;
}

/* Of one capture, after the stage; with the curl that was estimated, or as if there were none. */
static double roughness_with_curls(const struct groom_sample *sample, int curls)
{
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.guides = sample->truth->n_guides;
    options.operator_guides = sample->truth->n_operator_guides;
    struct groom_fit *fit = guides_fit(sample, &options, "guides", NULL);
    for (uint32_t o = 0; !curls && o < fit->groom->n_operators; o++)
        if (fit->groom->operators[o].type == GROOM_OPERATOR_CURL)
            fit->groom->operators[o].parameter[0] = 0;
    guides_fit_on(fit, "operators", NULL);
    double rough = roughness(fit->groom);
    groom_fit_destroy(fit);
    return rough;
}

START_TEST(guides_leave_the_waves_of_curls_to_these)
{
    struct groom_sample *sample = guides_sample(GROOM_SAMPLE_WAVY, 1000, VERTICES, 1, NULL);
    ck_assert_double_lt(roughness_with_curls(sample, 1), 0.7 * roughness_with_curls(sample, 0));
    groom_sample_destroy(sample);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("fit_guides");
    TCase *parts = tcase_create("parts");
    tcase_set_timeout(parts, 60);
    tcase_add_test(parts, mean_strands_are_what_evaluation_makes_without_random_operators);
    tcase_add_loop_test(parts, the_system_is_the_gradient_of_the_loss, 0, 2);
    tcase_add_test(parts, equal_guides_cost_nothing_and_even_change_next_to_nothing);
    tcase_add_test(parts, the_sides_of_a_parting_leave_each_other_alone);
    tcase_add_test(parts, guides_share_the_roughness_that_their_neighbours_have);
    tcase_add_test(parts, few_guides_and_guides_of_one_root_have_neighbours);
    tcase_add_test(parts, the_matrix_is_symmetric_and_positive);
    tcase_add_test(parts, the_solution_is_the_minimum);
    tcase_add_test(parts, operator_guides_are_found_where_strands_close_in);
    tcase_add_test(parts, the_stage_reports_its_loss_and_leaves_other_roots);
    tcase_add_test(parts, guides_leave_the_waves_of_curls_to_these);
    suite_add_tcase(suite, parts);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
