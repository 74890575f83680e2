/* pictures: hair is there, behind the head it is not, and the same bits come every time */
#include <math.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "groom/render.h"
#include "tests/support/test.h"

enum { SIZE = 96, STRANDS = 600, VERTICES = 12 };

/* A tuft of strands that stand on a ball of 0.1 m, towards one side (z = 1: the face's). */
static struct groom_strands *tuft(float z)
{
    struct groom_strands *s;
    ck_ok(groom_strands_create(STRANDS, STRANDS * VERTICES, NULL, &s, NULL));
    for (uint32_t i = 0; i < STRANDS; i++) {
        double a = 0.5 * ((i % 25) / 24.0 - 0.5), b = 0.5 * ((i / 25) / 23.0 - 0.5);
        s->first[i + 1] = (i + 1) * VERTICES;
        for (uint32_t j = 0; j < VERTICES; j++) {
            float r = 0.1f + 0.004f * (float)j, *p = s->points[i * VERTICES + j];
            p[0] = r * (float)sin(a);
            p[1] = r * (float)sin(b);
            p[2] = r * z * (float)(cos(a) * cos(b));
        }
    }
    return s;
}

static struct groom_mesh *ball(void)
{
    struct groom_mesh *mesh;
    uint32_t n = 24, t = 0;
    ck_ok(groom_mesh_create((n + 1) * 2 * n, 4 * n * n, 0, NULL, &mesh, NULL));
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t j = 0; j < 2 * n; j++) {
            float *p = mesh->points[i * 2 * n + j];
            p[0] = (float)(0.098 * sin(M_PI * i / n) * sin(M_PI * j / n));
            p[1] = (float)(0.098 * cos(M_PI * i / n));
            p[2] = (float)(0.098 * sin(M_PI * i / n) * cos(M_PI * j / n));
        }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < 2 * n; j++) {
            uint32_t a = i * 2 * n + j, b = i * 2 * n + (j + 1) % (2 * n);
            memcpy(mesh->triangles[t++], (uint32_t[3]){a, a + 2 * n, b + 2 * n}, sizeof *mesh->triangles);
            memcpy(mesh->triangles[t++], (uint32_t[3]){a, b + 2 * n, b}, sizeof *mesh->triangles);
        }
    return mesh;
}

