#include "fit/simplex.h"

#include <math.h>

struct active {
    const double *gram, *b;
    uint32_t n;                     /* of all */
    uint32_t member[SIMPLEX_MOST];  /* the weights above 0 */
    uint32_t n_members;
    double *w;
};

static double gram(const struct active *a, uint32_t i, uint32_t j) { return a->gram[i * a->n + j]; }

/* x = G_PP^-1 right by Cholesky; right is [n_members], overwritten with x */
static void solve_members(const struct active *a, double factor[SIMPLEX_MOST][SIMPLEX_MOST], double *right)
{
    uint32_t n = a->n_members;
    for (uint32_t i = 0; i < n; i++) {
        for (uint32_t j = 0; j < i; j++)
            right[i] -= factor[i][j] * right[j];
        right[i] /= factor[i][i];
    }
    for (uint32_t i = n; i-- > 0;) {
        for (uint32_t j = i + 1; j < n; j++)
            right[i] -= factor[j][i] * right[j];
        right[i] /= factor[i][i];
    }
}

static void factorize(const struct active *a, double factor[SIMPLEX_MOST][SIMPLEX_MOST])
{
    for (uint32_t i = 0; i < a->n_members; i++)
        for (uint32_t j = 0; j <= i; j++) {
            double sum = gram(a, a->member[i], a->member[j]);
            for (uint32_t k = 0; k < j; k++)
                sum -= factor[i][k] * factor[j][k];
            if (i == j) /* rounding must not make it indefinite */
                factor[i][i] = sqrt(fmax(sum, 1e-14 * gram(a, a->member[i], a->member[i]) + 1e-300));
            else
                factor[i][j] = sum / factor[j][j];
        }
}

/* The minimum over the members with their sum kept at 1, whatever their signs. */
static void minimum_of_members(const struct active *a, double *w)
{
    double factor[SIMPLEX_MOST][SIMPLEX_MOST], ones[SIMPLEX_MOST], sum_b = 0, sum_ones = 0;
    for (uint32_t i = 0; i < a->n_members; i++) {
        w[i] = a->b[a->member[i]];
        ones[i] = 1;
    }
    factorize(a, factor);
    solve_members(a, factor, w);
    solve_members(a, factor, ones);
    for (uint32_t i = 0; i < a->n_members; i++) {
        sum_b += w[i];
        sum_ones += ones[i];
    }
    for (uint32_t i = 0; i < a->n_members; i++)
        w[i] += (1 - sum_b) / sum_ones * ones[i];
}

/* From the present weights towards `to`, as far as none becomes negative; those that reach 0 leave.
 * Returns whether it got there. */
static int walk(struct active *a, const double *to)
{
    double step = 1;
    uint32_t n = 0;
    for (uint32_t i = 0; i < a->n_members; i++) {
        double from = a->w[a->member[i]];
        if (to[i] < 0)
            step = fmin(step, from / (from - to[i]));
    }
    for (uint32_t i = 0; i < a->n_members; i++) {
        uint32_t at = a->member[i];
        a->w[at] += step * (to[i] - a->w[at]);
        if (step < 1 && to[i] < 0 && a->w[at] <= 1e-12)
            a->w[at] = 0;
        else
            a->member[n++] = at;
    }
    int arrived = step == 1;
    if (!arrived && n == a->n_members) { /* rounding: the one that stopped the walk leaves all the same */
        uint32_t least = 0;
        for (uint32_t i = 1; i < n; i++)
            if (a->w[a->member[i]] < a->w[a->member[least]])
                least = i;
        a->w[a->member[least]] = 0;
        a->member[least] = a->member[--n];
    }
    a->n_members = n;
    return arrived;
}

static double slope(const struct active *a, uint32_t i)
{
    double sum = -a->b[i];
    for (uint32_t m = 0; m < a->n_members; m++)
        sum += gram(a, i, a->member[m]) * a->w[a->member[m]];
    return sum;
}

static int is_member(const struct active *a, uint32_t i)
{
    for (uint32_t m = 0; m < a->n_members; m++)
        if (a->member[m] == i)
            return 1;
    return 0;
}

/* The outsider whose slope is furthest below the members' common one; n where there is none. */
static uint32_t best_outsider(const struct active *a)
{
    double common = 0, size = 0;
    uint32_t best = a->n;
    for (uint32_t m = 0; m < a->n_members; m++)
        common += a->w[a->member[m]] * slope(a, a->member[m]);
    for (uint32_t i = 0; i < a->n; i++)
        size = fmax(size, gram(a, i, i));
    double least = common - 1e-9 * size;
    for (uint32_t i = 0; i < a->n; i++) {
        double value = is_member(a, i) ? INFINITY : slope(a, i);
        if (value < least) {
            least = value;
            best = i;
        }
    }
    return best;
}

static uint32_t best_single(const struct active *a)
{
    uint32_t best = 0;
    for (uint32_t i = 1; i < a->n; i++)
        if (gram(a, i, i) - 2 * a->b[i] < gram(a, best, best) - 2 * a->b[best])
            best = i;
    return best;
}

void simplex_solve(const double *gram_matrix, const double *b, uint32_t n, uint32_t support, double *w)
{
    struct active a = {.gram = gram_matrix, .b = b, .n = n, .w = w};
    double to[SIMPLEX_MOST];
    for (uint32_t i = 0; i < n; i++)
        w[i] = 0;
    a.member[a.n_members++] = best_single(&a);
    w[a.member[0]] = 1;
    for (uint32_t round = 0; round < 3 * n && a.n_members < support; round++) {
        uint32_t next = best_outsider(&a);
        if (next == n)
            break;
        a.member[a.n_members++] = next;
        do
            minimum_of_members(&a, to);
        while (!walk(&a, to) && a.n_members > 0);
    }
}
