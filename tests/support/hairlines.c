#include "tests/support/hairlines.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/groom.h"
#include "groom/mesh.h"
#include "groom/sample.h"

struct groom_mesh *hairlines_sample(uint32_t n, float (**roots)[3])
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    groom_sample_options_init(GROOM_SAMPLE_STRAIGHT, &options);
    options.n_strands = n;
    options.n_vertices = 3;
    options.n_guides = options.n_operator_guides = 20;
    if (groom_sample_create(&options, NULL, &sample, NULL) != GROOM_OK)
        abort();
    *roots = malloc(n * sizeof **roots);
    memcpy(*roots, sample->truth->roots, n * sizeof **roots);
    struct groom_mesh *head = sample->head;
    sample->head = NULL;
    groom_sample_destroy(sample);
    return head;
}

/* How far up (metres) the line goes at arc 0..1 from the left ear. */
static double rise_at(hairlines_shape shape, double arc)
{
    double middle = exp(-pow((arc - 0.5) / 0.06, 2)), temples = exp(-pow((fabs(arc - 0.5) - 0.2) / 0.08, 2));
    double forehead = pow(sin(M_PI * arc), 2);
    switch (shape) {
    case HAIRLINES_WIDOW:
        return -0.012 * middle + 0.008 * temples;
    case HAIRLINES_ROUND:
        return 0.015 * forehead;
    case HAIRLINES_RECEDING:
        return 0.025 * temples;
    default:
        return 0;
    }
}

/* Straight: heights between a fifth and four fifths of the way become their mean, easing in. */
static void straighten(struct groom_hairline_curve *curve)
{
    double sum = 0;
    int count = 0;
    for (uint32_t i = 0; i < curve->n_points; i++) {
        double arc = (double)i / (curve->n_points - 1);
        if (fabs(arc - 0.5) < 0.2) {
            sum += curve->points[i][1];
            count++;
        }
    }
    for (uint32_t i = 0; i < curve->n_points; i++) {
        double arc = (double)i / (curve->n_points - 1), t = fmin(fmax((0.27 - fabs(arc - 0.5)) / 0.1, 0), 1);
        t = t * t * (3 - 2 * t);
        curve->points[i][1] += (float)(t * (sum / count - curve->points[i][1]));
    }
}

void hairlines_draw(const struct groom_scalp_region *region, hairlines_shape shape, uint32_t n, struct groom_hairline *hairline)
{
    memset(hairline, 0, sizeof *hairline);
    hairline->n_curves = 1;
    struct groom_hairline_curve *curve = &hairline->curves[0];
    curve->n_points = n;
    groom_scalp_region_front(region, n, curve->points);
    for (uint32_t i = 0; i < n; i++)
        curve->points[i][1] += (float)rise_at(shape, (double)i / (n - 1));
    if (shape == HAIRLINES_STRAIGHT)
        straighten(curve);
}
