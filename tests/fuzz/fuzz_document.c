/* The groom document's reader: no crash, and what it takes it writes back to the same text. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "groom/document.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct groom *groom = NULL, *again = NULL;
    char *first, *second;
    size_t n_first, n_second;
    if (groom_document_read((const char *)bytes, n_bytes, NULL, NULL, &groom, NULL) != GROOM_OK)
        return 0;
    if (groom_document_write(groom, NULL, NULL, &first, &n_first, NULL) != GROOM_OK)
        abort();
    if (groom_document_read(first, n_first, NULL, NULL, &again, NULL) != GROOM_OK)
        abort();
    if (groom_document_write(again, NULL, NULL, &second, &n_second, NULL) != GROOM_OK)
        abort();
    if (n_first != n_second || memcmp(first, second, n_first) != 0)
        abort();
    free(first);
    free(second);
    groom_destroy(groom);
    groom_destroy(again);
    return 0;
}
