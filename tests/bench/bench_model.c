/* The procedural model: 100 000 strands x 100 vertices, 500 guides, 125 operator guides, k = 3. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "model/evaluate.h"
#include "tests/support/grooms.h"
#include "tests/support/reference.h"

#define STRANDS 100000
#define VERTICES 100
#define ROUNDS 5

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void require(groom_status status)
{
    if (status != GROOM_OK) {
        fprintf(stderr, "bench_model: %s\n", groom_status_message(status));
        exit(1);
    }
}

/* The best of some rounds over the first n strands, seconds. */
static double time_strands(enum kernel_variant variant, const struct groom *groom, uint32_t n, int rounds,
                           float (*out)[3], const struct groom_context *context)
{
    double best = 1e9;
    for (int round = 0; round < rounds; round++) {
        double start = now();
        require(evaluate_with(variant, groom, 0, n, out, context, NULL));
        double seconds = now() - start;
        best = seconds < best ? seconds : best;
    }
    return best;
}

static double time_evaluate(const struct groom *groom, float (*out)[3], const struct groom_context *context)
{
    return time_strands(kernel_best_variant(), groom, groom->n_strands, ROUNDS, out, context);
}

/* Nanoseconds a vertex in one thread: short rounds, so that the best one ran undisturbed. */
static double vertex_ns(enum kernel_variant variant, const struct groom *groom, float (*out)[3])
{
    enum { SAMPLE = 4096 };
    return 1e9 * time_strands(variant, groom, SAMPLE, 40, out, NULL) / (SAMPLE * (double)VERTICES);
}

/* Seconds that the plain double-precision reference would take for all strands on one core. */
static double time_reference(const struct groom *groom)
{
    enum { SAMPLE = 2000 };
    struct reference *reference = reference_create(groom);
    double (*out)[3] = malloc(VERTICES * sizeof *out), start = now();
    for (uint32_t i = 0; i < SAMPLE; i++)
        reference_strand(reference, i * (groom->n_strands / SAMPLE), out);
    double seconds = (now() - start) * groom->n_strands / SAMPLE;
    free(out);
    reference_destroy(reference);
    return seconds;
}

static void copy_adjoint(void *user, uint32_t first, uint32_t n, const float (*points)[3], float (*d_points)[3])
{
    (void)user;
    (void)first;
    memcpy(d_points, points, (size_t)n * VERTICES * sizeof *points);
}

static double time_gradient(const struct groom *groom, const struct groom_context *context)
{
    struct groom_gradient *gradient;
    double best = 1e9;
    require(groom_gradient_create(groom, NULL, &gradient, NULL));
    for (int round = 0; round < ROUNDS; round++) {
        double start = now();
        require(groom_evaluate_gradient(groom, NULL, groom->n_strands, (struct groom_adjoint){copy_adjoint, NULL},
                                        gradient, context, NULL));
        double seconds = now() - start;
        best = seconds < best ? seconds : best;
    }
    groom_gradient_destroy(gradient);
    return best;
}

static void set_enabled(struct groom *groom, int only)
{
    for (uint32_t i = 0; i < groom->n_operators; i++)
        groom->operators[i].enabled = only < 0 || (int)i == only;
}

int main(void)
{
    struct groom_shape shape = {STRANDS, VERTICES, 500, 125, 3};
    struct groom *groom = test_groom(shape, 1);
    float(*out)[3] = malloc((size_t)STRANDS * VERTICES * sizeof *out);
    struct groom_pool *pool;
    test_append_all_operators(groom, 1);
    require(groom_pool_create(2, &pool));
    struct groom_context both = {.pool = pool};

    double seconds = time_evaluate(groom, out, &both), gradient = time_gradient(groom, &both);
    printf("figure evaluate_100k_seconds %.4f s 100 000 strands x 100, five operators, two threads\n", seconds);
    printf("figure gradient_100k_seconds %.4f s forward and backward, two threads\n", gradient);
    printf("figure gradient_ratio %.2f x gradient / forward\n", gradient / seconds);

    double best = vertex_ns(kernel_best_variant(), groom, out);
    printf("figure evaluate_ns %.2f ns a vertex, one thread, five operators\n", best);
    printf("figure evaluate_vector_ratio %.2f x baseline instruction set / best\n",
           vertex_ns(KERNEL_BASELINE, groom, out) / best);
    printf("figure evaluate_scalar_ratio %.1f x plain scalar reference / best\n",
           1e9 * time_reference(groom) / ((double)STRANDS * VERTICES) / best);
    set_enabled(groom, GROOM_OPERATOR_COUNT);
    double nothing = vertex_ns(kernel_best_variant(), groom, out);
    printf("figure evaluate_instance_ns %.2f ns a vertex: instancing alone\n", nothing);
    for (int type = 0; type < GROOM_OPERATOR_COUNT; type++) {
        set_enabled(groom, type);
        printf("figure evaluate_%s_ns %.2f ns a vertex, besides\n", groom_operator_name((groom_operator_type)type),
               vertex_ns(kernel_best_variant(), groom, out) - nothing);
    }
    groom_pool_destroy(pool);
    groom_destroy(groom);
    free(out);
    return 0;
}
