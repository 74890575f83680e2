/* Edits in curvature space: a layer is read from the request, tried on the strands that come into it, and
 * written down as part of the chain. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "proto/json_text.h"
#include "server/grooms/layer_edit.h"

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* --- the body --------------------------------------------------------------------------- */

static groom_status refuse(struct layer_trial *trial, const char *pointer, const char *what)
{
    return groom_fail_field(trial->diag, GROOM_EINVAL, pointer, "%s", what);
}

static groom_status take_flag(struct layer_trial *trial, const char *name, bool *value)
{
    char pointer[32];
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(trial->control, name);
    snprintf(pointer, sizeof pointer, "/%s", name);
    if (item && !cJSON_IsBool(item))
        return refuse(trial, pointer, "this is true or false");
    *value = item ? cJSON_IsTrue(item) : *value;
    return GROOM_OK;
}

static groom_status take_number(struct layer_trial *trial, const char *name, uint32_t *value)
{
    char pointer[32];
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(trial->control, name);
    double number = cJSON_IsNumber(item) ? item->valuedouble : 0;
    snprintf(pointer, sizeof pointer, "/%s", name);
    if (!item || cJSON_IsNull(item))
        return GROOM_OK;
    if (!(number >= 1 && number < UINT32_MAX) || number > (double)(uint32_t)number)
        return refuse(trial, pointer, "a whole number from 1 is needed here");
    *value = (uint32_t)number;
    return GROOM_OK;
}

static groom_status take_text(struct layer_trial *trial, const char *name, const char **value)
{
    char pointer[32];
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(trial->control, name);
    snprintf(pointer, sizeof pointer, "/%s", name);
    if (item && !cJSON_IsNull(item) && !cJSON_IsString(item))
        return refuse(trial, pointer, "an id is needed here");
    *value = cJSON_GetStringValue(item);
    return GROOM_OK;
}

/* Which members are not the layer's. */
static const char *control_members(const struct layer_trial *trial)
{
    static const char *const names[2][2] = {
        {" commit points avoid_head head ", " layer commit points avoid_head "},
        {" commit points head groom revision strands ", " layer commit points groom revision strands "}};
    return names[trial->edit->type == GROOM_OPERATOR_INTERPOLATE][trial->edit->groom_id != NULL];
}

static void split_body(struct layer_trial *trial)
{
    for (cJSON *item = trial->body->child, *next; item; item = next) {
        char word[48];
        next = item->next;
        snprintf(word, sizeof word, " %.40s ", item->string);
        if (strstr(control_members(trial), word))
            cJSON_AddItemToObject(trial->control, item->string, cJSON_DetachItemViaPointer(trial->body, item));
    }
}

static groom_status parse_body(struct layer_trial *trial)
{
    struct json_text_error error;
    groom_status status;
    trial->body = json_text_parse(trial->edit->body, trial->edit->n_body, &error);
    if (!trial->body)
        return groom_fail_at(trial->diag, GROOM_EINVAL, error.byte_offset, "%s", error.detail);
    if (!cJSON_IsObject(trial->body))
        return groom_fail(trial->diag, GROOM_EINVAL, "the body is to be a JSON object");
    if (!(trial->control = cJSON_CreateObject()))
        return groom_fail(trial->diag, GROOM_ENOMEM, "no memory for the request");
    trial->wish = (struct wish){.commit = true, .avoid_head = true};
    split_body(trial);
    if ((status = take_flag(trial, "commit", &trial->wish.commit)) != GROOM_OK ||
        (status = take_flag(trial, "avoid_head", &trial->wish.avoid_head)) != GROOM_OK ||
        (status = take_number(trial, "layer", &trial->wish.layer)) != GROOM_OK ||
        (status = take_number(trial, "revision", &trial->wish.revision)) != GROOM_OK ||
        (status = take_text(trial, "head", &trial->wish.head)) != GROOM_OK ||
        (status = take_text(trial, "groom", &trial->wish.groom)) != GROOM_OK ||
        (status = take_text(trial, "strands", &trial->wish.strands)) != GROOM_OK)
        return status;
    trial->wish.points = !trial->wish.commit;
    return take_flag(trial, "points", &trial->wish.points);
}

/* --- the layer ----------------------------------------------------------------------------- */

