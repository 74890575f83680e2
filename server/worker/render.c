/* render: a shaded picture of strands, on a head where one is named; with --frames, a turn around them. */
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/format.h"
#include "groom/mesh.h"
#include "groom/render.h"
#include "server/worker/worker.h"

struct request {
    const char *unit, *up, *head, *head_unit, *head_up, *view, *size;
    const char *format, *as, *as_format, *as_unit, *as_up; /* other strands, whose camera is taken */
    const char *height, *azimuth, *elevation, *distance, *eye, *target, *fov, *light; /* a camera of one's own */
    const char *frames, *only, *frame_ms; /* a turntable; of it, one still */
    unsigned long long n_frames, the_frame, ms;
    struct groom_render_camera camera;
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
        {"format", 1, NULL, 'm'}, {"framed-format", 1, NULL, 'M'},
        {"height", 1, NULL, 'H'}, {"azimuth", 1, NULL, 'z'}, {"elevation", 1, NULL, 'e'}, {"distance", 1, NULL, 'd'},
        {"eye", 1, NULL, 'E'}, {"target", 1, NULL, 't'}, {"fov", 1, NULL, 'o'}, {"light", 1, NULL, 'l'},
        {"frames", 1, NULL, 'n'}, {"frame", 1, NULL, 'k'}, {"frame-ms", 1, NULL, 'i'}, {NULL, 0, NULL, 0}};
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
        case 'H': request->height = optarg; break;
        case 'z': request->azimuth = optarg; break;
        case 'e': request->elevation = optarg; break;
        case 'd': request->distance = optarg; break;
        case 'E': request->eye = optarg; break;
        case 't': request->target = optarg; break;
        case 'o': request->fov = optarg; break;
        case 'l': request->light = optarg; break;
        case 'n': request->frames = optarg; break;
        case 'k': request->only = optarg; break;
        case 'i': request->frame_ms = optarg; break;
        default: return 0;
        }
    }
    if (optind == argc) return 1;
    fprintf(stderr, "groom-worker render: \"%s\" is one argument too many\n", argv[optind]);
    return 0;
}

static groom_status real_parse(const char *option, const char *text, double *value, struct groom_diag *diag)
{
    int end = 0;
    if (!text || (sscanf(text, "%lf%n", value, &end) == 1 && !text[end] && isfinite(*value)))
        return GROOM_OK;
    return groom_fail(diag, GROOM_EINVAL, "%s is \"%.40s\"; it must be a number", option, text);
}

static groom_status place_parse(const char *option, const char *text, double place[3], struct groom_diag *diag)
{
    int end = 0;
    if (!text || (sscanf(text, "%lf,%lf,%lf%n", &place[0], &place[1], &place[2], &end) == 3 && !text[end]))
        return GROOM_OK;
    return groom_fail(diag, GROOM_EINVAL, "%s is \"%.80s\"; it must be X,Y,Z", option, text);
}

static groom_status interpret_camera(struct request *request, struct groom_diag *diag)
{
    struct groom_render_camera *camera = &request->camera;
    groom_status st = real_parse("--azimuth", request->azimuth, &camera->azimuth, diag);
    if (st == GROOM_OK) st = real_parse("--elevation", request->elevation, &camera->elevation, diag);
    if (st == GROOM_OK) st = real_parse("--distance", request->distance, &camera->distance, diag);
    if (st == GROOM_OK) st = real_parse("--fov", request->fov, &camera->fov_y, diag);
    if (st == GROOM_OK) st = place_parse("--eye", request->eye, camera->eye, diag);
    if (st == GROOM_OK) st = place_parse("--target", request->target, camera->target, diag);
    camera->is_placed = request->eye != NULL;
    camera->has_target = request->target != NULL;
    camera->light_stands = request->light && !strcmp(request->light, "front");
    camera->all_around = request->frames != NULL;
    if (!request->view)
        request->options.camera = camera;
    return st;
}

