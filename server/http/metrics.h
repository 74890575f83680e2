/* Counters of the HTTP side, and everything that /metrics says, as Prometheus text (0.0.4).
 * threads   any */
#ifndef HTTP_METRICS_H
#define HTTP_METRICS_H

#include <stddef.h>
#include <stdint.h>

struct metrics;

/* One row for each route and one (index n_routes) for what found none. NULL: out of memory. */
struct metrics *metrics_create(size_t n_routes);
void metrics_destroy(struct metrics *metrics); /* takes NULL */

void metrics_request(struct metrics *metrics, size_t route, int status, double seconds, uint64_t n_received,
                     uint64_t n_sent);
void metrics_stream(struct metrics *metrics, int change); /* event streams: +1, -1 */

/* Gauges and counters from elsewhere that are printed beside. */
struct metrics_line {
    const char *name, *labels, *help, *type; /* labels: `state="queued"` or "" */
    double value;
};

/* name_of(user, i) labels route i ("GET /v1/jobs/{id}"). *text is malloc'ed; NULL: out of memory. */
char *metrics_print(struct metrics *metrics,
                    const char *(*name_of)(const void *user, size_t route, char *text, size_t capacity),
                    const void *user, const struct metrics_line *lines, size_t n_lines);

#endif
