/* compare: how alike strands are to a target's (groom/quality.h). */
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>

#include "groom/format.h"
#include "groom/mesh.h"
#include "groom/quality.h"
#include "groom/strands.h"
#include "server/worker/worker.h"

/* A file of the command line, and the frame that it is in. */
struct named_file {
    const char *path, *format, *unit, *up;
    struct groom_frame frame;
    struct worker_input input;
};

struct request {
    struct named_file groom, target, drawn, head; /* groom: standard input */
};

static int parse(int argc, char **argv, struct request *request)
{
    static const struct option options[] = {
        {"unit", 1, NULL, 'u'},      {"up", 1, NULL, 'a'},        {"target", 1, NULL, 't'},    {"target-unit", 1, NULL, 'T'},
        {"target-up", 1, NULL, 'p'}, {"head", 1, NULL, 'h'},      {"head-unit", 1, NULL, 'H'}, {"head-up", 1, NULL, 'A'},
        {"drawn", 1, NULL, 'd'},     {"format", 1, NULL, 'f'},    {"target-format", 1, NULL, 'F'}, {NULL, 0, NULL, 0}};
    int c;
    while ((c = getopt_long(argc, argv, "", options, NULL)) != -1) {
        switch (c) {
        case 'u': request->groom.unit = optarg; break;
        case 'a': request->groom.up = optarg; break;
        case 't': request->target.path = optarg; break;
        case 'T': request->target.unit = optarg; break;
        case 'p': request->target.up = optarg; break;
        case 'h': request->head.path = optarg; break;
        case 'H': request->head.unit = optarg; break;
        case 'A': request->head.up = optarg; break;
        case 'f': request->groom.format = optarg; break;
        case 'F': request->target.format = optarg; break;
        case 'd': request->drawn.path = optarg; break;
        default: return 0;
        }
    }
    if (optind < argc)
        fprintf(stderr, "groom-worker compare: \"%s\" is one argument too many\n", argv[optind]);
    else if (!request->target.path)
        fputs("groom-worker compare: --target FILE is missing\n", stderr);
    request->drawn.format = request->groom.format;
    request->drawn.unit = request->groom.unit;
    request->drawn.up = request->groom.up;
    return optind == argc && request->target.path;
}

static groom_status open_files(struct request *request, struct groom_diag *diag)
{
    groom_status st = worker_input_open_path(request->target.path, "the target", &request->target.input, diag);
    if (st == GROOM_OK)
        st = worker_input_open_path(request->drawn.path, "the file of --drawn", &request->drawn.input, diag);
    if (st == GROOM_OK)
        st = worker_input_open_path(request->head.path, "the head", &request->head.input, diag);
    return st;
}

static groom_status read_strands(struct named_file *file, const struct groom_source *source,
                                 const struct groom_context *context, struct groom_strands **strands,
                                 struct groom_diag *diag)
{
    groom_status st = worker_frame_parse(file->unit, file->up, &file->frame, diag);
    struct groom_read_options options = {.frame = file->frame};
    if (st == GROOM_OK && file->format)
        st = groom_format_parse(file->format, &options.format, diag);
    return st == GROOM_OK ? groom_strands_read(source, &options, context, strands, NULL, diag) : st;
}

static groom_status read_head(struct named_file *file, const struct groom_context *context, struct groom_mesh **head,
                              struct groom_diag *diag)
{
    groom_status st = worker_frame_parse(file->unit, file->up, &file->frame, diag);
    struct groom_mesh_read_options options = {.frame = file->frame};
    return st == GROOM_OK ? groom_mesh_read(&file->input.source, &options, context, head, NULL, diag) : st;
}

/* One set of strands at a time is in memory beside the target. */
static groom_status compare_file(const struct groom_quality_target *target, struct named_file *file,
                                 const struct groom_source *source, struct groom_quality *quality,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_strands *strands = NULL;
    groom_status st = read_strands(file, source, context, &strands, diag);
    if (st == GROOM_OK)
        st = groom_quality_compare(target, strands, context, quality, diag);
    groom_strands_destroy(strands);
    return st;
}

static groom_status make_target(struct request *request, const struct groom_mesh *head, const struct groom_context *context,
                                struct groom_quality_target **target, struct groom_diag *diag)
{
    struct groom_strands *strands = NULL;
    groom_status st = read_strands(&request->target, &request->target.input.source, context, &strands, diag);
    if (st == GROOM_OK)
        st = groom_quality_target_create(strands, head, NULL, context, target, diag);
    groom_strands_destroy(strands);
    return st;
}

static groom_status compare(void *user, struct worker_input *input, const struct groom_context *context,
                            struct groom_diag *diag)
{
    struct request *request = user;
    struct groom_mesh *head = NULL;
    struct groom_quality_target *target = NULL;
    struct groom_quality fitted, drawn;
    char *json = NULL;
    groom_status st = GROOM_OK;
    if ((request->head.path && (st = read_head(&request->head, context, &head, diag)) != GROOM_OK) ||
        (st = make_target(request, head, context, &target, diag)) != GROOM_OK ||
        (st = compare_file(target, &request->groom, &input->source, &fitted, context, diag)) != GROOM_OK)
        goto out;
    if (request->drawn.path &&
        (st = compare_file(target, &request->drawn, &request->drawn.input.source, &drawn, context, diag)) != GROOM_OK)
        goto out;
    if ((st = groom_quality_print(&fitted, request->drawn.path ? &drawn : NULL, &json, diag)) == GROOM_OK)
        puts(json);
out:
    free(json);
    groom_quality_target_destroy(target);
    groom_mesh_destroy(head);
    return st;
}

int worker_compare(int argc, char **argv)
{
    struct request request = {0};
    struct groom_diag diag = {0};
    if (!parse(argc, argv, &request))
        return WORKER_USAGE;
    groom_status st = open_files(&request, &diag);
    int exit_status = st == GROOM_OK ? worker_run_sandboxed(compare, &request) : worker_print_problem(st, &diag);
    worker_input_close(&request.target.input);
    worker_input_close(&request.drawn.input);
    worker_input_close(&request.head.input);
    return exit_status;
}
