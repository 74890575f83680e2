/* convert: strands of one format, unit and axis to another, fewer or resampled where asked. */
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/format.h"
#include "groom/strands.h"
#include "server/worker/worker.h"

struct request {
    const char *from_format, *from_unit, *from_up, *to_format, *unit, *up, *vertices, *count;
    struct groom_read_options read;
    struct groom_write_options write;
    unsigned long long n_vertices, n_count;
};

static int parse(int argc, char **argv, struct request *request)
{
    static const struct option options[] = {
        {"from-format", 1, NULL, 'f'}, {"from-unit", 1, NULL, 'u'}, {"from-up", 1, NULL, 'a'},
        {"to-format", 1, NULL, 'F'},   {"unit", 1, NULL, 'U'},      {"up", 1, NULL, 'A'},
        {"vertices", 1, NULL, 'm'},    {"count", 1, NULL, 'n'},     {NULL, 0, NULL, 0}};
    int c;
    while ((c = getopt_long(argc, argv, "", options, NULL)) != -1) {
        switch (c) {
        case 'f':
            request->from_format = worker_format_name(optarg);
            break;
        case 'u':
            request->from_unit = optarg;
            break;
        case 'a':
            request->from_up = optarg;
            break;
        case 'F':
            request->to_format = optarg;
            break;
        case 'U':
            request->unit = optarg;
            break;
        case 'A':
            request->up = optarg;
            break;
        case 'm':
            request->vertices = optarg;
            break;
        case 'n':
            request->count = optarg;
            break;
        default:
            return 0;
        }
    }
    if (optind == argc && request->to_format)
        return 1;
    fputs("groom-worker convert: --to-format is needed, and no other argument\n", stderr);
    return 0;
}

static groom_status interpret(struct request *request, struct groom_diag *diag)
{
    groom_status st = GROOM_OK;
    if (request->from_format)
        st = groom_format_parse(request->from_format, &request->read.format, diag);
    if (st == GROOM_OK)
        st = groom_format_parse(request->to_format, &request->write.format, diag);
    if (st == GROOM_OK && !groom_format_writable(request->write.format))
        st = groom_fail(diag, GROOM_EINVAL,
                        "format \"%s\" can be read but not written; take hair, usda, ply, obj, data or json",
                        groom_format_name(request->write.format));
    if (st == GROOM_OK)
        st = worker_frame_parse(request->from_unit, request->from_up, &request->read.frame, diag);
    if (st == GROOM_OK)
        st = worker_frame_parse(request->unit, request->up, &request->write.frame, diag);
    if (st == GROOM_OK)
        st = worker_count_parse("--vertices", request->vertices, 65536, &request->n_vertices, diag);
    if (st == GROOM_OK)
        st = worker_count_parse("--count", request->count, UINT32_MAX, &request->n_count, diag);
    if (st == GROOM_OK && request->vertices && request->n_vertices < 2)
        st = groom_fail(diag, GROOM_EINVAL, "--vertices is %llu; a strand has at least 2",
                        request->n_vertices);
    if (st == GROOM_OK && request->count && !request->n_count)
        st = groom_fail(diag, GROOM_EINVAL, "--count is 0; at least one strand must be left");
    return st;
}

/* Strand i of `count` is strand i * n / count: spread over the file, the same for every call. */
static uint32_t chosen(uint32_t i, uint32_t n, uint32_t count) { return (uint32_t)((uint64_t)i * n / count); }

static groom_status thin(struct groom_strands **strands, uint32_t count, const struct groom_context *context,
                         struct groom_diag *diag)
{
    const struct groom_strands *all = *strands;
    struct groom_strands *few = NULL;
    uint64_t n_vertices = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t s = chosen(i, all->n_strands, count);
        n_vertices += all->first[s + 1] - all->first[s];
    }
    groom_status st = groom_strands_create(count, n_vertices, context, &few, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t s = chosen(i, all->n_strands, count), n = all->first[s + 1] - all->first[s];
        few->first[i + 1] = few->first[i] + n;
        memcpy(few->points + few->first[i], all->points + all->first[s], n * sizeof *all->points);
    }
    groom_strands_destroy(*strands);
    *strands = few;
    return GROOM_OK;
}

static groom_status resample(struct groom_strands **strands, uint32_t n_vertices,
                             const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_strands *even = NULL;
    uint32_t n = (*strands)->n_strands;
    groom_status st = groom_strands_create(n, (uint64_t)n * n_vertices, context, &even, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t i = 0; i < n; i++)
        even->first[i + 1] = (i + 1) * n_vertices;
    st = groom_strands_resample(*strands, n_vertices, even->points, context, diag);
    if (st == GROOM_OK) {
        struct groom_strands *uneven = *strands;
        *strands = even;
        even = uneven;
    }
    groom_strands_destroy(even);
    return st;
}

static groom_status convert(void *user, struct worker_input *input, const struct groom_context *context,
                            struct groom_diag *diag)
{
    static const int output = STDOUT_FILENO;
    struct request *request = user;
    struct groom_strands *strands = NULL;
    groom_status st = interpret(request, diag);
    if (st == GROOM_OK)
        st = groom_strands_read(&input->source, &request->read, context, &strands, NULL, diag);
    if (st == GROOM_OK && request->n_count && request->n_count < strands->n_strands)
        st = thin(&strands, (uint32_t)request->n_count, context, diag);
    if (st == GROOM_OK && request->n_vertices)
        st = resample(&strands, (uint32_t)request->n_vertices, context, diag);
    if (st == GROOM_OK)
        st = groom_strands_write(strands, &request->write, worker_fd_sink(&output), context, diag);
    groom_strands_destroy(strands);
    return st;
}

int worker_convert(int argc, char **argv)
{
    struct request request = {0};
    return parse(argc, argv, &request) ? worker_run_sandboxed(convert, &request) : WORKER_USAGE;
}
