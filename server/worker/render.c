/* render: a shaded picture of strands, on a head where one is named. */
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "groom/format.h"
#include "groom/mesh.h"
#include "groom/render.h"
#include "server/worker/worker.h"

struct request {
    const char *unit, *up, *head, *head_unit, *head_up, *view, *size;
    const char *format, *as, *as_format, *as_unit, *as_up; /* other strands, whose camera is taken */
    struct groom_frame frame, head_frame, as_frame;
    struct groom_render_options options;
    struct worker_input head_input, as_input;
};

static int parse(int argc, char **argv, struct request *request)
{
    static const struct option options[] = {
        {"unit", 1, NULL, 'u'},    {"up", 1, NULL, 'a'},      {"head", 1, NULL, 'h'}, {"head-unit", 1, NULL, 'U'},
        {"head-up", 1, NULL, 'A'}, {"view", 1, NULL, 'v'},    {"size", 1, NULL, 's'},
        {"framed-as", 1, NULL, 'f'}, {"framed-unit", 1, NULL, 'F'}, {"framed-up", 1, NULL, 'g'},
        {"format", 1, NULL, 'm'}, {"framed-format", 1, NULL, 'M'}, {NULL, 0, NULL, 0}};
    int c;
    while ((c = getopt_long(argc, argv, "", options, NULL)) != -1) {
        switch (c) {
        case 'u': request->unit = optarg; break;
        case 'a': request->up = optarg; break;
        case 'h': request->head = optarg; break;
        case 'U': request->head_unit = optarg; break;
        case 'A': request->head_up = optarg; break;
        case 'v': request->view = optarg; break;
        case 's': request->size = optarg; break;
        case 'm': request->format = optarg; break;
        case 'M': request->as_format = optarg; break;
        case 'f': request->as = optarg; break;
        case 'F': request->as_unit = optarg; break;
        case 'g': request->as_up = optarg; break;
        default: return 0;
        }
    }
    if (optind == argc) return 1;
    fprintf(stderr, "groom-worker render: \"%s\" is one argument too many\n", argv[optind]);
    return 0;
}

static groom_status interpret(struct request *request, struct groom_diag *diag)
{
    unsigned long long size = 0;
    groom_status st = worker_frame_parse(request->unit, request->up, &request->frame, diag);
    if (st == GROOM_OK) st = worker_frame_parse(request->head_unit, request->head_up, &request->head_frame, diag);
    if (st == GROOM_OK) st = worker_frame_parse(request->as_unit, request->as_up, &request->as_frame, diag);
    if (st == GROOM_OK) st = groom_view_parse(request->view ? request->view : "front", &request->options.view, diag);
    if (st == GROOM_OK) st = worker_count_parse("--size", request->size, GROOM_RENDER_MAX_SIZE, &size, diag);
    request->options.size = size ? (uint32_t)size : 512;
    return st;
}

static groom_status draw(const struct groom_strands *strands, const struct groom_mesh *mesh,
                         const struct groom_render_options *options, const struct groom_context *context,
                         struct groom_diag *diag)
{
    static const int output = STDOUT_FILENO;
    uint8_t *rgba = malloc((size_t)options->size * options->size * 4);
    if (!rgba) return groom_fail(diag, GROOM_ENOMEM, "no memory for a picture of %u pixels a side", options->size);
    groom_status st = groom_render_strands(strands, mesh, options, rgba, context, diag);
    if (st == GROOM_OK)
        st = groom_png_write(rgba, options->size, options->size, worker_fd_sink(&output), context, diag);
    free(rgba);
    return st;
}

static groom_status render(void *user, struct worker_input *input, const struct groom_context *context,
                           struct groom_diag *diag)
{
    struct request *request = user;
    struct groom_strands *strands = NULL, *as = NULL;
    struct groom_mesh *mesh = NULL;
    groom_status st = interpret(request, diag);
    struct groom_read_options read = {.frame = request->frame}, read_as = {.frame = request->as_frame};
    struct groom_mesh_read_options read_head = {.frame = request->head_frame};
    if (st == GROOM_OK && request->format) st = groom_format_parse(request->format, &read.format, diag);
    if (st == GROOM_OK && request->as_format) st = groom_format_parse(request->as_format, &read_as.format, diag);
    if (st == GROOM_OK) st = groom_strands_read(&input->source, &read, context, &strands, NULL, diag);
    if (st == GROOM_OK && request->head)
        st = groom_mesh_read(&request->head_input.source, &read_head, context, &mesh, NULL, diag);
    if (st == GROOM_OK && request->as)
        st = groom_strands_read(&request->as_input.source, &read_as, context, &as, NULL, diag);
    request->options.framed_as = as;
    if (st == GROOM_OK) st = draw(strands, mesh, &request->options, context, diag);
    groom_strands_destroy(as);
    groom_strands_destroy(strands);
    groom_mesh_destroy(mesh);
    return st;
}

int worker_render(int argc, char **argv)
{
    struct request request = {0};
    struct groom_diag diag = {0};
    if (!parse(argc, argv, &request)) return WORKER_USAGE;
    groom_status st = worker_input_open_path(request.head, "the head", &request.head_input, &diag);
    if (st == GROOM_OK) st = worker_input_open_path(request.as, "the file of --framed-as", &request.as_input, &diag);
    int exit_status = st == GROOM_OK ? worker_run_sandboxed(render, &request) : worker_print_problem(st, &diag);
    worker_input_close(&request.head_input);
    worker_input_close(&request.as_input);
    return exit_status;
}
