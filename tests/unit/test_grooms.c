/* Grooms of the daemon: revisions, edits, exports, on a real store in a temporary folder. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cjson/cJSON.h>

#include "groom/document.h"
#include "server/grooms/grooms.h"
#include "server/store/store.h"
#include "tests/support/grooms.h"
#include "tests/support/test.h"

#define N_STRANDS 60
#define N_VERTICES 10

struct fixture {
    char folder[64], path[128];
    struct store *store;
    struct grooms *grooms;
    char id[STORE_ID_SIZE];
};

/* An array of nobody's, in a member around the model. */
#define SEEN "{\"depth\":{\"dtype\":\"f32\",\"shape\":[2],\"data\":\"AACAPwAAAEA=\"}}"

static char *document_text(void)
{
    struct groom *groom = test_groom((struct groom_shape){N_STRANDS, N_VERTICES, 8, 4, 3}, 5);
    char *json;
    size_t n;
    test_append_all_operators(groom, 5);
    strcpy(groom->name, "first");
    ck_ok(groom_document_write(groom, "{\"fit\":{\"note\":\"kept\"},\"id\":\"grm_of_another_server\",\"seen\":" SEEN "}", NULL, &json,
                               &n, NULL));
    groom_destroy(groom);
    return json;
}

static void set_up(struct fixture *fixture)
{
    struct groom_diag diag = {0};
    strcpy(fixture->folder, "/tmp/groom-test-XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(fixture->folder));
    snprintf(fixture->path, sizeof fixture->path, "%s/groomd.db", fixture->folder);
    ck_ok(store_open(fixture->path, &fixture->store, &diag));
    struct grooms_options options = {
        .store = fixture->store, .worker_path = "/nonexistent", .temporary_folder = fixture->folder};
    ck_ok(grooms_create(&options, &fixture->grooms, &diag));
    char *json = document_text();
    ck_ok(grooms_import(fixture->grooms, NULL, json, strlen(json), fixture->id, &diag));
    free(json);
}

static void tear_down(struct fixture *fixture)
{
    char command[128];
    grooms_destroy(fixture->grooms);
    store_close(fixture->store);
    snprintf(command, sizeof command, "rm -r %s", fixture->folder);
    ck_assert_int_eq(system(command), 0);
}

static cJSON *get(const struct fixture *fixture, uint32_t revision, bool arrays)
{
    char *json;
    size_t n;
    uint32_t number;
    ck_ok(grooms_document(fixture->grooms, fixture->id, revision, arrays, &json, &n, &number, NULL));
    cJSON *document = cJSON_Parse(json);
    free(json);
    return document;
}

static double number_at(const cJSON *document, int op, const char *name)
{
    return cJSON_GetObjectItem(cJSON_GetArrayItem(cJSON_GetObjectItem(document, "operators"), op), name)->valuedouble;
}

static groom_status patch(struct fixture *fixture, uint32_t expected, const char *text, struct groom_diag *diag)
{
    uint32_t number = 0;
    groom_status status = grooms_patch(fixture->grooms, fixture->id, expected, GROOMS_JSON_PATCH, text, strlen(text),
                                       &number, diag);
    if (status == GROOM_OK)
        ck_assert_uint_eq(number, expected + 1);
    return status;
}

/* --- dense strands in memory ------------------------------------------------------------- */

struct memory {
    char bytes[1 << 16];
    size_t n;
};

static groom_status write_memory(void *user, const void *bytes, size_t n)
{
    struct memory *memory = user;
    ck_assert(memory->n + n <= sizeof memory->bytes);
    memcpy(memory->bytes + memory->n, bytes, n);
    memory->n += n;
    return GROOM_OK;
}

static void export(struct fixture *fixture, uint32_t revision, uint32_t count, struct memory *memory)
{
    struct grooms_export what = {.revision = revision, .count = count, .write = {.format = GROOM_FORMAT_DATA}};
    memory->n = 0;
    ck_ok(grooms_write_strands(fixture->grooms, fixture->id, &what, (struct groom_sink){write_memory, memory}, NULL));
}

/* --- tests --------------------------------------------------------------------------------- */

START_TEST(an_imported_document_has_a_new_identity_and_keeps_the_rest)
{
    struct fixture fixture;
    set_up(&fixture);
    cJSON *document = get(&fixture, 0, false);
    ck_assert_str_eq(cJSON_GetObjectItem(document, "id")->valuestring, fixture.id);
    ck_assert_int_eq(cJSON_GetObjectItem(document, "revision")->valueint, 1);
    ck_assert(cJSON_IsNull(cJSON_GetObjectItem(document, "parent")));
    ck_assert_str_eq(cJSON_GetObjectItem(cJSON_GetObjectItem(document, "fit"), "note")->valuestring, "kept");
    cJSON_Delete(document);
    tear_down(&fixture);
}
END_TEST

START_TEST(a_document_got_and_imported_again_gives_the_same_strands)
{
    struct fixture fixture;
    struct memory first, second;
    char *json;
    size_t n;
    uint32_t number;
    set_up(&fixture);
    export(&fixture, 0, 0, &first);
    ck_ok(grooms_document(fixture.grooms, fixture.id, 0, true, &json, &n, &number, NULL));
    ck_ok(grooms_import(fixture.grooms, NULL, json, n, fixture.id, NULL));
    export(&fixture, 0, 0, &second);
    ck_assert_uint_eq(first.n, second.n);
    ck_assert_mem_eq(first.bytes, second.bytes, first.n);
    free(json);
    tear_down(&fixture);
}
END_TEST

START_TEST(a_patch_makes_a_revision_and_leaves_the_one_before)
{
    struct fixture fixture;
    struct memory before, after, again;
    set_up(&fixture);
    export(&fixture, 1, 0, &before);
    ck_ok(patch(&fixture, 1, "[{\"op\":\"replace\",\"path\":\"/operators/2/radius\",\"value\":0.0125},"
                             "{\"op\":\"replace\",\"path\":\"/name\",\"value\":\"tighter\"}]", NULL));
    cJSON *document = get(&fixture, 0, false);
    ck_assert_double_eq_tol(number_at(document, 2, "radius"), 0.0125, 1e-9);
    ck_assert_int_eq(cJSON_GetObjectItem(document, "revision")->valueint, 2);
    ck_assert_int_eq(cJSON_GetObjectItem(document, "parent")->valueint, 1);
    ck_assert_str_eq(cJSON_GetObjectItem(document, "name")->valuestring, "tighter");
    cJSON_Delete(document);
    export(&fixture, 2, 0, &after);
    export(&fixture, 1, 0, &again);
    ck_assert_mem_ne(before.bytes, after.bytes, before.n);
    ck_assert_mem_eq(before.bytes, again.bytes, before.n);
    tear_down(&fixture);
}
END_TEST

START_TEST(operators_are_added_moved_and_removed)
{
    struct fixture fixture;
    set_up(&fixture);
    ck_ok(patch(&fixture, 1, "[{\"op\":\"add\",\"path\":\"/operators/-\",\"value\":{\"type\":\"frizz\",\"amplitude\":0.002}}]", NULL));
    ck_ok(patch(&fixture, 2, "[{\"op\":\"move\",\"from\":\"/operators/5\",\"path\":\"/operators/0\"}]", NULL));
    cJSON *document = get(&fixture, 0, false);
    ck_assert_double_eq_tol(number_at(document, 0, "amplitude"), 0.002, 1e-9);
    cJSON_Delete(document);
    ck_ok(patch(&fixture, 3, "[{\"op\":\"remove\",\"path\":\"/operators/0\"}]", NULL));
    struct memory first, last;
    export(&fixture, 1, 0, &first);
    export(&fixture, 4, 0, &last);
    ck_assert_mem_eq(first.bytes, last.bytes, first.n);
    tear_down(&fixture);
}
END_TEST

START_TEST(another_seed_draws_other_numbers)
{
    struct fixture fixture;
    struct memory before, after;
    set_up(&fixture);
    export(&fixture, 1, 0, &before);
    ck_ok(patch(&fixture, 1, "[{\"op\":\"replace\",\"path\":\"/operators/1/seed\",\"value\":99}]", NULL));
    export(&fixture, 2, 0, &after);
    ck_assert_mem_ne(before.bytes, after.bytes, before.n);
    tear_down(&fixture);
}
END_TEST

START_TEST(a_merge_patch_renames)
{
    struct fixture fixture;
    uint32_t number = 0;
    const char *text = "{\"name\":\"other\",\"tags\":[\"a\"]}";
    set_up(&fixture);
    ck_ok(grooms_patch(fixture.grooms, fixture.id, 1, GROOMS_MERGE_PATCH, text, strlen(text), &number, NULL));
    cJSON *document = get(&fixture, 0, false);
    ck_assert_str_eq(cJSON_GetObjectItem(document, "name")->valuestring, "other");
    ck_assert_int_eq(cJSON_GetArraySize(cJSON_GetObjectItem(document, "tags")), 1);
    cJSON_Delete(document);
    tear_down(&fixture);
}
END_TEST

START_TEST(a_patch_that_is_late_or_wrong_changes_nothing)
{
    struct fixture fixture;
    struct groom_diag diag = {0};
    static const struct {
        const char *text, *pointer;
    } bad[] = {
        {"[{\"op\":\"replace\",\"path\":\"/operators/2/radius\",\"value\":-1}]", "/operators/2/radius"},
        {"[{\"op\":\"replace\",\"path\":\"/id\",\"value\":\"grm_x\"}]", "/id"},
        {"[{\"op\":\"remove\",\"path\":\"/source\"}]", NULL},
        {"[{\"op\":\"replace\",\"path\":\"/revision\",\"value\":7}]", "/revision"},
        {"[{\"op\":\"add\",\"path\":\"/operators/9\",\"value\":{\"type\":\"frizz\"}}]", NULL},
        {"[{\"op\":\"replace\",\"path\":\"/strands\",\"value\":1}]", "/strands/roots"},
        {"[{\"op\":\"replace\",\"path\":\"/strands/roots/$array\",\"value\":\"00\"}]", "/strands/roots"},
        {"[{\"op\":\"replace\",\"path\":\"\",\"value\":[]}]", NULL},
        {"{}", NULL},
        {"[", NULL},
    };
    set_up(&fixture);
    ck_status(patch(&fixture, 2, "[]", &diag), GROOM_ECONFLICT);
    ck_assert_str_eq(diag.pointer, "");
    ck_status(patch(&fixture, 1, "[{\"op\":\"test\",\"path\":\"/name\",\"value\":\"not this\"}]", &diag), GROOM_ECONFLICT);
    ck_assert_str_eq(diag.pointer, "/0/value");
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        groom_status status = patch(&fixture, 1, bad[i].text, &diag);
        ck_assert_msg(status == GROOM_EINVAL, "%s: %s", bad[i].text, groom_status_name(status));
        if (bad[i].pointer)
            ck_assert_str_eq(diag.pointer, bad[i].pointer);
        ck_assert(diag.detail[0]);
    }
    cJSON *document = get(&fixture, 0, false);
    ck_assert_int_eq(cJSON_GetObjectItem(document, "revision")->valueint, 1);
    cJSON_Delete(document);
    tear_down(&fixture);
}
END_TEST

