/* PLY (Turk 1994): ASCII and binary of either byte order, elements in any order and of any shape.
 * From `vertex` come x y z and u v (or s t, texture_u texture_v); from `face` the list
 * vertex_indices or vertex_index, and the list texcoord of u v for each corner. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "geometry/mesh_build.h"

#define MOST_ELEMENTS 16
#define MOST_PROPERTIES 64

enum ply_type { PLY_NONE, PLY_I8, PLY_U8, PLY_I16, PLY_U16, PLY_I32, PLY_U32, PLY_F32, PLY_F64 };
static const uint8_t type_bytes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};

/* What a property is to us. */
enum ply_role { ROLE_NONE, ROLE_X, ROLE_Y, ROLE_Z, ROLE_U, ROLE_V, ROLE_CORNERS, ROLE_CORNER_UVS };

struct ply_property {
    enum ply_type type, count_type; /* count_type: of a list, else PLY_NONE */
    enum ply_role role;
};

struct ply_element {
    enum { ELEMENT_OTHER, ELEMENT_VERTEX, ELEMENT_FACE } kind;
    uint64_t count;
    uint32_t n_properties;
    struct ply_property properties[MOST_PROPERTIES];
};

struct ply_reader {
    struct mesh_build *build;
    const char *begin, *end, *at;
    const char *line; /* where the present line of the header begins */
    enum { PLY_ASCII, PLY_LITTLE, PLY_BIG } encoding;
    uint32_t n_elements;
    struct ply_element elements[MOST_ELEMENTS];
    int vertex_uvs; /* texture coordinates stand with the vertices */
    struct groom_diag *diag;
};

static groom_status refuse(struct ply_reader *r, const char *expected)
{
    if (r->at >= r->end)
        return groom_fail_at(r->diag, GROOM_ETRUNCATED, r->end - r->begin, "the file ends where %s was expected", expected);
    return groom_fail_at(r->diag, GROOM_EFORMAT, r->at - r->begin, "expected %s here", expected);
}

/* --- the header ------------------------------------------------------------ */

static groom_status refuse_line(struct ply_reader *r, const char *expected)
{
    return groom_fail_at(r->diag, GROOM_EFORMAT, r->line - r->begin, "expected %s in this line of the header", expected);
}

/* Words of one header line, zero-terminated; longer words and further words are cut off. */
struct ply_line {
    char words[8][48];
    int n;
};

static int read_line(struct ply_reader *r, struct ply_line *line)
{
    const char *newline = memchr(r->at, '\n', (size_t)(r->end - r->at));
    if (!newline)
        return 0;
    line->n = 0;
    r->line = r->at;
    memset(line->words, 0, sizeof line->words);
    for (const char *p = r->at; p < newline;) {
        const char *begin = p;
        while (p < newline && *p != ' ' && *p != '\t' && *p != '\r')
            p++;
        if (p > begin && line->n < 8) {
            size_t length = (size_t)(p - begin) < 47 ? (size_t)(p - begin) : 47;
            memcpy(line->words[line->n++], begin, length);
        }
        while (p < newline && (*p == ' ' || *p == '\t' || *p == '\r'))
            p++;
    }
    r->at = newline + 1;
    return 1;
}

static enum ply_type type_of(const char *name)
{
    static const struct { const char *name; enum ply_type type; } names[] = {
        {"char", PLY_I8},   {"int8", PLY_I8},   {"uchar", PLY_U8},   {"uint8", PLY_U8},
        {"short", PLY_I16}, {"int16", PLY_I16}, {"ushort", PLY_U16}, {"uint16", PLY_U16},
        {"int", PLY_I32},   {"int32", PLY_I32}, {"uint", PLY_U32},   {"uint32", PLY_U32},
        {"float", PLY_F32}, {"float32", PLY_F32}, {"double", PLY_F64}, {"float64", PLY_F64},
    };
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strcmp(name, names[i].name) == 0)
            return names[i].type;
    return PLY_NONE;
}

