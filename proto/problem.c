#include "proto/problem.h"

#include <cjson/cJSON.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char type_prefix[] = "/problems/";

struct problem *problem_set(struct problem *problem, int status, const char *name, const char *title,
                            const char *detail_format, ...)
{
    va_list arguments;
    *problem = (struct problem){.status = status, .byte_offset = -1};
    snprintf(problem->name, sizeof problem->name, "%s", name);
    snprintf(problem->title, sizeof problem->title, "%s", title);
    va_start(arguments, detail_format);
    vsnprintf(problem->detail, sizeof problem->detail, detail_format, arguments);
    va_end(arguments);
    return problem;
}

static int add_text(cJSON *object, const char *key, const char *text)
{
    return !text[0] || cJSON_AddStringToObject(object, key, text) != NULL;
}

cJSON *problem_to_json(const struct problem *problem)
{
    char type[sizeof type_prefix + sizeof problem->name];
    snprintf(type, sizeof type, "%s%s", type_prefix, problem->name[0] ? problem->name : "internal");
    cJSON *object = cJSON_CreateObject();
    if (object && add_text(object, "type", type) && add_text(object, "title", problem->title) &&
        cJSON_AddNumberToObject(object, "status", problem->status) &&
        add_text(object, "detail", problem->detail) && add_text(object, "instance", problem->instance) &&
        add_text(object, "request", problem->request) && add_text(object, "pointer", problem->pointer) &&
        add_text(object, "parameter", problem->parameter) &&
        (problem->byte_offset < 0 ||
         cJSON_AddNumberToObject(object, "byte_offset", (double)problem->byte_offset)))
        return object;
    cJSON_Delete(object);
    return NULL;
}

char *problem_print(const struct problem *problem)
{
    cJSON *object = problem_to_json(problem);
    char *text = object ? cJSON_PrintUnformatted(object) : NULL;
    cJSON_Delete(object);
    return text;
}

static void take_text(const cJSON *object, const char *key, char *text, size_t capacity)
{
    const char *value = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, key));
    snprintf(text, capacity, "%s", value ? value : "");
}

int problem_from_json(const cJSON *json, struct problem *problem)
{
    char type[sizeof type_prefix + sizeof problem->name];
    *problem = (struct problem){.status = 500, .byte_offset = -1};
    if (!cJSON_IsObject(json))
        return 0;
    take_text(json, "type", type, sizeof type);
    if (!type[0])
        return 0;
    size_t prefix = strncmp(type, type_prefix, sizeof type_prefix - 1) ? 0 : sizeof type_prefix - 1;
    snprintf(problem->name, sizeof problem->name, "%.*s", (int)sizeof problem->name - 1, type + prefix);
    take_text(json, "title", problem->title, sizeof problem->title);
    take_text(json, "detail", problem->detail, sizeof problem->detail);
    take_text(json, "instance", problem->instance, sizeof problem->instance);
    take_text(json, "request", problem->request, sizeof problem->request);
    take_text(json, "pointer", problem->pointer, sizeof problem->pointer);
    take_text(json, "parameter", problem->parameter, sizeof problem->parameter);
    const cJSON *status = cJSON_GetObjectItemCaseSensitive(json, "status");
    if (cJSON_IsNumber(status) && status->valuedouble >= 400 && status->valuedouble <= 599)
        problem->status = status->valueint;
    const cJSON *offset = cJSON_GetObjectItemCaseSensitive(json, "byte_offset");
    if (cJSON_IsNumber(offset) && offset->valuedouble >= 0 && offset->valuedouble < 9e15)
        problem->byte_offset = (int64_t)offset->valuedouble;
    return 1;
}
