/* What holds for the fit of any capture: each style of the generator, and real files where they are. */
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fit/assign.h"
#include "fit/state.h"
#include "groom/format.h"
#include "groom/mesh.h"
#include "groom/sample.h"
#include "groom/strands.h"
#include "tests/support/test.h"

/* Goes through the stages before this one. */
static void go_to(struct groom_fit *fit, uint32_t stage)
{
    struct groom_pool *pool;
    struct groom_diag diag = {0};
    groom_status st = GROOM_OK;
    ck_ok(groom_pool_create(2, &pool));
    struct groom_context context = {.pool = pool};
    while (st == GROOM_OK && fit->stage < stage)
        st = groom_fit_step(fit, &context, &diag);
    ck_assert_msg(st == GROOM_OK, "%s: %s", groom_status_name(st), diag.detail);
    groom_pool_destroy(pool);
}

/* Weighted, by guides that still have all of their clusters' shape. */
static struct groom_fit *fitted(const struct groom_strands *strands, const struct groom_mesh *head,
                                const struct groom_fit_options *options)
{
    struct groom_fit *fit;
    struct groom_diag diag = {0};
    groom_status st = groom_fit_create(strands, head, options, NULL, &fit, &diag);
    ck_assert_msg(st == GROOM_OK, "%s: %s", groom_status_name(st), diag.detail);
    go_to(fit, FIT_STAGE_guides);
    return fit;
}

static float (*dense_of(const struct groom_fit *fit, int with_operators))[3]
{
    float (*dense)[3] = malloc((size_t)fit->n * fit->m * sizeof *dense);
    struct groom *groom;
    ck_ok(groom_fit_result(fit, NULL, &groom, NULL));
    while (!with_operators && groom->n_operators > 0)
        ck_ok(groom_remove_operator(groom, groom->n_operators - 1, NULL));
    ck_ok(groom_evaluate(groom, 0, groom->n_strands, dense, NULL, NULL));
    groom_destroy(groom);
    return dense;
}

/* Mean square distance of the strands, with or without operators, from the target, over that of a bald head. */
static double unexplained(const struct groom_fit *fit, int with_operators)
{
    float (*dense)[3] = dense_of(fit, with_operators);
    double error = 0, all = 0;
    for (size_t v = 0; v < (size_t)fit->n * fit->m; v++)
        for (int c = 0; c < 3; c++) {
            double x = fit->centre[c] + (double)fit->scale * fit->target[v][c], root = fit->roots[v / fit->m][c];
            error += (dense[v][c] - x) * (dense[v][c] - x);
            all += (x - root) * (x - root);
        }
    free(dense);
    return error / all;
}

/* The whole groom, operators and all: finite, and of the size of the capture. */
static void is_sane(const struct groom_fit *fit)
{
    float (*dense)[3] = dense_of(fit, 1);
    double square = 0;
    ck_ok(groom_validate(fit->groom, NULL));
    for (size_t v = 0; v < (size_t)fit->n * fit->m; v++)
        for (int c = 0; c < 3; c++) {
            double x = (dense[v][c] - fit->centre[c]) / fit->scale;
            ck_assert(isfinite(x));
            square += x * x;
        }
    ck_assert_double_gt(square / ((double)fit->n * fit->m), 0.7);
    ck_assert_double_lt(square / ((double)fit->n * fit->m), 1.4);
    free(dense);
}

/* Operator guides stand among the guides; medoids and clusters have members. */
static void is_well_made(const struct groom_fit *fit)
{
    const struct groom *groom = fit->groom;
    uint32_t *members = calloc(fit->n_guides, sizeof *members);
    for (uint32_t i = 0; i < fit->n; i++)
        members[fit->cluster_of[i]]++;
    for (uint32_t g = 0; g < fit->n_guides; g++)
        ck_assert_uint_gt(members[g], 0);
    for (uint32_t o = 1; o < groom->n_operator_guides; o++)
        ck_assert_uint_gt(groom->operator_guide[o], groom->operator_guide[o - 1]);
    free(members);
}

/* What may be left unexplained after `instance_weights` and `guides`, and of the whole groom (0: not looked at). */
struct left { double weighted, solved, whole; };

