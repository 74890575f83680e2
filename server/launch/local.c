/* Attempts as child processes of this machine. */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/launch/spawn.h"

/* A fit takes all the processor it gets, for long; whoever waits for an answer comes first. */
#define ATTEMPT_NICE 5

/* --- handles: "local:PID:START:BOOT" ------------------------------------------------------ */

struct process {
    pid_t pid;
    unsigned long long start; /* clock ticks since the boot: with the pid, one process of this boot */
    char boot[16];
};

/* The beginning of a small file of /proc, without a stream: where memory or descriptors are out, a worker
 * that lives must not look dead. returns  0, ENOENT or ESRCH (it is not there), another errno */
static int read_proc(const char *path, char *text, size_t size)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return errno;
    ssize_t n = read(fd, text, size - 1);
    int error = n < 0 ? errno : 0;
    text[n > 0 ? n : 0] = 0;
    close(fd);
    return error;
}

/* The number of this boot, shortened; "" where it cannot be read. */
static void read_boot(char boot[16])
{
    char text[64];
    boot[0] = 0;
    if (read_proc("/proc/sys/kernel/random/boot_id", text, sizeof text) != 0 || sscanf(text, "%8[0-9a-f]", boot) != 1)
        boot[0] = 0;
}

enum presence { THERE, GONE, UNKNOWN };

/* Fields 3 and 22 of /proc/PID/stat; the second is a name in parentheses that may hold anything. */
static enum presence read_stat(pid_t pid, char *state, unsigned long long *start)
{
    char path[64], line[1024];
    snprintf(path, sizeof path, "/proc/%ld/stat", (long)pid);
    int error = read_proc(path, line, sizeof line);
    if (error)
        return error == ENOENT || error == ESRCH ? GONE : UNKNOWN;
    char *at = strrchr(line, ')');
    if (!at || at[1] != ' ')
        return UNKNOWN;
    *state = at[2];
    for (int field = 2; at && field < 22; field++)
        at = strchr(at + 1, ' ');
    return at && sscanf(at, "%llu", start) == 1 ? THERE : UNKNOWN;
}

static void write_handle(const struct process *process, char handle[LAUNCH_HANDLE_SIZE])
{
    snprintf(handle, LAUNCH_HANDLE_SIZE, "local:%ld:%llu:%s", (long)process->pid, process->start, process->boot);
}

static bool read_handle(const char *handle, struct process *process)
{
    long pid;
    process->boot[0] = 0;
    if (sscanf(handle, "local:%ld:%llu:%15[0-9a-f]", &pid, &process->start, process->boot) < 2 || pid <= 1)
        return false;
    process->pid = (pid_t)pid;
    return true;
}

/* Is it still this very process, and not another that got its number? *state is 'Z' for one that has
 * ended and was not waited for. */
static enum presence look(const struct process *process, char *state)
{
    unsigned long long start;
    char boot[16];
    read_boot(boot);
    if (!boot[0] && process->boot[0])
        return UNKNOWN;
    if (strcmp(boot, process->boot) != 0)
        return GONE;
    enum presence presence = read_stat(process->pid, state, &start);
    return presence == THERE && start != process->start ? GONE : presence;
}

static groom_status not_known(const char *handle, struct groom_diag *diag)
{
    return groom_fail(diag, GROOM_EIO, "%s cannot be looked after: %s", handle, strerror(errno));
}

/* --- the table --------------------------------------------------------------------------------- */

static groom_status local_start(struct launcher *launcher, const struct launch_spec *spec,
                                char handle[LAUNCH_HANDLE_SIZE], struct groom_diag *diag)
{
    struct process process;
    char state;
    int null_fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
    int log_fd = open(spec->log_path, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0640);
    groom_status status;
    if (null_fd < 0 || log_fd < 0) {
        status = groom_fail(diag, errno == ENOSPC ? GROOM_ENOSPC : GROOM_EIO, "opening %s: %s", spec->log_path,
                            strerror(errno));
    } else {
        struct spawn_spec spawn = {spec->argv, spec->env, {null_fd, log_fd, log_fd}, spec->limits, ATTEMPT_NICE};
        status = spawn_process(&spawn, &process.pid, diag);
    }
    if (null_fd >= 0)
        close(null_fd);
    if (log_fd >= 0)
        close(log_fd);
    if (status != GROOM_OK)
        return status;
    if (read_stat(process.pid, &state, &process.start) != THERE)
        process.start = 0; /* without /proc: it is still our child, and waited for */
    read_boot(process.boot);
    write_handle(&process, handle);
    return GROOM_OK;
}

