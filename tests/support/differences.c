#include "tests/support/differences.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/random.h"
#include "tests/support/reference.h"

/* --- the loss ---------------------------------------------------------------------- */

/* By place in the visit, not by strand: the adjoint knows no more. */
static float coefficient(uint32_t visit, uint32_t index)
{
    return 2.0f * groom_random_uniform((struct groom_random_key){77, 5}, visit, index) - 1.0f;
}

static void linear(void *user, uint32_t first, uint32_t n, const float (*points)[3], float (*d_points)[3])
{
    (void)points;
    const struct groom *groom = user;
    uint32_t m = groom->n_vertices;
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < m; j++)
            for (uint32_t c = 0; c < 3; c++)
                d_points[i * m + j][c] = coefficient(first + i, 3 * j + c);
}

struct groom_adjoint test_linear_adjoint(const struct groom *groom)
{
    return (struct groom_adjoint){linear, (void *)groom};
}

struct loss {
    struct reference *reference;
    const uint32_t *strand;
    uint32_t count;
    float *coefficients; /* [count][m][3] */
    double (*points)[3];
    double *part, *parts; /* [count] */
};

/* Each strand's part of the sum. */
static void evaluate(const struct loss *loss, double *part)
{
    uint32_t m = loss->reference->groom->n_vertices;
    for (uint32_t v = 0; v < loss->count; v++) {
        reference_strand(loss->reference, loss->strand ? loss->strand[v] : v, loss->points);
        part[v] = 0.0;
        for (uint32_t j = 0; j < m; j++)
            for (uint32_t c = 0; c < 3; c++)
                part[v] += (double)loss->coefficients[(v * m + j) * 3 + c] * loss->points[j][c];
    }
}

/* Fourth order: two central differences. *size: the sum of the absolute values of the strands' parts,
 * which is what rounding is proportional to where they cancel. */
static double derivative(const struct loss *loss, double *x, double step, double *size)
{
    const double steps[4] = {-2, -1, 1, 2}, weights[4] = {1, -8, 8, -1};
    double at = *x, sum = 0.0;
    memset(loss->parts, 0, loss->count * sizeof *loss->parts);
    for (int i = 0; i < 4; i++) {
        *x = at + steps[i] * step;
        evaluate(loss, loss->part);
        for (uint32_t v = 0; v < loss->count; v++)
            loss->parts[v] += weights[i] * loss->part[v];
    }
    *x = at;
    *size = 0.0;
    for (uint32_t v = 0; v < loss->count; v++) {
        sum += loss->parts[v] / (12 * step);
        *size += fabs(loss->parts[v] / (12 * step));
    }
    return sum;
}

/* --- comparing ------------------------------------------------------------------------ */

struct group {
    double worst, largest;
};

static void compare(struct group *group, double got, const struct loss *loss, double *x, double step)
{
    double size, truth = derivative(loss, x, step, &size), error = fabs(got - truth);
    group->worst = error > group->worst || isnan(error) ? error : group->worst;
    group->largest = fmax(group->largest, size);
}

static double relative(struct group group)
{
    return isnan(group.worst) ? INFINITY : group.worst / fmax(group.largest, 1e-5);
}

static void require(groom_status status)
{
    if (status == GROOM_OK)
        return;
    fprintf(stderr, "gradient: %s\n", groom_status_message(status));
    abort();
}

/* Steps fit for the size of what they move, in metres, radians, turns a metre. */
static double parameter_step(const char *unit) { return unit[0] == '1' ? 1e-3 : unit[0] == 'm' ? 1e-5 : 1e-4; }

static void compare_operator(const struct groom *groom, const struct loss *loss, uint32_t index,
                             const struct groom_gradient *gradient, struct gradient_error *error)
{
    const struct groom_operator *op = &groom->operators[index];
    uint32_t n_parameters, n_random;
    const struct groom_operator_parameter *parameters = groom_operator_parameters(op->type, &n_parameters);
    n_random = groom_operator_random_arrays(op->type);
    uint32_t n = groom_operator_random_per_guide(op->type) ? groom->n_operator_guides : groom->n_strands;
    for (uint32_t p = 0; p < n_parameters; p++) {
        struct group group = {0};
        compare(&group, gradient->operators[index].parameter[p], loss,
                &loss->reference->operators[index].parameter[p], parameter_step(parameters[p].unit));
        error->parameters = fmax(error->parameters, relative(group));
    }
    for (uint32_t a = 0; a < n_random; a++) {
        struct group group = {0};
        for (uint32_t i = 0; i < n; i++)
            compare(&group, gradient->operators[index].random[a][i], loss,
                    &loss->reference->operators[index].random[a][i], 1e-5);
        error->randoms = fmax(error->randoms, relative(group));
    }
}

struct gradient_error test_gradient_error(const struct groom *groom, const uint32_t *strand, uint32_t count)
{
    struct gradient_error error = {0};
    struct groom_gradient *gradient;
    uint32_t m = groom->n_vertices;
    require(groom_gradient_create(groom, NULL, &gradient, NULL));
    require(groom_evaluate_gradient(groom, strand, count, test_linear_adjoint(groom), gradient, NULL, NULL));

    struct loss loss = {reference_create(groom), strand, count, malloc((size_t)count * m * 3 * sizeof(float)),
                        malloc(m * sizeof *loss.points), malloc(count * sizeof(double)), malloc(count * sizeof(double))};
    for (uint32_t v = 0; v < count; v++)
        for (uint32_t i = 0; i < 3 * m; i++)
            loss.coefficients[v * 3 * m + i] = coefficient(v, i);
    struct group guides = {0}, weights = {0};
    for (size_t i = 0; i < (size_t)groom->n_guides * m * 3; i++)
        compare(&guides, (&gradient->guides[0][0])[i], &loss, &loss.reference->guides[0][0] + i, 1e-6);
    for (size_t i = 0; i < (size_t)groom->n_strands * groom->n_instancing; i++)
        compare(&weights, gradient->instancing_weight[i], &loss, &loss.reference->weight[i], 1e-5);
    error.guides = relative(guides);
    error.weights = relative(weights);
    for (uint32_t i = 0; i < groom->n_operators; i++)
        compare_operator(groom, &loss, i, gradient, &error);

    reference_destroy(loss.reference);
    free(loss.coefficients);
    free(loss.points);
    free(loss.part);
    free(loss.parts);
    groom_gradient_destroy(gradient);
    return error;
}
