/* The chain of operators: insert, remove, move, and the random numbers of each. */
#include <string.h>

#include "base/memory.h"
#include "groom/groom.h"
#include "groom/random.h"
#include "model/model.h"

size_t model_random_count(const struct groom *groom, groom_operator_type type)
{
    return groom_operator_random_per_guide(type) ? groom->n_operator_guides : groom->n_strands;
}

groom_status model_operator_allocate(const struct groom *groom, struct groom_operator *op)
{
    memset(op->random, 0, sizeof op->random);
    op->layer = NULL;
    if (groom_operator_is_layer(op->type))
        return layer_create(groom->allocator, &op->layer);
    for (uint32_t a = 0; a < groom_operator_random_arrays(op->type); a++) {
        op->random[a] = memory_array(groom->allocator, model_random_count(groom, op->type), sizeof(float));
        if (!op->random[a]) {
            model_operator_finish(groom, op);
            return GROOM_ENOMEM;
        }
    }
    return GROOM_OK;
}

void model_operator_finish(const struct groom *groom, struct groom_operator *op)
{
    for (uint32_t a = 0; a < GROOM_OPERATOR_MAX_RANDOM; a++) {
        memory_release(groom->allocator, op->random[a], model_random_count(groom, op->type), sizeof(float));
        op->random[a] = NULL;
    }
    layer_destroy(op->layer, groom->n_strands, groom->allocator);
    op->layer = NULL;
}

groom_status model_operator_copy(const struct groom *groom, const struct groom_operator *from, struct groom_operator *to)
{
    to->enabled = from->enabled;
    to->seed = from->seed;
    to->id = from->id;
    memcpy(to->parameter, from->parameter, sizeof to->parameter);
    return from->layer ? layer_copy(from->layer, groom->n_strands, groom->allocator, to->layer) : GROOM_OK;
}

uint32_t model_first_layer(const struct groom *groom)
{
    uint32_t i = 0;
    while (i < groom->n_operators && !(groom->operators[i].enabled && groom_operator_is_layer(groom->operators[i].type)))
        i++;
    return i;
}

void groom_draw_random(struct groom *groom, struct groom_operator *op, uint64_t seed)
{
    struct groom_random_key key = {seed, op->id};
    uint32_t n_arrays, count = (uint32_t)model_random_count(groom, op->type);
    const struct groom_operator_random *randoms = groom_operator_randoms(op->type, &n_arrays);
    for (uint32_t a = 0; a < n_arrays; a++)
        for (uint32_t i = 0; i < count; i++)
            op->random[a][i] = randoms[a].minimum < 0.0f ? groom_random_truncated_normal(key, i, a)
                                                         : groom_random_uniform(key, i, a);
    op->seed = seed;
}

/* Ids start at 1; no two operators of a groom share one. */
static uint32_t next_id(const struct groom *groom)
{
    uint32_t id = 0;
    for (uint32_t i = 0; i < groom->n_operators; i++)
        if (groom->operators[i].id > id)
            id = groom->operators[i].id;
    return id + 1;
}

static struct groom_operator operator_initial(const struct groom *groom, groom_operator_type type)
{
    struct groom_operator op = {.type = type, .enabled = 1, .id = next_id(groom)};
    uint32_t n;
    const struct groom_operator_parameter *parameters = groom_operator_parameters(type, &n);
    for (uint32_t p = 0; p < n; p++)
        op.parameter[p] = parameters[p].initial;
    return op;
}

groom_status groom_insert_operator(struct groom *groom, uint32_t index, groom_operator_type type, uint64_t seed,
                                   struct groom_diag *diag)
{
    uint32_t n = groom->n_operators;
    if ((unsigned)type >= GROOM_OPERATOR_TYPES)
        return groom_fail(diag, GROOM_EINVAL, "there is no operator type %d", (int)type);
    if (groom->n_operator_guides == 0 && groom_operator_needs_guides(type))
        return groom_fail(diag, GROOM_EINVAL, MODEL_NEEDS_GUIDES, groom_operator_name(type));
    if (index > n)
        return groom_fail(diag, GROOM_EINVAL, "an operator cannot stand at %u in a chain of %u", index, n);
    struct groom_operator op = operator_initial(groom, type);
    struct groom_operator *operators = memory_array(groom->allocator, (size_t)n + 1, sizeof *operators);
    if (!operators || model_operator_allocate(groom, &op) != GROOM_OK) {
        memory_release(groom->allocator, operators, (size_t)n + 1, sizeof *operators);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for another operator");
    }
    groom_draw_random(groom, &op, seed);
    for (uint32_t i = 0; i <= n; i++)
        operators[i] = i < index ? groom->operators[i] : i == index ? op : groom->operators[i - 1];
    memory_release(groom->allocator, groom->operators, n, sizeof *operators);
    groom->operators = operators;
    groom->n_operators = n + 1;
    return GROOM_OK;
}

static groom_status check_index(const struct groom *groom, uint32_t index, struct groom_diag *diag)
{
    if (index < groom->n_operators)
        return GROOM_OK;
    return groom_fail(diag, GROOM_EINVAL, "there is no operator %u in a chain of %u", index, groom->n_operators);
}

groom_status groom_remove_operator(struct groom *groom, uint32_t index, struct groom_diag *diag)
{
    groom_status status = check_index(groom, index, diag);
    if (status != GROOM_OK)
        return status;
    uint32_t n = groom->n_operators - 1;
    struct groom_operator *operators = NULL;
    if (n > 0 && !(operators = memory_array(groom->allocator, n, sizeof *operators)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a shorter chain");
    model_operator_finish(groom, &groom->operators[index]);
    for (uint32_t i = 0; i < n; i++)
        operators[i] = groom->operators[i < index ? i : i + 1];
    memory_release(groom->allocator, groom->operators, groom->n_operators, sizeof *operators);
    groom->operators = operators;
    groom->n_operators = n;
    return GROOM_OK;
}

groom_status groom_borrow(const struct groom *groom, uint32_t without, struct groom *copy, struct groom_diag *diag)
{
    uint32_t n = groom->n_operators - (without < groom->n_operators);
    struct groom_operator *operators = memory_array(groom->allocator, n, sizeof *operators);
    if (!operators)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a chain of %u operators", n);
    for (uint32_t i = 0; i < n; i++)
        operators[i] = groom->operators[i < without ? i : i + 1];
    *copy = *groom;
    copy->operators = operators;
    copy->n_operators = n;
    return GROOM_OK;
}

void groom_borrow_end(struct groom *copy, uint32_t added)
{
    if (added < copy->n_operators)
        model_operator_finish(copy, &copy->operators[added]);
    memory_release(copy->allocator, copy->operators, copy->n_operators, sizeof *copy->operators);
    *copy = (struct groom){0};
}

groom_status groom_move_operator(struct groom *groom, uint32_t from, uint32_t to, struct groom_diag *diag)
{
    groom_status status = check_index(groom, from, diag);
    if (status == GROOM_OK)
        status = check_index(groom, to, diag);
    if (status != GROOM_OK)
        return status;
    struct groom_operator op = groom->operators[from];
    if (from < to)
        memmove(&groom->operators[from], &groom->operators[from + 1], (to - from) * sizeof op);
    else
        memmove(&groom->operators[to + 1], &groom->operators[to], (from - to) * sizeof op);
    groom->operators[to] = op;
    return GROOM_OK;
}
