#include "server/launch/slurm_commands.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/launch/child.h"

#define MAX_ARGUMENTS 64

/* Limits as words of ulimit, then the worker. Slurm counts how often it has started a job again. */
static const char batch_script[] = "#!/bin/sh\n"
                                   "# One attempt of one job of groomd; see groomd --launcher slurm.\n"
                                   "ulimit -c 0\n"
                                   "ulimit -v \"$1\" && ulimit -t \"$2\" && ulimit -f \"$3\" || exit 1\n"
                                   "shift 3\n"
                                   "GROOM_WORK_RUN=${SLURM_RESTART_COUNT:-0}\n"
                                   "export GROOM_WORK_RUN\n"
                                   "exec \"$@\"\n";

/* --- lists of strings ------------------------------------------------------------------- */

static void strings_destroy(char **strings)
{
    for (char **at = strings; at && *at; at++)
        free(*at);
    free(strings);
}

static char **strings_copy(const char *const *strings)
{
    size_t n = 0;
    while (strings && strings[n])
        n++;
    char **copy = calloc(n + 1, sizeof *copy);
    for (size_t i = 0; copy && i < n; i++)
        if (!(copy[i] = strdup(strings[i]))) {
            strings_destroy(copy);
            return NULL;
        }
    return copy;
}

static char **strings_split(const char *text)
{
    char *copy = strdup(text ? text : ""), *rest = NULL;
    const char *words[MAX_ARGUMENTS + 1] = {NULL};
    size_t n = 0;
    for (char *word = copy ? strtok_r(copy, " \t", &rest) : NULL; word && n < MAX_ARGUMENTS;
         word = strtok_r(NULL, " \t", &rest))
        words[n++] = word;
    char **strings = copy ? strings_copy(words) : NULL;
    free(copy);
    return strings;
}

struct slurm_order *slurm_order_copy(const struct launch_spec *spec)
{
    struct slurm_order *order = calloc(1, sizeof *order);
    if (!order)
        return NULL;
    order->argv = strings_copy(spec->argv);
    order->env = strings_copy(spec->env);
    order->limits = spec->limits;
    order->size = spec->size;
    int n = snprintf(order->log_path, sizeof order->log_path, "%s", spec->log_path ? spec->log_path : "");
    if (order->argv && order->env && n < (int)sizeof order->log_path)
        return order;
    slurm_order_destroy(order);
    return NULL;
}

void slurm_order_destroy(struct slurm_order *order)
{
    if (!order)
        return;
    strings_destroy(order->argv);
    strings_destroy(order->env);
    free(order);
}

/* --- finding the programs ------------------------------------------------------------------ */

static char *find_program(const char *path, const char *name)
{
    char file[1024];
    for (const char *at = path; *at;) {
        size_t n = strcspn(at, ":");
        if (n > 0 && n < sizeof file - 32) {
            snprintf(file, sizeof file, "%.*s/%s", (int)n, at, name);
            if (access(file, X_OK) == 0)
                return strdup(file);
        }
        at += n + (at[n] == ':');
    }
    return NULL;
}

/* Of the daemon's environment Slurm's programs get what is theirs: no secret of ours goes with it. */
static char **choose_env(const char *path)
{
    static const char *const wanted[] = {"SLURM_", "HOME=", "USER=", "LOGNAME=", "TMPDIR=", "TZ="};
    const char *chosen[MAX_ARGUMENTS + 1] = {NULL};
    char path_entry[4096];
    size_t n = 0;
    snprintf(path_entry, sizeof path_entry, "PATH=%s", path);
    chosen[n++] = path_entry;
    for (char **entry = environ; entry && *entry; entry++)
        for (size_t i = 0; i < sizeof wanted / sizeof wanted[0] && n < MAX_ARGUMENTS; i++)
            if (!strncmp(*entry, wanted[i], strlen(wanted[i])))
                chosen[n++] = *entry;
    return strings_copy(chosen);
}

