#include <stdarg.h>
#include <stdio.h>

#include "groom/mesh.h"

/* Text gathered into one write for every few thousand lines. */
struct text {
    char bytes[1 << 16];
    size_t n;
    struct groom_sink sink;
    groom_status status;
};

static void flush(struct text *text)
{
    if (text->status == GROOM_OK && text->n)
        text->status = text->sink.write(text->sink.user, text->bytes, text->n);
    text->n = 0;
}

__attribute__((format(printf, 2, 3))) static void put(struct text *text, const char *format, ...)
{
    va_list arguments;
    if (sizeof text->bytes - text->n < 256)
        flush(text);
    va_start(arguments, format);
    text->n += (size_t)vsnprintf(text->bytes + text->n, sizeof text->bytes - text->n, format, arguments);
    va_end(arguments);
}

static void put_face(struct text *text, const struct groom_mesh *mesh, uint32_t i)
{
    const uint32_t *v = mesh->triangles[i];
    if (mesh->n_uvs) {
        const uint32_t *t = mesh->uv_triangles[i];
        put(text, "f %u/%u %u/%u %u/%u\n", v[0] + 1, t[0] + 1, v[1] + 1, t[1] + 1, v[2] + 1, t[2] + 1);
    } else {
        put(text, "f %u %u %u\n", v[0] + 1, v[1] + 1, v[2] + 1);
    }
}

groom_status groom_mesh_write_obj(const struct groom_mesh *mesh, struct groom_frame frame, struct groom_sink sink,
                                  struct groom_diag *diag)
{
    struct text text = {.sink = sink, .status = GROOM_OK};
    for (uint32_t i = 0; i < mesh->n_vertices && text.status == GROOM_OK; i++) {
        float p[3];
        groom_frame_from_metres(frame, mesh->points[i], p);
        put(&text, "v %.9g %.9g %.9g\n", p[0], p[1], p[2]);
    }
    for (uint32_t i = 0; i < mesh->n_uvs && text.status == GROOM_OK; i++)
        put(&text, "vt %.9g %.9g\n", mesh->uvs[i][0], mesh->uvs[i][1]);
    for (uint32_t i = 0; i < mesh->n_triangles && text.status == GROOM_OK; i++)
        put_face(&text, mesh, i);
    flush(&text);
    if (text.status != GROOM_OK)
        return groom_fail(diag, text.status, "writing the mesh: %s", groom_status_message(text.status));
    return GROOM_OK;
}
