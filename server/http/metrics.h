/* Counters of the HTTP side, and everything that /metrics says, as Prometheus text (0.0.4).
 * threads   any */
#ifndef HTTP_METRICS_H
#define HTTP_METRICS_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "server/histogram.h"

struct metrics;

/* One row for each route and one (index n_routes) for what found none. NULL: out of memory. */
struct metrics *metrics_create(size_t n_routes);
void metrics_destroy(struct metrics *metrics); /* takes NULL */

void metrics_request(struct metrics *metrics, size_t route, int status, double seconds, uint64_t n_received,
                     uint64_t n_sent);
void metrics_stream(struct metrics *metrics, int change); /* event streams: +1, -1 */

/* The counters of the HTTP side. name_of(i) labels route i ("GET /v1/jobs/{id}"). */
void metrics_print(struct metrics *metrics, FILE *out, const char *(*name_of)(size_t route, char *text, size_t capacity));

/* --- figures from elsewhere, printed beside ------------------------------------------------- */

struct metrics_line {
    const char *name, *labels, *help, *type; /* labels: `state="queued"` or "" */
    double value;
};
void metrics_lines(FILE *out, const struct metrics_line *lines, size_t n);
/* Before the first line of a name. */
void metrics_head(FILE *out, const char *name, const char *type, const char *help);
/* labels: at least one. */
void metrics_histogram(FILE *out, const char *name, const char *labels, const struct histogram *histogram,
                       const struct histogram_bounds *bounds);

#endif
