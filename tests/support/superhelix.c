#include "tests/support/superhelix.h"

#include <cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "groom/random.h"
#include "tests/support/test.h"

static char *read_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return NULL;
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    rewind(file);
    char *text = calloc((size_t)size + 1, 1);
    if (text && fread(text, 1, (size_t)size, file) != (size_t)size)
        text[0] = 0;
    fclose(file);
    return text;
}

struct cJSON *vectors_load(const char *name)
{
    char relative[256];
    snprintf(relative, sizeof relative, "../vectors/%s", name);
    const char *path = test_shared_data(relative);
    if (!path)
        return NULL;
    char *text = read_file(path);
    struct cJSON *json = text ? cJSON_Parse(text) : NULL;
    free(text);
    ck_assert_msg(json != NULL, "%s does not parse", path);
    return json;
}

const struct cJSON *vectors_get(const struct cJSON *object, const char *name)
{
    const struct cJSON *member = cJSON_GetObjectItemCaseSensitive(object, name);
    ck_assert_msg(member != NULL, "no member \"%s\"", name);
    return member;
}

double vectors_number(const struct cJSON *object, const char *name) { return vectors_get(object, name)->valuedouble; }

size_t vectors_size(const struct cJSON *array)
{
    if (cJSON_IsNumber(array))
        return 1;
    size_t n = 0;
    const struct cJSON *item;
    cJSON_ArrayForEach(item, array) n += vectors_size(item);
    return n;
}

static double *read_numbers(const struct cJSON *array, double *out)
{
    if (cJSON_IsNumber(array)) {
        *out = array->valuedouble;
        return out + 1;
    }
    const struct cJSON *item;
    cJSON_ArrayForEach(item, array) out = read_numbers(item, out);
    return out;
}

void vectors_read(const struct cJSON *array, double *out, size_t n)
{
    ck_assert_uint_eq(vectors_size(array), n);
    read_numbers(array, out);
}

struct groom_superhelices *superhelix_from_case(const struct cJSON *object)
{
    struct groom_superhelices *h;
    double rows[3][3];
    uint32_t n = (uint32_t)vectors_size(vectors_get(object, "l"));
    ck_ok(groom_superhelices_create(1, n, NULL, &h, NULL));
    h->first[1] = n;
    vectors_read(vectors_get(object, "p0"), h->root[0], 3);
    vectors_read(vectors_get(object, "F0_rows"), rows[0], 9);
    for (int axis = 0; axis < 3; axis++)
        for (int k = 0; k < 3; k++)
            h->frame[0][axis][k] = rows[k][axis];
    vectors_read(vectors_get(object, "q"), h->q[0], (size_t)n * 3);
    vectors_read(vectors_get(object, "l"), h->length, n);
    return h;
}

/* Benchmarks come here too, and Check's assertions work in tests only. */
static struct groom_superhelices *room_for(uint32_t n_strands, uint64_t n_elements)
{
    struct groom_superhelices *h = NULL;
    if (groom_superhelices_create(n_strands, n_elements, NULL, &h, NULL) != GROOM_OK)
        abort();
    return h;
}

struct groom_superhelices *superhelix_straight(uint32_t n_elements, double length)
{
    struct groom_superhelices *h = room_for(1, n_elements);
    h->first[1] = n_elements;
    for (int i = 0; i < 3; i++) {
        h->root[0][i] = 0.0;
        for (int k = 0; k < 3; k++)
            h->frame[0][i][k] = i == k;
    }
    for (uint32_t j = 0; j < n_elements; j++) {
        h->length[j] = length / n_elements;
        h->q[j][0] = h->q[j][1] = h->q[j][2] = 0.0;
    }
    return h;
}

void random_frame(uint64_t seed, uint32_t index, double f[3][3])
{
    double w[4], norm = 0.0;
    for (uint32_t k = 0; k < 4; k++) {
        w[k] = groom_random_normal((struct groom_random_key){seed, 77}, index, k);
        norm += w[k] * w[k];
    }
    norm = sqrt(norm);
    double a = w[0] / norm, b = w[1] / norm, c = w[2] / norm, d = w[3] / norm;
    double rows[3][3] = {{a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
                         {2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)},
                         {2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d}};
    for (int axis = 0; axis < 3; axis++)
        for (int k = 0; k < 3; k++)
            f[axis][k] = rows[k][axis];
}

static void make_coil(struct groom_superhelices *h, uint32_t i, uint64_t seed, int switchback)
{
    struct groom_random_key key = {seed, 1};
    uint32_t begin = h->first[i], n = h->first[i + 1] - begin;
    double radius = 0.004 + 0.008 * groom_random_uniform(key, i, 0);
    double step = (0.4 + 0.4 * groom_random_uniform(key, i, 1)) * radius; /* rise a radian of turn */
    double hand = groom_random_uniform(key, i, 2) < 0.5f ? -1.0 : 1.0;
    double square = radius * radius + step * step, gauge = 6.3 * groom_random_uniform(key, i, 3);
    for (int k = 0; k < 3; k++)
        h->root[i][k] = 0.1 * groom_random_normal(key, i, 4 + (uint32_t)k);
    random_frame(seed, i, h->frame[i]);
    for (uint32_t j = 0; j < n; j++) {
        double side = switchback && j >= n / 2 ? -hand : hand;
        double wander[3];
        for (uint32_t k = 0; k < 3; k++)
            wander[k] = 0.07 / sqrt(square) * groom_random_normal(key, i, 16 + 3 * j + k);
        h->length[begin + j] = 0.2 / n;
        h->q[begin + j][0] = side * step / square + wander[0];
        h->q[begin + j][1] = radius / square * cos(gauge) + wander[1];
        h->q[begin + j][2] = radius / square * sin(gauge) + wander[2];
    }
}

struct groom_superhelices *superhelix_coils(uint32_t n_strands, uint32_t n_elements, uint64_t seed, int switchback)
{
    struct groom_superhelices *h = room_for(n_strands, (uint64_t)n_strands * n_elements);
    for (uint32_t i = 0; i < n_strands; i++) {
        h->first[i + 1] = h->first[i] + n_elements;
        make_coil(h, i, seed, switchback);
    }
    return h;
}
