/* options of a fit: defaults, parsing, printing, schema */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fit/options.h"
#include "tests/support/test.h"

static struct groom_fit_options parsed(const char *json)
{
    struct groom_fit_options options;
    struct groom_diag diag = {0};
    groom_status st = groom_fit_options_parse(json, strlen(json), &options, &diag);
    ck_assert_msg(st == GROOM_OK, "%s: %s", diag.pointer, diag.detail);
    return options;
}

static struct groom_diag refused(const char *json, const char *pointer)
{
    struct groom_fit_options options, kept;
    struct groom_diag diag = {0};
    memset(&options, 0x5a, sizeof options);
    kept = options;
    ck_status(groom_fit_options_parse(json, strlen(json), &options, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, pointer);
    ck_assert(strlen(diag.detail) > 0);
    ck_assert_mem_eq(&options, &kept, sizeof kept);
    return diag;
}

START_TEST(nothing_means_the_papers_defaults)
{
    struct groom_fit_options options, empty = parsed("{}");
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    ck_assert_mem_eq(&options, &empty, sizeof options);
    ck_ok(groom_fit_options_parse(NULL, 0, &empty, NULL));
    ck_assert_mem_eq(&options, &empty, sizeof options);
    ck_assert_uint_eq(options.vertices, 100);
    ck_assert_uint_eq(options.guides, GROOM_FIT_AUTO);
    ck_assert_uint_eq(options.n_operators, 5);
    ck_assert_int_eq(options.operators[2], GROOM_OPERATOR_CURL);
    ck_assert_double_eq(options.stages.initialize.lambda_smooth, 1);
    ck_assert_uint_eq(options.stages.initialize.n_smooth, 80);
    ck_assert_double_eq(options.stages.initialize.fixed_fraction, 0.05);
    ck_assert_double_eq(options.stages.operators.lambda_e, 400);
    ck_assert_double_eq(options.stages.randoms.lambda_l, 0.01);
}
END_TEST

START_TEST(quality_sets_defaults_and_an_option_overrides_them)
{
    struct groom_fit_options draft = parsed("{\"quality\":\"draft\"}"), high = parsed("{\"quality\":\"high\"}");
    ck_assert_uint_lt(draft.stages.initialize.cluster_iterations, high.stages.initialize.cluster_iterations);
    /* wherever it stands */
    draft = parsed("{\"stages\":{\"initialize\":{\"cluster_iterations\":77}},\"quality\":\"draft\"}");
    ck_assert_uint_eq(draft.stages.initialize.cluster_iterations, 77);
    ck_assert_uint_lt(draft.stages.initialize.medoid_iterations, high.stages.initialize.medoid_iterations);
}
END_TEST

START_TEST(the_contracts_example_is_read)
{
    struct groom_fit_options o = parsed(
        "{\"vertices\":100,\"guides\":500,\"operator_guides\":125,\"operators\":[\"scale\",\"frizz\",\"frizz\"],"
        "\"interpolation_guides\":3,\"seed\":7,\"quality\":\"standard\",\"visibility\":null,\"stages\":{}}");
    ck_assert_uint_eq(o.guides, 500);
    ck_assert_uint_eq(o.operator_guides, 125);
    ck_assert_int_eq(o.operators_auto, 0);
    ck_assert_uint_eq(o.n_operators, 3);
    ck_assert_int_eq(o.operators[2], GROOM_OPERATOR_FRIZZ);
    ck_assert_uint_eq(o.seed, 7);
    o = parsed("{\"guides\":\"auto\",\"operators\":\"auto\"} \n");
    ck_assert_uint_eq(o.guides, GROOM_FIT_AUTO);
    ck_assert_int_eq(o.operators_auto, 1);
}
END_TEST

START_TEST(an_unknown_name_is_refused_with_the_nearest_one)
{
    struct groom_diag diag = refused("{\"guide\":3}", "/guide");
    ck_assert_ptr_nonnull(strstr(diag.detail, "\"guides\""));
    diag = refused("{\"stages\":{\"initialize\":{\"lamda_smooth\":3}}}", "/stages/initialize/lamda_smooth");
    ck_assert_ptr_nonnull(strstr(diag.detail, "\"lambda_smooth\""));
    diag = refused("{\"stages\":{\"random\":{}}}", "/stages/random");
    ck_assert_ptr_nonnull(strstr(diag.detail, "\"randoms\""));
    refused("{\"stages/initialize\":{}}", "/stages/initialize");
    refused("{\"\":1}", "/");
}
END_TEST

START_TEST(a_wrong_value_is_refused_where_it_stands)
{
    refused("{\"vertices\":2}", "/vertices");
    refused("{\"vertices\":10.5}", "/vertices");
    refused("{\"vertices\":\"auto\"}", "/vertices");
    refused("{\"vertices\":null}", "/vertices");
    refused("{\"guides\":0}", "/guides");
    refused("{\"guides\":1e400}", "/guides");
    refused("{\"seed\":-1}", "/seed");
    refused("{\"seed\":9007199254740993000}", "/seed");
    refused("{\"quality\":\"best\"}", "/quality");
    refused("{\"operators\":[\"scale\",\"curls\"]}", "/operators/1");
    refused("{\"operators\":{}}", "/operators");
    refused("{\"stages\":[]}", "/stages");
    refused("{\"stages\":null}", "/stages");
    refused("{\"visibility\":{\"cameras\":{}}}", "/visibility/cameras");
    refused("{\"visibility\":{\"cameras\":[{\"width\":0}]}}", "/visibility/cameras/0/width");
    refused("{\"visibility\":{\"cameras\":{\"frames\":[{}]}}}", "/visibility/cameras");
    refused("{\"visibility\":{\"cameras\":{\"frames\":[],\"unit\":\"ell\"}}}", "/visibility/cameras/unit");
    refused("{\"visibility\":{\"cameras\":{\"frames\":[],\"up\":\"x\"}}}", "/visibility/cameras/up");
    refused("{\"visibility\":{\"cameras\":{\"cameras_txt\":\"\"}}}", "/visibility/cameras");
    refused("{\"visibility\":{\"cameras\":{\"cameras_txt\":\"\",\"images_txt\":\"1 1 0 0\"}}}", "/visibility/cameras");
    refused("{\"stages\":{\"initialize\":{\"estimate_operators\":1}}}", "/stages/initialize/estimate_operators");
    refused("{\"guides\":10,\"operator_guides\":11}", "/operator_guides");
    refused("{\"guides\":2}", "/interpolation_guides");
    refused("{\"seed\":1,\"seed\":2}", "/seed");
}
END_TEST

START_TEST(what_is_no_object_is_refused)
{
    refused("[]", "");
    refused("null", "");
    refused("{", "");
    refused("{} {}", "");
    refused("{}x", "");
}
END_TEST

START_TEST(printing_fills_in_defaults_and_reads_back_the_same)
{
    struct groom_fit_options options = parsed(
        "{\"quality\":\"high\",\"guides\":321,\"operators\":[\"clump\"],\"stages\":{\"initialize\":"
        "{\"lambda_smooth\":0.1,\"sigma_instance\":0.25}},\"visibility\":{\"cameras\":[{\"width\":10,\"height\":20,"
        "\"fx\":30.5,\"fy\":31,\"cx\":5,\"cy\":10,\"rotation\":[[1,0,0],[0,1,0],[0,0,1]],\"translation\":[0,0.1,2]}]}}");
    struct groom_fit_options again;
    char *json, *json_again;
    ck_ok(groom_fit_options_print(&options, &json, NULL));
    ck_ok(groom_fit_options_parse(json, strlen(json), &again, NULL));
    ck_assert_mem_eq(&options, &again, sizeof options);
    ck_ok(groom_fit_options_print(&again, &json_again, NULL));
    ck_assert_str_eq(json, json_again);
    ck_assert_ptr_nonnull(strstr(json, "\"operator_guides\":\t\"auto\""));
    free(json);
    free(json_again);
}
END_TEST

/* A camera at (0, 1.6, 1) that looks along -z, three times. */
START_TEST(cameras_of_files_become_our_own)
{
    static const char *const forms[] = {
        "[{\"width\":640,\"height\":480,\"fx\":500,\"fy\":500,\"cx\":320,\"cy\":240,\"rotation\":[[1,0,0],[0,-1,0],[0,0,-1]],"
        "\"translation\":[0,1.6,1]}]",
        "{\"w\":640,\"h\":480,\"fl_x\":500,\"aabb_scale\":16,\"unit\":\"cm\",\"frames\":[{\"transform_matrix\":"
        "[[1,0,0,0],[0,1,0,160],[0,0,1,100],[0,0,0,1]]}]}",
        "{\"unit\":0.1,\"cameras_txt\":\"1 SIMPLE_PINHOLE 640 480 500 320 240\\n\",\"images_txt\":\"# q, t\\n1 0 1 0 0 0 16 10 1\\n\\n\"}"};
    for (int form = 0; form < 3; form++) {
        char json[600];
        snprintf(json, sizeof json, "{\"visibility\":{\"cameras\":%s}}", forms[form]);
        struct groom_fit_options options = parsed(json);
        const struct groom_camera *camera = &options.cameras[0];
        double pixel[2], depth;
        ck_assert_uint_eq(options.n_cameras, 1);
        ck_assert_uint_eq(camera->width, 640);
        ck_assert_int_eq(groom_camera_project(camera, (float[3]){0.1f, 1.5f, 0}, pixel, &depth), 1);
        ck_assert_double_eq_tol(pixel[0], 370, 1e-4);
        ck_assert_double_eq_tol(pixel[1], 290, 1e-4);
        ck_assert_double_eq_tol(depth, 1, 1e-6);
    }
}
END_TEST

/* Every row of the table is in the schema under its path, with a description. */
static const cJSON *schema_at(const cJSON *schema, const char *path)
{
    char part[64];
    while (schema && *path) {
        size_t n = strcspn(path + 1, "/");
        memcpy(part, path + 1, n);
        part[n] = 0;
        const cJSON *either = cJSON_GetObjectItem(schema, "anyOf");
        const cJSON *holder = either ? cJSON_GetArrayItem(either, 0) : schema;
        schema = cJSON_GetObjectItemCaseSensitive(cJSON_GetObjectItem(holder, "properties"), part);
        path += 1 + n;
    }
    return schema;
}

START_TEST(the_schema_describes_every_option)
{
    char *text;
    ck_ok(groom_fit_options_schema(&text, NULL));
    cJSON *schema = cJSON_Parse(text);
    ck_assert_ptr_nonnull(schema);
    for (size_t i = 0; i < options_n_rows; i++) {
        const cJSON *row = schema_at(schema, options_table[i].path);
        ck_assert_msg(row != NULL, "%s", options_table[i].path);
        ck_assert_ptr_nonnull(cJSON_GetObjectItem(row, "description"));
    }
    ck_assert_int_eq(cJSON_IsFalse(cJSON_GetObjectItem(schema, "additionalProperties")), 1);
    const cJSON *smooth = schema_at(schema, "/stages/initialize/n_smooth");
    ck_assert_double_eq(cJSON_GetObjectItem(smooth, "default")->valuedouble, 80);
    ck_assert_str_eq(cJSON_GetObjectItem(smooth, "type")->valuestring, "integer");
    cJSON_Delete(schema);
    free(text);
}
END_TEST

START_TEST(defaults_lie_in_their_ranges)
{
    for (size_t i = 0; i < options_n_rows; i++) {
        const struct option_row *row = &options_table[i];
        int automatic = row->type == OPTION_U32_OR_AUTO || row->type == OPTION_REAL_OR_AUTO;
        for (int q = 0; q < 3 && row->maximum > row->minimum; q++)
            ck_assert_msg((automatic && row->initial[q] == 0) ||
                              (row->initial[q] >= row->minimum && row->initial[q] <= row->maximum),
                          "%s", row->path);
        ck_assert_ptr_eq(options_find(row->path), row);
    }
}
END_TEST

TEST_SUITE("fit_options", nothing_means_the_papers_defaults, quality_sets_defaults_and_an_option_overrides_them,
           the_contracts_example_is_read, an_unknown_name_is_refused_with_the_nearest_one,
           a_wrong_value_is_refused_where_it_stands, what_is_no_object_is_refused,
           printing_fills_in_defaults_and_reads_back_the_same, cameras_of_files_become_our_own, the_schema_describes_every_option,
           defaults_lie_in_their_ranges)
