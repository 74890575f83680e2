/* Pairs of points as JSON. */
#include <stdio.h>
#include <string.h>

#include "groom/correspondence.h"
#include "retarget/fields.h"

static groom_status parse_pair(const cJSON *json, uint32_t i, struct groom_landmark *pair, struct groom_diag *diag)
{
    static const char *const names[] = {"name", "source", "target"};
    const cJSON *name = cJSON_GetObjectItemCaseSensitive(json, "name");
    char pointer[32], field[48];
    snprintf(pointer, sizeof pointer, "/landmarks/%u", i);
    groom_status st = fields_known(json, names, 3, pointer, "a landmark", diag);
    if (st != GROOM_OK)
        return st;
    snprintf(field, sizeof field, "%s/name", pointer);
    if (name && (!cJSON_IsString(name) || strlen(name->valuestring) >= sizeof pair->name))
        return groom_fail_field(diag, GROOM_EINVAL, field, "a landmark's name must be of at most 31 bytes");
    if (name)
        strcpy(pair->name, name->valuestring);
    snprintf(field, sizeof field, "%s/source", pointer);
    st = fields_point(cJSON_GetObjectItemCaseSensitive(json, "source"), field, pair->source, diag);
    snprintf(field, sizeof field, "%s/target", pointer);
    return st == GROOM_OK ? fields_point(cJSON_GetObjectItemCaseSensitive(json, "target"), field, pair->target, diag) : st;
}

static groom_status parse(const cJSON *json, struct groom_landmarks *landmarks, struct groom_diag *diag)
{
    static const char *const names[] = {"landmarks"};
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(json, "landmarks"), *pair;
    groom_status st = fields_known(json, names, 1, "", "a correspondence", diag);
    if (st != GROOM_OK)
        return st;
    int n = cJSON_IsArray(list) ? cJSON_GetArraySize(list) : 0;
    if (n < GROOM_MIN_LANDMARKS || n > GROOM_MAX_LANDMARKS)
        return groom_fail_field(diag, GROOM_EINVAL, "/landmarks", "there must be a list of %d to %d landmarks", GROOM_MIN_LANDMARKS,
                                GROOM_MAX_LANDMARKS);
    cJSON_ArrayForEach(pair, list) {
        st = parse_pair(pair, landmarks->n, &landmarks->pairs[landmarks->n], diag);
        if (st != GROOM_OK)
            return st;
        landmarks->n++;
    }
    return GROOM_OK;
}

groom_status groom_landmarks_parse(const char *text, size_t n_bytes, struct groom_landmarks *out, struct groom_diag *diag)
{
    struct groom_landmarks landmarks = {0};
    cJSON *json;
    groom_status st = fields_object(text, n_bytes, "a correspondence", &json, diag);
    if (st != GROOM_OK)
        return st;
    st = parse(json, &landmarks, diag);
    cJSON_Delete(json);
    if (st == GROOM_OK)
        *out = landmarks;
    return st;
}

static cJSON *pair_json(const struct groom_landmark *pair)
{
    cJSON *json = cJSON_CreateObject();
    int sound = json && (!pair->name[0] || cJSON_AddStringToObject(json, "name", pair->name)) &&
                fields_add(json, "source", fields_point_json(pair->source)) && fields_add(json, "target", fields_point_json(pair->target));
    if (sound)
        return json;
    cJSON_Delete(json);
    return NULL;
}

groom_status groom_landmarks_print(const struct groom_landmarks *landmarks, char **out, struct groom_diag *diag)
{
    cJSON *json = cJSON_CreateObject(), *list = cJSON_AddArrayToObject(json, "landmarks");
    int sound = list != NULL;
    for (uint32_t i = 0; sound && i < landmarks->n; i++)
        sound = fields_add(list, NULL, pair_json(&landmarks->pairs[i]));
    char *text = sound ? cJSON_PrintUnformatted(json) : NULL;
    cJSON_Delete(json);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to print the landmarks");
    *out = text;
    return GROOM_OK;
}
