#include "server/config.h"

#include <ctype.h>
#include <errno.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum type {
    TEXT,
    COUNT, /* a whole number */
    BYTES, /* with K, M, G or T behind it, of 1024 */
    SECONDS,
    LEVEL
};

struct option {
    const char *name, *metavar;
    enum type type;
    size_t offset;
    const char *initial;
    uint64_t minimum, maximum;
    const char *help;
};

#define AT(member) offsetof(struct config, member)
#define ANY        UINT64_MAX

/* clang-format off */
static const struct option options[] = {
    {"data", "DIR", TEXT, AT(data), "groomd-data", 0, 0, "folder of the database and the uploads; is made"},
    {"listen", "HOST:PORT", TEXT, AT(listen), "127.0.0.1:8080", 0, 0,
     "where to listen; port 0 picks a free one; [::1]:8080 for IPv6"},
    {"hosts", "NAMES", TEXT, AT(hosts), "", 0, 0,
     "names that this service has in a proxy, blanks between; localhost and addresses need none"},
    {"cors-origins", "ORIGINS", TEXT, AT(cors), "", 0, 0,
     "other sites whose pages may use the API (https://studio.example), blanks between"},
    {"config", "FILE", TEXT, AT(config), "", 0, 0, "read options from FILE, lines of `name = value`"},
    {"workers", "N", COUNT, AT(workers), "1", 1, 256, "jobs that run at a time"},
    {"worker-threads", "N", COUNT, AT(worker_threads), "0", 0, 1024,
     "threads of a job; 0: the processors shared among the workers"},
    {"worker-memory", "BYTES", BYTES, AT(worker_memory), "0", 0, ANY, "address space of a job; 0: no limit"},
    {"worker", "PATH", TEXT, AT(worker), "", 0, 0, "the groom-worker program; else the one beside groomd"},
    {"launcher", "NAME", TEXT, AT(launcher), "local", 0, 0,
     "where jobs run: local (processes of this machine), slurm (batch jobs of a cluster)"},
    {"work-url", "URL", TEXT, AT(work_url), "", 0, 0, "how workers reach this daemon; else where it listens"},
    {"work-folder", "DIR", TEXT, AT(work_folder), "", 0, 0,
     "the data folder as the cluster's nodes see it; not given: bytes go over HTTP"},
    {"slurm-arguments", "ARGUMENTS", TEXT, AT(slurm_arguments), "", 0, 0,
     "more of sbatch's arguments, blanks between: --partition=hair --qos=low"},
    {"slurm-interval", "SECONDS", SECONDS, AT(slurm_interval_s), "2", 1, 600, "between two squeue while jobs run"},
    {"job-time", "SECONDS", SECONDS, AT(job_time_s), "0", 0, 30 * 86400, "processor time of a job's attempt, after which the job has failed; 0: no limit"},
    {"job-wall", "SECONDS", SECONDS, AT(job_wall_s), "0", 0, 30 * 86400, "the same by the clock; 0: no limit"},
    {"job-attempts", "N", COUNT, AT(job_attempts), "3", 1, 100, "attempts of a job that may die before it has failed"},
    {"max-queue", "N", COUNT, AT(max_queue), "1000", 1, 100000, "jobs that may wait; more are answered 429"},
    {"token-requests", "N", COUNT, AT(token_requests), "0", 0, 1000000, "requests a second of a token that has no limit of its own; 0: any number"},
    {"token-bytes", "BYTES", BYTES, AT(token_bytes), "0", 0, (uint64_t)1 << 52, "bytes of a token's uploads, likewise"},
    {"token-queued", "N", COUNT, AT(token_queued), "0", 0, 100000, "jobs of a token that may wait, likewise"},
    {"session-time", "SECONDS", SECONDS, AT(session_time_s), "28800", 60, 30 * 86400, "how long a browser's session is good"},
    {"max-upload", "BYTES", BYTES, AT(max_upload), "4G", 1024, ANY, "largest body of an upload"},
    {"upload-expiry", "SECONDS", SECONDS, AT(upload_expiry_s), "259200", 60, 365 * 86400,
     "an upload in pieces that nobody used goes so long after its last byte"},
    {"max-body", "BYTES", BYTES, AT(max_body), "1M", 1024, 1 << 30, "largest body of a control message (JSON)"},
    {"min-free", "BYTES", BYTES, AT(min_free), "256M", 0, ANY, "not ready, and no uploads, below this on the disk"},
    {"export-cache", "BYTES", BYTES, AT(export_cache), "1G", 0, ANY, "disk for exports that may be asked for again"},
    {"parse-time", "SECONDS", SECONDS, AT(parse_time_s), "120", 1, 86400, "time to parse or convert one upload"},
    {"parse-memory", "BYTES", BYTES, AT(parse_memory), "16G", 1 << 26, ANY, "address space to parse or convert one upload"},
    {"webhook-url", "URL", TEXT, AT(webhook_url), "", 0, 0, "who is told of every job's end; a job may name one of its own"},
    {"webhook-secret", "SECRET", TEXT, AT(webhook_secret), "", 0, 0, "what those messages are signed with"},
    {"webhook-allow", "NETWORKS", TEXT, AT(webhook_allow), "", 0, 0,
     "private addresses and networks that webhooks may lead to (127.0.0.1 10.0.0.0/8), blanks between"},
    {"webhook-attempts", "N", COUNT, AT(webhook_attempts), "12", 1, 100, "tries of a message before it is given up"},
    {"webhook-timeout", "SECONDS", SECONDS, AT(webhook_timeout_s), "10", 1, 300, "time for one try"},
    {"keep-events", "SECONDS", SECONDS, AT(keep_events_s), "2592000", 0, ANY / 2000,
     "progress events of a job after its end; 0: for ever"},
    {"keep-keys", "SECONDS", SECONDS, AT(keep_keys_s), "604800", 0, ANY / 2000,
     "how long an Idempotency-Key is remembered; 0: for ever"},
    {"keep-jobs", "SECONDS", SECONDS, AT(keep_jobs_s), "0", 0, ANY / 2000,
     "finished jobs; what they made stays; 0: for ever"},
    {"keep-preparations", "SECONDS", SECONDS, AT(keep_preparations_s), "2592000", 0, ANY / 2000,
     "what a retargeting worked out of its strands, after the last job that asked for it; 0: for ever"},
    {"connections", "N", COUNT, AT(connections), "1200", 8, 100000, "open connections"},
    {"idle-timeout", "SECONDS", SECONDS, AT(idle_timeout_s), "60", 1, 3600, "close a connection after so long without a byte"},
    {"head-timeout", "SECONDS", SECONDS, AT(head_timeout_s), "20", 1, 3600, "time for the request line and headers"},
    {"min-rate", "BYTES", BYTES, AT(min_rate), "1K", 0, ANY, "bytes a second below which a body is given up after the head timeout"},
    {"max-wait", "SECONDS", SECONDS, AT(max_wait_s), "300", 0, 3600, "longest `Prefer: wait` that is honoured"},
    {"http-threads", "N", COUNT, AT(http_threads), "2", 1, 64, "threads that move bytes"},
    {"fast-threads", "N", COUNT, AT(fast_threads), "2", 1, 64, "threads that answer from the database"},
    {"slow-threads", "N", COUNT, AT(slow_threads), "2", 1, 64, "threads that parse, convert, export and draw"},
    {"slow-queue", "N", COUNT, AT(slow_queue), "64", 1, 10000, "requests that may wait for those; more are answered 503"},
    {"shutdown-time", "SECONDS", SECONDS, AT(shutdown_s), "8", 1, 600, "time to finish what is under way on SIGTERM"},
    {"log-level", "LEVEL", LEVEL, AT(log_level), "info", 0, 3, "error, warning, info or debug; JSON lines on standard error"},
};
/* clang-format on */
#define N_OPTIONS (sizeof options / sizeof options[0])