static groom_status interpret_frames(struct request *request, struct groom_diag *diag)
{
    groom_status st = worker_count_parse("--frames", request->frames, 65535, &request->n_frames, diag);
    if (st == GROOM_OK) st = worker_count_parse("--frame", request->only, 65535, &request->the_frame, diag);
    if (st == GROOM_OK) st = worker_count_parse("--frame-ms", request->frame_ms, 65535, &request->ms, diag);
    return st;
}

static groom_status interpret(struct request *request, struct groom_diag *diag)
{
    unsigned long long size = 0, height = 0;
    groom_status st = worker_frame_parse(request->unit, request->up, &request->frame, diag);
    if (st == GROOM_OK) st = worker_frame_parse(request->head_unit, request->head_up, &request->head_frame, diag);
    if (st == GROOM_OK) st = worker_frame_parse(request->as_unit, request->as_up, &request->as_frame, diag);
    if (st == GROOM_OK) st = groom_view_parse(request->view ? request->view : "front", &request->options.view, diag);
    if (st == GROOM_OK) st = worker_count_parse("--size", request->size, GROOM_RENDER_MAX_SIZE, &size, diag);
    if (st == GROOM_OK) st = worker_count_parse("--height", request->height, GROOM_RENDER_MAX_SIZE, &height, diag);
    request->options.size = size ? (uint32_t)size : 512;
    request->options.height = height ? (uint32_t)height : request->options.size;
    if (st == GROOM_OK) st = interpret_camera(request, diag);
    if (st == GROOM_OK) st = interpret_frames(request, diag);
    return st;
}

struct drawing {
    const struct groom_strands *strands;
    const struct groom_mesh *mesh;
    const struct groom_context *context;
    uint8_t *rgba;
};

static const int output = STDOUT_FILENO;

static groom_status draw_still(const struct drawing *d, const struct groom_render_options *options, struct groom_diag *diag)
{
    groom_status st = groom_render_strands(d->strands, d->mesh, options, d->rgba, d->context, diag);
    return st == GROOM_OK ? groom_png_write(d->rgba, options->size, options->height, worker_fd_sink(&output), d->context, diag) : st;
}

/* The camera goes once around, against the clock seen from above; frame 0 is where the camera's azimuth is. */
static double azimuth_of(const struct request *request, unsigned long long frame)
{
    return request->camera.azimuth + 2 * M_PI * (double)frame / (double)request->n_frames;
}

static groom_status draw_turn(const struct drawing *d, const struct request *request, struct groom_diag *diag)
{
    struct groom_render_camera camera = request->camera;
    struct groom_render_options options = request->options;
    struct groom_animation_options timing = {options.size, options.height, (uint32_t)request->n_frames, request->ms ? (uint32_t)request->ms : 100};
    struct groom_animation *animation = NULL;
    options.camera = &camera;
    groom_status st = groom_animation_create(&timing, worker_fd_sink(&output), d->context, &animation, diag);
    for (uint32_t i = 0; i < timing.n_frames && st == GROOM_OK; i++) {
        camera.azimuth = azimuth_of(request, i);
        st = groom_render_strands(d->strands, d->mesh, &options, d->rgba, d->context, diag);
        if (st == GROOM_OK) st = groom_animation_add(animation, d->rgba, diag);
    }
    if (st == GROOM_OK) st = groom_animation_finish(animation, diag);
    groom_animation_destroy(animation);
    return st;
}

static groom_status draw(const struct groom_strands *strands, const struct groom_mesh *mesh, struct request *request,
                         const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_render_options *options = &request->options;
    struct drawing drawing = {strands, mesh, context, malloc((size_t)options->size * options->height * 4)};
    if (!drawing.rgba)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a picture of %u x %u pixels", options->size, options->height);
    if (request->n_frames && request->only)
        request->camera.azimuth = azimuth_of(request, request->the_frame);
    groom_status st = request->n_frames && !request->only ? draw_turn(&drawing, request, diag) : draw_still(&drawing, options, diag);
    free(drawing.rgba);
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
    if (st == GROOM_OK) st = draw(strands, mesh, request, context, diag);
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
