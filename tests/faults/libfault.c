/* Preloaded into groomd: makes the nth write, sync, rename, creation, truncation, removal, allocation, read or start of
 * a process fail.
 *
 * GROOM_FAULT names a file that a test maps as well (struct faults): it arms a fault there while the daemon runs, and
 * reads how many calls of each kind there were. Only regular files below GROOM_FAULT_FOLDER count, and only in a
 * process of the name groomd. */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum kind { WRITE, SYNC, RENAME, CREATE, TRUNCATE, REMOVE, ALLOCATE, READ, SPAWN, KINDS };

struct faults {
    _Atomic int32_t kind;   /* -1: none */
    _Atomic int32_t error;  /* errno; 0: half of what is to be written, where anything is */
    _Atomic int64_t nth;    /* from 1; counts down */
    _Atomic int32_t goes_on; /* every one from the nth on */
    int32_t unused;
    _Atomic int64_t n_failed;
    _Atomic int64_t counts[KINDS];
};

static struct faults *faults;
static const char *folder;
static size_t n_folder;

__attribute__((constructor)) static void start(void)
{
    const char *path = getenv("GROOM_FAULT");
    folder = getenv("GROOM_FAULT_FOLDER");
    if (!path || !folder || strcmp(program_invocation_short_name, "groomd"))
        return;
    n_folder = strlen(folder);
    int fd = open(path, O_RDWR | O_CLOEXEC);
    void *map = fd >= 0 ? mmap(NULL, sizeof *faults, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) : MAP_FAILED;
    if (fd >= 0)
        close(fd);
    if (map != MAP_FAILED)
        faults = map;
}

/* Is this the call that is to fail? */
static int fails(enum kind kind)
{
    atomic_fetch_add(&faults->counts[kind], 1);
    if (atomic_load(&faults->kind) != (int32_t)kind)
        return 0;
    int64_t left = atomic_fetch_sub(&faults->nth, 1);
    if (left > 1 || (left < 1 && !atomic_load(&faults->goes_on)))
        return 0;
    atomic_fetch_add(&faults->n_failed, 1);
    errno = atomic_load(&faults->error);
    return 1;
}

static int is_ours(int fd)
{
    char link[64], path[4096];
    struct stat info;
    if (!faults || fstat(fd, &info) != 0 || !(S_ISREG(info.st_mode) || S_ISDIR(info.st_mode)))
        return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, path, sizeof path - 1);
    return n > (ssize_t)n_folder && !strncmp(path, folder, n_folder) && path[n_folder] == '/';
}

#define REAL(name) ((__typeof__(&name))real(#name))
static void *real(const char *name)
{
    void *found = dlsym(RTLD_NEXT, name);
    if (!found)
        abort();
    return found;
}

/* --- files --------------------------------------------------------------------------------- */

ssize_t write(int fd, const void *bytes, size_t n)
{
    if (is_ours(fd) && fails(WRITE)) {
        if (errno)
            return -1;
        n = n > 1 ? n / 2 : n;
    }
    return REAL(write)(fd, bytes, n);
}

ssize_t pwrite64(int fd, const void *bytes, size_t n, off64_t at)
{
    if (is_ours(fd) && fails(WRITE)) {
        if (errno)
            return -1;
        n = n > 1 ? n / 2 : n;
    }
    return REAL(pwrite64)(fd, bytes, n, at);
}

int fsync(int fd) { return is_ours(fd) && fails(SYNC) ? -1 : REAL(fsync)(fd); }
int fdatasync(int fd) { return is_ours(fd) && fails(SYNC) ? -1 : REAL(fdatasync)(fd); }

int rename(const char *from, const char *to) { return faults && fails(RENAME) ? -1 : REAL(rename)(from, to); }
int renameat(int from_fd, const char *from, int to_fd, const char *to)
{
    return faults && fails(RENAME) ? -1 : REAL(renameat)(from_fd, from, to_fd, to);
}
int linkat(int from_fd, const char *from, int to_fd, const char *to, int flags)
{
    return faults && fails(RENAME) ? -1 : REAL(linkat)(from_fd, from, to_fd, to, flags);
}

int ftruncate(int fd, off_t n) { return is_ours(fd) && fails(TRUNCATE) ? -1 : REAL(ftruncate)(fd, n); }
int ftruncate64(int fd, off64_t n) { return is_ours(fd) && fails(TRUNCATE) ? -1 : REAL(ftruncate64)(fd, n); }
int fallocate(int fd, int mode, off_t at, off_t n)
{
    return is_ours(fd) && fails(TRUNCATE) ? -1 : REAL(fallocate)(fd, mode, at, n);
}

