/* Standard input and output of the commands that parse. */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/worker/worker.h"

void worker_input_open(int fd, struct worker_input *input)
{
    struct stat status;
    memset(input, 0, sizeof *input);
    input->source = groom_source_from_fd(fd);
    if (fstat(fd, &status) || !S_ISREG(status.st_mode) || status.st_size <= 0 || lseek(fd, 0, SEEK_CUR) != 0)
        return;
    input->map = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE, fd, 0);
    if (input->map == MAP_FAILED) {
        input->map = NULL;
        return;
    }
    input->n_map = (size_t)status.st_size;
    madvise(input->map, input->n_map, MADV_SEQUENTIAL);
    input->source = groom_source_from_memory(&input->memory, input->map, input->n_map);
}

groom_status worker_input_open_path(const char *path, const char *what, struct worker_input *input, struct groom_diag *diag)
{
    if (!path)
        return GROOM_OK;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return groom_fail(diag, GROOM_EIO, "%s cannot be opened: %s", what, strerror(errno));
    worker_input_open(fd, input);
    close(fd); /* the mapping holds the file */
    return input->map ? GROOM_OK : groom_fail(diag, GROOM_EIO, "%s is empty or no regular file", what);
}

void worker_input_close(struct worker_input *input)
{
    if (input->map)
        munmap(input->map, input->n_map);
    memset(input, 0, sizeof *input);
}

int worker_run_sandboxed(groom_status (*body)(void *, struct worker_input *, const struct groom_context *,
                                              struct groom_diag *),
                         void *request)
{
    struct groom_context context = {0};
    struct worker_input input;
    struct groom_diag diag = {0};
    worker_enter_sandbox();
    worker_input_open(STDIN_FILENO, &input);
    groom_status st = groom_pool_create(worker_threads(), &context.pool);
    if (st == GROOM_OK)
        st = body(request, &input, &context, &diag);
    groom_pool_destroy(context.pool);
    worker_input_close(&input);
    return st == GROOM_OK ? WORKER_OK : worker_print_problem(st, &diag);
}

groom_status worker_input_text(struct worker_input *input, size_t limit, char **text, size_t *n_bytes,
                               struct groom_diag *diag)
{
    size_t capacity = input->source.size > 0 ? (size_t)input->source.size + 2 : 65536, n = 0;
    char *bytes = malloc(capacity);
    int64_t got = 1;
    while (bytes && got > 0 && n <= limit) {
        if (n + 1 >= capacity) {
            char *more = realloc(bytes, capacity *= 2);
            if (!more)
                break;
            bytes = more;
        }
        got = input->source.read(input->source.user, bytes + n, capacity - 1 - n);
        if (got > 0)
            n += (size_t)got;
    }
    if (!bytes || got != 0) {
        free(bytes);
        if (n > limit)
            return groom_fail(diag, GROOM_ETOOBIG, "the document is longer than %zu bytes", limit);
        if (got < 0)
            return groom_fail(diag, GROOM_EIO, "standard input cannot be read: %s", strerror(errno));
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the document");
    }
    bytes[n] = '\0';
    *text = bytes;
    *n_bytes = n;
    return GROOM_OK;
}

static groom_status write_all(void *user, const void *bytes, size_t n_bytes)
{
    const char *at = bytes;
    int fd = *(const int *)user;
    while (n_bytes) {
        ssize_t n = write(fd, at, n_bytes);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return errno == EPIPE                      ? GROOM_ECANCELLED
                   : errno == ENOSPC || errno == EFBIG ? GROOM_ENOSPC
                                                       : GROOM_EIO;
        at += n;
        n_bytes -= (size_t)n;
    }
    return GROOM_OK;
}

struct groom_sink worker_fd_sink(const int *fd)
{
    return (struct groom_sink){.write = write_all, .user = (void *)(uintptr_t)fd};
}
