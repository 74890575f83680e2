#include "server/http/metrics.h"

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double bounds[] = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 60};
#define N_BOUNDS (sizeof bounds / sizeof bounds[0])

struct row {
    atomic_ullong by_class[6];          /* of 1xx..5xx */
    atomic_ullong bucket[N_BOUNDS + 1]; /* not cumulative here */
    atomic_ullong microseconds;
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
    size_t bucket = 0;
    while (bucket < N_BOUNDS && seconds > bounds[bucket])
        bucket++;
    atomic_fetch_add(&row->by_class[status >= 100 && status < 600 ? status / 100 : 5], 1);
    atomic_fetch_add(&row->bucket[bucket], 1);
    atomic_fetch_add(&row->microseconds, (unsigned long long)(seconds * 1e6));
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

static void print_latency(FILE *out, struct row *row, const char *name)
{
    unsigned long long n = 0;
    for (size_t i = 0; i < N_BOUNDS; i++) {
        n += atomic_load(&row->bucket[i]);
        fprintf(out, "groomd_http_request_seconds_bucket{route=\"%s\",le=\"%g\"} %llu\n", name, bounds[i], n);
    }
    n += atomic_load(&row->bucket[N_BOUNDS]);
    fprintf(out, "groomd_http_request_seconds_bucket{route=\"%s\",le=\"+Inf\"} %llu\n", name, n);
    fprintf(out, "groomd_http_request_seconds_sum{route=\"%s\"} %.6f\n", name,
            (double)atomic_load(&row->microseconds) * 1e-6);
    fprintf(out, "groomd_http_request_seconds_count{route=\"%s\"} %llu\n", name, n);
}

static int was_used(struct row *row)
{
    for (int class = 1; class < 6; class ++)
        if (atomic_load(&row->by_class[class]))
            return 1;
    return 0;
}

static void head(FILE *out, const char *name, const char *type, const char *help)
{
    fprintf(out, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

static void print_lines(FILE *out, const struct metrics_line *lines, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        if (i == 0 || strcmp(lines[i].name, lines[i - 1].name))
            head(out, lines[i].name, lines[i].type, lines[i].help);
        fprintf(out, "%s%s%s%s %.15g\n", lines[i].name, lines[i].labels[0] ? "{" : "", lines[i].labels,
                lines[i].labels[0] ? "}" : "", lines[i].value);
    }
}

char *metrics_print(struct metrics *metrics, const char *(*name_of)(const void *, size_t, char *, size_t),
                    const void *user, const struct metrics_line *lines, size_t n_lines)
{
    char *text = NULL, name[128];
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return NULL;
    head(out, "groomd_http_requests_total", "counter", "Requests answered, by route and status class.");
    for (size_t i = 0; i < metrics->n_rows; i++)
        print_counts(out, &metrics->rows[i], name_of(user, i, name, sizeof name));
    head(out, "groomd_http_request_seconds", "histogram",
         "Time from the head of a request to the end of its answer.");
    for (size_t i = 0; i < metrics->n_rows; i++)
        if (was_used(&metrics->rows[i]))
            print_latency(out, &metrics->rows[i], name_of(user, i, name, sizeof name));
    const struct metrics_line own[] = {
        {"groomd_http_received_bytes_total", "", "Bytes of request bodies.", "counter",
         (double)atomic_load(&metrics->received)},
        {"groomd_http_sent_bytes_total", "", "Bytes of response bodies.", "counter",
         (double)atomic_load(&metrics->sent)},
        {"groomd_http_event_streams", "", "Open event streams.", "gauge",
         (double)atomic_load(&metrics->streams)},
    };
    print_lines(out, own, sizeof own / sizeof own[0]);
    print_lines(out, lines, n_lines);
    return fclose(out) == 0 ? text : (free(text), NULL);
}
