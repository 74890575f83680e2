#include "curvature/sculpt_tail.h"

#include <string.h>

/* Vectors of 3n numbers, cut from the scratch in this order. */
struct tail {
    size_t width;
    double *gradient, *direction, *trial, *next;
    double *moves, *changes; /* [TAIL_MEMORY][width] of the last steps: in q, in the gradient */
    double rho[TAIL_MEMORY];
    uint32_t n_kept, newest;
};

size_t tail_space(uint32_t n) { return (size_t)3 * n * (4 + 2 * TAIL_MEMORY); }

static struct tail tail_of(uint32_t n, double *space)
{
    size_t w = 3 * (size_t)n;
    return (struct tail){.width = w, .gradient = space, .direction = space + w, .trial = space + 2 * w,
                         .next = space + 3 * w, .moves = space + 4 * w, .changes = space + (4 + TAIL_MEMORY) * w};
}

static double dot(const double *a, const double *b, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static void add_scaled(double *a, double s, const double *b, size_t n)
{
    for (size_t i = 0; i < n; i++)
        a[i] += s * b[i];
}

/* Two-loop recursion: direction = -H gradient. */
static void find_direction(struct tail *t)
{
    double alpha[TAIL_MEMORY] = {0};
    size_t w = t->width;
    memcpy(t->direction, t->gradient, w * sizeof *t->direction);
    for (uint32_t i = 0; i < t->n_kept; i++) {
        uint32_t at = (t->newest + TAIL_MEMORY - i) % TAIL_MEMORY;
        alpha[at] = t->rho[at] * dot(t->moves + at * w, t->direction, w);
        add_scaled(t->direction, -alpha[at], t->changes + at * w, w);
    }
    if (t->n_kept) {
        const double *y = t->changes + t->newest * w;
        double scale = 1.0 / (t->rho[t->newest] * dot(y, y, w));
        for (size_t i = 0; i < w; i++)
            t->direction[i] *= scale;
    }
    for (uint32_t i = t->n_kept; i-- > 0;) {
        uint32_t at = (t->newest + TAIL_MEMORY - i) % TAIL_MEMORY;
        double beta = t->rho[at] * dot(t->changes + at * w, t->direction, w);
        add_scaled(t->direction, alpha[at] - beta, t->moves + at * w, w);
    }
    for (size_t i = 0; i < w; i++)
        t->direction[i] = -t->direction[i];
}

static double turning(const struct sculpt_problem *p, const double *d)
{
    double sum = 0.0;
    for (uint32_t j = 0; j < p->chain.n; j++)
        sum += sqrt(dot(d + 3 * j, d + 3 * j, 3)) * p->chain.length[j];
    return sum;
}

/* Backtrack until the energy has fallen enough (Armijo); t->trial is then the place. Returns the energy
 * there, or `energy` where no step helps. */
static double search_line(const struct sculpt_problem *p, struct tail *t, const double *q, double energy,
                          double first, double slope)
{
    double step = first;
    for (int halving = 0; halving < 30; halving++, step *= 0.4) {
        memcpy(t->trial, q, t->width * sizeof *t->trial);
        add_scaled(t->trial, step, t->direction, t->width);
        double after = energy_value(p, (const double (*)[3])t->trial, NULL);
        if (after <= energy + 1e-4 * step * slope && after < energy)
            return after;
    }
    return energy;
}

/* Keep the pair (move, change) where it has positive curvature. */
static void remember(struct tail *t, const double *q)
{
    size_t w = t->width;
    uint32_t at = t->n_kept ? (t->newest + 1) % TAIL_MEMORY : 0;
    double *s = t->moves + at * w, *y = t->changes + at * w;
    for (size_t i = 0; i < w; i++) {
        s[i] = t->trial[i] - q[i];
        y[i] = t->next[i] - t->gradient[i];
    }
    double along = dot(s, y, w);
    if (!(along > 1e-14 * sqrt(dot(s, s, w) * dot(y, y, w))))
        return;
    t->rho[at] = 1.0 / along;
    t->newest = at;
    t->n_kept += t->n_kept < TAIL_MEMORY;
}

double tail_minimise(const struct sculpt_problem *problem, double (*q)[3], uint32_t max_iterations,
                     double tolerance, double most_turning, double *space, struct chain_state *junction,
                     uint32_t *iterations, int *converged)
{
    struct tail t = tail_of(problem->chain.n, space);
    double energy = energy_gradient(problem, (const double (*)[3])q, (double (*)[3])t.gradient, junction);
    uint32_t i, slow = 0;
    for (i = 0; i < max_iterations && slow < 3; i++) {
        find_direction(&t);
        double slope = dot(t.direction, t.gradient, t.width);
        if (!(slope < 0.0))
            break;
        double turn = turning(problem, t.direction), first = turn > most_turning ? most_turning / turn : 1.0;
        double after = search_line(problem, &t, &q[0][0], energy, first, slope);
        if (!(after < energy))
            break;
        slow = energy - after <= tolerance * energy ? slow + 1 : 0;
        energy_gradient(problem, (const double (*)[3])t.trial, (double (*)[3])t.next, junction);
        remember(&t, &q[0][0]);
        memcpy(q, t.trial, t.width * sizeof *t.trial);
        memcpy(t.gradient, t.next, t.width * sizeof *t.next);
        energy = after;
    }
    *iterations = i;
    *converged = i < max_iterations;
    return energy;
}
