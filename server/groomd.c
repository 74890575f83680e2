/* groomd: the daemon. It owns the database and the uploads, answers over HTTP, and launches
 * groom-worker processes for all that parses untrusted bytes or computes for long.
 *
 * This file puts the rooms together and takes them apart in the reverse order:
 *   folder and lock, listening socket, blobs, store, jobs, grooms, supervisor, server. */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "proto/work.h"
#include "proto/json_text.h"
#include "server/access/access.h"
#include "server/access/command.h"
#include "server/actor.h"
#include "server/blobs/blobs.h"
#include "server/config.h"
#include "server/grooms/grooms.h"
#include "server/housekeeper.h"
#include "server/http/handlers.h"
#include "server/http/server.h"
#include "server/jobs/supervisor.h"
#include "server/launch/launch.h"
#include "server/listen.h"
#include "server/log.h"
#include "server/uploads/uploads.h"
#include "server/upkeep/command.h"
#include "server/upkeep/control.h"
#include "server/webhooks/webhooks.h"

#define PATH_SIZE 1400

struct daemon {
    struct config config;
    int lock_fd;
    char worker[PATH_SIZE], temporary[PATH_SIZE], logs[PATH_SIZE], node_logs[PATH_SIZE], threads[48];
    const char *worker_argv[4], *worker_env[3];
    struct listening listening;
    struct access *access;
    struct blobs *blobs;
    struct store *store;
    struct uploads *uploads;
    struct jobs *jobs;
    struct groom_pool *pool;
    struct grooms *grooms;
    struct launcher *launcher;
    struct supervisor *supervisor;
    struct housekeeper *housekeeper;
    struct control *control;
    struct webhooks *webhooks;
    struct service service;
    struct server *server;
};

/* --- the folder ------------------------------------------------------------------------ */

static groom_status make_folder(const char *path, struct groom_diag *diag)
{
    if (mkdir(path, 0700) == 0 || errno == EEXIST)
        return GROOM_OK;
    return groom_fail(diag, GROOM_EIO, "the folder %.200s cannot be made: %s", path, strerror(errno));
}

/* One daemon for one folder: the lock goes with the process, however that ends. */
static groom_status lock_folder(struct daemon *daemon, struct groom_diag *diag)
{
    char path[PATH_SIZE], pid[32];
    snprintf(path, sizeof path, "%s/lock", daemon->config.data);
    daemon->lock_fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (daemon->lock_fd < 0)
        return groom_fail(diag, GROOM_EIO, "%.200s cannot be opened: %s", path, strerror(errno));
    if (flock(daemon->lock_fd, LOCK_EX | LOCK_NB))
        return groom_fail(diag, GROOM_ECONFLICT,
                          "another groomd works on %.200s; stop it, or name another folder with --data",
                          daemon->config.data);
    int n = snprintf(pid, sizeof pid, "%ld\n", (long)getpid());
    if (ftruncate(daemon->lock_fd, 0) || write(daemon->lock_fd, pid, (size_t)n) != n)
        log_message(CONFIG_LOG_WARNING, "the process id could not be noted in %s", path);
    return GROOM_OK;
}

static groom_status open_folder(struct daemon *daemon, struct groom_diag *diag)
{
    groom_status status;
    snprintf(daemon->temporary, sizeof daemon->temporary, "%s/tmp", daemon->config.data);
    snprintf(daemon->logs, sizeof daemon->logs, "%s/logs", daemon->config.data);
    if ((status = make_folder(daemon->config.data, diag)) != GROOM_OK ||
        (status = lock_folder(daemon, diag)) != GROOM_OK ||
        (status = make_folder(daemon->temporary, diag)) != GROOM_OK)
        return status;
    return make_folder(daemon->logs, diag);
}

/* --- tokens ---------------------------------------------------------------------------------- */

/* Tokens are made and revoked by another process, on the file; the audit hears of it here. */
static void on_token(void *user, const char *action, const struct access_token *token)
{
    const struct daemon *daemon = user;
    const struct actor before = *actor_get(), keeper = {.name = "groomd token"};
    char members[160];
    snprintf(members, sizeof members, "\"token\":\"%s\",\"project\":\"%s\"", token->id, token->project);
    log_members(CONFIG_LOG_INFO, action, members);
    if (!daemon->store) /* while it starts */
        return;
    actor_set(&keeper);
    if (store_audit_add(daemon->store, token->project, action, token->id, token->name, NULL) != GROOM_OK)
        log_members(CONFIG_LOG_ERROR, "the audit could not be written", members);
    actor_set(&before);
}

static groom_status open_access(struct daemon *daemon, struct groom_diag *diag)
{
    const struct config *config = &daemon->config;
    const struct access_options options = {
        .folder = config->data,
        .defaults = {config->token_requests, config->token_bytes, config->token_queued},
        .changed = on_token,
        .user = daemon};
    return access_open(&options, &daemon->access, diag);
}

