/* Control messages from outside: the target of a request, JSON text, patches, problems.
 *
 * The first byte says what the rest is. Patches come as two JSON values with a zero byte between. */
#include <cjson/cJSON.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "proto/json_patch.h"
#include "proto/json_text.h"
#include "proto/problem.h"
#include "proto/uri.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(int holds)
{
    if (!holds)
        abort();
}

static void fuzz_uri(const char *text)
{
    struct uri uri;
    if (uri_parse(text, &uri)) {
        require(!uri.storage && uri.n_segments == 0 && uri.n_parameters == 0);
        return;
    }
    for (size_t i = 0; i < uri.n_segments; i++)
        require(strcmp(uri.segment[i], "..") && strcmp(uri.segment[i], "."));
    for (size_t i = 0; i < uri.n_parameters; i++)
        require(uri_query(&uri, uri.parameter[i].name) == uri.parameter[i].value);
    uri_finish(&uri);
}

/* What was read prints, and what was printed reads as the same. */
static void fuzz_text(const char *text, size_t n)
{
    struct json_text_error error;
    cJSON *tree = json_text_parse(text, n, &error);
    if (!tree) {
        require(error.detail[0] && error.byte_offset >= 0 && (size_t)error.byte_offset <= n);
        return;
    }
    char *printed = cJSON_PrintUnformatted(tree);
    cJSON *again = printed ? json_text_parse(printed, strlen(printed), NULL) : NULL;
    require(again && json_equal(tree, again));
    struct problem problem;
    if (problem_from_json(tree, &problem))
        require(problem.status >= 400 && problem.status <= 599);
    cJSON_Delete(again);
    free(printed);
    cJSON_Delete(tree);
}

/* A patch changes a copy or nothing. */
static void fuzz_patch(const char *text, size_t n)
{
    const char *zero = memchr(text, 0, n);
    if (!zero)
        return;
    cJSON *document = json_text_parse(text, (size_t)(zero - text), NULL);
    cJSON *patch = json_text_parse(zero + 1, n - (size_t)(zero - text) - 1, NULL);
    cJSON *before = document ? cJSON_Duplicate(document, 1) : NULL, *result = NULL;
    if (document && patch) {
        struct json_patch_error error = {0};
        enum json_patch_status status = json_patch_apply(document, patch, &result, &error);
        require((status == JSON_PATCH_OK) == (result != NULL));
        require(status == JSON_PATCH_OK || error.detail[0]);
        require(json_equal(document, before));
        cJSON *merged = json_merge_patch(document, patch);
        require(merged != NULL);
        cJSON_Delete(merged);
    }
    cJSON_Delete(result);
    cJSON_Delete(before);
    cJSON_Delete(patch);
    cJSON_Delete(document);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    char *text = malloc(size);
    require(text != NULL);
    memcpy(text, data + 1, size - 1);
    text[size - 1] = 0;
    switch (data[0]) {
    case 'u':
        fuzz_uri(text);
        break;
    case 'p':
        fuzz_patch(text, size - 1);
        break;
    default:
        fuzz_text(text, size - 1);
        break;
    }
    free(text);
    return 0;
}
