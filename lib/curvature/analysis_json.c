/* An analysis as JSON, and as one vertex buffer. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/json_stream.h"
#include "base/memory.h"
#include "base/sort.h"
#include "groom/analysis.h"

/* --- what all answers begin with ------------------------------------------------------------ */

static void write_identity(struct json_stream *out, const struct groom_analysis_telling *t)
{
    if (t->id_name)
        json_stream_text(out, t->id_name, t->id);
    if (t->revision)
        json_stream_integer(out, "revision", t->revision);
}

static uint32_t strand_name(const struct groom_analysis_telling *t, uint32_t i) { return t->index ? t->index[i] : i; }

/* --- how well the super-helices meet the strands ----------------------------------------------- */

static float middle_of(float *numbers, uint32_t n)
{
    sort_floats(numbers, n);
    return n ? numbers[(n - 1) / 2] : 0.0f;
}

/* scratch [n_strands] */
static void write_conversion(struct json_stream *out, const struct groom_strand_analysis *a, float *scratch)
{
    const struct groom_conversion *c = a->conversion;
    double square = 0.0, worst = 0.0, change = 0.0;
    uint32_t least = UINT32_MAX, most = 0, degenerate = 0;
    for (uint32_t i = 0; i < c->n_strands; i++) {
        const struct groom_conversion_report *r = &c->reports[i];
        uint32_t n = c->first[i + 1] - c->first[i];
        square += (double)r->error_rms_m * (double)r->error_rms_m * n / c->n_vertices;
        worst = fmax(worst, (double)r->error_max_m);
        change = fmax(change, fabs((double)r->length_change));
        least = r->n_elements < least ? r->n_elements : least;
        most = r->n_elements > most ? r->n_elements : most;
        degenerate += r->degenerate;
        scratch[i] = (float)r->n_elements;
    }
    json_stream_open(out, "conversion", '{');
    json_stream_open(out, "elements", '{');
    json_stream_integer(out, "min", c->n_strands ? least : 0);
    json_stream_number(out, "median", (double)middle_of(scratch, c->n_strands));
    json_stream_integer(out, "max", most);
    json_stream_close(out, '}');
    memcpy(scratch, a->error_share, c->n_strands * sizeof *scratch); /* which the median sorts, so that the worst is last */
    json_stream_open(out, "error", '{');
    json_stream_number(out, "rms", sqrt(square));
    json_stream_number(out, "max", worst);
    json_stream_number(out, "share_median", (double)middle_of(scratch, c->n_strands));
    json_stream_number(out, "share_max", c->n_strands ? (double)scratch[c->n_strands - 1] : 0.0);
    json_stream_close(out, '}');
    json_stream_number(out, "length_change_max", change);
    json_stream_integer(out, "degenerate", degenerate);
    json_stream_close(out, '}');
}

/* --- the summary ----------------------------------------------------------------------------------- */

static void write_shares(struct json_stream *out, const char *name, const double share[3], const char *const names[3])
{
    json_stream_open(out, name, '{');
    for (int k = 0; k < 3; k++)
        json_stream_number(out, names[k], share[k]);
    json_stream_close(out, '}');
}

static void write_distribution(struct json_stream *out, const char *name, double mean, const struct groom_histogram *h)
{
    json_stream_open(out, name, '{');
    json_stream_number(out, "mean", mean);
    json_stream_open(out, "histogram", '{');
    json_stream_number(out, "low", h->low);
    json_stream_number(out, "high", h->high);
    json_stream_open(out, "weight", '[');
    for (int k = 0; k < GROOM_HISTOGRAM_BINS; k++)
        json_stream_number(out, NULL, h->weight[k]);
    json_stream_close(out, ']');
    json_stream_close(out, '}');
    json_stream_close(out, '}');
}

static void write_summary(struct json_stream *out, const struct groom_analysis *a)
{
    static const char *const kinds[3] = {"straight", "wavy", "coiled"}, *const hands[3] = {"left", "none", "right"};
    write_shares(out, "share", a->summary.share, kinds);
    write_shares(out, "hand", a->summary.share_hand, hands);
    write_distribution(out, "radius", a->summary.radius_mean_m, &a->summary.radius);
    write_distribution(out, "frequency", a->summary.frequency_mean, &a->summary.frequency);
    write_distribution(out, "turns", a->summary.turns_mean, &a->summary.turns);
}

/* --- columns ----------------------------------------------------------------------------------------- */

struct columns {
    const struct groom_strand_analysis *analysis;
    const struct groom_analysis_telling *telling;
    const uint32_t *element; /* [n_vertices] under each vertex, or NULL: values are of the elements themselves */
};

