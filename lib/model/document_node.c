/* A document as a tree: in and out of text. */
#include <string.h>

#include "model/document_node.h"

groom_status document_parse(const char *json, size_t n_bytes, cJSON **root, struct groom_diag *diag)
{
    const char *end = NULL;
    cJSON *tree = cJSON_ParseWithLengthOpts(json, n_bytes, &end, 0);
    int64_t at = end ? end - json : 0;
    if (!tree)
        return groom_fail_at(diag, GROOM_EFORMAT, at, "this is not JSON (or is nested too deeply)");
    while ((size_t)at < n_bytes && strchr(" \t\r\n", json[at])) /* a zero byte ends the text as well */
        at++;
    if ((size_t)at < n_bytes) {
        cJSON_Delete(tree);
        return groom_fail_at(diag, GROOM_EFORMAT, at, "there is something behind the JSON value");
    }
    *root = tree;
    return GROOM_OK;
}

groom_status document_print(const cJSON *root, char **json, size_t *n_bytes, struct groom_diag *diag)
{
    char *text = cJSON_PrintUnformatted(root);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to print the document");
    *json = text;
    *n_bytes = strlen(text);
    return GROOM_OK;
}

const char *document_random_name(groom_operator_type type, uint32_t i)
{
    return groom_operator_random_arrays(type) == 1 ? "u" : i == 0 ? "u1" : "u2";
}
