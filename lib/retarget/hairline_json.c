/* Edits of the hairline as JSON. */
#include <stdio.h>
#include <string.h>

#include "groom/hairline.h"
#include "retarget/fields.h"

#define LEAST_POINTS 3

static const char *const kind_names[] = {
#define NAME(constant, name) name,
    GROOM_HAIRLINE_KIND_LIST(NAME)
};
static const char *const method_names[] = {
    GROOM_RELOCATE_LIST(NAME)
#undef NAME
};

const char *groom_hairline_kind_name(groom_hairline_kind kind)
{
    return (unsigned)kind < GROOM_HAIRLINE_KIND_COUNT ? kind_names[kind] : "?";
}

const char *groom_relocate_method_name(groom_relocate_method method)
{
    return (unsigned)method < GROOM_RELOCATE_COUNT ? method_names[method] : "?";
}

/* --- reading -------------------------------------------------------------------------------- */

/* One of n names; `fallback` where it is left out. */
static groom_status parse_name(const cJSON *json, const char *field, const char *const *names, int n, int fallback, int *out,
                               struct groom_diag *diag)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(json, field);
    char pointer[32], list[96] = "";
    *out = fallback;
    if (!item)
        return GROOM_OK;
    for (int i = 0; i < n; i++) {
        if (cJSON_IsString(item) && strcmp(item->valuestring, names[i]) == 0) {
            *out = i;
            return GROOM_OK;
        }
        size_t at = strlen(list);
        snprintf(list + at, sizeof list - at, "%s%s", i ? ", " : "", names[i]);
    }
    snprintf(pointer, sizeof pointer, "/%s", field);
    return groom_fail_field(diag, GROOM_EINVAL, pointer, "%s must be one of %s", field, list);
}

static groom_status parse_points(const cJSON *points, const char *parent, struct groom_hairline_curve *curve, struct groom_diag *diag)
{
    char pointer[64];
    const cJSON *point;
    snprintf(pointer, sizeof pointer, "%s/points", parent);
    if (!cJSON_IsArray(points) || cJSON_GetArraySize(points) < LEAST_POINTS || cJSON_GetArraySize(points) > GROOM_HAIRLINE_MAX_POINTS)
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "a hairline must be a list of %d to %d points", LEAST_POINTS,
                                GROOM_HAIRLINE_MAX_POINTS);
    cJSON_ArrayForEach(point, points) {
        snprintf(pointer, sizeof pointer, "%s/points/%u", parent, curve->n_points);
        groom_status st = fields_point(point, pointer, curve->points[curve->n_points], diag);
        if (st != GROOM_OK)
            return st;
        curve->n_points++;
    }
    return GROOM_OK;
}

static groom_status parse_turn(const cJSON *json, const char *pointer, struct groom_hairline_curve *curve, struct groom_diag *diag)
{
    static const char *const names[] = {"from", "to"};
    struct groom_hairline_turn turn = {0}, last = curve->n_turns ? curve->turns[curve->n_turns - 1] : turn;
    char field[72];
    groom_status st = fields_known(json, names, 2, pointer, "a turning point", diag);
    if (st != GROOM_OK)
        return st;
    snprintf(field, sizeof field, "%s/from", pointer);
    st = fields_number(cJSON_GetObjectItemCaseSensitive(json, "from"), field, 0, 1, &turn.from, diag);
    snprintf(field, sizeof field, "%s/to", pointer);
    if (st == GROOM_OK)
        st = fields_number(cJSON_GetObjectItemCaseSensitive(json, "to"), field, 0, 1, &turn.to, diag);
    if (st != GROOM_OK)
        return st;
    if (turn.from <= last.from || turn.to <= last.to || turn.from >= 1 || turn.to >= 1)
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "turning points must lie between 0 and 1 and ascend in from and in to");
    curve->turns[curve->n_turns++] = turn;
    return GROOM_OK;
}

static groom_status parse_turns(const cJSON *turns, const char *parent, struct groom_hairline_curve *curve, struct groom_diag *diag)
{
    char pointer[64];
    const cJSON *turn;
    groom_status st = GROOM_OK;
    snprintf(pointer, sizeof pointer, "%s/turns", parent);
    if (!turns)
        return GROOM_OK;
    if (!cJSON_IsArray(turns) || cJSON_GetArraySize(turns) > GROOM_HAIRLINE_MAX_TURNS)
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "turns must be a list of at most %d turning points", GROOM_HAIRLINE_MAX_TURNS);
    cJSON_ArrayForEach(turn, turns) {
        snprintf(pointer, sizeof pointer, "%s/turns/%u", parent, curve->n_turns);
        st = parse_turn(turn, pointer, curve, diag);
        if (st != GROOM_OK)
            break;
    }
    return st;
}

static groom_status parse_curve(const cJSON *json, const char *parent, struct groom_hairline *hairline, struct groom_diag *diag)
{
    struct groom_hairline_curve *curve = &hairline->curves[hairline->n_curves++];
    groom_status st = parse_points(cJSON_GetObjectItemCaseSensitive(json, "points"), parent, curve, diag);
    return st == GROOM_OK ? parse_turns(cJSON_GetObjectItemCaseSensitive(json, "turns"), parent, curve, diag) : st;
}

