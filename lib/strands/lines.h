/* Strands from indexed lines: OBJ's `l` and PLY's edges, in any order.
 *
 * Every point of the builder gets the index of the one that follows it in its strand. Two-index
 * lines are rejoined: one that begins where another ends goes on with it. Where lines share a vertex
 * otherwise (branches, a root that strands have in common), the vertex is repeated. At the end the
 * points are put into strand order in place, so that memory stays at 17 bytes a point. Polylines keep
 * the order of the file; joined lines come in the order of their roots. */
#ifndef STRANDS_LINES_H
#define STRANDS_LINES_H

#include "strands/builder.h"

struct lines {
    struct builder *out;
    struct chunks next;  /* uint32_t of each point: the one after it, or LINES_NONE */
    struct chunks flags; /* unsigned char of each point */
    struct chunks roots; /* uint32_t of each polyline, in the order of the file */
    int descends;        /* that order is not the order of the vertices */
    uint32_t last;       /* of the polyline that is being read */
    uint64_t n_repeated; /* vertices that lines share without being joined there */
};

void lines_init(struct lines *lines, struct builder *out, const struct groom_allocator *allocator);
void lines_finish(struct lines *lines); /* takes a zeroed struct */

/* All answer 0 on failure, with the builder's status set. Indices are below builder->points.n. */
GROOM_MUST_CHECK int lines_edge(struct lines *lines, uint32_t from, uint32_t to); /* joined with others */
GROOM_MUST_CHECK int lines_begin(struct lines *lines, uint32_t from);             /* a strand of its own */
GROOM_MUST_CHECK int lines_continue(struct lines *lines, uint32_t to);

/* Cut the builder's points into the strands, and warn of oddities. */
GROOM_MUST_CHECK int lines_cut(struct lines *lines);

#endif
