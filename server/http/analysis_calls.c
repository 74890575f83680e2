/* Strands in curvature space: what kind of hair it is, and the armatures that move it.
 *
 * Both ask for the dense strands of a groom or of an upload; the latter is an untrusted file and is
 * read by groom-worker first. Answers are files, kept as exports are. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/analysis.h"
#include "groom/format.h"
#include "groom/groom.h"
#include "server/grooms/grooms.h"
#include "server/http/handlers.h"
#include "server/http/server.h"
#include "server/http/tool.h"

#define MAX_VERTICES        24000000u /* what is analysed at once */
#define MAX_VERTICES_JSON   6000000u  /* with an array of as many numbers, base64 */
#define MAX_CLUSTER_FRAMES  16384u    /* frames of all clusters together */

/* --- what is asked of whom ------------------------------------------------------------------ */

/* The strands that a path names. */
struct subject {
    bool is_groom;
    uint32_t revision; /* of a groom */
    struct store_asset asset;
};

static bool subject_groom(struct request *request, struct subject *subject)
{
    struct store_revision found = {0};
    struct groom_diag diag = {0};
    uint64_t number = 0;
    if (!request_query_number(request, "revision", 1, UINT32_MAX, &number))
        return false;
    groom_status status =
        store_revision_get(request->service->store, request->parameter[0], (uint32_t)number, &found, &diag);
    *subject = (struct subject){.is_groom = true, .revision = found.number};
    store_revision_finish(&found);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    return status == GROOM_OK;
}

