/* Whatever a prepared source says, it is refused or carries strands to the end. The input is the payload; its
 * header and checksum are made right here, so that the fuzzer gets past them. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/checksum.h"
#include "retarget/source.h"
#include "retarget/store.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

#define N_STRANDS 6
#define N_VERTICES 4

/* A tetrahedron with hair on it. */
static struct groom_mesh *tetrahedron(float size)
{
    static const float corners[4][3] = {{0, 1, 0}, {-1, -1, 1}, {1, -1, 1}, {0, -1, -1}};
    static const uint32_t faces[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    struct groom_mesh *mesh;
    if (groom_mesh_create(4, 4, 0, NULL, &mesh, NULL) != GROOM_OK)
        abort();
    memcpy(mesh->triangles, faces, sizeof faces);
    for (int i = 0; i < 4; i++)
        for (int c = 0; c < 3; c++)
            mesh->points[i][c] = size * corners[i][c];
    return mesh;
}

static struct groom_strands *hair(void)
{
    struct groom_strands *strands;
    if (groom_strands_create(N_STRANDS, N_STRANDS * N_VERTICES, NULL, &strands, NULL) != GROOM_OK)
        abort();
    for (uint32_t i = 0; i < N_STRANDS; i++) {
        strands->first[i + 1] = N_VERTICES * (i + 1);
        for (uint32_t j = 0; j < N_VERTICES; j++) {
            float *p = strands->points[N_VERTICES * i + j];
            p[0] = 0.01f * (float)i - 0.02f + 0.003f * (float)j;
            p[1] = 0.05f + 0.02f * (float)j;
            p[2] = 0.01f * (float)(i % 2);
        }
    }
    return strands;
}

static groom_status load(const struct groom_strands *strands, const struct groom_mesh *body, const struct groom_skeleton *skeleton,
                         const struct groom_retarget_options *options, const uint8_t *payload, size_t n,
                         struct groom_retarget_source **source)
{
    struct store_header header = {.version = STORE_VERSION, .payload_bytes = n};
    struct checksum sum = {0};
    struct groom_memory_source state;
    struct groom_retarget_source *empty;
    unsigned char *file = malloc(sizeof header + n + sizeof(uint64_t));
    if (!file || source_init(&empty, strands, body, skeleton, NULL, options, NULL, NULL) != GROOM_OK)
        abort();
    header.inputs = empty->inputs;
    groom_retarget_source_destroy(empty);
    memcpy(header.magic, STORE_MAGIC, sizeof header.magic);
    memcpy(file, &header, sizeof header);
    if (n > 0)
        memcpy(file + sizeof header, payload, n);
    checksum_add(&sum, file + sizeof header, n);
    uint64_t checksum = checksum_finish(&sum);
    memcpy(file + sizeof header + n, &checksum, sizeof checksum);
    struct groom_source bytes = groom_source_from_memory(&state, file, sizeof header + n + sizeof checksum);
    groom_status st = groom_retarget_source_load(&bytes, strands, body, skeleton, NULL, options, NULL, source, NULL);
    free(file);
    return st;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct groom_mesh *body = tetrahedron(0.1f), *other = tetrahedron(0.12f);
    struct groom_strands *strands = hair();
    struct groom_skeleton skeleton = {1, {{"head", {0, -0.05f, 0}, {0, 0.02f, 0}}}};
    struct groom_retarget_target target = {other, &skeleton, NULL};
    struct groom_retarget_options options;
    struct groom_retarget_source *source;
    float out[N_STRANDS * N_VERTICES][3];
    groom_retarget_options_init(&options);
    options.guides = 2;
    options.neighbours = 2;
    options.iterations = 2;
    if (n_bytes < 1u << 16 && load(strands, body, &skeleton, &options, bytes, n_bytes, &source) == GROOM_OK) {
        (void)!groom_retarget_run(source, &target, &options, NULL, out, NULL, NULL, NULL);
        groom_retarget_source_destroy(source);
    }
    groom_strands_destroy(strands);
    groom_mesh_destroy(body);
    groom_mesh_destroy(other);
    return 0;
}
