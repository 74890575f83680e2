/* What was prepared, kept: a header, the arrays as they are in memory (little-endian), a checksum. */
#include <math.h>
#include <string.h>

#include "base/checksum.h"
#include "base/memory.h"
#include "retarget/source.h"
#include "retarget/store.h"

/* One walk over a source's members counts, writes or reads them. */
struct pen {
    enum { COUNT, WRITE, READ } mode;
    groom_status status;
    uint64_t n_bytes;
    struct checksum checksum;
    struct groom_sink sink;
    const struct groom_source *bytes;
};

static void pen_read(struct pen *pen, unsigned char *bytes, size_t n)
{
    while (n > 0 && pen->status == GROOM_OK) {
        int64_t got = pen->bytes->read(pen->bytes->user, bytes, n);
        if (got <= 0)
            pen->status = got < 0 ? GROOM_EIO : GROOM_ETRUNCATED;
        else
            bytes += got, n -= (size_t)got;
    }
}

static void pen_bytes(struct pen *pen, void *bytes, size_t n)
{
    if (pen->status != GROOM_OK || n == 0)
        return;
    pen->n_bytes += n;
    if (pen->mode == READ)
        pen_read(pen, bytes, n);
    if (pen->mode == WRITE)
        pen->status = pen->sink.write(pen->sink.user, bytes, n);
    if (pen->mode != COUNT && pen->status == GROOM_OK)
        checksum_add(&pen->checksum, bytes, n);
}

/* --- the walk ------------------------------------------------------------------------------ */

/* An array of which reading knows the size beforehand. */
#define PEN_ARRAY(pen, source, member, n)                                                                    \
    do {                                                                                                     \
        if ((pen)->mode == READ && (pen)->status == GROOM_OK && !(source)->member &&                         \
            !((source)->member = memory_array((source)->allocator, (n), sizeof *(source)->member)))          \
            (pen)->status = GROOM_ENOMEM;                                                                    \
        pen_bytes((pen), (source)->member, (size_t)(n) * sizeof *(source)->member);                          \
    } while (0)

static void pen_graph(struct pen *pen, struct groom_retarget_source *source, struct graph *graph, uint32_t n_rows)
{
    if (pen->mode == READ && pen->status == GROOM_OK)
        pen->status = graph_init(graph, n_rows, source->options.neighbours, source->allocator);
    pen_bytes(pen, graph->neighbour, (size_t)graph->n_rows * graph->k * sizeof *graph->neighbour);
    pen_bytes(pen, graph->weight, (size_t)graph->n_rows * graph->k * sizeof *graph->weight);
}

static void pen_guides(struct pen *pen, struct groom_retarget_source *source)
{
    uint32_t n_strands = source->strands->n_strands, last = 0;
    pen_bytes(pen, &source->n_guides, sizeof source->n_guides);
    if (pen->mode == READ && pen->status == GROOM_OK &&
        (source->n_guides > n_strands || (source->n_guides == 0) != (source->options.mode == GROOM_RETARGET_GLOBAL))) {
        source->n_guides = 0;
        pen->status = GROOM_EFORMAT;
    }
    PEN_ARRAY(pen, source, guides, source->n_guides);
    for (uint32_t i = 0; pen->mode == READ && pen->status == GROOM_OK && i < source->n_guides; i++) {
        if (source->guides[i] >= n_strands || (i > 0 && source->guides[i] <= last))
            pen->status = GROOM_EFORMAT;
        last = source->guides[i];
    }
    if (pen->mode == READ && pen->status == GROOM_OK)
        pen->status = source_index_guides(source, NULL);
}

static void pen_source(struct pen *pen, struct groom_retarget_source *source)
{
    uint32_t n = source->strands->n_vertices;
    int global = source->options.mode == GROOM_RETARGET_GLOBAL;
    PEN_ARRAY(pen, source, anchors, n);
    pen_bytes(pen, &source->n_without_bone, sizeof source->n_without_bone);
    pen_guides(pen, source);
    if (pen->status != GROOM_OK)
        return;
    if (!global)
        pen_graph(pen, source, &source->among_guides, source->guide_first[source->n_guides]);
    if (source_has_fine(source))
        pen_graph(pen, source, &source->to_guides, n);
    if (global || (source->options.sweeps > 0 && source_has_fine(source)))
        pen_graph(pen, source, &source->among_all, n);
}

/* --- saving ---------------------------------------------------------------------------------- */

