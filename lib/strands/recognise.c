/* The rules, in this order:
 *
 * 1. A magic number: HAIR or hair; "ply" and a line end; \x93NUMPY; PK (a zip: npz); f32 3.0 or
 *    4.0 (.tfx). Formats that are known but not read here are named in the hint.
 * 2. Text (no control bytes in the first 512): "{" or "[" is JSON; "version" is .tfx 2; where the first
 *    line that is no comment begins with a statement of OBJ, or all that is at hand is comments, it is OBJ.
 * 3. The formats without a magic number begin with the count of strands:
 *    - MonoHair: counts of strands and points, u16 counts that add up to the points, and a size of
 *      8 + 2 strands + 12 points, where the size is known;
 *    - .data (12 bytes a point), HairNet's .data (16), CT2Hair's .bin (28): records are walked as
 *      far as the bytes at hand go. A stride is impossible where a count is negative or larger
 *      than the rest, where what the counts leave of the size is no whole number of points, or where
 *      a coordinate is no plausible number (finite, below 1e9, no denormal). The wrong stride
 *      lands in the middle of a float, whose bits make an impossible count. Where more than one is
 *      possible, the one with more whole records wins, then the smaller stride.
 *    Where nothing fits the size, the same is asked without it, and a layout is possible whose first
 *    records are whole: a file that is cut off, has a wrong count or bytes too many goes to its
 *    reader, which says where it breaks. Without a size, counts above 2^24 strands or 2^20 vertices
 *    of one are taken for the bytes of something else.
 */
#include "strands/recognise.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "strands/input.h"

#define MANY_STRANDS  (1u << 24)
#define MANY_VERTICES (1u << 20)

struct bytes {
    const unsigned char *at;
    size_t n;
    int64_t size; /* of the whole, or -1 */
};

static int starts(const struct bytes *bytes, const char *word)
{
    size_t n = strlen(word);
    return bytes->n >= n && memcmp(bytes->at, word, n) == 0;
}

static struct recognised certain(groom_format format) { return (struct recognised){format, 1, 0, NULL}; }
static struct recognised unknown(const char *hint)
{
    return (struct recognised){GROOM_FORMAT_AUTO, 0, 0, hint};
}

/* --- 1: magic numbers ------------------------------------------------------------------ */

static int by_magic(const struct bytes *bytes, struct recognised *found)
{
    static const struct {
        const char *magic, *hint;
    } others[] = {
        {"Ogawa", "this is Alembic, which is not read: export the strands as HAIR, PLY, OBJ or JSON"},
        {"\x89HDF",
         "this is HDF5 (or old Alembic), which is not read: export the strands as HAIR, PLY, OBJ or JSON"},
        {"#usda", "this is USD, which is written but not read: export the strands as HAIR, PLY, OBJ or JSON"},
        {"PXR-USDC", "this is USD, which is not read: export the strands as HAIR, PLY, OBJ or JSON"},
        {"requires maya",
         "this is a Maya scene, which is not read: export the strands as HAIR, PLY, OBJ or JSON"},
        {"//Maya", "this is a Maya scene, which is not read: export the strands as HAIR, PLY, OBJ or JSON"},
        {"Kaydara FBX", "this is FBX, which is not read: export the strands as HAIR, PLY, OBJ or JSON"},
        {"glTF", "this is glTF, which is not read: export the strands as HAIR, PLY, OBJ or JSON"},
        {"\x1f\x8b", "this is compressed with gzip: uncompress it first"}};
    if (starts(bytes, "HAIR") || starts(bytes, "hair"))
        return *found = certain(GROOM_FORMAT_HAIR), 1;
    if (starts(bytes, "ply\n") || starts(bytes, "ply\r"))
        return *found = certain(GROOM_FORMAT_PLY), 1;
    if (starts(bytes, "\x93NUMPY"))
        return *found = certain(GROOM_FORMAT_NPY), 1;
    if (starts(bytes, "PK\3\4") || starts(bytes, "PK\5\6"))
        return *found = certain(GROOM_FORMAT_NPZ), 1;
    if (bytes->n >= 4 && (input_f32(bytes->at) == 3.0f || input_f32(bytes->at) == 4.0f))
        return *found = certain(GROOM_FORMAT_TFX), 1;
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        if (starts(bytes, others[i].magic))
            return *found = unknown(others[i].hint), 1;
    return 0;
}

/* --- 2: text --------------------------------------------------------------------------- */

static int is_text(const struct bytes *bytes)
{
    size_t n = bytes->n < 512 ? bytes->n : 512;
    for (size_t i = 0; i < n; i++)
        if (bytes->at[i] < ' ' && !isspace(bytes->at[i]))
            return 0;
    return n > 0;
}

static int is_obj(const unsigned char *p, const unsigned char *end)
{
    static const char *const statements[] = {"v", "vn", "vt", "vp",     "l",      "f",      "p",
                                             "o", "g",  "s",  "mtllib", "usemtl", "cstype", "deg"};
    size_t n = 0;
    while (p < end && (*p == '#' || isspace(*p))) { /* comments are other texts' headings */
        const unsigned char *line_end = *p == '#' ? memchr(p, '\n', (size_t)(end - p)) : p;
        p = line_end ? line_end + 1 : end;
    }
    if (p == end)
        return 1;
    while (p + n < end && n < 8 && p[n] > ' ')
        n++;
    for (size_t i = 0; i < sizeof statements / sizeof statements[0]; i++)
        if (n == strlen(statements[i]) && memcmp(p, statements[i], n) == 0 && p + n < end)
            return 1;
    return 0;
}

