#include "tests/support/npy.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/test.h"

static unsigned char *read_file(const char *path, size_t *n)
{
    FILE *file = fopen(path, "rb");
    ck_assert_msg(file != NULL, "%s cannot be opened", path);
    fseek(file, 0, SEEK_END);
    *n = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = malloc(*n + 1);
    ck_assert_uint_eq(fread(bytes, 1, *n, file), *n);
    bytes[*n] = 0;
    fclose(file);
    return bytes;
}

static double number_at(const unsigned char *at, char kind, int size)
{
    union { double d; float f; int64_t l; int32_t i; } u;
    memcpy(&u, at, (size_t)size);
    if (kind == 'f')
        return size == 8 ? u.d : u.f;
    return size == 8 ? (double)u.l : u.i;
}

static struct npy_array parse(const unsigned char *bytes)
{
    ck_assert(memcmp(bytes, "\x93NUMPY", 6) == 0);
    size_t header = bytes[6] == 1 ? 10 + (size_t)(bytes[8] | bytes[9] << 8) : 12 + (size_t)(bytes[8] | bytes[9] << 8 | bytes[10] << 16);
    const char *text = (const char *)bytes + 10, *descr = strstr(text, "'<"), *shape = strstr(text, "'shape': (");
    ck_assert(descr && shape && (descr[2] == 'f' || descr[2] == 'i'));
    struct npy_array array = {.n = 1};
    for (const char *at = shape + 10; *at && *at != ')';) {
        char *end;
        unsigned long long n = strtoull(at, &end, 10);
        array.n *= end > at ? n : 1;
        at = end > at ? end : at + 1;
    }
    int size = atoi(descr + 3);
    array.values = malloc((array.n + 1) * sizeof *array.values);
    for (size_t i = 0; i < array.n; i++)
        array.values[i] = number_at(bytes + header + i * (size_t)size, descr[2], size);
    return array;
}

struct npy_array test_npy(const char *path)
{
    size_t n;
    unsigned char *bytes = read_file(path, &n);
    struct npy_array array = parse(bytes);
    free(bytes);
    return array;
}

static unsigned u16(const unsigned char *p) { return p[0] | (unsigned)p[1] << 8; }
static unsigned u32(const unsigned char *p) { return u16(p) | u16(p + 2) << 16; }

struct npy_array test_npz(const char *path, const char *entry)
{
    size_t n, at = 0;
    unsigned char *bytes = read_file(path, &n);
    struct npy_array array = {0};
    while (!array.values && at + 30 < n && memcmp(bytes + at, "PK\3\4", 4) == 0) {
        size_t name = u16(bytes + at + 26), data = at + 30 + name + u16(bytes + at + 28), length = u32(bytes + at + 18);
        if (length == UINT32_MAX) /* 64-bit sizes: the compressed one is the second of the extra field */
            length = u32(bytes + at + 30 + name + 12);
        ck_assert_uint_eq(u16(bytes + at + 8), 0);
        if (name == strlen(entry) && memcmp(bytes + at + 30, entry, name) == 0)
            array = parse(bytes + data);
        at = data + length;
    }
    ck_assert_msg(array.values != NULL, "%s has no %s", path, entry);
    free(bytes);
    return array;
}
