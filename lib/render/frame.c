/* Where the camera stands: far enough, along the view's axis, for all of the hair and the head
 * around it; and the lights, which stand with the camera so that every view is lit alike. */
#include <math.h>

#include "render/scene.h"

#define FIELD_OF_VIEW (20.0 * M_PI / 180)
#define MARGIN 1.06

/* The head is framed as far as this many diagonals of the roots' box from its middle. */
#define HEAD_REACH 0.72

struct box {
    float low[3], high[3];
};

static void box_clear(struct box *box)
{
    for (int k = 0; k < 3; k++) {
        box->low[k] = INFINITY;
        box->high[k] = -INFINITY;
    }
}

static void box_add(struct box *box, const float p[3])
{
    for (int k = 0; k < 3; k++) {
        box->low[k] = fminf(box->low[k], p[k]);
        box->high[k] = fmaxf(box->high[k], p[k]);
    }
}

static double box_diagonal(const struct box *box)
{
    double sum = 0;
    for (int k = 0; k < 3; k++)
        sum += ((double)box->high[k] - box->low[k]) * ((double)box->high[k] - box->low[k]);
    return sqrt(sum);
}

static int head_point_counts(const struct box *roots, const float p[3])
{
    double reach = HEAD_REACH * box_diagonal(roots), sum = 0;
    for (int k = 0; k < 3; k++) {
        double d = p[k] - 0.5 * ((double)roots->low[k] + roots->high[k]);
        sum += d * d;
    }
    return sum <= reach * reach;
}

struct axes {
    double right[3], up[3], back[3]; /* back: towards the camera */
};

static const struct axes axes_of[GROOM_VIEW_COUNT] = {
    [GROOM_VIEW_FRONT] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
    [GROOM_VIEW_SIDE] = {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}},
    [GROOM_VIEW_BACK] = {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
    [GROOM_VIEW_TOP] = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

struct fitting {
    const struct axes *axes;
    double centre[3];
    double distance; /* of the camera from the centre */
};

/* Step back until the point is in the picture. */
static void fit_point(struct fitting *fit, const float p[3])
{
    double d[3] = {p[0] - fit->centre[0], p[1] - fit->centre[1], p[2] - fit->centre[2]};
    double across = fmax(fabs(dot(d, fit->axes->right)), fabs(dot(d, fit->axes->up))) * MARGIN;
    fit->distance = fmax(fit->distance, across / tan(0.5 * FIELD_OF_VIEW) + dot(d, fit->axes->back));
}

static void fit_all(struct fitting *fit, const struct render_scene *scene, const struct box *roots)
{
    for (uint32_t i = 0; i < scene->framed->n_vertices; i++)
        if (render_is_finite(scene->framed->points[i]))
            fit_point(fit, scene->framed->points[i]);
    for (uint32_t i = 0; scene->head && i < scene->head->n_vertices; i++)
        if (head_point_counts(roots, scene->head->points[i]))
            fit_point(fit, scene->head->points[i]);
}

static void hair_box(const struct groom_strands *strands, struct box *hair)
{
    box_clear(hair);
    for (uint32_t i = 0; i < strands->n_vertices; i++)
        if (render_is_finite(strands->points[i]))
            box_add(hair, strands->points[i]);
}

static void gather_boxes(const struct render_scene *scene, struct box *hair, struct box *roots, struct box *all)
{
    const struct groom_strands *strands = scene->framed;
    hair_box(strands, hair);
    box_clear(roots);
    for (uint32_t i = 0; i < strands->n_strands; i++)
        if (strands->first[i] < strands->first[i + 1] && render_is_finite(strands->points[strands->first[i]]))
            box_add(roots, strands->points[strands->first[i]]);
    *all = *hair;
    for (uint32_t i = 0; scene->head && i < scene->head->n_vertices; i++)
        if (head_point_counts(roots, scene->head->points[i]))
            box_add(all, scene->head->points[i]);
}

/* Lights in the camera's frame: a key from the upper left, a rim from above and behind. */
static void place_lights(struct render_scene *scene, const struct axes *axes)
{
    static const double key[3] = {-0.45, 0.65, 0.62}, rim[3] = {0.55, 0.6, -0.58};
    for (int k = 0; k < 3; k++) {
        scene->key[k] = (float)((key[0] * axes->right[k] + key[1] * axes->up[k] + key[2] * axes->back[k]) / sqrt(dot(key, key)));
        scene->rim[k] = (float)((rim[0] * axes->right[k] + rim[1] * axes->up[k] + rim[2] * axes->back[k]) / sqrt(dot(rim, rim)));
        scene->view[k] = (float)axes->back[k];
    }
}

/* A full head has about 100 000 hairs of 0.08 mm; fewer strands are drawn wider, each for several. */
static float hair_width(const struct render_scene *scene, const struct box *hair)
{
    double full = box_diagonal(hair), n = (double)scene->strands->n_strands / scene->stride;
    double width = 0.00022 * full * sqrt(fmax(1, 60000 / n));
    return (float)fmin(width, full / 150);
}

groom_status render_frame(struct render_scene *scene, groom_view view, struct groom_diag *diag)
{
    struct box hair, roots, all;
    double eye[3];
    gather_boxes(scene, &hair, &roots, &all);
    if (!(hair.low[0] <= hair.high[0]))
        return groom_fail(diag, GROOM_EEMPTY, "no point of the strands is finite: there is nothing to draw");
    struct fitting fit = {.axes = &axes_of[view]};
    for (int k = 0; k < 3; k++)
        fit.centre[k] = 0.5 * ((double)all.low[k] + all.high[k]);
    fit.distance = 1e-3 + 0.55 * box_diagonal(&all);
    fit_all(&fit, scene, &roots);
    for (int k = 0; k < 3; k++)
        eye[k] = fit.centre[k] + fit.distance * fit.axes->back[k];
    groom_camera_look_at(eye, fit.centre, FIELD_OF_VIEW, scene->size * scene->samples, scene->size * scene->samples, &scene->camera);
    place_lights(scene, fit.axes);
    if (!(scene->width > 0))
        scene->width = hair_width(scene, &hair);
    if (scene->framed != scene->strands)
        hair_box(scene->strands, &hair);
    if (!(hair.low[0] <= hair.high[0]))
        return groom_fail(diag, GROOM_EEMPTY, "no point of the strands is finite: there is nothing to draw");
    /* fit_point has left every point in front of the camera, the corner of the box nearest to it too; of
     * strands that it is not framed for, those right before the lens are left out */
    double reach = 0;
    for (int k = 0; k < 3; k++)
        reach += fmax((hair.low[k] - fit.centre[k]) * fit.axes->back[k], (hair.high[k] - fit.centre[k]) * fit.axes->back[k]);
    scene->nearest = (float)fmax(fit.distance - reach, (scene->framed == scene->strands ? 1e-3 : 0.2) * fit.distance);
    return GROOM_OK;
}
