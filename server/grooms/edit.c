/* Edits: each reads the latest revision, changes it, and adds the next. */
#include <stdlib.h>
#include <string.h>

#include "proto/json_patch.h"
#include "proto/json_text.h"
#include "server/grooms/room.h"

groom_status edit_begin(struct edit *edit)
{
    groom_status status = documents_load(edit->grooms, edit->groom_id, 0, &edit->revision, &edit->document, edit->diag);
    arrays_init(&edit->arrays, edit->grooms->options.store);
    if (status != GROOM_OK)
        return status;
    if (edit->expected == 0)
        edit->expected = edit->revision.number;
    if (edit->revision.number != edit->expected)
        return groom_fail(edit->diag, GROOM_ECONFLICT,
                          "the groom is at revision %u by now, not %u: get it again and repeat the edit",
                          edit->revision.number, edit->expected);
    return arrays_allow(&edit->arrays, edit->document);
}

void edit_finish(struct edit *edit)
{
    cJSON_Delete(edit->document);
    arrays_finish(&edit->arrays);
    store_revision_finish(&edit->revision);
}

/* Read the model of a document's tree, whose arrays are inline or among the edit's. */
static groom_status edit_decode(struct edit *edit, const cJSON *document, struct groom **groom)
{
    struct groom_array_finder finder = arrays_finder(&edit->arrays);
    char *text = cJSON_PrintUnformatted(document);
    if (!text)
        return groom_fail(edit->diag, GROOM_ENOMEM, "no memory for the groom document");
    groom_status status =
        groom_document_read(text, strlen(text), &finder, &edit->grooms->context, groom, edit->diag);
    free(text);
    return status;
}

static groom_status print_around(struct edit *edit, cJSON *document, char **around)
{
    documents_strip_model(document);
    arrays_use(&edit->arrays, document);
    if (documents_set_number(document, "revision", edit->expected + 1) != GROOM_OK ||
        documents_set_number(document, "parent", edit->expected) != GROOM_OK ||
        !(*around = cJSON_PrintUnformatted(document)))
        return groom_fail(edit->diag, GROOM_ENOMEM, "no memory for the groom document");
    return GROOM_OK;
}

static groom_status store_next(struct edit *edit, const struct groom *groom, const char *around)
{
    struct groom_array_keeper keeper = arrays_keeper(&edit->arrays);
    struct store_revision_new next = {.groom_id = edit->groom_id, .name = groom->name, .note = edit->note};
    struct store_array *list = NULL;
    char *document = NULL;
    size_t n_bytes;
    groom_status status = groom_document_write(groom, around, &keeper, &document, &n_bytes, edit->diag);
    if (status == GROOM_OK)
        status = arrays_list(&edit->arrays, &list, &next.n_arrays);
    if (status == GROOM_OK) {
        next.document = document;
        next.arrays = list;
        status = store_revision_add(edit->grooms->options.store, &next, edit->expected, edit->diag);
    }
    free(document);
    free(list);
    return status;
}

/* The next revision: this model with these members around it. `document` is taken apart. */
static groom_status edit_commit(struct edit *edit, const struct groom *groom, cJSON *document, uint32_t *number)
{
    char *around = NULL;
    groom_status status = print_around(edit, document, &around);
    if (status == GROOM_OK)
        status = store_next(edit, groom, around);
    if (status == GROOM_OK)
        *number = edit->expected + 1;
    free(around);
    return status;
}

groom_status edit_prepare_tree(struct edit *edit, char **text, struct store_array **list,
                               struct store_revision_new *next)
{
    const cJSON *name = cJSON_GetObjectItemCaseSensitive(edit->document, "name");
    *next = (struct store_revision_new){.groom_id = edit->groom_id, .note = edit->note, .name = edit->revision.name};
    if (cJSON_IsString(name))
        next->name = name->valuestring;
    if (documents_set_number(edit->document, "revision", edit->expected + 1) != GROOM_OK ||
        documents_set_number(edit->document, "parent", edit->expected) != GROOM_OK ||
        !(*text = cJSON_PrintUnformatted(edit->document)))
        return groom_fail(edit->diag, GROOM_ENOMEM, "no memory for the groom document");
    arrays_use(&edit->arrays, edit->document);
    next->document = *text;
    groom_status status = arrays_list(&edit->arrays, list, &next->n_arrays);
    next->arrays = *list;
    return status;
}

