/* Least squares: the super-helix nearest to a polyline's vertices. */
#ifndef CURVATURE_REFINE_H
#define CURVATURE_REFINE_H

#include <stdint.h>

#include "curvature/chain.h"

/* One strand while it is fitted. Coordinates are relative to its root. */
struct refine_strand {
    uint32_t n_elements, n_vertices;
    mat3 root;              /* frame */
    double *length;         /* [n_elements] */
    double (*q)[3];         /* [n_elements] */
    const vec3 *vertex;     /* [n_vertices]; vertex 0 is the root */
    uint32_t *element;      /* [n_vertices] the element that holds the vertex, rising */
    double *fraction;       /* [n_vertices] 0..1 along it */
    vec3 *fitted;           /* [n_vertices] the curve there: written */
};

/* Scratch of one element. */
struct refine_element {
    double control[6][4];  /* motion of everything beyond per unit of (q, length): turn, shift */
    double gain[4][7];     /* best control for a motion of the element's begin, and its constant */
};

struct refine_space {
    struct refine_element *element; /* [n_elements] */
    double *kept;                   /* [4 n_elements] lengths and q before a step */
    struct chain_state *junction;   /* [n_elements + 1] */
};

/* Fill `fitted`; returns the sum of squared distances, *worst the largest distance. */
double refine_measure(struct refine_strand *strand, double *worst);

/* Gauss-Newton with Levenberg-Marquardt damping on q, lengths and the root frame, at most n_steps;
 * stops early where no vertex is farther than `tolerance`. Linear in elements and vertices: the motion
 * beyond an element is a rigid one, so that the normal equations are eliminated tip to root in 6x6
 * blocks (the Riccati recursion). Returns the sum of squares, never more than before. */
double refine_fit(struct refine_strand *strand, const struct refine_space *space, uint32_t n_steps,
                  double tolerance, double *worst);

#endif