static groom_status find_layer(struct layer_trial *trial)
{
    const struct groom *groom = trial->subject.groom;
    trial->index = groom->n_operators;
    if (trial->wish.layer == 0)
        return GROOM_OK;
    for (uint32_t i = 0; i < groom->n_operators; i++)
        if (groom->operators[i].id == trial->wish.layer) {
            if (groom->operators[i].type != trial->edit->type)
                return refuse(trial, "/layer", "the operator of this id is of another type");
            trial->index = i;
            trial->replaced = true;
            return GROOM_OK;
        }
    return refuse(trial, "/layer", "the chain has no operator of this id");
}

/* The node to read: what the layer was, with what the body changes; contact is found anew. */
static cJSON *merge(struct layer_trial *trial)
{
    const cJSON *chain = cJSON_GetObjectItemCaseSensitive(trial->subject.edit.document, "operators");
    cJSON *node = trial->replaced ? cJSON_Duplicate(cJSON_GetArrayItem(chain, (int)trial->index), 1) : cJSON_CreateObject();
    cJSON_DeleteItemFromObjectCaseSensitive(node, "contact");
    cJSON_DeleteItemFromObjectCaseSensitive(trial->body, "contact"); /* is found, not told */
    if (trial->contact)
        cJSON_AddItemToObject(node, "contact", cJSON_Duplicate(trial->contact, 1));
    cJSON_DeleteItemFromObjectCaseSensitive(node, "type");
    cJSON_AddStringToObject(node, "type", groom_operator_name(trial->edit->type));
    while (trial->body->child) {
        cJSON *item = cJSON_DetachItemViaPointer(trial->body, trial->body->child);
        char *name = strdup(item->string);
        cJSON_DeleteItemFromObjectCaseSensitive(node, name ? name : "");
        if (!name || !cJSON_AddItemToObject(node, name, item))
            cJSON_Delete(item);
        free(name);
    }
    return node;
}

/* "/operators/5/anchors/0/at" of the chain is "/anchors/0/at" of the body. */
static groom_status shorten(const struct layer_trial *trial, groom_status status)
{
    char prefix[32];
    int n = snprintf(prefix, sizeof prefix, "/operators/%u", trial->index);
    struct groom_diag *diag = trial->diag;
    if (status != GROOM_OK && strncmp(diag->pointer, prefix, (size_t)n) == 0)
        memmove(diag->pointer, diag->pointer + n, strlen(diag->pointer + n) + 1);
    return status;
}

static groom_status read_layer(struct layer_trial *trial)
{
    struct groom_array_finder finder = arrays_finder(&trial->subject.edit.arrays);
    groom_status status = find_layer(trial);
    if (status != GROOM_OK)
        return status;
    if (trial->edit->type != GROOM_OPERATOR_SCULPT)
        trial->wish.avoid_head = false;
    uint32_t without = trial->replaced ? trial->index : trial->subject.groom->n_operators;
    if ((status = groom_borrow(trial->subject.groom, without, &trial->work, trial->diag)) != GROOM_OK)
        return status;
    cJSON *node = merge(trial);
    char *text = cJSON_PrintUnformatted(node);
    cJSON_Delete(node);
    status = text ? groom_document_operator_read(text, strlen(text), &finder, &trial->work, trial->index, trial->diag)
                  : groom_fail(trial->diag, GROOM_ENOMEM, "no memory for the layer");
    cJSON_free(text);
    trial->borrowed = true;
    if (status != GROOM_OK) {
        groom_borrow_end(&trial->work, UINT32_MAX);
        trial->borrowed = false;
        return shorten(trial, status);
    }
    if (trial->edit->type == GROOM_OPERATOR_INTERPOLATE)
        return subject_target(&trial->subject, &trial->wish, &trial->work, trial->index, trial->diag);
    return GROOM_OK;
}

/* --- at work ------------------------------------------------------------------------------------- */

static groom_status take_before(struct layer_trial *trial)
{
    return evaluate_state(trial->grooms, trial->subject.groom, trial->subject.keys, trial->index, &trial->before,
                          trial->diag);
}

