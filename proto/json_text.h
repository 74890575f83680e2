/* Control messages from outside: JSON text to a cJSON tree that later code can trust.
 *
 * cJSON alone takes invalid UTF-8, turns 1e400 into infinity, cuts strings at \u0000 and keeps
 * duplicate keys. Here each of these is refused, and so is nesting beyond JSON_TEXT_DEPTH and an
 * object of more than JSON_TEXT_MEMBERS members (cJSON looks keys up one by one). Bulk arrays of
 * numbers do not come this way: the strand formats have a streaming reader. */
#ifndef PROTO_JSON_TEXT_H
#define PROTO_JSON_TEXT_H

#include <stdbool.h>
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

/* cJSON leaves out what it has no memory for and says nothing. From json_memory_install on (once, before any
 * thread starts) a thread can ask whether that has happened since it called json_memory_begin; a thread that
 * never did is told no. */
void json_memory_install(void);
void json_memory_begin(void);
bool json_memory_failed(void);

#endif
