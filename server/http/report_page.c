/* The quality report of a groom as a page: pictures, a table, histograms. No script, and nothing from
 * another host. */
#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

#include "proto/json_text.h"
#include "server/http/handlers.h"
#include "server/http/html.h"
#include "server/http/quality_calls.h"

/* --- reading the report ------------------------------------------------------------------------ */

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

static double number(const cJSON *object, const char *name)
{
    const cJSON *item = member(object, name);
    return cJSON_IsNumber(item) ? item->valuedouble : 0;
}

static const char *text_of(const cJSON *object, const char *name)
{
    const char *text = cJSON_GetStringValue(member(object, name));
    return text ? text : "";
}

/* --- pictures ------------------------------------------------------------------------------------- */

static void put_picture(FILE *out, const cJSON *report, const char *of, const char *view)
{
    fprintf(out, "<img loading=\"lazy\" width=\"384\" height=\"384\" alt=\"%s, %s\" src=\"/v1/grooms/%s/quality.png?of=%s"
                 "&amp;view=%s&amp;size=768&amp;revision=%.0f&amp;with=%s\">",
            of, view, text_of(report, "id"), of, view, number(report, "revision"), text_of(report, "target"));
}

static void put_pictures(FILE *out, const cJSON *report)
{
    static const char *const views[] = {"front", "side", "back", "top"};
    fputs("<h2>Target and groom, the same camera</h2>\n<div class=\"pairs\">\n", out);
    for (size_t v = 0; v < sizeof views / sizeof views[0]; v++) {
        fputs("<figure>", out);
        put_picture(out, report, "target", views[v]);
        put_picture(out, report, "groom", views[v]);
        fprintf(out, "<figcaption>%s: target, groom</figcaption></figure>\n", views[v]);
    }
    fputs("</div>\n", out);
}

/* --- tables ------------------------------------------------------------------------------------------ */

static void put_distance(FILE *out, const cJSON *report, const char *name, const char *label, double scale)
{
    const cJSON *fitted = member(member(report, "fitted"), name), *drawn = member(member(report, "drawn"), name);
    double floor = number(fitted, "floor"), distance = number(fitted, "distance");
    fprintf(out, "<tr><td>%s</td><td>%.4g</td><td>%.4g</td>", label, scale * floor, scale * distance);
    fprintf(out, floor > 0 ? "<td>%.2f</td>" : "<td></td>", distance / floor);
    fprintf(out, drawn ? "<td>%.4g</td></tr>\n" : "<td></td></tr>\n", scale * number(drawn, "distance"));
}

static void put_distances(FILE *out, const cJSON *report)
{
    fputs("<h2>Distributions</h2>\n<p>Distances between one half of the target and the other half of the groom. The floor is "
          "that between the two halves of the target.</p>\n<table><tr><th></th><th>floor</th><th>groom</th><th>times the "
          "floor</th><th>with drawn random numbers</th></tr>\n",
          out);
    put_distance(out, report, "spectra", "spectra of segments, sliced Wasserstein (of 0.1 m)", 1);
    put_distance(out, report, "segments", "segments, sliced Wasserstein (of 0.1 m)", 1);
    put_distance(out, report, "curvature", "curvature (1/m)", 1);
    put_distance(out, report, "torsion", "torsion (rad/m)", 1);
    put_distance(out, report, "length", "length (mm)", 1000);
    fputs("</table>\n", out);
}

static void put_scores(FILE *out, const cJSON *report)
{
    const cJSON *score;
    int k = 0;
    fputs("<h2>Places</h2>\n<p>Shares of places along strands near which the other set has a segment of the same direction. In "
          "brackets: where the nearest segment alone decides.</p>\n<table><tr><th>tolerance</th><th>precision</th>"
          "<th>recall</th><th>F-score</th><th>floor</th><th>F-score with drawn random numbers</th></tr>\n",
          out);
    cJSON_ArrayForEach(score, member(member(report, "fitted"), "scores")) {
        const cJSON *drawn = cJSON_GetArrayItem(member(member(report, "drawn"), "scores"), k++);
        fprintf(out, "<tr><td>%.0f mm, %.0f°</td><td>%.3f (%.3f)</td><td>%.3f (%.3f)</td><td><b>%.3f</b> (%.3f)</td>"
                     "<td>%.3f (%.3f)</td>",
                1000 * number(score, "distance"), number(score, "angle") * 57.29577951308232, number(score, "precision"),
                number(score, "nearest_precision"), number(score, "recall"), number(score, "nearest_recall"),
                number(score, "f_score"), number(score, "nearest_f_score"), number(score, "floor"),
                number(score, "nearest_floor"));
        fprintf(out, drawn ? "<td>%.3f (%.3f)</td></tr>\n" : "<td></td></tr>\n", number(drawn, "f_score"),
                number(drawn, "nearest_f_score"));
    }
    fputs("</table>\n", out);
}

