/* PLY, ascii and binary of either byte order. Where strands begin is taken from, in this order:
 *  - an element "strand" with a count a strand: a property of segments (nsegs, n_segments, ...) or of
 *    points (nverts, npoints, ...), or a list of vertex indices;
 *  - an element "edge" with vertex1 and vertex2, rejoined;
 *  - neither: 100 points a strand, as NeuralHaircut, HAAR and GaussianHaircut write them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "strands/lines.h"
#include "strands/reader.h"
#include "strands/text.h"

#define MAX_ELEMENTS          16
#define MAX_PROPERTIES        64 /* 0.5 KiB of a row each; GaussianHaircut has 6, splats about 60 */
#define MAX_NAME              32
#define POINTS_WITHOUT_COUNTS 100

enum type { I8, U8, I16, U16, I32, U32, F32, F64, N_TYPES };
static const unsigned char type_size[N_TYPES] = {1, 1, 2, 2, 4, 4, 4, 8};

struct property {
    char name[MAX_NAME];
    enum type type;
    int is_list;
    enum type count_type; /* of a list */
    uint32_t offset;      /* in a binary row without lists */
};

enum role { OTHER, VERTEX, STRAND, EDGE };

struct element {
    char name[MAX_NAME];
    enum role role;
    uint64_t n;
    int n_properties, n_lists;
    uint32_t row_bytes; /* of a binary row; the least where it has lists */
    struct property properties[MAX_PROPERTIES];
};

struct ply {
    struct reader *reader;
    struct text text; /* of the header, and of ascii data */
    struct lines lines;
    int ascii, swap;
    int n_elements;
    uint64_t n_vertices, n_faces;
    int vertices_read, strands_found, edges_found;
    struct element elements[MAX_ELEMENTS];
    double row[MAX_PROPERTIES];
};

/* --- header ----------------------------------------------------------------------------- */

static groom_status refuse(struct ply *ply, const char *what)
{
    return text_fail(&ply->text, what, ply->reader->diag);
}

static int type_of(const char *word, enum type *type)
{
    static const struct {
        const char *name;
        enum type type;
    } names[] = {{"char", I8},   {"int8", I8},     {"uchar", U8},   {"uint8", U8},
                 {"short", I16}, {"int16", I16},   {"ushort", U16}, {"uint16", U16},
                 {"int", I32},   {"int32", I32},   {"uint", U32},   {"uint32", U32},
                 {"float", F32}, {"float32", F32}, {"double", F64}, {"float64", F64}};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strcmp(word, names[i].name) == 0) {
            *type = names[i].type;
            return 1;
        }
    return 0;
}

static size_t next_word(struct ply *ply, char *word, size_t capacity)
{
    text_skip_blank(&ply->text);
    return text_word(&ply->text, word, capacity);
}

static groom_status read_format(struct ply *ply)
{
    char word[32];
    if (!next_word(ply, word, sizeof word))
        return refuse(ply, "the kind of PLY");
    ply->ascii = strcmp(word, "ascii") == 0;
    ply->swap = strcmp(word, "binary_big_endian") == 0;
    if (!ply->ascii && !ply->swap && strcmp(word, "binary_little_endian") != 0)
        return refuse(ply, "ascii, binary_little_endian or binary_big_endian before this");
    return GROOM_OK;
}

static enum role role_of(const char *name)
{
    return strcmp(name, "vertex") == 0   ? VERTEX
           : strcmp(name, "strand") == 0 ? STRAND
           : strcmp(name, "edge") == 0   ? EDGE
                                         : OTHER;
}

static groom_status read_element(struct ply *ply)
{
    struct element *element = &ply->elements[ply->n_elements];
    long long n;
    if (ply->n_elements == MAX_ELEMENTS)
        return refuse(ply, "no more than 16 elements: the end of the header");
    *element = (struct element){0};
    if (!next_word(ply, element->name, sizeof element->name))
        return refuse(ply, "the name of an element");
    text_skip_blank(&ply->text);
    if (!text_integer(&ply->text, &n) || n < 0)
        return refuse(ply, "the count of an element");
    element->n = (uint64_t)n;
    element->role = role_of(element->name);
    if (element->role == VERTEX)
        ply->n_vertices = element->n;
    if (strcmp(element->name, "face") == 0)
        ply->n_faces = element->n;
    ply->n_elements++;
    return GROOM_OK;
}