static const struct groom_element_shape *shape_at(const struct columns *c, size_t k)
{
    return &c->analysis->analysis->elements[c->element ? c->element[k] : k];
}

/* X(name of the function, how one value is got from element or vertex k) */
#define SHAPE_COLUMNS(X)                                                                           \
    X(radius_column, shape->radius_m) X(step_column, shape->step_m)                                \
    X(frequency_column, shape->frequency) X(omega_column, shape->omega)                            \
    X(beta_column, shape->beta) X(hand_column, (float)shape->hand)
#define SHAPE_COLUMN(name, value)                                                                  \
    static void name(const void *user, size_t begin, size_t n, void *out)                          \
    {                                                                                              \
        for (size_t k = 0; k < n; k++) {                                                           \
            const struct groom_element_shape *shape = shape_at(user, begin + k);                   \
            ((float *)out)[k] = value;                                                             \
        }                                                                                          \
    }
SHAPE_COLUMNS(SHAPE_COLUMN)

static void kind_column(const void *user, size_t begin, size_t n, void *out)
{
    for (size_t k = 0; k < n; k++)
        ((uint32_t *)out)[k] = shape_at(user, begin + k)->kind;
}

static void length_column(const void *user, size_t begin, size_t n, void *out)
{
    const struct columns *c = user;
    for (size_t k = 0; k < n; k++)
        ((float *)out)[k] = (float)c->analysis->conversion->helices->length[begin + k];
}

static void switchback_strand_column(const void *user, size_t begin, size_t n, void *out)
{
    const struct columns *c = user;
    for (size_t k = 0; k < n; k++)
        ((uint32_t *)out)[k] = strand_name(c->telling, c->analysis->analysis->switchbacks[begin + k].strand);
}

static void switchback_element_column(const void *user, size_t begin, size_t n, void *out)
{
    const struct columns *c = user;
    for (size_t k = 0; k < n; k++)
        ((uint32_t *)out)[k] = c->analysis->analysis->switchbacks[begin + k].element;
}

static void switchback_at_column(const void *user, size_t begin, size_t n, void *out)
{
    const struct columns *c = user;
    for (size_t k = 0; k < n; k++)
        ((float *)out)[k] = c->analysis->analysis->switchbacks[begin + k].at;
}

static void index_column(const void *user, size_t begin, size_t n, void *out)
{
    const struct columns *c = user;
    for (size_t k = 0; k < n; k++)
        ((uint32_t *)out)[k] = strand_name(c->telling, (uint32_t)(begin + k));
}

static void n_elements_column(const void *user, size_t begin, size_t n, void *out)
{
    const struct columns *c = user;
    for (size_t k = 0; k < n; k++)
        ((uint32_t *)out)[k] = c->analysis->conversion->reports[begin + k].n_elements;
}

static void column(struct json_stream *out, const char *name, const char *dtype, uint64_t n, json_stream_column *gather,
                   const struct columns *c)
{
    json_stream_array(out, name, dtype, &n, 1, gather, c);
}

/* --- parts ---------------------------------------------------------------------------------------------- */

static uint32_t strands_with_switchbacks(const struct groom_analysis *a)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < a->n_switchbacks; k++)
        n += k == 0 || a->switchbacks[k].strand != a->switchbacks[k - 1].strand;
    return n;
}

static void write_switchbacks(struct json_stream *out, const struct columns *c)
{
    const struct groom_analysis *a = c->analysis->analysis;
    json_stream_open(out, "switchbacks", '{');
    json_stream_integer(out, "count", a->n_switchbacks);
    json_stream_integer(out, "strands", strands_with_switchbacks(a));
    json_stream_open(out, "list", '[');
    for (uint32_t k = 0; k < a->n_switchbacks && k < GROOM_ANALYSIS_LISTED; k++) {
        json_stream_open(out, NULL, '{');
        json_stream_integer(out, "strand", strand_name(c->telling, a->switchbacks[k].strand));
        json_stream_integer(out, "element", a->switchbacks[k].element);
        json_stream_number(out, "at", (double)a->switchbacks[k].at);
        json_stream_close(out, '}');
    }
    json_stream_close(out, ']');
    if (c->telling->parts & GROOM_ANALYSIS_SWITCHBACKS) {
        column(out, "strand", "u32", a->n_switchbacks, switchback_strand_column, c);
        column(out, "element", "u32", a->n_switchbacks, switchback_element_column, c);
        column(out, "at", "f32", a->n_switchbacks, switchback_at_column, c);
    }
    json_stream_close(out, '}');
}