static void draw(const struct groom_strands *s, const struct groom_mesh *head, groom_view view, const struct groom_context *context, uint8_t *rgba)
{
    /* green hair: nothing else is */
    struct groom_render_options options = {.view = view, .size = SIZE, .color = {0.02f, 0.5f, 0.02f}};
    struct groom_diag diag = {0};
    groom_status st = groom_render_strands(s, head, &options, rgba, context, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
}

static int count_hair(const uint8_t *rgba)
{
    int n = 0;
    for (int i = 0; i < SIZE * SIZE; i++)
        n += rgba[i * 4 + 1] > rgba[i * 4] + 25 && rgba[i * 4 + 1] > rgba[i * 4 + 2] + 25;
    return n;
}

START_TEST(hair_is_seen_from_every_side)
{
    static uint8_t rgba[SIZE * SIZE * 4];
    struct groom_strands *s = tuft(1);
    for (int view = 0; view < GROOM_VIEW_COUNT; view++) {
        draw(s, NULL, (groom_view)view, NULL, rgba);
        ck_assert_int_gt(count_hair(rgba), SIZE * SIZE / 20);
        ck_assert_int_lt(count_hair(rgba), SIZE * SIZE * 9 / 10);
        for (int i = 0; i < SIZE * SIZE; i++)
            ck_assert_uint_eq(rgba[i * 4 + 3], 255);
    }
    groom_strands_destroy(s);
}
END_TEST

START_TEST(the_head_hides_hair_behind_it)
{
    static uint8_t rgba[SIZE * SIZE * 4];
    struct groom_strands *face = tuft(1), *back = tuft(-1);
    struct groom_mesh *head = ball();
    draw(face, head, GROOM_VIEW_FRONT, NULL, rgba);
    ck_assert_int_gt(count_hair(rgba), 200);
    draw(back, head, GROOM_VIEW_FRONT, NULL, rgba);
    ck_assert_int_eq(count_hair(rgba), 0);
    draw(back, head, GROOM_VIEW_BACK, NULL, rgba);
    ck_assert_int_gt(count_hair(rgba), 200);
    groom_mesh_destroy(head);
    groom_strands_destroy(face);
    groom_strands_destroy(back);
}
END_TEST

START_TEST(views_are_the_right_way_round)
{
    static uint8_t rgba[SIZE * SIZE * 4];
    struct groom_strands *s = tuft(1);
    struct groom_mesh *head = ball();
    int halves[4] = {0}; /* left, right, upper, lower */
    for (int j = 0; j < VERTICES; j++)
        s->points[j][2] *= -1; /* one strand at the back, so that the middle of the picture is the middle of the head */
    draw(s, head, GROOM_VIEW_SIDE, NULL, rgba); /* from the person's left: the face is on the left */
    for (int i = 0; i < SIZE * SIZE; i++)
        if (rgba[i * 4 + 1] > rgba[i * 4] + 25)
            halves[i % SIZE >= SIZE / 2]++;
    ck_assert_int_gt(halves[0], 50);
    ck_assert_int_lt(halves[1] * 5, halves[0]);
    draw(s, head, GROOM_VIEW_TOP, NULL, rgba); /* the face is at the bottom */
    for (int i = 0; i < SIZE * SIZE; i++)
        if (rgba[i * 4 + 1] > rgba[i * 4] + 25)
            halves[2 + (i / SIZE >= SIZE / 2)]++;
    ck_assert_int_lt(halves[2] * 5, halves[3]);
    ck_assert_int_gt(halves[3], 50);
    groom_mesh_destroy(head);
    groom_strands_destroy(s);
}
END_TEST

START_TEST(pictures_are_the_same_bits_for_1_and_3_threads)
{
    static uint8_t rgba[2][SIZE * SIZE * 4];
    struct groom_strands *s = tuft(1);
    struct groom_mesh *head = ball();
    for (uint32_t run = 0; run < 2; run++) {
        struct groom_pool *pool;
        ck_ok(groom_pool_create(run ? 3 : 1, &pool));
        struct groom_context context = {.pool = pool};
        draw(s, head, GROOM_VIEW_FRONT, &context, rgba[run]);
        groom_pool_destroy(pool);
    }
    ck_assert_mem_eq(rgba[0], rgba[1], sizeof rgba[0]);
    groom_mesh_destroy(head);
    groom_strands_destroy(s);
}
END_TEST

START_TEST(the_middle_of_a_tuft_is_darker_than_its_lit_side)
{
    struct groom_strands *s = tuft(1);
    struct groom_light_options options = {.cells = 48, .stride = 1, .width_m = 2e-3f, .key = {0, 1, 0}};
    struct groom_light *light = NULL;
    float key[2], ambient[2], middle[3], above[3], low = INFINITY, high = -INFINITY;
    ck_ok(groom_light_create(s, &options, NULL, &light, NULL));
    for (int k = 0; k < 3; k++)
        middle[k] = above[k] = light->origin[k] + 0.5f * light->cell * (float)light->size[k];
    above[1] = light->origin[1] + light->cell * (float)light->size[1];
    groom_light_at(light, middle, &key[0], &ambient[0]);
    groom_light_at(light, above, &key[1], &ambient[1]);
    ck_assert_float_lt(key[0], key[1]);
    ck_assert_float_lt(ambient[0], ambient[1]);
    for (uint32_t c = 0; c < light->size[0] * light->size[1] * light->size[2]; c++) {
        low = fminf(low, light->ambient[c]);
        high = fmaxf(high, light->ambient[c]);
    }
    ck_assert(low >= 0 && high <= 1.0001f);
    groom_light_destroy(light);
    options.cells = 4;
    ck_status(groom_light_create(s, &options, NULL, &light, NULL), GROOM_EINVAL);
    groom_strands_destroy(s);
}
END_TEST

START_TEST(odd_strands_and_options_are_answered_calmly)
{
    static uint8_t rgba[SIZE * SIZE * 4];
    struct groom_render_options options = {.size = SIZE};
    struct groom_strands *s = tuft(1), *none, *dot;
    s->points[5][1] = NAN;
    s->points[100][0] = INFINITY;
    draw(s, NULL, GROOM_VIEW_FRONT, NULL, rgba);
    options.size = GROOM_RENDER_MIN_SIZE - 1;
    ck_status(groom_render_strands(s, NULL, &options, rgba, NULL, NULL), GROOM_EINVAL);
    options.size = GROOM_RENDER_MAX_SIZE + 1;
    ck_status(groom_render_strands(s, NULL, &options, rgba, NULL, NULL), GROOM_EINVAL);
    options = (struct groom_render_options){.size = SIZE, .view = (groom_view)9};
    ck_status(groom_render_strands(s, NULL, &options, rgba, NULL, NULL), GROOM_EINVAL);
    options.view = GROOM_VIEW_FRONT;
    ck_ok(groom_strands_create(0, 0, NULL, &none, NULL));
    ck_status(groom_render_strands(none, NULL, &options, rgba, NULL, NULL), GROOM_EEMPTY);
    ck_ok(groom_strands_create(1, 1, NULL, &dot, NULL));
    dot->first[1] = 1;
    memset(dot->points[0], 0, sizeof dot->points[0]);
    ck_ok(groom_render_strands(dot, NULL, &options, rgba, NULL, NULL)); /* one place, no extent */
    dot->points[0][0] = NAN;
    ck_status(groom_render_strands(dot, NULL, &options, rgba, NULL, NULL), GROOM_EEMPTY);
    groom_strands_destroy(dot);
    groom_strands_destroy(none);
    groom_strands_destroy(s);
}
END_TEST

START_TEST(views_have_names)
{
    groom_view view;
    for (int i = 0; i < GROOM_VIEW_COUNT; i++) {
        ck_ok(groom_view_parse(groom_view_name((groom_view)i), &view, NULL));
        ck_assert_int_eq(view, i);
    }
    ck_status(groom_view_parse("below", &view, NULL), GROOM_EINVAL);
}
END_TEST

/* --- cameras of one's own ------------------------------------------------------------------- */

static void draw_from(const struct groom_strands *s, const struct groom_render_camera *camera, uint8_t *rgba)
{
    struct groom_render_options options = {.size = SIZE, .camera = camera, .color = {0.02f, 0.5f, 0.02f}};
    struct groom_diag diag = {0};
    groom_status st = groom_render_strands(s, NULL, &options, rgba, NULL, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
}

/* Where the green pixels are: the box around them. */
static void find_hair(const uint8_t *rgba, int low[2], int high[2])
{
    low[0] = low[1] = SIZE;
    high[0] = high[1] = -1;
    for (int i = 0; i < SIZE * SIZE; i++) {
        int at[2] = {i % SIZE, i / SIZE};
        for (int k = 0; k < 2 && rgba[i * 4 + 1] > rgba[i * 4] + 25; k++) {
            low[k] = at[k] < low[k] ? at[k] : low[k];
            high[k] = at[k] > high[k] ? at[k] : high[k];
        }
    }
}

static double mean_difference(const uint8_t *a, const uint8_t *b)
{
    double sum = 0;
    for (int i = 0; i < SIZE * SIZE * 4; i++)
        sum += abs(a[i] - b[i]);
    return sum / (SIZE * SIZE * 4);
}

START_TEST(an_orbit_meets_the_four_views)
{
    static uint8_t view[SIZE * SIZE * 4], orbit[SIZE * SIZE * 4];
    static const struct { groom_view view; double azimuth, elevation; } pairs[] = {
        {GROOM_VIEW_FRONT, 0, 0}, {GROOM_VIEW_SIDE, M_PI / 2, 0}, {GROOM_VIEW_BACK, M_PI, 0}, {GROOM_VIEW_TOP, 0, M_PI / 2}};
    struct groom_strands *s = tuft(1);
    for (int i = 0; i < 4; i++) {
        struct groom_render_camera camera = {.azimuth = pairs[i].azimuth, .elevation = pairs[i].elevation};
        draw(s, NULL, pairs[i].view, NULL, view);
        draw_from(s, &camera, orbit);
        ck_assert_double_lt(mean_difference(view, orbit), 0.5);
    }
    groom_strands_destroy(s);
}
END_TEST

START_TEST(a_placed_camera_sees_what_lies_before_it)
{
    static uint8_t rgba[SIZE * SIZE * 4];
    struct groom_strands *s = tuft(1);
    int low[2], high[2];
    /* the tuft is some 0.05 m across; the picture shows 0.4 m where it stands */
    struct groom_render_camera camera = {.is_placed = 1, .has_target = 1, .eye = {0, 0, 2.1}, .target = {0, 0, 0.1}, .fov_y = 0.2};
    draw_from(s, &camera, rgba);
    find_hair(rgba, low, high);
    ck_assert_int_gt(low[0], SIZE / 4);
    ck_assert_int_lt(high[0], 3 * SIZE / 4);
    camera.target[0] = camera.eye[0] = -0.08; /* to the left of it: it stands on the right of the picture */
    draw_from(s, &camera, rgba);
    find_hair(rgba, low, high);
    ck_assert_int_gt(low[0], SIZE / 2);
    camera.target[2] = 4; /* it looks the other way */
    draw_from(s, &camera, rgba);
    ck_assert_int_eq(count_hair(rgba), 0);
    groom_strands_destroy(s);
}
END_TEST

START_TEST(a_turn_keeps_the_hair_in_the_picture_at_one_size)
{
    static uint8_t rgba[SIZE * SIZE * 4];
    struct groom_strands *s = tuft(1);
    int least = SIZE, low[2], high[2];
    for (int i = 0; i < 12; i++)
        for (int up = -1; up <= 1; up++) {
            struct groom_render_camera camera = {.azimuth = i * M_PI / 6, .elevation = up * 0.7, .all_around = 1};
            draw_from(s, &camera, rgba);
            find_hair(rgba, low, high);
            for (int k = 0; k < 2; k++) {
                ck_assert_int_gt(low[k], 0);
                ck_assert_int_lt(high[k], SIZE - 1);
                least = low[k] < least ? low[k] : least;
            }
        }
    ck_assert_int_lt(least, SIZE / 4); /* and no farther away than it must be */
    groom_strands_destroy(s);
}
END_TEST

START_TEST(a_wide_picture_shows_more_at_its_sides)
{
    static uint8_t square[SIZE * SIZE * 4], wide[SIZE * SIZE * 8];
    struct groom_strands *s = tuft(1);
    struct groom_render_camera camera = {.is_placed = 1, .has_target = 1, .eye = {0, 0, 2.1}, .target = {0, 0, 0.1}, .fov_y = 0.2};
    struct groom_render_options options = {.size = 2 * SIZE, .height = SIZE, .camera = &camera, .color = {0.02f, 0.5f, 0.02f}};
    int n = 0;
    draw_from(s, &camera, square);
    ck_ok(groom_render_strands(s, NULL, &options, wide, NULL, NULL));
    for (int i = 0; i < SIZE * SIZE * 2; i++)
        n += wide[i * 4 + 1] > wide[i * 4] + 25 && wide[i * 4 + 1] > wide[i * 4 + 2] + 25;
    ck_assert_int_ge(n, count_hair(square) * 9 / 10); /* the same hair */
    ck_assert_int_le(n, count_hair(square) * 11 / 10);
    groom_strands_destroy(s);
}
END_TEST

START_TEST(lights_that_stand_light_the_front_alone)
{
    static uint8_t going[SIZE * SIZE * 4], standing[SIZE * SIZE * 4];
    struct groom_strands *s = tuft(1);
    struct groom_mesh *head = ball();
    struct groom_render_camera camera = {.azimuth = M_PI};
    struct groom_render_options options = {.size = SIZE, .camera = &camera};
    long sums[2] = {0, 0};
    ck_ok(groom_render_strands(s, head, &options, going, NULL, NULL));
    camera.light_stands = 1;
    ck_ok(groom_render_strands(s, head, &options, standing, NULL, NULL));
    for (int i = 0; i < SIZE * SIZE; i++) {
        sums[0] += going[i * 4];
        sums[1] += standing[i * 4];
    }
    ck_assert_int_lt(sums[1], sums[0]); /* the back of the head lies in its own shadow */
    camera.azimuth = 0;
    ck_ok(groom_render_strands(s, head, &options, standing, NULL, NULL));
    camera.light_stands = 0;
    ck_ok(groom_render_strands(s, head, &options, going, NULL, NULL));
    ck_assert_mem_eq(going, standing, sizeof going);
    groom_mesh_destroy(head);
    groom_strands_destroy(s);
}
END_TEST

START_TEST(cameras_that_cannot_stand_are_refused)
{
    static uint8_t rgba[SIZE * SIZE * 4];
    static const struct groom_render_camera bad[] = {
        {.elevation = 2}, {.azimuth = NAN}, {.distance = -1}, {.fov_y = 3.1}, {.is_placed = 1, .eye = {1, 2, 3}, .target = {1, 2, 3}},
        {.has_target = 1, .target = {0, INFINITY, 0}}};
    struct groom_strands *s = tuft(1);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct groom_render_options options = {.size = SIZE, .camera = &bad[i]};
        struct groom_diag diag = {0};
        ck_status(groom_render_strands(s, NULL, &options, rgba, NULL, &diag), GROOM_EINVAL);
        ck_assert_ptr_nonnull(strstr(diag.detail, "must be"));
    }
    struct groom_render_options options = {.size = SIZE, .height = 5000};
    ck_status(groom_render_strands(s, NULL, &options, rgba, NULL, NULL), GROOM_EINVAL);
    groom_strands_destroy(s);
}
END_TEST

struct gathered { uint8_t bytes[1 << 16]; size_t n, room; };
static groom_status gather(void *user, const void *bytes, size_t n)
{
    struct gathered *g = user;
    if (g->n + n > g->room)
        return GROOM_ENOSPC;
    memcpy(g->bytes + g->n, bytes, n);
    g->n += n;
    return GROOM_OK;
}

START_TEST(a_png_decodes_to_the_same_pixels)
{
    static uint8_t rgba[SIZE * SIZE * 4], back[SIZE * SIZE * 4];
    static struct gathered g = {.room = sizeof g.bytes};
    struct groom_strands *s = tuft(1);
    png_image image = {.version = PNG_IMAGE_VERSION};
    draw(s, NULL, GROOM_VIEW_FRONT, NULL, rgba);
    ck_ok(groom_png_write(rgba, SIZE, SIZE, (struct groom_sink){gather, &g}, NULL, NULL));
    ck_assert_int_ne(png_image_begin_read_from_memory(&image, g.bytes, g.n), 0);
    ck_assert_uint_eq(image.width, SIZE);
    image.format = PNG_FORMAT_RGBA;
    ck_assert_int_ne(png_image_finish_read(&image, NULL, back, 0, NULL), 0);
    ck_assert_mem_eq(rgba, back, sizeof rgba);
    g.n = 0;
    g.room = 1000;
    ck_status(groom_png_write(rgba, SIZE, SIZE, (struct groom_sink){gather, &g}, NULL, NULL), GROOM_ENOSPC);
    ck_status(groom_png_write(rgba, 0, SIZE, (struct groom_sink){gather, &g}, NULL, NULL), GROOM_EINVAL);
    groom_strands_destroy(s);
}
END_TEST

/* --- animations ------------------------------------------------------------------------------ */

static uint32_t u32_at(const uint8_t *at) { return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3]; }

