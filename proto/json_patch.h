/* JSON Pointer (RFC 6901), JSON Patch (RFC 6902) and merge patch (RFC 7396) on cJSON trees.
 *
 * A patch is applied to a copy: the document that comes in is never changed, and what comes out
 * has all operations or there is nothing. */
#ifndef PROTO_JSON_PATCH_H
#define PROTO_JSON_PATCH_H

#include <stddef.h>

struct cJSON;

#define JSON_PATCH_MAX_OPERATIONS 1000
#define JSON_PATCH_MAX_DEPTH      128        /* of what an operation leaves behind */
#define JSON_PATCH_MAX_COPIED     (64 << 20) /* bytes that all "copy" operations together may add */

enum json_patch_status {
    JSON_PATCH_OK = 0,
    JSON_PATCH_INVALID,  /* the patch itself is not well-formed: HTTP 400 */
    JSON_PATCH_CONFLICT, /* a path does not exist: HTTP 422 */
    JSON_PATCH_TEST,     /* a "test" did not hold: HTTP 409 */
    JSON_PATCH_NO_MEMORY
};

struct json_patch_error {
    char pointer[128]; /* into the patch: "/2/path" */
    char detail[256];  /* a sentence */
};

/* The value that a pointer names ("" is the document), or NULL. Borrowed from the document. */
struct cJSON *json_pointer_get(const struct cJSON *document, const char *pointer);

/* Apply an array of operations.
 * document, patch  borrowed
 * result           a new tree, the caller's to delete; set on success only
 * error            may be NULL */
enum json_patch_status json_patch_apply(const struct cJSON *document, const struct cJSON *patch,
                                        struct cJSON **result, struct json_patch_error *error);

/* RFC 7396: a new tree, the caller's to delete; NULL where memory is out. */
struct cJSON *json_merge_patch(const struct cJSON *document, const struct cJSON *patch);

/* Equal as RFC 6902 section 4.6 means it: numbers by value, objects in any order. */
int json_equal(const struct cJSON *a, const struct cJSON *b);

#endif
