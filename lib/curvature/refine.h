/* Least squares: the super-helix nearest to a polyline's vertices. */
#ifndef CURVATURE_REFINE_H
#define CURVATURE_REFINE_H

#include <stdint.h>

#include "curvature/chain.h"
#include "curvature/trig_rows.h"

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

/* Four and eight numbers in a register or two: the controls of an element are four, a motion and a
 * constant are seven. */
typedef double refine_row __attribute__((vector_size(32)));
struct refine_row8 {
    refine_row low, high;
};

/* Scratch of one element. */
struct refine_element {
    refine_row control[6];      /* motion of everything beyond per unit of (q, length): turn, shift */
    struct refine_row8 gain[4]; /* best control for a motion of the element's begin, and its constant */
};

struct refine_space {
    struct refine_element *element; /* [n_elements] */
    double *kept;                   /* [4 n_elements] lengths and q before a step */
    struct chain_state *junction;   /* [n_elements + 1] where elements begin */
    struct chain_state *moved;      /* [n_elements + 1] ... after the step that is tried */
    struct trig_rows trig;          /* [n_elements + n_vertices + 3] of whole elements, then of their parts before
                                       each vertex */
};

/* Gauss-Newton with Levenberg-Marquardt damping on q, lengths and the root frame, at most n_steps;
 * stops early where no vertex is farther than `tolerance`. Linear in elements and vertices: the motion
 * beyond an element is a rigid one, so that the normal equations are eliminated tip to root in 6x6
 * blocks (the Riccati recursion). Returns the sum of squares, never more than before. */
double refine_fit(struct refine_strand *strand, struct refine_space *space, uint32_t n_steps,
                  double tolerance, double *worst);

/* The same, per instruction set. */
typedef double refine_fit_function(struct refine_strand *, struct refine_space *, uint32_t, double, double *);
refine_fit_function refine_fit_generic, refine_fit_avx2;

#endif
