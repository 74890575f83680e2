/* request targets and problem documents */
#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

#include "proto/problem.h"
#include "proto/strand_stream.h"
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

/* --- strands ------------------------------------------------------------------------- */

struct room {
    uint32_t first[3];
    float points[3][3];
};

static int room_for_two(void *user, struct strand_stream *stream)
{
    struct room *room = user;
    if (stream->n_strands != 2 || stream->n_vertices != 3)
        return 0;
    stream->first = room->first;
    stream->points = room->points;
    return 1;
}

/* Two strands of 1 and 2 vertices, as they are sent. */
static size_t two_strands(char *bytes)
{
    const uint32_t first[3] = {0, 1, 3};
    const float points[3][3] = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
    strand_stream_head(2, 3, bytes);
    memcpy(bytes + STRAND_STREAM_HEAD, first, sizeof first);
    memcpy(bytes + STRAND_STREAM_HEAD + sizeof first, points, sizeof points);
    ck_assert_uint_eq(strand_stream_bytes(2, 3), STRAND_STREAM_HEAD + sizeof first + sizeof points);
    return STRAND_STREAM_HEAD + sizeof first + sizeof points;
}

START_TEST(strands_come_whole_in_pieces_of_any_size)
{
    char bytes[128];
    size_t n = two_strands(bytes);
    for (size_t piece = 1; piece <= n; piece++) {
        struct room room = {0};
        struct strand_stream stream = {.room = room_for_two, .user = &room};
        for (size_t at = 0; at < n; at += piece) {
            ck_assert_int_eq(strand_stream_is_whole(&stream), 0);
            ck_assert_int_eq(strand_stream_take(&stream, bytes + at, piece < n - at ? piece : n - at), 1);
        }
        ck_assert_int_eq(strand_stream_is_whole(&stream), 1);
        ck_assert(room.first[2] == 3 && room.points[0][0] == 1.0f && room.points[2][2] == 9.0f);
        ck_assert_int_eq(strand_stream_take(&stream, "x", 1), 0); /* more than was announced */
    }
}
END_TEST

START_TEST(strands_that_do_not_add_up_are_refused)
{
    char bytes[128];
    size_t n = two_strands(bytes);
    for (size_t bent = 0; bent < STRAND_STREAM_HEAD + 12; bent++) { /* the head and the offsets: each bit counts */
        struct room room = {0};
        struct strand_stream stream = {.room = room_for_two, .user = &room};
        bytes[bent] ^= 4;
        int taken = strand_stream_take(&stream, bytes, n), whole = taken && strand_stream_is_whole(&stream);
        ck_assert_msg(!whole, "byte %zu", bent);
        bytes[bent] ^= 4;
    }
}
END_TEST

TEST_SUITE("proto", strands_come_whole_in_pieces_of_any_size, strands_that_do_not_add_up_are_refused, uri_splits_before_it_decodes, uri_takes_root_empty_segments_and_absolute_targets,
           uri_refuses_what_is_no_honest_target, problem_survives_the_way_through_json,
           problem_believes_no_odd_json)
