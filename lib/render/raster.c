/* The picture, in bands of rows: each is drawn by one thread with a depth buffer of its own, several
 * samples to a pixel. What lies at the same depth goes by its order, so that the bits depend on
 * nothing else. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "render/scene.h"

#define BAND_ROWS 32u      /* pixels */
#define CHUNK_VERTICES 16u /* of the strands, with the rows they touch, so that a band passes over others */

struct sample {
    float depth;
    uint32_t color;
};

struct span {
    float low, high; /* rows of samples; low > high: nothing to draw */
};

struct raster {
    const struct render_scene *scene;
    uint8_t *rgba;
    int columns;                /* samples */
    float widest;               /* hair, in samples, as drawn along an axis */
    struct span *chunks;        /* in order of the vertices, CHUNK_VERTICES each */
    struct sample *samples;     /* [threads][band_samples] */
    size_t band_samples;
};

/* One band in the making: rows top .. bottom - 1 of samples. */
struct band {
    const struct raster *raster;
    int top, bottom, columns;
    struct sample *samples;
};

static struct sample *sample_at(const struct band *band, int x, int y)
{
    return &band->samples[(size_t)(y - band->top) * (size_t)band->columns + (size_t)x];
}

static void put(struct band *band, int x, int y, float depth, uint32_t color)
{
    struct sample *sample = sample_at(band, x, y);
    if (depth < sample->depth)
        *sample = (struct sample){depth, color};
}

/* Without SSE4 the library's are calls, and these run for every segment. */
static int at_least(int a, int b) { return a > b ? a : b; }
static int at_most(int a, int b) { return a < b ? a : b; }
static float lesser(float a, float b) { return a < b ? a : b; }
static float greater(float a, float b) { return a > b ? a : b; }
static int ceiling(float x) { return (int)x + ((float)(int)x < x); }
static int below(float x) { return (int)x - ((float)(int)x > x); }

/* --- hair -------------------------------------------------------------------------- */

/* A segment as a run of short bars across it, one for each sample along its longer axis; a is the
 * upper end here. */
static void draw_steep(struct band *band, const struct render_vertex *a, const struct render_vertex *b, float width, uint32_t color)
{
    float slope = (b->x - a->x) / (b->y - a->y), fall = (b->depth - a->depth) / (b->y - a->y);
    int first = at_least(ceiling(a->y - 0.5f), band->top), end = at_most(ceiling(b->y - 0.5f), band->bottom);
    int bar = at_least(1, (int)(width + 0.5f));
    for (int y = first; y < end; y++) {
        float along = (float)y + 0.5f - a->y;
        int left = below(a->x + slope * along - 0.5f * (float)bar + 0.5f);
        for (int x = at_least(left, 0); x < left + bar && x < band->columns; x++)
            put(band, x, y, a->depth + fall * along, color);
    }
}

/* a is the left end. */
static void draw_flat(struct band *band, const struct render_vertex *a, const struct render_vertex *b, float width, uint32_t color)
{
    float slope = (b->y - a->y) / (b->x - a->x), fall = (b->depth - a->depth) / (b->x - a->x);
    int first = at_least(ceiling(a->x - 0.5f), 0), end = at_most(ceiling(b->x - 0.5f), band->columns);
    int bar = at_least(1, (int)(width + 0.5f));
    for (int x = first; x < end; x++) {
        float along = (float)x + 0.5f - a->x;
        int above = below(a->y + slope * along - 0.5f * (float)bar + 0.5f);
        for (int y = at_least(above, band->top); y < above + bar && y < band->bottom; y++)
            put(band, x, y, a->depth + fall * along, color);
    }
}

static void draw_segment(struct band *band, const struct render_vertex *a, const struct render_vertex *b, float width)
{
    float dx = fabsf(b->x - a->x), dy = fabsf(b->y - a->y), longer = greater(dx, dy);
    if (!(longer > 0))
        return;
    width *= sqrtf(dx * dx + dy * dy) / longer; /* the bars lie along an axis, not across the segment */
    if (dy >= dx)
        draw_steep(band, a->y <= b->y ? a : b, a->y <= b->y ? b : a, width, a->color);
    else
        draw_flat(band, a->x <= b->x ? a : b, a->x <= b->x ? b : a, width, a->color);
}

static float width_in_samples(const struct render_scene *scene, float depth)
{
    return scene->width * (float)scene->camera.fx / depth;
}