static const char *const level_names[] = {"error", "warning", "info", "debug"};

/* --- values ----------------------------------------------------------------------- */

static uint64_t factor_of(const char *suffix)
{
    static const char letters[] = "KMGT";
    const char *found = suffix[0] ? strchr(letters, toupper((unsigned char)suffix[0])) : NULL;
    if (!suffix[0])
        return 1;
    if (!found || (suffix[1] && strcmp(suffix + 1, "B") && strcmp(suffix + 1, "iB")))
        return 0;
    return (uint64_t)1 << (10 * (found - letters + 1));
}

static int parse_number(enum type type, const char *text, uint64_t *value)
{
    char *end;
    errno = 0;
    if (!isdigit((unsigned char)text[0]))
        return 0;
    *value = strtoull(text, &end, 10);
    if (type == SECONDS && !strcmp(end, "s"))
        end++;
    uint64_t factor = type == BYTES ? factor_of(end) : *end == 0;
    if (errno || !factor || *value > UINT64_MAX / factor)
        return 0;
    *value *= factor;
    return 1;
}

static int parse_level(const char *text, uint64_t *value)
{
    for (*value = 0; *value < 4; ++*value)
        if (!strcmp(text, level_names[*value]))
            return 1;
    return 0;
}

static groom_status set_text(struct config *config, const struct option *option, const char *text,
                             const char *where, struct groom_diag *diag)
{
    if (strlen(text) >= CONFIG_TEXT_SIZE)
        return groom_fail(diag, GROOM_EINVAL, "%s: %s is longer than %d bytes", where, option->name,
                          CONFIG_TEXT_SIZE - 1);
    strcpy((char *)config + option->offset, text);
    return GROOM_OK;
}