static groom_status read_property(struct ply *ply)
{
    char word[MAX_NAME];
    if (ply->n_elements == 0)
        return refuse(ply, "an element before its properties");
    struct element *element = &ply->elements[ply->n_elements - 1];
    struct property *property = &element->properties[element->n_properties];
    if (element->n_properties == MAX_PROPERTIES)
        return refuse(ply, "no more than 64 properties of an element: the next one");
    *property = (struct property){.offset = element->row_bytes};
    if (!next_word(ply, word, sizeof word))
        return refuse(ply, "the type of a property");
    if ((property->is_list = strcmp(word, "list") == 0)) {
        if (!next_word(ply, word, sizeof word) || !type_of(word, &property->count_type) ||
            property->count_type >= F32)
            return refuse(ply, "a whole number's type for the count of a list");
        if (!next_word(ply, word, sizeof word))
            return refuse(ply, "the type of a list");
    }
    if (!type_of(word, &property->type))
        return refuse(ply, "a type of PLY (char ... double) before this");
    if (!next_word(ply, property->name, sizeof property->name))
        return refuse(ply, "the name of a property");
    element->n_lists += property->is_list;
    element->row_bytes += type_size[property->is_list ? property->count_type : property->type];
    element->n_properties++;
    return GROOM_OK;
}

static groom_status read_header(struct ply *ply)
{
    char word[MAX_NAME];
    int has_format = 0;
    groom_status status = GROOM_OK;
    text_ready(&ply->text);
    if (memcmp(ply->text.p, "ply", 3) != 0)
        return refuse(ply, "\"ply\"");
    text_skip_line(&ply->text);
    while (status == GROOM_OK) {
        text_skip_space(&ply->text);
        if (!text_word(&ply->text, word, sizeof word))
            return refuse(ply, "a line of the header");
        if (strcmp(word, "end_header") == 0)
            break;
        if (strcmp(word, "format") == 0) {
            status = read_format(ply);
            has_format = 1;
        } else if (strcmp(word, "element") == 0) {
            status = read_element(ply);
        } else if (strcmp(word, "property") == 0) {
            status = read_property(ply);
        } else if (strcmp(word, "comment") != 0 && strcmp(word, "obj_info") != 0) {
            return refuse(ply, "format, element, property, comment or end_header before this");
        }
        if (status == GROOM_OK)
            text_skip_line(&ply->text);
    }
    if (status == GROOM_OK && text_peek(&ply->text) != '\n' && text_peek(&ply->text) != '\r')
        return refuse(ply, "the end of the line of \"end_header\"");
    if (status == GROOM_OK)
        text_skip_line(&ply->text);
    if (status == GROOM_OK && !has_format)
        return refuse(ply, "a line \"format\" before the data");
    return status;
}

/* --- rows ---------------------------------------------------------------------------------- */

static double decode(const unsigned char *bytes, enum type type, int swap)
{
    unsigned char b[8] = {0};
    size_t size = type_size[type];
    double wide;
    for (size_t i = 0; i < size; i++)
        b[i] = bytes[swap ? size - 1 - i : i];
    switch (type) {
    case I8:
        return (signed char)b[0];
    case U8:
        return b[0];
    case I16:
        return (int16_t)input_u16(b);
    case U16:
        return input_u16(b);
    case I32:
        return (int32_t)input_u32(b);
    case U32:
        return input_u32(b);
    case F32:
        return (double)input_f32(b);
    default:
        memcpy(&wide, b, sizeof wide);
        return wide;
    }
}

static groom_status read_value(struct ply *ply, const struct element *element, enum type type, double *value)
{
    const unsigned char *bytes;
    if (ply->ascii) {
        text_skip_space(&ply->text);
        return text_number(&ply->text, value) ? GROOM_OK : refuse(ply, element->name);
    }
    groom_status status =
        input_take(ply->reader->in, type_size[type], element->name, &bytes, ply->reader->diag);
    if (status == GROOM_OK)
        *value = decode(bytes, type, ply->swap);
    return status;
}

static uint64_t offset(const struct ply *ply)
{
    return ply->ascii ? text_offset(&ply->text) : input_offset(ply->reader->in);
}

static groom_status out_of_builder(struct ply *ply)
{
    return builder_fail(ply->reader->out, offset(ply), ply->reader->diag);
}