/* --- the worker program ------------------------------------------------------------------- */

static groom_status find_worker(struct daemon *daemon, struct groom_diag *diag)
{
    char *slash;
    if (daemon->config.worker[0]) {
        snprintf(daemon->worker, sizeof daemon->worker, "%s", daemon->config.worker);
    } else {
        ssize_t n = readlink("/proc/self/exe", daemon->worker, sizeof daemon->worker - 32);
        daemon->worker[n > 0 ? n : 0] = 0;
        if (!(slash = strrchr(daemon->worker, '/')))
            return groom_fail(diag, GROOM_EIO,
                              "the place of groomd is not known; name groom-worker with --worker");
        strcpy(slash + 1, "groom-worker");
    }
    if (access(daemon->worker, X_OK))
        return groom_fail(diag, GROOM_EINVAL, "groom-worker is not at %.200s (%s); name it with --worker",
                          daemon->worker, strerror(errno));
    return GROOM_OK;
}

/* Workers share the processors of this machine. */
static void choose_threads(struct daemon *daemon)
{
    const struct config *config = &daemon->config;
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    unsigned long long threads = config->worker_threads;
    if (!threads)
        threads = processors > (long)config->workers ? (unsigned long long)processors / config->workers : 1;
    snprintf(daemon->threads, sizeof daemon->threads, "GROOM_WORK_THREADS=%llu", threads);
    daemon->worker_env[0] = daemon->threads;
}

/* A daemon of a cluster may be away for a while without its workers giving up. */
static groom_status create_launcher(struct daemon *daemon, struct groom_diag *diag)
{
    const struct config *config = &daemon->config;
    daemon->worker_argv[0] = daemon->worker;
    daemon->worker_argv[1] = "attempt";
    /* libgroom multiplies in threads of its own; OpenBLAS's would each take 128 MiB of the job's address space */
    daemon->worker_env[1] = "OPENBLAS_NUM_THREADS=1";
    if (!strcmp(config->launcher, "local")) {
        choose_threads(daemon);
        return launch_local_create(&daemon->launcher, diag);
    }
    if (strcmp(config->launcher, "slurm"))
        return groom_fail(diag, GROOM_EINVAL, "--launcher %.60s: there are local and slurm", config->launcher);
    daemon->worker_argv[2] = "--watched";
    daemon->worker_env[0] = WORK_ENV_PATIENCE "=900";
    if (config->work_folder[0] && config->work_folder[0] != '/')
        return groom_fail(diag, GROOM_EINVAL, "--work-folder %.60s: name the whole path", config->work_folder);
    if (config->work_folder[0]) {
        snprintf(daemon->node_logs, sizeof daemon->node_logs, "%.1000s/logs", config->work_folder);
        char blobs[PATH_SIZE];
        snprintf(blobs, sizeof blobs, "%.1000s/blobs", config->work_folder);
        jobs_share_blobs(daemon->jobs, blobs);
    }
    const struct launch_slurm_options options = {.folder = config->data,
                                                 .log_folder = daemon->node_logs,
                                                 .arguments = config->slurm_arguments,
                                                 .interval_ms = (uint32_t)config->slurm_interval_s * 1000,
                                                 .stale = jobs_attempt_is_stale,
                                                 .user = daemon->jobs};
    return launch_slurm_create(&options, &daemon->launcher, diag);
}

/* --- the rooms ------------------------------------------------------------------------------ */

static groom_status open_uploads(struct daemon *daemon, struct groom_diag *diag)
{
    char path[PATH_SIZE];
    snprintf(path, sizeof path, "%s/uploads", daemon->config.data);
    return uploads_create(&(struct uploads_options){.store = daemon->store,
                                                    .blobs = daemon->blobs,
                                                    .folder = path,
                                                    .expiry_ms = (int64_t)daemon->config.upload_expiry_s * 1000},
                          &daemon->uploads, diag);
}

static groom_status open_state(struct daemon *daemon, struct groom_diag *diag)
{
    char path[PATH_SIZE], place[STORE_PLACE_SIZE];
    groom_status status;
    uint64_t n_removed = 0;
    snprintf(path, sizeof path, "%s/blobs", daemon->config.data);
    if ((status = blobs_open(path, NULL, &daemon->blobs, diag)) != GROOM_OK)
        return status;
    store_place(daemon->config.data, place);
    if ((status = store_open(place, &daemon->store, diag)) != GROOM_OK ||
        (status = jobs_create(daemon->store, daemon->blobs, &daemon->jobs, diag)) != GROOM_OK)
        return status;
    status = jobs_collect_blobs(daemon->jobs, &n_removed, diag);
    if (n_removed)
        log_message(CONFIG_LOG_INFO, "%llu uploads that were never finished have been removed",
                    (unsigned long long)n_removed);
    return status == GROOM_OK ? open_uploads(daemon, diag) : status;
}

