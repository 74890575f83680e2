/* Real captures, each to a groom at `standard` with 500 guides: a quality report, and the groom beside its
 * target at the same cameras.
 *   real_captures DATA OUTPUT [NAME...]
 * DATA is a folder of captures (tests/e2e/real_captures.test.mjs has the same ones); OUTPUT gets NAME.json and
 * NAME-{target,groom}-{front,side,back,top}.png. Those that are not there are passed over, and said. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "groom/fit.h"
#include "groom/format.h"
#include "groom/quality.h"
#include "groom/render.h"
#include "groom/strands.h"

#define SIZE 768 /* pixels of a picture's side */

static const struct capture {
    const char *name, *strands, *head;
    struct groom_frame frame;
} captures[] = {
    {"harolongo", "harolongo/hair.data", "harolongo/body.obj", {.unit_m = 0.01}},
    {"sintel", "sintel/hair.tfx", "sintel/head.obj", {.unit_m = 1}},
    {"combover", "combover/hair.data", "combover/body.obj", {.unit_m = 1, .up = GROOM_UP_Z}},
};

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void check(groom_status st, const struct groom_diag *diag)
{
    if (st == GROOM_OK)
        return;
    fprintf(stderr, "real_captures: %s: %s\n", groom_status_name(st), diag->detail);
    exit(1);
}

static FILE *open_file(const char *folder, const char *name, const char *mode)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, mode);
    if (!file && mode[0] == 'w') {
        perror(path);
        exit(1);
    }
    return file;
}

static void read_inputs(const struct capture *capture, const char *data, struct groom_strands **strands,
                        struct groom_mesh **head, const struct groom_context *context)
{
    struct groom_diag diag = {0};
    struct groom_read_options read = {.frame = capture->frame};
    struct groom_mesh_read_options read_head = {.frame = capture->frame};
    FILE *file = open_file(data, capture->strands, "rb"), *mesh = open_file(data, capture->head, "rb");
    struct groom_source source = groom_source_from_fd(fileno(file));
    check(groom_strands_read(&source, &read, context, strands, NULL, &diag), &diag);
    fclose(file);
    if (mesh) {
        source = groom_source_from_fd(fileno(mesh));
        check(groom_mesh_read(&source, &read_head, context, head, NULL, &diag), &diag);
        fclose(mesh);
    }
}

static struct groom *fit_groom(const struct groom_strands *strands, const struct groom_mesh *head,
                               const struct groom_context *context)
{
    struct groom_fit_options options;
    struct groom_fit *fit;
    struct groom *groom;
    struct groom_diag diag = {0};
    groom_fit_options_init(GROOM_FIT_STANDARD, &options);
    options.guides = 500;
    check(groom_fit_create(strands, head, &options, context, &fit, &diag), &diag);
    while (!groom_fit_done(fit))
        check(groom_fit_step(fit, context, &diag), &diag);
    check(groom_fit_result(fit, context, &groom, &diag), &diag);
    groom_fit_destroy(fit);
    return groom;
}

static groom_status write_bytes(void *user, const void *bytes, size_t n)
{
    return fwrite(bytes, 1, n, user) == n ? GROOM_OK : GROOM_EIO;
}

static void draw(const struct groom_strands *strands, const struct groom_strands *framed_as, const struct groom_mesh *head,
                 const char *folder, const char *name, const char *what, const struct groom_context *context)
{
    uint8_t *rgba = malloc((size_t)SIZE * SIZE * 4);
    struct groom_diag diag = {0};
    for (int view = 0; rgba && view < GROOM_VIEW_COUNT; view++) {
        struct groom_render_options options = {.view = (groom_view)view, .size = SIZE, .framed_as = framed_as};
        char file_name[128];
        snprintf(file_name, sizeof file_name, "%s-%s-%s.png", name, what, groom_view_name((groom_view)view));
        FILE *file = open_file(folder, file_name, "wb");
        check(groom_render_strands(strands, head, &options, rgba, context, &diag), &diag);
        check(groom_png_write(rgba, SIZE, SIZE, (struct groom_sink){write_bytes, file}, context, &diag), &diag);
        fclose(file);
    }
    free(rgba);
}

