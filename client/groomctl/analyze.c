/* analyze: what kind of hair it is, as a table for people. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "client/groomctl/transfer.h"
#include "proto/url.h"

#define BAR 30        /* characters of a whole bar */
#define ROWS 8        /* of a histogram: its bins are put together */

static const cJSON *member(const cJSON *object, const char *name) { return cJSON_GetObjectItemCaseSensitive(object, name); }

static double number_of(const cJSON *object, const char *part, const char *name)
{
    return api_number(member(object, part), name, 0);
}

/* A bar of 0..1; something that is there shows. */
static const char *bar(double share)
{
    static const char full[BAR + 1] = "##############################";
    double length = ceil(fmin(fmax(share, 0), 1) * BAR - 0.05);
    return full + BAR - (int)fmax(length, 0);
}

/* --- parts of the table ------------------------------------------------------------------ */

static void print_head(const cJSON *a)
{
    const char *groom = api_text(a, "groom");
    double strands = number_of(a, "analysed", "strands"), of = number_of(a, "analysed", "of");
    printf("%s", groom[0] ? groom : api_text(a, "strands_id"));
    if (groom[0])
        printf(" revision %.0f", api_number(a, "revision", 0));
    printf(": %.0f strands", strands);
    if (strands < of)
        printf(" (a fair sample of %.0f)", of);
    printf(", %.4g m of hair, %.4g m a strand\n\n", number_of(a, "analysed", "length"),
           strands > 0 ? number_of(a, "analysed", "length") / strands : 0);
}

static void print_shares(const cJSON *a)
{
    static const char *const kinds[] = {"coiled", "wavy", "straight"};
    for (int k = 0; k < 3; k++) {
        double share = number_of(a, "share", kinds[k]);
        printf("  %-9s%6.1f %%  %s\n", kinds[k], 100 * share, bar(share));
    }
    if (number_of(a, "share", "straight") < 1)
        printf("  of what winds, %.0f %% to the left and %.0f %% to the right\n", 100 * number_of(a, "hand", "left"),
               100 * number_of(a, "hand", "right"));
    putchar('\n');
}

/* Bins put together to a few rows; the longest bar is the largest row. */
static void print_distribution(const cJSON *a, const char *name, const char *title, const char *unit, double scale)
{
    const cJSON *histogram = member(member(a, name), "histogram"), *weights = member(histogram, "weight"), *weight;
    double rows[ROWS] = {0}, sum = 0, most = 0, high = scale * api_number(histogram, "high", 0);
    int n = cJSON_GetArraySize(weights), k = 0;
    cJSON_ArrayForEach(weight, weights)
    {
        rows[k++ * ROWS / n] += weight->valuedouble;
        sum += weight->valuedouble;
    }
    if (!(sum > 0))
        return;
    for (int r = 0; r < ROWS; r++)
        most = fmax(most, rows[r]);
    printf("%s, %.3g %s in the mean\n", title, scale * number_of(a, name, "mean"), unit);
    for (int r = 0; r < ROWS; r++) {
        char from[16], to[16] = "";
        snprintf(from, sizeof from, "%.3g", high * r / ROWS);
        if (r + 1 < ROWS) /* the last one has no end */
            snprintf(to, sizeof to, "%.3g", high * (r + 1) / ROWS);
        printf("  %6s %s %-6s %s %5.1f %%  %s\n", from, to[0] ? "-" : "+", to, unit, 100 * rows[r] / sum, bar(rows[r] / most));
    }
    putchar('\n');
}

static void print_switchbacks(const cJSON *a)
{
    enum { SHOWN = 5 };
    const cJSON *switchbacks = member(a, "switchbacks"), *item;
    double count = api_number(switchbacks, "count", 0);
    int shown = 0;
    if (!(count > 0)) {
        printf("no switchbacks\n");
        return;
    }
    printf("%.0f switchback%s on %.0f strand%s:", count, count > 1 ? "s" : "", api_number(switchbacks, "strands", 0),
           api_number(switchbacks, "strands", 0) > 1 ? "s" : "");
    cJSON_ArrayForEach(item, member(switchbacks, "list"))
    {
        if (shown++ == SHOWN)
            break;
        printf("%s strand %.0f at %.0f %%", shown > 1 ? "," : "", api_number(item, "strand", 0),
               100 * api_number(item, "at", 0));
    }
    printf("%s\n", count > SHOWN ? ", …" : "");
}

static void print_conversion(const cJSON *a)
{
    const cJSON *conversion = member(a, "conversion");
    double degenerate = api_number(conversion, "degenerate", 0);
    printf("super-helices of %.0f to %.0f elements (median %.0f); a strand's largest distance from its own is %.2g %% of "
           "its mean segment (median; at most %.2g %%)\n",
           number_of(conversion, "elements", "min"), number_of(conversion, "elements", "max"),
           number_of(conversion, "elements", "median"), 100 * number_of(conversion, "error", "share_median"),
           100 * number_of(conversion, "error", "share_max"));
    if (degenerate > 0)
        printf("%.0f strand%s of no length\n", degenerate, degenerate > 1 ? "s" : "");
}

static void print_table(const cJSON *a)
{
    print_head(a);
    print_shares(a);
    print_distribution(a, "radius", "curl radius", "mm", 1000);
    print_distribution(a, "frequency", "turns per metre", "/m", 1);
    print_distribution(a, "turns", "turns of a strand", "", 1);
    print_switchbacks(a);
    print_conversion(a);
}

/* --- the command ------------------------------------------------------------------------------ */

int command_analyze(struct groomctl *ctl, const struct arguments *arguments)
{
    static const char *const passed_on[] = {"revision",       "count",      "elements", "tolerance",
                                            "straight-below", "wavy-below", "arrays"};
    static const char *const parameters[] = {"revision",       "count",      "elements", "tolerance",
                                             "straight_below", "wavy_below", "arrays"};
    const char *id = arguments->operands[0];
    const char *binary = argument(arguments, "binary");
    struct url url;
    cJSON *answer = NULL;
    url_init(&url, !strncmp(id, "str_", 4) ? "/v1/strands" : "/v1/grooms");
    url_segment(&url, id);
    url_segment(&url, "analysis");
    for (size_t k = 0; k < sizeof passed_on / sizeof passed_on[0]; k++)
        url_query(&url, parameters[k], argument(arguments, passed_on[k]));
    if (binary) {
        url_query(&url, "format", "binary");
        return download_said(ctl, binary, download_file(ctl, url.text, binary));
    }
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &answer);
    if (status == DONE && ctl->json)
        api_print(ctl, answer);
    else if (status == DONE)
        print_table(answer);
    cJSON_Delete(answer);
    return status;
}