/* What an earlier try has kept, where it still serves. */
static groom_status take_input(struct layer_trial *trial)
{
    struct states *states = trial->grooms->states;
    trial->input = states_take_input(states, trial->before);
    if (trial->input && groom_layer_input_serves(trial->input, &trial->work, trial->index))
        return GROOM_OK;
    groom_layer_input_destroy(trial->input);
    trial->input = NULL;
    return groom_layer_input_create(&trial->work, trial->index, trial->before->strands, &trial->grooms->context,
                                    &trial->input, trial->diag);
}

static groom_status take_head(struct layer_trial *trial)
{
    if (!trial->wish.avoid_head || !*trial->subject.head ||
        project_has(trial->grooms, trial->edit->project, trial->subject.head, NULL) != GROOM_OK)
        return GROOM_OK; /* a document may name whatever head it likes */
    return heads_acquire(trial->grooms, trial->subject.head, &trial->head, trial->diag);
}

static groom_status apply(struct layer_trial *trial)
{
    groom_status status = take_input(trial);
    if (status == GROOM_OK)
        status = take_head(trial);
    if (status != GROOM_OK)
        return shorten(trial, status);
    status = trial->head
                 ? groom_layer_apply_outside(&trial->work, trial->index, trial->before->strands, trial->input,
                                             head_surface(trial->head), &trial->grooms->context, &trial->after,
                                             &trial->report, trial->diag)
                 : groom_layer_apply(&trial->work, trial->index, trial->before->strands, trial->input,
                                     &trial->grooms->context, &trial->after, &trial->report, trial->diag);
    return shorten(trial, status);
}

/* The strands behind the layer stay where an export finds them. */
static groom_status keep_after(struct layer_trial *trial, const char *node)
{
    char key[STORE_HASH_SIZE];
    struct state *state;
    if (node)
        evaluate_next_key(trial->subject.keys[trial->index], node, key);
    else
        memcpy(key, trial->subject.keys[1], sizeof key);
    struct groom_strands *strands = trial->after;
    trial->after = NULL;
    groom_status status = states_keep(trial->grooms->states, key, strands, &state);
    if (status == GROOM_OK)
        states_release(trial->grooms->states, state);
    return GROOM_OK; /* what could not be kept is computed again */
}

static groom_status answer(struct layer_trial *trial, struct grooms_layer_edited *edited)
{
    uint32_t n = trial->report.n_strands;
    const uint32_t *strands = trial->input ? groom_layer_input_strands(trial->input, &n) : NULL;
    const struct layer_answer reply = {.groom_id = edited->groom_id[0] ? edited->groom_id : NULL,
                                       .revision = edited->revision,
                                       .index = trial->index,
                                       .layer = trial->work.operators[trial->index].id,
                                       .type = trial->edit->type,
                                       .committed = trial->wish.commit,
                                       .has_head = trial->head != NULL || trial->report.contact.n_checked > 0,
                                       .seconds = now_s() - trial->started_s,
                                       .report = &trial->report,
                                       .after = trial->after,
                                       .strand = trial->wish.points ? strands : NULL,
                                       .n_strands = n};
    edited->json = layer_answer_text(&reply);
    edited->n_strands = n;
    return edited->json ? GROOM_OK : groom_fail(trial->diag, GROOM_ENOMEM, "no memory for the answer");
}

groom_status layer_trial_finish(struct layer_trial *trial, layer_trial_store store, void *user, struct grooms_layer_edited *edited)
{
    struct written written = {0};
    groom_status status = GROOM_OK;
    edited->end = trial->wish.commit ? GROOMS_EDITED : GROOMS_TRIED;
    if (trial->subject.editing) {
        strncpy(edited->groom_id, trial->edit->groom_id, sizeof edited->groom_id - 1);
        edited->revision = trial->subject.edit.expected + trial->wish.commit;
    }
    if (trial->wish.commit) {
        status = subject_write(&trial->subject, &trial->work, trial->index, trial->replaced, trial->edit, &written,
                               trial->diag);
        if (status == GROOM_OK && !trial->subject.editing) {
            strncpy(edited->groom_id, written.next.groom_id, sizeof edited->groom_id - 1);
            edited->revision = 1;
        }
    }
    if (status == GROOM_OK)
        status = answer(trial, edited);
    if (status == GROOM_OK && trial->wish.commit)
        status = store(user, &written.next, written.expected, edited->json, trial->diag);
    if (status == GROOM_OK && trial->wish.commit)
        status = keep_after(trial, written.node);
    written_finish(&written);
    return status;
}