static struct groom_strands *evaluate(const struct groom *groom, const struct groom_context *context)
{
    struct groom_strands *strands;
    struct groom_diag diag = {0};
    uint32_t n = groom->n_strands, m = groom->n_vertices;
    check(groom_strands_create(n, (uint64_t)n * m, context, &strands, &diag), &diag);
    for (uint32_t i = 0; i <= n; i++)
        strands->first[i] = i * m;
    check(groom_evaluate(groom, 0, n, strands->points, context, &diag), &diag);
    return strands;
}

static void print_row(const char *name, const char *when, double seconds, const struct groom_quality *q)
{
    printf("%-10s %-7s %6.1f", name, when, seconds);
    for (int k = 0; k < GROOM_QUALITY_TOLERANCES; k++)
        printf("  %.3f %.3f", q->scores[k].f_score, q->scores[k].nearest_f_score);
    printf("  %5.2f %5.2f  %5.1f %5.1f %5.1f %5.1f %5.1f  %5u %5u\n", 1000 * q->to_target.mean, 1000 * q->to_groom.mean,
           q->spectra.distance / q->spectra.floor, q->segments.distance / q->segments.floor,
           q->curvature.distance / q->curvature.floor, q->torsion.distance / q->torsion.floor,
           q->length.distance / q->length.floor, q->head_groom.strands, q->head_target.strands);
    fflush(stdout);
}

static void run(const struct capture *capture, const char *data, const char *folder, const struct groom_context *context)
{
    struct groom_strands *strands = NULL, *fitted;
    struct groom_mesh *head = NULL;
    struct groom_quality_target *target;
    struct groom_quality after, before;
    struct groom_diag diag = {0};
    char file_name[128], *json;
    read_inputs(capture, data, &strands, &head, context);
    double begin = now();
    struct groom *groom = fit_groom(strands, head, context);
    double seconds = now() - begin;
    check(groom_quality_target_create(strands, head, NULL, context, &target, &diag), &diag);
    check(groom_quality_of_groom(target, groom, context, &after, &before, &diag), &diag);
    print_row(capture->name, "fitted", seconds, &after);
    print_row(capture->name, "drawn", seconds, &before);
    check(groom_quality_print(&after, &before, &json, &diag), &diag);
    snprintf(file_name, sizeof file_name, "%s.json", capture->name);
    FILE *file = open_file(folder, file_name, "w");
    fprintf(file, "%s\n", json);
    fclose(file);
    free(json);
    fitted = evaluate(groom, context);
    draw(strands, NULL, head, folder, capture->name, "target", context);
    draw(fitted, strands, head, folder, capture->name, "groom", context);
    groom_strands_destroy(fitted);
    groom_quality_target_destroy(target);
    groom_destroy(groom);
    groom_mesh_destroy(head);
    groom_strands_destroy(strands);
}

static int wanted(const char *name, int argc, char **argv)
{
    for (int i = 3; i < argc; i++)
        if (strcmp(argv[i], name) == 0)
            return 1;
    return argc == 3;
}

int main(int argc, char **argv)
{
    struct groom_pool *pool;
    struct groom_context context = {0};
    if (argc < 3) {
        fputs("usage: real_captures DATA OUTPUT [NAME...]\n", stderr);
        return 2;
    }
    if (groom_pool_create(0, &pool) != GROOM_OK)
        return 1;
    context.pool = pool;
    printf("F-scores by any near segment and by the nearest one; nearest distances in mm; distances of distributions "
           "over their floors; strands inside the head\n%-10s %-7s %6s  %-11s  %-11s  %-11s  %5s %5s  %5s %5s %5s %5s %5s  %5s %5s\n",
           "capture", "numbers", "fit s", "1 mm 10 deg", "2 mm 20 deg", "3 mm 30 deg", "to t.", "to g.", "spec.", "segm.",
           "curv.", "tors.", "len.", "groom", "targ.");
    for (size_t k = 0; k < sizeof captures / sizeof captures[0]; k++) {
        FILE *there = open_file(argv[1], captures[k].strands, "rb");
        if (there)
            fclose(there);
        else
            printf("%s is not in %s: passed over\n", captures[k].strands, argv[1]);
        if (there && wanted(captures[k].name, argc, argv))
            run(&captures[k], argv[1], argv[2], &context);
    }
    groom_pool_destroy(pool);
    return 0;
}