static uint32_t count_guides(const struct groom_strands *strands, const struct groom_mesh *head)
{
    struct groom_fit_options options;
    struct groom_fit *fit;
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    options.vertices = 40;
    ck_ok(groom_fit_create(strands, head, &options, NULL, &fit, NULL));
    while (!fit->groom)
        ck_ok(groom_fit_step(fit, NULL, NULL));
    uint32_t n = fit->n_guides;
    groom_fit_destroy(fit);
    return n;
}

/* A guide that stands in the middle of a bundle is not what its own strands are like: bounds on the way are of operator guides
 * that are a quarter of the guides, or of the automatic ones where this is 0. */
static void fits(const struct groom_strands *strands, const struct groom_mesh *head, uint32_t n_operator_guides, struct left most,
                 const char *what)
{
    struct groom_fit_options options;
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    options.vertices = 40;
    if (n_operator_guides > 0)
        options.operator_guides = n_operator_guides;
    struct groom_fit *fit = fitted(strands, head, &options);
    double left = unexplained(fit, 0);
    ck_assert_msg(left < most.weighted, "%s: %g of it unexplained", what, left);
    if (most.solved > 0) {
        go_to(fit, FIT_STAGE_guides + 1);
        left = unexplained(fit, 0);
        ck_assert_msg(left < most.solved, "%s: %g of it unexplained by solved guides", what, left);
    }
    go_to(fit, FIT_N_STAGES);
    left = unexplained(fit, 1);
    ck_assert_msg(most.whole == 0 || left < most.whole, "%s: %g of it unexplained by the whole groom", what, left);
    is_sane(fit);
    is_well_made(fit);
    ck_assert_uint_eq(fit->groom->n_strands, strands->n_strands);
    groom_fit_destroy(fit);
}

/* All of it by a quarter, and what all ends with by the automatic ones. */
static void fits_both_ways(const struct groom_strands *strands, const struct groom_mesh *head, struct left most, const char *what)
{
    uint32_t n_guides = count_guides(strands, head);
    fits(strands, head, (n_guides + 3) / 4, most, what);
    fits(strands, head, 0, (struct left){INFINITY, 0, most.whole}, what);
}

/* The bounds are one and a half times what is measured. Instancing by distance alone leaves 0.02 to
 * 0.08 of these styles and 0.32 of the combover: it blends strands at a parting from both sides.
 * An operator guide stands in the middle of its bundle, not of its cluster: spiky hair, whose bundles are many and
 * narrow, is the worse for it before guides are solved (0.0104 where there were 0.0062), and the better after
 * (0.036 where there were 0.042). */
START_TEST(every_style_is_fitted)
{
    static const struct left most[GROOM_SAMPLE_STYLE_COUNT] = {
        [GROOM_SAMPLE_STRAIGHT] = {0.005, 0.0140, 0.0063}, [GROOM_SAMPLE_WAVY] = {0.009, 0.0065, 0.0024},
        [GROOM_SAMPLE_CURLY] = {0.008, 0.0086, 0.0114},    [GROOM_SAMPLE_COILY] = {0.016, 0.0285, 0.0370},
        [GROOM_SAMPLE_SHORT] = {0.013, 0.0159, 0.0038},    [GROOM_SAMPLE_SPIKY] = {0.0155, 0.0540, 0.0510},
        [GROOM_SAMPLE_BENT] = {0.010, 0.0323, 0.0099}};
    struct groom_sample_options options;
    struct groom_sample *sample;
    groom_sample_style style = (groom_sample_style)_i;
    groom_sample_options_capture(style, &options);
    options.n_strands = 2500;
    options.n_vertices = 50;
    ck_ok(groom_sample_create(&options, NULL, &sample, NULL));
    struct left headless = {1.5 * most[style].weighted, 1.5 * most[style].solved, 1.5 * most[style].whole};
    fits_both_ways(sample->capture, sample->head, most[style], groom_sample_style_name(style));
    fits_both_ways(sample->capture, NULL, headless, groom_sample_style_name(style));
    groom_sample_destroy(sample);
}
END_TEST

