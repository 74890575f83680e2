/* Curvature space: conversion and sampling on two cores, sculpting on one. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "groom/random.h"
#include "tests/support/adam.h"
#include "tests/support/superhelix.h"

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Of this thread alone, for figures that are told per core. */
static double now_core(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
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

/* One to three anchors a strand, moved by some 3 cm: what a hand on an armature does. */
static struct groom_anchor *some_anchors(const struct groom_superhelices *h, size_t *n_anchors)
{
    struct groom_anchor *anchors = calloc((size_t)h->n_strands * 3, sizeof *anchors);
    size_t n = 0;
    for (uint32_t i = 0; i < h->n_strands; i++)
        for (uint32_t k = 0; k <= i % 3; k++) {
            struct groom_anchor *a = &anchors[n++];
            double arc = groom_superhelix_length(h, i) * (a->at = 1.0 - 0.3 * k);
            a->strand = i;
            groom_superhelix_sample(h, i, &arc, 1, &a->position, NULL);
            for (uint32_t c = 0; c < 3; c++)
                a->position[c] += 0.017 * groom_random_normal((struct groom_random_key){4, c}, i, k);
        }
    *n_anchors = n;
    return anchors;
}

struct adam_total {
    double seconds, energy;
};

/* The paper's Adam with the same linear-time gradient, on the first strands. */
static struct adam_total run_adam(const struct groom_superhelices *h, const struct groom_anchor *anchors,
                                  uint32_t n_strands, const struct groom_sculpt_options *options)
{
    struct adam_total total = {0};
    double start = now_core();
    for (uint32_t i = 0; i < n_strands; i++) {
        struct located_anchor located[3];
        struct sculpt_problem p = {.chain = chain_of(h, i), .anchor = located};
        double length = groom_superhelix_length(h, i);
        for (; anchors->strand == i; anchors++) /* the tip first: the problem wants them rising */
            p.n_anchors++;
        for (uint32_t k = 0; k < p.n_anchors; k++)
            located[k] = energy_locate(&p.chain, anchors[-1 - (int)k].at * length, anchors[-1 - (int)k].position);
        p.rest = p.chain.q;
        p.c = options->stiffness / p.chain.n;
        total.energy += adam_sculpt(&p, 100.0).energy;
    }
    total.seconds = now_core() - start;
    return total;
}

static void bench_sculpt(uint32_t n_elements)
{
    enum { N = 12000, ADAM = 12 };
    struct groom_superhelices *h = superhelix_coils(N, n_elements, 1, 0), *copy;
    struct groom_sculpt_options options = groom_sculpt_options_default();
    struct groom_sculpt_outcome *outcomes = calloc(N, sizeof *outcomes);
    size_t n_anchors;
    struct groom_anchor *anchors = some_anchors(h, &n_anchors);
    double best = 1e9, energy = 0.0, iterations = 0.0;
    for (int round = 0; round < 3; round++) {
        need(groom_superhelices_copy(h, NULL, &copy, NULL));
        double start = now_core();
        need(groom_superhelices_sculpt(copy, NULL, anchors, n_anchors, &options, NULL, outcomes, NULL));
        best = now_core() - start < best ? now_core() - start : best;
        groom_superhelices_destroy(copy);
    }
    for (uint32_t i = 0; i < N; i++) {
        iterations += (double)outcomes[i].iterations / N;
        energy += i < ADAM ? outcomes[i].energy_after : 0.0;
    }
    struct adam_total adam = run_adam(h, anchors, ADAM, &options);
    printf("figure sculpt_%u_strands_per_s %.0f strands/s one core, 1-3 anchors, %.1f iterations; the paper's Adam: "
           "%.0f times the time, %.6f times the energy\n", n_elements, N / best, iterations,
           adam.seconds / ADAM / (best / N), adam.energy / energy);
    free(anchors), free(outcomes);
    groom_superhelices_destroy(h);
}

/* A lock of 2 000 strands in somebody's hand: each frame the anchors have moved on by some millimetres, the
 * solver begins at the last result, and all strands are sampled for drawing. */
static void bench_drag(const struct groom_context *context)
{
    enum { N = 2000, FRAMES = 30, VERTICES = 100 };
    struct groom_superhelices *rest = superhelix_coils(N, 45, 1, 0), *now_at;
    struct groom_sculpt_options options = groom_sculpt_options_default();
    struct groom_sculpt_outcome *outcomes = calloc(N, sizeof *outcomes);
    float(*points)[3] = calloc((size_t)N * VERTICES, sizeof *points);
    size_t n_anchors;
    struct groom_anchor *anchors = some_anchors(rest, &n_anchors);
    double worst = 0.0, start = now(), iterations = 0.0;
    options.n_roads = 0;
    options.tolerance = 1e-5; /* the next frame goes on from here */
    need(groom_superhelices_copy(rest, NULL, &now_at, NULL));
    for (uint32_t frame = 0; frame < FRAMES; frame++) {
        double begin = now();
        for (size_t k = 0; k < n_anchors; k++)
            anchors[k].position[frame / 10 % 3] += 0.003;
        need(groom_superhelices_sculpt(now_at, (const double(*)[3])rest->q, anchors, n_anchors, &options, context, outcomes,
                                       NULL));
        need(groom_superhelices_sample(now_at, VERTICES, points, context, NULL));
        worst = now() - begin > worst ? now() - begin : worst;
        for (uint32_t i = 0; i < N; i++)
            iterations += (double)outcomes[i].iterations / N / FRAMES;
    }
    printf("figure sculpt_drag_2000_seconds %.4f s a frame, two cores, 45 elements, 3 mm a frame, sampled at %d vertices; "
           "%.1f iterations; the slowest frame %.4f s\n", (now() - start) / FRAMES, VERTICES, iterations, worst);
    free(anchors), free(outcomes), free(points);
    groom_superhelices_destroy(rest), groom_superhelices_destroy(now_at);
}

static void bench_ruffle(const struct groom_context *context)
{
    enum { N = 100000 };
    struct groom_superhelices *h = superhelix_coils(N, 90, 1, 0), *out;
    struct groom_ruffle_options options = {.rho = 0.05, .match_elements = 30, .blend = 1.0, .seed = 1};
    double best = 1e9;
    for (int round = 0; round < 3; round++) {
        double start = now();
        need(groom_superhelices_ruffle(h, &options, context, &out, NULL));
        best = now() - start < best ? now() - start : best;
        groom_superhelices_destroy(out);
    }
    printf("figure ruffle_100k_seconds %.3f s 90 elements, rho 0.05\n", best);
    groom_superhelices_destroy(h);
}

static void bench_analyze(const struct groom_context *context)
{
    enum { N = 20000 };
    struct groom_superhelices *h = superhelix_coils(N, 45, 1, 0);
    struct groom_analysis_options options = groom_analysis_options_default();
    struct groom_analysis *analysis;
    double start = now();
    need(groom_superhelices_analyze(h, &options, context, &analysis, NULL));
    printf("figure analyze_strands_per_s %.0f strands/s 45 elements\n", N / (now() - start));
    groom_analysis_destroy(analysis);
    groom_superhelices_destroy(h);
}

static void bench_clusters(const struct groom_context *context)
{
    enum { N = 100000, CLUSTERS = 32, FRAMES = 6 };
    struct groom_strands *strands = coils_as_points(N, 100);
    struct groom_clusters *clusters;
    static struct groom_cluster_frame frames[CLUSTERS * FRAMES];
    const double at[FRAMES] = {1.0 / 6, 2.0 / 6, 3.0 / 6, 4.0 / 6, 5.0 / 6, 1.0};
    double start = now();
    need(groom_strands_cluster(strands, CLUSTERS, 1, context, &clusters, NULL));
    need(groom_clusters_frames(clusters, strands, at, FRAMES, context, frames, NULL));
    printf("figure clusters_100k_seconds %.3f s 32 clusters, 6 frames each\n", now() - start);
    groom_clusters_destroy(clusters);
    groom_strands_destroy(strands);
}

int main(void)
{
    struct groom_pool *pool;
    need(groom_pool_create(2, &pool));
    struct groom_context context = {.pool = pool};
    bench_convert(&context);
    bench_sample(&context);
    bench_analyze(&context);
    bench_ruffle(&context);
    bench_sculpt(45);
    bench_sculpt(90);
    bench_drag(&context);
    bench_clusters(&context);
    groom_pool_destroy(pool);
    return 0;
}