groom_status groom_retarget_source_save(const struct groom_retarget_source *source, struct groom_sink sink,
                                        struct groom_diag *diag)
{
    /* the walk changes nothing unless its pen reads */
    struct groom_retarget_source *state = (struct groom_retarget_source *)(uintptr_t)source;
    struct pen count = {.mode = COUNT}, pen = {.mode = WRITE, .sink = sink};
    struct store_header header = {.version = STORE_VERSION, .inputs = source->inputs};
    uint64_t checksum;
    groom_status st;
    memcpy(header.magic, STORE_MAGIC, sizeof header.magic);
    pen_source(&count, state);
    header.payload_bytes = count.n_bytes;
    if ((st = sink.write(sink.user, &header, sizeof header)) == GROOM_OK) {
        pen_source(&pen, state);
        checksum = checksum_finish(&pen.checksum);
        st = pen.status == GROOM_OK ? sink.write(sink.user, &checksum, sizeof checksum) : pen.status;
    }
    return st == GROOM_OK ? st : groom_fail(diag, st, "what was prepared (%llu bytes) could not be written",
                                            (unsigned long long)(sizeof header + header.payload_bytes + sizeof checksum));
}

/* --- loading ---------------------------------------------------------------------------------- */

static int sound_anchors(const struct groom_retarget_source *source)
{
    for (uint32_t i = 0; i < source->strands->n_vertices; i++) {
        const struct anchor *a = &source->anchors[i];
        if (a->triangle >= source->body->n_triangles || (a->bone >= source->skeleton.n_bones && a->bone != ANCHOR_NO_BONE) ||
            !isfinite(a->v) || !isfinite(a->w) || !isfinite(a->eta))
            return 0;
    }
    return 1;
}

static int sound_graph(const struct graph *graph, uint32_t n_columns)
{
    for (size_t i = 0; i < (size_t)graph->n_rows * graph->k; i++)
        if (graph->neighbour[i] >= n_columns || !(graph->weight[i] >= 0 && graph->weight[i] <= 1))
            return 0;
    return 1;
}

static int sound(const struct groom_retarget_source *source)
{
    uint32_t n_guide_particles = source->guide_first[source->n_guides];
    return sound_anchors(source) && sound_graph(&source->among_guides, n_guide_particles) &&
           sound_graph(&source->to_guides, n_guide_particles) && sound_graph(&source->among_all, source->strands->n_vertices);
}

static groom_status check_header(const struct groom_retarget_source *source, const struct store_header *header,
                                 struct groom_diag *diag)
{
    if (memcmp(header->magic, STORE_MAGIC, sizeof header->magic) != 0)
        return groom_fail_at(diag, GROOM_EFORMAT, 0, "this is not what a retargeting prepared");
    if (header->version != STORE_VERSION)
        return groom_fail_at(diag, GROOM_ECONFLICT, 8, "it was prepared by version %llu; this program writes %d",
                             (unsigned long long)header->version, STORE_VERSION);
    if (header->inputs != source->inputs)
        return groom_fail_at(diag, GROOM_ECONFLICT, 16, "it was prepared for other strands, another body, skeleton or options");
    return GROOM_OK;
}

static groom_status read_payload(struct pen *pen, struct groom_retarget_source *source, uint64_t n_bytes, struct groom_diag *diag)
{
    uint64_t checksum = 0, own;
    pen_source(pen, source);
    own = checksum_finish(&pen->checksum);
    pen_read(pen, (unsigned char *)&checksum, sizeof checksum);
    if (pen->status == GROOM_OK && (checksum != own || pen->n_bytes != n_bytes || !sound(source)))
        pen->status = GROOM_EFORMAT;
    if (pen->status != GROOM_OK)
        return groom_fail(diag, pen->status, "what was prepared could not be read: %s", groom_status_message(pen->status));
    return GROOM_OK;
}

groom_status groom_retarget_source_load(const struct groom_source *bytes, const struct groom_strands *strands,
                                        const struct groom_mesh *body, const struct groom_skeleton *skeleton,
                                        const uint32_t *regions, const struct groom_retarget_options *options,
                                        const struct groom_context *context, struct groom_retarget_source **out,
                                        struct groom_diag *diag)
{
    struct groom_retarget_source *source = NULL;
    struct pen pen = {.mode = READ, .bytes = bytes};
    struct store_header header;
    groom_status st = source_init(&source, strands, body, skeleton, regions, options, context, diag);
    if (st != GROOM_OK)
        return st;
    pen_read(&pen, (unsigned char *)&header, sizeof header);
    if (pen.status != GROOM_OK)
        st = groom_fail(diag, pen.status, "what was prepared ends within its header");
    else
        st = check_header(source, &header, diag);
    if (st == GROOM_OK)
        st = read_payload(&pen, source, header.payload_bytes, diag);
    if (st == GROOM_OK)
        *out = source;
    else
        groom_retarget_source_destroy(source);
    return st;
}