static groom_status open_grooms(struct daemon *daemon, struct groom_diag *diag)
{
    groom_status status = groom_pool_create(0, &daemon->pool);
    if (status != GROOM_OK)
        return status;
    const struct grooms_options options = {.store = daemon->store,
                                           .blobs = daemon->blobs,
                                           .pool = daemon->pool,
                                           .worker_path = daemon->worker,
                                           .temporary_folder = daemon->temporary};
    return grooms_create(&options, &daemon->grooms, diag);
}

static groom_status start_supervisor(struct daemon *daemon, struct groom_diag *diag)
{
    const struct config *config = &daemon->config;
    groom_status status = create_launcher(daemon, diag);
    if (status != GROOM_OK)
        return status;
    const struct supervisor_options options = {
        .n_slots = (uint32_t)config->workers,
        .max_deaths = (uint32_t)config->job_attempts,
        .launcher = daemon->launcher,
        .worker_argv = daemon->worker_argv,
        .worker_env = daemon->worker_env,
        .work_url = config->work_url[0] ? config->work_url : daemon->listening.url,
        .log_folder = daemon->logs,
        .limits = {.memory_bytes = config->worker_memory, .cpu_s = config->job_time_s},
        .wall_s = (uint32_t)config->job_wall_s,
        .size = {.threads = (uint32_t)config->worker_threads,
                 .memory_bytes = config->worker_memory,
                 .wall_s = config->job_wall_s ? config->job_wall_s : config->job_time_s}};
    return supervisor_start(daemon->jobs, &options, &daemon->supervisor, diag);
}

static groom_status start_housekeeper(struct daemon *daemon, struct groom_diag *diag)
{
    const struct config *config = &daemon->config;
    return housekeeper_start(&(struct housekeeper_options){.store = daemon->store,
                                                           .jobs = daemon->jobs,
                                                           .keep_events_s = config->keep_events_s,
                                                           .keep_jobs_s = config->keep_jobs_s,
                                                           .keep_preparations_s = config->keep_preparations_s},
                             &daemon->housekeeper, diag);
}

static groom_status start_webhooks(struct daemon *daemon, struct groom_diag *diag)
{
    const struct config *config = &daemon->config;
    const struct store_webhook_new all = {config->webhook_url, config->webhook_secret};
    groom_status status = GROOM_OK;
    if (all.url[0] && (status = webhook_url_check(all.url, config->webhook_allow, diag)) == GROOM_OK &&
        (status = webhook_secret_check(all.secret, diag)) == GROOM_OK)
        jobs_set_webhook(daemon->jobs, &all);
    if (status != GROOM_OK)
        return status;
    return webhooks_start(&(struct webhooks_options){.store = daemon->store,
                                                     .allow = config->webhook_allow,
                                                     .max_attempts = (uint32_t)config->webhook_attempts,
                                                     .timeout_s = (uint32_t)config->webhook_timeout_s},
                          &daemon->webhooks, diag);
}

static groom_status start_control(struct daemon *daemon, struct groom_diag *diag)
{
    return control_start(&(struct upkeep){.folder = daemon->config.data,
                                          .store = daemon->store,
                                          .blobs = daemon->blobs},
                         &daemon->control, diag);
}

static groom_status start_server(struct daemon *daemon, struct groom_diag *diag)
{
    daemon->service = (struct service){.config = &daemon->config,
                                       .access = daemon->access,
                                       .store = daemon->store,
                                       .blobs = daemon->blobs,
                                       .uploads = daemon->uploads,
                                       .jobs = daemon->jobs,
                                       .grooms = daemon->grooms,
                                       .supervisor = daemon->supervisor,
                                       .worker_path = daemon->worker,
                                       .temporary_folder = daemon->temporary};
    const struct server_options options = {.service = &daemon->service,
                                           .routes = http_routes,
                                           .n_routes = http_n_routes,
                                           .listen_fd = daemon->listening.fd};
    daemon->listening.fd = -1;
    return server_start(&options, &daemon->server, diag);
}

/* The socket listens before the supervisor starts, so that a worker that is quick only waits. */
static groom_status start(struct daemon *daemon, struct groom_diag *diag)
{
    groom_status status;
    if ((status = find_worker(daemon, diag)) != GROOM_OK ||
        (status = open_folder(daemon, diag)) != GROOM_OK || (status = open_access(daemon, diag)) != GROOM_OK ||
        (status = listen_open(daemon->config.listen, access_has_usable(daemon->access), &daemon->listening, diag)) !=
            GROOM_OK ||
        (status = open_state(daemon, diag)) != GROOM_OK ||
        (status = open_grooms(daemon, diag)) != GROOM_OK ||
        (status = start_supervisor(daemon, diag)) != GROOM_OK ||
        (status = start_housekeeper(daemon, diag)) != GROOM_OK ||
        (status = start_webhooks(daemon, diag)) != GROOM_OK ||
        (status = start_control(daemon, diag)) != GROOM_OK)
        return status;
    return start_server(daemon, diag);
}