/* A hint to the kernel, whose failure must not matter. */
int sync_file_range(int fd, off64_t at, off64_t n, unsigned flags)
{
    return is_ours(fd) && fails(SYNC) ? -1 : REAL(sync_file_range)(fd, at, n, flags);
}

ssize_t read(int fd, void *bytes, size_t n) { return is_ours(fd) && fails(READ) ? -1 : REAL(read)(fd, bytes, n); }
ssize_t pread(int fd, void *bytes, size_t n, off_t at) { return is_ours(fd) && fails(READ) ? -1 : REAL(pread)(fd, bytes, n, at); }
ssize_t pread64(int fd, void *bytes, size_t n, off64_t at)
{
    return is_ours(fd) && fails(READ) ? -1 : REAL(pread64)(fd, bytes, n, at);
}

int mkdir(const char *path, mode_t mode) { return faults && fails(CREATE) ? -1 : REAL(mkdir)(path, mode); }
int mkdirat(int fd, const char *path, mode_t mode) { return faults && fails(CREATE) ? -1 : REAL(mkdirat)(fd, path, mode); }
int rmdir(const char *path) { return faults && fails(REMOVE) ? -1 : REAL(rmdir)(path); }
int remove(const char *path) { return faults && fails(REMOVE) ? -1 : REAL(remove)(path); }
int unlink(const char *path) { return faults && fails(REMOVE) ? -1 : REAL(unlink)(path); }
int unlinkat(int fd, const char *path, int flags) { return faults && fails(REMOVE) ? -1 : REAL(unlinkat)(fd, path, flags); }

#define CREATES(flags) (((flags) & O_CREAT) || ((flags) & O_TMPFILE) == O_TMPFILE)

static mode_t mode_of(int flags, va_list arguments) { return CREATES(flags) ? va_arg(arguments, mode_t) : 0; }

#define OPEN(name, type)                                                                                      \
    int name(const char *path, int flags, ...)                                                                \
    {                                                                                                         \
        va_list arguments;                                                                                    \
        va_start(arguments, flags);                                                                           \
        mode_t mode = mode_of(flags, arguments);                                                              \
        va_end(arguments);                                                                                    \
        if (faults && CREATES(flags) && !strncmp(path, folder, n_folder) && fails(CREATE))                    \
            return -1;                                                                                        \
        return REAL(name)(path, flags, mode);                                                                 \
    }
OPEN(open, int)
OPEN(open64, int)

int openat(int at, const char *path, int flags, ...)
{
    va_list arguments;
    va_start(arguments, flags);
    mode_t mode = mode_of(flags, arguments);
    va_end(arguments);
    if (CREATES(flags) && is_ours(at) && fails(CREATE))
        return -1;
    return REAL(openat)(at, path, flags, mode);
}

/* --- processes ------------------------------------------------------------------------------- */

pid_t fork(void) { return faults && fails(SPAWN) ? -1 : REAL(fork)(); }
int pipe2(int ends[2], int flags) { return faults && fails(SPAWN) ? -1 : REAL(pipe2)(ends, flags); }

/* --- memory ---------------------------------------------------------------------------------- */

#ifndef WITHOUT_ALLOCATOR /* a sanitizer has its own */
void *__libc_malloc(size_t n);
void *__libc_calloc(size_t n, size_t size);
void *__libc_realloc(void *old, size_t n);
void *__libc_memalign(size_t alignment, size_t n);

static int memory_is_out(void)
{
    if (!faults || !fails(ALLOCATE))
        return 0;
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t n) { return memory_is_out() ? NULL : __libc_malloc(n); }
void *calloc(size_t n, size_t size) { return memory_is_out() ? NULL : __libc_calloc(n, size); }
void *aligned_alloc(size_t alignment, size_t n) { return memory_is_out() ? NULL : __libc_memalign(alignment, n); }
void *mmap(void *at, size_t n, int protection, int flags, int fd, off_t offset)
{
    return memory_is_out() ? MAP_FAILED : REAL(mmap)(at, n, protection, flags, fd, offset);
}
void *realloc(void *old, size_t n) { return memory_is_out() ? NULL : __libc_realloc(old, n); }
#endif
