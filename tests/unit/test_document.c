/* The groom document: there and back, and what it refuses. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cjson/cJSON.h>

#include "base/base64.h"
#include "groom/document.h"
#include "tests/support/grooms.h"
#include "tests/support/test.h"

/* --- base64 ------------------------------------------------------------------------------ */

START_TEST(base64_encodes_the_examples_of_its_standard)
{
    static const char *const pairs[][2] = {{"", ""},         {"f", "Zg=="},         {"fo", "Zm8="},
                                           {"foo", "Zm9v"},  {"foob", "Zm9vYg=="},  {"fooba", "Zm9vYmE="},
                                           {"foobar", "Zm9vYmFy"}};
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        char text[16], back[16] = {0};
        base64_encode(pairs[i][0], strlen(pairs[i][0]), text);
        ck_assert_str_eq(text, pairs[i][1]);
        ck_assert_int_eq(base64_decoded_length(text, strlen(text)), (int)strlen(pairs[i][0]));
        ck_assert_int_eq(base64_decode(text, strlen(text), back), 0);
        ck_assert_str_eq(back, pairs[i][0]);
    }
}
END_TEST

START_TEST(base64_refuses_what_is_not_base64)
{
    static const char *const bad[] = {"A", "AB", "ABC", "A===", "AB=A", "ABC\n", "AB C", "Zh==", "Zm9=", "====", "AA==AAAA"};
    unsigned char out[16];
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        ck_assert_msg(base64_decode(bad[i], strlen(bad[i]), out) != 0, "%s was taken", bad[i]);
}
END_TEST

static struct groom *small_groom(uint32_t n_strands, uint32_t n_guides, uint32_t n_vertices, uint64_t seed)
{
    struct groom *groom = test_groom((struct groom_shape){n_strands, n_vertices, n_guides, n_guides / 2, 3}, seed);
    test_append_all_operators(groom, seed);
    return groom;
}

/* --- there and back ------------------------------------------------------------------------ */

static struct groom *read_back(const char *json, const struct groom_array_finder *finder)
{
    struct groom *groom = NULL;
    struct groom_diag diag = {0};
    groom_status status = groom_document_read(json, strlen(json), finder, NULL, &groom, &diag);
    ck_assert_msg(status == GROOM_OK, "%s at %s: %s", groom_status_name(status), diag.pointer, diag.detail);
    return groom;
}

static void assert_same(const struct groom *a, const struct groom *b)
{
    size_t n_points = (size_t)a->n_strands * a->n_vertices;
    float(*x)[3] = malloc(n_points * sizeof *x), (*y)[3] = malloc(n_points * sizeof *y);
    ck_ok(groom_evaluate(a, 0, a->n_strands, x, NULL, NULL));
    ck_ok(groom_evaluate(b, 0, b->n_strands, y, NULL, NULL));
    ck_assert_mem_eq(x, y, n_points * sizeof *x);
    free(x);
    free(y);
}

START_TEST(document_read_back_is_the_same_groom_bit_for_bit)
{
    struct groom *groom = small_groom(40, 8, 12, 5), *back;
    char *json;
    size_t n;
    strcpy(groom->name, "Löckchen \"1\"");
    groom->operators[1].parameter[0] = 0.1f + 1e-8f;
    groom->operators[3].enabled = 0;
    memcpy(groom->axes, test_slanted_axes, sizeof groom->axes);
    ck_ok(groom_document_write(groom, "{\"id\":\"grm_x\",\"fit\":{\"losses\":[1,2]}}", NULL, &json, &n, NULL));
    ck_assert_uint_eq(n, strlen(json));
    back = read_back(json, NULL);
    ck_assert_str_eq(back->name, groom->name);
    ck_assert_int_eq(back->operators[3].enabled, 0);
    ck_assert_mem_eq(back->axes, groom->axes, sizeof back->axes);
    ck_assert_uint_eq(back->operators[2].id, groom->operators[2].id);
    assert_same(groom, back);
    ck_assert_ptr_nonnull(strstr(json, "\"fit\":{\"losses\":[1,2]}"));
    ck_assert_ptr_nonnull(strstr(json, "\"id\":\"grm_x\""));

    char *again;
    ck_ok(groom_document_write(back, json, NULL, &again, &n, NULL));
    ck_assert_str_eq(json, again);
    free(json);
    free(again);
    groom_destroy(groom);
    groom_destroy(back);
}
END_TEST

