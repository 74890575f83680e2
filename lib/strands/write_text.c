/* Text files: JSON, OBJ, USD ASCII. Numbers are %.9g, which a float survives. */
#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "strands/writer.h"

/* before, the three coordinates, after */
static inline groom_status write_point(struct groom_writer *writer, const char *before, const float point[3],
                                       char separator, const char *after)
{
    groom_status status = GROOM_OK;
    size_t n_before = strlen(before), n_after = strlen(after);
    char *p = (char *)writer_room(writer, WRITER_MAX_PIECE, &status);
    if (!p)
        return status;
    memcpy(p, before, n_before);
    size_t n = writer_print_point(writer, p + n_before, point, separator);
    if (n == 0)
        return GROOM_EINVAL;
    memcpy(p + n_before + n, after, n_after);
    writer_used(writer, n_before + n + n_after);
    return GROOM_OK;
}

/* Is i the last point of the present strand, where the run began with writer->in_strand written? */
static int is_last(const struct groom_writer *writer, size_t i)
{
    return writer->in_strand + i + 1 == writer_count(writer, writer->strand);
}

/* --- JSON ----------------------------------------------------------------------------- */

static groom_status begin_json(struct groom_writer *writer) { return writer_text(writer, "{\"strands\":["); }

static groom_status points_json(struct groom_writer *writer, const float (*points)[3], size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const char *before = writer->in_strand + i > 0 ? ",[" : writer->strand > 0 ? ",\n[[" : "\n[[";
        groom_status status = write_point(writer, before, points[i], ',', is_last(writer, i) ? "]]" : "]");
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

static groom_status finish_json(struct groom_writer *writer) { return writer_text(writer, "\n]}\n"); }

const struct writer_format writer_json = {begin_json, points_json, finish_json, 1, UINT32_MAX, UINT32_MAX};

/* --- OBJ: the vertices of a strand, then its line --------------------------------------- */

static groom_status begin_obj(struct groom_writer *writer)
{
    return writer_text(writer, "# groomd strands, root first\n");
}

static groom_status points_obj(struct groom_writer *writer, const float (*points)[3], size_t n)
{
    for (size_t i = 0; i < n; i++) {
        groom_status status = write_point(writer, "v ", points[i], ' ', "\n");
        if (status != GROOM_OK)
            return status;
    }
    if (!is_last(writer, n - 1))
        return GROOM_OK;
    uint32_t count = writer_count(writer, writer->strand);
    groom_status status = writer_text(writer, "l");
    if (status == GROOM_OK)
        status = writer_integers(writer, writer->first_of_strand + 1, count, ' ');
    writer->first_of_strand += count;
    return status == GROOM_OK ? writer_text(writer, "\n") : status;
}

const struct writer_format writer_obj = {begin_obj, points_obj, NULL, 1, UINT32_MAX, UINT32_MAX};

/* --- USD ASCII (openusd.org: UsdGeomBasisCurves) ------------------------------------------- */

static groom_status write_counts(struct groom_writer *writer)
{
    for (uint32_t i = 0; i < writer->n_strands; i++) {
        char text[24] = ",";
        size_t n = 1 + number_print_integer(text + 1, writer_count(writer, i)), skip = i == 0;
        groom_status status = writer_bytes(writer, text + skip, n - skip);
        if (status != GROOM_OK)
            return status;
    }
    return GROOM_OK;
}

static groom_status begin_usda(struct groom_writer *writer)
{
    char header[512];
    snprintf(header, sizeof header,
             "#usda 1.0\n(\n    defaultPrim = \"groom\"\n    metersPerUnit = %.9g\n    upAxis = \"%s\"\n)\n\n"
             "def BasisCurves \"groom\"\n{\n    uniform token type = \"linear\"\n"
             "    uniform token wrap = \"nonperiodic\"\n    int[] curveVertexCounts = [",
             writer->unit_m, writer->up == GROOM_UP_Z ? "Z" : "Y");
    groom_status status = writer_text(writer, header);
    if (status == GROOM_OK)
        status = write_counts(writer);
    return status == GROOM_OK ? writer_text(writer, "]\n    point3f[] points = [") : status;
}

static void widen_extent(struct groom_writer *writer, const float point[3])
{
    float x[3];
    writer_convert(writer, x, point);
    for (int k = 0; k < 3; k++) {
        writer->min[k] = x[k] < writer->min[k] ? x[k] : writer->min[k];
        writer->max[k] = x[k] > writer->max[k] ? x[k] : writer->max[k];
    }
}

static groom_status points_usda(struct groom_writer *writer, const float (*points)[3], size_t n)
{
    for (size_t i = 0; i < n; i++) {
        groom_status status = write_point(writer, writer->n_written + i ? ",(" : "(", points[i], ',', ")");
        if (status != GROOM_OK)
            return status;
        widen_extent(writer, points[i]);
    }
    return GROOM_OK;
}

static groom_status finish_usda(struct groom_writer *writer)
{
    char end[512];
    double half = writer->width / 2;
    int n = snprintf(end, sizeof end,
                     "]\n    float[] widths = [%.9g] (\n        interpolation = \"constant\"\n    )\n",
                     writer->width);
    if (writer->n_vertices > 0)
        n += snprintf(end + n, sizeof end - (size_t)n,
                      "    float3[] extent = [(%.9g,%.9g,%.9g),(%.9g,%.9g,%.9g)]\n", writer->min[0] - half,
                      writer->min[1] - half, writer->min[2] - half, writer->max[0] + half,
                      writer->max[1] + half, writer->max[2] + half);
    snprintf(end + n, sizeof end - (size_t)n, "}\n");
    return writer_text(writer, end);
}

const struct writer_format writer_usda = {begin_usda, points_usda, finish_usda, 0, INT32_MAX, UINT32_MAX};