static int by_text(const struct bytes *bytes, struct recognised *found)
{
    const unsigned char *p = bytes->at, *end = p + bytes->n;
    if (!is_text(bytes))
        return 0;
    if (starts(bytes, "\xef\xbb\xbf"))
        p += 3;
    while (p < end && isspace(*p))
        p++;
    if (p == end)
        return *found = unknown("nothing but white space"), 1;
    if (*p == '{' || *p == '[')
        return *found = certain(GROOM_FORMAT_JSON), 1;
    if (end - p >= 8 && memcmp(p, "version", 7) == 0 && isspace(p[7]))
        return *found = certain(GROOM_FORMAT_TFX), 1;
    if (is_obj(p, end))
        return *found = certain(GROOM_FORMAT_OBJ), 1;
    return *found =
               unknown("this is text, but no strand file: JSON begins with \"{\" or \"[\", OBJ with a statement like \"v\", "
                       "TressFX with \"version\", PLY with \"ply\"; HAIR, .data, .bin, .npy and .npz, which are read too, "
                       "are binary"),
           1;
}

/* --- 3: counts that fit -------------------------------------------------------------------- */

static int plausible_point(const unsigned char *bytes)
{
    for (int k = 0; k < 3; k++) {
        float x = input_f32(bytes + 4 * k);
        if (isfinite(x) && (fabsf(x) > 1e9f || (x != 0 && fabsf(x) < 1e-30f)))
            return 0; /* NaN and infinity are a strand's fault; these are another layout's */
    }
    return 1;
}

static int is_monohair(const struct bytes *bytes)
{
    if (bytes->n < 8 + 2)
        return 0;
    uint64_t n_strands = input_u32(bytes->at), n_points = input_u32(bytes->at + 4), sum = 0, i;
    if (n_strands == 0 || n_points == 0 || n_points > n_strands * UINT16_MAX)
        return 0;
    if (bytes->size < 0 && n_strands > MANY_STRANDS)
        return 0;
    if (bytes->size >= 0 && (uint64_t)bytes->size != 8 + 2 * n_strands + 12 * n_points)
        return 0;
    for (i = 0; i < n_strands && 8 + 2 * i + 2 <= bytes->n; i++)
        sum += input_u16(bytes->at + 8 + 2 * i);
    if (sum > n_points || (i == n_strands && sum != n_points))
        return 0;
    uint64_t first = 8 + 2 * n_strands;
    for (i = 0; i < 16 && i < n_points && first + 12 * i + 12 <= bytes->n; i++)
        if (!plausible_point(bytes->at + first + 12 * i))
            return 0;
    return 1;
}

/* 1 more than the whole records that the walk meets, 0 where the stride is impossible; without a
 * size, as many as it met where it breaks. */
static uint64_t walk_records(const struct bytes *bytes, uint32_t stride)
{
    uint64_t at = 4, n_whole = 0, n_strands, size = bytes->size >= 0 ? (uint64_t)bytes->size : UINT64_MAX;
    if (bytes->n < 8 || (n_strands = input_u32(bytes->at)) == 0 || n_strands > INT32_MAX)
        return 0;
    if (bytes->size < 0 && n_strands > MANY_STRANDS)
        return 0;
    if (bytes->size >= 0 && (size < 4 + 4 * n_strands || (size - 4 - 4 * n_strands) % stride != 0))
        return 0;
    for (uint64_t i = 0; i < n_strands && at + 4 <= bytes->n; i++) {
        uint64_t n = input_u32(bytes->at + at), end = at + 4 + n * stride;
        if (n > INT32_MAX / stride || end > size || (bytes->size < 0 && n > MANY_VERTICES))
            return bytes->size < 0 ? n_whole : 0;
        for (uint64_t j = 0; j < n && j < 16 && at + 4 + (j + 1) * stride <= bytes->n; j++)
            if (!plausible_point(bytes->at + at + 4 + j * stride))
                return bytes->size < 0 ? n_whole : 0;
        n_whole += end <= bytes->n;
        at = end;
        if (i + 1 == n_strands && bytes->size >= 0 && at != size)
            return 0;
    }
    return n_whole + 1;
}

static struct recognised by_counts(const struct bytes *bytes)
{
    static const struct {
        uint32_t stride;
        groom_format format;
    } layouts[] = {{12, GROOM_FORMAT_DATA}, {16, GROOM_FORMAT_DATA}, {28, GROOM_FORMAT_CT2HAIR}};
    struct recognised found = {GROOM_FORMAT_AUTO, 0, 0, NULL};
    uint64_t best = 0;
    if (is_monohair(bytes))
        return (struct recognised){GROOM_FORMAT_MONOHAIR, 0, 0, NULL};
    for (size_t i = 0; i < sizeof layouts / sizeof layouts[0]; i++) {
        uint64_t n = walk_records(bytes, layouts[i].stride);
        if (n > best) {
            best = n;
            found = (struct recognised){layouts[i].format, 0, layouts[i].stride, NULL};
        }
    }
    return found;
}

struct recognised recognise(const unsigned char *at, size_t n, int64_t size)
{
    struct bytes bytes = {at, n, size};
    struct recognised found;
    if (by_magic(&bytes, &found) || by_text(&bytes, &found))
        return found;
    found = by_counts(&bytes);
    if (found.format == GROOM_FORMAT_AUTO && size >= 0) {
        bytes.size = -1;
        found = by_counts(&bytes);
    }
    return found;
}
