#include "server/log.h"

#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "server/actor.h"

static atomic_int wanted = CONFIG_LOG_WARNING; /* until it is told */
static const char *const names[] = {"error", "warning", "info", "debug"};

void log_set_level(enum config_log_level level) { atomic_store(&wanted, (int)level); }
int log_wants(enum config_log_level level) { return (int)level <= atomic_load(&wanted); }

const char *log_escape(const char *text, char *out, size_t capacity)
{
    size_t n = 0;
    for (; *text && n + 7 < capacity; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\') {
            out[n++] = '\\';
            out[n++] = (char)c;
        } else if (c < 0x20 || c == 0x7f) {
            n += (size_t)snprintf(out + n, capacity - n, "\\u%04x", c);
        } else {
            out[n++] = (char)c;
        }
    }
    out[n] = 0;
    return out;
}

static void time_text(char out[32])
{
    struct timespec now;
    struct tm utc;
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    size_t n = strftime(out, 32, "%Y-%m-%dT%H:%M:%S", &utc);
    snprintf(out + n, 32 - n, ".%03ldZ", now.tv_nsec / 1000000);
}

void log_members(enum config_log_level level, const char *message, const char *members)
{
    char line[4096], when[32], escaped[1600], request[48] = "";
    const struct actor *actor = actor_get();
    if (!log_wants(level))
        return;
    time_text(when);
    if (actor->request[0])
        snprintf(request, sizeof request, ",\"request\":\"%s\"", actor->request);
    int n = snprintf(line, sizeof line - 1, "{\"time\":\"%s\",\"level\":\"%s\",\"message\":\"%s\"%s%s%.2000s}", when,
                     names[level], log_escape(message, escaped, sizeof escaped), request, members[0] ? "," : "",
                     members);
    line[n++] = '\n';
    ssize_t written = write(STDERR_FILENO, line, (size_t)n);
    (void)written; /* there is nowhere left to say that the log is full */
}

void log_message(enum config_log_level level, const char *format, ...)
{
    char message[1024];
    va_list arguments;
    if (!log_wants(level))
        return;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    log_members(level, message, "");
}

void log_job(enum config_log_level level, const char *message, const char *job_id, uint32_t attempt, const char *format,
             ...)
{
    char members[2000];
    va_list arguments;
    if (!log_wants(level))
        return;
    int n = snprintf(members, sizeof members, "\"job\":\"%.40s\"", job_id);
    if (attempt)
        n += snprintf(members + n, sizeof members - (size_t)n, ",\"attempt\":%u", attempt);
    if (format) {
        members[n++] = ',';
        va_start(arguments, format);
        vsnprintf(members + n, sizeof members - (size_t)n, format, arguments);
        va_end(arguments);
    }
    log_members(level, message, members);
}

void log_attempt(enum config_log_level level, const char *message, const char *name)
{
    char job_id[41];
    const char *dot = strrchr(name, '.');
    snprintf(job_id, sizeof job_id, "%.*s", dot && dot - name < 40 ? (int)(dot - name) : 40, name);
    log_job(level, message, job_id, dot ? (uint32_t)strtoul(dot + 1, NULL, 10) : 0, NULL);
}
