#include "server/worker/retarget_attempt.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "groom/document.h"
#include "groom/format.h"
#include "groom/groom.h"
#include "groom/retarget.h"
#include "groom/strands.h"
#include "proto/work.h"
#include "server/worker/blob.h"
#include "server/worker/receive.h"
#include "server/worker/retarget_body.h"
#include "server/worker/retarget_groom.h"
#include "server/worker/retarget_hairline.h"
#include "server/worker/retarget_part.h"
#include "server/worker/worker.h"

struct carrying {
    struct work_link *link;
    const struct order *order;
    const struct groom_context *context;
    struct groom_context reading;           /* the same, but that what is read is no progress of the stage */
    struct progress_report *progress;
    struct groom_diag *diag;

    cJSON *request;
    struct groom_retarget_options options;
    struct groom_strands *strands;          /* what is carried; or: */
    struct groom *groom;
    struct retarget_body body;
    struct groom_retarget_source *source;   /* of strands */
    int result;                             /* file of the parts */
};

static const cJSON *target_of(const struct carrying *c, uint32_t i)
{
    return cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(c->request, "targets"), (int)i);
}

/* --- where it stands -------------------------------------------------------------------------- */

/* What is worked out of the source alone, then each target in turn. */
#define PREPARE_SHARE 0.4

static groom_status begin_stage(struct carrying *c, const char *name, uint32_t index)
{
    uint32_t n = c->order->n_targets;
    double each = (1 - PREPARE_SHARE) / n, begin = index ? PREPARE_SHARE + each * (index - 1) : 0;
    progress_report_stage(c->progress, name, index, n + 1, begin, index ? begin + each : PREPARE_SHARE);
    return progress_report_send(c->progress, 1);
}

/* --- what is carried ------------------------------------------------------------------------------ */

static groom_status read_uploaded(struct carrying *c)
{
    const struct order_input *input = &c->order->strands;
    struct groom_read_options options = {.frame = input->frame};
    struct groom_memory_source memory;
    struct blob blob;
    groom_status st = blob_fetch(c->link, &input->blob, &blob, c->diag);
    if (st != GROOM_OK)
        return st;
    struct groom_source source = groom_source_from_memory(&memory, blob.bytes, blob.n_bytes);
    if (input->format[0])
        st = groom_format_parse(input->format, &options.format, c->diag);
    if (st == GROOM_OK)
        st = groom_strands_read(&source, &options, &c->reading, &c->strands, NULL, c->diag);
    blob_release(&blob);
    return st;
}

static groom_status read_groom(struct carrying *c)
{
    struct worker_input input;
    int fd;
    groom_status st = receive_file(c->link, WORK_PATH_GROOM, &fd, c->diag);
    if (st != GROOM_OK)
        return st;
    worker_input_open(fd, &input);
    st = groom_document_read((const char *)input.map, input.n_map, NULL, c->context, &c->groom, c->diag);
    worker_input_close(&input);
    close(fd);
    return st;
}

static groom_status take_subject(struct carrying *c)
{
    if (c->order->strands.blob.sha256[0])
        return read_uploaded(c);
    return cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(c->request, "dense"))
               ? receive_strands(c->link, &c->reading, &c->strands, c->diag)
               : read_groom(c);
}

/* --- what depends on the source alone ---------------------------------------------------------------- */

/* One that does not fit (made by another version) or is damaged is made anew. */
static groom_status take_up(struct carrying *c)
{
    struct groom_memory_source memory;
    struct groom_diag diag = {0};
    struct blob blob;
    groom_status st = blob_fetch(c->link, &c->order->preparation, &blob, &diag);
    if (st == GROOM_ECANCELLED)
        return st;
    if (st == GROOM_OK) {
        struct groom_source bytes = groom_source_from_memory(&memory, blob.bytes, blob.n_bytes);
        st = groom_retarget_source_load(&bytes, c->strands, c->body.mesh, &c->body.skeleton, NULL, &c->options, c->context,
                                        &c->source, &diag);
        blob_release(&blob);
    }
    if (st != GROOM_OK && st != GROOM_ENOMEM && st != GROOM_ECANCELLED)
        fprintf(stderr, "groom-worker: warning: what was prepared is not used and made anew: %s\n", diag.detail);
    return st == GROOM_ENOMEM || st == GROOM_ECANCELLED ? st : GROOM_OK;
}

