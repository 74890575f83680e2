#include "proto/json_patch.h"

#include <cjson/cJSON.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- pointers --------------------------------------------------------------- */

/* The token at *pointer (which stands on its '/'), unescaped into `token`; moves *pointer past it.
 * returns 0 where the escape is wrong or the token is too long */
static int next_token(const char **pointer, char *token, size_t capacity)
{
    const char *s = *pointer + 1;
    size_t n = 0;
    for (; *s && *s != '/'; s++) {
        char c = *s;
        if (c == '~') {
            if (s[1] != '0' && s[1] != '1')
                return 0;
            c = *++s == '0' ? '~' : '/';
        }
        if (n + 1 >= capacity)
            return 0;
        token[n++] = c;
    }
    token[n] = 0;
    *pointer = s;
    return 1;
}

/* An array index as RFC 6901 writes it: digits without a leading zero. -1 otherwise. */
static int parse_index(const char *token)
{
    if (!token[0] || strlen(token) > 8 || token[strspn(token, "0123456789")] || (token[0] == '0' && token[1]))
        return -1;
    return atoi(token);
}

static cJSON *child_of(const cJSON *parent, const char *token)
{
    if (cJSON_IsArray(parent)) {
        int index = parse_index(token);
        return index < 0 ? NULL : cJSON_GetArrayItem(parent, index);
    }
    return cJSON_IsObject(parent) ? cJSON_GetObjectItemCaseSensitive(parent, token) : NULL;
}

/* The parent of what a pointer names and the last token; NULL where the parent is not there. */
static cJSON *parent_of(cJSON *document, const char *pointer, char *token, size_t capacity)
{
    cJSON *parent = document;
    if (*pointer != '/')
        return NULL;
    for (;;) {
        if (!next_token(&pointer, token, capacity))
            return NULL;
        if (!*pointer)
            return parent;
        if (!(parent = child_of(parent, token)))
            return NULL;
    }
}

cJSON *json_pointer_get(const cJSON *document, const char *pointer)
{
    char token[256];
    if (!*pointer)
        return (cJSON *)(size_t)document;
    /* nothing is changed on the way; parent_of takes a mutable tree for its other callers */
    cJSON *parent = parent_of((cJSON *)(size_t)document, pointer, token, sizeof token);
    return parent ? child_of(parent, token) : NULL;
}

/* --- equality ----------------------------------------------------------------- */

static int equal_arrays(const cJSON *a, const cJSON *b)
{
    const cJSON *x = a->child, *y = b->child;
    for (; x && y; x = x->next, y = y->next)
        if (!json_equal(x, y))
            return 0;
    return !x && !y;
}

static int equal_objects(const cJSON *a, const cJSON *b)
{
    const cJSON *member;
    if (cJSON_GetArraySize(a) != cJSON_GetArraySize(b))
        return 0;
    cJSON_ArrayForEach(member, a)
    {
        const cJSON *other = cJSON_GetObjectItemCaseSensitive(b, member->string);
        if (!other || !json_equal(member, other))
            return 0;
    }
    return 1;
}

int json_equal(const cJSON *a, const cJSON *b)
{
    if ((a->type & 0xff) != (b->type & 0xff))
        return 0;
    if (cJSON_IsNumber(a))
        return !(a->valuedouble < b->valuedouble) && !(a->valuedouble > b->valuedouble);
    if (cJSON_IsString(a))
        return !strcmp(a->valuestring, b->valuestring);
    if (cJSON_IsArray(a))
        return equal_arrays(a, b);
    return !cJSON_IsObject(a) || equal_objects(a, b);
}

/* --- operations ------------------------------------------------------------------ */

struct application {
    cJSON *document; /* the copy that is being changed */
    int index;       /* of the operation */
    size_t copied;   /* bytes that "copy" has added so far: copying a document into itself doubles it */
    struct json_patch_error *error;
};