/* `where` names the place for the message: "--workers", "GROOMD_WORKERS", "groomd.conf:3". */
static groom_status set(struct config *config, const struct option *option, const char *text,
                        const char *where, struct groom_diag *diag)
{
    uint64_t value;
    if (option->type == TEXT)
        return set_text(config, option, text, where, diag);
    if (option->type == LEVEL && !parse_level(text, &value))
        return groom_fail(diag, GROOM_EINVAL, "%s: \"%.60s\" is not error, warning, info or debug", where,
                          text);
    if (option->type != LEVEL && !parse_number(option->type, text, &value))
        return groom_fail(diag, GROOM_EINVAL, "%s: \"%.60s\" is not a %s", where, text,
                          option->type == BYTES     ? "number of bytes (512M, 4G)"
                          : option->type == SECONDS ? "number of seconds"
                                                    : "whole number");
    if (value < option->minimum || value > option->maximum)
        return groom_fail(diag, GROOM_EINVAL, "%s: %.60s is outside %llu..%llu", where, text,
                          (unsigned long long)option->minimum, (unsigned long long)option->maximum);
    memcpy((char *)config + option->offset, &value, sizeof value);
    return GROOM_OK;
}

static const struct option *find(const char *name, size_t n)
{
    for (size_t i = 0; i < N_OPTIONS; i++)
        if (strlen(options[i].name) == n && !strncmp(options[i].name, name, n))
            return &options[i];
    return NULL;
}

/* --- the four places ------------------------------------------------------------------ */