/* The segments that begin at vertices first .. end - 1 of one strand. */
static void draw_run(struct band *band, uint32_t first, uint32_t end, uint32_t strand_end)
{
    const struct render_scene *scene = band->raster->scene;
    for (uint32_t i = first; i < end && i + 1 < strand_end; i++) {
        const struct render_vertex *a = &scene->hair[i], *b = a + 1;
        if (isnan(a->y) || isnan(b->y))
            continue;
        float reach = band->raster->widest + 1;
        if (greater(a->y, b->y) + reach >= (float)band->top && lesser(a->y, b->y) - reach <= (float)band->bottom)
            draw_segment(band, a, b, width_in_samples(scene, 0.5f * (a->depth + b->depth)));
    }
}

static uint32_t chunk_of(uint32_t vertex) { return vertex / CHUNK_VERTICES; }

static void draw_hair(struct band *band)
{
    const struct groom_strands *s = band->raster->scene->strands;
    for (uint32_t strand = 0; strand < s->n_strands; strand += band->raster->scene->stride) {
        uint32_t end = s->first[strand + 1];
        for (uint32_t i = s->first[strand], next; i < end; i = next) {
            const struct span *span = &band->raster->chunks[chunk_of(i)];
            next = (chunk_of(i) + 1) * CHUNK_VERTICES;
            next = next < end ? next : end;
            if (span->high >= (float)band->top && span->low <= (float)band->bottom)
                draw_run(band, i, next, end);
        }
    }
}

/* Rows that a chunk's segments may touch; the first vertex of the next chunk belongs to it too. */
static void span_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct raster *raster = user;
    const struct render_scene *scene = raster->scene;
    uint32_t n = scene->strands->n_vertices, first = piece * RENDER_PIECE;
    (void)thread;
    for (uint32_t v = first; v < n && v < first + RENDER_PIECE; v += CHUNK_VERTICES) {
        struct span span = {INFINITY, -INFINITY};
        for (uint32_t i = v; i < n && i <= v + CHUNK_VERTICES; i++) {
            if (isnan(scene->hair[i].y))
                continue;
            span.low = lesser(span.low, scene->hair[i].y - raster->widest - 1);
            span.high = greater(span.high, scene->hair[i].y + raster->widest + 1);
        }
        raster->chunks[chunk_of(v)] = span;
    }
}

/* --- skin -------------------------------------------------------------------------- */

static float edge(const struct render_vertex *a, const struct render_vertex *b, float x, float y)
{
    return (b->x - a->x) * (y - a->y) - (b->y - a->y) * (x - a->x);
}

static uint32_t blend_colors(const struct render_vertex *const v[3], const float w[3])
{
    float sum[3] = {0, 0, 0};
    for (int i = 0; i < 3; i++) {
        float c[3];
        color_unpack(v[i]->color, c);
        for (int k = 0; k < 3; k++)
            sum[k] += w[i] * c[k];
    }
    return color_pack(sum);
}

static void draw_triangle(struct band *band, const struct render_vertex *const v[3])
{
    float area = edge(v[0], v[1], v[2]->x, v[2]->y), low[2], high[2];
    low[0] = fminf(v[0]->x, fminf(v[1]->x, v[2]->x));
    high[0] = fmaxf(v[0]->x, fmaxf(v[1]->x, v[2]->x));
    low[1] = fminf(v[0]->y, fminf(v[1]->y, v[2]->y));
    high[1] = fmaxf(v[0]->y, fmaxf(v[1]->y, v[2]->y));
    if (area == 0 || isnan(area) || high[1] < (float)band->top || low[1] > (float)band->bottom || high[0] < 0 || low[0] > (float)band->columns)
        return;
    int top = at_least((int)fmaxf(low[1], 0), band->top), bottom = at_most((int)fminf(high[1], (float)band->bottom) + 1, band->bottom);
    int left = (int)fmaxf(low[0], 0), right = at_most((int)fminf(high[0], (float)band->columns) + 1, band->columns);
    for (int y = top; y < bottom; y++)
        for (int x = left; x < right; x++) {
            float cx = (float)x + 0.5f, cy = (float)y + 0.5f;
            float w[3] = {edge(v[1], v[2], cx, cy) / area, edge(v[2], v[0], cx, cy) / area, edge(v[0], v[1], cx, cy) / area};
            float depth = w[0] * v[0]->depth + w[1] * v[1]->depth + w[2] * v[2]->depth;
            if (w[0] >= 0 && w[1] >= 0 && w[2] >= 0 && depth < sample_at(band, x, y)->depth)
                put(band, x, y, depth, blend_colors(v, w));
        }
}

static void draw_skin(struct band *band)
{
    const struct render_scene *scene = band->raster->scene;
    for (uint32_t t = 0; scene->head && t < scene->head->n_triangles; t++) {
        const uint32_t *i = scene->head->triangles[t];
        const struct render_vertex *const v[3] = {&scene->skin[i[0]], &scene->skin[i[1]], &scene->skin[i[2]]};
        draw_triangle(band, v);
    }
}