static groom_status write_script(const char *path, struct groom_diag *diag)
{
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0700);
    ssize_t n = fd < 0 ? -1 : write(fd, batch_script, sizeof batch_script - 1);
    int error = errno;
    if (fd >= 0)
        close(fd);
    if (n == (ssize_t)sizeof batch_script - 1)
        return GROOM_OK;
    return groom_fail(diag, GROOM_EIO, "the batch script %.200s cannot be written: %s", path, strerror(error));
}

groom_status slurm_commands_init(const struct launch_slurm_options *options, struct slurm_commands *commands,
                                 struct groom_diag *diag)
{
    static const char *const names[] = {"sbatch", "squeue", "scancel"};
    const char *path = options->path ? options->path : getenv("PATH") ? getenv("PATH") : "/usr/bin:/bin";
    char script[1024];
    commands->wall_ms = options->wall_ms ? options->wall_ms : 15000;
    char **places[] = {&commands->sbatch, &commands->squeue, &commands->scancel};
    for (size_t i = 0; i < 3; i++)
        if (!(*places[i] = find_program(path, names[i])))
            return groom_fail(diag, GROOM_EINVAL,
                              "Slurm's program %s is not in PATH; install Slurm's client programs on this machine",
                              names[i]);
    snprintf(script, sizeof script, "%.900s/slurm-attempt.sh", options->folder);
    commands->script = strdup(script);
    commands->log_folder = strdup(options->log_folder ? options->log_folder : "");
    commands->arguments = strings_split(options->arguments);
    commands->env = choose_env(path);
    if (!commands->script || !commands->log_folder || !commands->arguments || !commands->env)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the launcher");
    return write_script(script, diag);
}

void slurm_commands_finish(struct slurm_commands *commands)
{
    free(commands->sbatch);
    free(commands->squeue);
    free(commands->scancel);
    free(commands->script);
    free(commands->log_folder);
    strings_destroy(commands->arguments);
    strings_destroy(commands->env);
    memset(commands, 0, sizeof *commands);
}

/* --- running one ------------------------------------------------------------------------------ */

/* The last line that it said, for people. */
static void last_line(const char *words, char *line, size_t size)
{
    size_t n = strlen(words);
    while (n > 0 && (words[n - 1] == '\n' || words[n - 1] == ' '))
        n--;
    size_t from = n;
    while (from > 0 && words[from - 1] != '\n')
        from--;
    snprintf(line, size, "%.*s", (int)(n - from), words + from);
}

/* returns  GROOM_OK (exit status 0), GROOM_EIO (no answer in time, or it could not be run),
 *          GROOM_EINVAL (it said no: diag has its last line, *words all of them) */
static groom_status run(struct slurm_commands *commands, const char *const *argv, const char *const *env,
                        struct child_result *result, struct groom_diag *diag)
{
    const struct child_spec spec = {.argv = argv, .env = env, .stdin_fd = -1, .stdout_fd = -1,
                                    .max_output = 16u << 20, .wall_ms = commands->wall_ms,
                                    .give_up = &commands->give_up};
    const char *slash = strrchr(argv[0], '/'), *name = slash ? slash + 1 : argv[0];
    char line[256];
    if (child_run(&spec, result, diag) != GROOM_OK)
        return GROOM_EIO;
    if (result->timed_out)
        return groom_fail(diag, GROOM_EIO, "%s did not answer within %u ms", name, commands->wall_ms);
    if (result->exit_status == 0)
        return GROOM_OK;
    last_line(result->words, line, sizeof line);
    if (result->signal)
        return groom_fail(diag, GROOM_EIO, "%s ended with signal %d", name, result->signal);
    return groom_fail(diag, GROOM_EINVAL, "%s", line[0] ? line : name);
}

/* --- sbatch ------------------------------------------------------------------------------------- */

/* What sbatch says where it is the cluster's fault and not the job's. */
static bool is_passing(const char *words)
{
    static const char *const passing[] = {"Unable to contact", "Socket timed out", "Transport endpoint",
                                          "Connection refused", "Connection timed out", "Zero Bytes",
                                          "temporarily", "Slurm backup controller in standby",
                                          "Protocol authentication error", "Munge", "Slurm temporarily unable",
                                          "Resource temporarily unavailable", "Unexpected message received",
                                          "Communication connection failure", "AssocMaxSubmitJobLimit",
                                          "QOSMaxSubmitJobPerUserLimit", "Too many open files"};
    for (size_t i = 0; i < sizeof passing / sizeof passing[0]; i++)
        if (strstr(words, passing[i]))
            return true;
    return false;
}