static enum ply_role role_of(int kind, int is_list, const char *name)
{
    static const struct { int kind, is_list; const char *name; enum ply_role role; } names[] = {
        {ELEMENT_VERTEX, 0, "x", ROLE_X}, {ELEMENT_VERTEX, 0, "y", ROLE_Y}, {ELEMENT_VERTEX, 0, "z", ROLE_Z},
        {ELEMENT_VERTEX, 0, "u", ROLE_U}, {ELEMENT_VERTEX, 0, "v", ROLE_V}, {ELEMENT_VERTEX, 0, "s", ROLE_U},
        {ELEMENT_VERTEX, 0, "t", ROLE_V}, {ELEMENT_VERTEX, 0, "texture_u", ROLE_U},
        {ELEMENT_VERTEX, 0, "texture_v", ROLE_V}, {ELEMENT_FACE, 1, "vertex_indices", ROLE_CORNERS},
        {ELEMENT_FACE, 1, "vertex_index", ROLE_CORNERS}, {ELEMENT_FACE, 1, "texcoord", ROLE_CORNER_UVS},
    };
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (names[i].kind == kind && names[i].is_list == is_list && strcmp(name, names[i].name) == 0)
            return names[i].role;
    return ROLE_NONE;
}

static groom_status header_format(struct ply_reader *r, const struct ply_line *line)
{
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    for (int i = 0; i < 3; i++) {
        if (strcmp(line->words[1], names[i]) == 0) {
            r->encoding = i == 0 ? PLY_ASCII : i == 1 ? PLY_LITTLE : PLY_BIG;
            return GROOM_OK;
        }
    }
    return refuse_line(r, "the format ascii, binary_little_endian or binary_big_endian");
}

static groom_status header_element(struct ply_reader *r, const struct ply_line *line)
{
    long long count;
    const char *word = line->words[2], *stop = word + strlen(word);
    if (mesh_scan_integer(word, &count) != stop || count < 0)
        return refuse_line(r, "a count");
    if (r->n_elements == MOST_ELEMENTS)
        return refuse_line(r, "no more than 16 elements");
    struct ply_element *element = &r->elements[r->n_elements++];
    element->count = (uint64_t)count;
    element->kind = strcmp(line->words[1], "vertex") == 0 ? ELEMENT_VERTEX
                    : strcmp(line->words[1], "face") == 0 ? ELEMENT_FACE : ELEMENT_OTHER;
    return GROOM_OK;
}

static groom_status header_property(struct ply_reader *r, const struct ply_line *line)
{
    struct ply_element *element = r->n_elements ? &r->elements[r->n_elements - 1] : NULL;
    if (!element || element->n_properties == MOST_PROPERTIES)
        return refuse_line(r, "a property of an element, at most 64 of each");
    struct ply_property *property = &element->properties[element->n_properties++];
    int is_list = strcmp(line->words[1], "list") == 0;
    property->count_type = is_list ? type_of(line->words[2]) : PLY_NONE;
    property->type = type_of(line->words[is_list ? 3 : 1]);
    property->role = role_of(element->kind, is_list, line->words[is_list ? 4 : 2]);
    if (property->type == PLY_NONE || (is_list && (property->count_type == PLY_NONE || property->count_type >= PLY_F32)))
        return refuse_line(r, "a known type");
    if (property->role == ROLE_CORNERS && property->type >= PLY_F32)
        return refuse_line(r, "whole numbers as vertex_indices");
    return GROOM_OK;
}

static groom_status read_header(struct ply_reader *r)
{
    struct ply_line line;
    int has_format = 0;
    while (read_line(r, &line)) {
        groom_status st = GROOM_OK;
        if (strcmp(line.words[0], "end_header") == 0)
            return has_format ? GROOM_OK : refuse_line(r, "a format line before");
        if (strcmp(line.words[0], "format") == 0) {
            st = header_format(r, &line);
            has_format = 1;
        } else if (strcmp(line.words[0], "element") == 0) {
            st = header_element(r, &line);
        } else if (strcmp(line.words[0], "property") == 0) {
            st = header_property(r, &line);
        }
        if (st != GROOM_OK)
            return st;
    }
    r->at = r->end;
    return refuse(r, "end_header");
}

static int has_role(const struct ply_element *element, enum ply_role role)
{
    for (uint32_t i = 0; i < element->n_properties; i++)
        if (element->properties[i].role == role)
            return 1;
    return 0;
}

/* The fewest bytes that one of these takes up: what a count is held against. */
static uint64_t least_bytes(const struct ply_reader *r, const struct ply_element *element)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < element->n_properties; i++) {
        const struct ply_property *p = &element->properties[i];
        bytes += r->encoding == PLY_ASCII ? 2 : type_bytes[p->count_type != PLY_NONE ? p->count_type : p->type];
    }
    return bytes;
}