static groom_status parse_curves(const cJSON *curves, struct groom_hairline *hairline, struct groom_diag *diag)
{
    static const char *const names[] = {"points", "turns"};
    int many = hairline->kind == GROOM_HAIRLINE_SIDEBURNS || hairline->kind == GROOM_HAIRLINE_CROWN;
    int most = many ? GROOM_HAIRLINE_MAX_CURVES : 1;
    const cJSON *curve;
    if (!cJSON_IsArray(curves) || cJSON_GetArraySize(curves) < 1 || cJSON_GetArraySize(curves) > most)
        return groom_fail_field(diag, GROOM_EINVAL, "/curves", "%s takes a list of 1 to %d curves",
                                groom_hairline_kind_name(hairline->kind), most);
    cJSON_ArrayForEach(curve, curves) {
        char pointer[32];
        snprintf(pointer, sizeof pointer, "/curves/%u", hairline->n_curves);
        groom_status st = fields_known(curve, names, 2, pointer, "a curve", diag);
        if (st == GROOM_OK)
            st = parse_curve(curve, pointer, hairline, diag);
        if (st != GROOM_OK)
            return st;
    }
    return GROOM_OK;
}

static groom_status parse(const cJSON *json, struct groom_hairline *hairline, struct groom_diag *diag)
{
    static const char *const names[] = {"kind", "method", "points", "turns", "curves"};
    const cJSON *curves = cJSON_GetObjectItemCaseSensitive(json, "curves");
    int kind, method;
    groom_status st = fields_known(json, names, 5, "", "a hairline", diag);
    if (st == GROOM_OK)
        st = parse_name(json, "kind", kind_names, GROOM_HAIRLINE_KIND_COUNT, GROOM_HAIRLINE_FRONT, &kind, diag);
    if (st == GROOM_OK)
        st = parse_name(json, "method", method_names, GROOM_RELOCATE_COUNT, GROOM_RELOCATE_MEMBRANE, &method, diag);
    if (st != GROOM_OK)
        return st;
    hairline->kind = (groom_hairline_kind)kind;
    hairline->method = (groom_relocate_method)method;
    if (!curves)
        return parse_curve(json, "", hairline, diag);
    if (cJSON_GetObjectItemCaseSensitive(json, "points") || cJSON_GetObjectItemCaseSensitive(json, "turns"))
        return groom_fail_field(diag, GROOM_EINVAL, "/curves", "give either curves, or points and turns");
    return parse_curves(curves, hairline, diag);
}

groom_status groom_hairline_parse(const char *text, size_t n_bytes, struct groom_hairline *out, struct groom_diag *diag)
{
    cJSON *json;
    groom_status st = fields_object(text, n_bytes, "a hairline", &json, diag);
    if (st != GROOM_OK)
        return st;
    struct groom_hairline *hairline = cJSON_malloc(sizeof *hairline);
    if (hairline) {
        memset(hairline, 0, sizeof *hairline);
        st = parse(json, hairline, diag);
    } else {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the hairline");
    }
    if (st == GROOM_OK)
        *out = *hairline;
    cJSON_free(hairline);
    cJSON_Delete(json);
    return st;
}

/* --- writing ------------------------------------------------------------------------------------ */

static cJSON *turn_json(const struct groom_hairline_turn *turn)
{
    cJSON *json = cJSON_CreateObject();
    if (fields_add(json, "from", json_number(turn->from)) && fields_add(json, "to", json_number(turn->to)))
        return json;
    cJSON_Delete(json);
    return NULL;
}

static cJSON *curve_json(const struct groom_hairline_curve *curve)
{
    cJSON *json = cJSON_CreateObject(), *points = cJSON_AddArrayToObject(json, "points"), *turns = cJSON_AddArrayToObject(json, "turns");
    int sound = points && turns;
    for (uint32_t i = 0; sound && i < curve->n_points; i++)
        sound = fields_add(points, NULL, fields_point_json(curve->points[i]));
    for (uint32_t i = 0; sound && i < curve->n_turns; i++)
        sound = fields_add(turns, NULL, turn_json(&curve->turns[i]));
    if (sound)
        return json;
    cJSON_Delete(json);
    return NULL;
}

groom_status groom_hairline_print(const struct groom_hairline *hairline, char **out, struct groom_diag *diag)
{
    cJSON *json = cJSON_CreateObject();
    int sound = cJSON_AddStringToObject(json, "kind", groom_hairline_kind_name(hairline->kind)) &&
                cJSON_AddStringToObject(json, "method", groom_relocate_method_name(hairline->method));
    cJSON *curves = cJSON_AddArrayToObject(json, "curves");
    for (uint32_t i = 0; sound && i < hairline->n_curves; i++)
        sound = fields_add(curves, NULL, curve_json(&hairline->curves[i]));
    char *text = sound && curves ? cJSON_PrintUnformatted(json) : NULL;
    cJSON_Delete(json);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to print the hairline");
    *out = text;
    return GROOM_OK;
}