struct argument_list {
    const char *items[2 * MAX_ARGUMENTS + 64];
    size_t n;
    char text[24][1280];
    size_t n_text;
};

static void add(struct argument_list *list, const char *argument)
{
    if (list->n + 1 < sizeof list->items / sizeof list->items[0])
        list->items[list->n++] = argument;
}

static __attribute__((format(printf, 2, 3))) void add_format(struct argument_list *list, const char *format, ...)
{
    char *text = list->text[list->n_text++];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof list->text[0], format, values);
    va_end(values);
    add(list, text);
}

static void add_names(struct argument_list *list, char *const *env)
{
    char names[1200] = "";
    size_t n = 0;
    for (char *const *entry = env; *entry; entry++) {
        int length = (int)strcspn(*entry, "=");
        if (n + (size_t)length + 2 < sizeof names)
            n += (size_t)snprintf(names + n, sizeof names - n, "%s%.*s", n ? "," : "", length, *entry);
    }
    add_format(list, "--export=%s", names);
}

static void add_size(struct argument_list *list, const struct launch_size *size)
{
    const uint64_t mib = 1u << 20;
    if (size->threads)
        add_format(list, "--cpus-per-task=%u", size->threads);
    if (size->memory_bytes)
        add_format(list, "--mem=%lluM", (unsigned long long)((size->memory_bytes + mib - 1) / mib));
    if (size->wall_s) /* whole minutes; the worker is told half a minute ahead and saves what it has */
        add_format(list, "--time=%llu", (unsigned long long)(size->wall_s / 60 + 1));
}

static void add_limit(struct argument_list *list, uint64_t value, uint64_t unit)
{
    if (value == 0)
        add(list, "unlimited");
    else
        add_format(list, "%llu", (unsigned long long)(value / unit));
}

static void add_order(struct argument_list *list, const struct slurm_commands *commands, const char *name,
                      const struct slurm_order *order)
{
    const char *slash = strrchr(order->log_path, '/');
    add_format(list, "--job-name=%s", name);
    if (commands->log_folder[0])
        add_format(list, "--output=%s/%s", commands->log_folder, slash ? slash + 1 : order->log_path);
    else
        add(list, "--output=/dev/null");
    add_names(list, order->env);
    add_size(list, &order->size);
    for (char *const *more = commands->arguments; *more; more++)
        add(list, *more);
    add(list, commands->script);
    add_limit(list, order->limits.memory_bytes, 1024);
    add_limit(list, order->limits.cpu_s, 1);
    add_limit(list, order->limits.file_bytes, 512);
    for (char *const *word = order->argv; *word; word++)
        add(list, *word);
    add(list, NULL);
}

/* sbatch takes what --export names from its own environment: no token stands in a list of processes. */
static const char **join_env(char *const *first, char *const *second)
{
    size_t n = 0, k = 0;
    while (first[n])
        n++;
    while (second[k])
        k++;
    const char **joined = calloc(n + k + 1, sizeof *joined);
    for (size_t i = 0; joined && i < n + k; i++)
        joined[i] = i < n ? first[i] : second[i - n];
    return joined;
}

groom_status slurm_submit(struct slurm_commands *commands, const char *name, const struct slurm_order *order,
                          struct groom_diag *diag)
{
    /* singleton: where it is not known whether a job of this name was accepted, a second one is harmless */
    static const char *const always[] = {"--parsable", "--quiet", "--requeue", "--dependency=singleton",
                                         "--comment=groomd", "--chdir=/", "--open-mode=append", "--ntasks=1",
                                         "--nodes=1", "--signal=B:TERM@30"};
    struct argument_list *list = calloc(1, sizeof *list);
    const char **env = join_env(commands->env, order->env);
    struct child_result result = {0};
    groom_status status = GROOM_ECANCELLED;
    if (list && env) {
        add(list, commands->sbatch);
        for (size_t i = 0; i < sizeof always / sizeof always[0]; i++)
            add(list, always[i]);
        add_order(list, commands, name, order);
        status = run(commands, list->items, env, &result, diag);
        if (status == GROOM_EINVAL && is_passing(result.words))
            status = GROOM_ECANCELLED;
    }
    child_result_finish(&result);
    free(list);
    free(env);
    return status;
}

