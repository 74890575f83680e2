/* options and health: what the server can do, and how it is. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "client/groomctl/api.h"

/* --- options: the JSON Schema as a table ------------------------------------------------------- */

static void print_value(const cJSON *value)
{
    char *text = value ? cJSON_PrintUnformatted(value) : NULL;
    printf("%-12s  ", text ? text : "");
    free(text);
}

static void print_properties(const cJSON *schema, const char *prefix)
{
    const cJSON *property;
    cJSON_ArrayForEach(property, cJSON_GetObjectItemCaseSensitive(schema, "properties"))
    {
        char path[256];
        snprintf(path, sizeof path, "%s%s%s", prefix, prefix[0] ? "." : "", property->string);
        if (cJSON_GetObjectItemCaseSensitive(property, "properties")) {
            print_properties(property, path);
            continue;
        }
        printf("%-42s  ", path);
        print_value(cJSON_GetObjectItemCaseSensitive(property, "default"));
        printf("%s\n", api_text(property, "description"));
    }
}

int command_options(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *kind = argument(arguments, "kind") ? argument(arguments, "kind") : "fit";
    cJSON *answer = NULL;
    int status = api_json(ctl, "GET", "/v1/options", NULL, NULL, &answer);
    const cJSON *schema = cJSON_GetObjectItemCaseSensitive(answer, kind);
    if (status == DONE && ctl->json)
        api_print(ctl, answer);
    else if (status == DONE && schema)
        print_properties(schema, "");
    else if (status == DONE)
        status = groomctl_usage_error("options", "--kind %s is no kind of job that has options of its own", kind);
    cJSON_Delete(answer);
    return status;
}

/* --- health ---------------------------------------------------------------------------------------- */

int command_health(struct groomctl *ctl, const struct arguments *arguments)
{
    cJSON *alive = NULL, *ready = NULL;
    int status = api_json(ctl, "GET", "/healthz", NULL, NULL, &alive);
    if (status == DONE)
        status = api_json(ctl, "GET", "/readyz", NULL, NULL, &ready);
    if (status == DONE && ctl->json)
        api_print(ctl, ready ? ready : alive);
    else if (status == DONE)
        printf("%s is alive and ready\n", http_client_base_url(ctl->client));
    cJSON_Delete(alive);
    cJSON_Delete(ready);
    return status;
}
