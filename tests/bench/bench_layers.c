/* A layer over a whole head, as the worker of a job runs it: 90 000 strands of 91 vertices through 90 elements
 * each and back, in place, on two cores. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include "groom/layers.h"
#include "tests/support/superhelix.h"

enum { N = 90000, M = 91, ELEMENTS = 90 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void need(groom_status status, const struct groom_diag *diag)
{
    if (status == GROOM_OK)
        return;
    fprintf(stderr, "bench_layers: %s %s %s\n", groom_status_name(status), diag->pointer, diag->detail);
    exit(1);
}

static struct groom_strands *coils(struct groom_diag *diag)
{
    struct groom_superhelices *h = superhelix_coils(N, 30, 1, 0);
    struct groom_strands *strands;
    need(groom_strands_create(N, (uint64_t)N * M, NULL, &strands, diag), diag);
    for (uint32_t i = 0; i < N; i++)
        strands->first[i + 1] = M * (i + 1);
    need(groom_superhelices_sample(h, M, strands->points, NULL, diag), diag);
    groom_superhelices_destroy(h);
    return strands;
}

/* Every tip 2 cm aside. */
static void pull_all(struct groom *groom, const struct groom_strands *strands, struct groom_diag *diag)
{
    need(groom_insert_operator(groom, 0, GROOM_OPERATOR_SCULPT, 1, diag), diag);
    struct groom_layer *layer = groom->operators[0].layer;
    layer->n_elements = ELEMENTS;
    need(groom_layer_anchors_resize(&layer->anchors, N, groom->allocator), diag);
    for (uint32_t i = 0; i < N; i++) {
        layer->anchors.strand[i] = i;
        layer->anchors.at[i] = 1.0f;
        memcpy(layer->anchors.position[i], strands->points[M * (i + 1) - 1], sizeof(float[3]));
        layer->anchors.position[i][0] += 0.02f;
    }
}

int main(void)
{
    struct groom_diag diag = {0};
    struct groom_pool *pool;
    struct groom *groom;
    struct groom_layer_report report;
    struct rusage before, after;
    need(groom_pool_create(2, &pool), &diag);
    struct groom_context context = {.pool = pool};
    struct groom_strands *strands = coils(&diag);
    need(groom_create_of_strands(strands, &context, &groom, &diag), &diag);
    pull_all(groom, strands, &diag);
    getrusage(RUSAGE_SELF, &before);
    double start = now();
    need(groom_layer_change(groom, 0, strands, NULL, &context, &report, &diag), &diag);
    double took = now() - start;
    getrusage(RUSAGE_SELF, &after);
    printf("figure sculpt_layer_90k_seconds %.3f s 90 000 x 91 vertices, 90 elements, two cores; processor time %.2f s, %.2f s of "
           "it the system's, %ld pages; energy %.3g -> %.3g\n", took,
           (double)(after.ru_utime.tv_sec - before.ru_utime.tv_sec + after.ru_stime.tv_sec - before.ru_stime.tv_sec) +
               1e-6 * (double)(after.ru_utime.tv_usec - before.ru_utime.tv_usec + after.ru_stime.tv_usec - before.ru_stime.tv_usec),
           (double)(after.ru_stime.tv_sec - before.ru_stime.tv_sec) + 1e-6 * (double)(after.ru_stime.tv_usec - before.ru_stime.tv_usec),
           after.ru_minflt - before.ru_minflt, report.sculpt.energy_before, report.sculpt.energy_after);
    groom_destroy(groom);
    groom_strands_destroy(strands);
    groom_pool_destroy(pool);
    return 0;
}
