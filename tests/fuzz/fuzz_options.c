/* Whatever is taken for options of a fit prints as options that are the same. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "groom/fit.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    static struct groom_fit_options options, again;
    char *json;
    if (n_bytes == 0 || groom_fit_options_parse((const char *)bytes, n_bytes, &options, NULL) != GROOM_OK)
        return 0;
    if (groom_fit_options_print(&options, &json, NULL) != GROOM_OK)
        return 0;
    if (groom_fit_options_parse(json, strlen(json), &again, NULL) != GROOM_OK ||
        memcmp(&options, &again, sizeof options) != 0)
        abort();
    free(json);
    return 0;
}
