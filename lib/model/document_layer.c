/* What a layer holds beside its parameters, as JSON (groom/document.h lists the members). */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "model/document_strands.h"
#include "model/model.h"

#define MAX_SEED 9007199254740991.0 /* beyond it a seed would not survive JSON's doubles */
#define MOST_ELEMENTS 1024
#define MOST_FRAMES 65536

struct reader {
    const cJSON *node;
    uint32_t index;
    const struct groom *groom;
    const struct groom_array_finder *finder;
    struct groom_layer *layer;
    struct groom_diag *diag;
};

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

/* A failure at /operators/<index>/<field>. */
__attribute__((format(printf, 3, 4))) static groom_status refuse(const struct reader *r, const char *field,
                                                                 const char *format, ...)
{
    char pointer[sizeof r->diag->pointer], detail[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    snprintf(pointer, sizeof pointer, "/operators/%u/%.60s", r->index, field);
    return groom_fail_field(r->diag, GROOM_EINVAL, pointer, "%s", detail);
}

static int is_whole(const cJSON *node, double maximum)
{
    return cJSON_IsNumber(node) && node->valuedouble >= 0 && node->valuedouble <= maximum &&
           !(node->valuedouble > floor(node->valuedouble));
}

/* A misspelt member of something below must not pass as left out. */
static groom_status refuse_others(const struct reader *r, const char *field, const cJSON *object, const char *known)
{
    const cJSON *child;
    char word[48], path[96];
    cJSON_ArrayForEach(child, object)
    {
        snprintf(word, sizeof word, " %.40s ", child->string);
        if (strstr(known, word))
            continue;
        snprintf(path, sizeof path, "%.40s/%.40s", field, child->string);
        return refuse(r, path, "there is no such member here; there are:%s", known);
    }
    return GROOM_OK;
}

/* --- elements, groups ---------------------------------------------------------------------- */

static groom_status read_elements(const struct reader *r)
{
    const cJSON *elements = member(r->node, "elements");
    const char *word = cJSON_GetStringValue(elements);
    if (!elements || (word && strcmp(word, "auto") == 0))
        return GROOM_OK;
    if (!is_whole(elements, MOST_ELEMENTS) || elements->valuedouble < 1)
        return refuse(r, "elements", "elements is \"auto\", or a whole number from 1 to %d", MOST_ELEMENTS);
    r->layer->n_elements = (uint32_t)elements->valuedouble;
    return GROOM_OK;
}

static groom_status read_clusters(const struct reader *r, const char *field, const cJSON *node)
{
    char path[32];
    const cJSON *count = member(node, "count"), *seed = member(node, "seed");
    groom_status status = refuse_others(r, field, node, " count seed ");
    if (status != GROOM_OK)
        return status;
    snprintf(path, sizeof path, "%s/count", field);
    if (!is_whole(count, UINT32_MAX))
        return refuse(r, path, "count is how many clusters there are to be, a whole number");
    snprintf(path, sizeof path, "%s/seed", field);
    if (seed && !is_whole(seed, MAX_SEED))
        return refuse(r, path, "a seed is a whole number, from 0, that a double holds exactly");
    r->layer->grouping.kind = GROOM_GROUPING_CLUSTERS;
    r->layer->grouping.count = (uint32_t)count->valuedouble;
    r->layer->grouping.seed = seed ? (uint64_t)seed->valuedouble : 1;
    return GROOM_OK;
}

static groom_status list_groups(const struct reader *r, const cJSON *node, uint32_t *of_strand)
{
    const cJSON *child;
    uint32_t i = 0;
    if (cJSON_GetArraySize(node) != (int)r->groom->n_strands)
        return refuse(r, "groups", "%d groups are given; each of the %u strands needs one", cJSON_GetArraySize(node),
                      r->groom->n_strands);
    cJSON_ArrayForEach(child, node)
    {
        if (!is_whole(child, UINT32_MAX - 1))
            return refuse(r, "groups", "the group of strand %u is not a whole number from 0", i);
        of_strand[i++] = (uint32_t)child->valuedouble;
    }
    return GROOM_OK;
}

static groom_status copy_groups(const struct reader *r, const cJSON *node, uint32_t *of_strand)
{
    char pointer[64];
    struct document_array array;
    snprintf(pointer, sizeof pointer, "/operators/%u/groups", r->index);
    groom_status status = document_array_check(node, pointer, DOCUMENT_U32, 1, r->finder, &array, r->diag);
    if (status == GROOM_OK && array.shape[0] != r->groom->n_strands)
        return refuse(r, "groups", "%u groups are given; each of the %u strands needs one", array.shape[0],
                      r->groom->n_strands);
    return status == GROOM_OK ? document_array_copy(&array, r->finder, of_strand, r->diag) : status;
}

static groom_status read_given(const struct reader *r, const cJSON *node)
{
    struct groom_grouping *grouping = &r->layer->grouping;
    uint32_t n = r->groom->n_strands;
    grouping->of_strand = memory_array(r->groom->allocator, n, sizeof *grouping->of_strand);
    if (!grouping->of_strand)
        return groom_fail(r->diag, GROOM_ENOMEM, "no memory for the groups of %u strands", n);
    grouping->kind = GROOM_GROUPING_GIVEN;
    groom_status status = cJSON_IsArray(node) ? list_groups(r, node, grouping->of_strand)
                                              : copy_groups(r, node, grouping->of_strand);
    for (uint32_t i = 0; status == GROOM_OK && i < n; i++) {
        if (grouping->of_strand[i] == UINT32_MAX)
            return refuse(r, "groups", "the group of strand %u is not below 4294967295", i);
        grouping->count = grouping->of_strand[i] >= grouping->count ? grouping->of_strand[i] + 1 : grouping->count;
    }
    return status;
}

static groom_status read_groups(const struct reader *r)
{
    const cJSON *groups = member(r->node, "groups");
    const char *word = cJSON_GetStringValue(groups);
    if (!groups || cJSON_IsNull(groups) || (word && strcmp(word, "all") == 0))
        return GROOM_OK;
    if (word && strcmp(word, "operator_guides") == 0) {
        r->layer->grouping.kind = GROOM_GROUPING_OPERATOR_GUIDES;
        return GROOM_OK;
    }
    if (cJSON_IsArray(groups) || document_array_is(groups))
        return read_given(r, groups);
    if (cJSON_IsObject(groups))
        return read_clusters(r, "groups", groups);
    return refuse(r, "groups", "groups is \"all\", \"operator_guides\", {\"count\":K,\"seed\":S} for k-means, or the group of "
                               "each strand");
}

/* --- sculpt ------------------------------------------------------------------------------------ */

static groom_status read_vector(const struct reader *r, const char *path, const cJSON *node, uint32_t n, float *out)
{
    const cJSON *child;
    uint32_t i = 0;
    int good = cJSON_IsArray(node) && cJSON_GetArraySize(node) == (int)n;
    cJSON_ArrayForEach(child, node)
    {
        good = good && cJSON_IsNumber(child);
    }
    if (!good)
        return refuse(r, path, "%u finite numbers in a list are needed here", n);
    cJSON_ArrayForEach(child, node)
    {
        out[i++] = (float)child->valuedouble;
    }
    return GROOM_OK;
}

static groom_status read_anchor(const struct reader *r, const char *name, uint32_t i, const cJSON *node,
                                struct groom_layer_anchors *anchors)
{
    char path[64];
    const cJSON *strand = member(node, "strand"), *at = member(node, "at");
    snprintf(path, sizeof path, "%s/%u", name, i);
    groom_status status = refuse_others(r, path, node, " strand at position ");
    if (status != GROOM_OK)
        return status;
    snprintf(path, sizeof path, "%s/%u/strand", name, i);
    if (!is_whole(strand, UINT32_MAX))
        return refuse(r, path, "strand is the number of a strand, from 0");
    snprintf(path, sizeof path, "%s/%u/at", name, i);
    if (!cJSON_IsNumber(at))
        return refuse(r, path, "at is a number from 0 (root) to 1 (tip)");
    anchors->strand[i] = (uint32_t)strand->valuedouble;
    anchors->at[i] = (float)at->valuedouble;
    snprintf(path, sizeof path, "%s/%u/position", name, i);
    return read_vector(r, path, member(node, "position"), 3, anchors->position[i]);
}

static groom_status list_anchors(const struct reader *r, const char *name, const cJSON *node,
                                 struct groom_layer_anchors *anchors)
{
    const cJSON *child;
    uint32_t i = 0;
    groom_status status = groom_layer_anchors_resize(anchors, (uint32_t)cJSON_GetArraySize(node), r->groom->allocator);
    if (status != GROOM_OK)
        return groom_fail(r->diag, status, "no memory for %d anchors", cJSON_GetArraySize(node));
    cJSON_ArrayForEach(child, node)
    {
        if ((status = read_anchor(r, name, i++, child, anchors)) != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

static groom_status copy_anchors(const struct reader *r, const char *name, const cJSON *node,
                                 struct groom_layer_anchors *anchors)
{
    char pointer[3][64];
    struct document_array strand, at, position;
    groom_status status;
    for (int i = 0; i < 3; i++)
        snprintf(pointer[i], sizeof pointer[i], "/operators/%u/%s/%s", r->index, name,
                 (const char *[]){"strand", "at", "position"}[i]);
    if ((status = refuse_others(r, name, node, " strand at position ")) != GROOM_OK ||
        (status = document_array_check(member(node, "strand"), pointer[0], DOCUMENT_U32, 1, r->finder, &strand,
                                       r->diag)) != GROOM_OK ||
        (status = document_array_check(member(node, "at"), pointer[1], DOCUMENT_F32, 1, r->finder, &at, r->diag)) !=
            GROOM_OK ||
        (status = document_array_check(member(node, "position"), pointer[2], DOCUMENT_F32, 2, r->finder, &position,
                                       r->diag)) != GROOM_OK)
        return status;
    if (at.shape[0] != strand.shape[0] || position.shape[0] != strand.shape[0] || position.shape[1] != 3)
        return refuse(r, name, "strand has %u numbers: at needs as many, and position that many times 3", strand.shape[0]);
    if ((status = groom_layer_anchors_resize(anchors, strand.shape[0], r->groom->allocator)) != GROOM_OK)
        return groom_fail(r->diag, status, "no memory for %u anchors", strand.shape[0]);
    if (strand.shape[0] == 0)
        return GROOM_OK;
    if ((status = document_array_copy(&strand, r->finder, anchors->strand, r->diag)) != GROOM_OK ||
        (status = document_array_copy(&at, r->finder, anchors->at, r->diag)) != GROOM_OK)
        return status;
    return document_array_copy(&position, r->finder, anchors->position, r->diag);
}

static groom_status read_anchors(const struct reader *r, const char *name, struct groom_layer_anchors *anchors)
{
    const cJSON *node = member(r->node, name);
    if (!node || cJSON_IsNull(node))
        return GROOM_OK;
    if (cJSON_IsArray(node))
        return list_anchors(r, name, node, anchors);
    if (cJSON_IsObject(node))
        return copy_anchors(r, name, node, anchors);
    return refuse(r, name, "a list of {\"strand\",\"at\",\"position\"} is needed here, or arrays of these three");
}

static groom_status read_frame(const struct reader *r, uint32_t i, const cJSON *node, struct groom_layer_frame *frame)
{
    char path[64];
    const cJSON *cluster = member(node, "cluster"), *at = member(node, "at"), *rows = member(node, "transform"), *row;
    int k = 0;
    snprintf(path, sizeof path, "frames/%u", i);
    groom_status status = refuse_others(r, path, node, " cluster at transform ");
    snprintf(path, sizeof path, "frames/%u/cluster", i);
    if (status == GROOM_OK && !is_whole(cluster, UINT32_MAX))
        status = refuse(r, path, "cluster is the number of a cluster, from 0");
    snprintf(path, sizeof path, "frames/%u/at", i);
    if (status == GROOM_OK && !cJSON_IsNumber(at))
        status = refuse(r, path, "at is a number from 0 (root) to 1 (tip)");
    snprintf(path, sizeof path, "frames/%u/transform", i);
    if (status == GROOM_OK && (!cJSON_IsArray(rows) || cJSON_GetArraySize(rows) != 3))
        status = refuse(r, path, "a transform is three rows of four finite numbers");
    if (status != GROOM_OK)
        return status;
    frame->cluster = (uint32_t)cluster->valuedouble;
    frame->at = (float)at->valuedouble;
    cJSON_ArrayForEach(row, rows)
    {
        if ((status = read_vector(r, path, row, 4, frame->transform[k++])) != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

static groom_status read_frames(const struct reader *r)
{
    const cJSON *frames = member(r->node, "frames"), *clusters = member(r->node, "clusters"), *child;
    uint32_t i = 0;
    groom_status status = GROOM_OK;
    if (clusters && !cJSON_IsNull(clusters))
        status = cJSON_IsObject(clusters) ? read_clusters(r, "clusters", clusters)
                                          : refuse(r, "clusters", "clusters is {\"count\":K,\"seed\":S}");
    if (status != GROOM_OK || !frames || cJSON_IsNull(frames))
        return status;
    if (!cJSON_IsArray(frames) || cJSON_GetArraySize(frames) > MOST_FRAMES)
        return refuse(r, "frames", "frames is a list of at most %d {\"cluster\",\"at\",\"transform\"}", MOST_FRAMES);
    if (groom_layer_frames_resize(r->layer, (uint32_t)cJSON_GetArraySize(frames), r->groom->allocator) != GROOM_OK)
        return groom_fail(r->diag, GROOM_ENOMEM, "no memory for the frames");
    cJSON_ArrayForEach(child, frames)
    {
        if ((status = read_frame(r, i, child, &r->layer->frames[i])) != GROOM_OK)
            return status;
        i++;
    }
    return GROOM_OK;
}

/* --- interpolate, curl_scale --------------------------------------------------------------------- */

static groom_status read_target(const struct reader *r)
{
    const cJSON *target = member(r->node, "target"), *revision = member(target, "revision");
    const char *id = cJSON_GetStringValue(member(target, "groom"));
    char pointer[40];
    const struct groom_context context = {.allocator = r->groom->allocator};
    if (!target || cJSON_IsNull(target))
        return GROOM_OK;
    groom_status status = refuse_others(r, "target", target, " groom revision vertices points ");
    if (status != GROOM_OK)
        return status;
    if (id && strlen(id) < sizeof r->layer->target_id)
        memcpy(r->layer->target_id, id, strlen(id) + 1);
    if (is_whole(revision, UINT32_MAX))
        r->layer->target_revision = (uint32_t)revision->valuedouble;
    snprintf(pointer, sizeof pointer, "/operators/%u/target", r->index);
    return document_strands_read(target, pointer, r->finder, &context, &r->layer->target, r->diag);
}

static groom_status read_curls(const struct reader *r)
{
    const cJSON *keep = member(r->node, "keep"), *hold = member(r->node, "hold_direction"), *group = member(r->node, "group");
    const char *word = cJSON_GetStringValue(keep);
    if (keep && (!word || (strcmp(word, "length") && strcmp(word, "turns"))))
        return refuse(r, "keep", "keep is \"length\" or \"turns\"");
    if (hold && !cJSON_IsBool(hold))
        return refuse(r, "hold_direction", "hold_direction is true or false");
    if (group && !cJSON_IsNull(group) && !is_whole(group, UINT32_MAX))
        return refuse(r, "group", "group is the number of a group, from 0");
    r->layer->keep_turns = word && strcmp(word, "turns") == 0;
    r->layer->free_direction = hold && !cJSON_IsTrue(hold);
    r->layer->by_group = group && !cJSON_IsNull(group);
    r->layer->group = r->layer->by_group ? (uint32_t)group->valuedouble : 0;
    return read_groups(r);
}

/* --- the layer -------------------------------------------------------------------------------------- */

int document_layer_has(groom_operator_type type, const char *name)
{
    const char *members = type == GROOM_OPERATOR_RUFFLE        ? " elements groups "
                          : type == GROOM_OPERATOR_SCULPT      ? " elements anchors contact clusters frames "
                          : type == GROOM_OPERATOR_INTERPOLATE ? " elements target "
                          : type == GROOM_OPERATOR_CURL_SCALE  ? " elements groups group keep hold_direction "
                                                               : "";
    char word[48];
    snprintf(word, sizeof word, " %.40s ", name);
    return strstr(members, word) != NULL;
}

groom_status document_layer_read(const cJSON *node, uint32_t index, const struct groom *groom,
                                 const struct groom_array_finder *finder, struct groom_operator *op,
                                 struct groom_diag *diag)
{
    const struct reader r = {node, index, groom, finder, op->layer, diag};
    groom_status status = read_elements(&r);
    if (status != GROOM_OK)
        return status;
    switch (op->type) {
    case GROOM_OPERATOR_RUFFLE: return read_groups(&r);
    case GROOM_OPERATOR_SCULPT:
        if ((status = read_anchors(&r, "anchors", &op->layer->anchors)) != GROOM_OK ||
            (status = read_anchors(&r, "contact", &op->layer->contact)) != GROOM_OK)
            return status;
        return read_frames(&r);
    case GROOM_OPERATOR_INTERPOLATE: return read_target(&r);
    case GROOM_OPERATOR_CURL_SCALE: return read_curls(&r);
    default: return GROOM_OK;
    }
}

/* --- writing -------------------------------------------------------------------------------------------- */

static groom_status need(const void *made) { return made ? GROOM_OK : GROOM_ENOMEM; }

static groom_status add_array(cJSON *node, const char *name, const void *elements, enum document_dtype dtype,
                              const uint32_t *shape, uint32_t n_dimensions, const struct groom_array_keeper *keeper)
{
    cJSON *array = NULL;
    groom_status status = document_array_create(elements, dtype, shape, n_dimensions, keeper, &array);
    if (status == GROOM_OK && !cJSON_AddItemToObject(node, name, array)) {
        cJSON_Delete(array);
        return GROOM_ENOMEM;
    }
    return status;
}

static groom_status write_anchors(const struct groom_layer_anchors *anchors, const char *name,
                                  const struct groom_array_keeper *keeper, cJSON *node)
{
    const uint32_t shape[] = {anchors->n, 3};
    groom_status status;
    cJSON *object;
    if (anchors->n == 0)
        return GROOM_OK;
    if (!(object = cJSON_AddObjectToObject(node, name)))
        return GROOM_ENOMEM;
    if ((status = add_array(object, "strand", anchors->strand, DOCUMENT_U32, shape, 1, keeper)) != GROOM_OK ||
        (status = add_array(object, "at", anchors->at, DOCUMENT_F32, shape, 1, keeper)) != GROOM_OK)
        return status;
    return add_array(object, "position", anchors->position, DOCUMENT_F32, shape, 2, keeper);
}

static groom_status write_clusters(const struct groom_grouping *grouping, const char *name, cJSON *node)
{
    cJSON *object = cJSON_AddObjectToObject(node, name);
    if (!object || !cJSON_AddNumberToObject(object, "count", grouping->count))
        return GROOM_ENOMEM;
    return need(cJSON_AddNumberToObject(object, "seed", (double)grouping->seed));
}

static groom_status write_groups(const struct groom *groom, const struct groom_grouping *grouping,
                                 const struct groom_array_keeper *keeper, cJSON *node)
{
    switch (grouping->kind) {
    case GROOM_GROUPING_CLUSTERS: return write_clusters(grouping, "groups", node);
    case GROOM_GROUPING_OPERATOR_GUIDES: return need(cJSON_AddStringToObject(node, "groups", "operator_guides"));
    case GROOM_GROUPING_GIVEN:
        return add_array(node, "groups", grouping->of_strand, DOCUMENT_U32, &groom->n_strands, 1, keeper);
    case GROOM_GROUPING_ALL: break;
    }
    return need(cJSON_AddStringToObject(node, "groups", "all"));
}

/* Nine digits, which every float survives; the nodes are raw numbers, as those of parameters are. */
static groom_status add_raw(cJSON *list, float value)
{
    char text[32];
    snprintf(text, sizeof text, "%.9g", (double)value);
    cJSON *raw = cJSON_CreateRaw(text);
    if (raw && cJSON_AddItemToArray(list, raw))
        return GROOM_OK;
    cJSON_Delete(raw);
    return GROOM_ENOMEM;
}

static groom_status write_frame(const struct groom_layer_frame *frame, cJSON *list)
{
    char at[32];
    cJSON *node = cJSON_CreateObject(), *rows;
    if (!cJSON_AddItemToArray(list, node)) {
        cJSON_Delete(node);
        return GROOM_ENOMEM;
    }
    snprintf(at, sizeof at, "%.9g", (double)frame->at);
    if (!cJSON_AddNumberToObject(node, "cluster", frame->cluster) || !cJSON_AddRawToObject(node, "at", at) ||
        !(rows = cJSON_AddArrayToObject(node, "transform")))
        return GROOM_ENOMEM;
    for (int i = 0; i < 3; i++) {
        cJSON *row = cJSON_CreateArray();
        if (!cJSON_AddItemToArray(rows, row)) {
            cJSON_Delete(row);
            return GROOM_ENOMEM;
        }
        for (int k = 0; k < 4; k++)
            if (add_raw(row, frame->transform[i][k]) != GROOM_OK)
                return GROOM_ENOMEM;
    }
    return GROOM_OK;
}

static groom_status write_frames(const struct groom_layer *layer, cJSON *node)
{
    groom_status status = GROOM_OK;
    if (layer->grouping.kind == GROOM_GROUPING_CLUSTERS)
        status = write_clusters(&layer->grouping, "clusters", node);
    if (status != GROOM_OK || layer->n_frames == 0)
        return status;
    cJSON *list = cJSON_AddArrayToObject(node, "frames");
    for (uint32_t i = 0; list && i < layer->n_frames; i++)
        if (write_frame(&layer->frames[i], list) != GROOM_OK)
            return GROOM_ENOMEM;
    return need(list);
}

static groom_status write_target(const struct groom_layer *layer, const struct groom_array_keeper *keeper, cJSON *node)
{
    if (!layer->target)
        return GROOM_OK;
    cJSON *target = cJSON_AddObjectToObject(node, "target");
    if (!target || (layer->target_id[0] && !cJSON_AddStringToObject(target, "groom", layer->target_id)) ||
        (layer->target_revision && !cJSON_AddNumberToObject(target, "revision", layer->target_revision)))
        return GROOM_ENOMEM;
    return document_strands_write(layer->target->n_strands, layer->target->first,
                                  (const float(*)[3])layer->target->points, keeper, target);
}

static groom_status write_curls(const struct groom_layer *layer, cJSON *node)
{
    if (layer->by_group && !cJSON_AddNumberToObject(node, "group", layer->group))
        return GROOM_ENOMEM;
    if (!cJSON_AddStringToObject(node, "keep", layer->keep_turns ? "turns" : "length"))
        return GROOM_ENOMEM;
    return need(cJSON_AddBoolToObject(node, "hold_direction", !layer->free_direction));
}

groom_status document_layer_write(const struct groom *groom, const struct groom_operator *op,
                                  const struct groom_array_keeper *keeper, cJSON *node)
{
    const struct groom_layer *layer = op->layer;
    groom_status status = layer->n_elements ? need(cJSON_AddNumberToObject(node, "elements", layer->n_elements))
                                            : need(cJSON_AddStringToObject(node, "elements", "auto"));
    if (status == GROOM_OK && (op->type == GROOM_OPERATOR_RUFFLE || op->type == GROOM_OPERATOR_CURL_SCALE))
        status = write_groups(groom, &layer->grouping, keeper, node);
    if (status == GROOM_OK && op->type == GROOM_OPERATOR_CURL_SCALE)
        status = write_curls(layer, node);
    if (status == GROOM_OK && op->type == GROOM_OPERATOR_INTERPOLATE)
        status = write_target(layer, keeper, node);
    if (status != GROOM_OK || op->type != GROOM_OPERATOR_SCULPT)
        return status;
    if ((status = write_anchors(&layer->anchors, "anchors", keeper, node)) != GROOM_OK ||
        (status = write_anchors(&layer->contact, "contact", keeper, node)) != GROOM_OK)
        return status;
    return write_frames(layer, node);
}