/* A whole number in 0..limit-1 that a row says. */
static groom_status whole(struct ply *ply, const char *what, double value, uint64_t limit, uint32_t *out)
{
    if (!(value >= 0 && value < (double)limit && value == floor(value)))
        return groom_fail_at(ply->reader->diag, GROOM_EFORMAT, (int64_t)offset(ply),
                             "%s before byte %llu is %g; a whole number from 0 to %llu was expected", what,
                             (unsigned long long)offset(ply), value,
                             (unsigned long long)(limit ? limit - 1 : 0));
    *out = (uint32_t)value;
    return GROOM_OK;
}

/* A list: passed over, or a strand's vertex indices. */
static groom_status read_list(struct ply *ply, const struct element *element, const struct property *property)
{
    double value;
    uint32_t n = 0, index = 0;
    int is_strand = element->role == STRAND && ply->vertices_read;
    groom_status status = read_value(ply, element, property->count_type, &value);
    if (status == GROOM_OK)
        status = whole(ply, "the count of a list", value, UINT64_C(1) << 32, &n);
    for (uint32_t i = 0; status == GROOM_OK && i < n; i++) {
        if ((status = read_value(ply, element, property->type, &value)) != GROOM_OK || !is_strand)
            continue;
        if ((status = whole(ply, "a vertex index", value, ply->n_vertices, &index)) == GROOM_OK &&
            !(i ? lines_continue(&ply->lines, index) : lines_begin(&ply->lines, index)))
            status = out_of_builder(ply);
    }
    return status;
}

