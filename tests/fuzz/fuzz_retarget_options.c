/* Options that are taken print, and what was printed is taken as the same. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "groom/retarget.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct groom_retarget_options options, again;
    struct groom_diag diag;
    char *text;
    if (groom_retarget_options_parse((const char *)bytes, n_bytes, &options, &diag) != GROOM_OK)
        return 0;
    if (groom_retarget_options_print(&options, &text, NULL) != GROOM_OK)
        return 0;
    if (groom_retarget_options_parse(text, strlen(text), &again, NULL) != GROOM_OK || memcmp(&again, &options, sizeof again) != 0)
        abort();
    free(text);
    return 0;
}