static groom_status take_defaults(struct config *config, struct groom_diag *diag)
{
    for (size_t i = 0; i < N_OPTIONS; i++) {
        groom_status status = set(config, &options[i], options[i].initial, options[i].name, diag);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

static char *trim(char *text)
{
    while (isspace((unsigned char)*text))
        text++;
    size_t n = strlen(text);
    while (n && isspace((unsigned char)text[n - 1]))
        text[--n] = 0;
    return text;
}

static groom_status take_line(struct config *config, char *line, const char *where, struct groom_diag *diag)
{
    line[strcspn(line, "#")] = 0;
    char *name = trim(line);
    if (!*name)
        return GROOM_OK;
    char *value = strchr(name, '=');
    if (!value)
        return groom_fail(diag, GROOM_EINVAL, "%s: expected `name = value`", where);
    *value++ = 0;
    name = trim(name);
    const struct option *option = find(name, strlen(name));
    if (!option || !strcmp(option->name, "config"))
        return groom_fail(diag, GROOM_EINVAL,
                          "%s: \"%.60s\" is not an option of a configuration file; see groomd --help", where,
                          name);
    return set(config, option, trim(value), where, diag);
}

static groom_status take_file(struct config *config, const char *path, struct groom_diag *diag)
{
    char line[2 * CONFIG_TEXT_SIZE], where[160];
    groom_status status = GROOM_OK;
    FILE *file = fopen(path, "re");
    if (!file)
        return groom_fail(diag, GROOM_EINVAL, "the configuration file %.200s cannot be read: %s", path,
                          strerror(errno));
    for (int number = 1; status == GROOM_OK && fgets(line, sizeof line, file); number++) {
        snprintf(where, sizeof where, "%.120s:%d", path, number);
        status = take_line(config, line, where, diag);
    }
    fclose(file);
    return status;
}

/* GROOMD_MAX_UPLOAD for max-upload. */
static void variable_of(const struct option *option, char *variable, size_t capacity)
{
    snprintf(variable, capacity, "GROOMD_%s", option->name);
    for (char *c = variable; *c; c++)
        *c = *c == '-' ? '_' : (char)toupper((unsigned char)*c);
}

static groom_status take_environment(struct config *config, char *const *environment, struct groom_diag *diag)
{
    char variable[64];
    for (size_t i = 0; i < N_OPTIONS; i++) {
        variable_of(&options[i], variable, sizeof variable);
        size_t n = strlen(variable);
        for (char *const *entry = environment; entry && *entry; entry++)
            if (!strncmp(*entry, variable, n) && (*entry)[n] == '=') {
                groom_status status = set(config, &options[i], *entry + n + 1, variable, diag);
                if (status != GROOM_OK)
                    return status;
            }
    }
    return GROOM_OK;
}

/* --name value, --name=value, --help, --version. */
static groom_status take_arguments(struct config *config, int argc, char *const *argv,
                                   enum config_action *action, struct groom_diag *diag)
{
    for (int i = 1; i < argc; i++) {
        const char *argument = argv[i];
        if (!strcmp(argument, "--help") || !strcmp(argument, "-h") || !strcmp(argument, "--version")) {
            *action = argument[2] == 'v' ? CONFIG_VERSION : CONFIG_HELP;
            return GROOM_OK;
        }
        size_t n = strcspn(argument, "=");
        const struct option *option = n > 2 && !strncmp(argument, "--", 2) ? find(argument + 2, n - 2) : NULL;
        if (!option)
            return groom_fail(diag, GROOM_EINVAL, "\"%.60s\" is not an option; see groomd --help", argument);
        const char *value = argument[n] ? argument + n + 1 : ++i < argc ? argv[i] : NULL;
        if (!value)
            return groom_fail(diag, GROOM_EINVAL, "--%s needs a value (%s)", option->name, option->metavar);
        groom_status status = set(config, option, value, argument, diag);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

void config_help(FILE *out)
{
    fputs("usage: groomd [--OPTION VALUE]...\n\n"
          "Turns dense hair strands into procedural grooms, over HTTP. The first line on standard output is\n"
          "`listening on http://HOST:PORT`. SIGTERM and SIGINT finish what is under way and stop.\n\n"
          "Each option is also a line `name = value` of the configuration file and an environment variable\n"
          "(GROOMD_MAX_UPLOAD for --max-upload). The command line wins, then the environment, then the "
          "file.\n\n"
          "       groomd token create|list|revoke   who may use it; see groomd token --help\n"
          "       groomd check            is all of a data folder whole? see groomd check --help\n"
          "       groomd backup FOLDER    a copy to start from, of a daemon that runs or not\n\n",
          out);
    for (size_t i = 0; i < N_OPTIONS; i++) {
        char left[64];
        snprintf(left, sizeof left, "--%s %s", options[i].name, options[i].metavar);
        fprintf(out, "  %-26s %s", left, options[i].help);
        if (options[i].initial[0])
            fprintf(out, " [%s]", options[i].initial);
        fputc('\n', out);
    }
    fputs("  --help, --version\n", out);
}

/* The configuration file is named by the command line or the environment, and read before both. */
groom_status config_load(int argc, char *const *argv, char *const *environment, struct config *config,
                         enum config_action *action, struct groom_diag *diag)
{
    groom_status status;
    struct config named = {0};
    *action = CONFIG_RUN;
    *config = named;
    if ((status = take_defaults(&named, diag)) != GROOM_OK ||
        (status = take_environment(&named, environment, diag)) != GROOM_OK ||
        (status = take_arguments(&named, argc, argv, action, diag)) != GROOM_OK || *action != CONFIG_RUN)
        return status;
    if ((status = take_defaults(config, diag)) != GROOM_OK ||
        (named.config[0] && (status = take_file(config, named.config, diag)) != GROOM_OK) ||
        (status = take_environment(config, environment, diag)) != GROOM_OK)
        return status;
    return take_arguments(config, argc, argv, action, diag);
}
