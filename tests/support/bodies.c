#include "tests/support/bodies.h"

#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "groom/sample.h"
#include "tests/support/test.h"

struct groom_mesh *bodies_sample_head(void)
{
    struct groom_sample_options options;
    struct groom_sample *sample;
    struct groom_mesh *head;
    groom_sample_options_init(GROOM_SAMPLE_STRAIGHT, &options);
    options.n_strands = options.n_guides = options.n_operator_guides = 1;
    if (groom_sample_create(&options, NULL, &sample, NULL) != GROOM_OK)
        abort();
    head = sample->head;
    sample->head = NULL;
    groom_sample_destroy(sample);
    return head;
}

struct groom_mesh *bodies_shared(const char *relative, double unit_m, groom_up up, const char *group)
{
    const char *path = test_shared_data(relative);
    struct groom_mesh_read_options options = {.frame = {unit_m, up}, .group = group};
    struct groom_mesh *mesh;
    struct groom_diag diag = {0};
    if (!path)
        return NULL;
    int fd = open(path, O_RDONLY);
    struct groom_source source = groom_source_from_fd(fd);
    groom_status st = groom_mesh_read(&source, &options, NULL, &mesh, NULL, &diag);
    ck_assert_msg(st == GROOM_OK, "%s", diag.detail);
    close(fd);
    return mesh;
}

struct groom_mesh *bodies_copy(const struct groom_mesh *mesh)
{
    struct groom_mesh *copy;
    if (groom_mesh_create(mesh->n_vertices, mesh->n_triangles, mesh->n_uvs, NULL, &copy, NULL) != GROOM_OK)
        abort();
    memcpy(copy->points, mesh->points, mesh->n_vertices * sizeof *mesh->points);
    memcpy(copy->triangles, mesh->triangles, mesh->n_triangles * sizeof *mesh->triangles);
    if (mesh->n_uvs > 0) {
        memcpy(copy->uvs, mesh->uvs, mesh->n_uvs * sizeof *mesh->uvs);
        memcpy(copy->uv_triangles, mesh->uv_triangles, mesh->n_triangles * sizeof *mesh->uv_triangles);
    }
    return copy;
}

struct groom_mesh *bodies_reshaped(const struct groom_mesh *mesh, double amount)
{
    struct groom_mesh *copy = bodies_copy(mesh);
    float low[3], high[3];
    groom_mesh_bounds(mesh, low, high);
    double middle = (low[1] + high[1]) / 2, size = high[1] - low[1];
    for (uint32_t i = 0; i < mesh->n_vertices; i++) {
        const float *p = mesh->points[i];
        double up = (p[1] - middle) / size, jaw = 0.08 * exp(-20 * (up + 0.1) * (up + 0.1));
        double x = p[0] * (1 + amount * (0.06 + jaw)), z = p[2] * (1 + amount * (p[2] < 0 ? -0.04 : 0.05));
        copy->points[i][0] = (float)x;
        copy->points[i][1] = (float)(p[1] + amount * (0.05 * size * up + 0.03));
        copy->points[i][2] = (float)(z + amount * 0.004 * sin(40 * up) - amount * 0.01);
    }
    return copy;
}
