/* Wavefront OBJ: v, vt, f, g and o; everything else is passed over. A backslash joins lines. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "geometry/mesh_build.h"

struct obj_reader {
    struct mesh_build *build;
    const char *begin, *end; /* the file */
    const char *at, *stop;   /* the rest of the present line */
    const char *group;       /* the one to keep, or NULL */
    int inside, found;       /* whether faces are kept now; whether the group was seen */
    struct groom_diag *diag;
};

static int is_space(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/* Blanks, and a backslash before the line's end with the end itself. */
static void skip_space(struct obj_reader *r)
{
    for (;;) {
        while (r->at < r->stop && is_space(*r->at))
            r->at++;
        const char *p = r->at;
        if (p + 1 >= r->end || *p != '\\' || !(p[1] == '\n' || (p[1] == '\r' && p + 2 < r->end && p[2] == '\n')))
            return;
        r->at = p + (p[1] == '\n' ? 2 : 3);
        const char *next = memchr(r->at, '\n', (size_t)(r->end - r->at));
        r->stop = next ? next : r->end;
    }
}

static groom_status refuse(struct obj_reader *r, const char *expected)
{
    return groom_fail_at(r->diag, GROOM_EFORMAT, r->at - r->begin, "expected %s here", expected);
}

/* n numbers of a v or vt line; missing ones are 0 beyond `needed`. */
static groom_status read_numbers(struct obj_reader *r, struct growing *array, int n, int needed)
{
    float *out = growing_add(array, 1, r->build->allocator);
    if (!out)
        return mesh_no_memory(r->diag);
    for (int i = 0; i < n; i++) {
        double value = 0;
        skip_space(r);
        const char *after = mesh_scan_number(r->at, &value);
        if (!after && (i < needed || r->at < r->stop))
            return refuse(r, array == &r->build->points ? "a coordinate of a vertex" : "a texture coordinate");
        r->at = after ? after : r->at;
        out[i] = (float)value;
    }
    return GROOM_OK;
}

/* 1 is the first, -1 the last so far; 0 is nobody. */
static int resolve(long long index, size_t count, uint32_t *out)
{
    long long i = index > 0 ? index - 1 : (long long)count + index;
    if (index == 0 || i < 0 || i >= UINT32_MAX)
        return 0;
    *out = (uint32_t)i;
    return 1;
}

/* v, v/vt, v//vn, v/vt/vn */
static groom_status read_corner(struct obj_reader *r, struct mesh_corner *corner)
{
    long long index;
    const char *after = mesh_scan_integer(r->at, &index);
    if (!after || !resolve(index, r->build->points.count, &corner->vertex))
        return refuse(r, "the number of a vertex, from 1, or from -1 backwards");
    r->at = after;
    corner->uv = MESH_NO_UV;
    if (r->at == r->stop || *r->at != '/')
        return GROOM_OK;
    r->at++;
    if ((after = mesh_scan_integer(r->at, &index)) != NULL) {
        if (!resolve(index, r->build->uvs.count, &corner->uv))
            return refuse(r, "the number of a texture coordinate, from 1, or from -1 backwards");
        r->at = after;
    }
    while (r->at < r->stop && !is_space(*r->at) && *r->at != '\\')
        r->at++; /* the normal's number */
    return GROOM_OK;
}

static groom_status read_face(struct obj_reader *r, uint32_t byte_offset)
{
    struct mesh_build *build = r->build;
    size_t first = build->corners.count;
    for (skip_space(r); r->at < r->stop && *r->at != '#'; skip_space(r)) {
        struct mesh_corner *corner = growing_add(&build->corners, 1, build->allocator);
        if (!corner)
            return mesh_no_memory(r->diag);
        groom_status st = read_corner(r, corner);
        if (st != GROOM_OK)
            return st;
    }
    if (!r->inside) {
        build->corners.count = first;
        return GROOM_OK;
    }
    struct mesh_face *face = growing_add(&build->faces, 1, build->allocator);
    if (!face)
        return mesh_no_memory(r->diag);
    *face = (struct mesh_face){(uint32_t)first, (uint32_t)(build->corners.count - first), byte_offset};
    return GROOM_OK;
}

/* g may name several groups, o names one object with blanks in it perhaps. */
static void read_group(struct obj_reader *r)
{
    if (!r->group)
        return;
    size_t length = strlen(r->group);
    r->inside = 0;
    skip_space(r);
    const char *name = r->at, *stop = r->stop;
    while (stop > name && is_space(stop[-1]))
        stop--;
    if ((size_t)(stop - name) == length && memcmp(name, r->group, length) == 0)
        r->inside = 1;
    while (name < stop && !r->inside) {
        const char *end = name;
        while (end < stop && !is_space(*end))
            end++;
        r->inside = (size_t)(end - name) == length && memcmp(name, r->group, length) == 0;
        for (name = end; name < stop && is_space(*name);)
            name++;
    }
    r->found |= r->inside;
}

static int takes_word(struct obj_reader *r, const char *word)
{
    size_t n = strlen(word);
    if ((size_t)(r->stop - r->at) <= n || memcmp(r->at, word, n) != 0 || !is_space(r->at[n]))
        return 0;
    r->at += n;
    return 1;
}

static groom_status read_line(struct obj_reader *r)
{
    while (r->at < r->stop && is_space(*r->at))
        r->at++;
    uint32_t byte_offset = (uint32_t)(r->at - r->begin);
    if (takes_word(r, "v"))
        return read_numbers(r, &r->build->points, 3, 3);
    if (takes_word(r, "vt"))
        return read_numbers(r, &r->build->uvs, 2, 1);
    if (takes_word(r, "f"))
        return read_face(r, byte_offset);
    if (takes_word(r, "g") || takes_word(r, "o"))
        read_group(r);
    return GROOM_OK;
}

groom_status mesh_read_obj(struct mesh_build *build, const char *bytes, size_t n_bytes, const char *group,
                           struct groom_diag *diag)
{
    struct obj_reader r = {.build = build, .begin = bytes, .end = bytes + n_bytes, .at = bytes,
                           .group = group, .inside = group == NULL, .diag = diag};
    while (r.at < r.end) {
        const char *newline = memchr(r.at, '\n', (size_t)(r.end - r.at));
        r.stop = newline ? newline : r.end;
        groom_status st = read_line(&r);
        if (st != GROOM_OK)
            return st;
        r.at = r.stop < r.end ? r.stop + 1 : r.end;
    }
    if (group && !r.found)
        return groom_fail(diag, GROOM_EEMPTY, "no group or object of the file is called \"%.80s\"", group);
    return GROOM_OK;
}
