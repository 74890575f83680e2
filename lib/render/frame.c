/* Where the camera stands: where it was put, or far enough, along the view's axis, for all of the hair and the
 * head around it; and the lights, which stand with the camera so that every view is lit alike. */
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

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

struct fitting {
    struct render_axes axes;
    double centre[3];
    double distance;      /* of the camera from the centre */
    double out_of_middle; /* metres that a picture's half height and half width show, a metre away */
    double out_of_side;
    int all_around;
};

static void at_least(double *distance, double least) { *distance = fmax(*distance, least); }

/* Step back until the point is in the picture. */
static void fit_point(struct fitting *fit, const float p[3])
{
    double d[3] = {p[0] - fit->centre[0], p[1] - fit->centre[1], p[2] - fit->centre[2]};
    double back = dot(d, fit->axes.back);
    at_least(&fit->distance, fabs(dot(d, fit->axes.right)) * MARGIN / fit->out_of_side + back);
    at_least(&fit->distance, fabs(dot(d, fit->axes.up)) * MARGIN / fit->out_of_middle + back);
}

/* The same while the point goes around the vertical axis: a circle of radius r at a height h. Across it is
 * r sin a, and r cos a nearer; what the picture's sides ask for has its most where both pull alike. */
static void fit_circle(struct fitting *fit, const float p[3])
{
    double x = p[0] - fit->centre[0], h = p[1] - fit->centre[1], z = p[2] - fit->centre[2], r = hypot(x, z);
    double rise = fit->axes.back[1], level = hypot(fit->axes.back[0], fit->axes.back[2]);
    at_least(&fit->distance, r * hypot(MARGIN / fit->out_of_side, level) + h * rise);
    for (int end = -1; end <= 1; end += 2)
        at_least(&fit->distance, fabs(h * level - end * r * rise) * MARGIN / fit->out_of_middle + end * r * level + h * rise);
}

static void fit_any(struct fitting *fit, const float p[3])
{
    if (fit->all_around)
        fit_circle(fit, p);
    else
        fit_point(fit, p);
}

