/* Options to JSON, and the JSON Schema that says what may stand there. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <string.h>

#include "base/json.h"
#include "fit/options.h"
#include "fit/state.h"
#include "geometry/camera_json.h"

static int append(cJSON *array, cJSON *item)
{
    if (item && cJSON_AddItemToArray(array, item))
        return 1;
    cJSON_Delete(item);
    return 0;
}

static groom_status finish(cJSON *json, int whole, char **text, struct groom_diag *diag)
{
    char *printed = whole ? cJSON_Print(json) : NULL;
    cJSON_Delete(json);
    if (!printed)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a JSON text");
    *text = printed;
    return GROOM_OK;
}

/* --- values -------------------------------------------------------------------- */

static cJSON *operators_json(const struct groom_fit_options *options)
{
    cJSON *array = cJSON_CreateArray();
    for (uint32_t i = 0; array && i < options->n_operators; i++)
        if (!append(array, cJSON_CreateString(groom_operator_name(options->operators[i])))) {
            cJSON_Delete(array);
            return NULL;
        }
    return array;
}

static cJSON *cameras_json(const struct groom_fit_options *options)
{
    cJSON *array = cJSON_CreateArray();
    for (uint32_t i = 0; array && i < options->n_cameras; i++)
        if (!append(array, camera_to_json(&options->cameras[i]))) {
            cJSON_Delete(array);
            return NULL;
        }
    return array;
}

static cJSON *number_or_auto(double value, int automatic)
{
    return automatic && value == 0 ? cJSON_CreateString("auto") : json_number(value);
}

static cJSON *group_json(const struct groom_fit_options *options, const char *group);

static cJSON *value_json(const struct groom_fit_options *options, const struct option_row *row)
{
    const void *at = (const char *)options + row->offset;
    switch (row->type) {
    case OPTION_GROUP: return group_json(options, row->path);
    case OPTION_GROUP_OR_NULL: return options->n_cameras ? group_json(options, row->path) : cJSON_CreateNull();
    case OPTION_U32: return number_or_auto(*(const uint32_t *)at, 0);
    case OPTION_U32_OR_AUTO: return number_or_auto(*(const uint32_t *)at, 1);
    case OPTION_U64: return number_or_auto((double)*(const uint64_t *)at, 0);
    case OPTION_REAL: return number_or_auto(*(const double *)at, 0);
    case OPTION_REAL_OR_AUTO: return number_or_auto(*(const double *)at, 1);
    case OPTION_BOOLEAN: return cJSON_CreateBool(*(const int *)at);
    case OPTION_METHOD: return cJSON_CreateString(options_method_names[*(const groom_fit_method *)at]);
    case OPTION_QUALITY: return cJSON_CreateString(options_quality_names[options->quality]);
    case OPTION_OPERATORS: return options->operators_auto ? cJSON_CreateString("auto") : operators_json(options);
    case OPTION_CAMERAS: return cameras_json(options);
    }
    return NULL;
}

static cJSON *group_json(const struct groom_fit_options *options, const char *group)
{
    cJSON *json = cJSON_CreateObject();
    for (size_t i = 0; json && i < options_n_rows; i++) {
        const char *name = options_member(options_table[i].path, group);
        if (name && !json_put(json, name, value_json(options, &options_table[i]))) {
            cJSON_Delete(json);
            return NULL;
        }
    }
    return json;
}

groom_status groom_fit_options_print(const struct groom_fit_options *options, char **json, struct groom_diag *diag)
{
    cJSON *tree = group_json(options, "");
    return finish(tree, tree != NULL, json, diag);
}

/* --- the schema ------------------------------------------------------------------ */

static int put_text(cJSON *object, const char *name, const char *text)
{
    return cJSON_AddStringToObject(object, name, text) != NULL;
}

static int put_number_range(cJSON *schema, const struct option_row *row, const char *type)
{
    return put_text(schema, "type", type) && cJSON_AddNumberToObject(schema, "minimum", row->minimum) &&
           cJSON_AddNumberToObject(schema, "maximum", row->maximum);
}

static int put_alternatives(cJSON *schema, cJSON *one, cJSON *other)
{
    cJSON *array = cJSON_AddArrayToObject(schema, "anyOf");
    int whole = array != NULL;
    whole &= append(array, one);
    whole &= append(array, other);
    return whole;
}

