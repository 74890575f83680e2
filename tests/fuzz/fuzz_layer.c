/* A layer's node, as the editing endpoints take it: read onto a small groom of strands, written, read again. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "groom/document.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static struct groom *small_groom(void)
{
    struct groom_strands *strands;
    struct groom *groom;
    if (groom_strands_create(3, 9, NULL, &strands, NULL) != GROOM_OK)
        abort();
    for (uint32_t i = 0; i < 9; i++) {
        strands->first[i / 3 + 1] = 3 * (i / 3 + 1);
        strands->points[i][0] = (float)(i / 3);
        strands->points[i][1] = (float)(i % 3);
        strands->points[i][2] = 0.0f;
    }
    if (groom_create_of_strands(strands, NULL, &groom, NULL) != GROOM_OK)
        abort();
    groom_strands_destroy(strands);
    return groom;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct groom *groom = small_groom();
    char *first = NULL, *second = NULL;
    size_t n_first, n_second;
    if (groom_document_operator_read((const char *)bytes, n_bytes, NULL, groom, 0, NULL) == GROOM_OK) {
        if (groom_validate(groom, NULL) != GROOM_OK ||
            groom_document_operator_write(groom, 0, NULL, &first, &n_first, NULL) != GROOM_OK ||
            groom_remove_operator(groom, 0, NULL) != GROOM_OK ||
            groom_document_operator_read(first, n_first, NULL, groom, 0, NULL) != GROOM_OK ||
            groom_document_operator_write(groom, 0, NULL, &second, &n_second, NULL) != GROOM_OK || n_first != n_second ||
            memcmp(first, second, n_first) != 0)
            abort();
    } else if (groom->n_operators != 0) {
        abort();
    }
    free(first);
    free(second);
    groom_destroy(groom);
    return 0;
}
