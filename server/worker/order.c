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

static groom_status parse_options(const cJSON *order_json, struct order *order, struct groom_diag *diag)
{
    const cJSON *options = member(order_json, "options");
    order->options = cJSON_IsObject(options) ? cJSON_PrintUnformatted(options) : strdup("{}");
    return order->options ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for the options");
}

int order_is_edit(const struct order *order)
{
    groom_operator_type type;
    return groom_operator_parse(order->kind, &type, NULL) == GROOM_OK && groom_operator_is_layer(type);
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
    if (!order_is_edit(order))
        st = parse_input(member(inputs, "strands"), "strands", &order->strands, diag);
    if (st == GROOM_OK && cJSON_IsObject(head))
        st = parse_input(head, "head", &order->head, diag);
    if (st == GROOM_OK && cJSON_IsObject(checkpoint))
        st = parse_blob(checkpoint, "checkpoint", &order->checkpoint, diag);
    return st == GROOM_OK ? parse_options(json, order, diag) : st;
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
    memset(order, 0, sizeof *order);
}
