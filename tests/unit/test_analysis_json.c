/* Analyses as they are told: JSON, vertex buffers, clusters. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/base64.h"
#include "base/json_stream.h"
#include "groom/analysis.h"
#include "tests/support/superhelix.h"
#include "tests/support/test.h"

#include <cjson/cJSON.h>

struct memory {
    char *bytes;
    size_t n, fail_after;
};

static groom_status memory_write(void *user, const void *bytes, size_t n)
{
    struct memory *m = user;
    if (m->fail_after && m->n + n > m->fail_after)
        return GROOM_ENOSPC;
    m->bytes = realloc(m->bytes, m->n + n + 1);
    memcpy(m->bytes + m->n, bytes, n);
    m->n += n;
    m->bytes[m->n] = 0;
    return GROOM_OK;
}

static struct groom_sink sink_of(struct memory *m) { return (struct groom_sink){memory_write, m}; }

START_TEST(json_comes_out_as_it_was_said)
{
    struct memory m = {0};
    struct json_stream s;
    const uint32_t numbers[4] = {1, 2, 3, 4};
    json_stream_init(&s, sink_of(&m));
    json_stream_open(&s, NULL, '{');
    json_stream_text(&s, "text", "a \"quote\", a \\ and\na line");
    json_stream_open(&s, "list", '[');
    json_stream_number(&s, NULL, 0.1);
    json_stream_number(&s, NULL, INFINITY);
    json_stream_open(&s, NULL, '{');
    json_stream_close(&s, '}');
    json_stream_close(&s, ']');
    json_stream_integer(&s, "large", UINT64_MAX);
    json_stream_packed(&s, "array", "u32", (uint64_t[]){2, 2}, 2, numbers);
    json_stream_close(&s, '}');
    ck_ok(json_stream_finish(&s));
    ck_assert_str_eq(m.bytes, "{\"text\":\"a \\\"quote\\\", a \\\\ and\\u000aa line\",\"list\":[0.1,null,{}],\"large\":"
                              "18446744073709551615,\"array\":{\"dtype\":\"u32\",\"shape\":[2,2],\"data\":"
                              "\"AQAAAAIAAAADAAAABAAAAA==\"}}");
    free(m.bytes);
}
END_TEST

/* Arrays are encoded piece by piece: the pieces must join. */
START_TEST(long_arrays_are_one_text)
{
    enum { N = 10001 };
    struct memory m = {0};
    struct json_stream s;
    uint32_t *numbers = calloc(N, sizeof *numbers), *back = calloc(N, sizeof *back);
    for (uint32_t k = 0; k < N; k++)
        numbers[k] = 2654435761u * k;
    json_stream_init(&s, sink_of(&m));
    json_stream_packed(&s, NULL, "u32", (uint64_t[]){N}, 1, numbers);
    ck_ok(json_stream_finish(&s));
    cJSON *json = cJSON_Parse(m.bytes);
    const char *data = cJSON_GetStringValue(cJSON_GetObjectItem(json, "data"));
    ck_assert_int_eq(base64_decoded_length(data, strlen(data)), 4 * N);
    ck_assert_int_eq(base64_decode(data, strlen(data), back), 0);
    ck_assert_mem_eq(back, numbers, 4 * N);
    cJSON_Delete(json);
    free(m.bytes), free(numbers), free(back);
}
END_TEST

/* --- an analysis ------------------------------------------------------------------------- */

static struct groom_strands *coils(uint32_t n_strands)
{
    struct groom_superhelices *h = superhelix_coils(n_strands, 45, 3, 1);
    struct groom_strands *s;
    ck_ok(groom_strands_create(n_strands, (uint64_t)n_strands * 100, NULL, &s, NULL));
    for (uint32_t i = 0; i < n_strands; i++)
        s->first[i + 1] = 100 * (i + 1);
    ck_ok(groom_superhelices_sample(h, 100, s->points, NULL, NULL));
    groom_superhelices_destroy(h);
    return s;
}

static groom_status analyze(const struct groom_strands *s, const struct groom_context *context,
                            struct groom_strand_analysis **a)
{
    struct groom_conversion_options conversion = groom_conversion_options_default();
    struct groom_analysis_options options = groom_analysis_options_default();
    return groom_strands_analyze(s, &conversion, &options, context, a, NULL);
}

static const struct groom_analysis_telling all_parts = {.id_name = "groom", .id = "grm_x", .revision = 3, .n_of = 12, .parts = 31};

static float *column_of(const cJSON *object, const char *part, const char *name, uint32_t n)
{
    const cJSON *array = cJSON_GetObjectItem(cJSON_GetObjectItem(object, part), name);
    const char *data = cJSON_GetStringValue(cJSON_GetObjectItem(array, "data"));
    float *numbers = calloc(n, sizeof *numbers);
    ck_assert_msg(data && base64_decoded_length(data, strlen(data)) == 4 * (int64_t)n, "%s.%s", part, name);
    ck_assert_int_eq(base64_decode(data, strlen(data), numbers), 0);
    return numbers;
}

