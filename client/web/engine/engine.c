/* The page's engine: libgroom's model, compiled to WebAssembly, behind functions that take and give
 * numbers and addresses alone. engine.mjs is its only caller; a test holds its strands against the
 * server's, bit for bit.
 *
 * A groom is made by its shape, filled through the addresses of its arrays, and edited in place.
 * Functions that can fail return a groom_status; engine_message then says what to mend. */
#include <stdlib.h>
#include <string.h>

#include "groom/diag.h"
#include "groom/groom.h"
#include "groom/render.h"

#pragma clang diagnostic ignored "-Wmissing-prototypes" /* nothing in C calls these */
#define EXPORT(name) __attribute__((export_name(#name))) name

static struct groom_diag last;

const char *EXPORT(engine_message)(void) { return last.detail; }
const char *EXPORT(engine_pointer)(void) { return last.pointer; }

void *EXPORT(engine_allocate)(size_t n_bytes) { return aligned_alloc(64, (n_bytes + 63) / 64 * 64); }
void EXPORT(engine_release)(void *memory) { free(memory); }

/* --- a groom ----------------------------------------------------------------------- */

struct groom *EXPORT(engine_groom)(uint32_t n_strands, uint32_t n_vertices, uint32_t n_guides,
                                   uint32_t n_operator_guides, uint32_t n_instancing)
{
    struct groom_shape shape = {n_strands, n_vertices, n_guides, n_operator_guides, n_instancing};
    struct groom *groom = NULL;
    memset(&last, 0, sizeof last);
    return groom_create(shape, NULL, &groom, &last) == GROOM_OK ? groom : NULL;
}

void EXPORT(engine_destroy)(struct groom *groom) { groom_destroy(groom); }

/* The arrays in the order of engine.mjs. */
void *EXPORT(engine_array)(struct groom *groom, uint32_t which)
{
    void *const arrays[] = {groom->roots,   groom->root_uv,          groom->guides,         groom->guide_uv,
                            groom->instancing_guide, groom->instancing_weight, groom->operator_guide,
                            groom->operator_guide_of};
    return which < sizeof arrays / sizeof arrays[0] ? arrays[which] : NULL;
}

/* Nine numbers, row by row. */
float *EXPORT(engine_axes)(struct groom *groom) { return groom->axes[0]; }

groom_status EXPORT(engine_validate)(const struct groom *groom)
{
    memset(&last, 0, sizeof last);
    return groom_validate(groom, &last);
}

/* --- its chain ------------------------------------------------------------------------ */

static uint64_t wide(uint32_t high, uint32_t low) { return (uint64_t)high << 32 | low; }

groom_status EXPORT(engine_insert)(struct groom *groom, uint32_t index, uint32_t type, uint32_t seed_high,
                                   uint32_t seed_low)
{
    memset(&last, 0, sizeof last);
    return groom_insert_operator(groom, index, (groom_operator_type)type, wide(seed_high, seed_low), &last);
}

groom_status EXPORT(engine_remove)(struct groom *groom, uint32_t index)
{
    return groom_remove_operator(groom, index, &last);
}

groom_status EXPORT(engine_move)(struct groom *groom, uint32_t from, uint32_t to)
{
    return groom_move_operator(groom, from, to, &last);
}

/* As a document has them; the random numbers stay. */
void EXPORT(engine_identify)(struct groom *groom, uint32_t index, uint32_t id, uint32_t seed_high, uint32_t seed_low,
                             uint32_t enabled)
{
    struct groom_operator *op = &groom->operators[index];
    op->id = id;
    op->seed = wide(seed_high, seed_low);
    op->enabled = enabled != 0;
}

float *EXPORT(engine_parameters)(struct groom *groom, uint32_t index) { return groom->operators[index].parameter; }

float *EXPORT(engine_random)(struct groom *groom, uint32_t index, uint32_t which)
{
    return which < GROOM_OPERATOR_MAX_RANDOM ? groom->operators[index].random[which] : NULL;
}