START_TEST(guides_are_replaced_one_for_one)
{
    struct fixture fixture;
    struct groom_strands *guides;
    struct groom_diag diag = {0};
    uint32_t number = 0;
    set_up(&fixture);
    ck_ok(groom_strands_create(8, 16, NULL, &guides, NULL));
    for (uint32_t i = 0; i < 8; i++) {
        guides->first[i + 1] = 2 * (i + 1);
        for (int j = 0; j < 2; j++)
            memcpy(guides->points[2 * i + (uint32_t)j], (float[]){0.01f * (float)i, 1.0f + 0.1f * (float)j, 0.0f}, 12);
    }
    ck_ok(grooms_set_guides(fixture.grooms, fixture.id, 1, guides, &number, &diag));
    ck_assert_uint_eq(number, 2);
    guides->n_strands = 7;
    ck_status(grooms_set_guides(fixture.grooms, fixture.id, 2, guides, &number, &diag), GROOM_EINVAL);
    guides->n_strands = 8;
    groom_strands_destroy(guides);

    struct memory memory = {.n = 0};
    struct grooms_export what = {.write = {.format = GROOM_FORMAT_DATA}};
    ck_ok(grooms_write_guides(fixture.grooms, fixture.id, &what, (struct groom_sink){write_memory, &memory}, NULL));
    ck_assert_uint_eq(memory.n, 4 + 8 * (4 + N_VERTICES * 12));
    tear_down(&fixture);
}
END_TEST

