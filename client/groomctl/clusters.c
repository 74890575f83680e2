/* clusters: which strands belong together, and the frames that a sculpt moves. */
#include <stdio.h>
#include <string.h>

#include "client/groomctl/transfer.h"
#include "proto/url.h"

static void print_clusters(const cJSON *answer)
{
    const cJSON *cluster;
    int k = 0;
    puts("cluster  strands  frames at (m)");
    cJSON_ArrayForEach(cluster, cJSON_GetObjectItemCaseSensitive(answer, "clusters"))
    {
        const cJSON *frame;
        printf("%7d  %7.0f ", k++, api_number(cluster, "strands", 0));
        cJSON_ArrayForEach(frame, cJSON_GetObjectItemCaseSensitive(cluster, "frames"))
        {
            const cJSON *p = cJSON_GetObjectItemCaseSensitive(frame, "position");
            printf("  %.2f: %.3f %.3f %.3f", api_number(frame, "at", 0), cJSON_GetNumberValue(cJSON_GetArrayItem(p, 0)),
                   cJSON_GetNumberValue(cJSON_GetArrayItem(p, 1)), cJSON_GetNumberValue(cJSON_GetArrayItem(p, 2)));
        }
        putchar('\n');
    }
}

int command_clusters(struct groomctl *ctl, const struct arguments *arguments)
{
    static const char *const passed_on[] = {"revision", "count", "seed", "frames"};
    const char *id = arguments->operands[0], *path = argument(arguments, "output");
    struct url url;
    cJSON *answer = NULL;
    url_init(&url, !strncmp(id, "str_", 4) ? "/v1/strands" : "/v1/grooms");
    url_segment(&url, id);
    url_segment(&url, "clusters");
    for (size_t k = 0; k < sizeof passed_on / sizeof passed_on[0]; k++)
        url_query(&url, passed_on[k], argument(arguments, passed_on[k]));
    if (path)
        return download_said(ctl, path, download_file(ctl, url.text, path));
    int status = api_json(ctl, "GET", url.text, NULL, NULL, &answer);
    if (status == DONE && ctl->json)
        api_print(ctl, answer);
    else if (status == DONE)
        print_clusters(answer);
    cJSON_Delete(answer);
    return status;
}