static enum json_patch_status refuse(const struct application *a, enum json_patch_status status,
                                     const char *member, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
static enum json_patch_status refuse(const struct application *a, enum json_patch_status status,
                                     const char *member, const char *format, ...)
{
    va_list arguments;
    if (!a->error)
        return status;
    if (a->index >= 0)
        snprintf(a->error->pointer, sizeof a->error->pointer, "/%d%s", a->index, member);
    else
        a->error->pointer[0] = 0;
    va_start(arguments, format);
    vsnprintf(a->error->detail, sizeof a->error->detail, format, arguments);
    va_end(arguments);
    return status;
}

static enum json_patch_status no_memory(const struct application *a)
{
    return refuse(a, JSON_PATCH_NO_MEMORY, "", "memory ran out");
}

static enum json_patch_status missing(const struct application *a, const char *member, const char *path)
{
    return refuse(a, JSON_PATCH_CONFLICT, member, "nothing stands at \"%.120s\"", path);
}

/* Debian's cJSON 1.7.15 refuses every cJSON_InsertItemInArray that is not at an end (its backport of
 * the mend for CVE-2023-50471 tests the wrong item), so the links are set here. The first item's
 * `prev` is the last item, as cJSON keeps it. */
static int insert_before(cJSON *array, cJSON *before, cJSON *value)
{
    if (!before)
        return cJSON_AddItemToArray(array, value);
    value->next = before;
    value->prev = before->prev;
    if (before == array->child)
        array->child = value;
    else
        before->prev->next = value;
    before->prev = value;
    return 1;
}

static enum json_patch_status insert_into_array(struct application *a, cJSON *array, const char *token,
                                                const char *path, cJSON *value)
{
    int size = cJSON_GetArraySize(array);
    int index = strcmp(token, "-") ? parse_index(token) : size;
    enum json_patch_status status = JSON_PATCH_OK;
    if (index < 0 || index > size)
        status = refuse(a, JSON_PATCH_CONFLICT, "/path", "\"%.100s\" is outside an array of %d", path, size);
    else if (!insert_before(array, cJSON_GetArrayItem(array, index), value))
        status = no_memory(a);
    if (status != JSON_PATCH_OK)
        cJSON_Delete(value);
    return status;
}

static int depth_of(const cJSON *item)
{
    int deepest = 0;
    const cJSON *child;
    cJSON_ArrayForEach(child, item)
    {
        int depth = depth_of(child);
        deepest = depth > deepest ? depth : deepest;
    }
    return deepest + 1;
}

static int tokens_of(const char *pointer)
{
    int n = 0;
    for (; *pointer; pointer++)
        n += *pointer == '/';
    return n;
}

/* Put `value`, which is taken over, at the path (RFC 6902 4.1). */
static enum json_patch_status add(struct application *a, const char *path, cJSON *value)
{
    char token[256];
    if (!value)
        return no_memory(a);
    if (tokens_of(path) + depth_of(value) > JSON_PATCH_MAX_DEPTH) {
        cJSON_Delete(value);
        return refuse(a, JSON_PATCH_INVALID, "/path", "the result would be nested deeper than %d",
                      JSON_PATCH_MAX_DEPTH);
    }
    if (!*path) {
        cJSON_Delete(a->document);
        a->document = value;
        return JSON_PATCH_OK;
    }
    cJSON *parent = parent_of(a->document, path, token, sizeof token);
    if (cJSON_IsArray(parent))
        return insert_into_array(a, parent, token, path, value);
    if (!cJSON_IsObject(parent)) {
        cJSON_Delete(value);
        return refuse(a, JSON_PATCH_CONFLICT, "/path", "no array or object holds \"%.120s\"", path);
    }
    cJSON_DeleteItemFromObjectCaseSensitive(parent, token);
    if (cJSON_AddItemToObject(parent, token, value))
        return JSON_PATCH_OK;
    cJSON_Delete(value);
    return no_memory(a);
}

/* Take out what stands at the path; *value is then the caller's. */
static enum json_patch_status detach(struct application *a, const char *member, const char *path,
                                     cJSON **value)
{
    char token[256];
    cJSON *parent = *path ? parent_of(a->document, path, token, sizeof token) : NULL;
    cJSON *found = parent ? child_of(parent, token) : NULL;
    if (!*path)
        return refuse(a, JSON_PATCH_CONFLICT, member, "the whole document cannot be taken out");
    if (!found)
        return missing(a, member, path);
    *value = cJSON_DetachItemViaPointer(parent, found);
    return JSON_PATCH_OK;
}

static enum json_patch_status apply_add(struct application *a, const char *path, const char *from,
                                        const cJSON *value)
{
    (void)from;
    return add(a, path, cJSON_Duplicate(value, 1));
}

static enum json_patch_status apply_remove(struct application *a, const char *path, const char *from,
                                           const cJSON *value)
{
    cJSON *gone = NULL;
    (void)from, (void)value;
    enum json_patch_status status = detach(a, "/path", path, &gone);
    cJSON_Delete(gone);
    return status;
}

static enum json_patch_status apply_replace(struct application *a, const char *path, const char *from,
                                            const cJSON *value)
{
    enum json_patch_status status = *path ? apply_remove(a, path, from, value) : JSON_PATCH_OK;
    return status == JSON_PATCH_OK ? apply_add(a, path, from, value) : status;
}

static enum json_patch_status apply_move(struct application *a, const char *path, const char *from,
                                         const cJSON *value)
{
    size_t n = strlen(from);
    (void)value;
    if (!strncmp(path, from, n) && path[n] == '/')
        return refuse(a, JSON_PATCH_INVALID, "/path", "a value cannot move into itself");
    if (!strcmp(path, from) && json_pointer_get(a->document, from))
        return JSON_PATCH_OK;
    cJSON *moved = NULL;
    enum json_patch_status status = detach(a, "/from", from, &moved);
    return status == JSON_PATCH_OK ? add(a, path, moved) : status;
}

static size_t weight_of(const cJSON *item)
{
    const cJSON *child;
    size_t weight = sizeof *item + (cJSON_IsString(item) ? strlen(item->valuestring) : 0) +
                    (item->string ? strlen(item->string) : 0);
    cJSON_ArrayForEach(child, item) weight += weight_of(child);
    return weight;
}

static enum json_patch_status apply_copy(struct application *a, const char *path, const char *from,
                                         const cJSON *value)
{
    const cJSON *found = json_pointer_get(a->document, from);
    (void)value;
    if (!found)
        return missing(a, "/from", from);
    if ((a->copied += weight_of(found)) > JSON_PATCH_MAX_COPIED)
        return refuse(a, JSON_PATCH_INVALID, "/op", "the patch copies more than %d bytes",
                      JSON_PATCH_MAX_COPIED);
    return add(a, path, cJSON_Duplicate(found, 1));
}

static enum json_patch_status apply_test(struct application *a, const char *path, const char *from,
                                         const cJSON *value)
{
    const cJSON *found = json_pointer_get(a->document, path);
    (void)from;
    if (!found)
        return missing(a, "/path", path);
    if (json_equal(found, value))
        return JSON_PATCH_OK;
    return refuse(a, JSON_PATCH_TEST, "/value", "the value at \"%.120s\" is another one", path);
}

static const struct operation {
    const char *name;
    int needs_from, needs_value;
    enum json_patch_status (*apply)(struct application *, const char *path, const char *from,
                                    const cJSON *value);
} operations[] = {
    {"add", 0, 1, apply_add},   {"remove", 0, 0, apply_remove}, {"replace", 0, 1, apply_replace},
    {"move", 1, 0, apply_move}, {"copy", 1, 0, apply_copy},     {"test", 0, 1, apply_test},
};

static const struct operation *find_operation(const char *name)
{
    for (size_t i = 0; name && i < sizeof operations / sizeof operations[0]; i++)
        if (!strcmp(name, operations[i].name))
            return &operations[i];
    return NULL;
}

/* A pointer member of an operation: there, and "" or with a leading '/'. */
static enum json_patch_status pointer_member(const struct application *a, const cJSON *item, const char *key,
                                             const char **pointer)
{
    char member[8];
    snprintf(member, sizeof member, "/%s", key);
    *pointer = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, key));
    if (!*pointer)
        return refuse(a, JSON_PATCH_INVALID, member, "the operation needs \"%s\", a JSON pointer", key);
    if (**pointer && **pointer != '/')
        return refuse(a, JSON_PATCH_INVALID, member, "\"%.100s\" is not a JSON pointer; it must begin with /",
                      *pointer);
    return JSON_PATCH_OK;
}

