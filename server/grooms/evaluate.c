/* Chains with layers: what comes out of each place is kept under the hash of all that it comes from. */
#include <stdlib.h>
#include <string.h>

#include "server/grooms/room.h"
#include "server/jobs/work.h"

/* --- keys ------------------------------------------------------------------------------ */

void evaluate_next_key(const char *key, const char *operator_json, char next[STORE_HASH_SIZE])
{
    size_t n = strlen(operator_json);
    char *both = malloc(STORE_HASH_SIZE + n);
    if (!both) { /* a key that nothing else has */
        memcpy(next, "none", 5);
        return;
    }
    memcpy(both, key, STORE_HASH_SIZE - 1);
    memcpy(both + STORE_HASH_SIZE - 1, operator_json, n + 1);
    work_hash(both, STORE_HASH_SIZE - 1 + n, next);
    free(both);
}

/* Where strands come from: references to arrays stand for what is in them. */
static groom_status source_key(const cJSON *document, char key[STORE_HASH_SIZE])
{
    static const char *const members[] = {"strands", "guides", "instancing", "operator_guides", "base", "axes"};
    memset(key, '0', STORE_HASH_SIZE - 1);
    key[STORE_HASH_SIZE - 1] = 0;
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
        const cJSON *item = cJSON_GetObjectItemCaseSensitive(document, members[i]);
        char *text = item ? cJSON_PrintUnformatted(item) : NULL, before[STORE_HASH_SIZE];
        if (item && !text)
            return GROOM_ENOMEM;
        memcpy(before, key, sizeof before);
        evaluate_next_key(before, text ? text : "", key);
        cJSON_free(text);
    }
    return GROOM_OK;
}

groom_status evaluate_keys(const cJSON *document, char (**out)[STORE_HASH_SIZE])
{
    const cJSON *chain = cJSON_GetObjectItemCaseSensitive(document, "operators"), *op;
    char(*keys)[STORE_HASH_SIZE] = calloc((size_t)cJSON_GetArraySize(chain) + 1, sizeof *keys);
    uint32_t i = 0;
    groom_status status = keys ? source_key(document, keys[0]) : GROOM_ENOMEM;
    cJSON_ArrayForEach(op, chain)
    {
        if (status != GROOM_OK)
            break;
        if (cJSON_IsFalse(cJSON_GetObjectItemCaseSensitive(op, "enabled"))) {
            memcpy(keys[i + 1], keys[i], sizeof *keys);
        } else {
            char *text = cJSON_PrintUnformatted(op);
            if (text)
                evaluate_next_key(keys[i], text, keys[i + 1]);
            else
                status = GROOM_ENOMEM;
            cJSON_free(text);
        }
        i++;
    }
    if (status == GROOM_OK)
        *out = keys;
    else
        free(keys);
    return status;
}

/* --- states ------------------------------------------------------------------------------- */

/* The last enabled layer before `index`, or -1. */
static int64_t layer_before(const struct groom *groom, uint32_t index)
{
    int64_t found = -1;
    for (uint32_t i = groom_next_layer(groom, 0); i < index; i = groom_next_layer(groom, i + 1))
        found = i;
    return found;
}

/* What comes out of a layer, from what comes into it; what an edit has kept there of the same layer is
 * used again. */
static groom_status run_layer(struct grooms *grooms, const struct groom *groom, uint32_t index, struct state *before,
                              struct groom_strands **after, struct groom_diag *diag)
{
    struct groom_layer_input *input = states_take_input(grooms->states, before);
    int serves = input && groom_layer_input_serves(input, groom, index);
    groom_status status = groom_layer_apply(groom, index, before->strands, serves ? input : NULL, &grooms->context, after,
                                            NULL, diag);
    states_give_input(grooms->states, before, input);
    return status;
}

groom_status evaluate_state(struct grooms *grooms, const struct groom *groom, char (*keys)[STORE_HASH_SIZE],
                            uint32_t index, struct state **out, struct groom_diag *diag)
{
    struct groom_strands *strands = NULL;
    struct state *before = NULL;
    int64_t layer = layer_before(groom, index);
    groom_status status = GROOM_OK;
    if ((*out = states_find(grooms->states, keys[index])))
        return GROOM_OK;
    if (layer < 0) {
        status = groom_evaluate_between(groom, 0, index, NULL, &grooms->context, &strands, diag);
    } else if (layer + 1 == index) {
        status = evaluate_state(grooms, groom, keys, (uint32_t)layer, &before, diag);
        if (status == GROOM_OK)
            status = run_layer(grooms, groom, (uint32_t)layer, before, &strands, diag);
    } else {
        status = evaluate_state(grooms, groom, keys, (uint32_t)layer + 1, &before, diag);
        if (status == GROOM_OK)
            status = groom_evaluate_between(groom, (uint32_t)layer + 1, index, before->strands, &grooms->context, &strands,
                                            diag);
    }
    states_release(grooms->states, before);
    if (status == GROOM_OK && states_keep(grooms->states, keys[index], strands, out) != GROOM_OK)
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for %u strands", groom->n_strands);
    return status;
}

groom_status evaluate_rest(struct grooms *grooms, const struct model *model, struct groom *rest, struct state **state,
                           struct groom_diag *diag)
{
    uint32_t n = model->groom->n_operators;
    int64_t layer = layer_before(model->groom, n);
    *state = NULL;
    *rest = *model->groom;
    if (layer < 0)
        return GROOM_OK;
    groom_status status = evaluate_state(grooms, model->groom, model->keys, (uint32_t)layer + 1, state, diag);
    if (status == GROOM_OK)
        *rest = groom_with_base(model->groom, (*state)->strands, (uint32_t)layer + 1, n);
    return status;
}
