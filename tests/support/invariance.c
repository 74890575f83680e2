#include "tests/support/invariance.h"

#include <math.h>

#include "groom/format.h"
#include "groom/mesh.h"
#include "groom/strands.h"
#include "tests/support/known.h"
#include "tests/support/strand_files.h"

const double invariance_as_it_is[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const double invariance_upright[3][3] = {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}};
const double invariance_slanted[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};

/* --- uploads ----------------------------------------------------------------------------------- */

static void upload_strands(struct groom_sample *sample, struct groom_frame frame)
{
    struct groom_write_options write = {.format = GROOM_FORMAT_DATA, .frame = frame};
    struct groom_read_options read = {.format = GROOM_FORMAT_DATA, .frame = frame};
    struct groom_context context = {.allocator = sample->allocator};
    struct test_bytes file = {0};
    struct groom_strands *strands;
    struct groom_read_report report;
    struct groom_diag diag = {0};
    known_must(groom_strands_write(sample->capture, &write, (struct groom_sink){test_sink_write, &file}, &context, &diag), &diag);
    known_must(test_read(file.bytes, file.n, 0, &read, &context, &strands, &report, &diag), &diag);
    groom_strands_destroy(sample->capture);
    sample->capture = strands;
    test_bytes_finish(&file);
}

static void upload_head(struct groom_sample *sample, struct groom_frame frame)
{
    struct groom_mesh_read_options read = {.frame = frame};
    struct groom_context context = {.allocator = sample->allocator};
    struct test_bytes file = {0};
    struct groom_memory_source memory;
    struct groom_mesh *head;
    struct groom_mesh_read_report report;
    struct groom_diag diag = {0};
    known_must(groom_mesh_write_obj(sample->head, frame, (struct groom_sink){test_sink_write, &file}, &diag), &diag);
    struct groom_source source = groom_source_from_memory(&memory, file.bytes, file.n);
    known_must(groom_mesh_read(&source, &read, &context, &head, &report, &diag), &diag);
    groom_mesh_destroy(sample->head);
    sample->head = head;
    test_bytes_finish(&file);
}

void invariance_upload(struct groom_sample *sample, struct groom_frame frame)
{
    upload_strands(sample, frame);
    upload_head(sample, frame);
}

/* --- turns ------------------------------------------------------------------------------------- */

void invariance_turn_points(float (*x)[3], size_t n, const double r[3][3])
{
    for (size_t v = 0; v < n; v++) {
        double p[3] = {(double)x[v][0], (double)x[v][1], (double)x[v][2]};
        for (int c = 0; c < 3; c++)
            x[v][c] = (float)(r[c][0] * p[0] + r[c][1] * p[1] + r[c][2] * p[2]);
    }
}

void invariance_turn(struct groom_sample *sample, const double r[3][3])
{
    invariance_turn_points(sample->capture->points, sample->capture->n_vertices, r);
    invariance_turn_points(sample->head->points, sample->head->n_vertices, r);
}

double invariance_degrees(const double a[3][3], const double b[3][3])
{
    double trace = 0;
    for (int k = 0; k < 9; k++)
        trace += a[k / 3][k % 3] * b[k / 3][k % 3];
    return acos(fmin(fmax((trace - 1) / 2, -1), 1)) * 180 / acos(-1);
}
