/* What the service says of itself: health, readiness, figures, options, its own description. */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "groom/fit.h"
#include "groom/retarget.h"
#include "proto/embed.h"
#include "server/http/handlers.h"
#include "server/http/server.h"
#include "server/jobs/stage_clock.h"
#include "server/jobs/supervisor.h"

EMBED(openapi_json, "proto/openapi.json");

void about_health(struct request *request)
{
    static const char fine[] = "{\"status\":\"ok\"}";
    respond_static(request, 200, "application/json", fine, sizeof fine - 1);
}

void about_openapi(struct request *request)
{
    respond_static(request, 200, "application/json", openapi_json, openapi_json_size);
}

void about_options(struct request *request)
{
    char *fit = NULL, *retarget = NULL, *text = NULL;
    struct groom_diag diag = {0};
    int n = -1;
    groom_status status = groom_fit_options_schema(&fit, &diag);
    if (status == GROOM_OK)
        status = groom_retarget_options_schema(&retarget, &diag);
    if (status == GROOM_OK && (n = asprintf(&text, "{\"fit\":%s,\"retarget\":%s}", fit, retarget)) < 0)
        status = GROOM_ENOMEM;
    free(fit);
    free(retarget);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "application/json", text, (size_t)n);
}

/* --- readiness --------------------------------------------------------------------------- */

/* NULL, or why nothing can be written. */
static const char *disk_trouble(const struct service *service, char *text, size_t capacity)
{
    struct statvfs disk;
    if (statvfs(service->temporary_folder, &disk))
        snprintf(text, capacity, "the data folder cannot be reached: %s", strerror(errno));
    else if ((uint64_t)disk.f_bavail * disk.f_frsize < service->config->min_free)
        snprintf(text, capacity, "the disk has %llu bytes left, less than --min-free",
                 (unsigned long long)disk.f_bavail * disk.f_frsize);
    else {
        int fd = open(service->temporary_folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
        if (fd >= 0 && write(fd, "ready?", 6) == 6 && fdatasync(fd) == 0) {
            close(fd);
            return NULL;
        }
        snprintf(text, capacity, "the data folder cannot be written to: %s", strerror(errno));
        if (fd >= 0)
            close(fd);
    }
    return text;
}

void about_ready(struct request *request)
{
    static const char ready[] = "{\"status\":\"ready\"}";
    char text[256];
    struct groom_diag diag = {0};
    const char *trouble = store_ping(request->service->store, &diag) == GROOM_OK ? NULL : diag.detail;
    if (!trouble && server_is_draining(request->server))
        trouble = "groomd is stopping";
    if (!trouble)
        trouble = disk_trouble(request->service, text, sizeof text);
    if (trouble)
        respond_refusal(request, 503, "not-ready", "the service cannot do its work", "%s", trouble);
    else
        respond_static(request, 200, "application/json", ready, sizeof ready - 1);
}

/* --- metrics ------------------------------------------------------------------------------ */

struct lines {
    struct metrics_line line[24];
    char labels[24][32];
    size_t n;
};

static void add(struct lines *lines, const char *name, const char *type, const char *help, const char *state,
                double value)
{
    if (lines->n == sizeof lines->line / sizeof lines->line[0])
        return;
    char *labels = lines->labels[lines->n];
    snprintf(labels, sizeof lines->labels[0], state ? "state=\"%s\"" : "%s", state ? state : "");
    lines->line[lines->n++] = (struct metrics_line){name, labels, help, type, value};
}

static void add_jobs(struct lines *lines, const struct store_counts *counts)
{
    for (int state = 0; state < STORE_JOB_STATES; state++)
        add(lines, "groomd_jobs", "gauge", "Jobs by state; queued is the depth of the queue.",
            store_job_state_name((enum store_job_state)state), (double)counts->jobs[state]);
    add(lines, "groomd_strands", "gauge", "Uploaded strands.", NULL, (double)counts->strands);
    add(lines, "groomd_heads", "gauge", "Uploaded heads.", NULL, (double)counts->heads);
    add(lines, "groomd_grooms", "gauge", "Grooms.", NULL, (double)counts->grooms);
    add(lines, "groomd_revisions", "gauge", "Revisions of all grooms.", NULL, (double)counts->revisions);
    add(lines, "groomd_attempts_died_total", "counter", "Attempts whose worker died, ever.", NULL,
        (double)counts->attempts_died);
}

static void add_workers(struct lines *lines, struct supervisor *supervisor)
{
    struct supervisor_counts counts = {0};
    supervisor_count(supervisor, &counts);
    add(lines, "groomd_worker_slots", "gauge", "Jobs that may run at a time.", NULL, counts.n_slots);
    add(lines, "groomd_workers", "gauge", "Workers that run.", NULL, counts.n_running);
    add(lines, "groomd_worker_launches_total", "counter", "Workers launched since the start.", NULL,
        (double)counts.n_launched);
    add(lines, "groomd_worker_restarts_total", "counter",
        "Workers that died since the start; their jobs went on in another.", NULL, (double)counts.n_died);
}

static void add_process(struct lines *lines, struct server *server)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    add(lines, "groomd_slow_queue", "gauge", "Requests that wait for a slow thread.", NULL,
        (double)lane_queued(server_lane(server, LANE_SLOW)));
    add(lines, "groomd_connections", "gauge", "Open connections.", NULL, (double)server_connections(server));
    add(lines, "process_cpu_seconds_total", "counter", "Processor time of the daemon.", NULL,
        (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
            (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) * 1e-6);
    add(lines, "process_max_resident_memory_bytes", "gauge", "Most memory that the daemon has had.", NULL,
        (double)usage.ru_maxrss * 1024);
}

static const char *route_name(size_t route, char *text, size_t capacity)
{
    if (route >= http_n_routes)
        return "none";
    snprintf(text, capacity, "%s %s", http_routes[route].method, http_routes[route].pattern);
    return text;
}

static void print_stages(FILE *out, struct stage_clock *clock)
{
    static const char name[] = "groomd_stage_seconds";
    const struct stage_times *times;
    char labels[2 * STAGE_NAME_SIZE + 24];
    metrics_head(out, name, "histogram", "Time that stages of jobs took, those that were gone through to their end.");
    for (size_t i = 0; (times = stage_clock_times(clock, i)); i++) {
        snprintf(labels, sizeof labels, "kind=\"%s\",stage=\"%s\"", times->kind, times->stage);
        metrics_histogram(out, name, labels, &times->histogram, &stage_clock_bounds);
    }
}

void about_metrics(struct request *request)
{
    struct lines lines = {.n = 0};
    struct store_counts counts;
    char *text = NULL;
    size_t n_bytes = 0;
    if (store_count(request->service->store, &counts, NULL) == GROOM_OK)
        add_jobs(&lines, &counts);
    if (request->service->supervisor)
        add_workers(&lines, request->service->supervisor);
    add_process(&lines, request->server);
    FILE *out = open_memstream(&text, &n_bytes);
    if (out) {
        metrics_print(server_metrics(request->server), out, route_name);
        metrics_lines(out, lines.line, lines.n);
        print_stages(out, jobs_stage_clock(request->service->jobs));
    }
    if (out && fclose(out) == 0) {
        respond_bytes(request, 200, "text/plain; version=0.0.4; charset=utf-8", text, n_bytes);
    } else {
        free(text);
        respond_failure(request, GROOM_ENOMEM, NULL);
    }
}
