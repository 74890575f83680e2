#include "geometry/chart.h"

#include <string.h>

/* Points whose distances from the centre vary by more than this share of the radius are no sphere. */
#define WORST_RESIDUAL 0.25
/* A sphere of more than so many times the points' own extent is as good as a plane. */
#define LARGEST_RADIUS 20.0
/* Pulls the centre to the points where they do not say where it is (a strip along a parting). */
#define RIDGE 1e-4

struct spread {
    struct vec mean;
    double extent;        /* root mean square distance from the mean */
    double covariance[3][3];
};

static void measure(const float (*points)[3], uint32_t n, struct spread *spread)
{
    memset(spread, 0, sizeof *spread);
    for (uint32_t i = 0; i < n; i++)
        spread->mean = vec_add(spread->mean, vec_of(points[i]));
    spread->mean = vec_scale(spread->mean, 1.0 / n);
    for (uint32_t i = 0; i < n; i++) {
        struct vec d = vec_sub(vec_of(points[i]), spread->mean);
        double c[3] = {d.x, d.y, d.z};
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                spread->covariance[j][k] += c[j] * c[k] / n;
    }
    spread->extent = sqrt(spread->covariance[0][0] + spread->covariance[1][1] + spread->covariance[2][2]);
}

/* --- the sphere ------------------------------------------------------------------ */

/* a x = b by elimination with pivots; a is 4 x 4. 0 where it has no answer. */
static int solve(double a[4][5], double x[4])
{
    for (int i = 0; i < 4; i++) {
        int pivot = i;
        for (int r = i + 1; r < 4; r++)
            if (fabs(a[r][i]) > fabs(a[pivot][i]))
                pivot = r;
        if (fabs(a[pivot][i]) < 1e-12)
            return 0;
        for (int c = 0; c < 5; c++) {
            double swap = a[i][c];
            a[i][c] = a[pivot][c];
            a[pivot][c] = swap;
        }
        for (int r = i + 1; r < 4; r++) {
            double factor = a[r][i] / a[i][i];
            for (int c = i; c < 5; c++)
                a[r][c] -= factor * a[i][c];
        }
    }
    for (int i = 3; i >= 0; i--) {
        x[i] = a[i][4];
        for (int c = i + 1; c < 4; c++)
            x[i] -= a[i][c] * x[c];
        x[i] /= a[i][i];
    }
    return 1;
}

/* Least squares of |p|^2 = 2 c.p + k, about the mean and in units of the extent. */
static int fit_sphere(struct chart *chart, const float (*points)[3], uint32_t n, const struct spread *spread)
{
    double a[4][5] = {{0}}, x[4], squares = 0;
    for (uint32_t i = 0; i < n; i++) {
        struct vec p = vec_scale(vec_sub(vec_of(points[i]), spread->mean), 1 / spread->extent);
        double row[5] = {2 * p.x, 2 * p.y, 2 * p.z, 1, vec_dot(p, p)};
        for (int j = 0; j < 4; j++)
            for (int k = 0; k < 5; k++)
                a[j][k] += row[j] * row[k] / n;
    }
    for (int j = 0; j < 3; j++)
        a[j][j] += RIDGE;
    if (!solve(a, x))
        return 0;
    struct vec c = {x[0], x[1], x[2]};
    double radius = sqrt(fmax(0, x[3] + vec_dot(c, c)));
    if (!(radius > 0.1 && radius < LARGEST_RADIUS))
        return 0;
    chart->centre = vec_add(spread->mean, vec_scale(c, spread->extent));
    chart->radius = radius * spread->extent;
    for (uint32_t i = 0; i < n; i++) {
        double r = vec_length(vec_sub(vec_of(points[i]), chart->centre)) / chart->radius - 1;
        squares += r * r / n;
    }
    return sqrt(squares) < WORST_RESIDUAL;
}

static struct vec mean_direction(const float (*points)[3], uint32_t n, struct vec centre)
{
    struct vec sum = {0, 0, 0};
    for (uint32_t i = 0; i < n; i++)
        sum = vec_add(sum, vec_unit(vec_sub(vec_of(points[i]), centre)));
    return vec_unit(sum);
}

/* --- the plane --------------------------------------------------------------------- */

static void rotate(double a[3][3], double e[3][3], int p, int q)
{
    if (a[p][q] == 0)
        return;
    double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1)), c = 1 / sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < 3; k++) {
        double x = a[k][p], y = a[k][q];
        a[k][p] = c * x - s * y;
        a[k][q] = s * x + c * y;
    }
    for (int k = 0; k < 3; k++) {
        double x = a[p][k], y = a[q][k];
        a[p][k] = c * x - s * y;
        a[q][k] = s * x + c * y;
        x = e[k][p];
        y = e[k][q];
        e[k][p] = c * x - s * y;
        e[k][q] = s * x + c * y;
    }
}

/* The direction in which the points spread least (Jacobi's eigenvalues of the covariance). */
static struct vec thinnest(const struct spread *spread)
{
    double a[3][3], e[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    memcpy(a, spread->covariance, sizeof a);
    for (int sweep = 0; sweep < 16; sweep++)
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++)
                rotate(a, e, p, q);
    int least = 1; /* y, where all are the same */
    for (int i = 0; i < 3; i++)
        if (a[i][i] < a[least][least])
            least = i;
    return (struct vec){e[0][least], e[1][least], e[2][least]};
}

static void fit_plane(struct chart *chart, const struct spread *spread, struct vec outward)
{
    chart->planar = 1;
    chart->centre = spread->mean;
    chart->n = thinnest(spread);
    struct vec up = vec_length(outward) > 0 ? outward : (struct vec){0, 1, 1e-3};
    if (vec_dot(chart->n, up) < 0)
        chart->n = vec_scale(chart->n, -1);
    /* a few roots in a row spread least in two directions: the surface knows better */
    if (vec_length(outward) > 0 && vec_dot(chart->n, outward) < 0.5 * vec_length(outward))
        chart->n = vec_unit(outward);
}

/* --- both -------------------------------------------------------------------------- */

static void set_axes(struct chart *chart)
{
    struct vec n = chart->n, back = {0, 0, -1}, up = {0, 1, 0};
    struct vec v = vec_sub(back, vec_scale(n, vec_dot(n, back)));
    if (vec_length(v) < 0.3)
        v = vec_sub(up, vec_scale(n, vec_dot(n, up)));
    chart->v = vec_unit(v);
    chart->u = vec_cross(chart->v, n);
}

void chart_fit(struct chart *chart, const float (*points)[3], uint32_t n, struct vec outward)
{
    struct spread spread;
    memset(chart, 0, sizeof *chart);
    measure(points, n, &spread);
    if (n >= 4 && spread.extent > 1e-9 && fit_sphere(chart, points, n, &spread)) {
        chart->n = mean_direction(points, n, chart->centre);
        if (vec_length(chart->n) == 0)
            chart->n = (struct vec){0, 1, 0};
    } else {
        fit_plane(chart, &spread, outward);
    }
    set_axes(chart);
}

void chart_map(const struct chart *chart, struct vec point, double out[2])
{
    struct vec d = vec_sub(point, chart->centre);
    double x = vec_dot(d, chart->u), y = vec_dot(d, chart->v), z = vec_dot(d, chart->n);
    double across = hypot(x, y), stretch = 1;
    if (!chart->planar)
        stretch = across > 1e-12 * chart->radius ? chart->radius * atan2(across, z) / across : 1;
    out[0] = x * stretch;
    out[1] = y * stretch;
}
