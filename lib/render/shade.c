/* Colours of hair (Kajiya and Kay 1989, with the second, coloured highlight that Marschner et al.
 * 2003 measured) and of skin, before anything is drawn: one for each segment and vertex. */
#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "groom/random.h"
#include "render/scene.h"

static const float key_light[3] = {1.55f, 1.48f, 1.36f}, rim_light[3] = {0.75f, 0.83f, 0.95f}, sky[3] = {0.60f, 0.64f, 0.70f};
static const float skin_color[3] = {0.46f, 0.33f, 0.265f};

uint32_t color_pack(const float linear[3])
{
    uint32_t packed = 0;
    for (int k = 0; k < 3; k++) {
        float value = linear[k] > 0 ? linear[k] : 0, root = sqrtf(value < 1 ? value : 1);
        packed |= (uint32_t)(root * 1023 + 0.5f) << (10 * k);
    }
    return packed;
}

void color_unpack(uint32_t packed, float linear[3])
{
    for (int k = 0; k < 3; k++) {
        float root = (float)(packed >> (10 * k) & 1023) / 1023;
        linear[k] = root * root;
    }
}

static void project(const struct render_scene *scene, const float p[3], struct render_vertex *out)
{
    double pixel[2] = {0, 0}, depth = 0;
    int seen = render_is_finite(p) && groom_camera_project(&scene->camera, p, pixel, &depth);
    out->x = seen ? (float)pixel[0] : NAN; /* a vertex without a place is not drawn */
    out->y = seen ? (float)pixel[1] : NAN;
    out->depth = (float)depth;
}

static float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void normalize(float a[3])
{
    float length = sqrtf(dot(a, a)), s = length > 0 ? 1 / length : 0;
    for (int k = 0; k < 3; k++)
        a[k] *= s;
}

/* --- hair -------------------------------------------------------------------------- */

/* What makes one strand not quite its neighbour. */
struct character {
    float color[3];
    float shift; /* of its highlights along the strand */
};

static struct character character_of(const struct render_scene *scene, uint32_t strand)
{
    const struct groom_random_key key = {0x6861697273, 0};
    float bright = 0.72f + 0.56f * groom_random_uniform(key, strand, 0), warm = 0.12f * (groom_random_uniform(key, strand, 1) - 0.5f);
    struct character c = {.shift = 0.1f * (groom_random_uniform(key, strand, 2) - 0.5f)};
    for (int k = 0; k < 3; k++)
        c.color[k] = scene->color[k] * bright * (1 + warm * (float)(1 - k));
    return c;
}

static float sine(float cosine) { return cosine * cosine < 1 ? sqrtf(1 - cosine * cosine) : 0; }

static float power16(float x)
{
    x *= x;
    x *= x;
    x *= x;
    return x * x;
}

/* One light on a segment: the diffuse part, a narrow white highlight, a broad coloured one. */
static void add_light(const struct character *c, const float tangent[3], const float towards[3], const float view[3],
                      const float light[3], float strength, float out[3])
{
    float half[3];
    for (int k = 0; k < 3; k++)
        half[k] = towards[k] + view[k];
    normalize(half);
    float across = dot(tangent, half), lit = sine(dot(tangent, towards));
    float first = power16(sine(across + 0.06f + c->shift)), second = power16(sine(across - 0.12f + c->shift));
    first *= first * first;
    first *= first;
    for (int k = 0; k < 3; k++)
        out[k] += light[k] * strength * (0.62f * lit * c->color[k] + 0.085f * first + 0.75f * second * c->color[k]);
}

static uint32_t hair_color(const struct render_scene *scene, const struct character *c, const float *p, const float *q)
{
    float tangent[3], middle[3], view[3], key, ambient, color[3];
    for (int k = 0; k < 3; k++) {
        tangent[k] = q[k] - p[k];
        middle[k] = 0.5f * (p[k] + q[k]);
        view[k] = scene->eye[k] - middle[k];
    }
    normalize(tangent);
    normalize(view);
    groom_light_at(scene->light, middle, &key, &ambient);
    float open = ambient * ambient;
    for (int k = 0; k < 3; k++)
        color[k] = sky[k] * c->color[k] * (0.06f + 0.94f * open);
    add_light(c, tangent, scene->key, view, key_light, 0.03f + 0.97f * key, color);
    add_light(c, tangent, scene->rim, view, rim_light, open * ambient, color);
    return color_pack(color);
}