static void fit_all(struct fitting *fit, const struct render_scene *scene, const struct box *roots)
{
    for (uint32_t i = 0; i < scene->framed->n_vertices; i++)
        if (render_is_finite(scene->framed->points[i]))
            fit_any(fit, scene->framed->points[i]);
    for (uint32_t i = 0; scene->head && i < scene->head->n_vertices; i++)
        if (head_point_counts(roots, scene->head->points[i]))
            fit_any(fit, scene->head->points[i]);
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
static void place_lights(struct render_scene *scene, const struct render_axes *axes)
{
    static const double key[3] = {-0.45, 0.65, 0.62}, rim[3] = {0.55, 0.6, -0.58};
    for (int k = 0; k < 3; k++) {
        scene->key[k] = (float)((key[0] * axes->right[k] + key[1] * axes->up[k] + key[2] * axes->back[k]) / sqrt(dot(key, key)));
        scene->rim[k] = (float)((rim[0] * axes->right[k] + rim[1] * axes->up[k] + rim[2] * axes->back[k]) / sqrt(dot(rim, rim)));
    }
}

/* A full head has about 100 000 hairs of 0.08 mm; fewer strands are drawn wider, each for several. */
static float hair_width(const struct render_scene *scene, const struct box *hair)
{
    double full = box_diagonal(hair), n = (double)scene->strands->n_strands / scene->stride;
    double width = 0.00022 * full * sqrt(fmax(1, 60000 / n));
    return (float)fmin(width, full / 150);
}

/* The camera's distance from the centre, for all that there is to see; and what it looks at. */
static void stand_back(struct fitting *fit, const struct render_scene *scene, const struct box *roots, const struct box *all,
                       const struct groom_render_camera *camera)
{
    for (int k = 0; k < 3; k++)
        fit->centre[k] = camera->has_target || camera->is_placed ? camera->target[k] : 0.5 * ((double)all->low[k] + all->high[k]);
    if (camera->is_placed)
        for (int k = 0; k < 3; k++)
            fit->distance += (camera->eye[k] - camera->target[k]) * fit->axes.back[k];
    else if (camera->distance > 0)
        fit->distance = camera->distance;
    else {
        fit->distance = 1e-3 + 0.55 * box_diagonal(all);
        fit_all(fit, scene, roots);
    }
}

static void set_camera(struct render_scene *scene, const struct fitting *fit)
{
    struct groom_camera *c = &scene->camera;
    *c = (struct groom_camera){.width = scene->width_px * scene->samples, .height = scene->height_px * scene->samples};
    c->fx = c->fy = 0.5 * c->height / fit->out_of_middle;
    c->cx = 0.5 * c->width;
    c->cy = 0.5 * c->height;
    for (int k = 0; k < 3; k++) {
        c->rotation[k] = fit->axes.right[k];
        c->rotation[3 + k] = -fit->axes.up[k];
        c->rotation[6 + k] = -fit->axes.back[k];
        scene->eye[k] = (float)(fit->centre[k] + fit->distance * fit->axes.back[k]);
    }
    for (int row = 0; row < 3; row++)
        for (int k = 0; k < 3; k++)
            c->translation[row] -= c->rotation[3 * row + k] * (fit->centre[k] + fit->distance * fit->axes.back[k]);
}

/* Where the camera was framed for the hair, every point is before it, the nearest corner of the box too. Where it was
 * not, what is right before the lens is left out: a few strands would hide the others. */
static float least_depth(const struct render_scene *scene, const struct fitting *fit, const struct box *hair)
{
    double reach = 0;
    for (int k = 0; k < 3; k++)
        reach += fmax((hair->low[k] - fit->centre[k]) * fit->axes.back[k], (hair->high[k] - fit->centre[k]) * fit->axes.back[k]);
    return (float)fmax(fit->distance - reach, (scene->framed != scene->strands ? 0.2 : scene->culls ? 0.02 : 1e-3) * fit->distance);
}

static struct groom_render_camera camera_or_front(const struct groom_render_options *options)
{
    return options->camera ? *options->camera : (struct groom_render_camera){0};
}

groom_status render_frame(struct render_scene *scene, const struct groom_render_options *options, struct groom_diag *diag)
{
    struct box hair, roots, all;
    const struct groom_render_camera camera = camera_or_front(options);
    struct render_axes front;
    gather_boxes(scene, &hair, &roots, &all);
    if (!(hair.low[0] <= hair.high[0]))
        return groom_fail(diag, GROOM_EEMPTY, "no point of the strands is finite: there is nothing to draw");
    struct fitting fit = {.all_around = camera.all_around, .out_of_middle = tan(0.5 * (camera.fov_y > 0 ? camera.fov_y : FIELD_OF_VIEW))};
    fit.out_of_side = fit.out_of_middle * scene->width_px / scene->height_px;
    if (options->camera)
        render_axes_of_camera(&camera, &fit.axes);
    else
        render_axes_of_view(options->view, &fit.axes);
    stand_back(&fit, scene, &roots, &all, &camera);
    set_camera(scene, &fit);
    render_axes_of_view(GROOM_VIEW_FRONT, &front);
    place_lights(scene, camera.light_stands ? &front : &fit.axes);
    if (!(scene->width > 0))
        scene->width = hair_width(scene, &hair);
    if (scene->framed != scene->strands)
        hair_box(scene->strands, &hair);
    if (!(hair.low[0] <= hair.high[0]))
        return groom_fail(diag, GROOM_EEMPTY, "no point of the strands is finite: there is nothing to draw");
    scene->culls = scene->framed != scene->strands || camera.is_placed || camera.has_target || camera.distance > 0;
    scene->nearest = least_depth(scene, &fit, &hair);
    return GROOM_OK;
}
