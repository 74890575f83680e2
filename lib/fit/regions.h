/* Regions of a graph whose insides are alike and whose borders are not. */
#ifndef FIT_REGIONS_H
#define FIT_REGIONS_H

#include <stddef.h>
#include <stdint.h>

#include "base/memory.h"
#include "groom/status.h"

struct region_edge { uint32_t a, b; double cost; }; /* a = b: none */

/* Merges n nodes to `wanted` regions (where the graph has more parts than that, the last ones are joined),
 * always the two whose border costs least: the mean over its edges of log(1 + cost / usual cost), times
 * na nb / (na + nb) of their nodes, which keeps regions of one size (as in Ward 1963). A border tells apart
 * neighbours of two kinds that means of all that lies behind it do not. Then nodes go where most of the
 * neighbours are that are like them. Ties by index.
 * edge    [n_edges], either direction, or both
 * region  [n] out, 0 .. wanted - 1
 * returns GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status regions_merge(const struct region_edge *edge, size_t n_edges, uint32_t n, uint32_t wanted,
                                            uint32_t *region, const struct groom_allocator *allocator);

#endif