/* Strands that the fit clumps go into the head no oftener than the truth's. */
START_TEST(few_strands_are_pulled_into_the_head)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    struct groom_fit_options fit_options;
    groom_sample_options_init(GROOM_SAMPLE_STRAIGHT, &options);
    options.n_strands = 3000;
    ck_ok(groom_sample_create(&options, NULL, &sample, NULL));
    groom_fit_options_init(GROOM_FIT_DRAFT, &fit_options);
    struct groom_fit *fit = fitted(sample->capture, sample->head, &fit_options);
    go_to(fit, FIT_N_STAGES);
    const struct groom_fit_report *report = groom_fit_get_report(fit);
    ck_assert_uint_gt(report->n_reassigned, 0);
    ck_assert_uint_lt(report->n_penetrating, sample->capture->n_strands / 20);
    groom_fit_destroy(fit);
    groom_sample_destroy(sample);
}
END_TEST

/* --- real captures ------------------------------------------------------------------- */

static struct groom_frame frame_of(double unit_m, groom_up up) { return (struct groom_frame){unit_m, up}; }

static struct groom_strands *read_strands(const char *path, struct groom_frame frame)
{
    struct groom_read_options options = {.frame = frame};
    struct groom_strands *strands;
    struct groom_diag diag = {0};
    int file = open(path, O_RDONLY);
    struct groom_source source = groom_source_from_fd(file);
    groom_status st = groom_strands_read(&source, &options, NULL, &strands, NULL, &diag);
    ck_assert_msg(st == GROOM_OK, "%s: %s", path, diag.detail);
    close(file);
    return strands;
}

static struct groom_mesh *read_head(const char *path, struct groom_frame frame)
{
    struct groom_mesh_read_options options = {.frame = frame};
    struct groom_mesh *head;
    struct groom_diag diag = {0};
    int file = open(path, O_RDONLY);
    struct groom_source source = groom_source_from_fd(file);
    groom_status st = groom_mesh_read(&source, &options, NULL, &head, NULL, &diag);
    ck_assert_msg(st == GROOM_OK, "%s: %s", path, diag.detail);
    close(file);
    return head;
}

/* Of 100 strands many are operator guides themselves, moved to the middle of their bundles and shaped like them: until
 * guides are solved, they explain less of them (0.121) than clusters alone did (0.070), and in the end more (0.0118
 * in place of 0.0157). */
START_TEST(real_captures_are_fitted)
{
    static const struct { const char *strands, *head; double unit_m; groom_up up; struct left most; } rows[] = {
        {"harolongo/hair.data", "harolongo/body.obj", 0.01, GROOM_UP_Y, {0.02, 0, 0.0042}},
        {"sintel/hair.tfx", "sintel/head.obj", 1, GROOM_UP_Y, {0.021, 0, 0.0180}},
        {"combover/hair.data", "combover/body.obj", 1, GROOM_UP_Z, {0.035, 0, 0.0385}},
        {"mohawk/hair.tfx", NULL, 1, GROOM_UP_Y, {0.027, 0, 0.0110}},
        {"bangs100/Bangs_100.data", NULL, 0.001, GROOM_UP_Z, {0.181, 0, 0.0178}},
    };
    const char *path = test_shared_data(rows[_i].strands);
    if (!path)
        return;
    struct groom_frame frame = frame_of(rows[_i].unit_m, rows[_i].up);
    struct groom_strands *strands = read_strands(path, frame);
    struct groom_mesh *head = rows[_i].head ? read_head(test_shared_data(rows[_i].head), frame) : NULL;
    fits_both_ways(strands, head, rows[_i].most, rows[_i].strands);
    groom_mesh_destroy(head);
    groom_strands_destroy(strands);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("fit_property");
    TCase *styles = tcase_create("styles"), *real = tcase_create("real");
    tcase_set_timeout(styles, 300);
    tcase_set_timeout(real, 300);
    tcase_add_loop_test(styles, every_style_is_fitted, 0, GROOM_SAMPLE_STYLE_COUNT);
    tcase_add_test(styles, few_strands_are_pulled_into_the_head);
    tcase_add_loop_test(real, real_captures_are_fitted, 0, 5);
    suite_add_tcase(suite, styles);
    suite_add_tcase(suite, real);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
