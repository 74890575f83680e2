/* What a daemon can be told: one table of name, type, default and help drives the command line
 * (--max-upload 4G), the environment (GROOMD_MAX_UPLOAD), the configuration file
 * (max-upload = 4G) and --help. The command line wins over the environment, the environment over
 * the file, the file over the defaults. */
#ifndef SERVER_CONFIG_H
#define SERVER_CONFIG_H

#include <stdint.h>
#include <stdio.h>

#include "groom/diag.h"

#define CONFIG_TEXT_SIZE 1024

enum config_log_level { CONFIG_LOG_ERROR, CONFIG_LOG_WARNING, CONFIG_LOG_INFO, CONFIG_LOG_DEBUG };

struct config {
    /* texts; "" where not given */
    char data[CONFIG_TEXT_SIZE];   /* folder of database and blobs */
    char listen[CONFIG_TEXT_SIZE]; /* HOST:PORT */
    char worker[CONFIG_TEXT_SIZE]; /* path of groom-worker; "": beside groomd */
    char launcher[CONFIG_TEXT_SIZE];
    char work_url[CONFIG_TEXT_SIZE], work_folder[CONFIG_TEXT_SIZE], slurm_arguments[CONFIG_TEXT_SIZE];
    char hosts[CONFIG_TEXT_SIZE];  /* names of this service, blanks between */
    char cors[CONFIG_TEXT_SIZE];   /* origins whose pages may use the API, blanks between */
    char config[CONFIG_TEXT_SIZE]; /* the configuration file */
    char webhook_url[CONFIG_TEXT_SIZE], webhook_secret[CONFIG_TEXT_SIZE];
    char webhook_allow[CONFIG_TEXT_SIZE]; /* addresses and networks, blanks between */
    /* counts, bytes, seconds */
    uint64_t workers, worker_threads, worker_memory, job_time_s, job_wall_s, job_attempts;
    uint64_t token_requests, token_bytes, token_queued, max_queue, session_time_s;
    uint64_t max_upload, upload_expiry_s, max_body, min_free, export_cache;
    uint64_t http_threads, fast_threads, slow_threads, slow_queue;
    uint64_t connections, idle_timeout_s, head_timeout_s, min_rate;
    uint64_t slurm_interval_s;
    uint64_t parse_time_s, parse_memory;
    uint64_t webhook_attempts, webhook_timeout_s;
    uint64_t keep_events_s, keep_keys_s, keep_jobs_s, keep_preparations_s;
    uint64_t max_wait_s, shutdown_s;
    uint64_t log_level; /* enum config_log_level */
};

enum config_action {
    CONFIG_RUN,
    CONFIG_HELP, /* config_help was asked for */
    CONFIG_VERSION
};

/* Fill `config` from all four places.
 * environment  "NAME=value" strings, NULL-terminated
 * returns  GROOM_OK; GROOM_EINVAL with a detail that names the place and the option */
GROOM_MUST_CHECK groom_status config_load(int argc, char *const *argv, char *const *environment,
                                          struct config *config, enum config_action *action,
                                          struct groom_diag *diag);

void config_help(FILE *out);

#endif
