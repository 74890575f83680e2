#include "server/upkeep/command.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/config.h"
#include "server/upkeep/control.h"

#define MAX_ARGUMENTS 64
#define PATH_SIZE     1500

static const char usage[] =
    "usage: groomd check [--data DIR]\n"
    "       groomd backup [--copy] FOLDER [--data DIR]\n\n"
    "Of a data folder, whether a daemon runs on it or not.\n\n"
    "check    reads everything: the database's pages and references, each blob against its hash, uploads under\n"
    "         way. Prints what is wrong; exit status 1 where there is anything. It changes nothing.\n"
    "backup   writes a new FOLDER that groomd can be started on (--data FOLDER), one state of things, while the\n"
    "         daemon goes on. Blobs never change: on the same file system they are linked.\n"
    "  --copy  copies all bytes, and verifies them\n"
    "  --data  the data folder; it may also come from the configuration file or GROOMD_DATA\n";

struct command {
    const char *name, *to; /* to: the folder of a backup */
    bool copy;
    struct config config;
    uint64_t n_problems;
};

static void print_line(void *user, char kind, const char *text)
{
    struct command *command = user;
    command->n_problems += kind == 'p';
    printf("%s%s\n", kind == 'p' ? "problem: " : kind == 'n' ? "note: " : "", text);
    fflush(stdout);
}

/* --- arguments ------------------------------------------------------------------------------ */

/* Our own here; what is left is the daemon's. returns  false where `usage` is the answer */
static bool take_arguments(struct command *command, int argc, char **argv, char *const *environment,
                           struct groom_diag *diag)
{
    char *rest[MAX_ARGUMENTS + 1] = {argv[0]};
    int n_rest = 1;
    enum config_action action;
    for (int i = 1; i < argc && n_rest < MAX_ARGUMENTS; i++) {
        if (!strcmp(argv[i], "--copy"))
            command->copy = true;
        else if (argv[i][0] != '-' && !command->to && !strcmp(command->name, "backup"))
            command->to = argv[i];
        else {
            rest[n_rest++] = argv[i];
            if (argv[i][0] == '-' && !strchr(argv[i], '=') && i + 1 < argc && strcmp(argv[i], "--help") &&
                strcmp(argv[i], "-h"))
                rest[n_rest++] = argv[++i];
        }
    }
    rest[n_rest] = NULL;
    if (config_load(n_rest, rest, environment, &command->config, &action, diag) != GROOM_OK)
        return false;
    return action == CONFIG_RUN && (command->to != NULL) == !strcmp(command->name, "backup");
}

/* --- by ourselves ----------------------------------------------------------------------------- */

/* Nobody else may have the folder: the lock of a daemon that runs is held. */
static groom_status lock_folder(const char *folder, int *fd, struct groom_diag *diag)
{
    char path[PATH_SIZE];
    if (!store_is_in(folder))
        return groom_fail(diag, GROOM_ENOTFOUND, "%.300s is no data folder: %s", folder, strerror(errno));
    snprintf(path, sizeof path, "%s/lock", folder);
    *fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (*fd < 0)
        return groom_fail(diag, GROOM_EIO, "%.300s: %s", path, strerror(errno));
    if (flock(*fd, LOCK_EX | LOCK_NB) != 0)
        return groom_fail(diag, GROOM_ECONFLICT, "a groomd works on %.300s and does not answer", folder);
    snprintf(path, sizeof path, "%s/tmp", folder);
    if (mkdir(path, 0700) != 0 && errno != EEXIST)
        return groom_fail(diag, GROOM_EIO, "%.300s: %s", path, strerror(errno));
    return GROOM_OK;
}

static groom_status run_here(struct command *command, const char *to, struct groom_diag *diag)
{
    char path[PATH_SIZE];
    struct blobs *blobs = NULL;
    int fd = -1;
    uint64_t n_problems = 0;
    groom_status status = lock_folder(command->config.data, &fd, diag);
    snprintf(path, sizeof path, "%s/blobs", command->config.data);
    if (status == GROOM_OK && (status = blobs_open(path, NULL, &blobs, diag)) == GROOM_OK) {
        const struct upkeep upkeep = {
            .folder = command->config.data, .blobs = blobs, .say = print_line, .user = command};
        status = to ? upkeep_backup(&upkeep, to, command->copy, diag) : upkeep_check(&upkeep, &n_problems, diag);
    }
    blobs_close(blobs);
    if (fd >= 0)
        close(fd);
    return status;
}

/* --- either way ---------------------------------------------------------------------------------- */

static groom_status absolute(const char *path, char full[PATH_SIZE], struct groom_diag *diag)
{
    char here[1024] = "";
    if (path[0] != '/' && !getcwd(here, sizeof here))
        return groom_fail(diag, GROOM_EIO, "the present folder is not known: %s", strerror(errno));
    int n = snprintf(full, PATH_SIZE, "%s%s%s", here, here[0] ? "/" : "", path);
    while (n > 1 && full[n - 1] == '/')
        full[--n] = 0;
    return n < PATH_SIZE - 64 ? GROOM_OK : groom_fail(diag, GROOM_EINVAL, "the name of the folder is too long");
}

static groom_status run(struct command *command, struct groom_diag *diag)
{
    char to[PATH_SIZE] = "", request[PATH_SIZE + 32] = "check";
    groom_status status = GROOM_OK;
    if (command->to) {
        status = absolute(command->to, to, diag);
        snprintf(request, sizeof request, "%s %s", command->copy ? "backup-copy" : "backup", to);
    }
    if (status == GROOM_OK)
        status = control_ask(command->config.data, request, print_line, command, diag);
    return status == GROOM_ENOTFOUND ? run_here(command, command->to ? to : NULL, diag) : status;
}

int upkeep_command(int argc, char **argv, char *const *environment)
{
    static struct command command;
    struct groom_diag diag = {0};
    command = (struct command){.name = argv[0]};
    for (int i = 1; i < argc; i++)
        if (!strcmp(argv[i], "--help") || !strcmp(argv[i], "-h"))
            return fputs(usage, stdout), 0;
    if (!take_arguments(&command, argc, argv, environment, &diag)) {
        fprintf(stderr, "%s%s%s", diag.detail[0] ? "groomd: " : "", diag.detail, diag.detail[0] ? "\n" : usage);
        return 2;
    }
    groom_status status = run(&command, &diag);
    if (status != GROOM_OK)
        fprintf(stderr, "groomd %s: %s\n", argv[0], diag.status == status ? diag.detail : groom_status_message(status));
    return status == GROOM_OK && command.n_problems == 0 ? 0 : 1;
}
