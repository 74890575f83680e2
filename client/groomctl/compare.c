/* compare: how alike strands are to a target, as a table. Ids are compared by the server, two files here. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "client/groomctl/transfer.h"
#include "groom/format.h"
#include "groom/mesh.h"
#include "groom/quality.h"
#include "groom/strands.h"
#include "proto/url.h"

/* --- by the server ---------------------------------------------------------------------------- */

static int ask_server(struct groomctl *ctl, const char *id, const char *target, const char *revision, cJSON **report)
{
    struct url url;
    struct http_response response;
    url_init(&url, strncmp(id, "str_", 4) ? "/v1/grooms" : "/v1/strands");
    url_segment(&url, id);
    url_segment(&url, "quality");
    url_query(&url, "revision", revision);
    url_query(&url, "with", target);
    if (url.overflow)
        return groomctl_usage_error("compare", "%.40s... is no id", id);
    int status = api_call(ctl, &(struct http_request){.method = "GET", .path = url.text, .idle_timeout_s = 300}, &response);
    *report = status == DONE ? cJSON_ParseWithLength(response.body, response.n_body) : NULL;
    http_response_finish(&response);
    if (status == DONE && !*report) {
        fputs("groomctl: the server's answer is not JSON; is this a groomd?\n", stderr);
        status = REFUSED;
    }
    return status;
}

static int save_picture(struct groomctl *ctl, const struct arguments *arguments, const char *path)
{
    static const char *const passed_on[] = {"of", "view", "size", "revision"};
    const char *id = arguments->operands[0];
    struct url url;
    if (strncmp(id, "grm_", 4))
        return groomctl_usage_error("compare", "--picture shows a groom beside its target: %.40s is none", id);
    url_init(&url, "/v1/grooms");
    url_segment(&url, id);
    url_segment(&url, "quality.png");
    for (size_t i = 0; i < sizeof passed_on / sizeof passed_on[0]; i++)
        url_query(&url, passed_on[i], argument(arguments, passed_on[i]));
    url_query(&url, "with", arguments->n_operands > 1 ? arguments->operands[1] : NULL);
    return download_said(ctl, path, download_file(ctl, url.text, path));
}

/* --- here ------------------------------------------------------------------------------------------ */

static groom_status read_file(const char *path, struct groom_frame frame, const struct groom_context *context,
                              struct groom_strands **strands, struct groom_mesh **head, struct groom_diag *diag)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return groom_fail(diag, GROOM_EIO, "%.200s cannot be opened", path);
    struct groom_source source = groom_source_from_fd(fileno(file));
    struct groom_read_options read = {.frame = frame};
    struct groom_mesh_read_options read_head = {.frame = frame};
    groom_status st = head ? groom_mesh_read(&source, &read_head, context, head, NULL, diag)
                           : groom_strands_read(&source, &read, context, strands, NULL, diag);
    fclose(file);
    return st;
}

static groom_status measure(const char *path, const char *target_path, const char *head_path, struct groom_frame frame,
                            const struct groom_context *context, struct groom_quality *quality, struct groom_diag *diag)
{
    struct groom_strands *strands = NULL, *target_strands = NULL;
    struct groom_mesh *head = NULL;
    struct groom_quality_target *target = NULL;
    groom_status st;
    if ((st = read_file(path, frame, context, &strands, NULL, diag)) != GROOM_OK ||
        (st = read_file(target_path, frame, context, &target_strands, NULL, diag)) != GROOM_OK ||
        (head_path && (st = read_file(head_path, frame, context, NULL, &head, diag)) != GROOM_OK) ||
        (st = groom_quality_target_create(target_strands, head, NULL, context, &target, diag)) != GROOM_OK)
        goto out;
    st = groom_quality_compare(target, strands, context, quality, diag);
out:
    groom_quality_target_destroy(target);
    groom_mesh_destroy(head);
    groom_strands_destroy(target_strands);
    groom_strands_destroy(strands);
    return st;
}

static int compare_files(const struct arguments *arguments, cJSON **report)
{
    const char *unit = argument(arguments, "unit"), *up = argument(arguments, "up");
    struct groom_frame frame = {.unit_m = 1};
    struct groom_context context = {0};
    struct groom_quality quality;
    struct groom_diag diag = {0};
    char *json = NULL;
    if (unit && groom_unit_parse(unit, &frame.unit_m, &diag) != GROOM_OK)
        return groomctl_usage_error("compare", "%s", diag.detail);
    if (up && groom_up_parse(up, &frame.up, &diag) != GROOM_OK)
        return groomctl_usage_error("compare", "%s", diag.detail);
    groom_status st = groom_pool_create(0, &context.pool);
    if (st == GROOM_OK)
        st = measure(arguments->operands[0], arguments->operands[1], argument(arguments, "head-file"), frame, &context,
                     &quality, &diag);
    if (st == GROOM_OK)
        st = groom_quality_print(&quality, NULL, &json, &diag);
    groom_pool_destroy(context.pool);
    if (st != GROOM_OK)
        fprintf(stderr, "groomctl: %s\n  %s\n", groom_status_message(st), diag.detail);
    *report = json ? cJSON_Parse(json) : NULL;
    free(json);
    return *report ? DONE : REFUSED;
}

