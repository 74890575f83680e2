/* A large array inside a document: checked, copied and written. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/base64.h"
#include "model/document_node.h"

static const char *const dtype_names[] = {[DOCUMENT_F32] = "f32", [DOCUMENT_U32] = "u32"};

static const char *string_member(const cJSON *node, const char *name)
{
    return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(node, name));
}

int document_array_is(const cJSON *node)
{
    return cJSON_IsObject(node) && string_member(node, "dtype") && cJSON_GetObjectItemCaseSensitive(node, "shape");
}

static groom_status find_reference(const struct document_array *array, const char *reference,
                                   const struct groom_array_finder *finder, const void **bytes, size_t *n_bytes,
                                   struct groom_diag *diag)
{
    if (!finder)
        return groom_fail_field(diag, GROOM_EINVAL, array->pointer,
                                "arrays must be inline here: give \"data\" in place of \"$array\"");
    groom_status status = finder->find(finder->user, reference, bytes, n_bytes);
    if (status == GROOM_ENOTFOUND)
        return groom_fail_field(diag, GROOM_EINVAL, array->pointer, "no array is kept under the name \"%.72s\"",
                                reference);
    if (status != GROOM_OK)
        return groom_fail_field(diag, status, array->pointer, "array \"%.72s\" could not be read", reference);
    return GROOM_OK;
}

static groom_status check_shape(struct document_array *array, struct groom_diag *diag)
{
    const cJSON *shape = cJSON_GetObjectItemCaseSensitive(array->node, "shape"), *extent;
    uint32_t n = 0;
    array->n_elements = 1;
    if (!cJSON_IsArray(shape) || cJSON_GetArraySize(shape) != (int)array->n_dimensions)
        return groom_fail_field(diag, GROOM_EINVAL, array->pointer, "shape must have %u numbers",
                                array->n_dimensions);
    cJSON_ArrayForEach(extent, shape)
    {
        double value = cJSON_IsNumber(extent) ? extent->valuedouble : -1;
        if (!(value >= 0 && value <= UINT32_MAX) || value != (double)(uint32_t)value)
            return groom_fail_field(diag, GROOM_EINVAL, array->pointer,
                                    "shape must hold whole numbers from 0 to 4294967295");
        array->shape[n++] = (uint32_t)value;
        if (__builtin_mul_overflow(array->n_elements, (size_t)value, &array->n_elements) ||
            array->n_elements > (size_t)PTRDIFF_MAX / 4)
            return groom_fail_field(diag, GROOM_EINVAL, array->pointer, "shape is too large");
    }
    return GROOM_OK;
}

static groom_status check_length(const struct document_array *array, const struct groom_array_finder *finder,
                                 struct groom_diag *diag)
{
    const char *data = string_member(array->node, "data");
    const char *reference = string_member(array->node, "$array");
    size_t n_bytes = 0;
    if (data) {
        int64_t n_decoded = base64_decoded_length(data, strlen(data));
        n_bytes = n_decoded < 0 ? SIZE_MAX : (size_t)n_decoded;
    } else if (reference) {
        const void *bytes;
        groom_status status = find_reference(array, reference, finder, &bytes, &n_bytes, diag);
        if (status != GROOM_OK)
            return status;
    } else {
        return groom_fail_field(diag, GROOM_EINVAL, array->pointer,
                                "\"data\" is missing: base64 of little-endian numbers");
    }
    if (n_bytes == SIZE_MAX)
        return groom_fail_field(diag, GROOM_EINVAL, array->pointer,
                                "data is not base64: its length is not a multiple of 4");
    if (n_bytes != array->n_elements * 4)
        return groom_fail_field(diag, GROOM_EINVAL, array->pointer, "data has %zu bytes, its shape needs %zu",
                                n_bytes, array->n_elements * 4);
    return GROOM_OK;
}

groom_status document_array_check(const cJSON *node, const char *pointer, enum document_dtype dtype,
                                  uint32_t n_dimensions, const struct groom_array_finder *finder,
                                  struct document_array *array, struct groom_diag *diag)
{
    groom_status status;
    *array = (struct document_array){.node = node, .n_dimensions = n_dimensions};
    snprintf(array->pointer, sizeof array->pointer, "%s", pointer);
    if (!document_array_is(node))
        return groom_fail_field(diag, GROOM_EINVAL, pointer,
                                "an array is needed here: {\"dtype\":\"%s\",\"shape\":[…],\"data\":\"…\"}",
                                dtype_names[dtype]);
    if (strcmp(string_member(node, "dtype"), dtype_names[dtype]) != 0)
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "dtype must be \"%s\"", dtype_names[dtype]);
    if ((status = check_shape(array, diag)) != GROOM_OK)
        return status;
    return check_length(array, finder, diag);
}

groom_status document_array_copy(const struct document_array *array, const struct groom_array_finder *finder,
                                 void *out, struct groom_diag *diag)
{
    const char *data = string_member(array->node, "data");
    if (data) {
        if (base64_decode(data, strlen(data), out) != 0)
            return groom_fail_field(diag, GROOM_EINVAL, array->pointer, "data is not base64");
        return GROOM_OK;
    }
    const void *bytes;
    size_t n_bytes;
    groom_status status =
        find_reference(array, string_member(array->node, "$array"), finder, &bytes, &n_bytes, diag);
    if (status == GROOM_OK)
        memcpy(out, bytes, array->n_elements * 4);
    return status;
}

/* Adds the text, taking it over: cJSON would copy megabytes. */
static groom_status add_text(cJSON *node, const char *name, char *text)
{
    cJSON *data = cJSON_AddStringToObject(node, name, "");
    if (!data) {
        free(text);
        return GROOM_ENOMEM;
    }
    cJSON_free(data->valuestring);
    data->valuestring = text;
    return GROOM_OK;
}

