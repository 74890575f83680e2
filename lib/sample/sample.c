/* A sample: head, truth, capture, cameras. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "sample/parts.h"

#define PI 3.14159265358979323846
#define PICTURE 1024 /* pixels */

/* --- styles and options ----------------------------------------------------------- */

static const char *const style_names[] = {
#define STYLE_NAME(constant, name, text) [constant] = name,
    GROOM_SAMPLE_STYLE_LIST(STYLE_NAME)
#undef STYLE_NAME
};

const char *groom_sample_style_name(groom_sample_style style)
{
    return (unsigned)style < GROOM_SAMPLE_STYLE_COUNT ? style_names[style] : "unknown";
}

groom_status groom_sample_style_parse(const char *name, groom_sample_style *style, struct groom_diag *diag)
{
    for (unsigned i = 0; i < GROOM_SAMPLE_STYLE_COUNT; i++)
        if (strcmp(name, style_names[i]) == 0) {
            *style = (groom_sample_style)i;
            return GROOM_OK;
        }
#define STYLE_WORD(constant, slug, text) " " slug
    return groom_fail(diag, GROOM_EINVAL, "there is no style \"%.40s\"; choose one of:%s", name,
                      GROOM_SAMPLE_STYLE_LIST(STYLE_WORD));
#undef STYLE_WORD
}

void groom_sample_options_init(groom_sample_style style, struct groom_sample_options *options)
{
    const struct sample_style *s = sample_style_of(style);
    *options = (struct groom_sample_options){.style = style, .n_strands = s->n_strands, .n_vertices = 100,
                                             .n_guides = s->n_guides, .n_operator_guides = s->n_operator_guides,
                                             .seed = 1, .n_cameras = 16};
}

void groom_sample_options_capture(groom_sample_style style, struct groom_sample_options *options)
{
    groom_sample_options_init(style, options);
    options->noise_m = 0.0005;
    options->missing = 0.03;
    options->inner_short = 0.10;
    options->off_scalp_m = 0.003;
    options->duplicates = 0.01;
}

static groom_status refuse(struct groom_diag *diag, const char *name, double minimum, double maximum)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/%s", name);
    return groom_fail_field(diag, GROOM_EINVAL, pointer, "%s must be from %.9g to %.9g", name, minimum, maximum);
}

static groom_status check(const struct groom_sample_options *o, struct groom_diag *diag)
{
    const struct { const char *name; double value, minimum, maximum; } rows[] = {
        {"style", o->style, 0, GROOM_SAMPLE_STYLE_COUNT - 1},
        {"n_strands", o->n_strands, 1, 1e6},
        {"n_vertices", o->n_vertices, 3, 1000},
        {"n_guides", o->n_guides, 1, o->n_strands},
        {"n_operator_guides", o->n_operator_guides, 1, o->n_guides},
        {"noise_m", o->noise_m, 0, 0.1},
        {"missing", o->missing, 0, 0.9},
        {"inner_short", o->inner_short, 0, 1},
        {"off_scalp_m", o->off_scalp_m, 0, 0.05},
        {"duplicates", o->duplicates, 0, 1},
        {"n_cameras", o->n_cameras, 0, 256},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (!(rows[i].value >= rows[i].minimum && rows[i].value <= rows[i].maximum))
            return refuse(diag, rows[i].name, rows[i].minimum, rows[i].maximum);
    return GROOM_OK;
}

/* --- cameras ------------------------------------------------------------------------ */

/* Two rings around the head, the higher one turned by half a step. */
static void place_cameras(uint32_t n, struct groom_camera *cameras)
{
    uint32_t lower = (n + 1) / 2;
    for (uint32_t i = 0; i < n; i++) {
        int high = i >= lower;
        uint32_t in_ring = high ? n - lower : lower;
        double turn = 2 * PI * (high ? i - lower + 0.5 : i) / in_ring, elevation = high ? 0.75 : 0.12;
        double eye[3] = {sample_head_centre[0] + 1.1 * cos(elevation) * sin(turn),
                         sample_head_centre[1] + 1.1 * sin(elevation),
                         sample_head_centre[2] + 1.1 * cos(elevation) * cos(turn)};
        double target[3] = {sample_head_centre[0], sample_head_centre[1] - 0.05, sample_head_centre[2]};
        groom_camera_look_at(eye, target, 0.6, PICTURE, PICTURE, &cameras[i]);
        snprintf(cameras[i].name, sizeof cameras[i].name, "camera_%03u", i);
    }
}

groom_status groom_sample_cameras_print(const struct groom_sample *sample, char **out, struct groom_diag *diag)
{
    return groom_cameras_print(sample->cameras, sample->n_cameras, out, diag);
}

/* --- the whole ------------------------------------------------------------------------ */

void groom_sample_destroy(struct groom_sample *sample)
{
    if (!sample)
        return;
    const struct groom_allocator *allocator = sample->allocator;
    memory_release(allocator, sample->strand_of, sample->capture ? sample->capture->n_strands : 0,
                   sizeof *sample->strand_of);
    memory_release(allocator, sample->cameras, sample->n_cameras, sizeof *sample->cameras);
    groom_strands_destroy(sample->capture);
    groom_destroy(sample->truth);
    groom_mesh_destroy(sample->head);
    memory_release(allocator, sample, 1, sizeof *sample);
}

groom_status groom_sample_create(const struct groom_sample_options *options, const struct groom_context *context,
                                 struct groom_sample **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_sample *sample;
    groom_status st = check(options, diag);
    if (st != GROOM_OK)
        return st;
    if (!(sample = memory_array_zero(allocator, 1, sizeof *sample)))
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a sample");
    sample->allocator = allocator;
    sample->n_cameras = options->n_cameras;
    if (!(sample->cameras = memory_array(allocator, options->n_cameras, sizeof *sample->cameras))) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for %u cameras", options->n_cameras);
        goto out;
    }
    place_cameras(options->n_cameras, sample->cameras);
    if ((st = sample_head_create(context, &sample->head, diag)) != GROOM_OK)
        goto out;
    if ((st = sample_truth_create(options, sample->head, context, &sample->truth, diag)) != GROOM_OK)
        goto out;
    if ((st = sample_capture_create(options, sample->truth, context, &sample->capture, &sample->strand_of, diag)) != GROOM_OK)
        goto out;
    *out = sample;
    sample = NULL;
out:
    groom_sample_destroy(sample);
    return st;
}
