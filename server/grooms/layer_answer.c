/* What an edit answers. */
#include <stdlib.h>
#include <string.h>

#include "server/grooms/layer_edit.h"

static void add_sculpt(cJSON *root, const struct layer_answer *answer)
{
    const struct groom_layer_report *r = answer->report;
    cJSON *object = cJSON_AddObjectToObject(root, "energy");
    cJSON_AddNumberToObject(object, "before", r->sculpt.energy_before);
    cJSON_AddNumberToObject(object, "after", r->sculpt.energy_after);
    object = cJSON_AddObjectToObject(root, "anchor_error");
    cJSON_AddNumberToObject(object, "mean", r->sculpt.anchor_error_mean_m);
    cJSON_AddNumberToObject(object, "max", r->sculpt.anchor_error_max_m);
    object = cJSON_AddObjectToObject(root, "iterations");
    cJSON_AddNumberToObject(object, "median", r->sculpt.iterations_median);
    cJSON_AddNumberToObject(object, "max", r->sculpt.iterations_max);
    cJSON_AddNumberToObject(root, "anchors", r->sculpt.n_anchors);
    cJSON_AddNumberToObject(root, "unfinished", r->sculpt.n_stopped);
    if (!answer->has_head) {
        cJSON_AddNullToObject(root, "contact");
        return;
    }
    object = cJSON_AddObjectToObject(root, "contact");
    cJSON_AddNumberToObject(object, "checked", r->contact.n_checked);
    cJSON_AddNumberToObject(object, "entered", r->contact.n_entered);
    cJSON_AddNumberToObject(object, "inside", r->contact.n_inside);
    cJSON_AddNumberToObject(object, "depth_before", (double)r->contact.depth_before_m);
    cJSON_AddNumberToObject(object, "depth_after", (double)r->contact.depth_after_m);
}

static bool add_array(cJSON *object, const char *name, const void *elements, int is_float, uint32_t n, uint32_t width)
{
    char *text = NULL;
    size_t n_bytes;
    const uint32_t shape[] = {n, width};
    if (groom_document_array_write(elements, is_float, shape, width ? 2 : 1, &text, &n_bytes) != GROOM_OK)
        return false;
    bool added = cJSON_AddRawToObject(object, name, text) != NULL;
    free(text);
    return added;
}

static bool add_points(cJSON *root, const struct layer_answer *answer)
{
    const struct groom_strands *after = answer->after;
    size_t n_points = 0;
    for (uint32_t k = 0; k < answer->n_strands; k++)
        n_points += after->first[answer->strand[k] + 1] - after->first[answer->strand[k]];
    uint32_t *counts = malloc((answer->n_strands + 1) * sizeof *counts);
    float(*points)[3] = malloc((n_points + 1) * sizeof *points), (*to)[3] = points;
    bool fine = counts && points;
    for (uint32_t k = 0; fine && k < answer->n_strands; k++, to += counts[k - 1]) {
        uint32_t at = after->first[answer->strand[k]];
        counts[k] = after->first[answer->strand[k] + 1] - at;
        memcpy(to, after->points + at, counts[k] * sizeof *to);
    }
    cJSON *object = cJSON_AddObjectToObject(root, "points");
    fine = fine && add_array(object, "strand", answer->strand, 0, answer->n_strands, 0) &&
           add_array(object, "vertices", counts, 0, answer->n_strands, 0) &&
           add_array(object, "points", points, 1, (uint32_t)n_points, 3);
    free(counts);
    free(points);
    return fine;
}

char *layer_answer_text(const struct layer_answer *answer)
{
    cJSON *root = cJSON_CreateObject(), *strands;
    if (answer->groom_id)
        cJSON_AddStringToObject(root, "groom", answer->groom_id);
    else
        cJSON_AddNullToObject(root, "groom");
    cJSON_AddNumberToObject(root, "revision", answer->revision);
    cJSON_AddStringToObject(root, "type", groom_operator_name(answer->type));
    cJSON_AddNumberToObject(root, "operator", answer->index);
    cJSON_AddNumberToObject(root, "layer", answer->layer);
    cJSON_AddBoolToObject(root, "committed", answer->committed);
    strands = cJSON_AddObjectToObject(root, "strands");
    cJSON_AddNumberToObject(strands, "edited", answer->report->n_strands);
    cJSON_AddNumberToObject(strands, "changed", answer->report->n_changed);
    cJSON_AddNumberToObject(root, "conversion_error", (double)answer->report->conversion_error_m);
    if (answer->type == GROOM_OPERATOR_SCULPT)
        add_sculpt(root, answer);
    cJSON_AddNumberToObject(root, "seconds", answer->seconds);
    char *text = !answer->strand || add_points(root, answer) ? cJSON_PrintUnformatted(root) : NULL;
    cJSON_Delete(root);
    return text;
}
