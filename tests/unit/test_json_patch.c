/* JSON Patch: RFC 6902 appendix A, RFC 6901 section 5, RFC 7396 appendix A; and what must not blow up */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "proto/json_patch.h"
#include "proto/json_text.h"
#include "tests/support/test.h"

struct patch_case {
    const char *name, *document, *patch;
    const char *expected; /* NULL: refused with `status` */
    enum json_patch_status status;
};

static const struct patch_case appendix_a[] = {
    {"A.1 add a member", "{\"foo\":\"bar\"}", "[{\"op\":\"add\",\"path\":\"/baz\",\"value\":\"qux\"}]",
     "{\"baz\":\"qux\",\"foo\":\"bar\"}", JSON_PATCH_OK},
    {"A.2 add an element", "{\"foo\":[\"bar\",\"baz\"]}",
     "[{\"op\":\"add\",\"path\":\"/foo/1\",\"value\":\"qux\"}]", "{\"foo\":[\"bar\",\"qux\",\"baz\"]}",
     JSON_PATCH_OK},
    {"add the first", "[1,2]",
     "[{\"op\":\"add\",\"path\":\"/0\",\"value\":0},{\"op\":\"add\",\"path\":\"/-\",\"value\":3}]",
     "[0,1,2,3]", JSON_PATCH_OK},
    {"A.3 remove a member", "{\"baz\":\"qux\",\"foo\":\"bar\"}", "[{\"op\":\"remove\",\"path\":\"/baz\"}]",
     "{\"foo\":\"bar\"}", JSON_PATCH_OK},
    {"A.4 remove an element", "{\"foo\":[\"bar\",\"qux\",\"baz\"]}",
     "[{\"op\":\"remove\",\"path\":\"/foo/1\"}]", "{\"foo\":[\"bar\",\"baz\"]}", JSON_PATCH_OK},
    {"A.5 replace a value", "{\"baz\":\"qux\",\"foo\":\"bar\"}",
     "[{\"op\":\"replace\",\"path\":\"/baz\",\"value\":\"boo\"}]", "{\"baz\":\"boo\",\"foo\":\"bar\"}",
     JSON_PATCH_OK},
    {"A.6 move a value", "{\"foo\":{\"bar\":\"baz\",\"waldo\":\"fred\"},\"qux\":{\"corge\":\"grault\"}}",
     "[{\"op\":\"move\",\"from\":\"/foo/waldo\",\"path\":\"/qux/thud\"}]",
     "{\"foo\":{\"bar\":\"baz\"},\"qux\":{\"corge\":\"grault\",\"thud\":\"fred\"}}", JSON_PATCH_OK},
    {"A.7 move an element", "{\"foo\":[\"all\",\"grass\",\"cows\",\"eat\"]}",
     "[{\"op\":\"move\",\"from\":\"/foo/1\",\"path\":\"/foo/3\"}]",
     "{\"foo\":[\"all\",\"cows\",\"eat\",\"grass\"]}", JSON_PATCH_OK},
    {"A.8 test: success", "{\"baz\":\"qux\",\"foo\":[\"a\",2,\"c\"]}",
     "[{\"op\":\"test\",\"path\":\"/baz\",\"value\":\"qux\"},{\"op\":\"test\",\"path\":\"/foo/"
     "1\",\"value\":2}]",
     "{\"baz\":\"qux\",\"foo\":[\"a\",2,\"c\"]}", JSON_PATCH_OK},
    {"A.9 test: error", "{\"baz\":\"qux\"}", "[{\"op\":\"test\",\"path\":\"/baz\",\"value\":\"bar\"}]", NULL,
     JSON_PATCH_TEST},
    {"A.10 add a nested member", "{\"foo\":\"bar\"}",
     "[{\"op\":\"add\",\"path\":\"/child\",\"value\":{\"grandchild\":{}}}]",
     "{\"foo\":\"bar\",\"child\":{\"grandchild\":{}}}", JSON_PATCH_OK},
    {"A.11 ignore unknown members", "{\"foo\":\"bar\"}",
     "[{\"op\":\"add\",\"path\":\"/baz\",\"value\":\"qux\",\"xyz\":123}]",
     "{\"foo\":\"bar\",\"baz\":\"qux\"}", JSON_PATCH_OK},
    {"A.12 add to a nonexistent target", "{\"foo\":\"bar\"}",
     "[{\"op\":\"add\",\"path\":\"/baz/bat\",\"value\":\"qux\"}]", NULL, JSON_PATCH_CONFLICT},
    {"A.14 tilde escapes", "{\"/\":9,\"~1\":10}", "[{\"op\":\"test\",\"path\":\"/~01\",\"value\":10}]",
     "{\"/\":9,\"~1\":10}", JSON_PATCH_OK},
    {"A.15 strings and numbers differ", "{\"/\":9,\"~1\":10}",
     "[{\"op\":\"test\",\"path\":\"/~01\",\"value\":\"10\"}]", NULL, JSON_PATCH_TEST},
    {"A.16 add an array value", "{\"foo\":[\"bar\"]}",
     "[{\"op\":\"add\",\"path\":\"/foo/-\",\"value\":[\"abc\",\"def\"]}]",
     "{\"foo\":[\"bar\",[\"abc\",\"def\"]]}", JSON_PATCH_OK},
    {"root replaced", "{\"a\":1}", "[{\"op\":\"replace\",\"path\":\"\",\"value\":[2]}]", "[2]",
     JSON_PATCH_OK},
    {"copy", "{\"a\":[1]}", "[{\"op\":\"copy\",\"from\":\"/a\",\"path\":\"/b\"}]", "{\"a\":[1],\"b\":[1]}",
     JSON_PATCH_OK},
    {"all or nothing", "{\"a\":1}",
     "[{\"op\":\"remove\",\"path\":\"/a\"},{\"op\":\"remove\",\"path\":\"/a\"}]", NULL, JSON_PATCH_CONFLICT},
    {"leading zero", "[1,2]", "[{\"op\":\"remove\",\"path\":\"/01\"}]", NULL, JSON_PATCH_CONFLICT},
    {"beyond the end", "[1]", "[{\"op\":\"add\",\"path\":\"/2\",\"value\":0}]", NULL, JSON_PATCH_CONFLICT},
    {"into itself", "{\"a\":{}}", "[{\"op\":\"move\",\"from\":\"/a\",\"path\":\"/a/b\"}]", NULL,
     JSON_PATCH_INVALID},
    {"onto itself", "{\"a\":{}}", "[{\"op\":\"move\",\"from\":\"/a\",\"path\":\"/a\"}]", "{\"a\":{}}",
     JSON_PATCH_OK},
    {"unknown op", "{}", "[{\"op\":\"spin\",\"path\":\"/a\"}]", NULL, JSON_PATCH_INVALID},
    {"no value", "{}", "[{\"op\":\"add\",\"path\":\"/a\"}]", NULL, JSON_PATCH_INVALID},
    {"no slash", "{\"a\":1}", "[{\"op\":\"remove\",\"path\":\"a\"}]", NULL, JSON_PATCH_INVALID},
    {"bad escape", "{\"a~\":1}", "[{\"op\":\"remove\",\"path\":\"/a~\"}]", NULL, JSON_PATCH_CONFLICT},
    {"not an array", "{}", "{\"op\":\"add\"}", NULL, JSON_PATCH_INVALID},
    {"null is a value", "{}", "[{\"op\":\"add\",\"path\":\"/a\",\"value\":null}]", "{\"a\":null}",
     JSON_PATCH_OK},
    {"objects in any order", "{\"a\":{\"x\":1,\"y\":2}}",
     "[{\"op\":\"test\",\"path\":\"/a\",\"value\":{\"y\":2,\"x\":1.0}}]", "{\"a\":{\"x\":1,\"y\":2}}",
     JSON_PATCH_OK},
};