static size_t put_chunk(uint8_t *out, const char *type, const uint8_t *bytes, uint32_t n)
{
    uint8_t size[4] = {(uint8_t)(n >> 24), (uint8_t)(n >> 16), (uint8_t)(n >> 8), (uint8_t)n};
    memcpy(out, size, 4);
    memcpy(out + 4, type, 4);
    if (n)
        memcpy(out + 8, bytes, n);
    uint32_t crc = (uint32_t)crc32(0, out + 4, n + 4);
    uint8_t tail[4] = {(uint8_t)(crc >> 24), (uint8_t)(crc >> 16), (uint8_t)(crc >> 8), (uint8_t)crc};
    memcpy(out + 8 + n, tail, 4);
    return n + 12;
}

/* Frame k taken out as a still, by libpng. Every chunk's checksum and the order of sequence numbers on the way. */
static void decode_frame(const struct gathered *g, int k, uint8_t *rgba)
{
    static uint8_t still[1 << 16];
    size_t n = 0, at = 8;
    int frame = -1;
    uint32_t sequence = 0;
    memcpy(still, g->bytes, 8);
    n = 8;
    while (at < g->n) {
        uint32_t size = u32_at(g->bytes + at);
        const uint8_t *type = g->bytes + at + 4, *data = type + 4;
        ck_assert_uint_eq(u32_at(data + size), (uint32_t)crc32(0, type, size + 4));
        if (!memcmp(type, "fcTL", 4) || !memcmp(type, "fdAT", 4))
            ck_assert_uint_eq(u32_at(data), sequence++);
        frame += !memcmp(type, "fcTL", 4);
        if (!memcmp(type, "IHDR", 4) || !memcmp(type, "IEND", 4))
            n += put_chunk(still + n, !memcmp(type, "IHDR", 4) ? "IHDR" : "IEND", data, size);
        else if (frame == k && !memcmp(type, "IDAT", 4))
            n += put_chunk(still + n, "IDAT", data, size);
        else if (frame == k && !memcmp(type, "fdAT", 4))
            n += put_chunk(still + n, "IDAT", data + 4, size - 4);
        at += size + 12;
    }
    png_image image = {.version = PNG_IMAGE_VERSION};
    ck_assert_int_ne(png_image_begin_read_from_memory(&image, still, n), 0);
    image.format = PNG_FORMAT_RGBA;
    ck_assert_int_ne(png_image_finish_read(&image, NULL, rgba, 0, NULL), 0);
}

