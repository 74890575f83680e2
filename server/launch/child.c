/* Run a tool, read what it says, never longer than its time. */
#include "server/launch/child.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "server/launch/spawn.h"

#define DEFAULT_WALL_MS 60000
#define DEFAULT_OUTPUT (1u << 20)

struct run {
    const struct child_spec *spec;
    pid_t pid;
    int pid_fd;              /* readable once it has ended */
    int words_fd, output_fd; /* ends that we read; -1: closed, or not ours */
    int64_t deadline_ms;
    size_t max_output, room;
    bool too_much, no_memory;
    struct child_result result;
    size_t n_words;
};

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static void close_fd(int *fd)
{
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
}

/* --- starting ------------------------------------------------------------------------- */

/* A pipe whose reading end never blocks us. */
static bool make_pipe(int *read_fd, int *write_fd)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return false;
    fcntl(ends[0], F_SETFL, O_NONBLOCK);
    *read_fd = ends[0];
    *write_fd = ends[1];
    return true;
}

static groom_status run_begin(struct run *run, struct groom_diag *diag)
{
    const struct child_spec *spec = run->spec;
    int null_fd = -1, words_fd = -1, output_fd = -1;
    groom_status status;
    if ((spec->stdin_fd < 0 && (null_fd = open("/dev/null", O_RDONLY | O_CLOEXEC)) < 0) ||
        !make_pipe(&run->words_fd, &words_fd) ||
        (spec->stdout_fd < 0 && !make_pipe(&run->output_fd, &output_fd))) {
        status = groom_fail(diag, GROOM_EIO, "starting %s: %s", spec->argv[0], strerror(errno));
    } else {
        struct spawn_spec spawn = {.argv = spec->argv, .env = spec->env, .limits = spec->limits,
                                   .fd = {spec->stdin_fd < 0 ? null_fd : spec->stdin_fd,
                                          spec->stdout_fd < 0 ? output_fd : spec->stdout_fd, words_fd}};
        status = spawn_process(&spawn, &run->pid, diag);
    }
    close_fd(&null_fd);
    close_fd(&words_fd);
    close_fd(&output_fd);
    if (status != GROOM_OK) {
        close_fd(&run->words_fd);
        close_fd(&run->output_fd);
        return status;
    }
    run->pid_fd = (int)syscall(SYS_pidfd_open, run->pid, 0);
    run->deadline_ms = now_ms() + (spec->wall_ms ? spec->wall_ms : DEFAULT_WALL_MS);
    run->max_output = spec->max_output ? spec->max_output : DEFAULT_OUTPUT;
    return GROOM_OK;
}

/* --- listening --------------------------------------------------------------------------- */

static void stop(struct run *run) { kill(-run->pid, SIGKILL); }

/* Of a long complaint its end is kept. */
static void keep_words(struct run *run, const char *bytes, size_t n)
{
    char *words = run->result.words;
    const size_t room = CHILD_WORDS_SIZE - 1;
    if (n > room) {
        bytes += n - room;
        n = room;
    }
    if (run->n_words + n > room) {
        size_t gone = run->n_words + n - room;
        memmove(words, words + gone, run->n_words - gone);
        run->n_words -= gone;
    }
    memcpy(words + run->n_words, bytes, n);
    run->n_words += n;
    words[run->n_words] = 0;
}

static void keep_output(struct run *run, const char *bytes, size_t n)
{
    struct child_result *result = &run->result;
    if (run->too_much || run->no_memory)
        return;
    if (result->n_output + n > run->max_output) {
        run->too_much = true;
        stop(run);
        return;
    }
    if (result->n_output + n + 1 > run->room) {
        size_t room = 2 * (result->n_output + n) + 1;
        char *larger = realloc(result->output, room);
        if (!larger) {
            run->no_memory = true;
            stop(run);
            return;
        }
        result->output = larger;
        run->room = room;
    }
    memcpy(result->output + result->n_output, bytes, n);
    result->n_output += n;
    result->output[result->n_output] = 0;
}

/* Read what is there; closes the end once the other side is gone. */
static void drain(struct run *run, int *fd, void (*keep)(struct run *run, const char *bytes, size_t n))
{
    char bytes[65536];
    while (*fd >= 0) {
        ssize_t n = read(*fd, bytes, sizeof bytes);
        if (n > 0)
            keep(run, bytes, (size_t)n);
        else if (n < 0 && errno == EINTR)
            continue;
        else if (n < 0 && errno == EAGAIN)
            return;
        else
            close_fd(fd);
    }
}