struct shelf {
    struct {
        void *bytes;
        size_t n_bytes;
    } items[64];
    size_t n;
};

static groom_status keep(void *user, const void *bytes, size_t n_bytes, char reference[GROOM_ARRAY_REFERENCE_SIZE])
{
    struct shelf *shelf = user;
    shelf->items[shelf->n].bytes = malloc(n_bytes);
    shelf->items[shelf->n].n_bytes = n_bytes;
    memcpy(shelf->items[shelf->n].bytes, bytes, n_bytes);
    snprintf(reference, GROOM_ARRAY_REFERENCE_SIZE, "%zu", shelf->n++);
    return GROOM_OK;
}

static groom_status find(void *user, const char *reference, const void **bytes, size_t *n_bytes)
{
    struct shelf *shelf = user;
    size_t at = strtoul(reference, NULL, 10);
    if (at >= shelf->n)
        return GROOM_ENOTFOUND;
    *bytes = shelf->items[at].bytes;
    *n_bytes = shelf->items[at].n_bytes;
    return GROOM_OK;
}

START_TEST(arrays_kept_elsewhere_are_found_again)
{
    struct groom *groom = small_groom(40, 8, 12, 6), *back;
    struct shelf shelf = {0};
    struct groom_array_keeper keeper = {keep, &shelf};
    struct groom_array_finder finder = {find, &shelf};
    char *by_reference, *inlined, *direct, *outlined;
    size_t n;
    ck_ok(groom_document_write(groom, NULL, &keeper, &by_reference, &n, NULL));
    ck_ok(groom_document_write(groom, NULL, NULL, &direct, &n, NULL));
    ck_assert_ptr_null(strstr(by_reference, "\"data\""));
    back = read_back(by_reference, &finder);
    assert_same(groom, back);

    ck_ok(groom_document_inline(by_reference, strlen(by_reference), &finder, &inlined, &n, NULL));
    ck_assert_str_eq(inlined, direct);
    ck_ok(groom_document_outline(direct, strlen(direct), &outlined, &n, NULL));
    ck_assert_ptr_null(strstr(outlined, "\"data\""));
    ck_assert_ptr_nonnull(strstr(outlined, "\"roots\":{\"dtype\":\"f32\",\"shape\":[40,3]}"));

    struct groom *none = NULL;
    ck_status(groom_document_read(by_reference, strlen(by_reference), NULL, NULL, &none, NULL), GROOM_EINVAL);
    for (size_t i = 0; i < shelf.n; i++)
        free(shelf.items[i].bytes);
    free(by_reference);
    free(inlined);
    free(direct);
    free(outlined);
    groom_destroy(groom);
    groom_destroy(back);
}
END_TEST

/* --- what an operator may leave out ------------------------------------------------------------ */

static cJSON *small_document(void)
{
    struct groom *groom = small_groom(10, 4, 5, 1);
    char *json;
    size_t n;
    ck_ok(groom_document_write(groom, NULL, NULL, &json, &n, NULL));
    cJSON *document = cJSON_Parse(json);
    free(json);
    groom_destroy(groom);
    return document;
}

static struct groom *read_tree(cJSON *document, groom_status expected, struct groom_diag *diag)
{
    struct groom *groom = NULL;
    char *json = cJSON_PrintUnformatted(document);
    groom_status status = groom_document_read(json, strlen(json), NULL, NULL, &groom, diag);
    ck_assert_msg(status == expected, "%s at %s: %s", groom_status_name(status), diag->pointer, diag->detail);
    free(json);
    cJSON_Delete(document);
    return groom;
}

START_TEST(an_operator_needs_no_more_than_its_type)
{
    struct groom_diag diag = {0};
    cJSON *document = small_document(), *chain = cJSON_GetObjectItem(document, "operators");
    cJSON_InsertItemInArray(chain, 0, cJSON_Parse("{\"type\":\"frizz\"}"));
    struct groom *groom = read_tree(document, GROOM_OK, &diag);
    ck_assert_uint_eq(groom->n_operators, GROOM_OPERATOR_COUNT + 1);
    ck_assert_int_eq(groom->operators[0].enabled, 1);
    for (uint32_t i = 1; i < groom->n_operators; i++)
        ck_assert_uint_ne(groom->operators[0].id, groom->operators[i].id);
    ck_assert_float_gt(groom->operators[0].random[0][3], 0.0f);
    groom_destroy(groom);
}
END_TEST

