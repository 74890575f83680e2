/* hairline: today's front hairline of strands, carried to another head: what an artist begins to drag. */
#include <cjson/cJSON.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/format.h"
#include "groom/hairline.h"
#include "groom/spatial.h"
#include "server/worker/retarget_body.h"
#include "server/worker/worker.h"

#define MOST_POINTS 256
#define USUAL_POINTS 33

struct head_file {
    const char *path, *unit, *up;
    struct worker_input input;
};

struct request {
    const char *format, *unit, *up, *points, *asked; /* asked: {"source":{…},"target":{…}}, skeletons and landmarks */
    struct head_file source, target;
};

static int parse(int argc, char **argv, struct request *request)
{
    static const struct option options[] = {
        {"unit", 1, NULL, 'u'},        {"up", 1, NULL, 'a'},          {"format", 1, NULL, 'f'},    {"source", 1, NULL, 's'},
        {"source-unit", 1, NULL, 'S'}, {"source-up", 1, NULL, 'A'},   {"target", 1, NULL, 't'},    {"target-unit", 1, NULL, 'T'},
        {"target-up", 1, NULL, 'p'},   {"asked", 1, NULL, 'j'},       {"points", 1, NULL, 'n'},    {NULL, 0, NULL, 0}};
    int c;
    while ((c = getopt_long(argc, argv, "", options, NULL)) != -1) {
        switch (c) {
        case 'u': request->unit = optarg; break;
        case 'a': request->up = optarg; break;
        case 'f': request->format = optarg; break;
        case 's': request->source.path = optarg; break;
        case 'S': request->source.unit = optarg; break;
        case 'A': request->source.up = optarg; break;
        case 't': request->target.path = optarg; break;
        case 'T': request->target.unit = optarg; break;
        case 'p': request->target.up = optarg; break;
        case 'j': request->asked = optarg; break;
        case 'n': request->points = optarg; break;
        default: return 0;
        }
    }
    if (optind == argc && request->source.path && request->target.path)
        return 1;
    fputs("groom-worker hairline: --source FILE and --target FILE are needed, and no other argument\n", stderr);
    return 0;
}

/* --- roots ------------------------------------------------------------------------------------ */

static groom_status read_roots(const struct request *request, struct worker_input *input, const struct groom_context *context,
                               float (**roots)[3], uint32_t *n, struct groom_diag *diag)
{
    struct groom_read_options options = {0};
    struct groom_strands *strands = NULL;
    groom_status st = worker_frame_parse(request->unit, request->up, &options.frame, diag);
    if (st == GROOM_OK && request->format)
        st = groom_format_parse(request->format, &options.format, diag);
    if (st == GROOM_OK)
        st = groom_strands_read(&input->source, &options, context, &strands, NULL, diag);
    if (st != GROOM_OK)
        return st;
    *n = strands->n_strands;
    if (!(*roots = malloc(*n * sizeof **roots)))
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the roots");
    for (uint32_t i = 0; st == GROOM_OK && i < *n; i++)
        memcpy((*roots)[i], strands->points[strands->first[i]], sizeof **roots);
    groom_strands_destroy(strands);
    return st;
}

/* With the surface that they stand on: by the barycentric coordinates of the nearest point. */
static groom_status carry(float (*roots)[3], uint32_t n, const struct groom_mesh *from, const struct groom_mesh *to,
                          const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_bvh *surface = NULL;
    groom_status st = groom_bvh_create(from, context, &surface, diag);
    for (uint32_t i = 0; st == GROOM_OK && i < n; i++) {
        struct groom_surface_point at;
        if (!groom_bvh_closest(surface, roots[i], INFINITY, &at))
            continue;
        const uint32_t *corner = to->triangles[at.triangle];
        for (int k = 0; k < 3; k++)
            roots[i][k] = at.barycentric[0] * to->points[corner[0]][k] + at.barycentric[1] * to->points[corner[1]][k] +
                          at.barycentric[2] * to->points[corner[2]][k];
    }
    groom_bvh_destroy(surface);
    return st;
}

/* --- bodies ------------------------------------------------------------------------------------- */