static cJSON *constant(const char *text)
{
    cJSON *schema = cJSON_CreateObject();
    if (schema && put_text(schema, "const", text))
        return schema;
    cJSON_Delete(schema);
    return NULL;
}

static int put_number_or_auto(cJSON *schema, const struct option_row *row, const char *type)
{
    cJSON *number = cJSON_CreateObject();
    if (number && put_number_range(number, row, type))
        return put_alternatives(schema, number, constant("auto"));
    cJSON_Delete(number);
    return 0;
}

static cJSON *names_schema(const char *(*name)(int), int n)
{
    cJSON *schema = cJSON_CreateObject(), *array = cJSON_AddArrayToObject(schema, "enum");
    for (int i = 0; array && i < n; i++)
        if (!append(array, cJSON_CreateString(name(i)))) {
            cJSON_Delete(schema);
            return NULL;
        }
    return schema;
}

static const char *operator_name(int i) { return groom_operator_name((groom_operator_type)i); }
static const char *method_name(int i) { return options_method_names[i]; }
static const char *quality_name(int i) { return options_quality_names[i]; }

static int put_operators(cJSON *schema)
{
    cJSON *array = cJSON_CreateObject();
    if (array && put_text(array, "type", "array") &&
        cJSON_AddNumberToObject(array, "maxItems", GROOM_FIT_MAX_OPERATORS) &&
        json_put(array, "items", names_schema(operator_name, GROOM_OPERATOR_COUNT)))
        return put_alternatives(schema, array, constant("auto"));
    cJSON_Delete(array);
    return 0;
}

#define FRAME_SCHEMA                                                                                         \
    "\"unit\":{\"description\":\"of the capture: m, cm, mm, dm, in or a number of metres\",\"type\":[\"string\",\"number\"]},"  \
    "\"up\":{\"enum\":[\"y\",\"z\"]}"

/* Ours, or the files that reconstructions come with. */
static int put_cameras(cJSON *schema)
{
    static const char camera[] =
        "{\"type\":\"object\",\"additionalProperties\":false,"
        "\"required\":[\"width\",\"height\",\"fx\",\"fy\",\"cx\",\"cy\",\"rotation\",\"translation\"],"
        "\"properties\":{\"name\":{\"type\":\"string\",\"maxLength\":31},"
        "\"width\":{\"type\":\"number\",\"minimum\":1,\"maximum\":65536},"
        "\"height\":{\"type\":\"number\",\"minimum\":1,\"maximum\":65536},"
        "\"fx\":{\"type\":\"number\",\"minimum\":0.001},\"fy\":{\"type\":\"number\",\"minimum\":0.001},"
        "\"cx\":{\"type\":\"number\"},\"cy\":{\"type\":\"number\"},"
        "\"rotation\":{\"type\":\"array\",\"minItems\":3,\"maxItems\":3,\"items\":{\"type\":\"array\","
        "\"minItems\":3,\"maxItems\":3,\"items\":{\"type\":\"number\"}}},"
        "\"translation\":{\"type\":\"array\",\"minItems\":3,\"maxItems\":3,\"items\":{\"type\":\"number\"}}}}";
    static const char transforms[] =
        "{\"type\":\"object\",\"description\":\"NeRF's transforms.json as it is\",\"required\":[\"frames\"],"
        "\"properties\":{" FRAME_SCHEMA ",\"frames\":{\"type\":\"array\",\"items\":{\"type\":\"object\","
        "\"required\":[\"transform_matrix\"]}}}}";
    static const char texts[] =
        "{\"type\":\"object\",\"description\":\"COLMAP's cameras.txt and images.txt, each as one string\","
        "\"required\":[\"cameras_txt\",\"images_txt\"],\"additionalProperties\":false,\"properties\":{" FRAME_SCHEMA
        ",\"cameras_txt\":{\"type\":\"string\"},\"images_txt\":{\"type\":\"string\"}}}";
    cJSON *list = cJSON_CreateObject(), *forms = cJSON_AddArrayToObject(schema, "oneOf");
    int whole = list && put_text(list, "type", "array") && cJSON_AddNumberToObject(list, "maxItems", GROOM_FIT_MAX_CAMERAS) &&
                json_put(list, "items", cJSON_Parse(camera));
    if (!forms || !whole) {
        cJSON_Delete(list);
        return 0;
    }
    cJSON *form[] = {list, cJSON_Parse(transforms), cJSON_Parse(texts)};
    for (int i = 0; i < 3; i++)
        if (!form[i] || !cJSON_AddItemToArray(forms, form[i])) {
            cJSON_Delete(form[i]);
            whole = 0;
        }
    return whole;
}

