/* Retargeting long and short hair from the sample's head to one of other proportions. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include "groom/retarget.h"
#include "groom/sample.h"
#include "tests/support/bodies.h"

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
    fprintf(stderr, "bench_retarget: %s: %s\n", groom_status_name(status), diag->detail);
    exit(1);
}

/* Memory of the library alone, at its most. */
struct meter {
    size_t now, most;
};

static void *meter_allocate(void *user, size_t bytes)
{
    struct meter *meter = user;
    size_t n = __atomic_add_fetch(&meter->now, bytes, __ATOMIC_RELAXED), most = __atomic_load_n(&meter->most, __ATOMIC_RELAXED);
    while (n > most && !__atomic_compare_exchange_n(&meter->most, &most, n, 0, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
        continue;
    return groom_default_allocator.allocate(groom_default_allocator.user, bytes);
}

static void meter_release(void *user, void *memory, size_t bytes)
{
    struct meter *meter = user;
    if (memory)
        __atomic_sub_fetch(&meter->now, bytes, __ATOMIC_RELAXED);
    groom_default_allocator.release(groom_default_allocator.user, memory, bytes);
}

struct hair {
    struct groom_sample *sample;
    struct groom_mesh *target;
    struct groom_skeleton skeleton, target_skeleton;
};

static struct hair hair_of(groom_sample_style style, uint32_t n_strands, uint32_t n_vertices, const struct groom_context *context)
{
    struct groom_sample_options options;
    struct groom_diag diag;
    struct hair hair;
    groom_sample_options_init(style, &options);
    options.n_strands = n_strands;
    options.n_vertices = n_vertices;
    options.n_cameras = 0;
    need(groom_sample_create(&options, context, &hair.sample, &diag), &diag);
    hair.target = bodies_reshaped(hair.sample->head, 1.0);
    need(groom_skeleton_make(hair.sample->head, context, &hair.skeleton, &diag), &diag);
    need(groom_skeleton_carry(&hair.skeleton, hair.sample->head, hair.target, &hair.target_skeleton, &diag), &diag);
    return hair;
}

static void hair_finish(struct hair *hair)
{
    groom_sample_destroy(hair->sample);
    groom_mesh_destroy(hair->target);
}

static void tell(const char *name, const struct groom_retarget_report *r)
{
    printf("%s: %u strands, %llu particles, %u guides; iterations %u, %u; initial %.2f s, coarse %.2f s, fine %.2f s, last pass %.2f s\n", name,
           r->n_strands, (unsigned long long)r->n_vertices, r->n_guides, r->iterations_coarse, r->iterations_fine,
           r->seconds_initial, r->seconds_coarse, r->seconds_fine, r->seconds_clearance);
    printf("  inside %llu vertices, %llu segments, %llu too near before; %llu, %llu, %llu after; without a bone %llu\n",
           (unsigned long long)r->inside_before.vertices, (unsigned long long)r->inside_before.segments,
           (unsigned long long)r->inside_before.near_vertices, (unsigned long long)r->inside_after.vertices,
           (unsigned long long)r->inside_after.segments, (unsigned long long)r->inside_after.near_vertices,
           (unsigned long long)r->n_without_bone);
    printf("  energy %.6g (%.6g, %.6g, %.6g) before, %.6g (%.6g, %.6g, %.6g) after; lengths %.3f %.3f %.3f; movement mean %.2g most %.2g m\n",
           r->before.total, r->before.shape, r->before.inter, r->before.body, r->after.total, r->after.shape, r->after.inter,
           r->after.body, r->length_ratio_min, r->length_ratio_median, r->length_ratio_max, r->movement_mean, r->movement_max);
}

/* Prints name_seconds and, where asked for, name_preprocess_seconds and name_bytes. */
static void bench(const char *name, groom_sample_style style, uint32_t n_strands, uint32_t n_vertices, groom_retarget_mode mode,
                  int preprocess, int bytes, struct groom_pool *pool)
{
    struct meter meter = {0};
    struct groom_allocator allocator = {meter_allocate, meter_release, &meter};
    struct groom_context context = {.pool = pool}, metered = {.pool = pool, .allocator = &allocator};
    struct hair hair = hair_of(style, n_strands, n_vertices, &context);
    struct groom_retarget_target target = {hair.target, &hair.target_skeleton, NULL};
    const struct groom_strands *strands = hair.sample->capture;
    struct groom_retarget_options options;
    struct groom_retarget_source *source;
    struct groom_retarget_report report;
    struct groom_diag diag;
    float(*out)[3] = malloc((size_t)strands->n_vertices * sizeof *out);
    groom_retarget_options_init(&options);
    options.mode = mode;
    double start = now(), prepared;
    need(groom_retarget_source_create(strands, hair.sample->head, &hair.skeleton, NULL, &options, &metered, &source, &diag), &diag);
    prepared = now();
    need(groom_retarget_run(source, &target, &options, &metered, out, NULL, &report, &diag), &diag);
    double end = now();
    tell(name, &report);
    printf("  preparation %.2f s, memory %.0f MB with the strands and the result\n", prepared - start,
           1e-6 * (double)(meter.most + 2 * (size_t)strands->n_vertices * sizeof *out));
    printf("figure retarget_%s_seconds %.3f s\n", name, end - prepared);
    if (preprocess)
        printf("figure retarget_%s_preprocess_seconds %.3f s\n", name, prepared - start);
    if (bytes)
        printf("figure retarget_%s_bytes %zu bytes at most, strands and result with it\n", name,
               meter.most + 2 * (size_t)strands->n_vertices * sizeof *out);
    groom_retarget_source_destroy(source);
    free(out);
    hair_finish(&hair);
}

int main(int argc, char **argv)
{
    struct groom_pool *pool;
    const char *only = argc > 1 ? argv[1] : NULL;
    if (groom_pool_create(2, &pool) != GROOM_OK)
        return 1;
    if (!only || strcmp(only, "8m") == 0)
        bench("8m", GROOM_SAMPLE_STRAIGHT, 96000, 89, GROOM_RETARGET_MULTISCALE, 1, 0, pool);
    if (!only || strcmp(only, "3m") == 0)
        bench("3m", GROOM_SAMPLE_CURLY, 113000, 26, GROOM_RETARGET_MULTISCALE, 0, 1, pool);
    if (!only || strcmp(only, "short") == 0)
        bench("short", GROOM_SAMPLE_SHORT, 65819, 7, GROOM_RETARGET_MULTISCALE, 0, 0, pool);
    if (!only || strcmp(only, "8m_global") == 0)
        bench("8m_global", GROOM_SAMPLE_STRAIGHT, 96000, 89, GROOM_RETARGET_GLOBAL, 0, 0, pool);
    groom_pool_destroy(pool);
    return 0;
}
