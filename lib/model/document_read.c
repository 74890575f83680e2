/* JSON -> struct groom. Shapes are checked against each other and against the bytes that are there
 * before anything is allocated; groom_validate then checks what the numbers mean. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "groom/document.h"
#include "model/document_node.h"
#include "model/model.h"

#define MAX_SEED 999999999999999.0 /* 15 digits: what every JSON library prints as it read it */
#define MAX_OPERATORS 256

struct reader {
    const cJSON *root;
    const struct groom_array_finder *finder;
    struct groom_diag *diag;
    uint32_t next_free_id; /* above every operator id that the document gives */
    /* the arrays of the document, checked */
    struct document_array roots, root_uv, guides, guide_uv, instancing_guide, instancing_weight, operator_guide,
        operator_guide_of;
};

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

static groom_status read_format(const struct reader *reader)
{
    const char *format = cJSON_GetStringValue(member(reader->root, "format"));
    const char *unit = cJSON_GetStringValue(member(reader->root, "unit"));
    if (!format)
        return groom_fail_field(reader->diag, GROOM_EFORMAT, "/format",
                                "this is not a groom document: \"format\":\"groom/1\" is missing");
    if (strcmp(format, "groom/1") != 0)
        return groom_fail_field(reader->diag, GROOM_EFORMAT, "/format",
                                "\"%.40s\" is not a format that this version reads; it reads \"groom/1\"", format);
    if (!unit || strcmp(unit, "m") != 0)
        return groom_fail_field(reader->diag, GROOM_EINVAL, "/unit",
                                "a groom document is in metres: \"unit\":\"m\"");
    return GROOM_OK;
}

/* --- arrays ------------------------------------------------------------------ */

