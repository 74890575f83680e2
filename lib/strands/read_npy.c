/* NumPy .npy (numpy.org/doc/stable/reference/generated/numpy.lib.format.html): magic, version, the
 * length of a header that is a Python dictionary, the values. */
#include "strands/npy.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"

#define MAX_HEADER 4096

/* --- header --------------------------------------------------------------------------- */

/* The value of 'key' in the dictionary, or NULL. */
static const char *find_key(const char *header, const char *key)
{
    char quoted[32];
    snprintf(quoted, sizeof quoted, "'%s':", key);
    const char *at = strstr(header, quoted);
    if (!at)
        return NULL;
    at += strlen(quoted);
    return at + strspn(at, " ");
}

/* '<f4' and the like; also '|u1' and others where they are only passed over */
static int parse_type(const char *text, struct npy *npy)
{
    if (!text || *text != '\'' || !text[1] || !strchr("<>|=", text[1]))
        return 0;
    long long size;
    npy->kind = text[2];
    npy->big_endian = text[1] == '>';
    const unsigned char *end = text[2] ? number_scan_integer((const unsigned char *)text + 3, &size) : NULL;
    if (!end || *end != '\'' || size <= 0 || size > 65536)
        return 0;
    npy->size = (unsigned)size * (npy->kind == 'U' ? 4 : 1); /* text counts in characters of UCS-4 */
    return 1;
}

/* (2, 256, 3) or (5,) or () */
static int parse_shape(const char *text, struct npy *npy)
{
    npy->n_dimensions = 0;
    npy->n = 1;
    if (!text || *text++ != '(')
        return 0;
    for (;;) {
        long long extent;
        text += strspn(text, " ,");
        if (*text == ')')
            return 1;
        const unsigned char *end = number_scan_integer((const unsigned char *)text, &extent);
        if (!end || extent < 0 || npy->n_dimensions == NPY_MAX_DIMENSIONS ||
            __builtin_mul_overflow(npy->n, (uint64_t)extent, &npy->n) || npy->n > UINT64_MAX / 4 / 65536)
            return 0;
        npy->shape[npy->n_dimensions++] = (uint64_t)extent;
        text = (const char *)end;
    }
}

/* The dictionary's text, zero-terminated. */
static groom_status read_dictionary(struct input *in, char header[MAX_HEADER + 1], struct groom_diag *diag)
{
    const unsigned char *bytes;
    uint64_t begin = input_offset(in);
    groom_status status = input_take(in, 10, "the header of a NumPy array", &bytes, diag);
    if (status != GROOM_OK)
        return status;
    if (memcmp(bytes, "\x93NUMPY", 6) != 0 || bytes[6] < 1 || bytes[6] > 3)
        return groom_fail_at(diag, GROOM_EFORMAT, (int64_t)begin,
                             "\"\\x93NUMPY\" and version 1, 2 or 3 were expected at byte %llu",
                             (unsigned long long)begin);
    size_t length = input_u16(bytes + 8);
    if (bytes[6] > 1) { /* four bytes of length */
        if ((status = input_take(in, 2, "the length of the header", &bytes, diag)) != GROOM_OK)
            return status;
        length |= (size_t)input_u16(bytes) << 16;
    }
    if (length > MAX_HEADER)
        return groom_fail_at(diag, GROOM_EFORMAT, (int64_t)begin + 8,
                             "the NumPy header at byte %llu says %zu bytes; "
                             "an array of floats needs fewer than %d",
                             (unsigned long long)begin, length, MAX_HEADER);
    if ((status = input_take(in, length, "the dictionary of the NumPy header", &bytes, diag)) != GROOM_OK)
        return status;
    memcpy(header, bytes, length);
    header[length] = 0;
    return GROOM_OK;
}

static groom_status read_header(struct input *in, struct npy *npy, int *fortran, struct groom_diag *diag)
{
    char header[MAX_HEADER + 1];
    uint64_t begin = input_offset(in);
    groom_status status = read_dictionary(in, header, diag);
    if (status != GROOM_OK)
        return status;
    const char *order = find_key(header, "fortran_order");
    if (!parse_type(find_key(header, "descr"), npy) || !order || !parse_shape(find_key(header, "shape"), npy))
        return groom_fail_at(diag, GROOM_EFORMAT, (int64_t)begin,
                             "the NumPy header at byte %llu has no 'descr' of one "
                             "number type, 'fortran_order' and 'shape' of at most %d dimensions: %.60s",
                             (unsigned long long)begin, NPY_MAX_DIMENSIONS, header);
    *fortran = strncmp(order, "False", 5) != 0;
    return GROOM_OK;
}

groom_status npy_read_any_header(struct input *in, struct npy *npy, struct groom_diag *diag)
{
    int fortran;
    return read_header(in, npy, &fortran, diag);
}