START_TEST(each_frame_of_an_animation_decodes_to_its_pixels)
{
    static uint8_t frames[3][SIZE * SIZE * 4], back[SIZE * SIZE * 4];
    static struct gathered g = {.room = sizeof g.bytes};
    struct groom_strands *s = tuft(1);
    struct groom_animation *animation;
    struct groom_animation_options options = {SIZE, SIZE, 3, 40};
    for (int k = 0; k < 3; k++)
        draw(s, NULL, (groom_view)k, NULL, frames[k]);
    ck_ok(groom_animation_create(&options, (struct groom_sink){gather, &g}, NULL, &animation, NULL));
    for (int k = 0; k < 3; k++) {
        ck_status(groom_animation_finish(animation, NULL), GROOM_EINVAL);
        ck_ok(groom_animation_add(animation, frames[k], NULL));
    }
    ck_status(groom_animation_add(animation, frames[0], NULL), GROOM_EINVAL);
    ck_ok(groom_animation_finish(animation, NULL));
    groom_animation_destroy(animation);
    for (int k = 0; k < 3; k++) {
        decode_frame(&g, k, back);
        ck_assert_mem_eq(back, frames[k], sizeof back);
    }
    g.n = 0;
    g.room = 2000; /* the sink fills in the middle */
    ck_ok(groom_animation_create(&options, (struct groom_sink){gather, &g}, NULL, &animation, NULL));
    ck_status(groom_animation_add(animation, frames[0], NULL), GROOM_ENOSPC);
    groom_animation_destroy(animation);
    options.frame_ms = 0;
    ck_status(groom_animation_create(&options, (struct groom_sink){gather, &g}, NULL, &animation, NULL), GROOM_EINVAL);
    groom_strands_destroy(s);
}
END_TEST

