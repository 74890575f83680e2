/* Every option of a retargeting, once: its name, where it is kept, its default, its range and what it does.
 * The numbers are Table I's where the paper gives them. */
#include <cjson/cJSON.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/json.h"
#include "retarget/source.h"

enum option_type { OPTION_REAL, OPTION_U32, OPTION_U64, OPTION_MODE };

struct option_row {
    const char *name;
    enum option_type type;
    size_t offset; /* in struct groom_retarget_options */
    double initial, minimum, maximum;
    const char *help;
};

#define AT(member) offsetof(struct groom_retarget_options, member)

static const struct option_row rows[] = {
    {"alpha", OPTION_REAL, AT(alpha), 3e3, 0, 1e9, "Weight of what strands are to each other (Eq. 1)."},
    {"beta", OPTION_REAL, AT(beta), 1e3, 1e-3, 1e9, "Weight of where strands are about the body (Eq. 1)."},
    {"neighbours", OPTION_U32, AT(neighbours), 5, 1, 16, "Nearest particles of other strands that a particle is held among (Eq. 8)."},
    {"clearance", OPTION_REAL, AT(clearance), 5e-4, 0, 0.05, "Metres that strands stay away from the body at least (Eq. 13)."},
    {"discrepancy", OPTION_REAL, AT(discrepancy), 0.3, 1e-6, 1e3, "Change of direction from segment to segment, against the source's, above which the initial transfer is smoothed (Eq. 6)."},
    {"smoothing", OPTION_U32, AT(smoothing), 0, 0, 1000, "Passes of that smoothing; 0: until no particle is above the threshold any more. One leaves kinks."},
    {"sigma_bone", OPTION_REAL, AT(sigma_bone), 100, 0, 500, "How much a bone is preferred that a particle stands square to (Eq. 2)."},
    {"sigma_root", OPTION_REAL, AT(sigma_root), 0.2, 1e-6, 1e3, "How soon along a strand its place counts again after its root was moved (Eq. 20)."},
    {"guides", OPTION_U32, AT(guides), 300, 1, 100000, "Strands that are adapted together first; the others follow between them (Section 5)."},
    {"iterations", OPTION_U32, AT(iterations), 15, 1, 1000, "Iterations in each scale at most: steps down Eq. 1, or, where tolerance is 0, the quadratic programmes of Section 4.6."},
    {"tolerance", OPTION_REAL, AT(tolerance), 1e-5, 0, 1, "Mean movement in an iteration, metres, that ends them. 0: all iterations, as Section 4.6 has them, each to the last digits."},
    {"sweeps", OPTION_U32, AT(sweeps), 0, 0, 1000, "Iterations over the whole hairstyle after the fine scale, past the paper: ten come near the global mode; 0: none."},
    {"mode", OPTION_MODE, AT(mode), GROOM_RETARGET_MULTISCALE, 0, 1, "multiscale: guides together, then every strand between them. global: all strands together, for comparison."},
    {"seed", OPTION_U64, AT(seed), 1, 0, 999999999999999.0, "Seed of the clustering that chooses guides."},
};

#define N_ROWS (sizeof rows / sizeof rows[0])
static const char *const mode_names[2] = {"multiscale", "global"};

/* --- values --------------------------------------------------------------------------- */

static void set(const struct option_row *row, struct groom_retarget_options *options, double value)
{
    void *at = (char *)options + row->offset;
    switch (row->type) {
    case OPTION_REAL: *(double *)at = value; break;
    case OPTION_U32: *(uint32_t *)at = (uint32_t)value; break;
    case OPTION_U64: *(uint64_t *)at = (uint64_t)value; break;
    case OPTION_MODE: *(groom_retarget_mode *)at = (groom_retarget_mode)value; break;
    }
}

static double get(const struct option_row *row, const struct groom_retarget_options *options)
{
    const void *at = (const char *)options + row->offset;
    switch (row->type) {
    case OPTION_REAL: return *(const double *)at;
    case OPTION_U32: return *(const uint32_t *)at;
    case OPTION_U64: return (double)*(const uint64_t *)at;
    case OPTION_MODE: return (double)*(const groom_retarget_mode *)at;
    }
    return NAN;
}

void groom_retarget_options_init(struct groom_retarget_options *options)
{
    memset(options, 0, sizeof *options);
    for (size_t i = 0; i < N_ROWS; i++)
        set(&rows[i], options, rows[i].initial);
}

static groom_status refuse(const struct option_row *row, struct groom_diag *diag)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/%s", row->name);
    if (row->type == OPTION_MODE)
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "mode must be \"multiscale\" or \"global\"");
    return groom_fail_field(diag, GROOM_EINVAL, pointer, "%s must be a %snumber from %.9g to %.9g", row->name,
                            row->type == OPTION_REAL ? "" : "whole ", row->minimum, row->maximum);
}

static int in_range(const struct option_row *row, double value)
{
    return value >= row->minimum && value <= row->maximum && (row->type == OPTION_REAL || value == floor(value));
}

groom_status retarget_options_check(const struct groom_retarget_options *options, struct groom_diag *diag)
{
    for (size_t i = 0; i < N_ROWS; i++)
        if (!in_range(&rows[i], get(&rows[i], options)))
            return refuse(&rows[i], diag);
    return GROOM_OK;
}