/* --- patches --------------------------------------------------------------------------- */

static groom_status parse_patch(const char *text, size_t n_bytes, cJSON **patch, struct groom_diag *diag)
{
    struct json_text_error error;
    *patch = json_text_parse(text, n_bytes, &error);
    return *patch ? GROOM_OK : groom_fail_at(diag, GROOM_EINVAL, error.byte_offset, "the patch: %s", error.detail);
}

static groom_status apply_json_patch(const cJSON *document, const cJSON *patch, cJSON **patched,
                                     struct groom_diag *diag)
{
    struct json_patch_error error;
    switch (json_patch_apply(document, patch, patched, &error)) {
    case JSON_PATCH_OK:
        return GROOM_OK;
    case JSON_PATCH_NO_MEMORY:
        return groom_fail(diag, GROOM_ENOMEM, "no memory to apply the patch");
    case JSON_PATCH_TEST: /* the state is not what the patch is for (RFC 5789, 2.2) */
        return groom_fail_field(diag, GROOM_ECONFLICT, error.pointer, "%s", error.detail);
    default:
        return groom_fail_field(diag, GROOM_EINVAL, error.pointer, "%s", error.detail);
    }
}

static groom_status apply_patch(const struct edit *edit, enum grooms_patch_kind kind, const char *text,
                                size_t n_bytes, cJSON **patched)
{
    cJSON *patch;
    groom_status status = parse_patch(text, n_bytes, &patch, edit->diag);
    if (status != GROOM_OK)
        return status;
    if (kind == GROOMS_JSON_PATCH) {
        status = apply_json_patch(edit->document, patch, patched, edit->diag);
    } else if (!cJSON_IsObject(patch)) {
        status = groom_fail(edit->diag, GROOM_EINVAL, "a merge patch is a JSON object");
    } else {
        *patched = json_merge_patch(edit->document, patch);
        status = *patched ? GROOM_OK : groom_fail(edit->diag, GROOM_ENOMEM, "no memory to apply the patch");
    }
    cJSON_Delete(patch);
    return status;
}

/* What names the groom and where it came from is the server's. */
static groom_status refuse_protected(const struct edit *edit, const cJSON *patched)
{
    static const char *const members[] = {"format", "unit", "id", "revision", "parent", "source"};
    if (!cJSON_IsObject(patched))
        return groom_fail(edit->diag, GROOM_EINVAL, "the patch leaves no groom document");
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
        const cJSON *before = cJSON_GetObjectItemCaseSensitive(edit->document, members[i]);
        const cJSON *after = cJSON_GetObjectItemCaseSensitive(patched, members[i]);
        if (!before != !after || (before && !json_equal(before, after))) {
            char pointer[32] = "/";
            strcat(pointer, members[i]);
            return groom_fail_field(edit->diag, GROOM_EINVAL, pointer, "%s cannot be changed by a patch", members[i]);
        }
    }
    return GROOM_OK;
}

static const cJSON *operator_with_id(const cJSON *document, const cJSON *id)
{
    const cJSON *chain = cJSON_GetObjectItemCaseSensitive(document, "operators"), *op;
    cJSON_ArrayForEach(op, chain)
    {
        const cJSON *other = cJSON_GetObjectItemCaseSensitive(op, "id");
        if (cJSON_IsNumber(id) && cJSON_IsNumber(other) && id->valuedouble == other->valuedouble)
            return op;
    }
    return NULL;
}

static bool same_member(const cJSON *a, const cJSON *b, const char *name)
{
    const cJSON *x = cJSON_GetObjectItemCaseSensitive(a, name), *y = cJSON_GetObjectItemCaseSensitive(b, name);
    return x && y ? json_equal(x, y) : x == y;
}

/* A new seed with the old numbers would change nothing, which nobody means: leave the numbers out, so
 * that reading the document draws them. */
