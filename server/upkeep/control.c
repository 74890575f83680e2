#include "server/upkeep/control.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "server/log.h"

#define NAME      "control"
#define LINE_SIZE 1600

struct control {
    struct upkeep upkeep;
    char *folder;
    int fd, wake[2];
    pthread_t thread;
    bool has_thread;
    atomic_bool busy;
};

/* --- the address ------------------------------------------------------------------------- */

/* Through the descriptor of the folder: its own name may be longer than an address can be. */
static int with_address(const char *folder, int fd, int (*call)(int, const struct sockaddr *, socklen_t))
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    int at = open(folder, O_PATH | O_DIRECTORY | O_CLOEXEC);
    if (at < 0)
        return -1;
    snprintf(address.sun_path, sizeof address.sun_path, "/proc/self/fd/%d/" NAME, at);
    int result = call(fd, (const struct sockaddr *)&address, sizeof address), error = errno;
    close(at);
    errno = error;
    return result;
}

/* --- the daemon's side --------------------------------------------------------------------- */

static void send_line(int fd, const char *kind, const char *text)
{
    char line[LINE_SIZE];
    int n = snprintf(line, sizeof line, "%s %s", kind, text);
    n = n < (int)sizeof line - 1 ? n : (int)sizeof line - 2;
    for (int i = 0; i < n; i++)
        if (line[i] == '\n')
            line[i] = ' ';
    line[n++] = '\n';
    if (send(fd, line, (size_t)n, MSG_NOSIGNAL) != n)
        return; /* who asked has gone: the work goes on without him */
}

static void say_to(void *user, char kind, const char *text) { send_line(*(int *)user, (char[]){kind, 0}, text); }

static groom_status obey(const struct upkeep *upkeep, const char *request, struct groom_diag *diag)
{
    uint64_t n_problems = 0;
    if (!strcmp(request, "check"))
        return upkeep_check(upkeep, &n_problems, diag);
    if (!strncmp(request, "backup /", 8))
        return upkeep_backup(upkeep, request + 7, false, diag);
    if (!strncmp(request, "backup-copy /", 13))
        return upkeep_backup(upkeep, request + 12, true, diag);
    return groom_fail(diag, GROOM_EINVAL, "the daemon does not know \"%.60s\"", request);
}

static bool read_line(int fd, char line[LINE_SIZE])
{
    size_t n = 0;
    while (n < LINE_SIZE - 1) {
        ssize_t got = recv(fd, line + n, 1, 0);
        if (got <= 0 || line[n] == '\n') {
            line[n] = 0;
            return got > 0;
        }
        n++;
    }
    return false;
}

static void serve(struct control *control, int fd)
{
    char request[LINE_SIZE], end[LINE_SIZE];
    struct upkeep upkeep = control->upkeep;
    struct groom_diag diag = {0};
    struct timeval patience = {10, 0};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    if (!read_line(fd, request))
        return;
    upkeep.say = say_to;
    upkeep.user = &fd;
    log_message(CONFIG_LOG_INFO, "%s", request);
    groom_status status = obey(&upkeep, request, &diag);
    snprintf(end, sizeof end, "%d %s", (int)status, status == GROOM_OK ? "" : diag.detail);
    send_line(fd, "e", end);
    if (status != GROOM_OK)
        log_message(CONFIG_LOG_WARNING, "%.40s: %s", request, diag.detail);
}

static void *listen_to(void *user)
{
    struct control *control = user;
    struct pollfd waits[2] = {{control->fd, POLLIN, 0}, {control->wake[0], POLLIN, 0}};
    for (;;) {
        if (poll(waits, 2, -1) < 0 && errno != EINTR)
            return NULL;
        if (waits[1].revents)
            return NULL;
        int fd = waits[0].revents ? accept4(control->fd, NULL, NULL, SOCK_CLOEXEC) : -1;
        if (fd < 0)
            continue;
        atomic_store(&control->busy, true);
        serve(control, fd);
        atomic_store(&control->busy, false);
        close(fd);
    }
}

