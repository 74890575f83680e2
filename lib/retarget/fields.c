#include "retarget/fields.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

groom_status fields_object(const char *text, size_t n_bytes, const char *what, cJSON **json, struct groom_diag *diag)
{
    const char *end = NULL;
    cJSON *tree = cJSON_ParseWithLengthOpts(text, n_bytes, &end, 0);
    if (!tree)
        return groom_fail_at(diag, GROOM_EINVAL, end ? end - text : 0, "%s must be a JSON object: the text does not parse", what);
    if (!cJSON_IsObject(tree)) {
        cJSON_Delete(tree);
        return groom_fail_field(diag, GROOM_EINVAL, "", "%s must be a JSON object", what);
    }
    *json = tree;
    return GROOM_OK;
}

groom_status fields_known(const cJSON *object, const char *const *names, size_t n, const char *pointer, const char *what,
                          struct groom_diag *diag)
{
    const cJSON *item;
    if (!cJSON_IsObject(object))
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "%s must be an object", what);
    cJSON_ArrayForEach(item, object) {
        size_t at = 0;
        char full[128];
        while (at < n && strcmp(names[at], item->string) != 0)
            at++;
        if (at < n && cJSON_GetObjectItemCaseSensitive(object, item->string) == item)
            continue;
        snprintf(full, sizeof full, "%.90s/%.30s", pointer, item->string);
        return groom_fail_field(diag, GROOM_EINVAL, full, at < n ? "%s has the field \"%.30s\" twice" : "%s has no field \"%.30s\"",
                                what, item->string);
    }
    return GROOM_OK;
}

groom_status fields_point(const cJSON *json, const char *pointer, float out[3], struct groom_diag *diag)
{
    const cJSON *item;
    float point[3];
    int n = 0;
    if (cJSON_IsArray(json) && cJSON_GetArraySize(json) == 3)
        cJSON_ArrayForEach(item, json)
            if (cJSON_IsNumber(item) && fabs(item->valuedouble) <= FIELDS_MAX_COORDINATE)
                point[n++] = (float)item->valuedouble;
    if (n != 3)
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "a point must be three numbers, in metres");
    memcpy(out, point, sizeof point);
    return GROOM_OK;
}

groom_status fields_number(const cJSON *json, const char *pointer, double least, double most, double *out,
                           struct groom_diag *diag)
{
    if (!cJSON_IsNumber(json) || !(json->valuedouble >= least && json->valuedouble <= most))
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "this must be a number from %.9g to %.9g", least, most);
    *out = json->valuedouble;
    return GROOM_OK;
}

int fields_add(cJSON *parent, const char *name, cJSON *item)
{
    if (parent && item && (name ? cJSON_AddItemToObject(parent, name, item) : cJSON_AddItemToArray(parent, item)))
        return 1;
    cJSON_Delete(item);
    return 0;
}

cJSON *fields_point_json(const float point[3])
{
    cJSON *array = cJSON_CreateArray();
    for (int c = 0; array && c < 3; c++)
        if (!fields_add(array, NULL, json_number(point[c]))) {
            cJSON_Delete(array);
            return NULL;
        }
    return array;
}