static void say_gone(struct launch_status *status)
{
    *status = (struct launch_status){.state = LAUNCH_ENDED, .unknown = true, .words = "gone"};
}

/* SIGXCPU comes from RLIMIT_CPU alone. What is out of address space says so itself. */
static void say_how(int wait_status, struct launch_status *status)
{
    status->state = LAUNCH_ENDED;
    status->over_time = WIFSIGNALED(wait_status) && WTERMSIG(wait_status) == SIGXCPU;
    spawn_words(wait_status, status->words, sizeof status->words);
}

static groom_status local_poll(struct launcher *launcher, const char *handle, struct launch_status *status,
                               struct groom_diag *diag)
{
    struct process process;
    char state = 'Z';
    int how;
    *status = (struct launch_status){.state = LAUNCH_RUNNING};
    bool known = read_handle(handle, &process);
    enum presence presence = known && process.start != 0 ? look(&process, &state) : THERE;
    if (presence == UNKNOWN)
        return not_known(handle, diag);
    if (!known || presence == GONE) {
        say_gone(status);
        return GROOM_OK;
    }
    pid_t waited = waitpid(process.pid, &how, WNOHANG);
    if (waited == process.pid) {
        say_how(how, status);
    } else if (waited < 0 && errno == ECHILD && state == 'Z') {
        say_gone(status); /* a former daemon's, that nobody has waited for yet */
    }
    return GROOM_OK;
}

static bool is_our_child(pid_t pid)
{
    siginfo_t info;
    return waitid(P_PID, (id_t)pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0;
}

static groom_status local_stop(struct launcher *launcher, const char *handle, enum launch_stop how,
                               struct groom_diag *diag)
{
    struct process process;
    int number = how == LAUNCH_KILL ? SIGKILL : SIGTERM;
    char state;
    if (!read_handle(handle, &process))
        return GROOM_OK;
    enum presence presence = process.start != 0 ? look(&process, &state) : THERE;
    if (presence != THERE)
        return presence == GONE ? GROOM_OK : not_known(handle, diag);
    if (is_our_child(process.pid)) { /* not waited for yet: the number is its own, and its group's */
        if (kill(-process.pid, number) != 0 && errno != ESRCH)
            return groom_fail(diag, GROOM_EIO, "stopping %s: %s", handle, strerror(errno));
        return GROOM_OK;
    }
    /* a former daemon's: hold on to the process, then see once more that it is the one */
    int pid_fd = (int)syscall(SYS_pidfd_open, process.pid, 0);
    if (pid_fd < 0)
        return GROOM_OK;
    groom_status status = GROOM_OK;
    if (look(&process, &state) == THERE && syscall(SYS_pidfd_send_signal, pid_fd, number, NULL, 0) != 0 && errno != ESRCH)
        status = groom_fail(diag, GROOM_EIO, "stopping %s: %s", handle, strerror(errno));
    close(pid_fd);
    return status;
}

static void local_destroy(struct launcher *launcher) { free(launcher); }

static const struct launcher_table local_table = {"local", NULL, 20, local_start, local_poll, local_stop,
                                                  local_destroy};

groom_status launch_local_create(struct launcher **launcher, struct groom_diag *diag)
{
    struct launcher *made = calloc(1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the launcher");
    made->table = &local_table;
    *launcher = made;
    return GROOM_OK;
}

void launch_destroy(struct launcher *launcher)
{
    if (launcher)
        launcher->table->destroy(launcher);
}
