#include "client/groomctl/read_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char *read_stream(FILE *in, size_t *n_bytes)
{
    size_t n = 0, capacity = 65536, got;
    char *bytes = malloc(capacity);
    while (bytes && (got = fread(bytes + n, 1, capacity - 1 - n, in)) > 0) {
        n += got;
        if (n + 1 < capacity)
            continue;
        char *more = realloc(bytes, capacity *= 2);
        if (!more)
            free(bytes);
        bytes = more;
    }
    if (bytes && ferror(in)) {
        free(bytes);
        return NULL;
    }
    if (bytes)
        bytes[n] = '\0';
    *n_bytes = n;
    return bytes;
}

char *read_whole_file(const char *path, size_t *n_bytes)
{
    int is_stdin = !strcmp(path, "-");
    FILE *in = is_stdin ? stdin : fopen(path, "rb");
    char *bytes = in ? read_stream(in, n_bytes) : NULL;
    if (!bytes)
        fprintf(stderr, "groomctl: %s cannot be read: %s\n", path, strerror(errno));
    if (in && !is_stdin)
        fclose(in);
    return bytes;
}

cJSON *read_json_file(const char *path)
{
    size_t n = 0;
    char *bytes = read_whole_file(path, &n);
    const char *end = bytes;
    cJSON *json = bytes ? cJSON_ParseWithLengthOpts(bytes, n + 1, &end, 1) : NULL;
    if (bytes && !json)
        fprintf(stderr, "groomctl: %s is not JSON: it cannot be read from byte %zu on\n", path,
                end ? (size_t)(end - bytes) : 0);
    free(bytes);
    return json;
}
