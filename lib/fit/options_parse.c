/* Options from JSON: whatever the table does not know, or holds otherwise, is refused. */
#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fit/options.h"
#include "geometry/camera_json.h"

#define MAX_PATH 128

/* --- the nearest known name -------------------------------------------------- */

#define MAX_NAME 48

/* Edits (insert, delete, replace) from a to b; both are cut to MAX_NAME. */
static unsigned edit_distance(const char *a, const char *b)
{
    unsigned row[MAX_NAME + 1];
    size_t n_a = strnlen(a, MAX_NAME), n_b = strnlen(b, MAX_NAME);
    for (size_t j = 0; j <= n_b; j++)
        row[j] = (unsigned)j;
    for (size_t i = 1; i <= n_a; i++) {
        unsigned diagonal = row[0];
        row[0] = (unsigned)i;
        for (size_t j = 1; j <= n_b; j++) {
            unsigned replace = diagonal + (a[i - 1] != b[j - 1]);
            unsigned shift = 1 + (row[j] < row[j - 1] ? row[j] : row[j - 1]);
            diagonal = row[j];
            row[j] = replace < shift ? replace : shift;
        }
    }
    return row[n_b];
}

static groom_status refuse_name(const char *group, const char *name, const char *path, struct groom_diag *diag)
{
    const char *nearest = NULL;
    unsigned best = (unsigned)-1;
    for (size_t i = 0; i < options_n_rows; i++) {
        const char *member = options_member(options_table[i].path, group);
        unsigned distance = member ? edit_distance(name, member) : (unsigned)-1;
        if (distance < best) {
            best = distance;
            nearest = member;
        }
    }
    return groom_fail_field(diag, GROOM_EINVAL, path, "there is no option \"%.48s\" in %s; did you mean \"%s\"?", name,
                            *group ? group : "the options", nearest);
}

/* --- values ------------------------------------------------------------------- */

static groom_status refuse_value(const struct option_row *row, struct groom_diag *diag)
{
    const char *kind = row->type == OPTION_REAL || row->type == OPTION_REAL_OR_AUTO ? "a number" : "a whole number";
    const char *or_auto = row->type == OPTION_U32_OR_AUTO || row->type == OPTION_REAL_OR_AUTO ? " or \"auto\"" : "";
    return groom_fail_field(diag, GROOM_EINVAL, row->path, "%s must be %s from %.9g to %.9g%s", row->path + 1, kind,
                            row->minimum, row->maximum, or_auto);
}

static groom_status parse_number(const cJSON *json, const struct option_row *row, void *at, struct groom_diag *diag)
{
    int real = row->type == OPTION_REAL || row->type == OPTION_REAL_OR_AUTO;
    int automatic = row->type == OPTION_U32_OR_AUTO || row->type == OPTION_REAL_OR_AUTO;
    double value = json->valuedouble;
    if (automatic && cJSON_IsString(json) && strcmp(json->valuestring, "auto") == 0)
        value = 0;
    else if (!cJSON_IsNumber(json) || !(value >= row->minimum && value <= row->maximum) ||
             (!real && value != floor(value)))
        return refuse_value(row, diag);
    if (real)
        *(double *)at = value;
    else if (row->type == OPTION_U64)
        *(uint64_t *)at = (uint64_t)value;
    else
        *(uint32_t *)at = (uint32_t)value;
    return GROOM_OK;
}

static groom_status parse_boolean(const cJSON *json, const struct option_row *row, int *at, struct groom_diag *diag)
{
    if (!cJSON_IsBool(json))
        return groom_fail_field(diag, GROOM_EINVAL, row->path, "%s must be true or false", row->path + 1);
    *at = cJSON_IsTrue(json);
    return GROOM_OK;
}

static groom_status parse_quality(const cJSON *json, groom_fit_quality *quality, struct groom_diag *diag)
{
    for (int i = 0; i < 3; i++)
        if (cJSON_IsString(json) && strcmp(json->valuestring, options_quality_names[i]) == 0) {
            *quality = (groom_fit_quality)i;
            return GROOM_OK;
        }
    return groom_fail_field(diag, GROOM_EINVAL, "/quality", "quality must be \"draft\", \"standard\" or \"high\"");
}

static groom_status parse_method(const cJSON *json, const struct option_row *row, groom_fit_method *method,
                                 struct groom_diag *diag)
{
    for (int i = 0; i < 2; i++)
        if (cJSON_IsString(json) && strcmp(json->valuestring, options_method_names[i]) == 0) {
            *method = (groom_fit_method)i;
            return GROOM_OK;
        }
    return groom_fail_field(diag, GROOM_EINVAL, row->path, "%s must be \"direct\" or \"paper\"", row->path + 1);
}

static groom_status parse_operators(const cJSON *json, struct groom_fit_options *options, struct groom_diag *diag)
{
    const cJSON *item;
    uint32_t n = 0;
    if (cJSON_IsString(json) && strcmp(json->valuestring, "auto") == 0)
        return GROOM_OK; /* the default */
    if (!cJSON_IsArray(json) || cJSON_GetArraySize(json) > GROOM_FIT_MAX_OPERATORS)
        return groom_fail_field(diag, GROOM_EINVAL, "/operators",
                                "operators must be \"auto\" or an array of at most %d names", GROOM_FIT_MAX_OPERATORS);
    cJSON_ArrayForEach(item, json) {
        char pointer[MAX_PATH];
        groom_operator_type type;
        snprintf(pointer, sizeof pointer, "/operators/%u", n);
        if (!cJSON_IsString(item) || groom_operator_parse(item->valuestring, &type, NULL) != GROOM_OK ||
            groom_operator_is_layer(type))
            return groom_fail_field(diag, GROOM_EINVAL, pointer,
                                    "an operator is one of \"scale\", \"bend\", \"curl\", \"clump\", \"frizz\"");
        options->operators[n++] = type;
    }
    options->operators_auto = 0;
    options->n_operators = n;
    return GROOM_OK;
}

