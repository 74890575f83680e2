/* request targets and problem documents */
#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

#include "proto/problem.h"
#include "proto/uri.h"
#include "tests/support/test.h"

START_TEST(uri_splits_before_it_decodes)
{
    struct uri uri;
    ck_assert_ptr_null(uri_parse("/v1/strands/a%2Fb?unit=c%6d&up&name=two+words%21#top", &uri));
    ck_assert_uint_eq(uri.n_segments, 3);
    ck_assert_str_eq(uri.segment[2], "a/b");
    ck_assert_uint_eq(uri.n_parameters, 3);
    ck_assert_str_eq(uri_query(&uri, "unit"), "cm");
    ck_assert_str_eq(uri_query(&uri, "up"), "");
    ck_assert_str_eq(uri_query(&uri, "name"), "two words!");
    ck_assert_ptr_null(uri_query(&uri, "nam"));
    uri_finish(&uri);
}
END_TEST

START_TEST(uri_takes_root_empty_segments_and_absolute_targets)
{
    struct uri uri;
    ck_assert_ptr_null(uri_parse("/", &uri));
    ck_assert_uint_eq(uri.n_segments, 0);
    uri_finish(&uri);
    ck_assert_ptr_null(uri_parse("/v1/strands/", &uri));
    ck_assert_uint_eq(uri.n_segments, 3);
    ck_assert_str_eq(uri.segment[2], "");
    uri_finish(&uri);
    ck_assert_ptr_null(uri_parse("http://127.0.0.1:80/healthz", &uri));
    ck_assert_str_eq(uri.segment[0], "healthz");
    uri_finish(&uri);
    ck_assert_ptr_null(uri_parse("/?&&a=1&", &uri));
    ck_assert_uint_eq(uri.n_parameters, 1);
    uri_finish(&uri);
}
END_TEST

START_TEST(uri_refuses_what_is_no_honest_target)
{
    static const char *const bad[] = {"",
                                      "v1",
                                      "*",
                                      "/a/../b",
                                      "/a/%2e%2e/b",
                                      "/%",
                                      "/%4",
                                      "/%zz",
                                      "/%00",
                                      "/a%0ab",
                                      "/%ff",
                                      "/%c0%af",
                                      "/%ed%a0%80",
                                      "/?a=1&a=2",
                                      "/?a=%",
                                      "/1/2/3/4/5/6/7/8/9/10/11/12/13/14/15/16/17"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct uri uri;
        ck_assert_msg(uri_parse(bad[i], &uri) != NULL, "%s", bad[i]);
        ck_assert_ptr_null(uri.storage);
    }
}
END_TEST

START_TEST(problem_survives_the_way_through_json)
{
    struct problem problem, again;
    problem_set(&problem, 422, "invalid-file", "the data is not what its format promises",
                "strand %d has no end", 7);
    problem.byte_offset = 128;
    strcpy(problem.pointer, "/strands/7");
    char *text = problem_print(&problem);
    ck_assert_ptr_nonnull(strstr(text, "\"type\":\"/problems/invalid-file\""));
    cJSON *json = cJSON_Parse(text);
    ck_assert(problem_from_json(json, &again));
    ck_assert_mem_eq(&problem, &again, sizeof problem);
    cJSON_Delete(json);
    free(text);
}
END_TEST

START_TEST(problem_believes_no_odd_json)
{
    static const char *const odd[] = {"[]", "{}", "{\"type\":7}", "3"};
    struct problem problem;
    for (size_t i = 0; i < sizeof odd / sizeof odd[0]; i++) {
        cJSON *json = cJSON_Parse(odd[i]);
        ck_assert_msg(!problem_from_json(json, &problem), "%s", odd[i]);
        cJSON_Delete(json);
    }
    cJSON *json = cJSON_Parse("{\"type\":\"/problems/x\",\"status\":200,\"byte_offset\":-4}");
    ck_assert(problem_from_json(json, &problem));
    ck_assert_int_eq(problem.status, 500);
    ck_assert_int_eq(problem.byte_offset, -1);
    cJSON_Delete(json);
}
END_TEST

TEST_SUITE("proto", uri_splits_before_it_decodes, uri_takes_root_empty_segments_and_absolute_targets,
           uri_refuses_what_is_no_honest_target, problem_survives_the_way_through_json,
           problem_believes_no_odd_json)
