/* struct groom -> JSON, and a document's arrays from one form into the other. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/document.h"
#include "model/document_node.h"
#include "model/model.h"

struct writer {
    cJSON *root;
    const struct groom_array_keeper *keeper;
    groom_status status; /* the first failure; everything after it does nothing */
};

static void note(struct writer *writer, groom_status status)
{
    if (writer->status == GROOM_OK)
        writer->status = status;
}

static void need(struct writer *writer, const void *made)
{
    if (!made)
        note(writer, GROOM_ENOMEM);
}

/* The fewest digits that give the same float back: 0.006 rather than 0.00600000005. */
static void add_float(struct writer *writer, cJSON *object, const char *name, float value)
{
    char text[32];
    for (int digits = 6; digits <= 9; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, (double)value);
        if (strtof(text, NULL) == value)
            break;
    }
    need(writer, cJSON_AddRawToObject(object, name, text));
}

static void add_array(struct writer *writer, cJSON *object, const char *name, const void *elements,
                      enum document_dtype dtype, const uint32_t *shape, uint32_t n_dimensions)
{
    cJSON *node = NULL;
    if (writer->status != GROOM_OK)
        return;
    note(writer, document_array_create(elements, dtype, shape, n_dimensions, writer->keeper, &node));
    if (node && !cJSON_AddItemToObject(object, name, node)) {
        cJSON_Delete(node);
        note(writer, GROOM_ENOMEM);
    }
}

static void add_f32(struct writer *writer, cJSON *object, const char *name, const void *elements,
                    const uint32_t *shape, uint32_t n_dimensions)
{
    add_array(writer, object, name, elements, DOCUMENT_F32, shape, n_dimensions);
}

static void add_u32(struct writer *writer, cJSON *object, const char *name, const void *elements,
                    const uint32_t *shape, uint32_t n_dimensions)
{
    add_array(writer, object, name, elements, DOCUMENT_U32, shape, n_dimensions);
}

static cJSON *add_section(struct writer *writer, const char *name)
{
    cJSON *section = cJSON_AddObjectToObject(writer->root, name);
    need(writer, section);
    return section;
}

static void write_strands(struct writer *writer, const struct groom *groom)
{
    cJSON *section = add_section(writer, "strands");
    need(writer, cJSON_AddNumberToObject(section, "count", groom->n_strands));
    need(writer, cJSON_AddNumberToObject(section, "vertices", groom->n_vertices));
    need(writer, cJSON_AddStringToObject(section, "scalp", groom_scalp_source_name(groom->scalp)));
    add_f32(writer, section, "roots", groom->roots, (uint32_t[]){groom->n_strands, 3}, 2);
    add_f32(writer, section, "root_uv", groom->root_uv, (uint32_t[]){groom->n_strands, 2}, 2);
}

static void write_guides(struct writer *writer, const struct groom *groom)
{
    cJSON *section = add_section(writer, "guides");
    need(writer, cJSON_AddNumberToObject(section, "count", groom->n_guides));
    need(writer, cJSON_AddNumberToObject(section, "vertices", groom->n_vertices));
    add_f32(writer, section, "points", groom->guides, (uint32_t[]){groom->n_guides, groom->n_vertices, 3}, 3);
    add_f32(writer, section, "root_uv", groom->guide_uv, (uint32_t[]){groom->n_guides, 2}, 2);
}

static void write_assignments(struct writer *writer, const struct groom *groom)
{
    uint32_t shape[] = {groom->n_strands, groom->n_instancing};
    cJSON *instancing = add_section(writer, "instancing");
    add_u32(writer, instancing, "guide", groom->instancing_guide, shape, 2);
    add_f32(writer, instancing, "weight", groom->instancing_weight, shape, 2);
    cJSON *operator_guides = add_section(writer, "operator_guides");
    add_u32(writer, operator_guides, "guide", groom->operator_guide, &groom->n_operator_guides, 1);
    add_u32(writer, operator_guides, "of_strand", groom->operator_guide_of, &groom->n_strands, 1);
}

static void write_random(struct writer *writer, const struct groom *groom, const struct groom_operator *op,
                         cJSON *node)
{
    uint32_t n_arrays = groom_operator_random_arrays(op->type);
    const uint32_t *count =
        groom_operator_random_per_guide(op->type) ? &groom->n_operator_guides : &groom->n_strands;
    if (n_arrays == 0)
        return;
    cJSON *random = cJSON_AddObjectToObject(node, "random");
    need(writer, random);
    for (uint32_t i = 0; i < n_arrays; i++)
        add_f32(writer, random, document_random_name(op->type, i), op->random[i], count, 1);
}

static void write_operator(struct writer *writer, const struct groom *groom, const struct groom_operator *op,
                           cJSON *chain)
{
    uint32_t n;
    const struct groom_operator_parameter *parameters = groom_operator_parameters(op->type, &n);
    cJSON *node = cJSON_CreateObject();
    if (!cJSON_AddItemToArray(chain, node)) {
        cJSON_Delete(node);
        note(writer, GROOM_ENOMEM);
        return;
    }
    need(writer, cJSON_AddStringToObject(node, "type", groom_operator_name(op->type)));
    need(writer, cJSON_AddNumberToObject(node, "id", op->id));
    need(writer, cJSON_AddBoolToObject(node, "enabled", op->enabled));
    need(writer, cJSON_AddNumberToObject(node, "seed", (double)op->seed));
    for (uint32_t i = 0; i < n; i++)
        add_float(writer, node, parameters[i].name, op->parameter[i]);
    write_random(writer, groom, op, node);
    if (op->layer && writer->status == GROOM_OK)
        note(writer, document_layer_write(groom, op, writer->keeper, node));
}

