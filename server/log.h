/* One line of JSON on standard error for what is worth knowing:
 *     {"time":"2026-01-31T12:00:00.250Z","level":"info","message":"...", members}
 * A line that is written while a request is handled carries its id ("request"), one that concerns a job
 * the job's ("job", and "attempt" where there is one).
 * threads   any; a line is written in one piece */
#ifndef SERVER_LOG_H
#define SERVER_LOG_H

#include <stddef.h>
#include <stdint.h>

#include "server/config.h"

void log_set_level(enum config_log_level level);
int log_wants(enum config_log_level level);

/* A message with no members. */
void log_message(enum config_log_level level, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* The same with members, which are JSON already: "\"job\":\"job_…\",\"attempt\":2". */
void log_members(enum config_log_level level, const char *message, const char *members);
/* A message about a job, and about one of its attempts (0: none). format: more members, or NULL. */
void log_job(enum config_log_level level, const char *message, const char *job_id, uint32_t attempt, const char *format,
             ...) __attribute__((format(printf, 5, 6)));
/* The same of "job_….2", as launchers name attempts. */
void log_attempt(enum config_log_level level, const char *message, const char *name);

/* text as the inside of a JSON string, cut where it does not fit; returns `out`. */
const char *log_escape(const char *text, char *out, size_t capacity);

#endif