static groom_status send_file(struct carrying *c, int fd, const char *method, const char *path)
{
    off_t n_bytes = lseek(fd, 0, SEEK_END);
    void *bytes = n_bytes > 0 ? mmap(NULL, (size_t)n_bytes, PROT_READ, MAP_PRIVATE, fd, 0) : MAP_FAILED;
    const struct http_request request = {.method = method, .path = path, .content_type = "application/octet-stream",
                                         .body = bytes, .n_body = (uint64_t)n_bytes};
    if (bytes == MAP_FAILED)
        return groom_fail(c->diag, GROOM_EIO, "what was made could not be kept");
    groom_status st = work_link_call(c->link, &request, NULL, c->diag);
    munmap(bytes, (size_t)n_bytes);
    return st;
}

/* A preparation that cannot be kept (the daemon's disk is full) costs the next job time, not this one its end. */
static groom_status hand_in(struct carrying *c)
{
    int fd = memfd_create("preparation", MFD_CLOEXEC);
    groom_status st = fd < 0 ? GROOM_ENOMEM : groom_retarget_source_save(c->source, worker_fd_sink(&fd), c->diag);
    if (st == GROOM_OK)
        st = send_file(c, fd, "PUT", WORK_PATH_PREPARATION);
    if (fd >= 0)
        close(fd);
    if (st == GROOM_OK || st == GROOM_ECANCELLED)
        return st;
    fprintf(stderr, "groom-worker: warning: what was prepared is not kept: %s\n", c->diag->detail);
    return GROOM_OK;
}

static groom_status prepare(struct carrying *c)
{
    groom_status st = GROOM_OK;
    if (c->order->preparation.sha256[0])
        st = take_up(c);
    if (st != GROOM_OK || c->source)
        return st;
    st = groom_retarget_source_create(c->strands, c->body.mesh, &c->body.skeleton, NULL, &c->options, c->context, &c->source,
                                      c->diag);
    return st == GROOM_OK && c->order->keeps_preparation ? hand_in(c) : st;
}

/* --- one target ------------------------------------------------------------------------------------------ */

struct target {
    struct retarget_body body;
    struct retarget_hairline hairline;
    struct groom_retarget_target library;
    struct groom_retarget_report report;
};

/* A groom's are those of its strands, and then of its guides. */
static groom_status carry_roots(struct carrying *c, struct target *t, float (*roots)[3])
{
    return c->groom ? groom_retarget_groom_roots(c->groom, c->body.mesh, &c->body.skeleton, NULL, &t->library, &c->reading,
                                                 roots, c->diag)
                    : groom_retarget_roots(c->source, &t->library, &c->reading, roots, c->diag);
}

/* From where the roots are carried to. */
static groom_status edit_hairline(struct carrying *c, uint32_t i, struct target *t)
{
    const cJSON *asked = cJSON_GetObjectItemCaseSensitive(target_of(c, i), "hairline");
    uint32_t n = c->groom ? c->groom->n_strands + c->groom->n_guides : c->strands->n_strands;
    char place[40];
    if (!asked)
        return GROOM_OK;
    float(*roots)[3] = malloc(n * sizeof *roots);
    groom_status st = roots ? carry_roots(c, t, roots) : groom_fail(c->diag, GROOM_ENOMEM, "no memory for a hairline");
    snprintf(place, sizeof place, "/targets/%u/hairline", i);
    if (st == GROOM_OK)
        st = retarget_hairline_edit(asked, place, t->body.mesh, &t->body.skeleton, (const float(*)[3])roots, n, &c->reading,
                                    &t->hairline, c->diag);
    t->library.roots = (const float(*)[3])t->hairline.roots;
    free(roots);
    return st;
}

static groom_status open_target(struct carrying *c, uint32_t i, struct target *t)
{
    groom_status st = retarget_body_target(c->link, &c->order->targets[i], target_of(c, i), i, &c->body, &c->reading, &t->body,
                                           c->diag);
    if (st != GROOM_OK)
        return st;
    t->library = (struct groom_retarget_target){.body = t->body.mesh, .skeleton = &t->body.skeleton};
    return edit_hairline(c, i, t);
}