static cJSON *parse(const char *text)
{
    struct json_text_error error;
    cJSON *tree = json_text_parse(text, strlen(text), &error);
    ck_assert_msg(tree != NULL, "%s: %s", text, error.detail);
    return tree;
}

START_TEST(patch_follows_rfc_6902)
{
    for (size_t i = 0; i < sizeof appendix_a / sizeof appendix_a[0]; i++) {
        const struct patch_case *c = &appendix_a[i];
        cJSON *document = parse(c->document), *before = parse(c->document), *patch = parse(c->patch),
              *result = NULL;
        struct json_patch_error error = {0};
        enum json_patch_status status = json_patch_apply(document, patch, &result, &error);
        ck_assert_msg(status == c->status, "%s: %d %s", c->name, status, error.detail);
        ck_assert_msg((result != NULL) == (c->expected != NULL), "%s", c->name);
        ck_assert_msg(json_equal(document, before), "%s changed its input", c->name);
        if (c->expected) {
            cJSON *expected = parse(c->expected);
            ck_assert_msg(json_equal(result, expected), "%s", c->name);
            cJSON_Delete(expected);
        } else {
            ck_assert_msg(error.detail[0], "%s", c->name);
        }
        cJSON_Delete(document), cJSON_Delete(before), cJSON_Delete(patch), cJSON_Delete(result);
    }
}
END_TEST

