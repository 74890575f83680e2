#include "server/worker/retarget_hairline.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/hairline.h"
#include "groom/spatial.h"
#include "server/worker/retarget_body.h"

static groom_status parse(const cJSON *asked, struct groom_hairline *hairline, struct groom_diag *diag)
{
    char *text = cJSON_PrintUnformatted(asked);
    groom_status st = text ? groom_hairline_parse(text, strlen(text), hairline, diag)
                           : groom_fail(diag, GROOM_ENOMEM, "no memory for a hairline");
    cJSON_free(text);
    return st;
}

/* --- the report ------------------------------------------------------------------------------ */

static void add_numbers(cJSON *json, const struct groom_relocation_report *report)
{
    const struct {
        const char *name;
        double value;
    } rows[] = {{"load_steps", report->load_steps},   {"newton_iterations", report->newton_iterations},
                {"energy", report->energy},           {"density_l1", report->density_l1},
                {"density_linf", report->density_linf}, {"flipped", report->n_flipped},
                {"mean_move", report->mean_move},     {"max_move", report->max_move},
                {"boundary_error", report->boundary_error}, {"bald", report->n_bald}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        cJSON_AddNumberToObject(json, rows[i].name, rows[i].value);
}

/* The edit with everything filled in, and what it did. */
static groom_status print_report(const struct groom_hairline *edit, const struct groom_relocation_report *report,
                                 cJSON **json, struct groom_diag *diag)
{
    char *text = NULL;
    groom_status st = groom_hairline_print(edit, &text, diag);
    if (st != GROOM_OK)
        return st;
    *json = cJSON_CreateObject();
    cJSON_AddItemToObject(*json, "edit", cJSON_Parse(text));
    add_numbers(*json, report);
    free(text);
    return GROOM_OK;
}

/* --- colours --------------------------------------------------------------------------------- */

/* From the region's triangles to the roots in them; 0 beyond the region. */
static groom_status spread_density(const struct groom_scalp_region *region, const struct groom_mesh *body,
                                   const float *of_triangle, const float (*roots)[3], struct retarget_hairline *hairline,
                                   const struct groom_context *context, struct groom_diag *diag)
{
    const uint32_t *triangles;
    uint32_t n_triangles = groom_scalp_region_triangles(region, &triangles);
    float *of_body = calloc(body->n_triangles, sizeof *of_body);
    struct groom_bvh *surface = NULL;
    groom_status st = of_body ? groom_bvh_create(body, context, &surface, diag) : GROOM_ENOMEM;
    for (uint32_t i = 0; st == GROOM_OK && i < n_triangles; i++)
        of_body[triangles[i]] = of_triangle[i];
    for (uint32_t i = 0; st == GROOM_OK && i < hairline->n; i++) {
        struct groom_surface_point at;
        hairline->density[i] = groom_bvh_closest(surface, roots[i], INFINITY, &at) ? of_body[at.triangle] : 0;
    }
    groom_bvh_destroy(surface);
    free(of_body);
    return st;
}

static groom_status relocate(const struct groom_scalp_region *region, const struct groom_hairline *edit,
                             const struct groom_mesh *body, const float (*roots)[3], const struct groom_context *context,
                             struct retarget_hairline *hairline, struct groom_diag *diag)
{
    const uint32_t *triangles;
    struct groom_relocation_report report = {0};
    float *density = malloc((groom_scalp_region_triangles(region, &triangles) + 1) * sizeof *density);
    groom_status st = density ? groom_hairline_relocate(region, edit, context, hairline->roots, hairline->bald, density,
                                                        &report, diag)
                              : groom_fail(diag, GROOM_ENOMEM, "no memory for a hairline");
    if (st == GROOM_OK)
        st = spread_density(region, body, density, roots, hairline, context, diag);
    if (st == GROOM_OK)
        st = print_report(edit, &report, &hairline->report, diag);
    hairline->n_bald = report.n_bald;
    free(density);
    return st;
}

groom_status retarget_hairline_edit(const cJSON *asked, const char *place, const struct groom_mesh *body,
                                    const struct groom_skeleton *skeleton, const float (*roots)[3], uint32_t n,
                                    const struct groom_context *context, struct retarget_hairline *hairline,
                                    struct groom_diag *diag)
{
    struct groom_hairline *edit = malloc(sizeof *edit);
    struct groom_scalp_region *region = NULL;
    *hairline = (struct retarget_hairline){.n = n, .roots = malloc(n * sizeof *roots), .density = malloc(n * sizeof(float)),
                                           .bald = calloc(n, 1)};
    groom_status st = edit && hairline->roots && hairline->density && hairline->bald
                          ? parse(asked, edit, diag)
                          : groom_fail(diag, GROOM_ENOMEM, "no memory for a hairline");
    if (st == GROOM_OK)
        st = groom_scalp_region_create(body, roots, n, skeleton, NULL, context, &region, NULL, diag);
    if (st == GROOM_OK)
        st = relocate(region, edit, body, roots, context, hairline, diag);
    groom_scalp_region_destroy(region);
    free(edit);
    if (st != GROOM_OK)
        retarget_hairline_finish(hairline);
    return retarget_complain(st, place, diag);
}

void retarget_hairline_finish(struct retarget_hairline *hairline)
{
    free(hairline->roots);
    free(hairline->density);
    free(hairline->bald);
    cJSON_Delete(hairline->report);
    *hairline = (struct retarget_hairline){0};
}
