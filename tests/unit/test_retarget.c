/* Retargeting against a worked case (../shared/vectors/retarget-straight) and what must hold of any. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/format.h"
#include "groom/retarget.h"
#include "retarget/job.h"
#include "tests/support/npy.h"
#include "tests/support/test.h"

/* --- the worked case ------------------------------------------------------------------- */

struct worked {
    char folder[4096];
    struct groom_strands *strands;
    struct groom_mesh *body, *target_body;
    struct groom_skeleton skeleton, target_skeleton;
    uint32_t *regions;
    struct groom_retarget_target target;
};

static char *path_of(const struct worked *w, const char *name)
{
    static char path[4352];
    snprintf(path, sizeof path, "%s/%s", w->folder, name);
    return path;
}

static char *read_text(const char *path)
{
    FILE *file = fopen(path, "rb");
    ck_assert(file != NULL);
    char *text = calloc(1, 1 << 20);
    ck_assert_uint_gt(fread(text, 1, (1 << 20) - 1, file), 0);
    fclose(file);
    return text;
}

static struct groom_mesh *read_mesh(const char *path)
{
    struct groom_memory_source state;
    struct groom_mesh_read_options options = {0};
    struct groom_mesh *mesh;
    char *text = read_text(path);
    struct groom_source source = groom_source_from_memory(&state, text, strlen(text));
    ck_ok(groom_mesh_read(&source, &options, NULL, &mesh, NULL, NULL));
    free(text);
    return mesh;
}

/* The bones of one side: [[head, tail], ...] in the order of "names". */
static struct groom_skeleton read_side(const char *text, const char *side)
{
    struct groom_skeleton skeleton = {.n_bones = 6};
    char key[32];
    snprintf(key, sizeof key, "\"%s\"", side);
    const char *at = strstr(text, key) + strlen(key);
    for (uint32_t i = 0; i < 36; i++) {
        char *end;
        at += strcspn(at, "-0123456789");
        float value = strtof(at, &end);
        struct groom_bone *bone = &skeleton.bones[i / 6];
        (i % 6 < 3 ? bone->head : bone->tail)[i % 3] = value;
        snprintf(bone->name, sizeof bone->name, "bone%u", i / 6);
        at = end;
    }
    return skeleton;
}

static void read_regions(struct worked *w)
{
    char *text = read_text(path_of(w, "valid_tris.txt")), *line = text;
    w->regions = calloc(w->body->n_triangles, sizeof *w->regions);
    for (uint32_t b = 0; b < 6; b++) {
        char *end = strchr(line, '\n');
        for (char *at = line; at < end;) {
            w->regions[strtoul(at, &at, 10)] |= 1u << b;
            at += strspn(at, " ");
        }
        line = end + 1;
    }
    free(text);
}

static int worked_init(struct worked *w)
{
    const char *path = test_shared_data("../vectors/retarget-straight");
    struct groom_read_options options = {0};
    if (!path)
        return 0;
    memset(w, 0, sizeof *w);
    snprintf(w->folder, sizeof w->folder, "%s", path);
    w->body = read_mesh(path_of(w, "source.obj"));
    w->target_body = read_mesh(path_of(w, "target.obj"));
    char *bones = read_text(path_of(w, "skeleton.json"));
    w->skeleton = read_side(bones, "source");
    w->target_skeleton = read_side(bones, "target");
    free(bones);
    read_regions(w);
    FILE *file = fopen(path_of(w, "source.hair"), "rb");
    struct groom_source source = groom_source_from_fd(fileno(file));
    ck_ok(groom_strands_read(&source, &options, NULL, &w->strands, NULL, NULL));
    fclose(file);
    w->target = (struct groom_retarget_target){w->target_body, &w->target_skeleton, NULL};
    return 1;
}

static void worked_finish(struct worked *w)
{
    groom_mesh_destroy(w->body);
    groom_mesh_destroy(w->target_body);
    groom_strands_destroy(w->strands);
    free(w->regions);
}

