/* Control messages from outside: JSON text to a cJSON tree that later code can trust.
 *
 * cJSON alone takes invalid UTF-8, turns 1e400 into infinity, cuts strings at \u0000 and keeps
 * duplicate keys. Here each of these is refused, and so is nesting beyond JSON_TEXT_DEPTH and an
 * object of more than JSON_TEXT_MEMBERS members (cJSON looks keys up one by one). Bulk arrays of
 * numbers do not come this way: the strand formats have a streaming reader. */
#ifndef PROTO_JSON_TEXT_H
#define PROTO_JSON_TEXT_H

#include <stddef.h>
#include <stdint.h>

struct cJSON;

#define JSON_TEXT_DEPTH   64
#define JSON_TEXT_MEMBERS 4096

struct json_text_error {
    int64_t byte_offset; /* where reading stopped */
    char detail[160];    /* a sentence */
};

/* bytes need no terminator. The tree is the caller's to delete.
 * returns  NULL on failure; error, which may be NULL, says why */
struct cJSON *json_text_parse(const char *bytes, size_t n_bytes, struct json_text_error *error);

#endif
