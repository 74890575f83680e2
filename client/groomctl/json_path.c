#include "client/groomctl/json_path.h"

#include <string.h>

cJSON *json_value(const char *text)
{
    cJSON *value = cJSON_ParseWithOpts(text, NULL, 1);
    return value ? value : cJSON_CreateString(text);
}

/* The object under `name`, made where there is none; NULL where it is something else. */
static cJSON *descend(cJSON *object, const char *name)
{
    cJSON *next = cJSON_GetObjectItemCaseSensitive(object, name);
    if (!next)
        next = cJSON_AddObjectToObject(object, name);
    return cJSON_IsObject(next) ? next : NULL;
}

int json_set_path(cJSON *object, const char *assignment)
{
    char path[256], *name = path, *end;
    const char *equals = strchr(assignment, '=');
    size_t n = equals ? (size_t)(equals - assignment) : 0;
    if (!n || n >= sizeof path)
        return 0;
    memcpy(path, assignment, n);
    path[n] = '\0';
    if (*name == '/')
        name++;
    while ((end = strpbrk(name, "./"))) {
        *end = '\0';
        if (!*name || !(object = descend(object, name)))
            return 0;
        name = end + 1;
    }
    if (!*name)
        return 0;
    cJSON_DeleteItemFromObjectCaseSensitive(object, name);
    return cJSON_AddItemToObject(object, name, json_value(equals + 1));
}
