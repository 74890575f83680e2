#include "server/http/metrics.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

static const struct histogram_bounds bounds = {
    14, {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 60}};

struct row {
    atomic_ullong by_class[6]; /* of 1xx..5xx */
    struct histogram latency;
};

struct metrics {
    atomic_ullong received, sent;
    atomic_llong streams;
    size_t n_rows;
    struct row rows[];
};

struct metrics *metrics_create(size_t n_routes)
{
    struct metrics *metrics = calloc(1, sizeof *metrics + (n_routes + 1) * sizeof metrics->rows[0]);
    if (metrics)
        metrics->n_rows = n_routes + 1;
    return metrics;
}

void metrics_destroy(struct metrics *metrics) { free(metrics); }

void metrics_request(struct metrics *metrics, size_t route, int status, double seconds, uint64_t n_received,
                     uint64_t n_sent)
{
    struct row *row = &metrics->rows[route < metrics->n_rows ? route : metrics->n_rows - 1];
    atomic_fetch_add(&row->by_class[status >= 100 && status < 600 ? status / 100 : 5], 1);
    histogram_add(&row->latency, &bounds, seconds);
    atomic_fetch_add(&metrics->received, n_received);
    atomic_fetch_add(&metrics->sent, n_sent);
}

void metrics_stream(struct metrics *metrics, int change) { atomic_fetch_add(&metrics->streams, change); }

static void print_counts(FILE *out, struct row *row, const char *name)
{
    for (int class = 1; class < 6; class ++) {
        unsigned long long n = atomic_load(&row->by_class[class]);
        if (n)
            fprintf(out, "groomd_http_requests_total{route=\"%s\",status=\"%dxx\"} %llu\n", name, class, n);
    }
}

static int was_used(struct row *row)
{
    for (int class = 1; class < 6; class ++)
        if (atomic_load(&row->by_class[class]))
            return 1;
    return 0;
}

/* --- as text --------------------------------------------------------------------------------- */

void metrics_head(FILE *out, const char *name, const char *type, const char *help)
{
    fprintf(out, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

void metrics_lines(FILE *out, const struct metrics_line *lines, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        if (i == 0 || strcmp(lines[i].name, lines[i - 1].name))
            metrics_head(out, lines[i].name, lines[i].type, lines[i].help);
        fprintf(out, "%s%s%s%s %.15g\n", lines[i].name, lines[i].labels[0] ? "{" : "", lines[i].labels,
                lines[i].labels[0] ? "}" : "", lines[i].value);
    }
}

void metrics_histogram(FILE *out, const char *name, const char *labels, const struct histogram *histogram,
                       const struct histogram_bounds *limits)
{
    unsigned long long n = 0;
    for (size_t i = 0; i < limits->n; i++) {
        n += atomic_load(&histogram->bucket[i]);
        fprintf(out, "%s_bucket{%s,le=\"%g\"} %llu\n", name, labels, limits->seconds[i], n);
    }
    n += atomic_load(&histogram->bucket[limits->n]);
    fprintf(out, "%s_bucket{%s,le=\"+Inf\"} %llu\n", name, labels, n);
    fprintf(out, "%s_sum{%s} %.6f\n", name, labels, (double)atomic_load(&histogram->microseconds) * 1e-6);
    fprintf(out, "%s_count{%s} %llu\n", name, labels, n);
}

void metrics_print(struct metrics *metrics, FILE *out, const char *(*name_of)(size_t, char *, size_t))
{
    char name[128], labels[160];
    metrics_head(out, "groomd_http_requests_total", "counter", "Requests answered, by route and status class.");
    for (size_t i = 0; i < metrics->n_rows; i++)
        print_counts(out, &metrics->rows[i], name_of(i, name, sizeof name));
    metrics_head(out, "groomd_http_request_seconds", "histogram", "Time from the head of a request to the end of its answer.");
    for (size_t i = 0; i < metrics->n_rows; i++) {
        if (!was_used(&metrics->rows[i]))
            continue;
        snprintf(labels, sizeof labels, "route=\"%s\"", name_of(i, name, sizeof name));
        metrics_histogram(out, "groomd_http_request_seconds", labels, &metrics->rows[i].latency, &bounds);
    }
    const struct metrics_line own[] = {
        {"groomd_http_received_bytes_total", "", "Bytes of request bodies.", "counter",
         (double)atomic_load(&metrics->received)},
        {"groomd_http_sent_bytes_total", "", "Bytes of response bodies.", "counter",
         (double)atomic_load(&metrics->sent)},
        {"groomd_http_event_streams", "", "Open event streams.", "gauge",
         (double)atomic_load(&metrics->streams)},
    };
    metrics_lines(out, own, sizeof own / sizeof own[0]);
}