START_TEST(random_numbers_left_out_are_the_ones_of_the_seed)
{
    struct groom_diag diag = {0};
    struct groom *with = read_tree(small_document(), GROOM_OK, &diag);
    cJSON *document = small_document(), *op;
    cJSON_ArrayForEach(op, cJSON_GetObjectItem(document, "operators")) cJSON_DeleteItemFromObject(op, "random");
    struct groom *without = read_tree(document, GROOM_OK, &diag);
    assert_same(with, without);
    groom_destroy(with);
    groom_destroy(without);
}
END_TEST

/* --- refusals ------------------------------------------------------------------------------------- */

static void expect_refusal(cJSON *document, groom_status expected, const char *pointer)
{
    struct groom_diag diag = {0};
    ck_assert_ptr_null(read_tree(document, expected, &diag));
    ck_assert_str_eq(diag.pointer, pointer);
    ck_assert(diag.detail[0] != '\0');
}

static cJSON *with_operator_member(int at, const char *name, const char *json)
{
    cJSON *document = small_document();
    cJSON *op = cJSON_GetArrayItem(cJSON_GetObjectItem(document, "operators"), at);
    cJSON_DeleteItemFromObject(op, name);
    cJSON_AddItemToObject(op, name, cJSON_Parse(json));
    return document;
}

START_TEST(a_refusal_points_at_the_culprit)
{
    expect_refusal(with_operator_member(2, "raduis", "0.01"), GROOM_EINVAL, "/operators/2/raduis");
    expect_refusal(with_operator_member(2, "radius", "\"wide\""), GROOM_EINVAL, "/operators/2/radius");
    expect_refusal(with_operator_member(2, "radius", "-1"), GROOM_EINVAL, "/operators/2/radius");
    expect_refusal(with_operator_member(2, "radius", "1e300"), GROOM_EINVAL, "/operators/2/radius");
    expect_refusal(with_operator_member(0, "type", "\"twirl\""), GROOM_EINVAL, "/operators/0/type");
    expect_refusal(with_operator_member(0, "seed", "-3"), GROOM_EINVAL, "/operators/0/seed");
    expect_refusal(with_operator_member(0, "seed", "0.5"), GROOM_EINVAL, "/operators/0/seed");
    expect_refusal(with_operator_member(0, "enabled", "1"), GROOM_EINVAL, "/operators/0/enabled");
    expect_refusal(with_operator_member(4, "random", "{}"), GROOM_EINVAL, "/operators/4/random/u");
    expect_refusal(with_operator_member(4, "random",
                                        "{\"u\":{\"dtype\":\"f32\",\"shape\":[1],\"data\":\"AAAAAA==\"}}"),
                   GROOM_EINVAL, "/operators/4/random/u");
}
END_TEST

static cJSON *with_axes(const char *json)
{
    cJSON *document = small_document();
    cJSON_AddItemToObject(document, "axes", cJSON_Parse(json));
    return document;
}

START_TEST(axes_that_are_none_are_refused)
{
    static const char *const none[] = {"3", "[]", "[1,0,0,0,1,0,0,0,1]", "[[1,0,0],[0,1,0]]", "[[1,0,0],[0,1,0],[0,0]]",
                                       "[[1,0,0],[0,1,0],[0,0,\"1\"]]", "[[1,0,0],[0,1,0],[0,0,-1]]", "[[1,0,0],[0,2,0],[0,0,1]]",
                                       "[[1,0,0],[0,1,0],[0,0,1e300]]"};
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++)
        expect_refusal(with_axes(none[i]), GROOM_EINVAL, "/axes");
}
END_TEST

static cJSON *with_section_member(const char *section, const char *name, const char *json)
{
    cJSON *document = small_document(), *object = cJSON_GetObjectItem(document, section);
    cJSON_DeleteItemFromObject(object, name);
    if (json)
        cJSON_AddItemToObject(object, name, cJSON_Parse(json));
    return document;
}

