#include "fit/visibility.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress.h"

#define LAYERS 12.0      /* times that strands cover what they are drawn on */
#define MOST_PIXELS 1024 /* of a depth buffer's side */
#define LEAST_PIXELS 48  /* of the side of the hair's box in it */
#define TOLERANCE 0.001  /* metres on an ordinary head */
#define CAMERAS_A_TIME 16u
#define MEASURED 1000u   /* strands that say how large pixels are */

struct looking {
    const struct visibility_scene *scene;
    const struct groom_camera *cameras;
    float *buffers;          /* for each thread */
    _Atomic uint32_t *seen;  /* a bit for each vertex */
};

/* A depth buffer over a camera's picture, of pixels `factor` times as wide. */
struct buffer {
    const struct groom_camera *camera;
    uint32_t width, height;
    double factor;
    float of_points[3][4]; /* takes the scene's points to (x depth, y depth, depth) */
    float of_world[3][4];  /* takes metres there */
    float *depth;
};

struct spot { float x, y, depth; }; /* pixels of the buffer; depth 0: not in front of the camera */

/* --- projecting --------------------------------------------------------------------------- */

/* K [R | t] of the buffer's pixels, of points that are to be scaled and moved first. */
static void make_matrix(const struct buffer *buffer, double scale, const double centre[3], float out[3][4])
{
    const struct groom_camera *camera = buffer->camera;
    double q[3][4];
    for (int row = 0; row < 3; row++) {
        q[row][3] = camera->translation[row];
        for (int c = 0; c < 3; c++) {
            q[row][c] = camera->rotation[3 * row + c] * scale;
            q[row][3] += camera->rotation[3 * row + c] * centre[c];
        }
    }
    for (int c = 0; c < 4; c++) {
        out[0][c] = (float)((camera->fx * q[0][c] + camera->cx * q[2][c]) / buffer->factor);
        out[1][c] = (float)((camera->fy * q[1][c] + camera->cy * q[2][c]) / buffer->factor);
        out[2][c] = (float)q[2][c];
    }
}

static void buffer_init(struct buffer *buffer, const struct visibility_scene *scene, const struct groom_camera *camera, double factor)
{
    double centre[3] = {scene->centre[0], scene->centre[1], scene->centre[2]}, none[3] = {0, 0, 0};
    buffer->camera = camera;
    buffer->factor = factor;
    buffer->width = (uint32_t)ceil(camera->width / factor);
    buffer->height = (uint32_t)ceil(camera->height / factor);
    make_matrix(buffer, scene->scale, centre, buffer->of_points);
    make_matrix(buffer, 1, none, buffer->of_world);
}

static inline struct spot project(const float m[3][4], const float p[3])
{
    float depth = m[2][0] * p[0] + m[2][1] * p[1] + m[2][2] * p[2] + m[2][3], over = 1 / depth;
    if (!(depth > 0))
        return (struct spot){0, 0, 0};
    return (struct spot){(m[0][0] * p[0] + m[0][1] * p[1] + m[0][2] * p[2] + m[0][3]) * over,
                         (m[1][0] * p[0] + m[1][1] * p[1] + m[1][2] * p[2] + m[1][3]) * over, depth};
}

static int is_inside(const struct buffer *buffer, const struct spot *spot)
{
    return spot->depth > 0 && spot->x >= 0 && spot->y >= 0 && spot->x < (float)buffer->width && spot->y < (float)buffer->height;
}

/* --- how large pixels are ------------------------------------------------------------------- */

struct extent { double length, low[2], high[2]; };