static cJSON *group_schema(const char *group);

/* Moves the members of `from` into `into`. */
static int absorb(cJSON *into, cJSON *from)
{
    int whole = from != NULL;
    while (whole && from->child) {
        cJSON *item = cJSON_DetachItemViaPointer(from, from->child);
        char name[64];
        snprintf(name, sizeof name, "%s", item->string);
        whole = json_put(into, name, item);
    }
    cJSON_Delete(from);
    return whole;
}

static cJSON *null_schema(void)
{
    cJSON *schema = cJSON_CreateObject();
    if (schema && put_text(schema, "type", "null"))
        return schema;
    cJSON_Delete(schema);
    return NULL;
}

static int put_kind(cJSON *schema, const struct option_row *row)
{
    switch (row->type) {
    case OPTION_GROUP: return absorb(schema, group_schema(row->path));
    case OPTION_GROUP_OR_NULL: return put_alternatives(schema, group_schema(row->path), null_schema());
    case OPTION_U32:
    case OPTION_U64: return put_number_range(schema, row, "integer");
    case OPTION_REAL: return put_number_range(schema, row, "number");
    case OPTION_U32_OR_AUTO: return put_number_or_auto(schema, row, "integer");
    case OPTION_REAL_OR_AUTO: return put_number_or_auto(schema, row, "number");
    case OPTION_BOOLEAN: return put_text(schema, "type", "boolean");
    case OPTION_METHOD: return absorb(schema, names_schema(method_name, 2));
    case OPTION_QUALITY: return absorb(schema, names_schema(quality_name, 3));
    case OPTION_OPERATORS: return put_operators(schema);
    case OPTION_CAMERAS: return put_cameras(schema);
    }
    return 0;
}

/* What the row does; where qualities differ, their defaults; where its stage is not in this library, that. */
static void describe(const struct option_row *row, char *text, size_t n)
{
    const double *d = row->initial;
    int at = snprintf(text, n, "%s", row->help);
    if (row->type != OPTION_QUALITY && (d[0] != d[1] || d[1] != d[2]))
        snprintf(text + at, n - (size_t)at, " draft: %.9g, standard: %.9g, high: %.9g.", d[0], d[1], d[2]);
    const char *stage = options_member(row->path, "/stages");
    if (stage && !fit_has_stage(stage))
        snprintf(text + at, n - (size_t)at, " Checked and kept; this version ends before this stage.");
}

static cJSON *row_schema(const struct option_row *row, const struct groom_fit_options *defaults)
{
    cJSON *schema = cJSON_CreateObject();
    char text[400];
    describe(row, text, sizeof text);
    if (schema && put_text(schema, "description", text) && put_kind(schema, row) &&
        (row->type == OPTION_GROUP || row->type == OPTION_CAMERAS ||
         json_put(schema, "default", value_json(defaults, row))))
        return schema;
    cJSON_Delete(schema);
    return NULL;
}

static cJSON *group_schema(const char *group)
{
    struct groom_fit_options defaults;
    cJSON *schema = cJSON_CreateObject(), *properties;
    groom_fit_options_init(GROOM_FIT_STANDARD, &defaults);
    int whole = schema && put_text(schema, "type", "object") && cJSON_AddFalseToObject(schema, "additionalProperties");
    properties = whole ? cJSON_AddObjectToObject(schema, "properties") : NULL;
    whole = properties != NULL;
    for (size_t i = 0; whole && i < options_n_rows; i++) {
        const char *name = options_member(options_table[i].path, group);
        if (name)
            whole = json_put(properties, name, row_schema(&options_table[i], &defaults));
    }
    if (whole)
        return schema;
    cJSON_Delete(schema);
    return NULL;
}

groom_status groom_fit_options_schema(char **json, struct groom_diag *diag)
{
    cJSON *schema = cJSON_CreateObject();
    int whole = schema && put_text(schema, "$schema", "https://json-schema.org/draft/2020-12/schema") &&
                put_text(schema, "title", "Options of a fit") && absorb(schema, group_schema(""));
    return finish(schema, whole, json, diag);
}