static groom_status check_header(struct ply_reader *r)
{
    int has_vertices = 0, has_faces = 0;
    uint64_t left = (uint64_t)(r->end - r->at) + 1; /* the last blank of a text may be missing */
    for (uint32_t i = 0; i < r->n_elements; i++) {
        struct ply_element *element = &r->elements[i];
        uint64_t least = least_bytes(r, element);
        if (least == 0)
            element->count = 0; /* nothing to read, however often */
        if (least && element->count > left / least)
            return groom_fail_at(r->diag, GROOM_ETRUNCATED, r->end - r->begin,
                                 "the header promises %llu elements of at least %llu bytes; %llu bytes follow it",
                                 (unsigned long long)element->count, (unsigned long long)least, (unsigned long long)left - 1);
        if (element->kind == ELEMENT_VERTEX) {
            has_vertices |= has_role(element, ROLE_X) && has_role(element, ROLE_Y) && has_role(element, ROLE_Z);
            r->vertex_uvs = has_role(element, ROLE_U) && has_role(element, ROLE_V);
        }
        has_faces |= element->kind == ELEMENT_FACE && has_role(element, ROLE_CORNERS);
    }
    if (!has_vertices || !has_faces)
        return groom_fail_at(r->diag, GROOM_EFORMAT, 0, "a mesh needs an element vertex with x, y and z and an element face with vertex_indices");
    return GROOM_OK;
}

/* --- the body --------------------------------------------------------------- */

static uint64_t load(const struct ply_reader *r, const char *at, unsigned n)
{
    uint64_t bits = 0;
    for (unsigned i = 0; i < n; i++)
        bits |= (uint64_t)(unsigned char)at[r->encoding == PLY_BIG ? n - 1 - i : i] << (8 * i);
    return bits;
}

static double decode(enum ply_type type, uint64_t bits)
{
    float f;
    double d;
    uint32_t low = (uint32_t)bits;
    switch (type) {
    case PLY_I8: return (int8_t)bits;
    case PLY_U8: return (uint8_t)bits;
    case PLY_I16: return (int16_t)bits;
    case PLY_U16: return (uint16_t)bits;
    case PLY_I32: return (int32_t)bits;
    case PLY_U32: return low;
    case PLY_F32: memcpy(&f, &low, sizeof f); return f;
    case PLY_F64: memcpy(&d, &bits, sizeof d); return d;
    case PLY_NONE: break;
    }
    return 0;
}

static groom_status read_value(struct ply_reader *r, enum ply_type type, double *value)
{
    if (r->encoding != PLY_ASCII) {
        unsigned n = type_bytes[type];
        if ((size_t)(r->end - r->at) < n) {
            r->at = r->end;
            return refuse(r, "a number");
        }
        *value = decode(type, load(r, r->at, n));
        r->at += n;
        return GROOM_OK;
    }
    while (r->at < r->end && (*r->at == ' ' || *r->at == '\t' || *r->at == '\r' || *r->at == '\n'))
        r->at++;
    const char *after = mesh_scan_number(r->at, value);
    if (!after)
        return refuse(r, "a number");
    r->at = after;
    return GROOM_OK;
}

/* A whole number 0 .. limit. */
static groom_status read_count(struct ply_reader *r, enum ply_type type, double limit, const char *expected, uint32_t *count)
{
    const char *before = r->at;
    double value;
    groom_status st = read_value(r, type, &value);
    if (st != GROOM_OK)
        return st;
    if (!(value >= 0 && value <= limit && value == floor(value))) {
        r->at = before;
        return refuse(r, expected);
    }
    *count = (uint32_t)value;
    return GROOM_OK;
}

static groom_status read_corners(struct ply_reader *r, const struct ply_property *property, uint32_t n,
                                 uint32_t byte_offset, struct mesh_face **face)
{
    struct mesh_build *build = r->build;
    *face = growing_add(&build->faces, 1, build->allocator);
    struct mesh_corner *corners = growing_add(&build->corners, n, build->allocator);
    if (!*face || !corners)
        return mesh_no_memory(r->diag);
    **face = (struct mesh_face){(uint32_t)(build->corners.count - n), n, byte_offset};
    for (uint32_t i = 0; i < n; i++) {
        groom_status st = read_count(r, property->type, UINT32_MAX - 1.0, "the index of a vertex", &corners[i].vertex);
        if (st != GROOM_OK)
            return st;
        corners[i].uv = r->vertex_uvs ? corners[i].vertex : MESH_NO_UV;
    }
    return GROOM_OK;
}

