/* convert-head: an uploaded head, read and written again as OBJ in metres, y up. */
#include <getopt.h>
#include <stdio.h>
#include <unistd.h>

#include "groom/mesh.h"
#include "server/worker/worker.h"

struct request {
    const char *format, *unit, *up;
};

static int parse(int argc, char **argv, struct request *request)
{
    static const struct option options[] = {
        {"format", 1, NULL, 'f'}, {"unit", 1, NULL, 'u'}, {"up", 1, NULL, 'a'}, {NULL, 0, NULL, 0}};
    int c;
    while ((c = getopt_long(argc, argv, "", options, NULL)) != -1) {
        switch (c) {
        case 'f':
            request->format = worker_format_name(optarg);
            break;
        case 'u':
            request->unit = optarg;
            break;
        case 'a':
            request->up = optarg;
            break;
        default:
            return 0;
        }
    }
    if (optind == argc)
        return 1;
    fputs("groom-worker convert-head: takes no argument but its options\n", stderr);
    return 0;
}

static groom_status convert(void *user, struct worker_input *input, const struct groom_context *context,
                            struct groom_diag *diag)
{
    static const int output = STDOUT_FILENO;
    const struct request *request = user;
    struct groom_mesh_read_options options = {0};
    struct groom_mesh *mesh = NULL;
    groom_status st = worker_frame_parse(request->unit, request->up, &options.frame, diag);
    if (st == GROOM_OK && request->format)
        st = groom_mesh_format_parse(request->format, &options.format, diag);
    if (st == GROOM_OK)
        st = groom_mesh_read(&input->source, &options, context, &mesh, NULL, diag);
    if (st == GROOM_OK)
        st = groom_mesh_write_obj(mesh, (struct groom_frame){.unit_m = 1}, worker_fd_sink(&output), diag);
    groom_mesh_destroy(mesh);
    return st;
}

int worker_convert_head(int argc, char **argv)
{
    struct request request = {0};
    return parse(argc, argv, &request) ? worker_run_sandboxed(convert, &request) : WORKER_USAGE;
}