/* --- too many for one request -------------------------------------------------------------------------------- */

/* What a job is to be given: the body as it came, and what it is for, at this revision. */
static groom_status hand_over(struct layer_trial *trial, struct grooms_layer_edited *edited)
{
    cJSON *inputs = cJSON_CreateObject();
    if (!trial->wish.commit) {
        cJSON_Delete(inputs);
        return groom_fail_field(trial->diag, GROOM_EINVAL, "/commit",
                                "%u strands are edited; at most %d can be tried on: more are a job's work",
                                edited->n_strands, GROOMS_EDIT_MOST_NOW);
    }
    edited->end = GROOMS_TOO_MANY;
    if (trial->subject.editing) {
        cJSON_AddStringToObject(inputs, "groom", trial->edit->groom_id);
        cJSON_AddNumberToObject(inputs, "revision", trial->subject.edit.expected);
    } else {
        cJSON_AddStringToObject(inputs, "strands", trial->edit->strands_id);
    }
    if (*trial->subject.head && trial->wish.avoid_head)
        cJSON_AddStringToObject(inputs, "head", trial->subject.head);
    edited->inputs = cJSON_PrintUnformatted(inputs);
    edited->json = strndup(trial->edit->body, trial->edit->n_body);
    cJSON_Delete(inputs);
    return edited->inputs && edited->json ? GROOM_OK : groom_fail(trial->diag, GROOM_ENOMEM, "no memory for a job");
}

/* --- the edit ------------------------------------------------------------------------------------------ */

void layer_trial_end(struct layer_trial *trial)
{
    if (trial->before && trial->input)
        states_give_input(trial->grooms->states, trial->before, trial->input);
    states_release(trial->grooms->states, trial->before);
    heads_release(trial->grooms, trial->head);
    groom_strands_destroy(trial->after);
    if (trial->borrowed)
        groom_borrow_end(&trial->work, trial->index);
    subject_close(&trial->subject);
    cJSON_Delete(trial->body);
    cJSON_Delete(trial->control);
}

groom_status layer_trial_begin(struct layer_trial *trial)
{
    groom_status status;
    trial->started_s = now_s();
    if ((status = parse_body(trial)) != GROOM_OK ||
        (status = subject_open(trial->grooms, trial->edit, &trial->wish, &trial->subject, trial->diag)) != GROOM_OK ||
        (status = read_layer(trial)) != GROOM_OK)
        return status;
    return take_before(trial);
}

static groom_status store_now(void *user, const struct store_revision_new *next, uint32_t expected, const char *answer,
                              struct groom_diag *diag)
{
    struct layer_trial *trial = user;
    (void)answer;
    return expected ? store_revision_add(trial->grooms->options.store, next, expected, diag)
                    : store_groom_create(trial->grooms->options.store, next, diag);
}

static groom_status run(struct layer_trial *trial, struct grooms_layer_edited *edited)
{
    uint32_t n = 0;
    groom_status status = layer_trial_begin(trial);
    if (status != GROOM_OK)
        return status;
    status = groom_layer_count(&trial->work, trial->index, trial->before->strands, &trial->grooms->context, &n, trial->diag);
    if (status != GROOM_OK)
        return shorten(trial, status);
    edited->n_strands = n;
    if (n > GROOMS_EDIT_MOST_NOW)
        return hand_over(trial, edited);
    status = apply(trial);
    return status == GROOM_OK ? layer_trial_finish(trial, store_now, trial, edited) : status;
}

groom_status grooms_edit_layer(struct grooms *grooms, const struct grooms_layer_edit *edit,
                               struct grooms_layer_edited *out, struct groom_diag *diag)
{
    struct layer_trial trial = {.grooms = grooms, .edit = edit, .diag = diag};
    struct grooms_layer_edited edited = {0};
    groom_status status = run(&trial, &edited);
    layer_trial_end(&trial);
    if (status == GROOM_OK)
        *out = edited;
    else
        grooms_layer_edited_finish(&edited);
    return status;
}

void grooms_layer_edited_finish(struct grooms_layer_edited *edited)
{
    free(edited->json);
    free(edited->inputs);
    *edited = (struct grooms_layer_edited){0};
}
