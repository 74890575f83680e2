#include "server/worker/receive.h"

#include <errno.h>
#include <sys/mman.h>
#include <unistd.h>

#include "proto/strand_stream.h"
#include "proto/work.h"

/* --- a file --------------------------------------------------------------------------------- */

struct file {
    int fd, failed;
};

static void begin_file(void *user)
{
    struct file *file = user;
    file->failed = ftruncate(file->fd, 0) != 0 || lseek(file->fd, 0, SEEK_SET) != 0;
}

static size_t take_file(void *user, const char *bytes, size_t n)
{
    struct file *file = user;
    size_t done = 0;
    while (!file->failed && done < n) {
        ssize_t written = write(file->fd, bytes + done, n - done);
        if (written < 0 && errno != EINTR)
            return 0;
        done += written > 0 ? (size_t)written : 0;
    }
    return file->failed ? 0 : n;
}

groom_status receive_file(struct work_link *link, const char *path, int *fd, struct groom_diag *diag)
{
    struct file file = {.fd = memfd_create("answer", MFD_CLOEXEC)};
    const struct http_request request = {.method = "GET", .path = path, .sink = take_file, .begin = begin_file, .user = &file};
    if (file.fd < 0)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for an answer of the daemon");
    groom_status st = work_link_call(link, &request, NULL, diag);
    if (st == GROOM_OK && (lseek(file.fd, 0, SEEK_SET) != 0 || file.failed))
        st = groom_fail(diag, GROOM_EIO, "an answer of the daemon could not be kept");
    if (st == GROOM_OK)
        *fd = file.fd;
    else
        close(file.fd);
    return st;
}

/* --- strands ---------------------------------------------------------------------------------- */

struct reception {
    struct strand_stream stream;
    const struct groom_context *context;
    struct groom_strands *strands;
    struct groom_diag *diag;
    int failed;
};

static int make_room(void *user, struct strand_stream *stream)
{
    struct reception *r = user;
    if (groom_strands_create(stream->n_strands, stream->n_vertices, r->context, &r->strands, r->diag) != GROOM_OK)
        return 0;
    stream->first = r->strands->first;
    stream->points = r->strands->points;
    return 1;
}

static void begin_strands(void *user)
{
    struct reception *r = user;
    groom_strands_destroy(r->strands);
    r->strands = NULL;
    r->failed = 0;
    r->stream = (struct strand_stream){.room = make_room, .user = r};
}

static size_t take_strands(void *user, const char *bytes, size_t n)
{
    struct reception *r = user;
    r->failed = r->failed || !strand_stream_take(&r->stream, bytes, n);
    return n; /* to the end, so that the line stays whole */
}

groom_status receive_strands(struct work_link *link, const struct groom_context *context, struct groom_strands **strands,
                             struct groom_diag *diag)
{
    struct reception r = {.context = context, .diag = diag};
    const struct http_request request = {.method = "GET", .path = WORK_PATH_STRANDS, .sink = take_strands,
                                         .begin = begin_strands, .user = &r};
    begin_strands(&r);
    groom_status st = work_link_call(link, &request, NULL, diag);
    if (st == GROOM_OK && (r.failed || !strand_stream_is_whole(&r.stream)))
        st = groom_fail(diag, GROOM_EIO, "the daemon sent %llu bytes that are no strands", (unsigned long long)r.stream.at);
    if (st == GROOM_OK)
        *strands = r.strands;
    else
        groom_strands_destroy(r.strands);
    return st;
}