/* --- the table --------------------------------------------------------------------------------------- */

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

static double value(const cJSON *object, const char *name) { return api_number(object, name, NAN); }

static void print_distance(const cJSON *report, const char *name, const char *label, double scale)
{
    const cJSON *fitted = member(member(report, "fitted"), name), *drawn = member(member(report, "drawn"), name);
    double floor = value(fitted, "floor"), distance = value(fitted, "distance");
    printf("  %-34s %10.4g %10.4g %9.2fx", label, scale * floor, scale * distance, floor > 0 ? distance / floor : NAN);
    if (cJSON_IsObject(drawn))
        printf(" %10.4g", scale * value(drawn, "distance"));
    putchar('\n');
}

static void print_scores(const cJSON *report)
{
    const cJSON *score;
    int k = 0;
    puts("places within a tolerance          precision     recall    F-score      floor   (nearest only)");
    cJSON_ArrayForEach(score, member(member(report, "fitted"), "scores")) {
        const cJSON *drawn = cJSON_GetArrayItem(member(member(report, "drawn"), "scores"), k++);
        printf("  %.0f mm, %2.0f degrees                   %.3f      %.3f      %.3f      %.3f   (%.3f)", 1000 * value(score, "distance"),
               value(score, "angle") * 57.29577951308232, value(score, "precision"), value(score, "recall"), value(score, "f_score"),
               value(score, "floor"), value(score, "nearest_f_score"));
        if (drawn)
            printf("   drawn %.3f", value(drawn, "f_score"));
        putchar('\n');
    }
}

static void print_nearest(const cJSON *report, const char *name, const char *label)
{
    const cJSON *nearest = member(member(member(report, "fitted"), "nearest"), name);
    printf("  %-34s %10.2f %10.2f\n", label, 1000 * value(nearest, "mean"), 1000 * value(nearest, "p95"));
}

static void print_rest(const cJSON *report)
{
    const cJSON *fitted = member(report, "fitted"), *paired = member(fitted, "paired"), *head = member(fitted, "inside_head");
    if (cJSON_IsObject(paired))
        printf("strand against strand: %.2f mm, %.1f degrees\n", 1000 * value(paired, "distance"),
               value(paired, "direction") * 57.29577951308232);
    if (cJSON_IsObject(head))
        printf("inside the head: %.0f strands, %.2f %% of the length; of the target %.0f, %.2f %%\n",
               value(member(head, "groom"), "strands"), 100 * value(member(head, "groom"), "share"),
               value(member(head, "target"), "strands"), 100 * value(member(head, "target"), "share"));
}

static void print_table(const cJSON *report)
{
    const cJSON *counts = member(report, "strands");
    printf("%.0f strands, %.1f m; target %.0f strands, %.1f m\n", value(counts, "groom"), value(counts, "groom_length"),
           value(counts, "target"), value(counts, "target_length"));
    print_scores(report);
    puts("nearest distance (mm)                    mean        95 %");
    print_nearest(report, "to_target", "to the target");
    print_nearest(report, "to_groom", "from the target");
    print_nearest(report, "floor", "between halves of the target");
    printf("distances of distributions              floor      these   of floor%s\n",
           cJSON_IsObject(member(report, "drawn")) ? "      drawn" : "");
    print_distance(report, "spectra", "spectra, sliced Wasserstein", 1);
    print_distance(report, "segments", "segments, sliced Wasserstein", 1);
    print_distance(report, "curvature", "curvature (1/m)", 1);
    print_distance(report, "torsion", "torsion (rad/m)", 1);
    print_distance(report, "length", "length (mm)", 1000);
    print_rest(report);
}

static int is_id(const char *text) { return !strncmp(text, "str_", 4) || !strncmp(text, "grm_", 4); }
static int is_file(const char *text) { return !is_id(text) || access(text, R_OK) == 0; }

int command_compare(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *what = arguments->operands[0], *target = arguments->n_operands > 1 ? arguments->operands[1] : NULL;
    cJSON *report = NULL;
    if (argument(arguments, "picture"))
        return save_picture(ctl, arguments, argument(arguments, "picture"));
    if (is_file(what) != (target ? is_file(target) : is_file(what)))
        return groomctl_usage_error("compare", "both are ids or both are files: upload the file first");
    if (!target && strncmp(what, "grm_", 4))
        return groomctl_usage_error("compare", "a target is needed: only a groom has one of its own");
    int status = is_file(what) ? compare_files(arguments, &report)
                               : ask_server(ctl, what, target, argument(arguments, "revision"), &report);
    if (status == DONE && ctl->json)
        api_print(ctl, report);
    else if (status == DONE)
        print_table(report);
    cJSON_Delete(report);
    return status;
}