static void close_target(struct target *t)
{
    retarget_hairline_finish(&t->hairline);
    retarget_body_finish(&t->body);
}

/* Of each strand, from those of its vertices. */
static void gather(const struct groom_strands *strands, const struct groom_strands *carried,
                   const struct groom_retarget_values *values, const struct retarget_colours *colours)
{
    for (uint32_t s = 0; s < strands->n_strands; s++) {
        uint32_t first = strands->first[s], n = strands->first[s + 1] - first;
        double movement = 0, length = groom_polyline_length(strands->points + first, n);
        float depth = 0;
        for (uint32_t v = first; v < first + n; v++) {
            movement += (double)values->movement[v];
            depth = values->depth[v] > depth ? values->depth[v] : depth;
        }
        colours->movement[s] = (float)(movement / n);
        colours->depth[s] = depth;
        colours->stretch[s] = length > 0 ? (float)(groom_polyline_length(carried->points + first, n) / length) : 1;
    }
}

static void move_value(float *values, uint32_t to, uint32_t from)
{
    if (values)
        values[to] = values[from];
}

/* Strands that balding gives up leave, with their numbers. */
static void drop_bald(const unsigned char *bald, struct groom_strands *strands, const struct retarget_colours *colours)
{
    uint32_t n = 0, n_vertices = 0;
    for (uint32_t s = 0; s < strands->n_strands; s++) {
        uint32_t first = strands->first[s], n_own = strands->first[s + 1] - first;
        if (bald[s])
            continue;
        memmove(strands->points + n_vertices, strands->points + first, n_own * sizeof *strands->points);
        strands->first[n] = n_vertices;
        n_vertices += n_own;
        move_value(colours->movement, n, s);
        move_value(colours->depth, n, s);
        move_value(colours->stretch, n, s);
        move_value(colours->density, n, s);
        n++;
    }
    strands->first[n] = n_vertices;
    strands->n_strands = n;
    strands->n_vertices = n_vertices;
}

static groom_status run_strands(struct carrying *c, struct target *t, struct groom_strands *carried,
                                struct retarget_colours *colours)
{
    size_t n = c->strands->n_vertices;
    float *values = malloc(2 * n * sizeof *values);
    const struct groom_retarget_values wanted = {.movement = values, .depth = values ? values + n : NULL};
    if (!values)
        return groom_fail(c->diag, GROOM_ENOMEM, "no memory for the colours of the strands");
    memcpy(carried->first, c->strands->first, ((size_t)c->strands->n_strands + 1) * sizeof *carried->first);
    groom_status st = groom_retarget_run(c->source, &t->library, &c->options, c->context, carried->points, &wanted, &t->report,
                                         c->diag);
    if (st == GROOM_OK)
        gather(c->strands, carried, &wanted, colours);
    free(values);
    return st;
}

static groom_status write_part(struct carrying *c, struct target *t, const struct groom_strands *strands,
                               const struct groom *groom, const struct retarget_colours *colours)
{
    const struct retarget_part part = {.strands = strands, .groom = groom,
                                       .n_strands = groom ? groom->n_strands : strands->n_strands, .report = &t->report,
                                       .source_skeleton = &c->body.skeleton, .skeleton = &t->body.skeleton,
                                       .hairline = t->hairline.report,
                                       .colours = colours ? *colours : (struct retarget_colours){0}};
    return retarget_part_write(&part, c->result, c->context, c->diag);
}

static groom_status carry_strands(struct carrying *c, struct target *t)
{
    struct groom_strands *carried = NULL;
    uint32_t n = c->strands->n_strands;
    float *values = malloc(3 * (size_t)n * sizeof *values);
    if (!values)
        return groom_fail(c->diag, GROOM_ENOMEM, "no memory for the colours of the strands");
    struct retarget_colours colours = {values, values + n, values + 2 * (size_t)n, t->hairline.density};
    groom_status st = groom_strands_create(n, c->strands->n_vertices, c->context, &carried, c->diag);
    if (st == GROOM_OK)
        st = run_strands(c, t, carried, &colours);
    if (st == GROOM_OK && t->hairline.n_bald == n)
        st = groom_fail_field(c->diag, GROOM_EEMPTY, "/hairline", "the curve leaves no hair");
    if (st == GROOM_OK) {
        struct groom_strands kept = *carried; /* a view, which may be shorter */
        if (t->hairline.n_bald)
            drop_bald(t->hairline.bald, &kept, &colours);
        st = write_part(c, t, &kept, NULL, &colours);
    }
    groom_strands_destroy(carried);
    free(values);
    return st;
}