static groom_status read_row(struct ply *ply, const struct element *element)
{
    for (int i = 0; i < element->n_properties; i++) {
        const struct property *property = &element->properties[i];
        groom_status status = property->is_list ? read_list(ply, element, property)
                                                : read_value(ply, element, property->type, &ply->row[i]);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

static int find_property(const struct element *element, const char *name)
{
    for (int i = 0; i < element->n_properties; i++)
        if (strcmp(element->properties[i].name, name) == 0 && !element->properties[i].is_list)
            return i;
    return -1;
}

/* Rows of no property, of any count, would take no bytes and no end. */
static groom_status check_element(struct ply *ply, const struct element *element)
{
    int64_t remaining = input_remaining(ply->reader->in);
    uint64_t least = ply->ascii ? 2 * (uint64_t)element->n_properties - 1 : element->row_bytes;
    if (element->n_properties == 0 && element->n > 0)
        return groom_fail_at(ply->reader->diag, GROOM_EFORMAT, (int64_t)offset(ply),
                             "element %s has %llu rows without a property", element->name,
                             (unsigned long long)element->n);
    if (remaining < 0 || element->n == 0)
        return GROOM_OK;
    if (element->n > ((uint64_t)remaining + 1) / least)
        return groom_fail_at(
            ply->reader->diag, GROOM_ETRUNCATED, (int64_t)offset(ply),
            "%llu rows of element %s need at least %llu bytes each from byte %llu on, where %llu are left",
            (unsigned long long)element->n, element->name, (unsigned long long)least,
            (unsigned long long)offset(ply), (unsigned long long)remaining);
    return GROOM_OK;
}

/* --- vertices ---------------------------------------------------------------------------------- */

static int is_packed(const struct ply *ply, const struct element *element, int x, int y, int z)
{
    const struct property *p = element->properties;
    return !ply->ascii && !ply->swap && !element->n_lists && p[x].type == F32 && p[y].type == F32 &&
           p[z].type == F32 && p[y].offset == p[x].offset + 4 && p[z].offset == p[x].offset + 8 &&
           element->row_bytes <= 4096;
}

/* Little-endian floats beside each other: whole windows at a time. */
static groom_status read_packed_vertices(struct ply *ply, const struct element *element, uint32_t first)
{
    for (uint64_t left = element->n; left > 0;) {
        const unsigned char *rows;
        size_t n;
        groom_status status = input_records(ply->reader->in, element->row_bytes, left, "a vertex", &rows, &n,
                                            ply->reader->diag);
        if (status != GROOM_OK)
            return status;
        if (!builder_points_f32(ply->reader->out, rows + first, n, element->row_bytes))
            return out_of_builder(ply);
        left -= n;
    }
    return GROOM_OK;
}

static groom_status read_vertices(struct ply *ply, const struct element *element)
{
    int x = find_property(element, "x"), y = find_property(element, "y"), z = find_property(element, "z");
    if (ply->vertices_read || x < 0 || y < 0 || z < 0)
        return groom_fail_at(ply->reader->diag, GROOM_EFORMAT, (int64_t)offset(ply),
                             "one element \"vertex\" with x, y and z was expected");
    groom_status status = read_expect(ply->reader, 0, element->n, 0);
    ply->vertices_read = 1;
    if (status == GROOM_OK && is_packed(ply, element, x, y, z))
        return read_packed_vertices(ply, element, element->properties[x].offset);
    for (uint64_t i = 0; status == GROOM_OK && i < element->n; i++) {
        status = read_row(ply, element);
        if (status == GROOM_OK && !builder_point(ply->reader->out, ply->row[x], ply->row[y], ply->row[z]))
            status = out_of_builder(ply);
    }
    return status;
}

/* --- strands and edges -------------------------------------------------------------------------- */

/* The property that counts, and how many points a strand has more than it says. */
static int find_count(const struct element *element, uint32_t *extra)
{
    static const struct {
        const char *name;
        uint32_t extra;
    } names[] = {{"nsegs", 1},        {"n_segs", 1},     {"nsegments", 1},    {"n_segments", 1},
                 {"num_segments", 1}, {"segments", 1},   {"nverts", 0},       {"n_verts", 0},
                 {"nvertices", 0},    {"n_vertices", 0}, {"num_vertices", 0}, {"npoints", 0},
                 {"n_points", 0},     {"num_points", 0}, {"points", 0},       {"count", 0}};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        int property = find_property(element, names[i].name);
        *extra = names[i].extra;
        if (property >= 0)
            return property;
    }
    return -1;
}

static groom_status cut_strand(struct ply *ply, double value, uint32_t extra)
{
    uint32_t count = 0;
    groom_status status = whole(ply, "the count of a strand", value, UINT64_C(1) << 31, &count);
    if (status != GROOM_OK)
        return status;
    uint64_t n = (uint64_t)count + extra,
             waiting = ply->strands_found ? builder_waiting(ply->reader->out) : 0;
    if (n > waiting)
        return groom_fail_at(ply->reader->diag, GROOM_EFORMAT, (int64_t)offset(ply),
                             "the strand before byte %llu has %llu vertices, where %llu of %llu are left",
                             (unsigned long long)offset(ply), (unsigned long long)n,
                             (unsigned long long)waiting, (unsigned long long)ply->n_vertices);
    return builder_cut(ply->reader->out, n) ? GROOM_OK : out_of_builder(ply);
}

static groom_status read_strands(struct ply *ply, const struct element *element)
{
    uint32_t extra;
    int property = find_count(element, &extra);
    groom_status status = GROOM_OK;
    if (!ply->vertices_read || ply->strands_found || ply->edges_found)
        return groom_fail_at(ply->reader->diag, GROOM_EFORMAT, (int64_t)offset(ply),
                             "element \"strand\" was expected once, after \"vertex\" and before \"edge\"");
    if (property < 0 && element->n_lists != 1)
        return groom_fail_at(
            ply->reader->diag, GROOM_EFORMAT, (int64_t)offset(ply),
            "element \"strand\" has no property that counts (nsegs, nverts or a list of vertex indices)");
    ply->strands_found = 1;
    for (uint64_t i = 0; status == GROOM_OK && i < element->n; i++) {
        status = read_row(ply, element);
        if (status == GROOM_OK && property >= 0)
            status = cut_strand(ply, ply->row[property], extra);
    }
    if (status == GROOM_OK && property < 0)
        return lines_cut(&ply->lines) ? GROOM_OK : out_of_builder(ply);
    if (status == GROOM_OK && builder_waiting(ply->reader->out) > 0)
        report_warn(ply->reader->report, "%llu vertices belong to no strand",
                    (unsigned long long)builder_waiting(ply->reader->out));
    return status;
}

static groom_status read_edges(struct ply *ply, const struct element *element)
{
    int from = find_property(element, "vertex1"), to = find_property(element, "vertex2");
    groom_status status = GROOM_OK;
    if (!ply->vertices_read || from < 0 || to < 0 || ply->edges_found)
        return groom_fail_at(ply->reader->diag, GROOM_EFORMAT, (int64_t)offset(ply),
                             "one element \"edge\" with vertex1 and vertex2 was expected, after \"vertex\"");
    ply->edges_found = 1;
    if (ply->strands_found && !ply->ascii && !element->n_lists)
        return input_skip(ply->reader->in, element->n * element->row_bytes, "an edge", ply->reader->diag);
    for (uint64_t i = 0; status == GROOM_OK && i < element->n; i++) {
        uint32_t a = 0, b = 0;
        if ((status = read_row(ply, element)) != GROOM_OK ||
            (status = whole(ply, "vertex1", ply->row[from], ply->n_vertices, &a)) != GROOM_OK ||
            (status = whole(ply, "vertex2", ply->row[to], ply->n_vertices, &b)) != GROOM_OK)
            return status;
        if (!ply->strands_found && !lines_edge(&ply->lines, a, b))
            return out_of_builder(ply);
    }
    if (status == GROOM_OK && !ply->strands_found && element->n > 0)
        return lines_cut(&ply->lines) ? GROOM_OK : out_of_builder(ply);
    return status;
}

/* Neither strands nor edges: the layout of NeuralHaircut and GaussianHaircut. */
static groom_status cut_uniformly(struct ply *ply)
{
    uint64_t n = ply->n_vertices;
    groom_status status = GROOM_OK;
    if (ply->n_faces > 0)
        return groom_fail_at(ply->reader->diag, GROOM_EFORMAT, (int64_t)offset(ply),
                             "%llu faces and no strands: this is a mesh; upload it as a head",
                             (unsigned long long)ply->n_faces);
    if (n == 0 || n % POINTS_WITHOUT_COUNTS != 0)
        return groom_fail_at(
            ply->reader->diag, GROOM_EFORMAT, (int64_t)offset(ply),
            "%llu vertices without an element \"strand\" or \"edge\": a multiple of %d was expected, "
            "as many a strand",
            (unsigned long long)n, POINTS_WITHOUT_COUNTS);
    report_warn(ply->reader->report,
                "the file does not say where strands begin: %d points a strand were taken",
                POINTS_WITHOUT_COUNTS);
    for (uint64_t i = 0; status == GROOM_OK && i < n / POINTS_WITHOUT_COUNTS; i++)
        status = builder_cut(ply->reader->out, POINTS_WITHOUT_COUNTS) ? GROOM_OK : out_of_builder(ply);
    return status;
}

/* --- the file ------------------------------------------------------------------------------------- */

static groom_status read_rows(struct ply *ply, const struct element *element)
{
    if (ply->ascii)
        text_end(&ply->text); /* what counts are checked against begins here */
    groom_status status = check_element(ply, element);
    if (status != GROOM_OK)
        return status;
    switch (element->role) {
    case VERTEX:
        return read_vertices(ply, element);
    case STRAND:
        return read_strands(ply, element);
    case EDGE:
        return read_edges(ply, element);
    default:
        break;
    }
    for (uint64_t i = 0; status == GROOM_OK && i < element->n; i++)
        status = read_row(ply, element);
    return status;
}

static groom_status read_elements(struct ply *ply)
{
    groom_status status = read_header(ply);
    if (!ply->ascii)
        text_end(&ply->text);
    for (int i = 0; status == GROOM_OK && i < ply->n_elements; i++)
        status = read_rows(ply, &ply->elements[i]);
    if (status == GROOM_OK && !ply->strands_found && ply->reader->report->n_strands_in_file == 0)
        status = cut_uniformly(ply);
    if (status == GROOM_OK && ply->ascii)
        text_skip_space(&ply->text);
    if (ply->ascii)
        text_end(&ply->text);
    return status;
}

groom_status read_ply(struct reader *reader)
{
    const struct groom_allocator *allocator = memory_allocator(reader->context);
    struct ply *ply = memory_array_zero(allocator, 1, sizeof *ply);
    if (!ply)
        return groom_fail(reader->diag, GROOM_ENOMEM, "no memory for the PLY header");
    ply->reader = reader;
    lines_init(&ply->lines, reader->out, allocator);
    text_begin(&ply->text, reader->in);
    groom_status status = read_elements(ply);
    if (status == GROOM_OK)
        read_warn_trailing(reader);
    lines_finish(&ply->lines);
    memory_release(allocator, ply, 1, sizeof *ply);
    return status;
}