START_TEST(error_points_into_the_patch)
{
    cJSON *document = parse("{\"a\":1}"), *result = NULL;
    cJSON *patch =
        parse("[{\"op\":\"test\",\"path\":\"/a\",\"value\":1},{\"op\":\"remove\",\"path\":\"/b\"}]");
    struct json_patch_error error;
    ck_assert_int_eq(json_patch_apply(document, patch, &result, &error), JSON_PATCH_CONFLICT);
    ck_assert_str_eq(error.pointer, "/1/path");
    cJSON_Delete(document), cJSON_Delete(patch);
}
END_TEST

START_TEST(pointer_follows_rfc_6901)
{
    cJSON *document = parse(
        "{\"foo\":[\"bar\",\"baz\"],\"\":0,\"a/b\":1,\"c%d\":2,\"i\\\\j\":5,\"k\\\"l\":6,\" \":7,\"m~n\":8}");
    static const struct {
        const char *pointer;
        double value;
    } cases[] = {{"/", 0}, {"/a~1b", 1}, {"/c%d", 2}, {"/i\\j", 5}, {"/k\"l", 6}, {"/ ", 7}, {"/m~0n", 8}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const cJSON *found = json_pointer_get(document, cases[i].pointer);
        ck_assert_msg(found != NULL, "%s", cases[i].pointer);
        ck_assert_double_eq(found->valuedouble, cases[i].value);
    }
    ck_assert_ptr_eq(json_pointer_get(document, ""), document);
    ck_assert_str_eq(json_pointer_get(document, "/foo/0")->valuestring, "bar");
    ck_assert_ptr_null(json_pointer_get(document, "/foo/2"));
    ck_assert_ptr_null(json_pointer_get(document, "/foo/-"));
    ck_assert_ptr_null(json_pointer_get(document, "foo"));
    cJSON_Delete(document);
}
END_TEST

START_TEST(copying_into_itself_is_bounded)
{
    cJSON *document = parse("{\"a\":{}}"), *patch = cJSON_CreateArray(), *result = NULL;
    for (int i = 0; i < 200; i++) {
        cJSON *op = cJSON_CreateObject();
        char path[16];
        snprintf(path, sizeof path, "/a/k%d", i);
        cJSON_AddStringToObject(op, "op", "copy");
        cJSON_AddStringToObject(op, "from", "/a");
        cJSON_AddStringToObject(op, "path", path);
        cJSON_AddItemToArray(patch, op);
    }
    ck_assert_int_eq(json_patch_apply(document, patch, &result, NULL), JSON_PATCH_INVALID);
    ck_assert_ptr_null(result);
    cJSON_Delete(document), cJSON_Delete(patch);
}
END_TEST

