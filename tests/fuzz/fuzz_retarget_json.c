/* What a retargeting is told in JSON: whatever is taken prints as text that reads back the same. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "groom/correspondence.h"
#include "groom/hairline.h"
#include "groom/skeleton.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static void fuzz_skeleton(const char *text, size_t n_bytes)
{
    struct groom_skeleton skeleton = {0}, again = {0};
    char *json;
    if (groom_skeleton_parse(text, n_bytes, &skeleton, NULL) != GROOM_OK ||
        groom_skeleton_print(&skeleton, &json, NULL) != GROOM_OK)
        return;
    if (groom_skeleton_parse(json, strlen(json), &again, NULL) != GROOM_OK || memcmp(&skeleton, &again, sizeof again) != 0)
        abort();
    free(json);
}

static void fuzz_hairline(const char *text, size_t n_bytes)
{
    static struct groom_hairline hairline, again;
    char *json;
    if (groom_hairline_parse(text, n_bytes, &hairline, NULL) != GROOM_OK || groom_hairline_print(&hairline, &json, NULL) != GROOM_OK)
        return;
    if (groom_hairline_parse(json, strlen(json), &again, NULL) != GROOM_OK || memcmp(&hairline, &again, sizeof again) != 0)
        abort();
    free(json);
}

static void fuzz_landmarks(const char *text, size_t n_bytes)
{
    static struct groom_landmarks landmarks, again;
    char *json;
    if (groom_landmarks_parse(text, n_bytes, &landmarks, NULL) != GROOM_OK || groom_landmarks_print(&landmarks, &json, NULL) != GROOM_OK)
        return;
    if (groom_landmarks_parse(json, strlen(json), &again, NULL) != GROOM_OK || memcmp(&landmarks, &again, sizeof again) != 0)
        abort();
    free(json);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    if (n_bytes) {
        fuzz_landmarks((const char *)bytes, n_bytes);
        fuzz_skeleton((const char *)bytes, n_bytes);
        fuzz_hairline((const char *)bytes, n_bytes);
    }
    return 0;
}
