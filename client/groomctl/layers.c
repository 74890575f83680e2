/* ruffle, sculpt, interpolate, curl-scale: edits in curvature space. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "client/groomctl/api.h"
#include "client/groomctl/json_path.h"
#include "client/groomctl/read_file.h"
#include "proto/url.h"

/* An option whose value goes into the body as it is. */
struct mapping {
    const char *option, *member;
};

static void set(cJSON *body, const char *name, cJSON *value)
{
    cJSON_DeleteItemFromObjectCaseSensitive(body, name);
    cJSON_AddItemToObject(body, name, value);
}

static void take_values(const struct arguments *arguments, const struct mapping *rows, cJSON *body)
{
    for (; rows->option; rows++) {
        const char *value = argument(arguments, rows->option);
        if (value)
            set(body, rows->member, json_value(value));
    }
}

/* What all four know; NULL where a file could not be read (and that was said). */
static cJSON *begin_body(const struct arguments *arguments)
{
    static const struct mapping rows[] = {{"layer", "layer"}, {"elements", "elements"}, {"head", "head"}, {0}};
    const char *file = argument(arguments, "body");
    cJSON *body = file ? read_json_file(file) : cJSON_CreateObject();
    if (!body)
        return NULL;
    take_values(arguments, rows, body);
    if (argument(arguments, "try")) {
        set(body, "commit", cJSON_CreateFalse());
        set(body, "points", cJSON_CreateFalse());
    }
    return body;
}

/* A word, or a number of clusters. */
static void take_groups(const struct arguments *arguments, cJSON *body)
{
    const char *value = argument(arguments, "groups");
    cJSON *groups = value ? json_value(value) : NULL;
    if (cJSON_IsNumber(groups)) {
        cJSON *clusters = cJSON_CreateObject();
        cJSON_AddItemToObject(clusters, "count", groups);
        groups = clusters;
    }
    if (groups)
        set(body, "groups", groups);
}

/* --- the call --------------------------------------------------------------------------------- */

static void print_edited(const struct groomctl *ctl, const cJSON *answer)
{
    const cJSON *strands = cJSON_GetObjectItemCaseSensitive(answer, "strands");
    const cJSON *error = cJSON_GetObjectItemCaseSensitive(answer, "anchor_error");
    const cJSON *contact = cJSON_GetObjectItemCaseSensitive(answer, "contact");
    if (ctl->json) {
        api_print(ctl, answer);
        return;
    }
    if (cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(answer, "committed")))
        printf("%s revision %.0f layer %.0f\n", api_text(answer, "groom"), api_number(answer, "revision", 0),
               api_number(answer, "layer", 0));
    printf("%.0f of %.0f strands changed in %.2f s\n", api_number(strands, "changed", 0), api_number(strands, "edited", 0),
           api_number(answer, "seconds", 0));
    if (error)
        printf("anchors miss by %.2f mm, at most %.2f mm\n", 1e3 * api_number(error, "mean", 0), 1e3 * api_number(error, "max", 0));
    if (cJSON_IsObject(contact) && api_number(contact, "entered", 0) > 0)
        printf("%.0f strands entered the head; %.0f are still inside, by at most %.2f mm\n", api_number(contact, "entered", 0),
               api_number(contact, "inside", 0), 1e3 * api_number(contact, "depth_after", 0));
}

/* The end of a job, and what it has made. */
static int wait_for(struct groomctl *ctl, const char *job_id)
{
    struct url url;
    url_init(&url, "/v1/jobs");
    url_segment(&url, job_id);
    for (;;) {
        cJSON *job = NULL;
        int status = api_json(ctl, "GET", url.text, NULL, "Prefer: wait=20", &job);
        if (status != DONE)
            return status;
        const char *state = api_text(job, "state");
        int over = strcmp(state, "queued") && strcmp(state, "running"), fine = !strcmp(state, "succeeded");
        if (fine)
            print_edited(ctl, cJSON_GetObjectItemCaseSensitive(job, "result"));
        else if (over)
            fprintf(stderr, "groomctl: %s %s: %s\n", job_id, state,
                    api_text(cJSON_GetObjectItemCaseSensitive(job, "error"), "detail"));
        cJSON_Delete(job);
        if (over)
            return fine ? DONE : REFUSED;
        if (groomctl_interrupted())
            return INTERRUPTED;
    }
}

static int take_answer(struct groomctl *ctl, const struct arguments *arguments, const cJSON *answer)
{
    const char *id = api_text(answer, "id");
    if (strncmp(id, "job_", 4)) {
        print_edited(ctl, answer);
        return DONE;
    }
    if (argument(arguments, "wait"))
        return wait_for(ctl, id);
    if (ctl->json)
        api_print(ctl, answer);
    else
        printf("%s\n", id);
    return DONE;
}

/* Takes the body over. */
static int edit(struct groomctl *ctl, const struct arguments *arguments, const char *part, cJSON *body)
{
    const char *id = arguments->operands[0], *revision = argument(arguments, "if-match");
    char header[80];
    struct url url;
    cJSON *answer = NULL;
    url_init(&url, strncmp(id, "str_", 4) ? "/v1/grooms" : "/v1/strands");
    url_segment(&url, id);
    url_segment(&url, part);
    snprintf(header, sizeof header, "If-Match: \"%.40s\"", revision ? revision : "");
    int status = api_json(ctl, "POST", url.text, body, revision ? header : NULL, &answer);
    if (status == DONE)
        status = take_answer(ctl, arguments, answer);
    cJSON_Delete(answer);
    cJSON_Delete(body);
    return status;
}

