#include "tests/support/grooms.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "groom/random.h"

const float test_slanted_axes[3][3] = {{0.36f, 0.48f, -0.8f}, {-0.8f, 0.6f, 0}, {0.48f, 0.64f, 0.6f}};
const float test_quarter_axes[3][3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};

enum stream { STREAM_GUIDE_ROOT = 1000, STREAM_GUIDE_SHAPE, STREAM_STRAND_ROOT, STREAM_PARAMETER };

/* Not one of Check's assertions: benchmarks use this file too. */
static void require(groom_status status)
{
    if (status == GROOM_OK)
        return;
    fprintf(stderr, "test groom: %s\n", groom_status_message(status));
    abort();
}

static void place_root(struct groom_random_key key, uint32_t i, float uv[2], float root[3])
{
    uv[0] = groom_random_uniform(key, i, 0);
    uv[1] = groom_random_uniform(key, i, 1);
    double azimuth = 6.28 * uv[0], polar = 1.5 * uv[1];
    root[0] = (float)(0.1 * sin(polar) * cos(azimuth));
    root[1] = (float)(1.6 + 0.1 * cos(polar));
    root[2] = (float)(0.1 * sin(polar) * sin(azimuth));
}

/* A walk whose direction drifts from the outward normal by a few slow sines. */
static void grow_guide(struct groom_random_key key, uint32_t g, uint32_t m, float (*points)[3])
{
    double direction[3], amplitude[3], phase[3], step = 0.3 / (m - 1);
    for (int c = 0; c < 3; c++) {
        direction[c] = (points[0][c] - (c == 1 ? 1.6 : 0.0)) / 0.1;
        amplitude[c] = groom_random_normal(key, g, 2 * (uint32_t)c);
        phase[c] = 6.28 * groom_random_uniform(key, g, 2 * (uint32_t)c + 1);
    }
    for (uint32_t j = 1; j < m; j++)
        for (int c = 0; c < 3; c++)
            points[j][c] = (float)(points[j - 1][c] +
                                   step * (direction[c] + 0.6 * amplitude[c] * sin(phase[c] + 4.0 * j / m)));
}

struct groom *test_groom(struct groom_shape shape, uint64_t seed)
{
    struct groom *groom;
    require(groom_create(shape, NULL, &groom, NULL));
    uint32_t m = shape.n_vertices;
    for (uint32_t g = 0; g < shape.n_guides; g++) {
        place_root((struct groom_random_key){seed, STREAM_GUIDE_ROOT}, g, groom->guide_uv[g], groom->guides[g * m]);
        grow_guide((struct groom_random_key){seed, STREAM_GUIDE_SHAPE}, g, m, &groom->guides[g * m]);
    }
    for (uint32_t o = 0; o < shape.n_operator_guides; o++)
        groom->operator_guide[o] = o * (shape.n_guides / shape.n_operator_guides);
    for (uint32_t i = 0; i < shape.n_strands; i++) {
        place_root((struct groom_random_key){seed, STREAM_STRAND_ROOT}, i, groom->root_uv[i], groom->roots[i]);
        double best = INFINITY;
        for (uint32_t o = 0; o < shape.n_operator_guides; o++) {
            const float *uv = groom->guide_uv[groom->operator_guide[o]];
            double d = hypot(uv[0] - groom->root_uv[i][0], uv[1] - groom->root_uv[i][1]);
            if (d < best) {
                best = d;
                groom->operator_guide_of[i] = o;
            }
        }
    }
    require(groom_instance_by_distance(groom, 0.0f, NULL, NULL));
    return groom;
}

void test_append_operator(struct groom *groom, groom_operator_type type, uint64_t seed)
{
    require(groom_insert_operator(groom, groom->n_operators, type, seed, NULL));
    struct groom_operator *op = &groom->operators[groom->n_operators - 1];
    uint32_t n;
    const struct groom_operator_parameter *parameters = groom_operator_parameters(type, &n);
    for (uint32_t p = 0; p < n; p++)
        op->parameter[p] = parameters[p].initial * (0.5f + groom_random_uniform((struct groom_random_key){seed, STREAM_PARAMETER},
                                                                                op->id, p));
}

void test_append_all_operators(struct groom *groom, uint64_t seed)
{
    for (int type = 0; type < GROOM_OPERATOR_COUNT; type++)
        test_append_operator(groom, (groom_operator_type)type, seed);
}
