/* Sculpted strands against a round head. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/spatial.h"
#include "tests/support/superhelix.h"
#include "tests/support/test.h"

#define RADIUS 0.1

/* A sphere about the origin, of 24 x 48 patches. */
static struct groom_mesh *sphere(void)
{
    enum { ROWS = 24, COLUMNS = 48 };
    struct groom_mesh *mesh;
    uint32_t t = 0;
    ck_ok(groom_mesh_create((ROWS - 1) * COLUMNS + 2, 2 * COLUMNS * (ROWS - 1), 0, NULL, &mesh, NULL));
    for (uint32_t r = 1; r < ROWS; r++)
        for (uint32_t c = 0; c < COLUMNS; c++) {
            double polar = M_PI * r / ROWS, around = 2.0 * M_PI * c / COLUMNS;
            float *p = mesh->points[(r - 1) * COLUMNS + c];
            p[0] = (float)(RADIUS * sin(polar) * sin(around));
            p[1] = (float)(RADIUS * cos(polar));
            p[2] = (float)(RADIUS * sin(polar) * cos(around));
        }
    uint32_t top = (ROWS - 1) * COLUMNS, bottom = top + 1;
    memcpy(mesh->points[top], (float[3]){0, (float)RADIUS, 0}, sizeof(float[3]));
    memcpy(mesh->points[bottom], (float[3]){0, (float)-RADIUS, 0}, sizeof(float[3]));
    for (uint32_t c = 0; c < COLUMNS; c++) {
        uint32_t next = (c + 1) % COLUMNS, last = (ROWS - 2) * COLUMNS;
        memcpy(mesh->triangles[t++], (uint32_t[3]){top, c, next}, sizeof(uint32_t[3]));
        memcpy(mesh->triangles[t++], (uint32_t[3]){bottom, last + next, last + c}, sizeof(uint32_t[3]));
        for (uint32_t r = 0; r + 2 < ROWS; r++) {
            uint32_t a = r * COLUMNS + c, b = r * COLUMNS + next;
            memcpy(mesh->triangles[t++], (uint32_t[3]){a, a + COLUMNS, b}, sizeof(uint32_t[3]));
            memcpy(mesh->triangles[t++], (uint32_t[3]){b, a + COLUMNS, b + COLUMNS}, sizeof(uint32_t[3]));
        }
    }
    ck_assert_uint_eq(t, mesh->n_triangles);
    return mesh;
}

/* Straight strands that stand on the sphere's equator, and an anchor for each tip straight across. */
static struct groom_superhelices *standing(uint32_t n, struct groom_anchor *anchors)
{
    struct groom_superhelices *h = superhelix_coils(n, 30, 1, 0);
    for (uint32_t j = 0; j < h->n_elements; j++) {
        h->length[j] = 0.25 / 30;
        h->q[j][0] = h->q[j][1] = h->q[j][2] = 0.0;
    }
    for (uint32_t i = 0; i < n; i++) {
        double around = 0.3 * i;
        double out[3] = {sin(around), 0.0, cos(around)}, up[3] = {0, 1, 0}, side[3] = {cos(around), 0.0, -sin(around)};
        for (int c = 0; c < 3; c++) {
            h->root[i][c] = RADIUS * out[c];
            h->frame[i][0][c] = out[c], h->frame[i][1][c] = up[c], h->frame[i][2][c] = -side[c];
        }
        anchors[i] = (struct groom_anchor){i, 1.0, {-1.3 * RADIUS * out[0], 0.004, -1.3 * RADIUS * out[2]}};
    }
    ck_ok(groom_superhelices_check(h, NULL));
    return h;
}

static double deepest(const struct groom_superhelices *h, uint32_t i, const struct groom_bvh *bvh)
{
    double most = 0.0;
    for (int k = 6; k <= 100; k++) {
        double s = 0.25 * k / 100, p[3];
        groom_superhelix_sample(h, i, &s, 1, &p, NULL);
        float f[3] = {(float)p[0], (float)p[1], (float)p[2]};
        most = fmax(most, -(double)groom_bvh_signed_distance(bvh, f));
    }
    return most;
}

struct scene {
    struct groom_mesh *mesh;
    struct groom_bvh *bvh;
    struct groom_superhelices *rest, *helices;
    struct groom_anchor anchors[8];
    struct groom_sculpt_options sculpt;
};

static struct scene scene_make(void)
{
    struct scene s = {.mesh = sphere(), .sculpt = groom_sculpt_options_default()};
    ck_ok(groom_bvh_create(s.mesh, NULL, &s.bvh, NULL));
    s.rest = standing(8, s.anchors);
    ck_ok(groom_superhelices_copy(s.rest, NULL, &s.helices, NULL));
    ck_ok(groom_superhelices_sculpt(s.helices, NULL, s.anchors, 6, &s.sculpt, NULL, NULL, NULL)); /* two stay */
    return s;
}