START_TEST(revert_brings_back_what_was)
{
    struct fixture fixture;
    struct memory first, reverted;
    struct groom_diag diag = {0};
    uint32_t number = 0;
    char *json;
    set_up(&fixture);
    export(&fixture, 1, 0, &first);
    ck_ok(patch(&fixture, 1, "[{\"op\":\"remove\",\"path\":\"/operators/4\"}]", NULL));
    ck_ok(grooms_revert(fixture.grooms, fixture.id, 2, 1, &number, &diag));
    ck_assert_uint_eq(number, 3);
    export(&fixture, 0, 0, &reverted);
    ck_assert_mem_eq(first.bytes, reverted.bytes, first.n);
    ck_status(grooms_revert(fixture.grooms, fixture.id, 3, 9, &number, &diag), GROOM_ENOTFOUND);
    ck_ok(grooms_revisions_json(fixture.grooms, fixture.id, (struct store_page){0}, &json, &diag));
    cJSON *revisions = cJSON_Parse(json);
    ck_assert_int_eq(cJSON_GetArraySize(cJSON_GetObjectItem(revisions, "revisions")), 3);
    cJSON_Delete(revisions);
    free(json);
    tear_down(&fixture);
}
END_TEST

START_TEST(fewer_strands_are_a_part_of_more)
{
    struct fixture fixture;
    struct memory all, some, few;
    const size_t strand = 4 + N_VERTICES * 12;
    struct grooms_export too_many = {.count = N_STRANDS + 1, .write = {.format = GROOM_FORMAT_DATA}};
    set_up(&fixture);
    export(&fixture, 0, 0, &all);
    export(&fixture, 0, 30, &some);
    export(&fixture, 0, 10, &few);
    ck_assert_uint_eq(all.n, 4 + N_STRANDS * strand);
    ck_assert_uint_eq(some.n, 4 + 30 * strand);
    for (int i = 0; i < 30; i++)
        ck_assert_ptr_nonnull(memmem(all.bytes, all.n, some.bytes + 4 + (size_t)i * strand, strand));
    for (int i = 0; i < 10; i++)
        ck_assert_ptr_nonnull(memmem(some.bytes, some.n, few.bytes + 4 + (size_t)i * strand, strand));
    ck_status(grooms_write_strands(fixture.grooms, fixture.id, &too_many,
                                   (struct groom_sink){write_memory, &all}, NULL), GROOM_EINVAL);
    tear_down(&fixture);
}
END_TEST