/* --- pixels ------------------------------------------------------------------------ */

static uint8_t to_srgb(float linear)
{
    float s = linear <= 0.0031308f ? 12.92f * linear : 1.055f * powf(linear, 1 / 2.4f) - 0.055f;
    return (uint8_t)(fminf(1, fmaxf(0, s)) * 255 + 0.5f);
}

/* A studio backdrop: lighter behind the head than at the edges. */
static uint32_t backdrop(const struct raster *raster, uint32_t x, uint32_t y)
{
    static const float middle[3] = {0.60f, 0.62f, 0.65f}, outside[3] = {0.27f, 0.29f, 0.32f};
    float color[3];
    float u = ((float)x + 0.5f) / (float)raster->scene->width_px - 0.5f, v = ((float)y + 0.5f) / (float)raster->scene->height_px - 0.45f;
    float t = fminf(1, 1.9f * (u * u + v * v));
    for (int k = 0; k < 3; k++)
        color[k] = middle[k] + (outside[k] - middle[k]) * t;
    return color_pack(color);
}

static void resolve_pixel(const struct band *band, uint32_t x, uint32_t y, uint8_t out[4])
{
    uint32_t samples = band->raster->scene->samples;
    float sum[3] = {0, 0, 0};
    for (uint32_t j = 0; j < samples; j++)
        for (uint32_t i = 0; i < samples; i++) {
            float color[3];
            color_unpack(sample_at(band, (int)(x * samples + i), (int)(y * samples + j))->color, color);
            for (int k = 0; k < 3; k++)
                sum[k] += color[k];
        }
    for (int k = 0; k < 3; k++)
        out[k] = to_srgb(sum[k] / (float)(samples * samples));
    out[3] = 255;
}

static void clear_pixel(struct band *band, uint32_t x, uint32_t y)
{
    uint32_t samples = band->raster->scene->samples, color = backdrop(band->raster, x, y);
    for (uint32_t j = 0; j < samples; j++)
        for (uint32_t i = 0; i < samples; i++)
            *sample_at(band, (int)(x * samples + i), (int)(y * samples + j)) = (struct sample){INFINITY, color};
}

static void band_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct raster *raster = user;
    const struct render_scene *scene = raster->scene;
    uint32_t top = piece * BAND_ROWS, bottom = top + BAND_ROWS < scene->height_px ? top + BAND_ROWS : scene->height_px;
    struct band band = {.raster = raster, .top = (int)(top * scene->samples), .bottom = (int)(bottom * scene->samples),
                        .columns = raster->columns, .samples = raster->samples + thread * raster->band_samples};
    for (uint32_t y = top; y < bottom; y++)
        for (uint32_t x = 0; x < scene->width_px; x++)
            clear_pixel(&band, x, y);
    draw_skin(&band);
    draw_hair(&band);
    for (uint32_t y = top; y < bottom; y++)
        for (uint32_t x = 0; x < scene->width_px; x++)
            resolve_pixel(&band, x, y, raster->rgba + ((size_t)y * scene->width_px + x) * 4);
}

groom_status render_raster(struct render_scene *scene, uint8_t *rgba, struct groom_diag *diag)
{
    struct raster raster = {.scene = scene, .rgba = rgba, .columns = (int)(scene->width_px * scene->samples)};
    uint32_t n = scene->strands->n_vertices, n_threads = parallel_threads(scene->context);
    size_t n_chunks = (size_t)chunk_of(n) + 1;
    raster.band_samples = (size_t)raster.columns * BAND_ROWS * scene->samples;
    raster.chunks = memory_array(scene->allocator, n_chunks, sizeof *raster.chunks);
    raster.samples = memory_array(scene->allocator, raster.band_samples * n_threads, sizeof *raster.samples);
    raster.widest = 1.5f * width_in_samples(scene, scene->nearest);
    int ready = raster.chunks && raster.samples;
    if (ready) {
        parallel_for(scene->context, n / RENDER_PIECE + 1, span_piece, &raster);
        parallel_for(scene->context, (scene->height_px + BAND_ROWS - 1) / BAND_ROWS, band_piece, &raster);
    }
    memory_release(scene->allocator, raster.chunks, n_chunks, sizeof *raster.chunks);
    memory_release(scene->allocator, raster.samples, raster.band_samples * n_threads, sizeof *raster.samples);
    return ready ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for a picture of %u x %u pixels", scene->width_px, scene->height_px);
}