static groom_status parse_cameras(const cJSON *json, struct groom_fit_options *options, struct groom_diag *diag)
{
    return cameras_from_json(json, "/visibility/cameras", options->cameras, GROOM_FIT_MAX_CAMERAS, &options->n_cameras, diag);
}

/* --- the tree ------------------------------------------------------------------- */

static groom_status parse_group(const cJSON *json, const char *group, struct groom_fit_options *options,
                                struct groom_diag *diag);

static groom_status parse_value(const cJSON *json, const struct option_row *row, struct groom_fit_options *options,
                                struct groom_diag *diag)
{
    void *at = (char *)options + row->offset;
    switch (row->type) {
    case OPTION_GROUP: return parse_group(json, row->path, options, diag);
    case OPTION_GROUP_OR_NULL: return cJSON_IsNull(json) ? GROOM_OK : parse_group(json, row->path, options, diag);
    case OPTION_BOOLEAN: return parse_boolean(json, row, at, diag);
    case OPTION_METHOD: return parse_method(json, row, at, diag);
    case OPTION_QUALITY: return parse_quality(json, at, diag);
    case OPTION_OPERATORS: return parse_operators(json, options, diag);
    case OPTION_CAMERAS: return parse_cameras(json, options, diag);
    case OPTION_U32:
    case OPTION_U32_OR_AUTO:
    case OPTION_U64:
    case OPTION_REAL:
    case OPTION_REAL_OR_AUTO: return parse_number(json, row, at, diag);
    }
    return GROOM_EINTERNAL;
}

static int named_before(const cJSON *object, const cJSON *item)
{
    for (const cJSON *other = object->child; other != item; other = other->next)
        if (strcmp(other->string, item->string) == 0)
            return 1;
    return 0;
}

static groom_status parse_group(const cJSON *json, const char *group, struct groom_fit_options *options,
                                struct groom_diag *diag)
{
    const cJSON *item;
    if (!cJSON_IsObject(json))
        return groom_fail_field(diag, GROOM_EINVAL, group, "%s must be an object", *group ? group + 1 : "the options");
    cJSON_ArrayForEach(item, json) {
        char path[MAX_PATH];
        groom_status st;
        snprintf(path, sizeof path, "%s/%.48s", group, item->string);
        const struct option_row *row = strchr(item->string, '/') ? NULL : options_find(path);
        if (!row)
            return refuse_name(group, item->string, path, diag);
        if (named_before(json, item))
            return groom_fail_field(diag, GROOM_EINVAL, path, "%s stands there twice", path + 1);
        if ((st = parse_value(item, row, options, diag)) != GROOM_OK)
            return st;
    }
    return GROOM_OK;
}

static groom_status check_together(const struct groom_fit_options *options, struct groom_diag *diag)
{
    if (options->guides != GROOM_FIT_AUTO && options->operator_guides > options->guides)
        return groom_fail_field(diag, GROOM_EINVAL, "/operator_guides",
                                "operator_guides is %u, but they are chosen among the %u guides",
                                options->operator_guides, options->guides);
    if (options->guides != GROOM_FIT_AUTO && options->interpolation_guides > options->guides)
        return groom_fail_field(diag, GROOM_EINVAL, "/interpolation_guides",
                                "interpolation_guides is %u, but there are only %u guides",
                                options->interpolation_guides, options->guides);
    return GROOM_OK;
}

static groom_status parse_root(const cJSON *json, struct groom_fit_options *options, struct groom_diag *diag)
{
    groom_fit_quality quality = GROOM_FIT_STANDARD;
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(json, "quality");
    groom_status st;
    if (item && (st = parse_quality(item, &quality, diag)) != GROOM_OK)
        return st;
    groom_fit_options_init(quality, options);
    if ((st = parse_group(json, "", options, diag)) != GROOM_OK)
        return st;
    return check_together(options, diag);
}

groom_status groom_fit_options_parse(const char *text, size_t n, struct groom_fit_options *out,
                                     struct groom_diag *diag)
{
    struct groom_fit_options *options;
    const char *end = text;
    cJSON *json = NULL;
    groom_status st;

    if (!(options = malloc(sizeof *options)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the options");
    json = n ? cJSON_ParseWithLengthOpts(text, n, &end, 0) : cJSON_CreateObject();
    while (json && n && end < text + n && strchr(" \t\r\n", *end) && *end)
        end++;
    if (!json || (n && end < text + n && !(end == text + n - 1 && *end == 0)))
        st = groom_fail_at(diag, GROOM_EINVAL, end ? end - text : 0, "the options are not one JSON object");
    else
        st = parse_root(json, options, diag);
    if (st == GROOM_OK)
        *out = *options;
    cJSON_Delete(json);
    free(options);
    return st;
}