static void finish(struct daemon *daemon)
{
    if (!control_stop(daemon->control)) {
        log_message(CONFIG_LOG_WARNING, "a check or a backup was cut off");
        _exit(0);
    }
    webhooks_stop(daemon->webhooks);
    housekeeper_stop(daemon->housekeeper);
    server_destroy(daemon->server);
    supervisor_destroy(daemon->supervisor);
    launch_destroy(daemon->launcher);
    grooms_destroy(daemon->grooms);
    groom_pool_destroy(daemon->pool);
    jobs_destroy(daemon->jobs);
    uploads_destroy(daemon->uploads);
    store_close(daemon->store);
    blobs_close(daemon->blobs);
    access_close(daemon->access);
    if (daemon->listening.fd >= 0)
        close(daemon->listening.fd);
    if (daemon->lock_fd >= 0)
        close(daemon->lock_fd);
}

/* --- the end --------------------------------------------------------------------------------- */

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* Workers first, while they can still bring their checkpoints; then the requests. What is still
 * under way after that is cut: nothing that was acknowledged is lost by it. */
static void stop(struct daemon *daemon)
{
    int64_t until = now_ms() + (int64_t)daemon->config.shutdown_s * 1000;
    log_message(CONFIG_LOG_INFO, "stopping");
    supervisor_drain(daemon->supervisor, (uint32_t)daemon->config.shutdown_s * 500);
    int64_t left = until - now_ms();
    if (!server_stop(daemon->server, left > 500 ? (uint32_t)left : 500)) {
        log_message(CONFIG_LOG_WARNING, "some requests were cut: they took longer than --shutdown-time");
        _exit(0);
    }
    log_message(CONFIG_LOG_INFO, "stopped");
}

/* Signals are taken here and nowhere else: every thread that is started later inherits the mask. */
static void block_signals(sigset_t *signals)
{
    sigemptyset(signals);
    sigaddset(signals, SIGTERM);
    sigaddset(signals, SIGINT);
    pthread_sigmask(SIG_BLOCK, signals, NULL);
    signal(SIGPIPE, SIG_IGN);
}

static void raise_descriptor_limit(void)
{
    struct rlimit limit;
    if (!getrlimit(RLIMIT_NOFILE, &limit) && limit.rlim_cur < limit.rlim_max) {
        limit.rlim_cur = limit.rlim_max;
        setrlimit(RLIMIT_NOFILE, &limit);
    }
}

static void run(struct daemon *daemon, const sigset_t *signals)
{
    int signal_number = 0;
    printf("listening on %s\n", daemon->listening.url);
    fflush(stdout);
    log_message(CONFIG_LOG_INFO, "listening on %s", daemon->listening.url);
    while (sigwait(signals, &signal_number))
        ;
    pthread_sigmask(SIG_UNBLOCK, signals, NULL); /* a second signal ends it at once */
    stop(daemon);
}

int main(int argc, char **argv)
{
    static struct daemon daemon = {.lock_fd = -1, .listening.fd = -1};
    struct groom_diag diag = {0};
    enum config_action action;
    sigset_t signals;
    if (argc > 1 && (!strcmp(argv[1], "check") || !strcmp(argv[1], "backup")))
        return upkeep_command(argc - 1, argv + 1, environ);
    if (argc > 1 && !strcmp(argv[1], "token"))
        return access_command(argc - 1, argv + 1, environ);
    groom_status status = config_load(argc, argv, environ, &daemon.config, &action, &diag);
    if (status == GROOM_OK && action == CONFIG_HELP) {
        config_help(stdout);
        return 0;
    }
    if (status == GROOM_OK && action == CONFIG_VERSION) {
        puts("groomd 1");
        return 0;
    }
    if (status != GROOM_OK) {
        fprintf(stderr, "groomd: %s\n", diag.detail);
        return 2;
    }
    log_set_level((enum config_log_level)daemon.config.log_level);
    json_memory_install();
    raise_descriptor_limit();
    block_signals(&signals);
    if ((status = start(&daemon, &diag)) == GROOM_OK)
        run(&daemon, &signals);
    else
        fprintf(stderr, "groomd: %s\n", diag.status == status ? diag.detail : groom_status_message(status));
    finish(&daemon);
    return status == GROOM_OK ? 0 : 1;
}