static void shade_strand(const struct render_scene *scene, uint32_t strand)
{
    const struct groom_strands *s = scene->strands;
    struct character c = character_of(scene, strand);
    for (uint32_t i = s->first[strand]; i < s->first[strand + 1]; i++) {
        const float *p = s->points[i], *q = i + 1 < s->first[strand + 1] ? s->points[i + 1] : p;
        project(scene, p, &scene->hair[i]);
        if (scene->culls && scene->hair[i].depth < scene->nearest)
            scene->hair[i].x = scene->hair[i].y = NAN;
        scene->hair[i].color = render_is_finite(p) && render_is_finite(q) ? hair_color(scene, &c, p, q) : 0;
    }
}

static void pass_over(const struct render_scene *scene, uint32_t strand)
{
    for (uint32_t i = scene->strands->first[strand]; i < scene->strands->first[strand + 1]; i++)
        scene->hair[i] = (struct render_vertex){NAN, NAN, 0, 0};
}

#define STRANDS_A_PIECE 256u

static void hair_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct render_scene *scene = user;
    (void)thread;
    for (uint32_t i = piece * STRANDS_A_PIECE; i < scene->strands->n_strands && i < (piece + 1) * STRANDS_A_PIECE; i++) {
        if (i % scene->stride == 0)
            shade_strand(scene, i);
        else
            pass_over(scene, i);
    }
}

/* --- skin -------------------------------------------------------------------------- */

static void add_normals(const struct groom_mesh *mesh, float (*normals)[3])
{
    for (uint32_t t = 0; t < mesh->n_triangles; t++) {
        const uint32_t *v = mesh->triangles[t];
        float a[3], b[3];
        for (int k = 0; k < 3; k++) {
            a[k] = mesh->points[v[1]][k] - mesh->points[v[0]][k];
            b[k] = mesh->points[v[2]][k] - mesh->points[v[0]][k];
        }
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                normals[v[i]][k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
}

static void shade_skin(struct render_scene *scene, float (*normals)[3])
{
    for (uint32_t i = 0; i < scene->head->n_vertices; i++) {
        const float *p = scene->head->points[i];
        float key, ambient, color[3];
        normalize(normals[i]);
        project(scene, p, &scene->skin[i]);
        groom_light_at(scene->light, p, &key, &ambient);
        float facing = fmaxf(0, 0.75f * dot(normals[i], scene->key) + 0.25f);
        float rim = fmaxf(0, dot(normals[i], scene->rim)), above = 0.6f + 0.4f * normals[i][1];
        for (int k = 0; k < 3; k++)
            color[k] = skin_color[k] * (0.85f * key_light[k] * facing * (0.2f + 0.8f * key) + 0.25f * rim_light[k] * rim * ambient +
                                        0.5f * sky[k] * above * (0.25f + 0.75f * ambient));
        scene->skin[i].color = color_pack(color);
    }
}

groom_status render_shade(struct render_scene *scene, struct groom_diag *diag)
{
    float(*normals)[3] = NULL;
    scene->hair = memory_array(scene->allocator, scene->strands->n_vertices, sizeof *scene->hair);
    if (!scene->hair)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to draw %u vertices", scene->strands->n_vertices);
    parallel_for(scene->context, scene->strands->n_strands / STRANDS_A_PIECE + 1, hair_piece, scene);
    if (!scene->head)
        return GROOM_OK;
    scene->skin = memory_array(scene->allocator, scene->head->n_vertices, sizeof *scene->skin);
    normals = memory_array_zero(scene->allocator, scene->head->n_vertices, sizeof *normals);
    int ready = scene->skin && normals;
    if (ready) {
        add_normals(scene->head, normals);
        shade_skin(scene, normals);
    }
    memory_release(scene->allocator, normals, scene->head->n_vertices, sizeof *normals);
    return ready ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to draw the head");
}