START_TEST(each_failing_allocation_of_an_animation_is_reported)
{
    static uint8_t rgba[SIZE * SIZE * 4];
    static struct gathered g = {.room = sizeof g.bytes};
    for (size_t fail_at = 0;; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom_animation *animation = NULL;
        struct groom_animation_options options = {SIZE, SIZE, 1, 40};
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        g.n = 0;
        groom_status st = groom_animation_create(&options, (struct groom_sink){gather, &g}, &context, &animation, NULL);
        if (st == GROOM_OK)
            st = groom_animation_add(animation, rgba, NULL);
        groom_animation_destroy(animation);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_assert_int_eq(st, GROOM_ENOMEM);
        ck_assert_uint_lt(fail_at, 40);
    }
}
END_TEST

START_TEST(each_failing_allocation_is_reported_and_leaks_nothing)
{
    static uint8_t rgba[SIZE * SIZE * 4];
    static struct gathered g = {.room = sizeof g.bytes};
    struct groom_strands *s = tuft(1);
    struct groom_mesh *head = ball();
    for (size_t fail_at = 0;; fail_at++) {
        struct test_failing_allocator state;
        struct groom_allocator allocator;
        struct groom_render_options options = {.size = SIZE};
        test_failing_allocator_init(&state, fail_at, &allocator);
        struct groom_context context = {.allocator = &allocator};
        groom_status st = groom_render_strands(s, head, &options, rgba, &context, NULL);
        g.n = 0;
        if (st == GROOM_OK)
            st = groom_png_write(rgba, SIZE, SIZE, (struct groom_sink){gather, &g}, &context, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        if (st == GROOM_OK)
            break;
        ck_assert_int_eq(st, GROOM_ENOMEM);
        ck_assert_uint_lt(fail_at, 100);
    }
    groom_mesh_destroy(head);
    groom_strands_destroy(s);
}
END_TEST

TEST_SUITE("render", hair_is_seen_from_every_side, the_head_hides_hair_behind_it, views_are_the_right_way_round,
           pictures_are_the_same_bits_for_1_and_3_threads, the_middle_of_a_tuft_is_darker_than_its_lit_side, odd_strands_and_options_are_answered_calmly, views_have_names,
           an_orbit_meets_the_four_views, a_placed_camera_sees_what_lies_before_it, a_turn_keeps_the_hair_in_the_picture_at_one_size,
           a_wide_picture_shows_more_at_its_sides, lights_that_stand_light_the_front_alone, cameras_that_cannot_stand_are_refused,
           each_frame_of_an_animation_decodes_to_its_pixels, each_failing_allocation_of_an_animation_is_reported,
           a_png_decodes_to_the_same_pixels, each_failing_allocation_is_reported_and_leaks_nothing)