/* u v for each corner of the face that the same line has named. */
static groom_status read_corner_uvs(struct ply_reader *r, const struct ply_property *property, uint32_t n,
                                    const struct mesh_face *face)
{
    struct mesh_build *build = r->build;
    struct mesh_corner *corners = build->corners.items;
    double value;
    for (uint32_t i = 0; i < n; i++) {
        groom_status st = read_value(r, property->type, &value);
        if (st != GROOM_OK)
            return st;
        if (!face || r->vertex_uvs || n != face->n * 2)
            continue;
        if (i % 2 == 0) {
            corners[face->first + i / 2].uv = (uint32_t)build->uvs.count;
            if (!growing_add(&build->uvs, 1, build->allocator))
                return mesh_no_memory(r->diag);
        }
        ((float *)build->uvs.items)[(build->uvs.count - 1) * 2 + i % 2] = (float)value;
    }
    return GROOM_OK;
}

static groom_status read_list(struct ply_reader *r, const struct ply_property *property, uint32_t byte_offset,
                              struct mesh_face **face)
{
    uint32_t n = 0;
    double value;
    /* no list is longer than the bytes that are left */
    double limit = (double)(r->end - r->at);
    groom_status st = read_count(r, property->count_type, limit, "the length of a list that the file has room for", &n);
    if (st != GROOM_OK)
        return st;
    if (property->role == ROLE_CORNERS && !*face)
        return read_corners(r, property, n, byte_offset, face);
    if (property->role == ROLE_CORNER_UVS)
        return read_corner_uvs(r, property, n, *face);
    for (uint32_t i = 0; i < n && st == GROOM_OK; i++)
        st = read_value(r, property->type, &value);
    return st;
}

static groom_status keep_vertex(struct ply_reader *r, const double values[])
{
    float *point = growing_add(&r->build->points, 1, r->build->allocator);
    if (!point)
        return mesh_no_memory(r->diag);
    for (int axis = 0; axis < 3; axis++)
        point[axis] = (float)values[ROLE_X + axis];
    if (!r->vertex_uvs)
        return GROOM_OK;
    float *uv = growing_add(&r->build->uvs, 1, r->build->allocator);
    if (!uv)
        return mesh_no_memory(r->diag);
    uv[0] = (float)values[ROLE_U];
    uv[1] = (float)values[ROLE_V];
    return GROOM_OK;
}

static groom_status read_element(struct ply_reader *r, const struct ply_element *element)
{
    double values[ROLE_CORNERS] = {0}, value;
    struct mesh_face *face = NULL;
    uint32_t byte_offset = (uint32_t)(r->at - r->begin);
    for (uint32_t i = 0; i < element->n_properties; i++) {
        const struct ply_property *property = &element->properties[i];
        groom_status st = property->count_type != PLY_NONE ? read_list(r, property, byte_offset, &face)
                                                           : read_value(r, property->type, &value);
        if (st != GROOM_OK)
            return st;
        if (property->count_type == PLY_NONE && property->role != ROLE_NONE)
            values[property->role] = value;
    }
    return element->kind == ELEMENT_VERTEX ? keep_vertex(r, values) : GROOM_OK;
}

static groom_status read_body(struct ply_reader *r)
{
    for (uint32_t e = 0; e < r->n_elements; e++) {
        for (uint64_t i = 0; i < r->elements[e].count; i++) {
            groom_status st = read_element(r, &r->elements[e]);
            if (st != GROOM_OK)
                return st;
        }
    }
    return GROOM_OK;
}

groom_status mesh_read_ply(struct mesh_build *build, const char *bytes, size_t n_bytes, struct groom_diag *diag)
{
    struct ply_reader *r = memory_array_zero(build->allocator, 1, sizeof *r);
    if (!r)
        return mesh_no_memory(diag);
    r->build = build;
    r->begin = r->at = r->line = bytes;
    r->end = bytes + n_bytes;
    r->diag = diag;
    groom_status st = read_header(r);
    if (st == GROOM_OK)
        st = check_header(r);
    if (st == GROOM_OK)
        st = read_body(r);
    memory_release(build->allocator, r, 1, sizeof *r);
    return st;
}
