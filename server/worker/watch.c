/* The attempt's second process, which outlives its death to say so. */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "proto/work.h"
#include "server/worker/work_link.h"
#include "server/worker/worker.h"

#define TAIL_BYTES 2048

static volatile sig_atomic_t child_pid, stop;

static void pass_on(int number)
{
    stop = number;
    if (child_pid > 0)
        kill((pid_t)child_pid, number);
}

struct tail {
    char bytes[TAIL_BYTES + 1];
    size_t n;
};

/* The end of it is kept; what is not text is made harmless. */
static void keep(struct tail *tail, const char *bytes, size_t n)
{
    if (n > TAIL_BYTES) {
        bytes += n - TAIL_BYTES;
        n = TAIL_BYTES;
    }
    size_t gone = tail->n + n > TAIL_BYTES ? tail->n + n - TAIL_BYTES : 0;
    memmove(tail->bytes, tail->bytes + gone, tail->n - gone);
    tail->n -= gone;
    for (size_t i = 0; i < n; i++) {
        unsigned char c = (unsigned char)bytes[i];
        tail->bytes[tail->n++] = c >= 127 || (c < ' ' && c != '\n' && c != '\t') ? '?' : (char)c;
    }
    tail->bytes[tail->n] = 0;
}

/* What the child says goes on to our own standard error. */
static void listen_to(int fd, struct tail *tail)
{
    char bytes[1024];
    ssize_t n;
    while ((n = read(fd, bytes, sizeof bytes)) > 0 || (n < 0 && errno == EINTR)) {
        if (n < 0)
            continue;
        keep(tail, bytes, (size_t)n);
        if (write(STDERR_FILENO, bytes, (size_t)n) < 0)
            continue; /* there is nobody to tell */
    }
}

static void describe(int how, const struct tail *tail, char *words, size_t size)
{
    if (WIFSIGNALED(how))
        snprintf(words, size, "signal %d (%s)\n%s", WTERMSIG(how), strsignal(WTERMSIG(how)), tail->bytes);
    else
        snprintf(words, size, "exit status %d\n%s", WEXITSTATUS(how), tail->bytes);
}

static int is_crash(int how)
{
    return !WIFEXITED(how) || (WEXITSTATUS(how) != WORK_EXIT_DONE && WEXITSTATUS(how) != WORK_EXIT_FAILED &&
                               WEXITSTATUS(how) != WORK_EXIT_STOPPED);
}

static void tell(const char *url, const char *token, const char *words)
{
    struct work_link link;
    if (!work_link_open(&link, url, token, &stop))
        return;
    work_link_farewell(&link, words);
    work_link_close(&link);
}

static int watch(const char *url, const char *token, int fd)
{
    static struct tail tail;
    char words[TAIL_BYTES + 128];
    int how = 0;
    listen_to(fd, &tail);
    close(fd);
    while (waitpid((pid_t)child_pid, &how, 0) < 0 && errno == EINTR)
        continue;
    child_pid = 0;
    if (is_crash(how)) {
        describe(how, &tail, words, sizeof words);
        tell(url, token, words);
    }
    return WIFEXITED(how) ? WEXITSTATUS(how) : 128 + WTERMSIG(how);
}

/* The child keeps the caller's handlers, and dies with its parent. */
int worker_watch(const char *url, const char *token, int *status)
{
    struct sigaction action = {.sa_handler = pass_on};
    sigset_t both, before;
    int ends[2];
    if (pipe(ends) != 0)
        return 0;
    sigemptyset(&both);
    sigaddset(&both, SIGTERM);
    sigaddset(&both, SIGINT);
    sigprocmask(SIG_BLOCK, &both, &before); /* until it is known whom to pass them to */
    pid_t parent = getpid(), pid = fork();
    if (pid > 0) {
        child_pid = pid;
        sigaction(SIGTERM, &action, NULL);
        sigaction(SIGINT, &action, NULL);
    } else if (pid == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent)
            _exit(WORK_EXIT_STOPPED);
        dup2(ends[1], STDERR_FILENO);
    }
    close(ends[1]);
    if (pid > 0) {
        sigprocmask(SIG_SETMASK, &before, NULL);
        *status = watch(url, token, ends[0]);
        return 1;
    }
    close(ends[0]);
    sigprocmask(SIG_SETMASK, &before, NULL);
    return 0;
}