/* --- the commands -------------------------------------------------------------------------------- */

int command_ruffle(struct groomctl *ctl, const struct arguments *arguments)
{
    static const struct mapping rows[] = {
        {"rho", "rho"}, {"match-elements", "match_elements"}, {"blend", "blend"}, {"seed", "seed"}, {0}};
    cJSON *body = begin_body(arguments);
    if (!body)
        return REFUSED;
    take_values(arguments, rows, body);
    take_groups(arguments, body);
    return edit(ctl, arguments, "ruffle", body);
}

/* "12,1,0.1,1.6,0" */
static cJSON *anchor_of(const char *text)
{
    unsigned strand;
    double at, p[3];
    int end = 0;
    if (sscanf(text, "%u,%lf,%lf,%lf,%lf%n", &strand, &at, &p[0], &p[1], &p[2], &end) != 5 || text[end])
        return NULL;
    cJSON *anchor = cJSON_CreateObject();
    cJSON_AddNumberToObject(anchor, "strand", strand);
    cJSON_AddNumberToObject(anchor, "at", at);
    cJSON_AddItemToObject(anchor, "position", cJSON_CreateDoubleArray(p, 3));
    return anchor;
}

static int take_anchors(const struct arguments *arguments, cJSON *body)
{
    const char *text = argument_nth(arguments, "anchor", 0);
    if (!text)
        return DONE;
    cJSON *list = cJSON_CreateArray();
    for (size_t i = 0; (text = argument_nth(arguments, "anchor", i)); i++) {
        cJSON *anchor = anchor_of(text);
        if (!anchor) {
            cJSON_Delete(list);
            return groomctl_usage_error("sculpt", "\"%s\" is not STRAND,AT,X,Y,Z", text);
        }
        cJSON_AddItemToArray(list, anchor);
    }
    set(body, "anchors", list);
    return DONE;
}

/* A member that stands in a file of its own. */
static int take_file(const struct arguments *arguments, const char *name, cJSON *body)
{
    const char *file = argument(arguments, name);
    cJSON *value = file ? read_json_file(file) : NULL;
    if (file && !value)
        return REFUSED;
    if (value)
        set(body, name, value);
    return DONE;
}

static void take_clusters(const struct arguments *arguments, cJSON *body)
{
    const char *count = argument(arguments, "clusters"), *seed = argument(arguments, "cluster-seed");
    if (!count)
        return;
    cJSON *clusters = cJSON_CreateObject();
    cJSON_AddItemToObject(clusters, "count", json_value(count));
    if (seed)
        cJSON_AddItemToObject(clusters, "seed", json_value(seed));
    set(body, "clusters", clusters);
}

int command_sculpt(struct groomctl *ctl, const struct arguments *arguments)
{
    static const struct mapping rows[] = {{"stiffness", "stiffness"}, {0}};
    cJSON *body = begin_body(arguments);
    if (!body)
        return REFUSED;
    take_values(arguments, rows, body);
    take_clusters(arguments, body);
    if (argument(arguments, "through-head"))
        set(body, "avoid_head", cJSON_CreateFalse());
    int status = take_file(arguments, "anchors", body);
    if (status == DONE)
        status = take_file(arguments, "frames", body);
    if (status == DONE)
        status = take_anchors(arguments, body);
    if (status == DONE)
        return edit(ctl, arguments, "sculpt", body);
    cJSON_Delete(body);
    return status;
}

int command_interpolate(struct groomctl *ctl, const struct arguments *arguments)
{
    static const struct mapping rows[] = {
        {"t", "t"}, {"groom", "groom"}, {"revision", "revision"}, {"strands", "strands"}, {0}};
    cJSON *body = begin_body(arguments);
    if (!body)
        return REFUSED;
    take_values(arguments, rows, body);
    return edit(ctl, arguments, "interpolate", body);
}

int command_curl_scale(struct groomctl *ctl, const struct arguments *arguments)
{
    static const struct mapping rows[] = {{"radius", "radius"}, {"step", "step"}, {"keep", "keep"},
                                          {"largest-radius", "largest_radius"}, {"group", "group"}, {0}};
    const char *ramp = argument(arguments, "ramp");
    double at[2];
    int end = 0;
    if (ramp && (sscanf(ramp, "%lf,%lf%n", &at[0], &at[1], &end) != 2 || ramp[end]))
        return groomctl_usage_error("curl-scale", "\"%s\" is not ROOT,TIP (0,1)", ramp);
    cJSON *body = begin_body(arguments);
    if (!body)
        return REFUSED;
    take_values(arguments, rows, body);
    take_groups(arguments, body);
    if (ramp) {
        set(body, "ramp_root", cJSON_CreateNumber(at[0]));
        set(body, "ramp_tip", cJSON_CreateNumber(at[1]));
    }
    if (argument(arguments, "free-direction"))
        set(body, "hold_direction", cJSON_CreateFalse());
    return edit(ctl, arguments, "curl-scale", body);
}
