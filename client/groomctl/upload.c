#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "client/groomctl/resumable.h"
#include "client/groomctl/transfer.h"
#include "proto/url.h"

struct upload_options upload_options_of(const struct arguments *arguments)
{
    return (struct upload_options){.format = argument(arguments, "format"),
                                   .unit = argument(arguments, "unit"),
                                   .up = argument(arguments, "up"),
                                   .name = argument(arguments, "name"),
                                   .resumable_from = argument(arguments, "resumable-from")};
}

/* --- sending ------------------------------------------------------------------------------ */

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

/* Below this a broken upload is sent again sooner than it is asked after. */
static uint64_t resumable_from(const char *text)
{
    char *end;
    unsigned long long value = text ? strtoull(text, &end, 10) : 0;
    return text && *text && !*end ? value : (uint64_t)16 << 20;
}

static int open_input(const char *path, uint64_t *n_bytes)
{
    struct stat status;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0 || fstat(fd, &status)) {
        fprintf(stderr, "groomctl: %s cannot be read: %s\n", path, strerror(errno));
        if (fd >= 0)
            close(fd);
        return -1;
    }
    if (!S_ISREG(status.st_mode) || !status.st_size) {
        fprintf(stderr, "groomctl: %s %s\n", path, S_ISREG(status.st_mode) ? "is empty" : "is not a file");
        close(fd);
        return -1;
    }
    *n_bytes = (uint64_t)status.st_size;
    return fd;
}

static int send_file(struct groomctl *ctl, const char *url_path, int fd, uint64_t n_bytes, const char *name,
                     cJSON **answer)
{
    struct sending sending;
    sending_init(&sending, name, 0, n_bytes);
    struct http_request request = {.method = "POST",
                                   .path = url_path,
                                   .content_type = "application/octet-stream",
                                   .body_fd = fd,
                                   .n_body = n_bytes,
                                   .sent = ctl->is_terminal && !ctl->json ? sending_draw : NULL,
                                   .user = &sending,
                                   .idle_timeout_s = 300};
    struct http_response response;
    int status = api_call(ctl, &request, &response);
    sending_clear(&sending);
    *answer = status == DONE ? cJSON_ParseWithLength(response.body, response.n_body) : NULL;
    if (status == DONE && !*answer) {
        fputs("groomctl: the server's answer is not JSON; is this a groomd?\n", stderr);
        status = REFUSED;
    }
    if (status == INTERRUPTED)
        fprintf(stderr, "groomctl: interrupted; nothing of %s was kept\n", name);
    http_response_finish(&response);
    return status;
}

int upload_file(struct groomctl *ctl, enum sized_thing thing, const char *path,
                const struct upload_options *options, cJSON **answer)
{
    struct url url;
    uint64_t n_bytes = 0;
    int fd = open_input(path, &n_bytes), status;
    if (fd < 0)
        return REFUSED;
    url_init(&url, thing == SIZED_HEAD ? "/v1/heads" : "/v1/strands");
    url_query(&url, "format", options->format);
    url_query(&url, "unit", options->unit);
    url_query(&url, "up", options->up);
    url_query(&url, "name", options->name ? options->name : base_name(path));
    bool in_pieces = !url.overflow && n_bytes >= resumable_from(options->resumable_from) &&
                     upload_resumable(ctl, &url, fd, n_bytes, path, &status, answer);
    if (url.overflow)
        status = groomctl_usage_error("upload", "the name is too long");
    else if (!in_pieces)
        status = send_file(ctl, url.text, fd, n_bytes, base_name(path), answer);
    close(fd);
    return status;
}

/* --- saying what came of it ---------------------------------------------------------------- */

int upload_box(const cJSON *answer, struct sized_box *out)
{
    const cJSON *box = cJSON_GetObjectItemCaseSensitive(answer, "bbox");
    const cJSON *low = cJSON_GetObjectItemCaseSensitive(box, "min"),
                *high = cJSON_GetObjectItemCaseSensitive(box, "max");
    for (int i = 0; i < 3; i++) {
        const cJSON *a = cJSON_GetArrayItem(low, i), *b = cJSON_GetArrayItem(high, i);
        if (!cJSON_IsNumber(a) || !cJSON_IsNumber(b))
            return 0;
        out->low[i] = a->valuedouble;
        out->high[i] = b->valuedouble;
    }
    return 1;
}

static int extents(const cJSON *answer, double size[3])
{
    struct sized_box box;
    int known = upload_box(answer, &box);
    for (int i = 0; known && i < 3; i++)
        size[i] = box.high[i] - box.low[i];
    return known;
}

static void print_hint(enum sized_thing thing, const struct upload_options *options, const double size[3])
{
    char text[256];
    double largest = size[0] > size[1] ? size[0] : size[1];
    if (size[2] > largest)
        largest = size[2];
    unit_hint_text(thing, largest, unit_in_metres(options->unit), text, sizeof text);
    if (text[0])
        fprintf(stderr, "hint: %s\n", text);
}

static void print_warnings(const cJSON *answer)
{
    const cJSON *warning;
    cJSON_ArrayForEach(warning, cJSON_GetObjectItemCaseSensitive(answer, "warnings"))
    {
        if (cJSON_IsString(warning))
            fprintf(stderr, "warning: %s\n", warning->valuestring);
    }
}

void upload_describe(const struct groomctl *ctl, enum sized_thing thing, const struct upload_options *options,
                     const cJSON *answer)
{
    double size[3] = {0, 0, 0};
    int known = extents(answer, size);
    if (ctl->json) {
        api_print(ctl, answer);
    } else {
        printf("%s  %.0f %s, %.0f vertices, %s", api_text(answer, "id"),
               api_number(answer, thing == SIZED_HEAD ? "triangles" : "strands", 0),
               thing == SIZED_HEAD ? "triangles" : "strands", api_number(answer, "vertices", 0),
               api_text(answer, "format"));
        if (known)
            printf(", %.3g x %.3g x %.3g m", size[0], size[1], size[2]);
        printf("\n");
        fflush(stdout);
    }
    print_warnings(answer);
    if (known)
        print_hint(thing, options, size);
}

static int upload(struct groomctl *ctl, const struct arguments *arguments, enum sized_thing thing)
{
    struct upload_options options = upload_options_of(arguments);
    cJSON *answer = NULL;
    int status = upload_file(ctl, thing, arguments->operands[0], &options, &answer);
    if (status == DONE)
        upload_describe(ctl, thing, &options, answer);
    cJSON_Delete(answer);
    return status;
}

int command_upload(struct groomctl *ctl, const struct arguments *arguments)
{
    return upload(ctl, arguments, SIZED_HAIR);
}

int command_upload_head(struct groomctl *ctl, const struct arguments *arguments)
{
    return upload(ctl, arguments, SIZED_HEAD);
}