static bool subject_upload(struct request *request, struct subject *subject)
{
    struct groom_diag diag = {0};
    *subject = (struct subject){0};
    groom_status status =
        store_asset_get(request->service->store, request->actor.project, STORE_STRANDS, request->parameter[0], &subject->asset, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    return status == GROOM_OK;
}

static void subject_finish(struct subject *subject) { store_asset_finish(&subject->asset); }

/* --- strands of an upload --------------------------------------------------------------------- */

/* In metres and y up, in a format that holds strands of any length. */
static bool convert_upload(struct request *request, const struct store_asset *asset, int to)
{
    int from;
    uint64_t n_bytes;
    char from_unit[40], from_up[2] = {asset->up, 0};
    struct groom_diag diag = {0};
    snprintf(from_unit, sizeof from_unit, "%.17g", asset->unit_m);
    const char *const arguments[] = {"convert",   "--from-format", asset->format, "--from-unit", from_unit,
                                     "--from-up", from_up,         "--to-format", "data",        NULL};
    groom_status status = blobs_read(request->service->blobs, asset->sha256, &from, &n_bytes, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return false;
    }
    bool done = tool_run(request, arguments, from, to, NULL, NULL);
    close(from);
    return done;
}

static int compare_indices(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return x < y ? -1 : x > y;
}

/* The first `count` strands of the fair order in place of all. */
static groom_status keep_fairly(struct grooms_dense *dense, uint32_t count, const struct groom_context *context,
                                struct groom_diag *diag)
{
    const struct groom_strands *all = dense->strands;
    struct groom_strands *kept = NULL;
    uint64_t n_vertices = 0;
    dense->index = malloc(all->n_strands * sizeof *dense->index);
    if (!dense->index)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to choose %u strands", count);
    groom_fair_order(all->n_strands, dense->index);
    qsort(dense->index, count, sizeof *dense->index, compare_indices);
    for (uint32_t k = 0; k < count; k++)
        n_vertices += all->first[dense->index[k] + 1] - all->first[dense->index[k]];
    groom_status status = groom_strands_create(count, n_vertices, context, &kept, diag);
    if (status != GROOM_OK)
        return status;
    for (uint32_t k = 0; k < count; k++) {
        uint32_t begin = all->first[dense->index[k]], n = all->first[dense->index[k] + 1] - begin;
        memcpy(kept->points[kept->first[k]], all->points[begin], n * sizeof *kept->points);
        kept->first[k + 1] = kept->first[k] + n;
    }
    groom_strands_destroy(dense->strands);
    dense->strands = kept;
    return GROOM_OK;
}

static groom_status read_upload(struct request *request, int fd, uint32_t count, struct grooms_dense *dense,
                                struct groom_diag *diag)
{
    struct groom_read_options options = {.format = GROOM_FORMAT_DATA};
    const struct groom_context *context = grooms_context(request->service->grooms);
    if (lseek(fd, 0, SEEK_SET) < 0)
        return groom_fail(diag, GROOM_EIO, "temporary file: %s", strerror(errno));
    struct groom_source source = groom_source_from_fd(fd); /* from where it stands */
    groom_status status = groom_strands_read(&source, &options, context, &dense->strands, NULL, diag);
    if (status != GROOM_OK)
        return status;
    dense->n_of = dense->strands->n_strands;
    return count && count < dense->n_of ? keep_fairly(dense, count, context, diag) : GROOM_OK;
}

/* --- strands ------------------------------------------------------------------------------------- */

static bool load_upload(struct request *request, const struct subject *subject, uint32_t count,
                        struct grooms_dense *dense)
{
    struct groom_diag diag = {0};
    int fd = tool_temporary(request);
    if (fd < 0)
        return false;
    bool done = convert_upload(request, &subject->asset, fd);
    if (done) {
        groom_status status = read_upload(request, fd, count, dense, &diag);
        if (status != GROOM_OK)
            respond_failure(request, status, &diag);
        done = status == GROOM_OK;
    }
    close(fd);
    return done;
}

/* returns  false where it was refused (and answered); dense is to be finished in any case */
static bool load(struct request *request, const struct subject *subject, uint32_t count, struct grooms_dense *dense)
{
    struct groom_diag diag = {0};
    *dense = (struct grooms_dense){0};
    if (!subject->is_groom)
        return load_upload(request, subject, count, dense);
    groom_status status = grooms_dense(request->service->grooms, request->parameter[0], subject->revision, count,
                                       dense, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    return status == GROOM_OK;
}

static struct groom_analysis_telling telling_of(const struct request *request, const struct subject *subject,
                                                const struct grooms_dense *dense)
{
    return (struct groom_analysis_telling){.id_name = subject->is_groom ? "groom" : "strands_id",
                                           .id = request->parameter[0],
                                           .revision = subject->revision,
                                           .n_of = dense->n_of,
                                           .index = dense->index};
}

/* --- answers as files ------------------------------------------------------------------------------ */

/* Writes one answer about the strands. what: the caller's question. */
typedef groom_status (*write_answer)(struct request *request, const struct subject *subject,
                                     const struct grooms_dense *dense, const void *what, struct groom_sink sink,
                                     struct groom_diag *diag);

static groom_status write_file(struct request *request, const struct subject *subject, const struct grooms_dense *dense,
                               write_answer write, const void *what, int fd, uint64_t *n_bytes, struct groom_diag *diag)
{
    struct tool_sink *sink = malloc(sizeof *sink);
    if (!sink)
        return GROOM_ENOMEM;
    groom_status status = write(request, subject, dense, what, tool_sink(sink, fd), diag);
    if (status == GROOM_OK)
        status = tool_flush(sink);
    *n_bytes = sink->n_written;
    free(sink);
    return status;
}

static int make_answer(struct request *request, const struct subject *subject, uint32_t count, write_answer write,
                       const void *what, const char *etag, uint64_t *n_bytes)
{
    char key[160];
    int fd;
    struct grooms_dense dense;
    struct groom_diag diag = {0};
    struct export_cache *cache = server_exports(request->server);
    snprintf(key, sizeof key, "%.31s/%s", request->parameter[0], etag);
    if (export_cache_find(cache, key, &fd, n_bytes))
        return fd;
    bool loaded = load(request, subject, count, &dense);
    if (loaded && (fd = tool_temporary(request)) >= 0) {
        groom_status status = write_file(request, subject, &dense, write, what, fd, n_bytes, &diag);
        if (status == GROOM_OK)
            export_cache_keep(cache, key, fd, *n_bytes);
        else {
            close(fd);
            fd = -1;
            respond_failure(request, status, &diag);
        }
    } else
        fd = -1;
    grooms_dense_finish(&dense);
    return fd;
}

static void answer(struct request *request, const struct subject *subject, uint32_t count, write_answer write,
                   const void *what, const char *etag, const char *content_type)
{
    uint64_t n_bytes = 0;
    if (request_not_modified(request, etag))
        return;
    int fd = make_answer(request, subject, count, write, what, etag, &n_bytes);
    if (fd < 0)
        return;
    respond_file(request, content_type, fd, n_bytes);
    respond_etag(request, "%s", etag);
}

/* --- analysis: the query ------------------------------------------------------------------------------ */

struct analysis_query {
    uint32_t count;
    unsigned parts;
    bool binary;
    struct groom_conversion_options conversion;
    struct groom_analysis_options options;
};

static bool query_elements(struct request *request, uint32_t *n_elements)
{
    uint64_t number = 0;
    const char *text = request_query(request, "elements");
    if (!text || !strcmp(text, "auto"))
        return true;
    if (!request_query_number(request, "elements", 1, 4096, &number))
        return false;
    *n_elements = (uint32_t)number;
    return true;
}

static bool query_format(struct request *request, bool *binary)
{
    const char *text = request_query(request, "format");
    *binary = text && !strcmp(text, "binary");
    if (!text || *binary || !strcmp(text, "json"))
        return true;
    respond_bad_query(request, "format", "format is \"%.40s\"; it must be json or binary", text);
    return false;
}

static const struct {
    const char *name;
    unsigned part;
} parts[] = {{"elements", GROOM_ANALYSIS_ELEMENTS},
             {"vertices", GROOM_ANALYSIS_VERTICES},
             {"centre", GROOM_ANALYSIS_CENTRE},
             {"switchbacks", GROOM_ANALYSIS_SWITCHBACKS},
             {"strands", GROOM_ANALYSIS_STRANDS}};

static unsigned part_of(const char *word, size_t n)
{
    for (size_t k = 0; k < sizeof parts / sizeof parts[0]; k++)
        if (strlen(parts[k].name) == n && !strncmp(parts[k].name, word, n))
            return parts[k].part;
    return 0;
}

/* "elements,vertices" */
static bool query_arrays(struct request *request, unsigned *found)
{
    const char *text = request_query(request, "arrays");
    for (size_t n; text && *text; text += n + (text[n] == ',')) {
        n = strcspn(text, ",");
        unsigned part = part_of(text, n);
        if (!part) {
            respond_bad_query(request, "arrays",
                              "\"%.*s\" is no array of an analysis: elements, vertices, centre, switchbacks or strands",
                              n < 40 ? (int)n : 40, text);
            return false;
        }
        *found |= part;
    }
    return true;
}

static bool read_query(struct request *request, struct analysis_query *q)
{
    uint64_t count = 0;
    *q = (struct analysis_query){.conversion = groom_conversion_options_default(),
                                 .options = groom_analysis_options_default()};
    bool fine = request_query_number(request, "count", 1, UINT32_MAX, &count) &&
                query_elements(request, &q->conversion.n_elements) &&
                request_query_real(request, "tolerance", 1e-9, 1e3, &q->conversion.tolerance_m) &&
                request_query_real(request, "straight_below", 0, 1e6, &q->options.straight_below) &&
                request_query_real(request, "wavy_below", 0, 1, &q->options.wavy_below) &&
                query_arrays(request, &q->parts) && query_format(request, &q->binary);
    q->count = (uint32_t)count;
    return fine;
}

/* --- analysis: the answer -------------------------------------------------------------------------------- */

static groom_status check_size(const struct grooms_dense *dense, const struct analysis_query *q, struct groom_diag *diag)
{
    const unsigned large = GROOM_ANALYSIS_ELEMENTS | GROOM_ANALYSIS_VERTICES | GROOM_ANALYSIS_CENTRE;
    uint32_t most = !q->binary && (q->parts & large) ? MAX_VERTICES_JSON : MAX_VERTICES;
    if (q->count > dense->n_of)
        return groom_fail_field(diag, GROOM_EINVAL, "/count", "there are %u strands: ask for at most as many",
                                dense->n_of);
    if (dense->strands->n_vertices > most)
        return groom_fail(diag, GROOM_ETOOBIG, "%u vertices are too many for one answer of this kind (%u): ask for a sample, "
                          "count=%.0f, or for format=binary", dense->strands->n_vertices, most,
                          floor((double)most / dense->strands->n_vertices * dense->strands->n_strands));
    return GROOM_OK;
}

static groom_status write_analysis(struct request *request, const struct subject *subject,
                                   const struct grooms_dense *dense, const void *what, struct groom_sink sink,
                                   struct groom_diag *diag)
{
    const struct analysis_query *q = what;
    const struct groom_context *context = grooms_context(request->service->grooms);
    struct groom_analysis_telling telling = telling_of(request, subject, dense);
    struct groom_strand_analysis *analysis = NULL;
    groom_status status = check_size(dense, q, diag);
    telling.parts = q->parts;
    if (status == GROOM_OK)
        status = groom_strands_analyze(dense->strands, &q->conversion, &q->options, context, &analysis, diag);
    if (status == GROOM_OK && q->binary)
        status = groom_strand_analysis_write_vertices(analysis, sink, context, diag);
    else if (status == GROOM_OK)
        status = groom_strand_analysis_write(analysis, &telling, sink, context, diag);
    groom_strand_analysis_destroy(analysis);
    return status;
}

static void respond_analysis(struct request *request, const struct subject *subject)
{
    struct analysis_query q;
    char etag[80];
    if (!read_query(request, &q))
        return;
    snprintf(etag, sizeof etag, "%u-a%u-%u-%.9g-%.6g-%.6g-%x%s", subject->revision, q.count, q.conversion.n_elements,
             q.conversion.tolerance_m, q.options.straight_below, q.options.wavy_below, q.parts, q.binary ? "b" : "");
    answer(request, subject, q.count, write_analysis, &q, etag,
           q.binary ? "application/octet-stream" : "application/json");
}

void analysis_call_groom(struct request *request)
{
    struct subject subject;
    if (subject_groom(request, &subject))
        respond_analysis(request, &subject);
}

void analysis_call_strands(struct request *request)
{
    struct subject subject;
    if (subject_upload(request, &subject))
        respond_analysis(request, &subject);
    subject_finish(&subject);
}

/* --- clusters ------------------------------------------------------------------------------------------------ */

struct clusters_query {
    uint64_t count, seed, n_frames;
};

static groom_status write_frames(const struct clusters_query *q, const struct grooms_dense *dense,
                                 const struct groom_clusters *clusters, const struct groom_context *context,
                                 const struct groom_analysis_telling *telling, struct groom_sink sink,
                                 struct groom_diag *diag)
{
    double at[GROOM_CLUSTER_FRAMES_MOST];
    struct groom_cluster_frame *frames = malloc(q->count * q->n_frames * sizeof *frames);
    if (!frames)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the frames of %u clusters", (unsigned)q->count);
    for (uint32_t k = 0; k < q->n_frames; k++)
        at[k] = (k + 1.0) / (double)q->n_frames;
    groom_status status =
        groom_clusters_frames(clusters, dense->strands, at, (uint32_t)q->n_frames, context, frames, diag);
    if (status == GROOM_OK)
        status = groom_clusters_write(clusters, dense->strands, frames, (uint32_t)q->n_frames, q->seed, telling, sink,
                                      diag);
    free(frames);
    return status;
}

static groom_status write_clusters(struct request *request, const struct subject *subject,
                                   const struct grooms_dense *dense, const void *what, struct groom_sink sink,
                                   struct groom_diag *diag)
{
    const struct clusters_query *q = what;
    const struct groom_context *context = grooms_context(request->service->grooms);
    struct groom_analysis_telling telling = telling_of(request, subject, dense);
    struct groom_clusters *clusters = NULL;
    groom_status status = groom_strands_cluster(dense->strands, (uint32_t)q->count, q->seed, context, &clusters, diag);
    if (status == GROOM_EINVAL && !strcmp(diag->pointer, "/clusters/count"))
        snprintf(diag->pointer, sizeof diag->pointer, "/count");
    if (status == GROOM_OK)
        status = write_frames(q, dense, clusters, context, &telling, sink, diag);
    groom_clusters_destroy(clusters);
    return status;
}

static void respond_clusters(struct request *request, const struct subject *subject)
{
    struct clusters_query q = {.count = 8, .seed = 1, .n_frames = 4};
    char etag[80];
    if (!request_query_number(request, "count", 1, GROOM_CLUSTERS_MOST, &q.count) ||
        !request_query_number(request, "seed", 0, (uint64_t)1 << 53, &q.seed) ||
        !request_query_number(request, "frames", 1, GROOM_CLUSTER_FRAMES_MOST, &q.n_frames))
        return;
    if (q.count * q.n_frames > MAX_CLUSTER_FRAMES) {
        respond_bad_query(request, "frames", "%llu clusters of %llu frames: together at most %u",
                          (unsigned long long)q.count, (unsigned long long)q.n_frames, MAX_CLUSTER_FRAMES);
        return;
    }
    snprintf(etag, sizeof etag, "%u-k%llu-%llu-%llu", subject->revision, (unsigned long long)q.count,
             (unsigned long long)q.seed, (unsigned long long)q.n_frames);
    answer(request, subject, 0, write_clusters, &q, etag, "application/json");
}

void clusters_call_groom(struct request *request)
{
    struct subject subject;
    if (subject_groom(request, &subject))
        respond_clusters(request, &subject);
}

void clusters_call_strands(struct request *request)
{
    struct subject subject;
    if (subject_upload(request, &subject))
        respond_clusters(request, &subject);
    subject_finish(&subject);
}
