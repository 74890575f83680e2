/* Real strands to super-helices and back: what issue 4 asks of conversion. */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "groom/curvature.h"
#include "groom/format.h"
#include "tests/support/test.h"

struct real_file {
    const char *path;
    double unit_m;
    groom_up up;
};

static const struct real_file files[] = {
    {"harolongo/hair.data", 0.01, GROOM_UP_Y}, {"sintel/hair.tfx", 1.0, GROOM_UP_Y},
    {"combover/hair.data", 1.0, GROOM_UP_Z},   {"mohawk/hair.tfx", 1.0, GROOM_UP_Y},
    {"bangs100/Bangs_100.data", 0.001, GROOM_UP_Z},
    {"guides/back.data", 1.0, GROOM_UP_Y},     {"guides/slicked_back.data", 1.0, GROOM_UP_Y},
    {"guides/scene_hair.data", 1.0, GROOM_UP_Y}, /* with strands that fold back on themselves */
};

static struct groom_strands *read_strands(const struct real_file *file)
{
    const char *path = test_shared_data(file->path);
    if (!path)
        return NULL;
    int fd = open(path, O_RDONLY);
    ck_assert_int_ge(fd, 0);
    struct groom_source source = groom_source_from_fd(fd);
    struct groom_read_options options = {.frame = {.unit_m = file->unit_m, .up = file->up}};
    struct groom_strands *strands;
    ck_ok(groom_strands_read(&source, &options, NULL, &strands, NULL, NULL));
    close(fd);
    return strands;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double distance(const float a[3], const float b[3])
{
    double square = 0.0;
    for (int c = 0; c < 3; c++)
        square += pow((double)a[c] - (double)b[c], 2);
    return sqrt(square);
}

/* Errors of all vertices in shares of their strand's mean segment, sorted; asserts on lengths. Strands
 * whose segments are finer than float32 can tell at their distance from the origin are left out. */
static uint32_t measure(const struct groom_strands *s, const struct groom_conversion *c, const float (*back)[3],
                        double *errors)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < s->n_strands; i++) {
        uint32_t begin = s->first[i], count = s->first[i + 1] - begin;
        double length = groom_polyline_length((const float(*)[3])s->points + begin, count), segment = length / (count - 1);
        double now = groom_polyline_length(back + begin, count);
        if (segment < 2e-5)
            continue;
        ck_assert_msg(fabs(now / length - 1.0) <= 0.005, "strand %u: length changed by %g", i, now / length - 1.0);
        ck_assert_double_eq_tol((double)c->reports[i].length_change, now / length - 1.0, 1e-3);
        for (uint32_t k = begin; k < begin + count; k++)
            errors[n++] = distance(back[k], s->points[k]) / segment;
    }
    qsort(errors, n, sizeof *errors, by_value);
    return n;
}

START_TEST(real_strands_come_back)
{
    const struct real_file *file = &files[_i];
    struct groom_strands *strands = read_strands(file);
    if (!strands)
        return;
    struct groom_conversion_options options = groom_conversion_options_default();
    struct groom_conversion *c;
    struct groom_pool *pool;
    ck_ok(groom_pool_create(2, &pool));
    struct groom_context context = {.pool = pool};
    float(*back)[3] = calloc(strands->n_vertices, sizeof *back);
    double *errors = calloc(strands->n_vertices, sizeof *errors);
    ck_ok(groom_strands_convert(strands, &options, &context, &c, NULL));
    ck_ok(groom_superhelices_check(c->helices, NULL));
    ck_ok(groom_superhelices_sample_at(c->helices, c->first, c->at, back, &context, NULL));
    uint32_t n = measure(strands, c, (const float(*)[3])back, errors);
    printf("round trip: %s, %.1f elements a strand, error of a vertex %.4f of a segment (median), %.4f (worst)\n",
           file->path, (double)c->helices->n_elements / c->n_strands, errors[n / 2], errors[n - 1]);
    fflush(stdout);
    ck_assert_double_lt(errors[n / 2], 0.01);
    ck_assert_double_lt(errors[n - 1], 0.05);
    free(back), free(errors);
    groom_conversion_destroy(c);
    groom_strands_destroy(strands);
    groom_pool_destroy(pool);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("round_trip");
    TCase *cases = tcase_create("round_trip");
    tcase_set_timeout(cases, 300);
    tcase_add_loop_test(cases, real_strands_come_back, 0, (int)(sizeof files / sizeof files[0]));
    suite_add_tcase(suite, cases);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