/* --- squeue -------------------------------------------------------------------------------------- */

bool slurm_row_lives(const struct slurm_row *row)
{
    static const char *const ended[] = {"BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL",
                                        "OUT_OF_MEMORY", "PREEMPTED", "REVOKED", "TIMEOUT"};
    for (size_t i = 0; i < sizeof ended / sizeof ended[0]; i++)
        if (!strcmp(row->state, ended[i]))
            return false;
    return true;
}

/* "name|state|exit|node|id|reason|" */
static bool read_row(char *line, struct slurm_row *row)
{
    char exit_code[24] = "0";
    struct {
        char *text;
        size_t size;
    } fields[] = {{row->name, sizeof row->name}, {row->state, sizeof row->state},
                  {exit_code, sizeof exit_code}, {row->node, sizeof row->node},
                  {row->id, sizeof row->id},     {row->reason, sizeof row->reason}};
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        char *bar = strchr(line, '|');
        if (!bar)
            return false;
        *bar = 0;
        snprintf(fields[i].text, fields[i].size, "%s", line);
        line = bar + 1;
    }
    row->exit_code = atoi(exit_code);
    return row->state[0] != 0;
}

static groom_status read_rows(char *text, struct slurm_rows *rows, struct groom_diag *diag)
{
    char *rest = NULL;
    for (char *line = strtok_r(text, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
        struct slurm_row *more = realloc(rows->items, (rows->n + 1) * sizeof *more);
        if (!more)
            return groom_fail(diag, GROOM_ENOMEM, "no memory for the list of Slurm's jobs");
        rows->items = more;
        rows->n += read_row(line, &rows->items[rows->n]);
    }
    return GROOM_OK;
}

groom_status slurm_list(struct slurm_commands *commands, const char *names, struct slurm_rows *rows,
                        struct groom_diag *diag)
{
    struct child_result result = {0};
    char *filter = NULL;
    if (names && asprintf(&filter, "--name=%s", names) < 0)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to ask squeue");
    const char *argv[] = {commands->squeue, "--noheader", "--me", "--states=all",
                          "--Format=Name:|,State:|,exit_code:|,BatchHost:|,JobID:|,Reason:|", filter, NULL};
    *rows = (struct slurm_rows){0};
    groom_status status = run(commands, argv, (const char *const *)commands->env, &result, diag);
    if (status == GROOM_OK && result.output)
        status = read_rows(result.output, rows, diag);
    child_result_finish(&result);
    free(filter);
    if (status != GROOM_OK) {
        free(rows->items);
        *rows = (struct slurm_rows){0};
    }
    return status;
}

/* --- scancel ----------------------------------------------------------------------------------------- */

groom_status slurm_cancel(struct slurm_commands *commands, const char *name, enum launch_stop how,
                          struct groom_diag *diag)
{
    char job_name[SLURM_NAME_SIZE + 16];
    snprintf(job_name, sizeof job_name, "--name=%s", name);
    const char *signal_it[] = {commands->scancel, "--quiet", "--me", "--full",
                               how == LAUNCH_KILL ? "--signal=KILL" : "--signal=TERM", job_name, NULL};
    /* one that waits has no process yet; one that was killed must not come back */
    const char *cancel_it[] = {commands->scancel, "--quiet", "--me", job_name,
                               how == LAUNCH_KILL ? NULL : "--state=PENDING", NULL};
    const char *const *steps[] = {signal_it, cancel_it};
    groom_status status = GROOM_OK;
    for (int i = 0; i < 2 && status == GROOM_OK; i++) {
        struct child_result result = {0};
        status = run(commands, steps[i], (const char *const *)commands->env, &result, diag);
        child_result_finish(&result);
    }
    return status;
}
