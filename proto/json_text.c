#include "proto/json_text.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int refuse(struct json_text_error *error, size_t offset, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static int refuse(struct json_text_error *error, size_t offset, const char *format, ...)
{
    va_list arguments;
    if (!error)
        return 0;
    error->byte_offset = (int64_t)offset;
    va_start(arguments, format);
    vsnprintf(error->detail, sizeof error->detail, format, arguments);
    va_end(arguments);
    return 0;
}

/* The length of the well-formed UTF-8 sequence at s (Unicode 15, table 3-7), or 0. */
static size_t utf8_length(const unsigned char *s, size_t left)
{
    unsigned low = 0x80, high = 0xbf;
    size_t n = s[0] < 0x80 ? 1 : s[0] < 0xc2 ? 0 : s[0] < 0xe0 ? 2 : s[0] < 0xf0 ? 3 : s[0] < 0xf5 ? 4 : 0;
    if (n == 0 || n > left)
        return 0;
    if (s[0] == 0xe0)
        low = 0xa0;
    if (s[0] == 0xed)
        high = 0x9f;
    if (s[0] == 0xf0)
        low = 0x90;
    if (s[0] == 0xf4)
        high = 0x8f;
    for (size_t i = 1; i < n; i++, low = 0x80, high = 0xbf)
        if (s[i] < low || s[i] > high)
            return 0;
    return n;
}

/* Past the string that begins at `at` (its opening quote), or 0 where it is refused. */
static size_t scan_string(const char *bytes, size_t n, size_t at, struct json_text_error *error)
{
    for (at++; at < n && bytes[at] != '"';) {
        if ((unsigned char)bytes[at] < 0x20)
            return (size_t)refuse(error, at,
                                  "a string holds the control character 0x%02x; write it as \\u00%02x",
                                  (unsigned)bytes[at], (unsigned)bytes[at]);
        if (bytes[at] == '\\') {
            if (n - at >= 6 && !memcmp(bytes + at, "\\u0000", 6))
                return (size_t)refuse(error, at, "a string holds \\u0000, which is not taken");
            at += 2;
            continue;
        }
        size_t length = utf8_length((const unsigned char *)bytes + at, n - at);
        if (!length)
            return (size_t)refuse(error, at, "this is not UTF-8");
        at += length;
    }
    if (at >= n)
        return (size_t)refuse(error, n, "the text ends within a string");
    return at + 1;
}

/* What cJSON would let pass or recurse into; the grammar itself is cJSON's to check. */
static int scan(const char *bytes, size_t n, struct json_text_error *error)
{
    int depth = 0;
    for (size_t at = 0; at < n;) {
        unsigned char c = (unsigned char)bytes[at];
        if (c == '"') {
            if (!(at = scan_string(bytes, n, at, error)))
                return 0;
            continue;
        }
        if (c == 0 || c >= 0x80)
            return refuse(error, at, "byte 0x%02x stands outside a string; expected JSON in UTF-8", c);
        if ((c == '{' || c == '[') && ++depth > JSON_TEXT_DEPTH)
            return refuse(error, at, "arrays and objects are nested deeper than %d", JSON_TEXT_DEPTH);
        depth -= c == '}' || c == ']';
        at++;
    }
    return 1;
}

static int by_text(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

static int check_keys(const cJSON *object, struct json_text_error *error)
{
    const cJSON *member;
    const char **keys = malloc(JSON_TEXT_MEMBERS * sizeof *keys);
    size_t n = 0;
    int fine = keys != NULL || refuse(error, 0, "memory ran out");
    if (fine)
        cJSON_ArrayForEach(member, object)
        {
            if (n == JSON_TEXT_MEMBERS) {
                fine = refuse(error, 0, "an object has more than %d members", JSON_TEXT_MEMBERS);
                break;
            }
            keys[n++] = member->string;
        }
    if (fine && n > 1)
        qsort(keys, n, sizeof *keys, by_text);
    for (size_t i = 1; fine && i < n; i++)
        if (!strcmp(keys[i - 1], keys[i]))
            fine = refuse(error, 0, "the key \"%.60s\" stands twice in one object", keys[i]);
    free(keys);
    return fine;
}

static int check_tree(const cJSON *item, struct json_text_error *error)
{
    const cJSON *child;
    if (cJSON_IsNumber(item) && !isfinite(item->valuedouble))
        return refuse(error, 0, "a number is too large for a 64-bit float");
    if (cJSON_IsObject(item) && item->child && item->child->next && !check_keys(item, error))
        return 0;
    cJSON_ArrayForEach(child, item) if (!check_tree(child, error)) return 0;
    return 1;
}

/* cJSON_Parse with the end at n: only blanks may follow the value. */
static cJSON *parse(const char *bytes, size_t n, struct json_text_error *error)
{
    const char *end = NULL;
    cJSON *tree = cJSON_ParseWithLengthOpts(bytes, n, &end, 0);
    size_t at = end && end >= bytes ? (size_t)(end - bytes) : 0;
    if (!tree) {
        /* cJSON stays on the last byte where the text ends early */
        refuse(error, at,
               at + 1 >= n ? "this is not JSON, or it ends before the value is complete"
                           : "this is not JSON");
        return NULL;
    }
    while (at < n && strchr(" \t\r\n", bytes[at]))
        at++;
    if (at < n) {
        refuse(error, at, "something follows the JSON value");
        cJSON_Delete(tree);
        return NULL;
    }
    return tree;
}

cJSON *json_text_parse(const char *bytes, size_t n_bytes, struct json_text_error *error)
{
    cJSON *tree;
    if (error)
        *error = (struct json_text_error){0};
    if (n_bytes == 0) {
        refuse(error, 0, "the body is empty; expected JSON");
        return NULL;
    }
    if (!scan(bytes, n_bytes, error) || !(tree = parse(bytes, n_bytes, error)))
        return NULL;
    if (check_tree(tree, error))
        return tree;
    cJSON_Delete(tree);
    return NULL;
}

/* --- memory that was out ------------------------------------------------------------------ */

static _Thread_local struct {
    bool watched, failed;
} memory;

static void *watched_malloc(size_t n)
{
    void *bytes = malloc(n);
    memory.failed |= !bytes && memory.watched;
    return bytes;
}

void json_memory_install(void)
{
    cJSON_Hooks hooks = {watched_malloc, free};
    cJSON_InitHooks(&hooks);
}

void json_memory_begin(void)
{
    memory.watched = true;
    memory.failed = false;
}

bool json_memory_failed(void) { return memory.failed; }