static void put_nearest(FILE *out, const cJSON *report, const char *name, const char *label)
{
    const cJSON *fitted = member(member(member(report, "fitted"), "nearest"), name);
    const cJSON *drawn = member(member(member(report, "drawn"), "nearest"), name);
    fprintf(out, "<tr><td>%s</td><td>%.2f</td><td>%.2f</td>", label, 1000 * number(fitted, "mean"), 1000 * number(fitted, "p95"));
    fprintf(out, drawn ? "<td>%.2f</td><td>%.2f</td></tr>\n" : "<td></td><td></td></tr>\n", 1000 * number(drawn, "mean"),
            1000 * number(drawn, "p95"));
}

static void put_head(FILE *out, const cJSON *report, const char *name, const char *label)
{
    const cJSON *head = member(member(member(report, "fitted"), "inside_head"), name);
    if (head)
        fprintf(out, "<tr><td>%s</td><td>%.0f</td><td>%.0f</td><td>%.2f %%</td><td>%.1f mm</td></tr>\n", label,
                number(head, "strands"), number(head, "vertices"), 100 * number(head, "share"), 1000 * number(head, "deepest"));
}

static void put_rest(FILE *out, const cJSON *report)
{
    const cJSON *fitted = member(report, "fitted"), *paired = member(fitted, "paired"), *drawn = member(member(report, "drawn"), "paired");
    fputs("<table><tr><th>nearest distance (mm)</th><th>mean</th><th>95 %</th><th>drawn: mean</th><th>95 %</th></tr>\n", out);
    put_nearest(out, report, "to_target", "from the groom to the target");
    put_nearest(out, report, "to_groom", "from the target to the groom");
    put_nearest(out, report, "floor", "between halves of the target");
    fputs("</table>\n", out);
    if (cJSON_IsObject(paired))
        fprintf(out, "<p>Strand against strand: vertices are %.2f mm apart, directions %.1f°; with drawn random numbers %.2f mm, "
                     "%.1f°.</p>\n",
                1000 * number(paired, "distance"), number(paired, "direction") * 57.29577951308232,
                1000 * number(drawn, "distance"), number(drawn, "direction") * 57.29577951308232);
    if (!cJSON_IsObject(member(fitted, "inside_head")))
        return;
    fputs("<h2>Inside the head</h2>\n<table><tr><th>more than 1 mm deep</th><th>strands</th><th>vertices</th><th>of the "
          "length</th><th>deepest</th></tr>\n",
          out);
    put_head(out, report, "target", "target");
    put_head(out, report, "groom", "groom");
    fputs("</table>\n", out);
}

/* --- histograms ---------------------------------------------------------------------------------------- */

#define PLOT_WIDTH 360.0
#define PLOT_HEIGHT 140.0

static double highest(const cJSON *bins, double so_far)
{
    const cJSON *bin;
    cJSON_ArrayForEach(bin, bins) so_far = bin->valuedouble > so_far ? bin->valuedouble : so_far;
    return so_far;
}

/* A histogram as a line of steps. */
static void put_steps(FILE *out, const cJSON *bins, double top, const char *style)
{
    double width = PLOT_WIDTH / (cJSON_GetArraySize(bins) > 0 ? cJSON_GetArraySize(bins) : 1), x = 0;
    const cJSON *bin;
    fprintf(out, "<path class=\"%s\" d=\"M0 %.0f", style, PLOT_HEIGHT);
    cJSON_ArrayForEach(bin, bins) {
        double y = PLOT_HEIGHT * (1 - (top > 0 ? bin->valuedouble / top : 0));
        fprintf(out, "L%.1f %.1fL%.1f %.1f", x, y, x + width, y);
        x += width;
    }
    fprintf(out, "L%.0f %.0f\"/>", PLOT_WIDTH, PLOT_HEIGHT);
}