/* --- parsing ---------------------------------------------------------------------------- */

static const struct option_row *find(const char *name)
{
    for (size_t i = 0; i < N_ROWS; i++)
        if (strcmp(rows[i].name, name) == 0)
            return &rows[i];
    return NULL;
}

static groom_status refuse_name(const char *name, struct groom_diag *diag)
{
    char pointer[96], names[256] = "";
    size_t used = 0;
    snprintf(pointer, sizeof pointer, "/%.64s", name);
    for (size_t i = 0; i < N_ROWS; i++)
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", i ? ", " : "", rows[i].name);
    return groom_fail_field(diag, GROOM_EINVAL, pointer, "there is no option \"%.48s\"; there are %s", name, names);
}

static groom_status parse_value(const cJSON *json, const struct option_row *row, struct groom_retarget_options *options,
                                struct groom_diag *diag)
{
    double value = cJSON_IsNumber(json) ? json->valuedouble : NAN;
    for (int i = 0; row->type == OPTION_MODE && i < 2; i++)
        value = cJSON_IsString(json) && strcmp(json->valuestring, mode_names[i]) == 0 ? i : i ? value : NAN;
    if (!in_range(row, value))
        return refuse(row, diag);
    set(row, options, value);
    return GROOM_OK;
}

static groom_status refuse_twice(const struct option_row *row, struct groom_diag *diag)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/%s", row->name);
    return groom_fail_field(diag, GROOM_EINVAL, pointer, "%s stands there twice", row->name);
}

static groom_status parse_object(const cJSON *json, struct groom_retarget_options *options, struct groom_diag *diag)
{
    const cJSON *item;
    uint32_t seen = 0;
    cJSON_ArrayForEach(item, json) {
        const struct option_row *row = find(item->string);
        groom_status st;
        if (!row)
            return refuse_name(item->string, diag);
        if (seen >> (row - rows) & 1)
            return refuse_twice(row, diag);
        seen |= 1u << (row - rows);
        if ((st = parse_value(item, row, options, diag)) != GROOM_OK)
            return st;
    }
    return GROOM_OK;
}

groom_status groom_retarget_options_parse(const char *text, size_t n, struct groom_retarget_options *out,
                                          struct groom_diag *diag)
{
    struct groom_retarget_options options;
    groom_status st;
    groom_retarget_options_init(&options);
    cJSON *json = n ? cJSON_ParseWithLength(text, n) : cJSON_CreateObject();
    if (!cJSON_IsObject(json))
        st = groom_fail(diag, GROOM_EINVAL, "the options are not one JSON object");
    else
        st = parse_object(json, &options, diag);
    if (st == GROOM_OK)
        *out = options;
    cJSON_Delete(json);
    return st;
}

/* --- printing ------------------------------------------------------------------------------ */

static groom_status print(cJSON *json, int whole, char **text, struct groom_diag *diag)
{
    char *printed = whole ? cJSON_Print(json) : NULL;
    cJSON_Delete(json);
    if (!printed)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a JSON text");
    *text = printed;
    return GROOM_OK;
}

groom_status groom_retarget_options_print(const struct groom_retarget_options *options, char **text, struct groom_diag *diag)
{
    cJSON *json = cJSON_CreateObject();
    int whole = json != NULL;
    for (size_t i = 0; whole && i < N_ROWS; i++) {
        double value = get(&rows[i], options);
        whole = json_put(json, rows[i].name, rows[i].type == OPTION_MODE ? cJSON_CreateString(mode_names[value > 0]) : json_number(value));
    }
    return print(json, whole, text, diag);
}

static cJSON *schema_of(const struct option_row *row)
{
    cJSON *json = cJSON_CreateObject();
    int whole = json && json_put(json, "description", cJSON_CreateString(row->help));
    if (row->type == OPTION_MODE) {
        whole = whole && json_put(json, "enum", cJSON_CreateStringArray(mode_names, 2)) &&
                json_put(json, "default", cJSON_CreateString(mode_names[(int)row->initial]));
    } else {
        whole = whole && json_put(json, "type", cJSON_CreateString(row->type == OPTION_REAL ? "number" : "integer")) &&
                json_put(json, "minimum", json_number(row->minimum)) && json_put(json, "maximum", json_number(row->maximum)) &&
                json_put(json, "default", json_number(row->initial));
    }
    if (whole)
        return json;
    cJSON_Delete(json);
    return NULL;
}

groom_status groom_retarget_options_schema(char **text, struct groom_diag *diag)
{
    cJSON *json = cJSON_CreateObject(), *properties = cJSON_CreateObject();
    int whole = json && properties;
    for (size_t i = 0; whole && i < N_ROWS; i++)
        whole = json_put(properties, rows[i].name, schema_of(&rows[i]));
    whole = whole && json_put(json, "$schema", cJSON_CreateString("https://json-schema.org/draft/2020-12/schema")) &&
            json_put(json, "title", cJSON_CreateString("Options of a retargeting")) && json_put(json, "type", cJSON_CreateString("object")) &&
            json_put(json, "additionalProperties", cJSON_CreateFalse());
    if (whole) {
        whole = json_put(json, "properties", properties);
        properties = NULL;
    }
    cJSON_Delete(properties);
    return print(json, whole, text, diag);
}