static groom_status add_inline(cJSON *node, const void *bytes, size_t n_bytes)
{
    char *text = malloc(base64_encoded_length(n_bytes) + 1);
    if (!text)
        return GROOM_ENOMEM;
    base64_encode(bytes, n_bytes, text);
    return add_text(node, "data", text);
}

static groom_status add_reference(cJSON *node, const void *bytes, size_t n_bytes,
                                  const struct groom_array_keeper *keeper)
{
    char reference[GROOM_ARRAY_REFERENCE_SIZE];
    groom_status status = keeper->keep(keeper->user, bytes, n_bytes, reference);
    if (status != GROOM_OK)
        return status;
    return cJSON_AddStringToObject(node, "$array", reference) ? GROOM_OK : GROOM_ENOMEM;
}

groom_status document_array_create(const void *elements, enum document_dtype dtype, const uint32_t *shape,
                                   uint32_t n_dimensions, const struct groom_array_keeper *keeper, cJSON **out)
{
    size_t n_bytes = 4;
    groom_status status = GROOM_ENOMEM;
    cJSON *node = cJSON_CreateObject();
    if (!cJSON_AddStringToObject(node, "dtype", dtype_names[dtype]))
        goto out;
    cJSON *extents = cJSON_AddArrayToObject(node, "shape");
    for (uint32_t i = 0; i < n_dimensions; i++) {
        n_bytes *= shape[i];
        if (!cJSON_AddItemToArray(extents, cJSON_CreateNumber(shape[i])))
            goto out;
    }
    status = keeper ? add_reference(node, elements, n_bytes, keeper) : add_inline(node, elements, n_bytes);
    if (status != GROOM_OK)
        goto out;
    *out = node;
    node = NULL;
out:
    cJSON_Delete(node);
    return status;
}

/* Without a tree: cJSON would look at every character of megabytes twice. */
groom_status groom_document_array_write(const void *elements, int is_float, const uint32_t *shape,
                                        uint32_t n_dimensions, char **json, size_t *n_bytes)
{
    size_t n_data = 4;
    for (uint32_t i = 0; i < n_dimensions; i++)
        n_data *= shape[i];
    char *text = malloc(base64_encoded_length(n_data) + 160);
    if (!text)
        return GROOM_ENOMEM;
    int at = sprintf(text, "{\"dtype\":\"%s\",\"shape\":[", dtype_names[is_float ? DOCUMENT_F32 : DOCUMENT_U32]);
    for (uint32_t i = 0; i < n_dimensions; i++)
        at += sprintf(text + at, "%s%u", i ? "," : "", shape[i]);
    at += sprintf(text + at, "],\"data\":\"");
    base64_encode(elements, n_data, text + at);
    size_t end = (size_t)at + base64_encoded_length(n_data);
    memcpy(text + end, "\"}", 3);
    *json = text;
    *n_bytes = end + 2;
    return GROOM_OK;
}

groom_status document_array_inline(cJSON *node, const struct groom_array_finder *finder, struct groom_diag *diag)
{
    const char *reference = string_member(node, "$array");
    struct document_array array = {.node = node};
    const void *bytes;
    size_t n_bytes;
    if (!reference)
        return GROOM_OK;
    groom_status status = find_reference(&array, reference, finder, &bytes, &n_bytes, diag);
    if (status != GROOM_OK)
        return status;
    if ((status = add_inline(node, bytes, n_bytes)) != GROOM_OK)
        return groom_fail(diag, status, "no memory for an array of %zu bytes", n_bytes);
    cJSON_DeleteItemFromObjectCaseSensitive(node, "$array");
    return GROOM_OK;
}

groom_status document_array_keep(cJSON *node, const struct groom_array_keeper *keeper)
{
    const char *data = string_member(node, "data");
    int64_t n_bytes = data ? base64_decoded_length(data, strlen(data)) : -1;
    void *bytes = n_bytes > 0 ? malloc((size_t)n_bytes) : NULL;
    groom_status status = GROOM_OK;
    if (n_bytes <= 0)
        return GROOM_OK;
    if (!bytes)
        return GROOM_ENOMEM;
    if (base64_decode(data, strlen(data), bytes) == 0 &&
        (status = add_reference(node, bytes, (size_t)n_bytes, keeper)) == GROOM_OK)
        cJSON_DeleteItemFromObjectCaseSensitive(node, "data");
    free(bytes);
    return status;
}