/* The name of a daemon that was killed is in the way; nobody else has the folder's lock. */
static groom_status open_socket(struct control *control, struct groom_diag *diag)
{
    char path[1500];
    snprintf(path, sizeof path, "%s/" NAME, control->folder);
    unlink(path);
    control->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (control->fd < 0 || with_address(control->folder, control->fd, bind) != 0 || chmod(path, 0600) != 0 ||
        listen(control->fd, 4) != 0 || pipe2(control->wake, O_CLOEXEC) != 0)
        return groom_fail(diag, GROOM_EIO, "%.300s: %s", path, strerror(errno));
    return GROOM_OK;
}

groom_status control_start(const struct upkeep *upkeep, struct control **control, struct groom_diag *diag)
{
    struct control *made = calloc(1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the control socket");
    made->upkeep = *upkeep;
    made->fd = made->wake[0] = made->wake[1] = -1;
    groom_status status = GROOM_ENOMEM;
    if ((made->upkeep.folder = made->folder = strdup(upkeep->folder)) &&
        (status = open_socket(made, diag)) == GROOM_OK) {
        made->has_thread = pthread_create(&made->thread, NULL, listen_to, made) == 0;
        if (!made->has_thread)
            status = groom_fail(diag, GROOM_ENOMEM, "no thread for the control socket");
    }
    if (status != GROOM_OK) {
        control_stop(made);
        return status;
    }
    *control = made;
    return GROOM_OK;
}

/* A check or a backup has nothing that must be saved: it is not waited for. */
static bool end_thread(struct control *control)
{
    struct timespec nap = {0, 10 * 1000000};
    if (write(control->wake[1], "", 1) != 1)
        return false;
    for (int i = 0; i < 100 && atomic_load(&control->busy); i++)
        nanosleep(&nap, NULL);
    if (atomic_load(&control->busy))
        return false;
    pthread_join(control->thread, NULL);
    return true;
}

bool control_stop(struct control *control)
{
    char path[1500];
    if (!control)
        return true;
    if (control->has_thread && !end_thread(control))
        return false;
    if (control->folder) {
        snprintf(path, sizeof path, "%s/" NAME, control->folder);
        unlink(path);
    }
    for (int i = 0; i < 2; i++)
        if (control->wake[i] >= 0)
            close(control->wake[i]);
    if (control->fd >= 0)
        close(control->fd);
    free(control->folder);
    free(control);
    return true;
}

/* --- the other side --------------------------------------------------------------------------- */

static groom_status hear(int fd, void (*say)(void *user, char kind, const char *text), void *user,
                         struct groom_diag *diag)
{
    char line[LINE_SIZE];
    while (read_line(fd, line)) {
        if (line[0] != 'e') {
            say(user, line[0], line[1] ? line + 2 : "");
            continue;
        }
        char *text;
        int status = (int)strtol(line + 2, &text, 10);
        return status == GROOM_OK ? GROOM_OK : groom_fail(diag, (groom_status)status, "%s", text + (*text == ' '));
    }
    return groom_fail(diag, GROOM_EIO, "the daemon ended in the middle");
}

groom_status control_ask(const char *folder, const char *request,
                         void (*say)(void *user, char kind, const char *text), void *user, struct groom_diag *diag)
{
    char line[LINE_SIZE];
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    groom_status status;
    int n = snprintf(line, sizeof line, "%s\n", request);
    if (fd < 0 || with_address(folder, fd, connect) != 0)
        status = groom_fail(diag, GROOM_ENOTFOUND, "no daemon answers in %.300s", folder);
    else if (n >= (int)sizeof line || strchr(request, '\n') || send(fd, line, (size_t)n, MSG_NOSIGNAL) != n)
        status = groom_fail(diag, GROOM_EINVAL, "the daemon cannot be asked for that");
    else
        status = hear(fd, say, user, diag);
    if (fd >= 0)
        close(fd);
    return status;
}