static groom_status check_arrays(struct reader *reader)
{
    const struct {
        const char *section, *name;
        enum document_dtype dtype;
        uint32_t n_dimensions;
        struct document_array *array;
    } rows[] = {
        {"strands", "roots", DOCUMENT_F32, 2, &reader->roots},
        {"strands", "root_uv", DOCUMENT_F32, 2, &reader->root_uv},
        {"guides", "points", DOCUMENT_F32, 3, &reader->guides},
        {"guides", "root_uv", DOCUMENT_F32, 2, &reader->guide_uv},
        {"instancing", "guide", DOCUMENT_U32, 2, &reader->instancing_guide},
        {"instancing", "weight", DOCUMENT_F32, 2, &reader->instancing_weight},
        {"operator_guides", "guide", DOCUMENT_U32, 1, &reader->operator_guide},
        {"operator_guides", "of_strand", DOCUMENT_U32, 1, &reader->operator_guide_of},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char pointer[64];
        snprintf(pointer, sizeof pointer, "/%s/%s", rows[i].section, rows[i].name);
        groom_status status =
            document_array_check(member(member(reader->root, rows[i].section), rows[i].name), pointer, rows[i].dtype,
                                 rows[i].n_dimensions, reader->finder, rows[i].array, reader->diag);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

static groom_status expect_extent(const struct reader *reader, const struct document_array *array,
                                  uint32_t dimension, uint32_t expected)
{
    if (array->shape[dimension] == expected)
        return GROOM_OK;
    return groom_fail_field(reader->diag, GROOM_EINVAL, array->pointer,
                            "shape[%u] is %u; the rest of the document makes it %u", dimension,
                            array->shape[dimension], expected);
}

/* A count that a section states beside its arrays must agree with them. */
static groom_status expect_count(const struct reader *reader, const char *section, const char *name,
                                 uint32_t expected)
{
    const cJSON *count = member(member(reader->root, section), name);
    char pointer[64];
    if (!count || (cJSON_IsNumber(count) && count->valuedouble == expected))
        return GROOM_OK;
    snprintf(pointer, sizeof pointer, "/%s/%s", section, name);
    return groom_fail_field(reader->diag, GROOM_EINVAL, pointer, "the arrays make this %u", expected);
}

static groom_status check_counts(const struct reader *reader, struct groom_shape shape)
{
    groom_status status;
    if ((status = expect_count(reader, "strands", "count", shape.n_strands)) != GROOM_OK ||
        (status = expect_count(reader, "strands", "vertices", shape.n_vertices)) != GROOM_OK ||
        (status = expect_count(reader, "guides", "count", shape.n_guides)) != GROOM_OK)
        return status;
    return expect_count(reader, "guides", "vertices", shape.n_vertices);
}

static groom_status check_shapes(const struct reader *reader, struct groom_shape *shape)
{
    *shape = (struct groom_shape){.n_strands = reader->roots.shape[0],
                                  .n_vertices = reader->guides.shape[1],
                                  .n_guides = reader->guides.shape[0],
                                  .n_operator_guides = reader->operator_guide.shape[0],
                                  .n_instancing = reader->instancing_guide.shape[1]};
    const struct {
        const struct document_array *array;
        uint32_t dimension, expected;
    } extents[] = {
        {&reader->roots, 1, 3},
        {&reader->root_uv, 0, shape->n_strands},
        {&reader->root_uv, 1, 2},
        {&reader->guides, 2, 3},
        {&reader->guide_uv, 0, shape->n_guides},
        {&reader->guide_uv, 1, 2},
        {&reader->instancing_guide, 0, shape->n_strands},
        {&reader->instancing_weight, 0, shape->n_strands},
        {&reader->instancing_weight, 1, shape->n_instancing},
        {&reader->operator_guide_of, 0, shape->n_strands},
    };
    for (size_t i = 0; i < sizeof extents / sizeof extents[0]; i++) {
        groom_status status = expect_extent(reader, extents[i].array, extents[i].dimension, extents[i].expected);
        if (status != GROOM_OK)
            return status;
    }
    return check_counts(reader, *shape);
}

static groom_status copy_arrays(const struct reader *reader, struct groom *groom)
{
    const struct {
        const struct document_array *array;
        void *out;
    } copies[] = {
        {&reader->roots, groom->roots},
        {&reader->root_uv, groom->root_uv},
        {&reader->guides, groom->guides},
        {&reader->guide_uv, groom->guide_uv},
        {&reader->instancing_guide, groom->instancing_guide},
        {&reader->instancing_weight, groom->instancing_weight},
        {&reader->operator_guide, groom->operator_guide},
        {&reader->operator_guide_of, groom->operator_guide_of},
    };
    for (size_t i = 0; i < sizeof copies / sizeof copies[0]; i++) {
        groom_status status = document_array_copy(copies[i].array, reader->finder, copies[i].out, reader->diag);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

/* --- plain members -------------------------------------------------------------- */

static groom_status read_name(const struct reader *reader, struct groom *groom)
{
    const cJSON *name = member(reader->root, "name");
    if (!name || cJSON_IsNull(name))
        return GROOM_OK;
    if (!cJSON_IsString(name) || strlen(name->valuestring) >= sizeof groom->name)
        return groom_fail_field(reader->diag, GROOM_EINVAL, "/name", "name is a string of at most %zu bytes",
                                sizeof groom->name - 1);
    memcpy(groom->name, name->valuestring, strlen(name->valuestring) + 1);
    return GROOM_OK;
}

static groom_status read_scalp(const struct reader *reader, struct groom *groom)
{
    const cJSON *scalp = member(member(reader->root, "strands"), "scalp");
    groom->scalp = GROOM_SCALP_ROOTS;
    if (!scalp)
        return GROOM_OK;
    for (int source = GROOM_SCALP_MESH_UV; source <= GROOM_SCALP_FILE; source++)
        if (cJSON_IsString(scalp) &&
            strcmp(scalp->valuestring, groom_scalp_source_name((groom_scalp_source)source)) == 0) {
            groom->scalp = (groom_scalp_source)source;
            return GROOM_OK;
        }
    return groom_fail_field(reader->diag, GROOM_EINVAL, "/strands/scalp",
                            "scalp is \"mesh_uv\", \"computed\", \"roots\" or \"file\"");
}

/* --- operators -------------------------------------------------------------------- */

/* Where in the chain the reader is, for messages. */
struct place {
    struct reader *reader;
    uint32_t index;
};

static groom_status refuse(struct place place, const char *field, const char *what)
{
    char pointer[96];
    snprintf(pointer, sizeof pointer, "/operators/%u/%.60s", place.index, field);
    return groom_fail_field(place.reader->diag, GROOM_EINVAL, pointer, "%s", what);
}

static groom_status read_type(struct place place, const struct groom *groom, const cJSON *node, groom_operator_type *type)
{
    const char *name = cJSON_GetStringValue(member(node, "type"));
    struct groom_diag unknown;
    if (!name)
        return refuse(place, "type", "an operator is an object with a \"type\"");
    if (groom_operator_parse(name, type, &unknown) != GROOM_OK)
        return refuse(place, "type", unknown.detail);
    if (groom->n_operator_guides == 0 && groom_operator_needs_guides(*type)) {
        char what[256];
        snprintf(what, sizeof what, MODEL_NEEDS_GUIDES, groom_operator_name(*type));
        return refuse(place, "type", what);
    }
    return GROOM_OK;
}

static int is_member_of(groom_operator_type type, const char *name)
{
    static const char *const common[] = {"type", "id", "enabled", "seed", "random"};
    uint32_t n;
    const struct groom_operator_parameter *parameters = groom_operator_parameters(type, &n);
    for (size_t i = 0; i < sizeof common / sizeof common[0]; i++)
        if (strcmp(name, common[i]) == 0)
            return 1;
    for (uint32_t i = 0; i < n; i++)
        if (strcmp(name, parameters[i].name) == 0)
            return 1;
    return document_layer_has(type, name);
}

/* A misspelt parameter must not pass as the default. */
static groom_status refuse_unknown(struct place place, const cJSON *node, groom_operator_type type)
{
    const cJSON *child;
    cJSON_ArrayForEach(child, node)
    {
        if (is_member_of(type, child->string))
            continue;
        char what[160];
        uint32_t n;
        const struct groom_operator_parameter *parameters = groom_operator_parameters(type, &n);
        int at = snprintf(what, sizeof what, "a %s operator has no such member; it has", groom_operator_name(type));
        for (uint32_t i = 0; i < n; i++)
            at += snprintf(what + at, sizeof what - (size_t)at, "%s %s", i ? "," : "", parameters[i].name);
        return refuse(place, child->string, what);
    }
    return GROOM_OK;
}

static groom_status read_whole_number(struct place place, const cJSON *operator_node, const char *field,
                                      double maximum, uint64_t *value)
{
    const cJSON *node = member(operator_node, field);
    if (!node)
        return GROOM_OK;
    double number = cJSON_IsNumber(node) ? node->valuedouble : -1;
    if (!(number >= 0 && number <= maximum) || number != floor(number))
        return refuse(place, field, "a whole number is needed here, from 0, that a double holds exactly");
    *value = (uint64_t)number;
    return GROOM_OK;
}

static groom_status read_enabled(struct place place, const cJSON *node, struct groom_operator *op)
{
    const cJSON *enabled = member(node, "enabled");
    if (enabled && !cJSON_IsBool(enabled))
        return refuse(place, "enabled", "enabled is true or false");
    op->enabled = !enabled || cJSON_IsTrue(enabled);
    return GROOM_OK;
}

static groom_status read_parameters(struct place place, const cJSON *node, struct groom_operator *op)
{
    uint32_t n;
    const struct groom_operator_parameter *parameters = groom_operator_parameters(op->type, &n);
    for (uint32_t i = 0; i < n; i++) {
        const cJSON *value = member(node, parameters[i].name);
        if (!value)
            continue;
        if (!cJSON_IsNumber(value) || !isfinite((float)value->valuedouble))
            return refuse(place, parameters[i].name, "a finite number is needed here");
        op->parameter[i] = (float)value->valuedouble;
    }
    return GROOM_OK;
}

static groom_status read_random(struct place place, const struct groom *groom, const cJSON *node,
                                struct groom_operator *op)
{
    struct reader *reader = place.reader;
    uint32_t n_expected = groom_operator_random_per_guide(op->type) ? groom->n_operator_guides : groom->n_strands;
    for (uint32_t i = 0; i < groom_operator_random_arrays(op->type); i++) {
        const char *name = document_random_name(op->type, i);
        char pointer[64];
        struct document_array array;
        snprintf(pointer, sizeof pointer, "/operators/%u/random/%s", place.index, name);
        groom_status status =
            document_array_check(member(node, name), pointer, DOCUMENT_F32, 1, reader->finder, &array, reader->diag);
        if (status == GROOM_OK)
            status = expect_extent(reader, &array, 0, n_expected);
        if (status == GROOM_OK)
            status = document_array_copy(&array, reader->finder, op->random[i], reader->diag);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

static groom_status read_operator(struct place place, const cJSON *node, struct groom *groom)
{
    struct reader *reader = place.reader;
    groom_operator_type type;
    uint64_t seed = 1, id = UINT32_MAX;
    groom_status status;
    if ((status = read_type(place, groom, node, &type)) != GROOM_OK ||
        (status = refuse_unknown(place, node, type)) != GROOM_OK ||
        (status = read_whole_number(place, node, "seed", MAX_SEED, &seed)) != GROOM_OK ||
        (status = read_whole_number(place, node, "id", UINT32_MAX - MAX_OPERATORS, &id)) != GROOM_OK ||
        (status = groom_insert_operator(groom, place.index, type, seed, reader->diag)) != GROOM_OK)
        return status;

    struct groom_operator *op = &groom->operators[place.index];
    const cJSON *random = member(node, "random");
    op->id = member(node, "id") ? (uint32_t)id : reader->next_free_id++;
    if ((status = read_enabled(place, node, op)) != GROOM_OK ||
        (status = read_parameters(place, node, op)) != GROOM_OK)
        return status;
    if (op->layer)
        return document_layer_read(node, place.index, groom, reader->finder, op, reader->diag);
    if (random && !cJSON_IsNull(random))
        return read_random(place, groom, random, op);
    groom_draw_random(groom, op, seed);
    return GROOM_OK;
}

static uint32_t first_free_id(const cJSON *chain)
{
    const cJSON *node;
    uint32_t next = 1;
    cJSON_ArrayForEach(node, chain)
    {
        const cJSON *id = member(node, "id");
        if (cJSON_IsNumber(id) && id->valuedouble >= next && id->valuedouble < UINT32_MAX - MAX_OPERATORS)
            next = (uint32_t)id->valuedouble + 1;
    }
    return next;
}

static groom_status check_ids(struct reader *reader, const struct groom *groom)
{
    for (uint32_t i = 0; i < groom->n_operators; i++)
        for (uint32_t j = 0; j < i; j++)
            if (groom->operators[i].id == groom->operators[j].id)
                return refuse((struct place){reader, i}, "id", "another operator of the chain has this id");
    return GROOM_OK;
}

static groom_status read_operators(struct reader *reader, struct groom *groom)
{
    const cJSON *chain = member(reader->root, "operators"), *node;
    struct place place = {reader, 0};
    if (!cJSON_IsArray(chain))
        return groom_fail_field(reader->diag, GROOM_EINVAL, "/operators",
                                "operators is an array, possibly an empty one");
    if (cJSON_GetArraySize(chain) > MAX_OPERATORS)
        return groom_fail_field(reader->diag, GROOM_EINVAL, "/operators", "a chain has at most %d operators",
                                MAX_OPERATORS);
    reader->next_free_id = first_free_id(chain);
    cJSON_ArrayForEach(node, chain)
    {
        groom_status status = read_operator(place, node, groom);
        if (status != GROOM_OK)
            return status;
        place.index++;
    }
    return check_ids(reader, groom);
}

/* --- the whole ----------------------------------------------------------------------- */

/* Where the strands come from: guides, or a base. */
static groom_status read_source(struct reader *reader, const struct groom_context *context, struct groom **groom)
{
    struct groom_shape shape;
    groom_status status;
    if (member(reader->root, "base")) {
        if ((status = document_base_read(reader->root, reader->finder, context, groom, reader->diag)) != GROOM_OK)
            return status;
        shape = model_shape(*groom);
        return check_counts(reader, shape);
    }
    if ((status = check_arrays(reader)) != GROOM_OK || (status = check_shapes(reader, &shape)) != GROOM_OK ||
        (status = groom_create(shape, context, groom, reader->diag)) != GROOM_OK)
        return status;
    return copy_arrays(reader, *groom);
}

static groom_status read_groom(struct reader *reader, const struct groom_context *context, struct groom **out)
{
    struct groom *groom = NULL;
    groom_status status;
    if ((status = read_format(reader)) != GROOM_OK || (status = read_source(reader, context, &groom)) != GROOM_OK ||
        (status = read_name(reader, groom)) != GROOM_OK || (status = read_scalp(reader, groom)) != GROOM_OK ||
        (status = document_axes_read(reader->root, groom, reader->diag)) != GROOM_OK ||
        (status = read_operators(reader, groom)) != GROOM_OK ||
        (status = groom_validate(groom, reader->diag)) != GROOM_OK)
        goto out;
    *out = groom;
    groom = NULL;
out:
    groom_destroy(groom);
    return status;
}

groom_status groom_document_operator_read(const char *json, size_t n_bytes, const struct groom_array_finder *finder,
                                          struct groom *groom, uint32_t index, struct groom_diag *diag)
{
    cJSON *root;
    uint32_t n = groom->n_operators, highest = 0;
    groom_status status = document_parse(json, n_bytes, &root, diag);
    if (status != GROOM_OK)
        return status;
    for (uint32_t i = 0; i < n; i++)
        highest = groom->operators[i].id > highest ? groom->operators[i].id : highest;
    struct reader reader = {.root = root, .finder = finder, .diag = diag, .next_free_id = highest + 1};
    struct place place = {&reader, index};
    if (n >= MAX_OPERATORS)
        status = refuse(place, "type", "the chain has as many operators as it may");
    if (status == GROOM_OK)
        status = read_operator(place, root, groom);
    if (status == GROOM_OK)
        status = check_ids(&reader, groom);
    if (status == GROOM_OK)
        status = model_validate_operator(groom, index, diag);
    cJSON_Delete(root);
    if (status != GROOM_OK && groom->n_operators > n) {
        groom_status removed = groom_remove_operator(groom, index, NULL);
        (void)removed;
    }
    return status;
}

groom_status groom_document_read(const char *json, size_t n_bytes, const struct groom_array_finder *finder,
                                 const struct groom_context *context, struct groom **groom,
                                 struct groom_diag *diag)
{
    cJSON *root;
    groom_status status = document_parse(json, n_bytes, &root, diag);
    if (status != GROOM_OK)
        return status;
    struct reader reader = {.root = root, .finder = finder, .diag = diag};
    status = read_groom(&reader, context, groom);
    cJSON_Delete(root);
    return status;
}
