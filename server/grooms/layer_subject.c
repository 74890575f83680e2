/* What a layer is put on: a groom's revision, or strands that become one; and how it is written down. */
#include <stdlib.h>
#include <string.h>

#include "server/grooms/layer_edit.h"

/* --- open ------------------------------------------------------------------------------ */

static groom_status open_groom(struct subject *subject, const struct grooms_layer_edit *edit, struct groom_diag *diag)
{
    subject->edit = (struct edit){.grooms = subject->grooms, .groom_id = edit->groom_id, .expected = edit->expected,
                                  .note = groom_operator_name(edit->type), .diag = diag};
    subject->editing = true;
    groom_status status = edit_begin(&subject->edit);
    if (status == GROOM_OK)
        status = models_acquire(subject->grooms, edit->groom_id, subject->edit.expected, &subject->model, diag);
    if (status != GROOM_OK)
        return status;
    subject->groom = subject->model->groom;
    subject->keys = subject->model->keys;
    subject->head = subject->model->head;
    return GROOM_OK;
}

static groom_status check_head(const struct subject *subject, const struct wish *wish, struct groom_diag *diag)
{
    struct store_asset asset = {0};
    if (!wish->head)
        return GROOM_OK;
    groom_status status = store_asset_get(subject->grooms->options.store, subject->project, STORE_HEAD, wish->head, &asset, diag);
    store_asset_finish(&asset);
    if (status == GROOM_ENOTFOUND)
        return groom_fail_field(diag, GROOM_EINVAL, "/head", "there is no upload \"%.40s\"", wish->head);
    return status;
}

static groom_status open_upload(struct subject *subject, const struct grooms_layer_edit *edit, const struct wish *wish,
                                struct groom_diag *diag)
{
    char *name = NULL;
    groom_status status = check_head(subject, wish, diag);
    if (status == GROOM_OK)
        status = uploads_acquire(subject->grooms, edit->strands_id, &subject->upload, &name, diag);
    if (status == GROOM_OK)
        status = groom_create_of_strands(subject->upload->strands, &subject->grooms->context, &subject->own, diag);
    if (status == GROOM_OK) {
        strncpy(subject->own->name, name, sizeof subject->own->name - 1);
        strncpy(subject->own->base_strands, edit->strands_id, sizeof subject->own->base_strands - 1);
        memcpy(subject->upload_key[0], subject->upload->entry.key, STORE_HASH_SIZE);
        subject->keys = subject->upload_key;
        subject->groom = subject->own;
        subject->head = wish->head ? wish->head : "";
    }
    free(name);
    return status;
}

groom_status subject_open(struct grooms *grooms, const struct grooms_layer_edit *edit, const struct wish *wish,
                          struct subject *subject, struct groom_diag *diag)
{
    *subject = (struct subject){.project = edit->project, .grooms = grooms};
    return edit->groom_id ? open_groom(subject, edit, diag) : open_upload(subject, edit, wish, diag);
}

void subject_close(struct subject *subject)
{
    if (!subject->grooms) /* it was never opened */
        return;
    if (subject->editing)
        edit_finish(&subject->edit);
    models_release(subject->grooms, subject->model);
    states_release(subject->grooms->states, subject->upload);
    groom_destroy(subject->own);
}

/* --- the other side of an interpolation ----------------------------------------------------- */

static groom_status copy_strands(const struct groom_strands *from, struct groom_strands **to, struct groom_diag *diag)
{
    groom_status status = groom_strands_create(from->n_strands, from->n_vertices, NULL, to, diag);
    if (status == GROOM_OK) {
        memcpy((*to)->first, from->first, ((size_t)from->n_strands + 1) * sizeof *from->first);
        memcpy((*to)->points, from->points, from->n_vertices * sizeof *from->points);
    }
    return status;
}

static groom_status strands_of_upload(struct grooms *grooms, const char *id, struct groom_strands **strands,
                                      struct groom_diag *diag)
{
    struct state *state;
    char *name;
    groom_status status = uploads_acquire(grooms, id, &state, &name, diag);
    if (status != GROOM_OK)
        return status;
    status = copy_strands(state->strands, strands, diag);
    states_release(grooms->states, state);
    free(name);
    return status;
}

static groom_status strands_of_groom(struct grooms *grooms, const char *id, uint32_t *revision,
                                     struct groom_strands **strands, struct groom_diag *diag)
{
    struct grooms_dense dense = {0};
    groom_status status = grooms_dense(grooms, id, *revision, 0, &dense, diag);
    if (status != GROOM_OK)
        return status;
    *revision = dense.revision;
    *strands = dense.strands;
    dense.strands = NULL;
    grooms_dense_finish(&dense);
    return GROOM_OK;
}