START_TEST(merge_follows_rfc_7396)
{
    static const char *const cases[][3] = {
        {"{\"a\":\"b\"}", "{\"a\":\"c\"}", "{\"a\":\"c\"}"},
        {"{\"a\":\"b\"}", "{\"b\":\"c\"}", "{\"a\":\"b\",\"b\":\"c\"}"},
        {"{\"a\":\"b\"}", "{\"a\":null}", "{}"},
        {"{\"a\":\"b\",\"b\":\"c\"}", "{\"a\":null}", "{\"b\":\"c\"}"},
        {"{\"a\":[\"b\"]}", "{\"a\":\"c\"}", "{\"a\":\"c\"}"},
        {"{\"a\":\"c\"}", "{\"a\":[\"b\"]}", "{\"a\":[\"b\"]}"},
        {"{\"a\":{\"b\":\"c\"}}", "{\"a\":{\"b\":\"d\",\"c\":null}}", "{\"a\":{\"b\":\"d\"}}"},
        {"{\"a\":[{\"b\":\"c\"}]}", "{\"a\":[1]}", "{\"a\":[1]}"},
        {"[\"a\",\"b\"]", "[\"c\",\"d\"]", "[\"c\",\"d\"]"},
        {"{\"a\":\"b\"}", "[\"c\"]", "[\"c\"]"},
        {"{\"a\":\"foo\"}", "null", "null"},
        {"{\"a\":\"foo\"}", "\"bar\"", "\"bar\""},
        {"{\"e\":null}", "{\"a\":1}", "{\"e\":null,\"a\":1}"},
        {"[1,2]", "{\"a\":\"b\",\"c\":null}", "{\"a\":\"b\"}"},
        {"{}", "{\"a\":{\"bb\":{\"ccc\":null}}}", "{\"a\":{\"bb\":{}}}"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        cJSON *document = parse(cases[i][0]), *patch = parse(cases[i][1]), *expected = parse(cases[i][2]);
        cJSON *result = json_merge_patch(document, patch);
        ck_assert_msg(result && json_equal(result, expected), "%s + %s", cases[i][0], cases[i][1]);
        cJSON_Delete(document), cJSON_Delete(patch), cJSON_Delete(expected), cJSON_Delete(result);
    }
}
END_TEST

START_TEST(text_refuses_what_cjson_would_let_pass)
{
    static const struct {
        const char *text;
        int64_t offset;
    } cases[] = {{"", 0},         {"{\"a\":1e400}", 0}, {"{\"a\":1,\"a\":2}", 0}, {"\"\\u0000\"", 1},
                 {"\"\xff\"", 1}, {"\"\xc0\xaf\"", 1},  {"\"\xed\xa0\x80\"", 1},  {"{} {}", 3},
                 {"{\"a\":}", 5}, {"\"a", 2},           {"{\"a\":\"b", 7},        {"[1,2", 3},
                 {"\"\n\"", 1}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct json_text_error error;
        ck_assert_msg(!json_text_parse(cases[i].text, strlen(cases[i].text), &error), "%s", cases[i].text);
        ck_assert_msg(error.detail[0], "%s", cases[i].text);
        ck_assert_msg(error.byte_offset == cases[i].offset, "%s: %ld", cases[i].text,
                      (long)error.byte_offset);
    }
}
END_TEST

START_TEST(text_refuses_deep_nesting_and_takes_sixty_four)
{
    char text[2001];
    memset(text, '[', 1000), memset(text + 1000, ']', 1000), text[2000] = 0;
    struct json_text_error error;
    ck_assert_ptr_null(json_text_parse(text, 2000, &error));
    ck_assert_int_eq(error.byte_offset, JSON_TEXT_DEPTH);
    cJSON *tree = json_text_parse(text + 1000 - JSON_TEXT_DEPTH, 2 * JSON_TEXT_DEPTH, &error);
    ck_assert_ptr_nonnull(tree);
    cJSON_Delete(tree);
}
END_TEST

TEST_SUITE("json_patch", patch_follows_rfc_6902, error_points_into_the_patch, pointer_follows_rfc_6901,
           copying_into_itself_is_bounded, merge_follows_rfc_7396, text_refuses_what_cjson_would_let_pass,
           text_refuses_deep_nesting_and_takes_sixty_four)
