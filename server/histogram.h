/* How often something took how long, in fixed buckets, as Prometheus counts it.
 * threads   any: counters are atomic, a reader may see one of two that belong together */
#ifndef SERVER_HISTOGRAM_H
#define SERVER_HISTOGRAM_H

#include <stdatomic.h>
#include <stddef.h>

#define HISTOGRAM_MAX_BOUNDS 16

struct histogram_bounds {
    size_t n;
    double seconds[HISTOGRAM_MAX_BOUNDS]; /* ascending */
};

struct histogram {
    atomic_ullong bucket[HISTOGRAM_MAX_BOUNDS + 1]; /* not cumulative; the last: above all bounds */
    atomic_ullong microseconds;
};

static inline void histogram_add(struct histogram *histogram, const struct histogram_bounds *bounds, double seconds)
{
    size_t bucket = 0;
    while (bucket < bounds->n && seconds > bounds->seconds[bucket])
        bucket++;
    atomic_fetch_add(&histogram->bucket[bucket], 1);
    atomic_fetch_add(&histogram->microseconds, (unsigned long long)(seconds * 1e6));
}

#endif
