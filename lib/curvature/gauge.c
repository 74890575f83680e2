/* Gauges: the one freedom of a material frame that the curve does not see. */
#include <math.h>

#include "groom/curvature.h"

/* Where strand b's curvature is at fraction `at` of its length; *j moves forward. */
struct gauge_walk {
    const struct groom_superhelices *h;
    uint32_t j, end;
    double passed, length; /* arc before element j; the whole */
};

static struct gauge_walk walk_of(const struct groom_superhelices *h, uint32_t strand)
{
    return (struct gauge_walk){h, h->first[strand], h->first[strand + 1], 0.0, groom_superhelix_length(h, strand)};
}

/* The fraction of the strand at which the present element ends. */
static double walk_end(const struct gauge_walk *w)
{
    if (w->j + 1 >= w->end || !(w->length > 0.0))
        return 1.0;
    return (w->passed + w->h->length[w->j]) / w->length;
}

static void walk_next(struct gauge_walk *w) { w->passed += w->h->length[w->j++]; }

double groom_superhelix_gauge(const struct groom_superhelices *a, uint32_t strand_a,
                              const struct groom_superhelices *b, uint32_t strand_b)
{
    struct gauge_walk x = walk_of(a, strand_a), y = walk_of(b, strand_b);
    double along = 0.0, across = 0.0, at = 0.0;
    while (x.j < x.end && y.j < y.end) {
        double ex = walk_end(&x), ey = walk_end(&y), next = ex < ey ? ex : ey;
        const double *p = a->q[x.j], *q = b->q[y.j];
        along += (next - at) * (p[1] * q[1] + p[2] * q[2]);
        across += (next - at) * (p[2] * q[1] - p[1] * q[2]);
        at = next;
        if (ex <= next)
            walk_next(&x);
        if (ey <= next)
            walk_next(&y);
    }
    return along == 0.0 && across == 0.0 ? 0.0 : atan2(across, along);
}

void groom_superhelix_turn_gauge(struct groom_superhelices *h, uint32_t strand, double angle)
{
    double c = cos(angle), s = sin(angle);
    for (uint32_t j = h->first[strand]; j < h->first[strand + 1]; j++) {
        double *q = h->q[j], q1 = q[1];
        q[1] = c * q1 - s * q[2];
        q[2] = s * q1 + c * q[2];
    }
    for (int i = 0; i < 3; i++) { /* u' and v' so that F q stays what it was */
        double u = h->frame[strand][1][i], v = h->frame[strand][2][i];
        h->frame[strand][1][i] = c * u - s * v;
        h->frame[strand][2][i] = s * u + c * v;
    }
}