static void scene_free(struct scene *s)
{
    groom_superhelices_destroy(s->rest);
    groom_superhelices_destroy(s->helices);
    groom_bvh_destroy(s->bvh);
    groom_mesh_destroy(s->mesh);
}

static groom_status push_out(struct scene *s, const struct groom_contact_options *options,
                             const struct groom_context *context, struct groom_contact_report *reports)
{
    return groom_superhelices_push_out(s->helices, (const double(*)[3])s->rest->q, s->anchors, 6, s->bvh, options,
                                       &s->sculpt, context, reports, NULL);
}

START_TEST(strands_that_went_through_the_head_go_round_it)
{
    struct scene s = scene_make();
    struct groom_contact_options options = groom_contact_options_default();
    struct groom_contact_report reports[8];
    double before = 0.0;
    for (uint32_t i = 0; i < 6; i++)
        before = fmax(before, deepest(s.helices, i, s.bvh));
    ck_assert_double_ge(before, 0.01); /* or the test shows nothing */
    ck_ok(push_out(&s, &options, NULL, reports));
    ck_ok(groom_superhelices_check(s.helices, NULL));
    for (uint32_t i = 0; i < 6; i++) {
        double now = deepest(s.helices, i, s.bvh);
        ck_assert_uint_eq(reports[i].checked, 1);
        ck_assert_double_le(now, fmax(0.003, (double)reports[i].depth_after_m + 0.003));
        ck_assert_double_le((double)reports[i].depth_after_m, 0.25 * (double)reports[i].depth_before_m + 1e-6);
    }
    ck_assert_mem_eq(s.helices->length, s.rest->length, s.rest->n_elements * sizeof(double));
    scene_free(&s);
}
END_TEST

START_TEST(without_rounds_it_only_tells)
{
    struct scene s = scene_make();
    struct groom_contact_options options = groom_contact_options_default();
    struct groom_contact_report reports[8];
    struct groom_superhelices *was;
    ck_ok(groom_superhelices_copy(s.helices, NULL, &was, NULL));
    options.max_rounds = 0;
    ck_ok(push_out(&s, &options, NULL, reports));
    ck_assert_mem_eq(s.helices->q, was->q, was->n_elements * sizeof *was->q);
    ck_assert_float_gt(reports[0].depth_before_m, 0.005f);
    ck_assert_float_eq(reports[0].depth_before_m, reports[0].depth_after_m);
    ck_assert_uint_eq(reports[7].checked, 0);
    groom_superhelices_destroy(was);
    scene_free(&s);
}
END_TEST

START_TEST(what_lay_inside_at_rest_may_stay)
{
    struct scene s = scene_make();
    struct groom_contact_options options = groom_contact_options_default();
    struct groom_contact_report reports[8];
    /* the result itself is the rest shape: nothing has entered beyond it */
    ck_ok(groom_superhelices_push_out(s.helices, (const double(*)[3])s.helices->q, s.anchors, 6, s.bvh, &options, &s.sculpt,
                                      NULL, reports, NULL));
    for (int i = 0; i < 8; i++)
        ck_assert_float_eq(reports[i].depth_before_m, 0.0f);
    scene_free(&s);
}
END_TEST

START_TEST(the_same_bits_for_any_pool)
{
    struct scene a = scene_make(), b = scene_make();
    struct groom_contact_options options = groom_contact_options_default();
    struct groom_contact_report x[8], y[8];
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(push_out(&a, &options, NULL, x));
    ck_ok(push_out(&b, &options, &context, y));
    ck_assert_mem_eq(a.helices->q, b.helices->q, a.helices->n_elements * sizeof *a.helices->q);
    ck_assert_mem_eq(x, y, sizeof x);
    groom_pool_destroy(pool);
    scene_free(&a), scene_free(&b);
}
END_TEST

START_TEST(each_allocation_may_fail_and_leaves_the_strands)
{
    struct scene s = scene_make();
    struct groom_contact_options options = groom_contact_options_default();
    struct groom_superhelices *was;
    ck_ok(groom_superhelices_copy(s.helices, NULL, &was, NULL));
    options.max_rounds = 1;
    for (size_t n = 0;; n++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom_contact_report reports[8];
        test_failing_allocator_init(&state, n, &allocator);
        struct groom_context context = {.allocator = &allocator};
        groom_status st = push_out(&s, &options, &context, reports);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_status(st, GROOM_ENOMEM);
        ck_assert_mem_eq(s.helices->q, was->q, was->n_elements * sizeof *was->q);
        ck_assert_uint_lt(n, 200);
    }
    options.margin_m = NAN;
    ck_status(push_out(&s, &options, NULL, NULL), GROOM_EINVAL);
    groom_superhelices_destroy(was);
    scene_free(&s);
}
END_TEST

TEST_SUITE("contact", strands_that_went_through_the_head_go_round_it, without_rounds_it_only_tells,
           what_lay_inside_at_rest_may_stay, the_same_bits_for_any_pool, each_allocation_may_fail_and_leaves_the_strands)