static void write_operators(struct writer *writer, const struct groom *groom)
{
    cJSON *chain = cJSON_AddArrayToObject(writer->root, "operators");
    need(writer, chain);
    for (uint32_t i = 0; i < groom->n_operators; i++)
        write_operator(writer, groom, &groom->operators[i], chain);
}

groom_status groom_document_operator_write(const struct groom *groom, uint32_t index,
                                           const struct groom_array_keeper *keeper, char **json, size_t *n_bytes,
                                           struct groom_diag *diag)
{
    struct writer writer = {.root = cJSON_CreateArray(), .keeper = keeper};
    need(&writer, writer.root);
    if (writer.status == GROOM_OK)
        write_operator(&writer, groom, &groom->operators[index], writer.root);
    groom_status status = writer.status;
    if (status == GROOM_OK)
        status = document_print(cJSON_GetArrayItem(writer.root, 0), json, n_bytes, diag);
    else
        groom_fail(diag, status, "the operator could not be written: %s", groom_status_message(status));
    cJSON_Delete(writer.root);
    return status;
}

static int is_model_member(const char *name)
{
    static const char *const members[] = {"format",     "unit",            "name",     "strands", "guides",
                                          "instancing", "operator_guides", "operators", "base", "axes"};
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++)
        if (strcmp(name, members[i]) == 0)
            return 1;
    return 0;
}

/* Calls visit on every array below node; recursion is as deep as the parser let the document be. */
static groom_status each_array(cJSON *node, groom_status (*visit)(void *user, cJSON *array), void *user)
{
    if (document_array_is(node))
        return visit(user, node);
    for (cJSON *child = node->child; child; child = child->next) {
        groom_status status = each_array(child, visit, user);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

static groom_status keep_array(void *user, cJSON *array) { return document_array_keep(array, user); }

/* Moves what the model does not own from one tree to the other. */
static void keep_other_members(struct writer *writer, cJSON *around)
{
    struct groom_array_keeper keeper = writer->keeper ? *writer->keeper : (struct groom_array_keeper){0};
    cJSON *child = around ? around->child : NULL;
    while (child) {
        cJSON *next = child->next;
        if (!is_model_member(child->string)) {
            cJSON_DetachItemViaPointer(around, child);
            if (writer->keeper)
                note(writer, each_array(child, keep_array, &keeper));
            if (!cJSON_AddItemToObject(writer->root, child->string, child)) {
                cJSON_Delete(child);
                note(writer, GROOM_ENOMEM);
            }
        }
        child = next;
    }
}

groom_status groom_document_write(const struct groom *groom, const char *around,
                                  const struct groom_array_keeper *keeper, char **json, size_t *n_bytes,
                                  struct groom_diag *diag)
{
    struct writer writer = {.root = cJSON_CreateObject(), .keeper = keeper};
    cJSON *others = NULL;
    groom_status status = GROOM_OK;
    need(&writer, writer.root);
    if (around && (status = document_parse(around, strlen(around), &others, diag)) != GROOM_OK)
        goto out;
    need(&writer, cJSON_AddStringToObject(writer.root, "format", "groom/1"));
    need(&writer, cJSON_AddStringToObject(writer.root, "unit", "m"));
    need(&writer, cJSON_AddStringToObject(writer.root, "name", groom->name));
    keep_other_members(&writer, others);
    if (model_axes(groom) && writer.status == GROOM_OK)
        note(&writer, document_axes_write(model_axes(groom), writer.root));
    write_strands(&writer, groom);
    if (groom->base && writer.status == GROOM_OK) {
        note(&writer, document_base_write(groom, keeper, writer.root));
    } else {
        write_guides(&writer, groom);
        write_assignments(&writer, groom);
    }
    write_operators(&writer, groom);
    if ((status = writer.status) != GROOM_OK) {
        groom_fail(diag, status, "the groom document could not be written: %s", groom_status_message(status));
        goto out;
    }
    status = document_print(writer.root, json, n_bytes, diag);
out:
    cJSON_Delete(others);
    cJSON_Delete(writer.root);
    return status;
}

/* --- arrays from one form into the other ------------------------------------------- */

static groom_status transform(const char *json, size_t n_bytes, groom_status (*visit)(void *user, cJSON *array),
                              void *user, char **out, size_t *n_out, struct groom_diag *diag)
{
    cJSON *root;
    groom_status status = document_parse(json, n_bytes, &root, diag);
    if (status != GROOM_OK)
        return status;
    status = each_array(root, visit, user);
    if (status == GROOM_OK)
        status = document_print(root, out, n_out, diag);
    cJSON_Delete(root);
    return status;
}

struct inlining {
    const struct groom_array_finder *finder;
    struct groom_diag *diag;
};

static groom_status inline_array(void *user, cJSON *array)
{
    struct inlining *inlining = user;
    return document_array_inline(array, inlining->finder, inlining->diag);
}

groom_status groom_document_inline(const char *json, size_t n_bytes, const struct groom_array_finder *finder,
                                   char **out, size_t *n_out, struct groom_diag *diag)
{
    struct inlining inlining = {finder, diag};
    return transform(json, n_bytes, inline_array, &inlining, out, n_out, diag);
}

static groom_status outline_array(void *user, cJSON *array)
{
    (void)user;
    cJSON_DeleteItemFromObjectCaseSensitive(array, "data");
    cJSON_DeleteItemFromObjectCaseSensitive(array, "$array");
    return GROOM_OK;
}

groom_status groom_document_outline(const char *json, size_t n_bytes, char **out, size_t *n_out,
                                    struct groom_diag *diag)
{
    return transform(json, n_bytes, outline_array, NULL, out, n_out, diag);
}
