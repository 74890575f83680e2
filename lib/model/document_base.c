/* Dense strands in a document: a groom's base, or a layer's target. */
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "model/document_node.h"
#include "model/document_strands.h"

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

/* --- strands of any vertex counts ------------------------------------------------------ */

/* From counts to beginnings; they must come to n_points. */
static groom_status sum_counts(const struct document_array *counts, struct groom_strands *strands, struct groom_diag *diag)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < strands->n_strands; i++) {
        uint32_t n = strands->first[i + 1];
        if (n < 2)
            return groom_fail_field(diag, GROOM_EINVAL, counts->pointer, "strand %u has %u vertices; it needs 2 or more", i, n);
        sum += n;
        strands->first[i + 1] = (uint32_t)sum;
        if (sum > strands->n_vertices)
            break;
    }
    if (sum != strands->n_vertices)
        return groom_fail_field(diag, GROOM_EINVAL, counts->pointer, "these come to another sum than there are points (%u)",
                                strands->n_vertices);
    return GROOM_OK;
}

groom_status document_strands_read(const cJSON *node, const char *pointer, const struct groom_array_finder *finder,
                                   const struct groom_context *context, struct groom_strands **out,
                                   struct groom_diag *diag)
{
    char name[64];
    struct document_array counts, points;
    struct groom_strands *strands = NULL;
    groom_status status;
    snprintf(name, sizeof name, "%s/vertices", pointer);
    status = document_array_check(member(node, "vertices"), name, DOCUMENT_U32, 1, finder, &counts, diag);
    snprintf(name, sizeof name, "%s/points", pointer);
    if (status == GROOM_OK)
        status = document_array_check(member(node, "points"), name, DOCUMENT_F32, 2, finder, &points, diag);
    if (status == GROOM_OK && points.shape[1] != 3)
        status = groom_fail_field(diag, GROOM_EINVAL, name, "shape[1] is %u; points have 3 coordinates", points.shape[1]);
    if (status == GROOM_OK && counts.shape[0] == 0)
        status = groom_fail_field(diag, GROOM_EINVAL, counts.pointer, "there are no strands");
    if (status != GROOM_OK)
        return status;
    if ((status = groom_strands_create(counts.shape[0], points.shape[0], context, &strands, diag)) == GROOM_OK &&
        (status = document_array_copy(&counts, finder, strands->first + 1, diag)) == GROOM_OK &&
        (status = sum_counts(&counts, strands, diag)) == GROOM_OK)
        status = document_array_copy(&points, finder, strands->points, diag);
    if (status == GROOM_OK)
        *out = strands;
    else
        groom_strands_destroy(strands);
    return status;
}

static groom_status add(cJSON *node, const char *name, groom_status status, cJSON *array)
{
    if (status == GROOM_OK && !cJSON_AddItemToObject(node, name, array)) {
        cJSON_Delete(array);
        return GROOM_ENOMEM;
    }
    return status;
}

groom_status document_strands_write(uint32_t n_strands, const uint32_t *first, const float (*points)[3],
                                    const struct groom_array_keeper *keeper, cJSON *node)
{
    const uint32_t shape[] = {first[n_strands], 3};
    cJSON *array = NULL;
    uint32_t *counts = memory_array(&groom_default_allocator, n_strands, sizeof *counts);
    if (!counts)
        return GROOM_ENOMEM;
    for (uint32_t i = 0; i < n_strands; i++)
        counts[i] = first[i + 1] - first[i];
    groom_status status = document_array_create(counts, DOCUMENT_U32, &n_strands, 1, keeper, &array);
    status = add(node, "vertices", status, array);
    memory_release(&groom_default_allocator, counts, n_strands, sizeof *counts);
    if (status != GROOM_OK)
        return status;
    status = document_array_create(points, DOCUMENT_F32, shape, 2, keeper, &array);
    return add(node, "points", status, array);
}

/* --- the base ------------------------------------------------------------------------------ */

static groom_status refuse_guides(const cJSON *root, struct groom_diag *diag)
{
    static const char *const members[] = {"guides", "instancing", "operator_guides"};
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++)
        if (member(root, members[i])) {
            char pointer[32];
            snprintf(pointer, sizeof pointer, "/%s", members[i]);
            return groom_fail_field(diag, GROOM_EINVAL, pointer, "a groom has a base or guides, not both");
        }
    return GROOM_OK;
}

static groom_status read_upload(const cJSON *base, struct groom *groom, struct groom_diag *diag)
{
    const cJSON *strands = member(base, "strands");
    if (!strands || cJSON_IsNull(strands))
        return GROOM_OK;
    if (!cJSON_IsString(strands) || strlen(strands->valuestring) >= sizeof groom->base_strands)
        return groom_fail_field(diag, GROOM_EINVAL, "/base/strands", "strands is the id of an upload, \"str_…\"");
    memcpy(groom->base_strands, strands->valuestring, strlen(strands->valuestring) + 1);
    return GROOM_OK;
}

static groom_status read_root_uv(const cJSON *root, const struct groom_array_finder *finder, struct groom *groom,
                                 struct groom_diag *diag)
{
    struct document_array uv;
    const cJSON *node = member(member(root, "strands"), "root_uv");
    if (!node)
        return GROOM_OK;
    groom_status status = document_array_check(node, "/strands/root_uv", DOCUMENT_F32, 2, finder, &uv, diag);
    if (status == GROOM_OK && (uv.shape[0] != groom->n_strands || uv.shape[1] != 2))
        status = groom_fail_field(diag, GROOM_EINVAL, "/strands/root_uv", "the base makes its shape [%u, 2]",
                                  groom->n_strands);
    return status == GROOM_OK ? document_array_copy(&uv, finder, groom->root_uv, diag) : status;
}

groom_status document_base_read(const cJSON *root, const struct groom_array_finder *finder,
                                const struct groom_context *context, struct groom **out, struct groom_diag *diag)
{
    const cJSON *base = member(root, "base");
    struct groom_strands *strands = NULL;
    struct groom *groom = NULL;
    groom_status status = refuse_guides(root, diag);
    if (status == GROOM_OK && !member(base, "points"))
        status = groom_fail_field(diag, GROOM_EINVAL, "/base/points",
                                  "the strands are missing: a document brings them along, \"vertices\" and \"points\" "
                                  "(an upload becomes a groom by POST /v1/strands/{id}/sculpt and the like)");
    if (status == GROOM_OK)
        status = document_strands_read(base, "/base", finder, context, &strands, diag);
    if (status == GROOM_OK)
        status = groom_create_of_strands(strands, context, &groom, diag);
    if (status == GROOM_OK)
        status = read_upload(base, groom, diag);
    if (status == GROOM_OK)
        status = read_root_uv(root, finder, groom, diag);
    groom_strands_destroy(strands);
    if (status == GROOM_OK)
        *out = groom;
    else
        groom_destroy(groom);
    return status;
}

groom_status document_base_write(const struct groom *groom, const struct groom_array_keeper *keeper, cJSON *root)
{
    cJSON *base = cJSON_AddObjectToObject(root, "base");
    if (!base || (groom->base_strands[0] ? !cJSON_AddStringToObject(base, "strands", groom->base_strands)
                                         : !cJSON_AddNullToObject(base, "strands")))
        return GROOM_ENOMEM;
    return document_strands_write(groom->n_strands, groom->first, (const float(*)[3])groom->base, keeper, base);
}
