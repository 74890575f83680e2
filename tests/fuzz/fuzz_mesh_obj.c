/* OBJ meshes: whatever the bytes, a valid mesh or a refusal. */
#include <stdint.h>
#include <stdlib.h>

#include "groom/mesh.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct groom_memory_source state;
    struct groom_source source = groom_source_from_memory(&state, bytes, n_bytes);
    struct groom_mesh_read_options options = {.format = GROOM_MESH_OBJ, .group = n_bytes % 3 ? NULL : "body"};
    struct groom_mesh *mesh = NULL;
    if (groom_mesh_read(&source, &options, NULL, &mesh, NULL, NULL) == GROOM_OK &&
        (mesh->n_triangles == 0 || groom_mesh_validate(mesh, NULL) != GROOM_OK))
        abort();
    groom_mesh_destroy(mesh);
    return 0;
}
