/* The report of a retargeting as JSON. */
#include <cjson/cJSON.h>
#include <stdlib.h>

#include "base/json.h"
#include "groom/retarget.h"

static int put_number(cJSON *object, const char *name, double value) { return json_put(object, name, json_number(value)); }

/* A new object in `object`; NULL where memory is out. */
static cJSON *put_object(cJSON *object, const char *name)
{
    cJSON *item = cJSON_CreateObject();
    return json_put(object, name, item) ? item : NULL;
}

static int put_energy(cJSON *object, const char *name, const struct groom_retarget_energy *energy)
{
    cJSON *json = put_object(object, name);
    return json && put_number(json, "shape", energy->shape) && put_number(json, "inter", energy->inter) &&
           put_number(json, "body", energy->body) && put_number(json, "total", energy->total);
}

static int put_inside(cJSON *object, const char *name, const struct groom_retarget_inside *inside)
{
    cJSON *json = put_object(object, name);
    return json && put_number(json, "vertices", (double)inside->vertices) &&
           put_number(json, "segments", (double)inside->segments) &&
           put_number(json, "near_vertices", (double)inside->near_vertices) && put_number(json, "deepest", inside->deepest);
}

static int put_pair(cJSON *object, const struct groom_retarget_report *report)
{
    cJSON *energy = put_object(object, "energy"), *inside = energy ? put_object(object, "inside") : NULL;
    return inside && put_energy(energy, "before", &report->before) && put_energy(energy, "after", &report->after) &&
           put_inside(inside, "before", &report->inside_before) && put_inside(inside, "after", &report->inside_after);
}

static int put_history(cJSON *object, const struct groom_retarget_report *report)
{
    cJSON *array = cJSON_CreateArray();
    uint32_t n = report->iterations_coarse < GROOM_RETARGET_MAX_HISTORY ? report->iterations_coarse : GROOM_RETARGET_MAX_HISTORY;
    if (!json_put(object, "coarse", array))
        return 0;
    for (uint32_t i = 0; i < n; i++) {
        cJSON *step = cJSON_CreateObject();
        if (!step || !cJSON_AddItemToArray(array, step)) {
            cJSON_Delete(step);
            return 0;
        }
        if (!put_energy(step, "energy", &report->coarse[i].energy) || !put_number(step, "mean_movement", report->coarse[i].mean_movement))
            return 0;
    }
    return 1;
}

static int put_movement(cJSON *object, const char *name, const struct groom_retarget_movement *movement)
{
    cJSON *json = put_object(object, name);
    return json && put_number(json, "strands", movement->strands) && put_number(json, "mean", movement->mean) &&
           put_number(json, "max", movement->max);
}

static int put_measures(cJSON *object, const struct groom_retarget_report *report)
{
    cJSON *length = put_object(object, "length_ratio"), *movement = length ? put_object(object, "movement") : NULL;
    return movement && put_number(length, "min", report->length_ratio_min) &&
           put_number(length, "median", report->length_ratio_median) && put_number(length, "max", report->length_ratio_max) &&
           put_number(movement, "mean", report->movement_mean) && put_number(movement, "max", report->movement_max) &&
           put_movement(movement, "in_conflict", &report->movement_conflict) &&
           put_movement(movement, "others", &report->movement_others) && put_number(object, "unchanged", report->n_unchanged) &&
           put_number(object, "shorter_than_clearance", report->n_short);
}

static int put_seconds(cJSON *object, const struct groom_retarget_report *report)
{
    cJSON *json = put_object(object, "seconds");
    return json && put_number(json, "initial", report->seconds_initial) && put_number(json, "coarse", report->seconds_coarse) &&
           put_number(json, "fine", report->seconds_fine) && put_number(json, "clearance", report->seconds_clearance) &&
           put_number(json, "total", report->seconds_total);
}

groom_status groom_retarget_report_print(const struct groom_retarget_report *report, char **text, struct groom_diag *diag)
{
    cJSON *json = cJSON_CreateObject();
    int whole = json && put_number(json, "strands", report->n_strands) && put_number(json, "vertices", (double)report->n_vertices) &&
                put_number(json, "guides", report->n_guides) && put_number(json, "smoothed", (double)report->n_smoothed) &&
                put_number(json, "without_bone", (double)report->n_without_bone) &&
                put_number(json, "iterations_coarse", report->iterations_coarse) &&
                put_number(json, "iterations_fine", report->iterations_fine) && put_pair(json, report) &&
                put_measures(json, report) && put_seconds(json, report) && put_history(json, report);
    char *printed = whole ? cJSON_Print(json) : NULL;
    cJSON_Delete(json);
    if (!printed)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the report of a retargeting");
    *text = printed;
    return GROOM_OK;
}
