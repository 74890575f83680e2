/* inspect: what a file of untrusted bytes holds, as one JSON object. */
#include <cjson/cJSON.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/format.h"
#include "groom/mesh.h"
#include "groom/strands.h"
#include "server/worker/worker.h"

struct request {
    const char *kind, *format, *unit, *up, *max_vertices;
    struct groom_frame frame;
    unsigned long long n_max;
};

/* --- JSON ------------------------------------------------------------------------ */

static cJSON *number(float value)
{
    char text[32];
    snprintf(text, sizeof text, "%.9g", (double)value);
    return cJSON_CreateRaw(text);
}

static void add_box(cJSON *object, const float minimum[3], const float maximum[3])
{
    cJSON *box = cJSON_AddObjectToObject(object, "bbox");
    cJSON *low = cJSON_AddArrayToObject(box, "min"), *high = cJSON_AddArrayToObject(box, "max");
    for (int i = 0; i < 3; i++) {
        cJSON_AddItemToArray(low, number(minimum[i]));
        cJSON_AddItemToArray(high, number(maximum[i]));
    }
}

static void add_warnings(cJSON *object, uint32_t n, const char (*warnings)[160])
{
    cJSON *array = cJSON_AddArrayToObject(object, "warnings");
    for (uint32_t i = 0; i < n; i++)
        cJSON_AddItemToArray(array, cJSON_CreateString(warnings[i]));
}

static groom_status print_object(cJSON *object, struct groom_diag *diag)
{
    char *text = cJSON_PrintUnformatted(object);
    cJSON_Delete(object);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the answer");
    puts(text);
    free(text);
    return GROOM_OK;
}

/* --- strands ----------------------------------------------------------------------- */

static cJSON *describe_strands(const struct groom_strands_summary *summary,
                               const struct groom_read_report *report)
{
    cJSON *object = cJSON_CreateObject(), *length, *dropped;
    cJSON_AddStringToObject(object, "format", groom_format_name(report->format));
    cJSON_AddNumberToObject(object, "strands", summary->n_strands);
    cJSON_AddNumberToObject(object, "vertices", summary->n_vertices);
    add_box(object, summary->bbox_min, summary->bbox_max);
    length = cJSON_AddObjectToObject(object, "length");
    cJSON_AddItemToObject(length, "min", number(summary->length_min));
    cJSON_AddItemToObject(length, "median", number(summary->length_median));
    cJSON_AddItemToObject(length, "max", number(summary->length_max));
    dropped = cJSON_AddObjectToObject(object, "dropped");
    cJSON_AddNumberToObject(dropped, "short", (double)report->n_dropped_short);
    cJSON_AddNumberToObject(dropped, "zero_length", (double)report->n_dropped_zero_length);
    cJSON_AddNumberToObject(dropped, "not_finite", (double)report->n_dropped_not_finite);
    add_warnings(object, report->n_warnings, (const char(*)[160])report->warnings);
    return object;
}

static groom_status inspect_strands(const struct request *request, struct worker_input *input,
                                    const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_read_options options = {.frame = request->frame, .max_vertices = request->n_max};
    struct groom_strands *strands = NULL;
    struct groom_read_report report;
    struct groom_strands_summary summary;
    groom_status st = GROOM_OK;
    if (request->format)
        st = groom_format_parse(request->format, &options.format, diag);
    if (st == GROOM_OK)
        st = groom_strands_read(&input->source, &options, context, &strands, &report, diag);
    if (st == GROOM_OK)
        st = groom_strands_summarize(strands, context, &summary, diag);
    if (st == GROOM_OK)
        st = print_object(describe_strands(&summary, &report), diag);
    groom_strands_destroy(strands);
    return st;
}

/* --- heads --------------------------------------------------------------------------- */

static cJSON *describe_head(const struct groom_mesh *mesh, const struct groom_mesh_read_report *report)
{
    cJSON *object = cJSON_CreateObject(), *dropped;
    float minimum[3], maximum[3];
    groom_mesh_bounds(mesh, minimum, maximum);
    cJSON_AddStringToObject(object, "format", groom_mesh_format_name(report->format));
    cJSON_AddNumberToObject(object, "vertices", mesh->n_vertices);
    cJSON_AddNumberToObject(object, "triangles", mesh->n_triangles);
    add_box(object, minimum, maximum);
    cJSON_AddBoolToObject(object, "has_uv", mesh->uvs != NULL);
    dropped = cJSON_AddObjectToObject(object, "dropped");
    cJSON_AddNumberToObject(dropped, "not_finite", (double)report->n_dropped_not_finite);
    cJSON_AddNumberToObject(dropped, "degenerate", (double)report->n_dropped_degenerate);
    add_warnings(object, report->n_warnings, (const char(*)[160])report->warnings);
    return object;
}

static groom_status inspect_head(const struct request *request, struct worker_input *input,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_mesh_read_options options = {.frame = request->frame};
    struct groom_mesh *mesh = NULL;
    struct groom_mesh_read_report report;
    groom_status st = GROOM_OK;
    if (request->format)
        st = groom_mesh_format_parse(request->format, &options.format, diag);
    if (st == GROOM_OK)
        st = groom_mesh_read(&input->source, &options, context, &mesh, &report, diag);
    if (st == GROOM_OK && request->n_max && mesh->n_vertices > request->n_max)
        st = groom_fail(diag, GROOM_ETOOBIG, "the mesh has %u vertices; at most %llu are taken",
                        mesh->n_vertices, request->n_max);
    if (st == GROOM_OK)
        st = print_object(describe_head(mesh, &report), diag);
    groom_mesh_destroy(mesh);
    return st;
}

/* --- the command ------------------------------------------------------------------------ */

static int parse(int argc, char **argv, struct request *request)
{
    static const struct option options[] = {{"kind", 1, NULL, 'k'},         {"format", 1, NULL, 'f'},
                                            {"unit", 1, NULL, 'u'},         {"up", 1, NULL, 'a'},
                                            {"max-vertices", 1, NULL, 'n'}, {NULL, 0, NULL, 0}};
    int c;
    while ((c = getopt_long(argc, argv, "", options, NULL)) != -1) {
        switch (c) {
        case 'k':
            request->kind = optarg;
            break;
        case 'f':
            request->format = worker_format_name(optarg);
            break;
        case 'u':
            request->unit = optarg;
            break;
        case 'a':
            request->up = optarg;
            break;
        case 'n':
            request->max_vertices = optarg;
            break;
        default:
            return 0;
        }
    }
    if (optind == argc && request->kind &&
        (!strcmp(request->kind, "strands") || !strcmp(request->kind, "head")))
        return 1;
    fputs("groom-worker inspect: --kind strands or --kind head is needed, and no other argument\n", stderr);
    return 0;
}

static groom_status inspect(void *user, struct worker_input *input, const struct groom_context *context,
                            struct groom_diag *diag)
{
    struct request *request = user;
    groom_status st = worker_frame_parse(request->unit, request->up, &request->frame, diag);
    if (st == GROOM_OK)
        st = worker_count_parse("--max-vertices", request->max_vertices, UINT32_MAX, &request->n_max, diag);
    if (st != GROOM_OK)
        return st;
    return (!strcmp(request->kind, "head") ? inspect_head : inspect_strands)(request, input, context, diag);
}

int worker_inspect(int argc, char **argv)
{
    struct request request = {0};
    return parse(argc, argv, &request) ? worker_run_sandboxed(inspect, &request) : WORKER_USAGE;
}