START_TEST(what_is_told_is_what_was_found)
{
    struct groom_strands *s = coils(12);
    struct groom_strand_analysis *a;
    struct memory m = {0}, buffer = {0};
    ck_ok(analyze(s, NULL, &a));
    ck_ok(groom_strand_analysis_write(a, &all_parts, sink_of(&m), NULL, NULL));
    ck_ok(groom_strand_analysis_write_vertices(a, sink_of(&buffer), NULL, NULL));
    cJSON *json = cJSON_Parse(m.bytes);
    ck_assert_ptr_nonnull(json);
    uint32_t n = a->analysis->n_elements;
    float *radius = column_of(json, "elements", "radius", n), *beta = column_of(json, "elements", "beta", n);
    for (uint32_t j = 0; j < n; j++) {
        ck_assert_float_eq(radius[j], a->analysis->elements[j].radius_m);
        ck_assert_float_eq(beta[j], a->analysis->elements[j].beta);
    }
    /* every vertex has the numbers of an element of its own strand, and the two ways of telling them agree */
    float *of_vertex = column_of(json, "vertices", "frequency", s->n_vertices);
    ck_assert_uint_eq(buffer.n, s->n_vertices * 16);
    for (uint32_t k = 0; k < s->n_vertices; k++) {
        float four[4];
        int found = 0;
        memcpy(four, buffer.bytes + 16 * (size_t)k, sizeof four);
        ck_assert_float_eq(four[1], of_vertex[k]);
        for (uint32_t j = a->analysis->first[k / 100]; j < a->analysis->first[k / 100 + 1]; j++)
            found |= a->analysis->elements[j].frequency == of_vertex[k];
        ck_assert(found);
    }
    const cJSON *switchbacks = cJSON_GetObjectItem(json, "switchbacks");
    ck_assert_double_eq(cJSON_GetObjectItem(switchbacks, "count")->valuedouble, a->analysis->n_switchbacks);
    ck_assert_uint_ge(a->analysis->n_switchbacks, 10); /* all 12 have one; it may drown in what the coils wander */
    free(radius), free(beta), free(of_vertex), free(m.bytes), free(buffer.bytes);
    cJSON_Delete(json);
    groom_strand_analysis_destroy(a), groom_strands_destroy(s);
}
END_TEST

START_TEST(histograms_hold_all_that_was_weighed)
{
    struct groom_strands *s = coils(12);
    struct groom_strand_analysis *a;
    ck_ok(analyze(s, NULL, &a));
    const struct groom_histogram *all[] = {&a->analysis->summary.radius, &a->analysis->summary.frequency};
    double winding = a->analysis->summary.length_m * (1.0 - a->analysis->summary.share[GROOM_HAIR_STRAIGHT]);
    for (int h = 0; h < 2; h++) {
        double sum = 0.0, mean = 0.0, means[2] = {a->analysis->summary.radius_mean_m, a->analysis->summary.frequency_mean};
        for (int k = 0; k < GROOM_HISTOGRAM_BINS; k++) {
            sum += all[h]->weight[k];
            mean += all[h]->weight[k] * all[h]->high * (k + 0.5) / GROOM_HISTOGRAM_BINS;
        }
        ck_assert_double_eq_tol(sum, winding, 1e-9);
        ck_assert_double_eq_tol(mean / sum, means[h], 0.06 * means[h]);
        ck_assert_double_le(all[h]->weight[GROOM_HISTOGRAM_BINS - 1], 0.08 * sum); /* no spike where it ends */
    }
    double hands = a->analysis->summary.share_hand[0] + a->analysis->summary.share_hand[1] + a->analysis->summary.share_hand[2];
    ck_assert_double_eq_tol(hands, 1.0, 1e-12);
    groom_strand_analysis_destroy(a), groom_strands_destroy(s);
}
END_TEST

START_TEST(a_sink_that_fails_is_reported)
{
    struct groom_strands *s = coils(12);
    struct groom_strand_analysis *a;
    ck_ok(analyze(s, NULL, &a));
    for (size_t after = 1; after < 60000; after += 9000) {
        struct memory m = {.fail_after = after};
        ck_status(groom_strand_analysis_write(a, &all_parts, sink_of(&m), NULL, NULL), GROOM_ENOSPC);
        free(m.bytes);
    }
    struct memory m = {.fail_after = 100};
    ck_status(groom_strand_analysis_write_vertices(a, sink_of(&m), NULL, NULL), GROOM_ENOSPC);
    groom_strand_analysis_destroy(a), groom_strands_destroy(s);
    free(m.bytes);
}
END_TEST

static groom_status whole_way(const struct groom_strands *s, const struct groom_context *context)
{
    struct memory m = {0};
    struct groom_strand_analysis *a = NULL;
    groom_status st = analyze(s, context, &a);
    if (st == GROOM_OK)
        st = groom_strand_analysis_write(a, &all_parts, sink_of(&m), context, NULL);
    if (st == GROOM_OK)
        st = groom_strand_analysis_write_vertices(a, sink_of(&m), context, NULL);
    groom_strand_analysis_destroy(a);
    free(m.bytes);
    return st;
}

START_TEST(failing_allocations_are_reported_and_leak_nothing)
{
    struct groom_strands *s = coils(2);
    groom_status st = GROOM_ENOMEM;
    for (size_t n = 0; st != GROOM_OK; n++) {
        struct groom_allocator allocator;
        struct test_failing_allocator state;
        struct groom_context context = {.allocator = &allocator};
        test_failing_allocator_init(&state, n, &allocator);
        st = whole_way(s, &context);
        ck_assert(st == GROOM_OK || st == GROOM_ENOMEM);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
    }
    groom_strands_destroy(s);
}
END_TEST

TEST_SUITE("analysis_json", json_comes_out_as_it_was_said, long_arrays_are_one_text, what_is_told_is_what_was_found,
           histograms_hold_all_that_was_weighed, a_sink_that_fails_is_reported,
           failing_allocations_are_reported_and_leak_nothing)