void EXPORT(engine_draw)(struct groom *groom, uint32_t index, uint32_t seed_high, uint32_t seed_low)
{
    groom_draw_random(groom, &groom->operators[index], wide(seed_high, seed_low));
}

/* --- what operators there are: one table for sliders, documents and evaluation ------------- */

const char *EXPORT(engine_type_name)(uint32_t type)
{
    return type < GROOM_OPERATOR_TYPES ? groom_operator_name((groom_operator_type)type) : NULL;
}

uint32_t EXPORT(engine_n_parameters)(uint32_t type)
{
    uint32_t n;
    groom_operator_parameters((groom_operator_type)type, &n);
    return n;
}

const struct groom_operator_parameter *EXPORT(engine_parameter)(uint32_t type, uint32_t index)
{
    uint32_t n;
    return groom_operator_parameters((groom_operator_type)type, &n) + index;
}

uint32_t EXPORT(engine_n_random)(uint32_t type) { return groom_operator_random_arrays((groom_operator_type)type); }

const char *EXPORT(engine_random_name)(uint32_t type, uint32_t which)
{
    uint32_t n;
    return groom_operator_randoms((groom_operator_type)type, &n)[which].name;
}

/* --- strands ----------------------------------------------------------------------------- */

groom_status EXPORT(engine_evaluate)(const struct groom *groom, uint32_t first, uint32_t count, float (*out)[3])
{
    memset(&last, 0, sizeof last);
    return groom_evaluate(groom, first, count, out, NULL, &last);
}

/* The first `count` strands of the fair order, as it stands: what comes first is a fair sample again. */
groom_status EXPORT(engine_fair)(uint32_t n_strands, uint32_t count, uint32_t *first)
{
    uint32_t *order = malloc(n_strands * sizeof *order);
    memset(&last, 0, sizeof last);
    if (!order)
        return groom_fail(&last, GROOM_ENOMEM, "no memory to choose %u strands", count);
    groom_fair_order(n_strands, order);
    memcpy(first, order, count * sizeof *first);
    free(order);
    return GROOM_OK;
}

/* These strands alone, in that order: what a viewer shows of many. */
struct groom *EXPORT(engine_select)(const struct groom *groom, uint32_t count)
{
    struct groom *selected = NULL;
    uint32_t *order = malloc(count * sizeof *order);
    groom_status st = order ? engine_fair(groom->n_strands, count, order)
                            : groom_fail(&last, GROOM_ENOMEM, "no memory to choose %u strands", count);
    if (st == GROOM_OK)
        st = groom_select(groom, order, count, NULL, &selected, &last);
    free(order);
    return st == GROOM_OK ? selected : NULL;
}

/* --- light --------------------------------------------------------------------------------- */

/* Shadows within strands of one vertex count, towards the light (x, y, z). */
struct groom_light *EXPORT(engine_light)(float (*points)[3], uint32_t n_strands, uint32_t n_vertices, uint32_t cells,
                                         float width_m, float x, float y, float z)
{
    struct groom_light_options options = {.cells = cells, .stride = 1, .width_m = width_m, .key = {x, y, z}};
    struct groom_light *light = NULL;
    uint32_t *first = malloc((n_strands + 1) * sizeof *first);
    memset(&last, 0, sizeof last);
    for (uint32_t i = 0; first && i <= n_strands; i++)
        first[i] = i * n_vertices;
    struct groom_strands strands = {
        .n_strands = n_strands, .n_vertices = n_strands * n_vertices, .first = first, .points = points};
    groom_status st = first ? groom_light_create(&strands, &options, NULL, &light, &last) : GROOM_ENOMEM;
    free(first);
    return st == GROOM_OK ? light : NULL;
}

void EXPORT(engine_light_destroy)(struct groom_light *light) { groom_light_destroy(light); }
