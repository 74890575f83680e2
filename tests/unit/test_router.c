/* which route a target finds */
#include <string.h>

#include "server/http/router.h"
#include "tests/support/test.h"

static void nothing(struct request *request) { (void)request; }

static const struct route routes[] = {
    {"GET", "/", nothing, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"GET", "/v1/strands", nothing, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"POST", "/v1/strands", nothing, BODY_BLOB, LANE_SLOW, "", 0, NULL},
    {"GET", "/v1/strands/{id}", nothing, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"GET", "/v1/strands/{id}/data", nothing, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"GET", "/v1/a/{x}/{y}", nothing, BODY_NONE, LANE_FAST, "", 0, NULL},
};

static enum router_outcome find(const char *method, const char *target, struct router_match *match,
                                struct uri *uri)
{
    ck_assert_ptr_null(uri_parse(target, uri));
    return router_find(routes, sizeof routes / sizeof routes[0], method, uri, match);
}

START_TEST(each_target_finds_its_route)
{
    static const struct {
        const char *method, *target;
        int route;
    } cases[] = {{"GET", "/", 0},
                 {"GET", "/v1/strands", 1},
                 {"HEAD", "/v1/strands", 1},
                 {"POST", "/v1/strands", 2},
                 {"GET", "/v1/strands/str_1?x=1", 3},
                 {"GET", "/v1/strands/str_1/data", 4},
                 {"GET", "/v1/a/b/c", 5}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct router_match match;
        struct uri uri;
        ck_assert_int_eq(find(cases[i].method, cases[i].target, &match, &uri), ROUTER_FOUND);
        ck_assert_ptr_eq(match.route, &routes[cases[i].route]);
        uri_finish(&uri);
    }
}
END_TEST

START_TEST(parameters_come_in_order)
{
    struct router_match match;
    struct uri uri;
    ck_assert_int_eq(find("GET", "/v1/a/one/two%2Fthree", &match, &uri), ROUTER_FOUND);
    ck_assert_str_eq(match.parameter[0], "one");
    ck_assert_str_eq(match.parameter[1], "two/three");
    uri_finish(&uri);
}
END_TEST

START_TEST(wrong_method_says_which_are_allowed)
{
    struct router_match match;
    struct uri uri;
    ck_assert_int_eq(find("DELETE", "/v1/strands", &match, &uri), ROUTER_NO_METHOD);
    ck_assert_str_eq(match.allow, "GET, HEAD, POST, OPTIONS");
    uri_finish(&uri);
}
END_TEST

START_TEST(unknown_paths_find_nothing)
{
    static const char *const targets[] = {
        "/v1",         "/v1/strands/", "/v1//strands", "/v1/strands/a/b", "/v1/strands/a/data/",
        "/V1/strands", "/v1/strandsx"};
    for (size_t i = 0; i < sizeof targets / sizeof targets[0]; i++) {
        struct router_match match;
        struct uri uri;
        ck_assert_msg(find("GET", targets[i], &match, &uri) == ROUTER_NO_PATH, "%s", targets[i]);
        uri_finish(&uri);
    }
}
END_TEST

START_TEST(lists_of_words)
{
    ck_assert(router_knows("format unit up", "unit"));
    ck_assert(router_knows("format", "format"));
    ck_assert(!router_knows("format unit", "uni"));
    ck_assert(!router_knows("format unit", ""));
    ck_assert(!router_knows("", "x"));
}
END_TEST

TEST_SUITE("router", each_target_finds_its_route, parameters_come_in_order,
           wrong_method_says_which_are_allowed, unknown_paths_find_nothing, lists_of_words)
