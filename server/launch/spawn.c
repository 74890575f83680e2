#include "server/launch/spawn.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

/* What the child could not do; it tells the parent through a pipe that a successful exec closes. */
enum spawn_step { STEP_GROUP, STEP_PARENT, STEP_LIMITS, STEP_DESCRIPTORS, STEP_EXECUTE };
static const char *const step_words[] = {"making its process group", "tying it to its parent", "setting its limits",
                                         "passing its descriptors", "executing it"};
struct spawn_failure {
    enum spawn_step step;
    int error;
};

/* --- in the child, between fork and exec: only what is safe after a fork of many threads ------ */

static int limit(int resource, rlim_t soft, rlim_t hard)
{
    struct rlimit value = {soft, hard};
    return setrlimit((__rlimit_resource_t)resource, &value);
}

static int set_limits(const struct launch_limits *limits)
{
    if (limit(RLIMIT_CORE, 0, 0) != 0)
        return -1;
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    if (limits->memory_bytes > 0 && limit(RLIMIT_AS, limits->memory_bytes, limits->memory_bytes) != 0)
        return -1;
#endif
    /* SIGXCPU first, so that it is seen for what it is */
    if (limits->cpu_s > 0 && limit(RLIMIT_CPU, limits->cpu_s, limits->cpu_s + 1) != 0)
        return -1;
#if !defined(__SANITIZE_THREAD__) /* it writes its shadow memory to a file */
    rlim_t file = limits->file_bytes == LAUNCH_NO_FILES ? 0 : limits->file_bytes;
    if (limits->file_bytes > 0 && limit(RLIMIT_FSIZE, file, file) != 0)
        return -1;
#endif
    return 0;
}

/* First out of the way of 0..2, then into place; all others close at exec. */
static int pass_descriptors(const int fd[3])
{
    int high[3];
    for (int i = 0; i < 3; i++)
        if ((high[i] = fcntl(fd[i], F_DUPFD_CLOEXEC, 10)) < 0)
            return -1;
    for (int i = 0; i < 3; i++)
        if (dup2(high[i], i) < 0)
            return -1;
    return close_range(3, ~0u, CLOSE_RANGE_CLOEXEC);
}

/* Where it cannot, it runs as it is. */
static void give_way(int nice_by)
{
    errno = 0;
    if (nice_by && nice(nice_by) == -1 && errno)
        return; /* it runs as it is */
}

/* By system call: make 4.3 hands down signals 32 and 33 ignored, which the C library keeps for itself
 * and does not let anybody reset. */
static void reset_signals(void)
{
    static const struct {
        void *handler;
        unsigned long flags;
        void *restorer;
        uint64_t mask;
    } standard;
    sigset_t none;
    for (int number = 1; number < NSIG; number++)
        syscall(SYS_rt_sigaction, number, &standard, NULL, sizeof standard.mask);
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
}

/* The parent may have died before the kernel was told to watch it. */
static int tie_to_parent(pid_t parent)
{
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0 || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0)
        return -1;
    if (getppid() != parent) {
        errno = ESRCH;
        return -1;
    }
    return 0;
}

static _Noreturn void become(const struct spawn_spec *spec, pid_t parent, int report_fd)
{
    static char *const nothing[] = {NULL};
    struct spawn_failure failure = {STEP_GROUP, 0};
    reset_signals();
    give_way(spec->nice);
    if (setpgid(0, 0) == 0) {
        failure.step = STEP_PARENT;
        if (tie_to_parent(parent) == 0) {
            failure.step = STEP_LIMITS;
            if (set_limits(&spec->limits) == 0) {
                failure.step = STEP_DESCRIPTORS;
                if (pass_descriptors(spec->fd) == 0) {
                    failure.step = STEP_EXECUTE;
                    execve(spec->argv[0], (char *const *)spec->argv,
                           spec->env ? (char *const *)spec->env : nothing);
                }
            }
        }
    }
    failure.error = errno;
    ssize_t told = write(report_fd, &failure, sizeof failure);
    _exit(told == (ssize_t)sizeof failure ? 127 : 126);
}

/* --- in the parent ---------------------------------------------------------------------------- */

/* No signal handler of the daemon may run in the child. */
static pid_t fork_quietly(const struct spawn_spec *spec, int report_fd)
{
    sigset_t all, before;
    pid_t parent = getpid();
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    pid_t pid = fork();
    if (pid == 0)
        become(spec, parent, report_fd);
    int error = errno;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    errno = error;
    return pid;
}

groom_status spawn_process(const struct spawn_spec *spec, pid_t *pid, struct groom_diag *diag)
{
    struct spawn_failure failure;
    int report[2];
    if (pipe2(report, O_CLOEXEC) != 0)
        return groom_fail(diag, GROOM_EIO, "starting %s: %s", spec->argv[0], strerror(errno));
    /* above 2, so that passing the descriptors does not write over it */
    int report_fd = fcntl(report[1], F_DUPFD_CLOEXEC, 10);
    pid_t child = report_fd >= 0 ? fork_quietly(spec, report_fd) : -1;
    int error = errno;
    close(report[1]);
    if (report_fd >= 0)
        close(report_fd);
    if (child < 0) {
        close(report[0]);
        return groom_fail(diag, GROOM_EIO, "starting %s: %s", spec->argv[0], strerror(error));
    }
    ssize_t n;
    do
        n = read(report[0], &failure, sizeof failure);
    while (n < 0 && errno == EINTR);
    close(report[0]);
    if (n == (ssize_t)sizeof failure) {
        while (waitpid(child, NULL, 0) < 0 && errno == EINTR)
            continue;
        return groom_fail(diag, GROOM_EIO, "starting %s: %s: %s", spec->argv[0], step_words[failure.step],
                          strerror(failure.error));
    }
    *pid = child;
    return GROOM_OK;
}

void spawn_words(int wait_status, char *words, size_t size)
{
    if (WIFSIGNALED(wait_status))
        snprintf(words, size, "signal %d (%s)", WTERMSIG(wait_status), strsignal(WTERMSIG(wait_status)));
    else
        snprintf(words, size, "exit status %d", WEXITSTATUS(wait_status));
}
