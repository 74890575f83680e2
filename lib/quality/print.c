/* The quality report as JSON. */
#include <cjson/cJSON.h>
#include <math.h>

#include "base/json.h"
#include "groom/quality.h"

static int put(cJSON *json, const char *name, double value)
{
    cJSON *item = json_number(value);
    if (item && cJSON_AddItemToObject(json, name, item))
        return 1;
    cJSON_Delete(item);
    return 0;
}

static int put_distance(cJSON *json, const char *name, const struct groom_quality_distance *distance)
{
    cJSON *item = cJSON_AddObjectToObject(json, name);
    return item && put(item, "distance", distance->distance) && put(item, "floor", distance->floor);
}

static int put_nearest(cJSON *json, const char *name, const struct groom_quality_nearest *nearest)
{
    cJSON *item = cJSON_AddObjectToObject(json, name);
    return item && put(item, "mean", nearest->mean) && put(item, "p95", nearest->p95);
}

static int put_score(cJSON *scores, const struct groom_quality_score *score)
{
    cJSON *item = cJSON_CreateObject();
    if (!item || !cJSON_AddItemToArray(scores, item)) {
        cJSON_Delete(item);
        return 0;
    }
    return put(item, "distance", score->distance) && put(item, "angle", score->angle) &&
           put(item, "precision", score->precision) && put(item, "recall", score->recall) &&
           put(item, "f_score", score->f_score) && put(item, "floor", score->floor) &&
           put(item, "nearest_precision", score->nearest_precision) &&
           put(item, "nearest_recall", score->nearest_recall) && put(item, "nearest_f_score", score->nearest_f_score) &&
           put(item, "nearest_floor", score->nearest_floor);
}

static int put_scores(cJSON *json, const struct groom_quality *quality)
{
    cJSON *scores = cJSON_AddArrayToObject(json, "scores");
    for (int k = 0; scores && k < GROOM_QUALITY_TOLERANCES; k++)
        if (!put_score(scores, &quality->scores[k]))
            return 0;
    return scores != NULL;
}

/* To a millionth: a plot shows no more. */
static int put_bins(cJSON *json, const char *name, const double *bins)
{
    double rounded[GROOM_QUALITY_BINS];
    for (int b = 0; b < GROOM_QUALITY_BINS; b++)
        rounded[b] = round(bins[b] * 1e6) / 1e6;
    cJSON *array = cJSON_CreateDoubleArray(rounded, GROOM_QUALITY_BINS);
    if (array && cJSON_AddItemToObject(json, name, array))
        return 1;
    cJSON_Delete(array);
    return 0;
}

static int put_histogram(cJSON *json, const char *name, const struct groom_quality_histogram *histogram)
{
    cJSON *item = cJSON_AddObjectToObject(json, name);
    return item && put(item, "low", histogram->low) && put(item, "high", histogram->high) &&
           put_bins(item, "target", histogram->target) && put_bins(item, "groom", histogram->groom);
}

static int put_histograms(cJSON *json, const struct groom_quality *quality)
{
    cJSON *item = cJSON_AddObjectToObject(json, "histograms");
    return item && put_histogram(item, "curvature", &quality->curvatures) &&
           put_histogram(item, "torsion", &quality->torsions) && put_histogram(item, "length", &quality->lengths);
}

static int put_head(cJSON *json, const char *name, const struct groom_quality_head *head)
{
    cJSON *item = cJSON_AddObjectToObject(json, name);
    return item && put(item, "strands", head->strands) && put(item, "vertices", head->vertices) &&
           put(item, "segments", head->segments) && put(item, "share", head->share) && put(item, "deepest", head->deepest);
}

static int put_heads(cJSON *json, const struct groom_quality *quality)
{
    cJSON *item = quality->has_head ? cJSON_AddObjectToObject(json, "inside_head") : cJSON_AddNullToObject(json, "inside_head");
    return item && (!quality->has_head ||
                    (put_head(item, "target", &quality->head_target) && put_head(item, "groom", &quality->head_groom)));
}

static int put_pairs(cJSON *json, const struct groom_quality *quality)
{
    cJSON *item = quality->has_pairs ? cJSON_AddObjectToObject(json, "paired") : cJSON_AddNullToObject(json, "paired");
    return item && (!quality->has_pairs ||
                    (put(item, "distance", quality->pair_distance) && put(item, "direction", quality->pair_direction)));
}

static int put_all_nearest(cJSON *json, const struct groom_quality *quality)
{
    cJSON *item = cJSON_AddObjectToObject(json, "nearest");
    return item && put_nearest(item, "to_target", &quality->to_target) &&
           put_nearest(item, "to_groom", &quality->to_groom) && put_nearest(item, "floor", &quality->floor);
}

static int put_quality(cJSON *json, const char *name, const struct groom_quality *quality)
{
    cJSON *item;
    if (!quality)
        return cJSON_AddNullToObject(json, name) != NULL;
    item = cJSON_AddObjectToObject(json, name);
    return item && put_distance(item, "spectra", &quality->spectra) && put_distance(item, "segments", &quality->segments) &&
           put_distance(item, "curvature", &quality->curvature) && put_distance(item, "torsion", &quality->torsion) &&
           put_distance(item, "length", &quality->length) && put_all_nearest(item, quality) && put_scores(item, quality) &&
           put_heads(item, quality) && put_pairs(item, quality) && put_histograms(item, quality);
}

static int put_counts(cJSON *json, const struct groom_quality *quality)
{
    cJSON *item = cJSON_AddObjectToObject(json, "strands");
    return item && put(item, "target", quality->n_target) && put(item, "groom", quality->n_groom) &&
           put(item, "target_length", quality->length_target) && put(item, "groom_length", quality->length_groom) &&
           put(item, "bend_vertices", quality->bend_vertices);
}

groom_status groom_quality_print(const struct groom_quality *fitted, const struct groom_quality *drawn, char **out,
                                 struct groom_diag *diag)
{
    cJSON *json = cJSON_CreateObject();
    char *text = NULL;
    if (json && cJSON_AddStringToObject(json, "format", "quality/1") && put_counts(json, fitted) &&
        put_quality(json, "fitted", fitted) && put_quality(json, "drawn", drawn))
        text = cJSON_PrintUnformatted(json);
    cJSON_Delete(json);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a quality report");
    *out = text;
    return GROOM_OK;
}