static void listen_once(struct run *run)
{
    struct pollfd ends[3] = {{run->pid_fd, POLLIN, 0}, {run->words_fd, POLLIN, 0}, {run->output_fd, POLLIN, 0}};
    const atomic_bool *give_up = run->spec->give_up;
    int64_t left = give_up && atomic_load(give_up) ? 0 : run->deadline_ms - now_ms();
    if (left <= 0 && !run->result.timed_out) {
        run->result.timed_out = true;
        stop(run);
    }
    /* killed, or without a pidfd: look again soon */
    int timeout = left <= 0 || run->pid_fd < 0 ? 20 : (int)(left < 60000 ? left : 60000);
    if (give_up && timeout > 100)
        timeout = 100;
    poll(ends, 3, timeout);
    drain(run, &run->words_fd, keep_words);
    drain(run, &run->output_fd, keep_output);
}

static bool has_ended(pid_t pid)
{
    siginfo_t info = {0};
    return waitid(P_PID, (id_t)pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == pid;
}

static groom_status run_finish(struct run *run, struct child_result *result, struct groom_diag *diag)
{
    int how = 0;
    while (!has_ended(run->pid))
        listen_once(run);
    stop(run); /* what it may have left in its group; its number is its own until we wait for it */
    while (waitpid(run->pid, &how, 0) < 0 && errno == EINTR)
        continue;
    drain(run, &run->words_fd, keep_words);
    drain(run, &run->output_fd, keep_output);
    close_fd(&run->words_fd);
    close_fd(&run->output_fd);
    close_fd(&run->pid_fd);
    run->result.exit_status = WIFEXITED(how) ? WEXITSTATUS(how) : -1;
    run->result.signal = WIFSIGNALED(how) ? WTERMSIG(how) : 0;
    run->result.timed_out |= run->result.signal == SIGXCPU;
    if (!run->too_much && !run->no_memory) {
        *result = run->result;
        return GROOM_OK;
    }
    child_result_finish(&run->result);
    return run->too_much ? groom_fail(diag, GROOM_ETOOBIG, "%s said more than %zu bytes", run->spec->argv[0],
                                      run->max_output)
                         : groom_fail(diag, GROOM_ENOMEM, "no memory for the output of %s", run->spec->argv[0]);
}

groom_status child_run(const struct child_spec *spec, struct child_result *result, struct groom_diag *diag)
{
    struct run run = {.spec = spec, .pid_fd = -1, .words_fd = -1, .output_fd = -1};
    groom_status status = run_begin(&run, diag);
    return status == GROOM_OK ? run_finish(&run, result, diag) : status;
}

void child_result_finish(struct child_result *result)
{
    if (!result)
        return;
    free(result->output);
    result->output = NULL;
    result->n_output = 0;
}

/* --- streaming: the same in a thread of its own, which the child is tied to ---------------------- */

struct child {
    struct child_spec spec;
    struct run run;
    struct child_result result;
    struct groom_diag diag;
    groom_status started, ended;
    sem_t ready;
    pthread_t thread;
};

static void *child_main(void *user)
{
    struct child *child = user;
    child->started = run_begin(&child->run, &child->diag);
    close_fd(&child->spec.stdout_fd); /* the child has its own now: the reader sees its end */
    bool runs = child->started == GROOM_OK;
    sem_post(&child->ready);
    if (runs)
        child->ended = run_finish(&child->run, &child->result, &child->diag);
    return NULL;
}

static groom_status start_thread(struct child *child, struct groom_diag *diag)
{
    sem_init(&child->ready, 0, 0);
    if (pthread_create(&child->thread, NULL, child_main, child) != 0) {
        close_fd(&child->spec.stdout_fd);
        return groom_fail(diag, GROOM_ENOMEM, "no thread for %s", child->spec.argv[0]);
    }
    while (sem_wait(&child->ready) != 0)
        continue;
    if (child->started != GROOM_OK) {
        pthread_join(child->thread, NULL);
        if (diag)
            *diag = child->diag;
    }
    return child->started;
}

groom_status child_start(const struct child_spec *spec, struct child **child, int *output_fd,
                         struct groom_diag *diag)
{
    int ends[2];
    struct child *made = calloc(1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a child");
    if (pipe2(ends, O_CLOEXEC) != 0) {
        free(made);
        return groom_fail(diag, GROOM_EIO, "starting %s: %s", spec->argv[0], strerror(errno));
    }
    made->spec = *spec;
    made->spec.stdout_fd = ends[1];
    made->run = (struct run){.spec = &made->spec, .pid_fd = -1, .words_fd = -1, .output_fd = -1};
    groom_status status = start_thread(made, diag);
    if (status != GROOM_OK) {
        close(ends[0]);
        sem_destroy(&made->ready);
        free(made);
        return status;
    }
    *child = made;
    *output_fd = ends[0];
    return GROOM_OK;
}

groom_status child_wait(struct child *child, struct child_result *result, struct groom_diag *diag)
{
    pthread_join(child->thread, NULL);
    groom_status status = child->ended;
    if (status == GROOM_OK)
        *result = child->result;
    else if (diag)
        *diag = child->diag;
    sem_destroy(&child->ready);
    free(child);
    return status;
}