/* How much of the strands, in pixels of the picture, and where; by a part of them. */
static struct extent measure(const struct visibility_scene *scene, const struct buffer *whole)
{
    struct extent extent = {0, {INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    uint32_t stride = scene->n / MEASURED + 1;
    for (uint32_t i = 0; i < scene->n; i += stride) {
        struct spot before = {0, 0, 0};
        for (uint32_t j = 0; j < scene->m; j++) {
            struct spot here = project(whole->of_points, scene->points[(size_t)i * scene->m + j]);
            if (is_inside(whole, &here)) {
                extent.low[0] = fmin(extent.low[0], here.x);
                extent.low[1] = fmin(extent.low[1], here.y);
                extent.high[0] = fmax(extent.high[0], here.x);
                extent.high[1] = fmax(extent.high[1], here.y);
                if (j > 0 && is_inside(whole, &before))
                    extent.length += stride * sqrt((here.x - before.x) * (here.x - before.x) + (here.y - before.y) * (here.y - before.y));
            }
            before = here;
        }
    }
    return extent;
}

/* Lines of a pixel's width and this length cover an area of length * factor, each pixel factor^2. */
static double choose_factor(const struct visibility_scene *scene, const struct groom_camera *camera)
{
    struct buffer whole;
    buffer_init(&whole, scene, camera, 1);
    struct extent extent = measure(scene, &whole);
    double wide = extent.high[0] - extent.low[0], high = extent.high[1] - extent.low[1];
    double least = fmax(1, fmax(camera->width, camera->height) / (double)MOST_PIXELS);
    if (!(extent.length > 0))
        return least;
    double factor = LAYERS * wide * high / extent.length;
    return fmax(fmin(factor, fmax(wide, high) / LEAST_PIXELS), least);
}

/* --- drawing ----------------------------------------------------------------------------------- */

static void put(struct buffer *buffer, float x, float y, float depth)
{
    if (!(x >= 0 && y >= 0 && x < (float)buffer->width && y < (float)buffer->height))
        return;
    float *at = &buffer->depth[(size_t)y * buffer->width + (size_t)x];
    *at = depth < *at ? depth : *at;
}

static void draw_line(struct buffer *buffer, const struct spot *a, const struct spot *b)
{
    float dx = b->x - a->x, dy = b->y - a->y, longer = fmaxf(fabsf(dx), fabsf(dy));
    float most = 4.0f * (float)(buffer->width + buffer->height);
    if (!(a->depth > 0 && b->depth > 0 && longer < most)) /* across the lens */
        return;
    uint32_t n = (uint32_t)longer + 1;
    for (uint32_t k = 0; k <= n; k++) {
        float t = (float)k / (float)n;
        put(buffer, a->x + t * dx, a->y + t * dy, a->depth + t * (b->depth - a->depth));
    }
}

static void draw_strands(const struct visibility_scene *scene, struct buffer *buffer)
{
    for (uint32_t i = 0; i < scene->n; i++) {
        struct spot before = project(buffer->of_points, scene->points[(size_t)i * scene->m]);
        for (uint32_t j = 1; j < scene->m; j++) {
            struct spot here = project(buffer->of_points, scene->points[(size_t)i * scene->m + j]);
            draw_line(buffer, &before, &here);
            before = here;
        }
    }
}

static double edge(const struct spot *a, const struct spot *b, double x, double y)
{
    return ((double)b->x - a->x) * (y - a->y) - ((double)b->y - a->y) * (x - a->x);
}

static double lesser3(double a, double b, double c) { return fmin(a, fmin(b, c)); }
static double greater3(double a, double b, double c) { return fmax(a, fmax(b, c)); }

static void draw_triangle(struct buffer *buffer, const struct spot v[3])
{
    double area = edge(&v[0], &v[1], v[2].x, v[2].y);
    if (!(v[0].depth > 0 && v[1].depth > 0 && v[2].depth > 0) || area == 0)
        return;
    double left = fmax(floor(lesser3(v[0].x, v[1].x, v[2].x)), 0), top = fmax(floor(lesser3(v[0].y, v[1].y, v[2].y)), 0);
    double right = fmin(greater3(v[0].x, v[1].x, v[2].x), buffer->width - 1.0);
    double bottom = fmin(greater3(v[0].y, v[1].y, v[2].y), buffer->height - 1.0);
    for (double y = top; y <= bottom; y++)
        for (double x = left; x <= right; x++) {
            double w0 = edge(&v[1], &v[2], x + 0.5, y + 0.5) / area, w1 = edge(&v[2], &v[0], x + 0.5, y + 0.5) / area;
            if (w0 >= 0 && w1 >= 0 && w0 + w1 <= 1)
                put(buffer, (float)x, (float)y, (float)(w0 * v[0].depth + w1 * v[1].depth + (1 - w0 - w1) * v[2].depth));
        }
}

static void draw_head(const struct groom_mesh *head, struct buffer *buffer)
{
    for (uint32_t t = 0; t < head->n_triangles; t++) {
        struct spot v[3];
        for (int k = 0; k < 3; k++)
            v[k] = project(buffer->of_world, head->points[head->triangles[t][k]]);
        draw_triangle(buffer, v);
    }
}

/* --- looking ------------------------------------------------------------------------------------ */

static void mark_seen(const struct looking *job, const struct buffer *buffer)
{
    const struct visibility_scene *scene = job->scene;
    float tolerance = (float)TOLERANCE * scene->ordinary, pixel = 1 + (float)(buffer->factor / buffer->camera->fx);
    for (size_t v = 0; v < (size_t)scene->n * scene->m; v++) {
        struct spot spot = project(buffer->of_points, scene->points[v]);
        if (!is_inside(buffer, &spot))
            continue;
        float nearest = buffer->depth[(size_t)spot.y * buffer->width + (size_t)spot.x];
        uint32_t bit = 1u << (v % 32);
        if (spot.depth <= nearest * pixel + tolerance &&
            !(atomic_load_explicit(&job->seen[v / 32], memory_order_relaxed) & bit))
            atomic_fetch_or_explicit(&job->seen[v / 32], bit, memory_order_relaxed);
    }
}

static void look_through(void *user, uint32_t piece, uint32_t thread)
{
    const struct looking *job = user;
    const struct groom_camera *camera = &job->cameras[piece];
    struct buffer buffer = {.depth = job->buffers + (size_t)thread * MOST_PIXELS * MOST_PIXELS};
    buffer_init(&buffer, job->scene, camera, choose_factor(job->scene, camera));
    buffer.width = buffer.width < MOST_PIXELS ? buffer.width : MOST_PIXELS; /* against rounding */
    buffer.height = buffer.height < MOST_PIXELS ? buffer.height : MOST_PIXELS;
    for (size_t k = 0; k < (size_t)buffer.width * buffer.height; k++)
        buffer.depth[k] = INFINITY;
    if (job->scene->head)
        draw_head(job->scene->head, &buffer);
    draw_strands(job->scene, &buffer);
    mark_seen(job, &buffer);
}

static void count_shares(const struct looking *job, float *share)
{
    uint32_t m = job->scene->m;
    for (uint32_t i = 0; i < job->scene->n; i++) {
        uint32_t n = 0;
        for (size_t v = (size_t)i * m; v < (size_t)(i + 1) * m; v++)
            n += atomic_load_explicit(&job->seen[v / 32], memory_order_relaxed) >> (v % 32) & 1;
        share[i] = (float)n / (float)m;
    }
}

groom_status visibility_shares(const struct visibility_scene *scene, const struct groom_camera *cameras,
                               uint32_t n_cameras, float *share, const struct groom_context *context,
                               struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    size_t n_words = (size_t)scene->n * scene->m / 32 + 1;
    size_t n_depths = (size_t)parallel_threads(context) * MOST_PIXELS * MOST_PIXELS;
    struct looking job = {.scene = scene};
    groom_status st = GROOM_OK;
    job.buffers = memory_array(allocator, n_depths, sizeof *job.buffers);
    job.seen = memory_array_zero(allocator, n_words, sizeof *job.seen);
    if (!job.buffers || !job.seen)
        st = groom_fail(diag, GROOM_ENOMEM, "no memory to look at %u strands", scene->n);
    for (uint32_t first = 0; st == GROOM_OK && first < n_cameras; first += CAMERAS_A_TIME) {
        job.cameras = cameras + first;
        parallel_for(context, n_cameras - first < CAMERAS_A_TIME ? n_cameras - first : CAMERAS_A_TIME, look_through, &job);
        if (progress_cancelled(context))
            st = groom_fail(diag, GROOM_ECANCELLED, "cancelled while cameras looked at the strands");
    }
    if (st == GROOM_OK)
        count_shares(&job, share);
    memory_release(allocator, job.buffers, n_depths, sizeof *job.buffers);
    memory_release(allocator, job.seen, n_words, sizeof *job.seen);
    return st;
}