static struct groom_retarget_source *prepare(const struct worked *w, const struct groom_retarget_options *options)
{
    struct groom_retarget_source *source;
    struct groom_diag diag = {0};
    groom_status st = groom_retarget_source_create(w->strands, w->body, &w->skeleton, w->regions, options, NULL, &source, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
    return source;
}

/* The same with the worked case's own guides. */
static struct groom_retarget_source *prepare_with_guides(const struct worked *w, const struct groom_retarget_options *options)
{
    struct groom_retarget_source *source;
    ck_ok(source_init(&source, w->strands, w->body, &w->skeleton, w->regions, options, NULL, NULL));
    ck_ok(anchors_find(source, w->regions, NULL, NULL));
    if (options->mode == GROOM_RETARGET_MULTISCALE) {
        struct npy_array guides = test_npz(path_of(w, "pre.npz"), "guides.npy");
        source->n_guides = (uint32_t)guides.n;
        source->guides = source->allocator->allocate(NULL, guides.n * sizeof *source->guides);
        for (size_t i = 0; i < guides.n; i++)
            source->guides[i] = (uint32_t)guides.values[i];
        free(guides.values);
    }
    ck_ok(source_index_guides(source, NULL));
    ck_ok(neighbours_find(source, NULL, NULL));
    return source;
}

/* The largest distance of points (relative to centre) from those of a file. */
static double farthest(const struct worked *w, const char *name, const float (*points)[3], const double centre[3])
{
    struct npy_array worked = test_npy(path_of(w, name));
    double most = 0;
    ck_assert_uint_eq(worked.n, 3 * (size_t)w->strands->n_vertices);
    for (size_t i = 0; i < worked.n / 3; i++) {
        double sum = 0;
        for (size_t c = 0; c < 3; c++) {
            double d = points[i][c] + centre[c] - worked.values[3 * i + c];
            sum += d * d;
        }
        most = fmax(most, sqrt(sum));
    }
    free(worked.values);
    return most;
}

/* Table I, one pass of smoothing as the worked case has it, every iteration to the last digits. */
static struct groom_retarget_options worked_options(void)
{
    struct groom_retarget_options options;
    groom_retarget_options_init(&options);
    options.guides = 20;
    options.smoothing = 1;
    options.sweeps = 0;
    options.tolerance = 0;
    return options;
}

START_TEST(bones_are_those_of_the_worked_case)
{
    struct worked w;
    struct groom_retarget_options options = worked_options();
    if (!worked_init(&w))
        return;
    struct groom_retarget_source *source = prepare(&w, &options);
    struct npy_array bone = test_npz(path_of(&w, "pre.npz"), "bone.npy"), tri = test_npz(path_of(&w, "pre.npz"), "tri.npy");
    struct npy_array eta = test_npz(path_of(&w, "pre.npz"), "eta.npy"), t = test_npz(path_of(&w, "pre.npz"), "t.npy");
    ck_assert_uint_eq(bone.n, w.strands->n_vertices);
    for (uint32_t i = 0; i < bone.n; i++) {
        const struct anchor *a = &source->anchors[i];
        ck_assert_uint_eq(a->bone, (uint32_t)bone.values[i]);
        ck_assert_uint_eq(a->triangle, (uint32_t)tri.values[i]);
        ck_assert_double_eq_tol(a->eta, eta.values[i], 1e-7);
        ck_assert_double_eq_tol(a->along / 4294967295.0, t.values[i], 1e-6); /* bones are kept as floats */
    }
    ck_assert_uint_eq(source->n_without_bone, 0);
    free(bone.values), free(tri.values), free(eta.values), free(t.values);
    groom_retarget_source_destroy(source);
    worked_finish(&w);
}
END_TEST

static void compare_graph(const struct worked *w, const struct graph *graph, const uint8_t *left_out, const char *ids, const char *weights)
{
    struct npy_array id = test_npz(path_of(w, "pre.npz"), ids), weight = test_npz(path_of(w, "pre.npz"), weights);
    size_t at = 0;
    for (uint32_t i = 0, strand = 0; i < graph->n_rows; i++) {
        while (left_out && i >= w->strands->first[strand + 1])
            strand++;
        for (uint32_t j = 0; !(left_out && left_out[strand]) && j < graph->k; j++, at++) {
            ck_assert_uint_eq(graph->neighbour[i * graph->k + j], (uint32_t)id.values[at]);
            ck_assert_double_eq_tol(graph->weight[i * graph->k + j], weight.values[at], 1e-6);
        }
    }
    ck_assert_uint_eq(at, id.n);
    free(id.values), free(weight.values);
}

START_TEST(neighbours_are_those_of_the_worked_case)
{
    struct worked w;
    struct groom_retarget_options options = worked_options();
    if (!worked_init(&w))
        return;
    struct groom_retarget_source *source = prepare_with_guides(&w, &options);
    compare_graph(&w, &source->among_guides, NULL, "knn_guides.npy", "w_guides.npy");
    compare_graph(&w, &source->to_guides, source->is_guide, "knn_normal.npy", "w_normal.npy");
    groom_retarget_source_destroy(source);
    worked_finish(&w);
}
END_TEST

START_TEST(initial_transfer_is_that_of_the_worked_case)
{
    struct worked w;
    struct groom_retarget_options options = worked_options();
    struct groom_retarget_report report = {0};
    struct job job;
    if (!worked_init(&w))
        return;
    struct groom_retarget_source *source = prepare(&w, &options);
    ck_ok(job_init(&job, source, &w.target, &options, NULL, &report, NULL));
    float(*tilde)[3] = calloc(w.strands->n_vertices, sizeof *tilde);
    for (uint32_t i = 0; i < w.strands->n_vertices; i++) {
        double p[3];
        transfer_anchor(&job, i, p);
        for (int c = 0; c < 3; c++)
            tilde[i][c] = (float)(p[c] - job.centre[c]);
    }
    ck_ok(transfer_all(&job, NULL));
    ck_assert_double_lt(farthest(&w, "ptil.npy", (const float(*)[3])tilde, job.centre), 1e-6);
    ck_assert_double_lt(farthest(&w, "phat.npy", (const float(*)[3])job.hat, job.centre), 1e-6);
    ck_assert_uint_eq(report.n_smoothed, 296);
    free(tilde);
    job_finish(&job);
    groom_retarget_source_destroy(source);
    worked_finish(&w);
}
END_TEST

/* The numbers called `key` after the first `from` of the case's energies, in their order. */
static uint32_t numbers_of(const struct worked *w, const char *from, const char *key, double *out, uint32_t n)
{
    char *text = read_text(path_of(w, "energies.json")), *at = strstr(text, from);
    char quoted[64];
    uint32_t found = 0;
    ck_assert(at != NULL);
    snprintf(quoted, sizeof quoted, "\"%s\":", key);
    while (found < n && (at = strstr(at, quoted))) {
        at += strlen(quoted);
        out[found++] = strtod(at, NULL);
    }
    free(text);
    return found;
}

#define ck_near(a, b, share) ck_assert_double_eq_tol(a, b, (share) * fabs(b))

/* Both scales for so many iterations, without the last pass. */
static struct groom_retarget_report adapt_worked(const struct worked *w, struct groom_retarget_options options,
                                                 const struct groom_retarget_source *source, const char *result)
{
    struct groom_retarget_report report = {0};
    struct job job;
    float(*p)[3] = calloc(w->strands->n_vertices, sizeof *p);
    ck_ok(job_init(&job, source, &w->target, &options, NULL, &report, NULL));
    ck_ok(transfer_all(&job, NULL));
    ck_ok(job_adapt(&job, p, NULL));
    if (result)
        ck_assert_double_lt(farthest(w, result, (const float(*)[3])p, job.centre), 1e-6);
    job_finish(&job);
    free(p);
    return report;
}

START_TEST(iterations_of_both_scales_are_those_of_the_worked_case)
{
    struct worked w;
    struct groom_retarget_options options = worked_options();
    double shape[17], total[17], fine_shape[16], fine_total[16], fine_inter[16], fine_body[16];
    if (!worked_init(&w))
        return;
    struct groom_retarget_source *source = prepare_with_guides(&w, &options);
    ck_assert_uint_eq(numbers_of(&w, "\"coarse\"", "shape", shape, 17), 17);
    ck_assert_uint_eq(numbers_of(&w, "\"coarse\"", "total", total, 17), 17);
    ck_assert_uint_eq(numbers_of(&w, "\"fine\"", "shape", fine_shape, 16), 16);
    ck_assert_uint_eq(numbers_of(&w, "\"fine\"", "inter", fine_inter, 16), 16);
    ck_assert_uint_eq(numbers_of(&w, "\"fine\"", "body", fine_body, 16), 16);
    ck_assert_uint_eq(numbers_of(&w, "\"fine\"", "total", fine_total, 16), 16);
    options.iterations = 1;
    adapt_worked(&w, options, source, "result_outer1.npy");
    options.iterations = 15;
    struct groom_retarget_report report = adapt_worked(&w, options, source, "result_outer15.npy");
    for (uint32_t i = 0; i < 15; i++) {
        ck_near(report.coarse[i].energy.shape, shape[2 + i], 1e-4);
        ck_near(report.coarse[i].energy.total, total[2 + i], 1e-4);
    }
    ck_near(report.before.total, total[0] + fine_total[0], 1e-4);
    ck_near(report.after.shape, report.coarse[14].energy.shape + fine_shape[15], 1e-3);
    ck_near(report.after.inter, report.coarse[14].energy.inter + fine_inter[15], 1e-3);
    ck_near(report.after.body, report.coarse[14].energy.body + fine_body[15], 1e-3);
    ck_near(report.after.total, report.coarse[14].energy.total + fine_total[15], 1e-3);
    groom_retarget_source_destroy(source);
    worked_finish(&w);
}
END_TEST

START_TEST(global_solution_is_that_of_the_worked_case)
{
    struct worked w;
    struct groom_retarget_options options = worked_options();
    double total[3], inter[3];
    options.mode = GROOM_RETARGET_GLOBAL;
    if (!worked_init(&w))
        return;
    struct groom_retarget_source *source = prepare(&w, &options);
    ck_assert_uint_eq(numbers_of(&w, "\"global_energy\"", "total", total, 3), 3);
    ck_assert_uint_eq(numbers_of(&w, "\"global_energy\"", "inter", inter, 3), 3);
    struct groom_retarget_report report = adapt_worked(&w, options, source, "result_global.npy");
    ck_near(report.before.total, total[0], 1e-4);
    ck_near(report.after.total, total[2], 1e-4);
    ck_near(report.after.inter, inter[2], 1e-3);
    groom_retarget_source_destroy(source);
    worked_finish(&w);
}
END_TEST

START_TEST(nothing_is_left_inside)
{
    struct worked w;
    struct groom_retarget_options options = worked_options();
    struct groom_retarget_report report;
    if (!worked_init(&w))
        return;
    struct groom_retarget_source *source = prepare(&w, &options);
    float(*p)[3] = calloc(w.strands->n_vertices, sizeof *p);
    ck_ok(groom_retarget_run(source, &w.target, &options, NULL, p, NULL, &report, NULL));
    ck_assert_uint_eq(report.inside_before.vertices, 2);
    ck_assert_uint_eq(report.inside_before.segments, 3);
    ck_assert_uint_eq(report.inside_after.vertices + report.inside_after.segments + report.inside_after.near_vertices, 0);
    free(p);
    groom_retarget_source_destroy(source);
    worked_finish(&w);
}
END_TEST

/* --- kept ---------------------------------------------------------------------------------- */

struct buffer {
    unsigned char *bytes;
    size_t n;
};

static groom_status write_buffer(void *user, const void *bytes, size_t n)
{
    struct buffer *buffer = user;
    buffer->bytes = realloc(buffer->bytes, buffer->n + n);
    memcpy(buffer->bytes + buffer->n, bytes, n);
    buffer->n += n;
    return GROOM_OK;
}

static groom_status load(const struct worked *w, const struct groom_retarget_options *options, const struct buffer *buffer, size_t n,
                         struct groom_retarget_source **source)
{
    struct groom_memory_source state;
    struct groom_source bytes = groom_source_from_memory(&state, buffer->bytes, n);
    return groom_retarget_source_load(&bytes, w->strands, w->body, &w->skeleton, w->regions, options, NULL, source, NULL);
}

START_TEST(what_was_prepared_is_kept)
{
    struct worked w;
    struct groom_retarget_options options = worked_options();
    struct groom_retarget_source *source, *loaded;
    struct buffer buffer = {0};
    if (!worked_init(&w))
        return;
    source = prepare(&w, &options);
    ck_ok(groom_retarget_source_save(source, (struct groom_sink){write_buffer, &buffer}, NULL));
    ck_ok(load(&w, &options, &buffer, buffer.n, &loaded));
    float(*a)[3] = calloc(w.strands->n_vertices, sizeof *a), (*b)[3] = calloc(w.strands->n_vertices, sizeof *b);
    ck_ok(groom_retarget_run(source, &w.target, &options, NULL, a, NULL, NULL, NULL));
    ck_ok(groom_retarget_run(loaded, &w.target, &options, NULL, b, NULL, NULL, NULL));
    ck_assert_mem_eq(a, b, w.strands->n_vertices * sizeof *a);
    groom_retarget_source_destroy(loaded);
    ck_status(load(&w, &options, &buffer, buffer.n - 1, &loaded), GROOM_ETRUNCATED);
    buffer.bytes[buffer.n / 2] ^= 1;
    ck_status(load(&w, &options, &buffer, buffer.n, &loaded), GROOM_EFORMAT);
    buffer.bytes[buffer.n / 2] ^= 1;
    options.guides = 21;
    ck_status(load(&w, &options, &buffer, buffer.n, &loaded), GROOM_ECONFLICT);
    options.guides = 20;
    w.strands->points[7][0] += 1e-3f;
    ck_status(load(&w, &options, &buffer, buffer.n, &loaded), GROOM_ECONFLICT);
    free(a), free(b), free(buffer.bytes);
    groom_retarget_source_destroy(source);
    worked_finish(&w);
}
END_TEST

/* --- options --------------------------------------------------------------------------------- */

static groom_status parse(const char *json, struct groom_retarget_options *options, struct groom_diag *diag)
{
    return groom_retarget_options_parse(json, strlen(json), options, diag);
}

START_TEST(options_are_those_of_table_one_where_absent)
{
    struct groom_retarget_options options;
    char *text;
    ck_ok(parse("{\"alpha\":2,\"mode\":\"global\"}", &options, NULL));
    ck_assert_double_eq(options.alpha, 2);
    ck_assert_double_eq(options.beta, 1e3);
    ck_assert_uint_eq(options.neighbours, 5);
    ck_assert_double_eq(options.clearance, 5e-4);
    ck_assert_double_eq(options.discrepancy, 0.3);
    ck_assert_int_eq(options.mode, GROOM_RETARGET_GLOBAL);
    ck_ok(groom_retarget_options_print(&options, &text, NULL));
    struct groom_retarget_options again;
    ck_ok(parse(text, &again, NULL));
    ck_assert_mem_eq(&again, &options, sizeof options);
    free(text);
    ck_ok(groom_retarget_options_schema(&text, NULL));
    ck_assert_ptr_nonnull(strstr(text, "\"neighbours\""));
    free(text);
}
END_TEST

START_TEST(options_refuse_what_they_do_not_know)
{
    struct groom_retarget_options options;
    struct groom_diag diag;
    ck_status(parse("{\"alhpa\":2}", &options, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/alhpa");
    ck_status(parse("{\"guides\":2.5}", &options, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/guides");
    ck_status(parse("{\"mode\":\"fast\"}", &options, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/mode");
    ck_status(parse("{\"beta\":1,\"beta\":2}", &options, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/beta");
    ck_status(parse("[1]", &options, &diag), GROOM_EINVAL);
}
END_TEST

TEST_SUITE("retarget", bones_are_those_of_the_worked_case, neighbours_are_those_of_the_worked_case,
           initial_transfer_is_that_of_the_worked_case, iterations_of_both_scales_are_those_of_the_worked_case,
           global_solution_is_that_of_the_worked_case, nothing_is_left_inside, what_was_prepared_is_kept,
           options_are_those_of_table_one_where_absent, options_refuse_what_they_do_not_know)