START_TEST(an_array_that_lies_is_refused)
{
    expect_refusal(with_section_member("strands", "roots", NULL), GROOM_EINVAL, "/strands/roots");
    expect_refusal(with_section_member("strands", "count", "11"), GROOM_EINVAL, "/strands/count");
    expect_refusal(with_section_member("strands", "roots",
                                       "{\"dtype\":\"f32\",\"shape\":[4000000000,3],\"data\":\"AAAA\"}"),
                   GROOM_EINVAL, "/strands/roots");
    expect_refusal(with_section_member("strands", "roots", "{\"dtype\":\"u32\",\"shape\":[10,3],\"data\":\"\"}"),
                   GROOM_EINVAL, "/strands/roots");
    expect_refusal(with_section_member("strands", "roots", "{\"dtype\":\"f32\",\"shape\":[10],\"data\":\"\"}"),
                   GROOM_EINVAL, "/strands/roots");
    expect_refusal(with_section_member("instancing", "guide",
                                       "{\"dtype\":\"u32\",\"shape\":[1,3],\"data\":\"AAAAAAAAAAAAAAAA\"}"),
                   GROOM_EINVAL, "/instancing/guide");
}
END_TEST

START_TEST(what_is_not_a_groom_document_is_refused)
{
    struct groom *groom = NULL;
    struct groom_diag diag = {0};
    static const char *const texts[] = {"", "{", "[]", "null", "{}", "{\"format\":\"groom/2\",\"unit\":\"m\"}",
                                        "{\"format\":\"groom/1\",\"unit\":\"cm\"}", "{\"format\":\"groom/1\"} x"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        ck_assert_int_ne(groom_document_read(texts[i], strlen(texts[i]), NULL, NULL, &groom, &diag), GROOM_OK);
        ck_assert_ptr_null(groom);
    }
}
END_TEST

START_TEST(every_failed_allocation_is_answered)
{
    cJSON *document = small_document();
    char *json = cJSON_PrintUnformatted(document);
    cJSON_Delete(document);
    for (size_t fail_at = 0;; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom *groom = NULL;
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        groom_status status = groom_document_read(json, strlen(json), NULL, &context, &groom, NULL);
        int reached = state.n_allocations > fail_at;
        if (reached) {
            ck_status(status, GROOM_ENOMEM);
            ck_assert_ptr_null(groom);
        }
        groom_destroy(groom);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (!reached) {
            ck_ok(status);
            break;
        }
    }
    free(json);
}
END_TEST

/* --- fewer strands ------------------------------------------------------------------------------------ */

START_TEST(selected_strands_evaluate_to_the_same_bits)
{
    struct groom *groom = small_groom(50, 8, 9, 3), *fewer = NULL;
    uint32_t order[50], seen[50] = {0};
    float whole[50][9][3], some[7][9][3];
    memcpy(groom->axes, test_slanted_axes, sizeof groom->axes);
    groom_fair_order(50, order);
    for (int i = 0; i < 50; i++)
        ck_assert_uint_eq(seen[order[i]]++, 0);
    ck_ok(groom_select(groom, order, 7, NULL, &fewer, NULL));
    ck_ok(groom_evaluate(groom, 0, 50, whole[0], NULL, NULL));
    ck_ok(groom_evaluate(fewer, 0, 7, some[0], NULL, NULL));
    for (int i = 0; i < 7; i++)
        ck_assert_mem_eq(some[i], whole[order[i]], sizeof some[i]);
    groom_destroy(fewer);
    fewer = NULL;
    ck_status(groom_select(groom, (uint32_t[]){50}, 1, NULL, &fewer, NULL), GROOM_EINVAL);
    ck_status(groom_select(groom, order, 0, NULL, &fewer, NULL), GROOM_EINVAL);
    groom_destroy(groom);
}
END_TEST

TEST_SUITE("document", base64_encodes_the_examples_of_its_standard, base64_refuses_what_is_not_base64,
           document_read_back_is_the_same_groom_bit_for_bit, arrays_kept_elsewhere_are_found_again,
           an_operator_needs_no_more_than_its_type, random_numbers_left_out_are_the_ones_of_the_seed,
           a_refusal_points_at_the_culprit, axes_that_are_none_are_refused, an_array_that_lies_is_refused,
           what_is_not_a_groom_document_is_refused, every_failed_allocation_is_answered, selected_strands_evaluate_to_the_same_bits)
