#include "client/groomctl/output_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int fail(const char *path, const char *verb)
{
    fprintf(stderr, "groomctl: %s cannot be %s: %s\n", path, verb, strerror(errno));
    return 0;
}

int output_file_open(struct output_file *file, const char *path)
{
    mode_t mask = umask(0);
    umask(mask);
    *file = (struct output_file){.fd = -1};
    if (strlen(path) >= sizeof file->path) {
        errno = ENAMETOOLONG;
        return fail(path, "written");
    }
    strcpy(file->path, path);
    if (!strcmp(path, "-")) {
        file->is_stdout = 1;
        file->fd = STDOUT_FILENO;
        return 1;
    }
    snprintf(file->temporary, sizeof file->temporary, "%s.XXXXXX", path);
    file->fd = mkstemp(file->temporary);
    if (file->fd < 0)
        return fail(path, "written");
    fchmod(file->fd, 0666 & ~mask);
    return 1;
}

int output_file_write(struct output_file *file, const void *bytes, size_t n)
{
    const char *at = bytes;
    while (n) {
        ssize_t written = write(file->fd, at, n);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0) {
            snprintf(file->failure, sizeof file->failure, "%s", strerror(errno));
            return 0;
        }
        at += written;
        n -= (size_t)written;
        file->n_bytes += (size_t)written;
    }
    return 1;
}

void output_file_restart(struct output_file *file)
{
    if (file->is_stdout || !file->n_bytes)
        return;
    file->n_bytes = 0;
    if (ftruncate(file->fd, 0) || lseek(file->fd, 0, SEEK_SET))
        snprintf(file->failure, sizeof file->failure, "%s", strerror(errno));
}

int output_file_commit(struct output_file *file)
{
    int fd = file->fd;
    file->fd = -1;
    if (file->is_stdout)
        return 1;
    if (close(fd) || rename(file->temporary, file->path)) {
        fail(file->path, "written");
        unlink(file->temporary);
        return 0;
    }
    return 1;
}

void output_file_abort(struct output_file *file)
{
    if (file->fd < 0 || file->is_stdout)
        return;
    close(file->fd);
    unlink(file->temporary);
    file->fd = -1;
}

int output_file_check(const char *path)
{
    char folder[4096];
    const char *slash = strrchr(path, '/');
    if (!strcmp(path, "-"))
        return 1;
    snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) + 1 : 1, slash ? path : ".");
    return access(folder, W_OK) ? fail(path, "written") : 1;
}

static groom_status write_piece(void *user, const void *bytes, size_t n_bytes)
{
    if (output_file_write(user, bytes, n_bytes))
        return GROOM_OK;
    return errno == ENOSPC ? GROOM_ENOSPC : GROOM_EIO;
}

struct groom_sink output_file_sink(struct output_file *file)
{
    return (struct groom_sink){.write = write_piece, .user = file};
}

int output_file_save(const char *path, const void *bytes, size_t n)
{
    struct output_file file;
    if (!output_file_open(&file, path))
        return 0;
    if (output_file_write(&file, bytes, n))
        return output_file_commit(&file);
    fprintf(stderr, "groomctl: %s cannot be written: %s\n", path, file.failure);
    output_file_abort(&file);
    return 0;
}
