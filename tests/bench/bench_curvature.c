/* Curvature space: conversion and sampling, strands a second on two cores. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "tests/support/superhelix.h"

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void need(groom_status status)
{
    if (status == GROOM_OK)
        return;
    fprintf(stderr, "bench_curvature: %s\n", groom_status_name(status));
    exit(1);
}

static struct groom_strands *coils_as_points(uint32_t n_strands, uint32_t n_vertices)
{
    struct groom_superhelices *h = superhelix_coils(n_strands, 30, 1, 0);
    struct groom_strands *strands;
    need(groom_strands_create(n_strands, (uint64_t)n_strands * n_vertices, NULL, &strands, NULL));
    for (uint32_t i = 0; i < n_strands; i++)
        strands->first[i + 1] = n_vertices * (i + 1);
    need(groom_superhelices_sample(h, n_vertices, strands->points, NULL, NULL));
    groom_superhelices_destroy(h);
    return strands;
}

static void bench_convert(const struct groom_context *context)
{
    enum { N = 20000 };
    struct groom_strands *strands = coils_as_points(N, 100);
    struct groom_conversion_options options = groom_conversion_options_default();
    for (uint32_t n_elements = 45;; n_elements = 0) {
        struct groom_conversion *c;
        double error = 0.0, best = 1e9;
        options.n_elements = n_elements;
        for (int round = 0; round < 3; round++) {
            double start = now();
            need(groom_strands_convert(strands, &options, context, &c, NULL));
            best = now() - start < best ? now() - start : best;
            error = 0.0;
            for (uint32_t i = 0; i < N; i++)
                error += (double)c->reports[i].error_rms_m / N;
            if (round < 2)
                groom_conversion_destroy(c);
        }
        printf("figure %s %.0f strands/s 100 vertices, %.1f elements, mean rms error %.3g mm\n",
               n_elements ? "convert_strands_per_s" : "convert_auto_strands_per_s", N / best,
               (double)c->helices->n_elements / N, 1e3 * error);
        groom_conversion_destroy(c);
        if (n_elements == 0)
            break;
    }
    groom_strands_destroy(strands);
}

static void bench_sample(const struct groom_context *context)
{
    enum { N = 20000 };
    struct groom_superhelices *h = superhelix_coils(N, 90, 1, 0);
    float(*out)[3] = calloc((size_t)N * 100, sizeof *out);
    double best = 1e9;
    for (int round = 0; round < 3; round++) {
        double start = now();
        need(groom_superhelices_sample(h, 100, out, context, NULL));
        best = now() - start < best ? now() - start : best;
    }
    printf("figure sample_helices_vertices_per_s %.3g vertices/s 100 vertices of 90 elements\n", N * 100.0 / best);
    free(out);
    groom_superhelices_destroy(h);
}

int main(void)
{
    struct groom_pool *pool;
    need(groom_pool_create(2, &pool));
    struct groom_context context = {.pool = pool};
    bench_convert(&context);
    bench_sample(&context);
    groom_pool_destroy(pool);
    return 0;
}