groom_status subject_target(const struct subject *subject, const struct wish *wish, struct groom *groom, uint32_t index,
                            struct groom_diag *diag)
{
    struct groom_layer *layer = groom->operators[index].layer;
    const char *own = subject->editing ? subject->edit.groom_id : NULL, *id = wish->groom ? wish->groom : own;
    struct groom_strands *strands = NULL;
    uint32_t revision = wish->revision;
    groom_status status;
    if (!wish->groom && !wish->strands && !wish->revision)
        return layer->target ? GROOM_OK
                             : groom_fail_field(diag, GROOM_EINVAL, "/groom",
                                                "what is it to be blended with? Give \"groom\" (and \"revision\"), "
                                                "\"revision\" of the same groom, or \"strands\"");
    if (wish->strands && (wish->groom || wish->revision))
        return groom_fail_field(diag, GROOM_EINVAL, "/strands", "give a groom or strands, not both");
    if (!wish->strands && !id)
        return groom_fail_field(diag, GROOM_EINVAL, "/revision", "strands that were uploaded have no revisions");
    if ((wish->strands || wish->groom) &&
        (status = project_has(subject->grooms, subject->project, wish->strands ? wish->strands : wish->groom, diag)) !=
            GROOM_OK)
        goto missing;
    status = wish->strands ? strands_of_upload(subject->grooms, wish->strands, &strands, diag)
                           : strands_of_groom(subject->grooms, id, &revision, &strands, diag);
missing:
    if (status == GROOM_ENOTFOUND) {
        const char *pointer = wish->strands ? "/strands" : wish->groom ? "/groom" : "/revision";
        char detail[sizeof diag->detail];
        memcpy(detail, diag->detail, sizeof detail);
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "%s", detail);
    }
    if (status != GROOM_OK)
        return status;
    groom_strands_destroy(layer->target);
    layer->target = strands;
    strncpy(layer->target_id, wish->strands ? wish->strands : id, sizeof layer->target_id - 1);
    layer->target_revision = wish->strands ? 0 : revision;
    return GROOM_OK;
}

/* --- writing it down ---------------------------------------------------------------------------- */

static groom_status write_node(struct subject *subject, const struct groom *groom, uint32_t index, cJSON **tree,
                               char **text, struct groom_diag *diag)
{
    struct groom_array_keeper keeper = arrays_keeper(&subject->edit.arrays);
    char *written = NULL;
    size_t n_bytes;
    groom_status status = groom_document_operator_write(groom, index, &keeper, &written, &n_bytes, diag);
    if (status == GROOM_OK)
        status = documents_parse(written, n_bytes, tree, diag);
    free(written);
    if (status == GROOM_OK && !(*text = cJSON_PrintUnformatted(*tree))) {
        cJSON_Delete(*tree);
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a layer");
    }
    return status;
}

static groom_status write_revision(struct subject *subject, const struct groom *groom, uint32_t index, bool replaced,
                                   struct written *written, struct groom_diag *diag)
{
    cJSON *tree = NULL, *chain = cJSON_GetObjectItemCaseSensitive(subject->edit.document, "operators");
    groom_status status = write_node(subject, groom, index, &tree, &written->node, diag);
    if (status != GROOM_OK)
        return status;
    if (replaced ? !cJSON_ReplaceItemInArray(chain, (int)index, tree) : !cJSON_AddItemToArray(chain, tree)) {
        cJSON_Delete(tree);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a layer");
    }
    written->expected = subject->edit.expected;
    return edit_prepare_tree(&subject->edit, &written->text, &written->list, &written->next);
}

/* Of a new groom only its document tells under which key its strands are found. */
static groom_status note_keys(struct subject *subject, const char *document, struct groom_diag *diag)
{
    cJSON *tree = NULL;
    char(*keys)[STORE_HASH_SIZE] = NULL;
    groom_status status = documents_parse(document, strlen(document), &tree, diag);
    if (status == GROOM_OK && evaluate_keys(tree, &keys) != GROOM_OK)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for a groom");
    if (status == GROOM_OK)
        memcpy(subject->upload_key, keys, sizeof subject->upload_key);
    free(keys);
    cJSON_Delete(tree);
    return status;
}

static groom_status write_new(struct subject *subject, const struct groom *groom, const struct grooms_layer_edit *edit,
                              struct written *written, struct groom_diag *diag)
{
    const struct grooms_source source = {.strands = edit->strands_id, .head = *subject->head ? subject->head : NULL,
                                         .note = groom_operator_name(edit->type)};
    groom_status status = prepare_groom(subject->grooms, groom, "{}", 2, &source, &written->prepared, diag);
    if (status != GROOM_OK)
        return status;
    written->next = written->prepared.revision;
    written->next.groom_id = written->prepared.groom_id;
    written->next.project = edit->project;
    return note_keys(subject, written->next.document, diag);
}

groom_status subject_write(struct subject *subject, const struct groom *groom, uint32_t index, bool replaced,
                           const struct grooms_layer_edit *edit, struct written *written, struct groom_diag *diag)
{
    return subject->editing ? write_revision(subject, groom, index, replaced, written, diag)
                            : write_new(subject, groom, edit, written, diag);
}

void written_finish(struct written *written)
{
    cJSON_free(written->node);
    cJSON_free(written->text);
    free(written->list);
    grooms_prepared_finish(&written->prepared);
}