static void put_plot(FILE *out, const cJSON *report, const char *name, const char *label, double scale)
{
    const cJSON *fitted = member(member(member(report, "fitted"), "histograms"), name);
    const cJSON *drawn = member(member(member(report, "drawn"), "histograms"), name);
    double top = highest(member(fitted, "groom"), highest(member(fitted, "target"), 0));
    if (drawn)
        top = highest(member(drawn, "groom"), top);
    fprintf(out, "<figure class=\"plot\"><svg role=\"img\" aria-label=\"%s\" viewBox=\"-1 -4 %.0f %.0f\">", label, PLOT_WIDTH + 2,
            PLOT_HEIGHT + 22);
    put_steps(out, member(fitted, "target"), top, "target");
    if (drawn)
        put_steps(out, member(drawn, "groom"), top, "drawn");
    put_steps(out, member(fitted, "groom"), top, "groom");
    fprintf(out, "<text x=\"0\" y=\"%.0f\">%.4g</text><text class=\"end\" x=\"%.0f\" y=\"%.0f\">%.4g</text></svg><figcaption>%s"
                 "</figcaption></figure>\n",
            PLOT_HEIGHT + 15, scale * number(fitted, "low"), PLOT_WIDTH, PLOT_HEIGHT + 15, scale * number(fitted, "high"), label);
}

static void put_plots(FILE *out, const cJSON *report)
{
    fputs("<p class=\"key\"><span class=\"target\">target</span> <span class=\"groom\">groom</span> <span class=\"drawn\">groom with "
          "drawn random numbers</span></p>\n<div class=\"pairs\">\n",
          out);
    put_plot(out, report, "curvature", "curvature (1/m)", 1);
    put_plot(out, report, "torsion", "torsion (rad/m)", 1);
    put_plot(out, report, "length", "length (mm)", 1000);
    fputs("</div>\n", out);
}

/* --- the page --------------------------------------------------------------------------------------------- */

static void put_page(FILE *out, const cJSON *report)
{
    const cJSON *counts = member(report, "strands");
    fprintf(out, "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
                 "content=\"width=device-width\"><title>quality of %s</title><link rel=\"stylesheet\" href=\"/status.css\"></head>\n"
                 "<body><h1>Quality of %s, revision %.0f</h1>\n<p>%.0f strands, %.1f m, against <code>%s</code>: %.0f strands, %.1f m. "
                 "<a href=\"/\">groomd</a> <a href=\"/v1/grooms/%s/quality?revision=%.0f&amp;with=%s\">as JSON</a></p>\n",
            text_of(report, "id"), text_of(report, "id"), number(report, "revision"), number(counts, "groom"),
            number(counts, "groom_length"), text_of(report, "target"), number(counts, "target"), number(counts, "target_length"),
            text_of(report, "id"), number(report, "revision"), text_of(report, "target"));
    put_pictures(out, report);
    put_scores(out, report);
    put_distances(out, report);
    put_plots(out, report);
    put_rest(out, report);
    fputs("</body></html>\n", out);
}

void page_quality(struct request *request)
{
    struct grooms_comparison what;
    struct groom_diag diag = {0};
    char *json = NULL, *text = NULL;
    size_t n_bytes = 0;
    if (!quality_query(request, &what))
        return;
    groom_status status = grooms_quality(request->service->grooms, &what, &json, &n_bytes, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    cJSON *report = json_text_parse(json, n_bytes, NULL);
    FILE *out = report ? open_memstream(&text, &n_bytes) : NULL;
    if (out) {
        put_page(out, report);
        html_respond(request, out, &text, &n_bytes);
    } else {
        respond_failure(request, GROOM_ENOMEM, NULL);
    }
    cJSON_Delete(report);
    free(json);
}
