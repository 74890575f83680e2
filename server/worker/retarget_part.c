#include "server/worker/retarget_part.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/document.h"
#include "groom/format.h"
#include "server/worker/worker.h"

/* --- the line ------------------------------------------------------------------------------- */

/* Takes the text over; its line breaks are white space, for strings of JSON hold none. */
static void add_text(cJSON *line, const char *name, char *text)
{
    if (!text)
        return;
    for (char *at = strchr(text, '\n'); at; at = strchr(at, '\n'))
        *at = ' ';
    cJSON_AddRawToObject(line, name, text);
    free(text);
}

static groom_status add_skeleton(cJSON *line, const char *name, const struct groom_skeleton *skeleton,
                                 struct groom_diag *diag)
{
    char *text = NULL;
    groom_status st = groom_skeleton_print(skeleton, &text, diag);
    add_text(line, name, text);
    return st;
}

static groom_status add_colours(cJSON *line, const struct retarget_part *part)
{
    const struct {
        const char *name;
        const float *values;
    } rows[] = {{"movement", part->colours.movement}, {"depth", part->colours.depth}, {"stretch", part->colours.stretch},
                {"density", part->colours.density}};
    cJSON *strands = cJSON_AddObjectToObject(line, "strands");
    groom_status st = GROOM_OK;
    for (size_t i = 0; st == GROOM_OK && i < sizeof rows / sizeof rows[0]; i++) {
        char *text = NULL;
        size_t n;
        if (!rows[i].values)
            continue;
        st = groom_document_array_write(rows[i].values, 1, &part->n_strands, 1, &text, &n);
        add_text(strands, rows[i].name, text);
    }
    return st;
}

static groom_status describe(const struct retarget_part *part, cJSON *line, struct groom_diag *diag)
{
    char *report = NULL;
    groom_status st = groom_retarget_report_print(part->report, &report, diag);
    cJSON_AddStringToObject(line, "kind", part->strands ? "strands" : "groom");
    add_text(line, "report", report);
    if (st == GROOM_OK)
        st = add_skeleton(line, "source_skeleton", part->source_skeleton, diag);
    if (st == GROOM_OK)
        st = add_skeleton(line, "skeleton", part->skeleton, diag);
    if (part->hairline)
        cJSON_AddItemToObject(line, "hairline", cJSON_Duplicate(part->hairline, 1));
    return st == GROOM_OK ? add_colours(line, part) : st;
}

/* --- the file ---------------------------------------------------------------------------------- */

static groom_status write_body(const struct retarget_part *part, int fd, const struct groom_context *context,
                               struct groom_diag *diag)
{
    const struct groom_write_options options = {.format = GROOM_FORMAT_HAIR};
    struct groom_sink sink = worker_fd_sink(&fd);
    char *json = NULL;
    size_t n_bytes;
    if (part->strands)
        return groom_strands_write(part->strands, &options, sink, context, diag);
    groom_status st = groom_document_write(part->groom, NULL, NULL, &json, &n_bytes, diag);
    if (st == GROOM_OK)
        st = sink.write(sink.user, json, n_bytes);
    free(json);
    return st;
}

/* "bytes" comes first and is known last: room is left for its digits, and white space is JSON. */
#define BYTES_LINE "{\"bytes\":%20llu,"

static groom_status write_line(const char *json, int fd, off_t *at, off_t *body, struct groom_diag *diag)
{
    struct groom_sink sink = worker_fd_sink(&fd);
    char room[64];
    int n = snprintf(room, sizeof room, BYTES_LINE, 0ull);
    *at = lseek(fd, 0, SEEK_CUR);
    groom_status st = sink.write(sink.user, room, (size_t)n);
    if (st == GROOM_OK)
        st = sink.write(sink.user, json + 1, strlen(json) - 1); /* its brace is there */
    if (st == GROOM_OK)
        st = sink.write(sink.user, "\n", 1);
    *body = lseek(fd, 0, SEEK_CUR);
    return st == GROOM_OK && (*at < 0 || *body < 0) ? groom_fail(diag, GROOM_EIO, "the result could not be kept") : st;
}

static groom_status fill_in_bytes(int fd, off_t at, off_t body, struct groom_diag *diag)
{
    char room[64];
    off_t end = lseek(fd, 0, SEEK_CUR);
    int n = snprintf(room, sizeof room, BYTES_LINE, (unsigned long long)(end - body));
    if (end < body || pwrite(fd, room, (size_t)n, at) != n)
        return groom_fail(diag, GROOM_EIO, "the result could not be kept");
    return GROOM_OK;
}

groom_status retarget_part_write(const struct retarget_part *part, int fd, const struct groom_context *context,
                                 struct groom_diag *diag)
{
    cJSON *line = cJSON_CreateObject();
    off_t at = 0, body = 0;
    groom_status st = line ? describe(part, line, diag) : GROOM_ENOMEM;
    char *json = st == GROOM_OK ? cJSON_PrintUnformatted(line) : NULL;
    cJSON_Delete(line);
    if (st == GROOM_OK && !json)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the result");
    if (st == GROOM_OK)
        st = write_line(json, fd, &at, &body, diag);
    if (st == GROOM_OK)
        st = write_body(part, fd, context, diag);
    if (st == GROOM_OK)
        st = fill_in_bytes(fd, at, body, diag);
    cJSON_free(json);
    return st;
}