groom_status npy_read_header(struct input *in, struct npy *npy, struct groom_diag *diag)
{
    int fortran;
    uint64_t begin = input_offset(in);
    groom_status status = read_header(in, npy, &fortran, diag);
    if (status != GROOM_OK)
        return status;
    if (fortran || npy->kind != 'f' || (npy->size != 2 && npy->size != 4 && npy->size != 8))
        return groom_fail_at(diag, GROOM_EFORMAT, (int64_t)begin,
                             "the NumPy array at byte %llu is %s of type %c%u; "
                             "float16, float32 or float64 in row-major order was expected",
                             (unsigned long long)begin, fortran ? "column-major" : "row-major", npy->kind,
                             npy->size);
    return GROOM_OK;
}

/* --- values ------------------------------------------------------------------------------- */

static double from_half(uint16_t half)
{
    int exponent = half >> 10 & 31, fraction = half & 1023;
    double value = exponent == 0    ? ldexp(fraction, -24)
                   : exponent == 31 ? (fraction ? NAN : INFINITY)
                                    : ldexp(1024 + fraction, exponent - 25);
    return half >> 15 ? -value : value;
}

static double value_at(const unsigned char *bytes, const struct npy *npy)
{
    unsigned char b[8] = {0};
    double wide;
    for (unsigned i = 0; i < npy->size; i++)
        b[i] = bytes[npy->big_endian ? npy->size - 1 - i : i];
    if (npy->size == 2)
        return from_half(input_u16(b));
    if (npy->size == 4)
        return (double)input_f32(b);
    memcpy(&wide, b, sizeof wide);
    return wide;
}

static int add_points(struct builder *out, const unsigned char *bytes, size_t n, const struct npy *npy)
{
    if (npy->size == 4 && !npy->big_endian)
        return builder_points_f32(out, bytes, n, 12);
    for (size_t i = 0; i < n; i++, bytes += 3 * npy->size)
        if (!builder_point(out, value_at(bytes, npy), value_at(bytes + npy->size, npy),
                           value_at(bytes + 2 * npy->size, npy)))
            return 0;
    return 1;
}

static groom_status read_strand(struct reader *reader, struct input *in, const struct npy *npy)
{
    for (uint64_t left = npy->shape[1]; left > 0;) {
        const unsigned char *bytes;
        size_t n;
        groom_status status =
            input_records(in, 3 * (size_t)npy->size, left, "a vertex", &bytes, &n, reader->diag);
        if (status != GROOM_OK)
            return status;
        if (!add_points(reader->out, bytes, n, npy))
            return builder_fail(reader->out, input_offset(in), reader->diag);
        left -= n;
    }
    return builder_cut(reader->out, npy->shape[1])
               ? GROOM_OK
               : builder_fail(reader->out, input_offset(in), reader->diag);
}

groom_status npy_read_positions(struct reader *reader, struct input *in, const struct npy *npy)
{
    groom_status status = GROOM_OK;
    if (npy->n_dimensions != 3 || npy->shape[2] != 3 || npy->shape[1] < 2)
        return groom_fail_at(
            reader->diag, GROOM_EFORMAT, (int64_t)input_offset(in),
            "positions have %d dimensions, %llu x %llu x ...; (strands, vertices, 3) was expected",
            npy->n_dimensions, (unsigned long long)(npy->n_dimensions > 0 ? npy->shape[0] : 0),
            (unsigned long long)(npy->n_dimensions > 1 ? npy->shape[1] : 0));
    for (uint64_t i = 0; i < npy->shape[0] && status == GROOM_OK; i++)
        status = read_strand(reader, in, npy);
    return status;
}

groom_status npy_read_root_uv(struct reader *reader, struct input *in, const struct npy *npy)
{
    if (npy->n_dimensions != 2 || npy->shape[1] != 2) {
        report_warn(reader->report, "root_uv is not (strands, 2): not read");
        return input_skip(in, npy->n * npy->size, "root_uv", reader->diag);
    }
    for (uint64_t left = npy->shape[0]; left > 0;) {
        const unsigned char *uv;
        size_t n, size = npy->size;
        groom_status status = input_records(in, 2 * size, left, "a pair of root_uv", &uv, &n, reader->diag);
        if (status != GROOM_OK)
            return status;
        for (size_t i = 0; i < n; i++, uv += 2 * size)
            if (!builder_root_uv(reader->out, (float)value_at(uv, npy), (float)value_at(uv + size, npy)))
                return builder_fail(reader->out, input_offset(in), reader->diag);
        left -= n;
    }
    return GROOM_OK;
}

groom_status read_npy(struct reader *reader)
{
    struct npy npy = {0};
    groom_status status = npy_read_header(reader->in, &npy, reader->diag);
    if (status == GROOM_OK)
        status = read_expect(reader, npy.n_dimensions ? npy.shape[0] : 0, npy.n / 3, npy.n * npy.size);
    if (status == GROOM_OK)
        status = npy_read_positions(reader, reader->in, &npy);
    if (status == GROOM_OK)
        read_warn_trailing(reader);
    return status;
}