START_TEST(revisions_share_the_arrays_that_they_do_not_change)
{
    struct fixture fixture;
    set_up(&fixture);
    FILE *file = fopen(fixture.path, "rb");
    ck_assert_ptr_nonnull(file);
    fclose(file);
    for (uint32_t i = 1; i <= 20; i++) {
        char text[128];
        snprintf(text, sizeof text, "[{\"op\":\"replace\",\"path\":\"/operators/2/radius\",\"value\":%g}]", 0.001 * i);
        ck_ok(patch(&fixture, i, text, NULL));
    }
    cJSON *first = get(&fixture, 1, true), *last = get(&fixture, 21, true);
    ck_assert(cJSON_Compare(cJSON_GetObjectItem(first, "guides"), cJSON_GetObjectItem(last, "guides"), 1));
    cJSON_Delete(first);
    cJSON_Delete(last);
    struct store_revision row = {0};
    ck_ok(store_revision_get(fixture.store, fixture.id, 21, &row, NULL));
    ck_assert_uint_lt(strlen(row.document), 4000);
    ck_assert_ptr_null(strstr(row.document, "\"data\""));
    cJSON *whole = get(&fixture, 21, true), *seen = cJSON_Parse(SEEN); /* so do those that the model does not know */
    ck_assert(cJSON_Compare(cJSON_GetObjectItem(whole, "seen"), seen, 1));
    cJSON_Delete(whole);
    cJSON_Delete(seen);
    store_revision_finish(&row);
    tear_down(&fixture);
}
END_TEST

TEST_SUITE("grooms", an_imported_document_has_a_new_identity_and_keeps_the_rest,
           a_document_got_and_imported_again_gives_the_same_strands,
           a_patch_makes_a_revision_and_leaves_the_one_before, operators_are_added_moved_and_removed,
           another_seed_draws_other_numbers, a_merge_patch_renames, a_patch_that_is_late_or_wrong_changes_nothing,
           guides_are_replaced_one_for_one, revert_brings_back_what_was, fewer_strands_are_a_part_of_more,
           revisions_share_the_arrays_that_they_do_not_change)