static void redraw_where_seed_changed(const cJSON *before, cJSON *after)
{
    cJSON *chain = cJSON_GetObjectItemCaseSensitive(after, "operators"), *op;
    cJSON_ArrayForEach(op, chain)
    {
        const cJSON *old = operator_with_id(before, cJSON_GetObjectItemCaseSensitive(op, "id"));
        if (old && !same_member(old, op, "seed") && same_member(old, op, "random"))
            cJSON_DeleteItemFromObjectCaseSensitive(op, "random");
    }
}

groom_status grooms_patch(struct grooms *grooms, const char *groom_id, uint32_t expected,
                          enum grooms_patch_kind kind, const char *patch, size_t n_bytes, uint32_t *number,
                          struct groom_diag *diag)
{
    struct edit edit = {.grooms = grooms, .groom_id = groom_id, .expected = expected, .note = "patch", .diag = diag};
    cJSON *patched = NULL;
    struct groom *groom = NULL;
    groom_status status;
    if ((status = edit_begin(&edit)) != GROOM_OK ||
        (status = apply_patch(&edit, kind, patch, n_bytes, &patched)) != GROOM_OK ||
        (status = refuse_protected(&edit, patched)) != GROOM_OK)
        goto out;
    redraw_where_seed_changed(edit.document, patched);
    if ((status = edit_decode(&edit, patched, &groom)) == GROOM_OK)
        status = edit_commit(&edit, groom, patched, number);
out:
    groom_destroy(groom);
    cJSON_Delete(patched);
    edit_finish(&edit);
    return status;
}

/* --- guides -------------------------------------------------------------------------------- */

static groom_status replace_guides(struct groom *groom, const struct groom_strands *guides,
                                   const struct groom_context *context, struct groom_diag *diag)
{
    if (groom->n_guides == 0)
        return groom_fail(diag, GROOM_EINVAL, "this groom is made of uploaded strands: it has no guides to replace");
    if (guides->n_strands != groom->n_guides)
        return groom_fail(diag, GROOM_EINVAL,
                          "%u strands were sent and the groom has %u guides: send as many, in the same order",
                          guides->n_strands, groom->n_guides);
    return groom_strands_resample(guides, groom->n_vertices, groom->guides, context, diag);
}

groom_status grooms_set_guides(struct grooms *grooms, const char *groom_id, uint32_t expected,
                               const struct groom_strands *guides, uint32_t *number, struct groom_diag *diag)
{
    struct edit edit = {.grooms = grooms, .groom_id = groom_id, .expected = expected, .note = "guides", .diag = diag};
    struct groom *groom = NULL;
    groom_status status;
    if ((status = edit_begin(&edit)) == GROOM_OK &&
        (status = edit_decode(&edit, edit.document, &groom)) == GROOM_OK &&
        (status = replace_guides(groom, guides, &grooms->context, diag)) == GROOM_OK &&
        (status = groom_validate(groom, diag)) == GROOM_OK)
        status = edit_commit(&edit, groom, edit.document, number);
    groom_destroy(groom);
    edit_finish(&edit);
    return status;
}

/* --- back to an earlier revision -------------------------------------------------------------- */

groom_status grooms_revert(struct grooms *grooms, const char *groom_id, uint32_t expected, uint32_t revision,
                           uint32_t *number, struct groom_diag *diag)
{
    struct edit edit = {.grooms = grooms, .groom_id = groom_id, .expected = expected, .note = "revert", .diag = diag};
    struct store_revision earlier = {0};
    cJSON *document = NULL;
    struct groom *groom = NULL;
    groom_status status;
    if (revision == 0)
        return groom_fail_field(diag, GROOM_EINVAL, "/revision", "revisions are counted from 1");
    if ((status = edit_begin(&edit)) == GROOM_OK &&
        (status = documents_load(grooms, groom_id, revision, &earlier, &document, diag)) == GROOM_OK &&
        (status = arrays_allow(&edit.arrays, document)) == GROOM_OK &&
        (status = edit_decode(&edit, document, &groom)) == GROOM_OK)
        status = edit_commit(&edit, groom, document, number);
    groom_destroy(groom);
    cJSON_Delete(document);
    store_revision_finish(&earlier);
    edit_finish(&edit);
    return status;
}
