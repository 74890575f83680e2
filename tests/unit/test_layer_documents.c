/* Grooms made of uploaded strands, and what layers hold, in memory and in documents */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/document.h"
#include "groom/strands.h"
#include "tests/support/grooms.h"
#include "tests/support/test.h"

/* Strands of 2, 3, 4, … vertices, winding. */
static struct groom_strands *uneven(uint32_t n)
{
    struct groom_strands *strands;
    ck_ok(groom_strands_create(n, (uint64_t)n * (n + 3) / 2, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n; i++) {
        strands->first[i + 1] = strands->first[i] + 2 + i;
        for (uint32_t j = 0; j < 2 + i; j++) {
            float *p = strands->points[strands->first[i] + j];
            p[0] = 0.01f * (float)i + 0.004f * sinf(0.9f * (float)j);
            p[1] = 1.7f - 0.003f * (float)j;
            p[2] = 0.004f * cosf(0.9f * (float)j);
        }
    }
    return strands;
}

static struct groom *groom_of(struct groom_strands *strands)
{
    struct groom *groom;
    ck_ok(groom_create_of_strands(strands, NULL, &groom, NULL));
    ck_ok(groom_validate(groom, NULL));
    return groom;
}

START_TEST(a_groom_of_strands_evaluates_to_them)
{
    struct groom_strands *strands = uneven(21);
    struct groom *groom = groom_of(strands);
    float(*out)[3] = malloc(strands->n_vertices * sizeof *out);
    ck_ok(groom_evaluate(groom, 0, 21, out, NULL, NULL));
    ck_assert_mem_eq(out, strands->points, strands->n_vertices * sizeof *out);
    ck_assert_uint_eq(groom->n_vertices, 22);
    free(out);
    groom_destroy(groom);
    groom_strands_destroy(strands);
}
END_TEST

/* Whatever stands beside it in a block, a strand comes out the same. */
START_TEST(operators_see_each_strand_of_a_base_alone)
{
    struct groom_strands *strands = uneven(37);
    struct groom *groom = groom_of(strands), *one;
    float(*all)[3] = malloc(strands->n_vertices * sizeof *all), alone[64][3];
    ck_ok(groom_insert_operator(groom, 0, GROOM_OPERATOR_SCALE, 3, NULL));
    ck_ok(groom_insert_operator(groom, 1, GROOM_OPERATOR_FRIZZ, 4, NULL));
    ck_ok(groom_evaluate(groom, 0, 37, all, NULL, NULL));
    for (uint32_t i = 0; i < 37; i++) {
        size_t n = 2 + i;
        ck_ok(groom_evaluate(groom, i, 1, alone, NULL, NULL));
        ck_assert_mem_eq(alone, all + strands->first[i], n * sizeof *alone);
        ck_ok(groom_select(groom, &i, 1, NULL, &one, NULL));
        ck_ok(groom_evaluate(one, 0, 1, alone, NULL, NULL));
        ck_assert_mem_eq(alone, all + strands->first[i], n * sizeof *alone);
        groom_destroy(one);
    }
    ck_assert(memcmp(all, strands->points, strands->n_vertices * sizeof *all) != 0);
    free(all);
    groom_destroy(groom);
    groom_strands_destroy(strands);
}
END_TEST

/* The chain cut in two, the dense strands between the halves as a base: nothing is lost but rounding. */
START_TEST(the_rest_of_a_chain_goes_on_from_dense_strands)
{
    struct groom *groom = test_groom((struct groom_shape){100, 20, 12, 4, 3}, 7);
    test_append_all_operators(groom, 7);
    struct groom_strands *between;
    float(*whole)[3] = malloc(2000 * sizeof *whole), (*rest)[3] = malloc(2000 * sizeof *rest);
    ck_ok(groom_strands_create(100, 2000, NULL, &between, NULL));
    for (uint32_t i = 0; i < 100; i++)
        between->first[i + 1] = 20 * (i + 1);
    struct groom head = groom_with_base(groom, NULL, 0, 2), tail = groom_with_base(groom, between, 2, 5);
    ck_ok(groom_evaluate(groom, 0, 100, whole, NULL, NULL));
    ck_ok(groom_evaluate(&head, 0, 100, between->points, NULL, NULL));
    ck_ok(groom_evaluate(&tail, 0, 100, rest, NULL, NULL));
    for (int i = 0; i < 2000; i++)
        for (int c = 0; c < 3; c++)
            ck_assert_float_eq_tol(whole[i][c], rest[i][c], 2e-5f);
    free(whole);
    free(rest);
    groom_strands_destroy(between);
    groom_destroy(groom);
}
END_TEST

START_TEST(what_needs_guides_is_refused_on_a_base)
{
    struct groom_strands *strands = uneven(5);
    struct groom *groom = groom_of(strands);
    struct groom_diag diag;
    for (int type = 0; type < GROOM_OPERATOR_TYPES; type++)
        if (groom_operator_needs_guides((groom_operator_type)type)) {
            ck_status(groom_insert_operator(groom, 0, (groom_operator_type)type, 1, &diag), GROOM_EINVAL);
            ck_assert_ptr_nonnull(strstr(diag.detail, "operator guides"));
        } else {
            ck_ok(groom_insert_operator(groom, 0, (groom_operator_type)type, 1, &diag));
        }
    ck_assert_uint_eq(groom->n_operators, 6);
    struct groom_gradient *gradient;
    float out[64][3];
    ck_ok(groom_gradient_create(groom, NULL, &gradient, NULL));
    ck_status(groom_evaluate_gradient(groom, NULL, 5, (struct groom_adjoint){0}, gradient, NULL, &diag), GROOM_EINVAL);
    ck_status(groom_evaluate(groom, 0, 5, out, NULL, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "layer"));
    groom_gradient_destroy(gradient);
    groom_destroy(groom);
    groom_strands_destroy(strands);
}
END_TEST

/* --- documents ------------------------------------------------------------------------------- */

static char *write_text(const struct groom *groom)
{
    char *json;
    size_t n;
    ck_ok(groom_document_write(groom, NULL, NULL, &json, &n, NULL));
    return json;
}

static struct groom *read_text(const char *json)
{
    struct groom *groom = NULL;
    struct groom_diag diag = {0};
    groom_status status = groom_document_read(json, strlen(json), NULL, NULL, &groom, &diag);
    ck_assert_msg(status == GROOM_OK, "%s at %s: %s", groom_status_name(status), diag.pointer, diag.detail);
    return groom;
}

/* One of each, with all that it can hold. */
static struct groom *with_all_layers(void)
{
    struct groom_strands *strands = uneven(9);
    struct groom *groom = groom_of(strands);
    strcpy(groom->base_strands, "str_abc");
    for (int type = GROOM_OPERATOR_COUNT; type < GROOM_OPERATOR_TYPES; type++)
        ck_ok(groom_insert_operator(groom, groom->n_operators, (groom_operator_type)type, 5, NULL));
    struct groom_layer *ruffle = groom->operators[0].layer, *sculpt = groom->operators[1].layer;
    ruffle->grouping.kind = GROOM_GROUPING_GIVEN;
    ruffle->grouping.count = 3;
    ruffle->grouping.of_strand = groom->allocator->allocate(groom->allocator->user, 9 * sizeof(uint32_t));
    for (uint32_t i = 0; i < 9; i++)
        ruffle->grouping.of_strand[i] = i % 3;
    sculpt->n_elements = 45;
    sculpt->grouping = (struct groom_grouping){.kind = GROOM_GROUPING_CLUSTERS, .count = 2, .seed = 7};
    ck_ok(groom_layer_anchors_resize(&sculpt->anchors, 2, groom->allocator));
    sculpt->anchors.strand[1] = 8;
    sculpt->anchors.at[1] = 0.3f;
    sculpt->anchors.position[1][2] = 0.1f;
    ck_ok(groom_layer_anchors_resize(&sculpt->contact, 1, groom->allocator));
    ck_ok(groom_layer_frames_resize(sculpt, 1, groom->allocator));
    sculpt->frames[0] = (struct groom_layer_frame){1, 0.7f, {{1, 0, 0, 0.01f}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    groom->operators[2].layer->target = strands;
    strcpy(groom->operators[2].layer->target_id, "grm_x");
    groom->operators[2].layer->target_revision = 4;
    groom->operators[3].layer->keep_turns = groom->operators[3].layer->free_direction = 1;
    groom->operators[3].enabled = 0;
    ck_ok(groom_validate(groom, NULL));
    return groom;
}

START_TEST(layers_and_base_survive_a_document_and_a_copy)
{
    struct groom *groom = with_all_layers(), *copy;
    char *json = write_text(groom);
    struct groom *back = read_text(json);
    char *again = write_text(back);
    ck_assert_str_eq(json, again);
    ck_assert_mem_eq(back->base, groom->base, groom->n_base * sizeof *groom->base);
    ck_assert_mem_eq(back->first, groom->first, 10 * sizeof *groom->first);
    ck_ok(groom_clone(groom, NULL, &copy, NULL));
    char *third = write_text(copy);
    ck_assert_str_eq(json, third);
    free(json);
    free(again);
    free(third);
    groom_destroy(groom);
    groom_destroy(back);
    groom_destroy(copy);
}
END_TEST

/* A document of strands with this chain. */
static groom_status read_chain(const char *chain, struct groom **groom, struct groom_diag *diag)
{
    char json[4096];
    snprintf(json, sizeof json,
             "{\"format\":\"groom/1\",\"unit\":\"m\",\"base\":{\"vertices\":{\"dtype\":\"u32\",\"shape\":[1],\"data\":\"AgAAAA==\"},"
             "\"points\":{\"dtype\":\"f32\",\"shape\":[2,3],\"data\":\"AAAAAAAAAAAAAAAAAACAPwAAgD8AAIA/\"}},"
             "\"operators\":[%s]}",
             chain);
    *groom = NULL;
    return groom_document_read(json, strlen(json), NULL, NULL, groom, diag);
}

START_TEST(what_a_layer_cannot_be_is_refused_with_its_place)
{
    static const char *const bad[][2] = {
        {"{\"type\":\"curl\"}", "/operators/0/type"},
        {"{\"type\":\"ruffle\",\"rho\":1.5}", "/operators/0/rho"},
        {"{\"type\":\"ruffle\",\"rho\":-1e-6}", "/operators/0/rho"},
        {"{\"type\":\"ruffle\",\"match_elements\":1.5}", "/operators/0/match_elements"},
        {"{\"type\":\"ruffle\",\"elements\":0}", "/operators/0/elements"},
        {"{\"type\":\"ruffle\",\"elements\":\"many\"}", "/operators/0/elements"},
        {"{\"type\":\"ruffle\",\"groups\":\"clumps\"}", "/operators/0/groups"},
        {"{\"type\":\"ruffle\",\"groups\":[0,1]}", "/operators/0/groups"},
        {"{\"type\":\"ruffle\",\"groups\":[-1]}", "/operators/0/groups"},
        {"{\"type\":\"ruffle\",\"groups\":{\"count\":2}}", "/operators/0/groups/count"},
        {"{\"type\":\"ruffle\",\"groups\":{\"count\":1,\"sed\":3}}", "/operators/0/groups/sed"},
        {"{\"type\":\"ruffle\",\"groups\":\"operator_guides\"}", "/operators/0/groups"},
        {"{\"type\":\"ruffle\",\"anchors\":[]}", "/operators/0/anchors"},
        {"{\"type\":\"sculpt\",\"anchors\":3}", "/operators/0/anchors"},
        {"{\"type\":\"sculpt\",\"anchors\":[{\"strand\":1,\"at\":1,\"position\":[0,0,0]}]}", "/operators/0/anchors/0/strand"},
        {"{\"type\":\"sculpt\",\"anchors\":[{\"strand\":0,\"at\":1.01,\"position\":[0,0,0]}]}", "/operators/0/anchors/0/at"},
        {"{\"type\":\"sculpt\",\"anchors\":[{\"strand\":0,\"at\":1,\"position\":[0,0,1e39]}]}", "/operators/0/anchors/0/position"},
        {"{\"type\":\"sculpt\",\"anchors\":[{\"strand\":0,\"at\":1,\"position\":[0,null,0]}]}", "/operators/0/anchors/0/position"},
        {"{\"type\":\"sculpt\",\"anchors\":[{\"strand\":0,\"at\":1,\"pos\":[0,0,0]}]}", "/operators/0/anchors/0/pos"},
        {"{\"type\":\"sculpt\",\"frames\":[{\"cluster\":0,\"at\":1,\"transform\":[[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}",
         "/operators/0/clusters"},
        {"{\"type\":\"sculpt\",\"clusters\":{\"count\":1},\"frames\":[{\"cluster\":1,\"at\":1,\"transform\":[[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}",
         "/operators/0/frames/0/cluster"},
        {"{\"type\":\"sculpt\",\"clusters\":{\"count\":1},\"frames\":[{\"cluster\":0,\"at\":2,\"transform\":[[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}",
         "/operators/0/frames/0/at"},
        {"{\"type\":\"sculpt\",\"clusters\":{\"count\":1},\"frames\":[{\"cluster\":0,\"at\":1,\"transform\":[[1,0,0,0],[0,null,0,0],[0,0,1,0]]}]}",
         "/operators/0/frames/0/transform"},
        {"{\"type\":\"sculpt\",\"clusters\":{\"count\":1},\"frames\":[{\"cluster\":0,\"at\":1,\"transform\":[[1,0,0,0],[0,1e99,0,0],[0,0,1,0]]}]}",
         "/operators/0/frames/0/transform"},
        {"{\"type\":\"sculpt\",\"clusters\":{\"count\":0}}", "/operators/0/clusters/count"},
        {"{\"type\":\"interpolate\",\"t\":1.01}", "/operators/0/t"},
        {"{\"type\":\"interpolate\",\"target\":{\"vertices\":0}}", "/operators/0/target/vertices"},
        {"{\"type\":\"curl_scale\",\"radius\":0}", "/operators/0/radius"},
        {"{\"type\":\"curl_scale\",\"keep\":\"both\"}", "/operators/0/keep"},
        {"{\"type\":\"curl_scale\",\"hold_direction\":1}", "/operators/0/hold_direction"},
        {"{\"type\":\"curl_scale\",\"group\":1}", "/operators/0/group"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct groom *groom;
        struct groom_diag diag = {0};
        ck_assert_msg(read_chain(bad[i][0], &groom, &diag) == GROOM_EINVAL, "%s was taken", bad[i][0]);
        ck_assert_msg(strcmp(diag.pointer, bad[i][1]) == 0, "%s: %s, expected %s", bad[i][0], diag.pointer, bad[i][1]);
    }
}
END_TEST

START_TEST(a_base_that_does_not_add_up_is_refused)
{
    static const char *const bad[][2] = {
        {"\"base\":{\"strands\":\"str_x\"}", "/base/points"},
        {"\"base\":{},\"guides\":{}", "/guides"},
        {"\"base\":{\"vertices\":{\"dtype\":\"u32\",\"shape\":[1],\"data\":\"AwAAAA==\"},"
         "\"points\":{\"dtype\":\"f32\",\"shape\":[2,3],\"data\":\"AAAAAAAAAAAAAAAAAACAPwAAgD8AAIA/\"}}",
         "/base/vertices"},
        {"\"base\":{\"vertices\":{\"dtype\":\"u32\",\"shape\":[1],\"data\":\"AQAAAA==\"},"
         "\"points\":{\"dtype\":\"f32\",\"shape\":[1,3],\"data\":\"AAAAAAAAAAAAAAAA\"}}",
         "/base/vertices"},
        {"\"base\":{\"vertices\":{\"dtype\":\"u32\",\"shape\":[1],\"data\":\"AgAAAA==\"},"
         "\"points\":{\"dtype\":\"f32\",\"shape\":[3,2],\"data\":\"AAAAAAAAAAAAAAAAAACAPwAAgD8AAIA/\"}}",
         "/base/points"},
        {"\"base\":{\"vertices\":{\"dtype\":\"u32\",\"shape\":[1],\"data\":\"AgAAAA==\"},"
         "\"points\":{\"dtype\":\"f32\",\"shape\":[2,3],\"data\":\"AADAfwAAAAAAAAAAAACAPwAAgD8AAIA/\"}}",
         "/base/points"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        char json[1024];
        struct groom *groom = NULL;
        struct groom_diag diag = {0};
        snprintf(json, sizeof json, "{\"format\":\"groom/1\",\"unit\":\"m\",%s,\"operators\":[]}", bad[i][0]);
        ck_assert_msg(groom_document_read(json, strlen(json), NULL, NULL, &groom, &diag) == GROOM_EINVAL, "%zu was taken", i);
        ck_assert_str_eq(diag.pointer, bad[i][1]);
    }
}
END_TEST

START_TEST(running_out_of_memory_leaks_nothing)
{
    struct groom *groom = with_all_layers();
    char *json = write_text(groom);
    for (size_t at = 0;; at++) {
        struct test_failing_allocator failing;
        struct groom_allocator allocator;
        struct groom *back = NULL, *copy = NULL;
        test_failing_allocator_init(&failing, at, &allocator);
        const struct groom_context context = {.allocator = &allocator};
        groom_status status = groom_document_read(json, strlen(json), NULL, &context, &back, NULL);
        if (status == GROOM_OK)
            status = groom_clone(back, &context, &copy, NULL);
        ck_assert(status == GROOM_OK || status == GROOM_ENOMEM);
        groom_destroy(back);
        groom_destroy(copy);
        ck_assert_uint_eq(failing.outstanding_bytes, 0);
        if (failing.n_allocations <= at)
            break;
    }
    free(json);
    groom_destroy(groom);
}
END_TEST

TEST_SUITE("layer_documents", a_groom_of_strands_evaluates_to_them, operators_see_each_strand_of_a_base_alone,
           the_rest_of_a_chain_goes_on_from_dense_strands, what_needs_guides_is_refused_on_a_base,
           layers_and_base_survive_a_document_and_a_copy, what_a_layer_cannot_be_is_refused_with_its_place,
           a_base_that_does_not_add_up_is_refused, running_out_of_memory_leaks_nothing)
