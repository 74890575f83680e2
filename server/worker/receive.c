#include "server/worker/receive.h"

#include <errno.h>
#include <sys/mman.h>
#include <unistd.h>

struct reception {
    int fd, failed;
};

static void begin(void *user)
{
    struct reception *r = user;
    r->failed = ftruncate(r->fd, 0) != 0 || lseek(r->fd, 0, SEEK_SET) != 0;
}

static size_t take(void *user, const char *bytes, size_t n)
{
    struct reception *r = user;
    size_t done = 0;
    while (!r->failed && done < n) {
        ssize_t written = write(r->fd, bytes + done, n - done);
        if (written < 0 && errno != EINTR)
            return 0;
        done += written > 0 ? (size_t)written : 0;
    }
    return r->failed ? 0 : n;
}

groom_status receive(struct work_link *link, const char *path, int *fd, struct groom_diag *diag)
{
    struct reception reception = {.fd = memfd_create("answer", MFD_CLOEXEC)};
    const struct http_request request = {.method = "GET", .path = path, .sink = take, .begin = begin, .user = &reception};
    if (reception.fd < 0)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for an answer of the daemon");
    groom_status st = work_link_call(link, &request, NULL, diag);
    if (st == GROOM_OK && (lseek(reception.fd, 0, SEEK_SET) != 0 || reception.failed))
        st = groom_fail(diag, GROOM_EIO, "an answer of the daemon could not be kept");
    if (st == GROOM_OK)
        *fd = reception.fd;
    else
        close(reception.fd);
    return st;
}