static groom_status read_head(struct head_file *file, const struct groom_context *context, struct groom_mesh **mesh,
                              struct groom_diag *diag)
{
    struct groom_mesh_read_options options = {.by_faces_alone = 1};
    groom_status st = worker_frame_parse(file->unit, file->up, &options.frame, diag);
    return st == GROOM_OK ? groom_mesh_read(&file->input.source, &options, context, mesh, NULL, diag) : st;
}

static groom_status open_bodies(struct request *request, const cJSON *asked, const struct groom_context *context,
                                struct retarget_body *source, struct retarget_body *target, struct groom_diag *diag)
{
    groom_status st = read_head(&request->source, context, &source->mesh, diag);
    if (st == GROOM_OK)
        st = retarget_body_open_source(cJSON_GetObjectItemCaseSensitive(asked, "source"), context, source, diag);
    if (st == GROOM_OK)
        st = read_head(&request->target, context, &target->mesh, diag);
    return st == GROOM_OK ? retarget_body_open_target(cJSON_GetObjectItemCaseSensitive(asked, "target"), "", source, context,
                                                      target, diag)
                          : st;
}

/* --- the answer ----------------------------------------------------------------------------------- */

static void add_points(cJSON *json, const char *name, const float (*points)[3], uint32_t n)
{
    cJSON *list = cJSON_AddArrayToObject(json, name);
    for (uint32_t i = 0; i < n; i++) {
        cJSON *point = cJSON_CreateArray();
        for (int k = 0; k < 3; k++)
            cJSON_AddItemToArray(point, cJSON_CreateNumber(round(1e7 * (double)points[i][k]) / 1e7));
        cJSON_AddItemToArray(list, point);
    }
}

static groom_status print(const struct groom_scalp_region *region, const struct groom_scalp_region_report *report, uint32_t n,
                          struct groom_diag *diag)
{
    float front[MOST_POINTS][3];
    cJSON *json = cJSON_CreateObject();
    groom_scalp_region_front(region, n, front);
    add_points(json, "front", (const float(*)[3])front, n);
    add_points(json, "ears", report->ears, 2);
    cJSON_AddNumberToObject(json, "area", report->area);
    cJSON_AddNumberToObject(json, "roots_outside", report->n_roots_outside);
    char *text = cJSON_PrintUnformatted(json);
    cJSON_Delete(json);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the answer");
    puts(text);
    cJSON_free(text);
    return GROOM_OK;
}

static groom_status hairline(void *user, struct worker_input *input, const struct groom_context *context,
                             struct groom_diag *diag)
{
    struct request *request = user;
    struct retarget_body source = {0}, target = {0};
    struct groom_scalp_region_report report;
    struct groom_scalp_region *region = NULL;
    float(*roots)[3] = NULL;
    uint32_t n = 0;
    unsigned long long n_points = 0;
    cJSON *asked = request->asked ? cJSON_Parse(request->asked) : NULL;
    groom_status st = worker_count_parse("--points", request->points, MOST_POINTS, &n_points, diag);
    if (st == GROOM_OK)
        st = read_roots(request, input, context, &roots, &n, diag);
    if (st == GROOM_OK)
        st = open_bodies(request, asked, context, &source, &target, diag);
    if (st == GROOM_OK)
        st = carry(roots, n, source.mesh, target.mesh, context, diag);
    if (st == GROOM_OK)
        st = groom_scalp_region_create(target.mesh, (const float(*)[3])roots, n, &target.skeleton, NULL, context, &region,
                                       &report, diag);
    if (st == GROOM_OK)
        st = print(region, &report, n_points > 1 ? (uint32_t)n_points : USUAL_POINTS, diag);
    groom_scalp_region_destroy(region);
    retarget_body_finish(&source);
    retarget_body_finish(&target);
    cJSON_Delete(asked);
    free(roots);
    return st;
}

int worker_hairline(int argc, char **argv)
{
    struct request request = {0};
    struct groom_diag diag = {0};
    if (!parse(argc, argv, &request))
        return WORKER_USAGE;
    groom_status st = worker_input_open_path(request.source.path, "the source's head", &request.source.input, &diag);
    if (st == GROOM_OK)
        st = worker_input_open_path(request.target.path, "the target's head", &request.target.input, &diag);
    int exit_status = st == GROOM_OK ? worker_run_sandboxed(hairline, &request) : worker_print_problem(st, &diag);
    worker_input_close(&request.source.input);
    worker_input_close(&request.target.input);
    return exit_status;
}