static void write_elements(struct json_stream *out, const struct columns *c)
{
    const struct groom_analysis *a = c->analysis->analysis;
    uint64_t n_first = (uint64_t)a->n_strands + 1, n = a->n_elements;
    json_stream_open(out, "elements", '{');
    json_stream_packed(out, "first", "u32", &n_first, 1, a->first);
    column(out, "length", "f32", n, length_column, c);
    column(out, "radius", "f32", n, radius_column, c);
    column(out, "step", "f32", n, step_column, c);
    column(out, "frequency", "f32", n, frequency_column, c);
    column(out, "omega", "f32", n, omega_column, c);
    column(out, "beta", "f32", n, beta_column, c);
    column(out, "hand", "f32", n, hand_column, c);
    column(out, "kind", "u32", n, kind_column, c);
    json_stream_close(out, '}');
}

static void write_vertices(struct json_stream *out, const struct columns *c)
{
    const struct groom_conversion *conversion = c->analysis->conversion;
    uint64_t n_first = (uint64_t)conversion->n_strands + 1, n = conversion->n_vertices;
    json_stream_open(out, "vertices", '{');
    json_stream_packed(out, "first", "u32", &n_first, 1, conversion->first);
    column(out, "radius", "f32", n, radius_column, c);
    column(out, "frequency", "f32", n, frequency_column, c);
    column(out, "hand", "f32", n, hand_column, c);
    column(out, "beta", "f32", n, beta_column, c);
    json_stream_close(out, '}');
}

static void write_strands(struct json_stream *out, const struct columns *c)
{
    uint64_t n = c->analysis->analysis->n_strands;
    json_stream_open(out, "per_strand", '{');
    column(out, "index", "u32", n, index_column, c);
    json_stream_packed(out, "turns", "f32", &n, 1, c->analysis->analysis->turns);
    column(out, "elements", "u32", n, n_elements_column, c);
    json_stream_packed(out, "error_share", "f32", &n, 1, c->analysis->error_share);
    json_stream_close(out, '}');
}

static void write_parts(struct json_stream *out, const struct columns *elements, const struct columns *vertices)
{
    const struct groom_analysis *a = elements->analysis->analysis;
    unsigned parts = elements->telling->parts;
    if (parts & GROOM_ANALYSIS_STRANDS)
        write_strands(out, elements);
    if (parts & GROOM_ANALYSIS_ELEMENTS)
        write_elements(out, elements);
    if (parts & GROOM_ANALYSIS_VERTICES)
        write_vertices(out, vertices);
    if (parts & GROOM_ANALYSIS_CENTRE)
        json_stream_packed(out, "centre", "f32", (uint64_t[]){a->n_strands, a->n_samples, 3}, 3, a->centre);
}

/* --- the whole --------------------------------------------------------------------------------------------- */

static groom_status find_elements(const struct groom_strand_analysis *a, const struct groom_context *context,
                                  uint32_t **element, struct groom_diag *diag)
{
    const struct groom_conversion *c = a->conversion;
    *element = memory_array(memory_allocator(context), c->n_vertices, sizeof **element);
    if (!*element)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the elements under %u vertices", c->n_vertices);
    groom_superhelices_elements_at(c->helices, c->first, c->at, *element, context);
    return GROOM_OK;
}

groom_status groom_strand_analysis_write(const struct groom_strand_analysis *a,
                                         const struct groom_analysis_telling *telling, struct groom_sink sink,
                                         const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const struct groom_conversion *c = a->conversion;
    struct columns elements = {a, telling, NULL}, vertices = elements;
    uint32_t *element = NULL;
    struct json_stream out;
    groom_status st = GROOM_OK;
    float *scratch = memory_array(allocator, c->n_strands, sizeof *scratch);
    if (!scratch)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to tell of %u strands", c->n_strands);
    if ((telling->parts & GROOM_ANALYSIS_VERTICES) && (st = find_elements(a, context, &element, diag)) != GROOM_OK)
        goto out;
    vertices.element = element;
    json_stream_init(&out, sink);
    json_stream_open(&out, NULL, '{');
    write_identity(&out, telling);
    json_stream_open(&out, "analysed", '{');
    json_stream_integer(&out, "strands", c->n_strands);
    json_stream_integer(&out, "of", telling->n_of);
    json_stream_integer(&out, "vertices", c->n_vertices);
    json_stream_integer(&out, "elements", a->analysis->n_elements);
    json_stream_number(&out, "length", a->analysis->summary.length_m);
    json_stream_close(&out, '}');
    write_conversion(&out, a, scratch);
    write_summary(&out, a->analysis);
    write_switchbacks(&out, &elements);
    write_parts(&out, &elements, &vertices);
    json_stream_close(&out, '}');
    if ((st = json_stream_finish(&out)) != GROOM_OK)
        groom_fail(diag, st, "the analysis could not be written");
out:
    memory_release(allocator, scratch, c->n_strands, sizeof *scratch);
    memory_release(allocator, element, c->n_vertices, sizeof *element);
    return st;
}