/* The strands that balding leaves, with their numbers. */
static groom_status keep_groom(struct carrying *c, struct target *t, struct groom **carried, const struct retarget_colours *colours)
{
    struct groom *kept = NULL;
    if (!t->hairline.n_bald)
        return GROOM_OK;
    groom_status st = retarget_groom_without(*carried, t->hairline.bald, c->context, &kept, c->diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t s = 0, n = 0; s < (*carried)->n_strands; s++)
        if (!t->hairline.bald[s]) {
            move_value(colours->stretch, n, s);
            move_value(colours->density, n++, s);
        }
    groom_destroy(*carried);
    *carried = kept;
    return GROOM_OK;
}

static groom_status carry_groom(struct carrying *c, struct target *t)
{
    struct groom *carried = NULL;
    struct retarget_colours colours = {.stretch = malloc(c->groom->n_strands * sizeof(float)), .density = t->hairline.density};
    groom_status st = colours.stretch ? groom_retarget_groom(c->groom, c->body.mesh, &c->body.skeleton, NULL, &t->library,
                                                             &c->options, c->context, &carried, &t->report, c->diag)
                                      : groom_fail(c->diag, GROOM_ENOMEM, "no memory for the colours of the strands");
    if (st == GROOM_OK)
        st = retarget_groom_stretch(c->groom, carried, &c->reading, colours.stretch, c->diag);
    if (st == GROOM_OK)
        st = keep_groom(c, t, &carried, &colours);
    if (st == GROOM_OK)
        st = write_part(c, t, NULL, carried, &colours);
    groom_destroy(carried);
    free(colours.stretch);
    return st;
}

static groom_status carry(struct carrying *c, uint32_t i)
{
    struct target *t = calloc(1, sizeof *t); /* its report is large */
    if (!t)
        return groom_fail(c->diag, GROOM_ENOMEM, "no memory for a target");
    groom_status st = begin_stage(c, "carry", i + 1);
    if (st == GROOM_OK)
        st = open_target(c, i, t);
    if (st == GROOM_OK)
        st = c->groom ? carry_groom(c, t) : carry_strands(c, t);
    close_target(t);
    free(t);
    return st;
}

/* --- all of it ---------------------------------------------------------------------------------------------- */

static groom_status open_carrying(struct carrying *c)
{
    c->request = cJSON_Parse(c->order->request);
    c->result = memfd_create("result", MFD_CLOEXEC);
    if (!c->request || c->result < 0)
        return groom_fail(c->diag, GROOM_ENOMEM, "no memory for a retargeting");
    return groom_retarget_options_parse(c->order->options, strlen(c->order->options), &c->options, c->diag);
}

static void close_carrying(struct carrying *c)
{
    groom_retarget_source_destroy(c->source);
    retarget_body_finish(&c->body);
    groom_destroy(c->groom);
    groom_strands_destroy(c->strands);
    cJSON_Delete(c->request);
    if (c->result >= 0)
        close(c->result);
}

groom_status retarget_attempt(struct work_link *link, const struct order *order, const struct groom_context *context,
                              struct progress_report *report, struct groom_diag *diag)
{
    struct carrying c = {.link = link, .order = order, .context = context, .progress = report, .diag = diag, .result = -1,
                         .reading = {.allocator = context->allocator, .pool = context->pool}};
    groom_status st = open_carrying(&c);
    if (st == GROOM_OK)
        st = begin_stage(&c, "prepare", 0);
    if (st == GROOM_OK)
        st = take_subject(&c);
    if (st == GROOM_OK)
        st = retarget_body_source(link, &order->source, cJSON_GetObjectItemCaseSensitive(c.request, "source"), &c.reading,
                                  &c.body, diag);
    if (st == GROOM_OK && c.strands)
        st = prepare(&c);
    for (uint32_t i = 0; st == GROOM_OK && i < order->n_targets; i++)
        st = carry(&c, i);
    if (st == GROOM_OK)
        st = send_file(&c, c.result, "POST", WORK_PATH_RESULT);
    close_carrying(&c);
    return st;
}