static enum json_patch_status apply_one(struct application *a, const cJSON *item)
{
    enum json_patch_status status;
    const char *path, *from = "";
    if (!cJSON_IsObject(item))
        return refuse(a, JSON_PATCH_INVALID, "", "an operation is an object with \"op\" and \"path\"");
    const struct operation *op =
        find_operation(cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "op")));
    if (!op)
        return refuse(a, JSON_PATCH_INVALID, "/op",
                      "\"op\" must be add, remove, replace, move, copy or test");
    if ((status = pointer_member(a, item, "path", &path)) != JSON_PATCH_OK)
        return status;
    if (op->needs_from && (status = pointer_member(a, item, "from", &from)) != JSON_PATCH_OK)
        return status;
    const cJSON *value = cJSON_GetObjectItemCaseSensitive(item, "value");
    if (op->needs_value && !value)
        return refuse(a, JSON_PATCH_INVALID, "/value", "\"%s\" needs \"value\"", op->name);
    return op->apply(a, path, from, value);
}

enum json_patch_status json_patch_apply(const cJSON *document, const cJSON *patch, cJSON **result,
                                        struct json_patch_error *error)
{
    struct application a = {.index = -1, .error = error};
    enum json_patch_status status = JSON_PATCH_OK;
    const cJSON *item;
    if (!cJSON_IsArray(patch))
        return refuse(&a, JSON_PATCH_INVALID, "", "a JSON Patch is an array of operations");
    if (cJSON_GetArraySize(patch) > JSON_PATCH_MAX_OPERATIONS)
        return refuse(&a, JSON_PATCH_INVALID, "", "a patch may have %d operations",
                      JSON_PATCH_MAX_OPERATIONS);
    if (!(a.document = cJSON_Duplicate(document, 1)))
        return no_memory(&a);
    cJSON_ArrayForEach(item, patch)
    {
        a.index++;
        if ((status = apply_one(&a, item)) != JSON_PATCH_OK) {
            cJSON_Delete(a.document);
            return status;
        }
    }
    *result = a.document;
    return JSON_PATCH_OK;
}

/* --- merge patch ------------------------------------------------------------------ */

static int merge_members(cJSON *target, const cJSON *patch)
{
    const cJSON *member;
    cJSON_ArrayForEach(member, patch)
    {
        if (cJSON_IsNull(member)) {
            cJSON_DeleteItemFromObjectCaseSensitive(target, member->string);
            continue;
        }
        cJSON *merged = json_merge_patch(cJSON_GetObjectItemCaseSensitive(target, member->string), member);
        if (!merged)
            return 0;
        cJSON_DeleteItemFromObjectCaseSensitive(target, member->string);
        if (!cJSON_AddItemToObject(target, member->string, merged)) {
            cJSON_Delete(merged);
            return 0;
        }
    }
    return 1;
}

cJSON *json_merge_patch(const cJSON *document, const cJSON *patch)
{
    if (!cJSON_IsObject(patch))
        return cJSON_Duplicate(patch, 1);
    cJSON *target =
        document && cJSON_IsObject(document) ? cJSON_Duplicate(document, 1) : cJSON_CreateObject();
    if (target && merge_members(target, patch))
        return target;
    cJSON_Delete(target);
    return NULL;
}