groom_status groom_strand_analysis_write_vertices(const struct groom_strand_analysis *a, struct groom_sink sink,
                                                  const struct groom_context *context, struct groom_diag *diag)
{
    enum { VERTICES_A_PIECE = 1024 };
    float piece[VERTICES_A_PIECE][4];
    uint32_t *element, n = a->conversion->n_vertices;
    groom_status st = find_elements(a, context, &element, diag);
    for (uint32_t begin = 0, count; st == GROOM_OK && begin < n; begin += count) {
        count = n - begin < VERTICES_A_PIECE ? n - begin : VERTICES_A_PIECE;
        for (uint32_t k = 0; k < count; k++) {
            const struct groom_element_shape *s = &a->analysis->elements[element[begin + k]];
            memcpy(piece[k], (float[4]){s->radius_m, s->frequency, (float)s->hand, s->beta}, sizeof piece[k]);
        }
        st = sink.write(sink.user, piece, count * sizeof piece[0]);
    }
    memory_release(memory_allocator(context), element, n, sizeof *element);
    return st;
}

/* --- clusters ------------------------------------------------------------------------------------------------- */

static void write_vector(struct json_stream *out, const char *name, const double v[3])
{
    json_stream_open(out, name, '[');
    for (int c = 0; c < 3; c++)
        json_stream_number(out, NULL, v[c]);
    json_stream_close(out, ']');
}

static void write_frame(struct json_stream *out, const struct groom_cluster_frame *f)
{
    json_stream_open(out, NULL, '{');
    json_stream_number(out, "at", f->at);
    write_vector(out, "position", f->origin);
    json_stream_open(out, "axes", '[');
    for (int k = 0; k < 3; k++)
        write_vector(out, NULL, f->axes[k]);
    json_stream_close(out, ']');
    write_vector(out, "extent", f->extent);
    json_stream_close(out, '}');
}

static void mean_root(const struct groom_clusters *c, const struct groom_strands *strands, uint32_t k, double root[3])
{
    uint32_t begin = c->first[k], end = c->first[k + 1];
    root[0] = root[1] = root[2] = 0.0;
    for (uint32_t m = begin; m < end; m++)
        for (int axis = 0; axis < 3; axis++)
            root[axis] += (double)strands->points[strands->first[c->strands[m]]][axis] / (end - begin);
}

groom_status groom_clusters_write(const struct groom_clusters *c, const struct groom_strands *strands,
                                  const struct groom_cluster_frame *frames, uint32_t n_frames, uint64_t seed,
                                  const struct groom_analysis_telling *telling, struct groom_sink sink,
                                  struct groom_diag *diag)
{
    struct json_stream out;
    uint64_t n = c->n_strands;
    json_stream_init(&out, sink);
    json_stream_open(&out, NULL, '{');
    write_identity(&out, telling);
    json_stream_integer(&out, "count", c->n_clusters);
    json_stream_integer(&out, "seed", seed);
    json_stream_integer(&out, "strands", n);
    json_stream_open(&out, "clusters", '[');
    for (uint32_t k = 0; k < c->n_clusters; k++) {
        double root[3];
        mean_root(c, strands, k, root);
        json_stream_open(&out, NULL, '{');
        json_stream_integer(&out, "cluster", k);
        json_stream_integer(&out, "strands", c->first[k + 1] - c->first[k]);
        write_vector(&out, "root", root);
        json_stream_open(&out, "frames", '[');
        for (uint32_t f = 0; f < n_frames; f++)
            write_frame(&out, &frames[(size_t)k * n_frames + f]);
        json_stream_close(&out, ']');
        json_stream_close(&out, '}');
    }
    json_stream_close(&out, ']');
    json_stream_packed(&out, "of_strand", "u32", &n, 1, c->of_strand);
    json_stream_close(&out, '}');
    groom_status st = json_stream_finish(&out);
    return st == GROOM_OK ? st : groom_fail(diag, st, "the clusters could not be written");
}
