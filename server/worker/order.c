#include "server/worker/order.h"

#include "groom/groom.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

static const char *text_of(const cJSON *object, const char *name)
{
    const char *text = cJSON_GetStringValue(member(object, name));
    return text ? text : "";
}

static double number_of(const cJSON *object, const char *name, double otherwise)
{
    const cJSON *item = member(object, name);
    return cJSON_IsNumber(item) ? item->valuedouble : otherwise;
}

static int is_hash(const char *text)
{
    return strlen(text) == ORDER_HASH_SIZE - 1 && strspn(text, "0123456789abcdef") == ORDER_HASH_SIZE - 1;
}

static groom_status parse_blob(const cJSON *object, const char *what, struct order_blob *blob,
                               struct groom_diag *diag)
{
    double n_bytes = number_of(object, "bytes", -1);
    if (!is_hash(text_of(object, "sha256")) || n_bytes < 0 || n_bytes > 1e15)
        return groom_fail(diag, GROOM_EFORMAT, "the daemon's order names no usable %s (sha256 and bytes)",
                          what);
    snprintf(blob->sha256, sizeof blob->sha256, "%s", text_of(object, "sha256"));
    snprintf(blob->path, sizeof blob->path, "%s", text_of(object, "path"));
    blob->n_bytes = (uint64_t)n_bytes;
    return GROOM_OK;
}

static groom_status parse_input(const cJSON *object, const char *what, struct order_input *input,
                                struct groom_diag *diag)
{
    const char *format = text_of(object, "format");
    snprintf(input->id, sizeof input->id, "%s", text_of(object, "id"));
    snprintf(input->name, sizeof input->name, "%.127s", text_of(object, "name"));
    snprintf(input->format, sizeof input->format, "%s", strcmp(format, "auto") ? format : "");
    input->frame.unit_m = number_of(object, "unit_m", 1);
    input->frame.up = strcmp(text_of(object, "up"), "z") ? GROOM_UP_Y : GROOM_UP_Z;
    return parse_blob(object, what, &input->blob, diag);
}

static groom_status copy_object(const cJSON *order_json, const char *name, char **text, struct groom_diag *diag)
{
    const cJSON *object = member(order_json, name);
    *text = cJSON_IsObject(object) ? cJSON_PrintUnformatted(object) : strdup("{}");
    return *text ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for the order's %s", name);
}

int order_is_edit(const struct order *order)
{
    groom_operator_type type;
    return groom_operator_parse(order->kind, &type, NULL) == GROOM_OK && groom_operator_is_layer(type);
}

int order_is_retargeting(const struct order *order) { return !strcmp(order->kind, "retarget"); }

static groom_status parse_targets(const cJSON *targets, struct order *order, struct groom_diag *diag)
{
    const cJSON *target;
    groom_status st = GROOM_OK;
    cJSON_ArrayForEach(target, targets)
    {
        if (order->n_targets == ORDER_MOST_TARGETS)
            return groom_fail(diag, GROOM_EFORMAT, "the daemon's order has more than %d targets", ORDER_MOST_TARGETS);
        if ((st = parse_input(target, "target", &order->targets[order->n_targets++], diag)) != GROOM_OK)
            return st;
    }
    return order->n_targets ? GROOM_OK : groom_fail(diag, GROOM_EFORMAT, "the daemon's order has no target");
}

static groom_status parse_retargeting(const cJSON *json, const cJSON *inputs, struct order *order, struct groom_diag *diag)
{
    const cJSON *strands = member(inputs, "strands"), *preparation = member(json, "preparation");
    groom_status st = parse_input(member(inputs, "source"), "source", &order->source, diag);
    if (st == GROOM_OK && strands)
        st = parse_input(strands, "strands", &order->strands, diag);
    if (st == GROOM_OK)
        st = parse_targets(member(inputs, "targets"), order, diag);
    order->keeps_preparation = preparation != NULL;
    if (st == GROOM_OK && cJSON_IsObject(preparation))
        st = parse_blob(preparation, "preparation", &order->preparation, diag);
    return st == GROOM_OK ? copy_object(json, "request", &order->request, diag) : st;
}

static groom_status parse_members(const cJSON *json, struct order *order, struct groom_diag *diag)
{
    const cJSON *inputs = member(json, "inputs"), *head = member(inputs, "head"),
                *checkpoint = member(json, "checkpoint");
    groom_status st;
    if (!cJSON_IsObject(inputs))
        return groom_fail(diag, GROOM_EFORMAT, "the daemon's order is not one: it has no inputs");
    snprintf(order->job, sizeof order->job, "%s", text_of(json, "job"));
    snprintf(order->kind, sizeof order->kind, "%s", text_of(json, "kind"));
    order->attempt = (uint32_t)number_of(json, "attempt", 1);
    st = GROOM_OK;
    if (order_is_retargeting(order))
        st = parse_retargeting(json, inputs, order, diag);
    else if (!order_is_edit(order))
        st = parse_input(member(inputs, "strands"), "strands", &order->strands, diag);
    if (st == GROOM_OK && cJSON_IsObject(head))
        st = parse_input(head, "head", &order->head, diag);
    if (st == GROOM_OK && cJSON_IsObject(checkpoint))
        st = parse_blob(checkpoint, "checkpoint", &order->checkpoint, diag);
    return st == GROOM_OK ? copy_object(json, "options", &order->options, diag) : st;
}

groom_status order_parse(const char *json, size_t n_bytes, struct order *order, struct groom_diag *diag)
{
    cJSON *object = json ? cJSON_ParseWithLength(json, n_bytes) : NULL;
    memset(order, 0, sizeof *order);
    groom_status st = parse_members(object, order, diag);
    cJSON_Delete(object);
    if (st != GROOM_OK)
        order_finish(order);
    return st;
}

void order_finish(struct order *order)
{
    free(order->options);
    free(order->request);
    memset(order, 0, sizeof *order);
}
