/* Whatever a checkpoint says, a fit refuses it or goes on from it to its end. The input is the
 * payload; its header and checksums are made right here, so that the fuzzer gets past them. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "fit/checkpoint.h"
#include "base/checksum.h"
#include "fit/state.h"
#include "groom/strands.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

#define N_STRANDS 9

static struct groom_fit *small_fit(void)
{
    struct groom_strands *strands;
    struct groom_fit_options options;
    struct groom_fit *fit;
    if (groom_strands_create(N_STRANDS, 3 * N_STRANDS, NULL, &strands, NULL) != GROOM_OK)
        abort();
    for (uint32_t i = 0; i < N_STRANDS; i++)
        for (uint32_t j = 0; j < 3; j++) {
            float *p = strands->points[3 * i + j];
            p[0] = 0.01f * (float)(i % 3) + 0.002f * (float)(i * j);
            p[1] = 1.7f - 0.03f * (float)j;
            p[2] = 0.01f * (float)(i / 3);
            strands->first[i + 1] = 3 * (i + 1);
        }
    groom_fit_options_init(GROOM_FIT_DRAFT, &options);
    options.vertices = 4;
    options.guides = 4;
    options.operator_guides = 2;
    if (groom_fit_create(strands, NULL, &options, NULL, &fit, NULL) != GROOM_OK)
        abort();
    groom_strands_destroy(strands);
    return fit;
}

static groom_status load(struct groom_fit *fit, const uint8_t *payload, size_t n)
{
    struct checkpoint_header header = {.version = CHECKPOINT_VERSION, .inputs = fit->inputs, .payload_bytes = n};
    struct checksum sum = {0};
    struct groom_memory_source state;
    uint64_t checksum;
    unsigned char *file = malloc(sizeof header + n + sizeof checksum);
    if (!file)
        return GROOM_ENOMEM;
    memcpy(header.magic, "GROOMFIT", 8);
    checksum_add(&sum, payload, n);
    checksum = checksum_finish(&sum);
    memcpy(file, &header, sizeof header);
    memcpy(file + sizeof header, payload, n);
    memcpy(file + sizeof header + n, &checksum, sizeof checksum);
    struct groom_source source = groom_source_from_memory(&state, file, sizeof header + n + sizeof checksum);
    groom_status st = groom_fit_load(fit, &source, NULL, NULL);
    free(file);
    return st;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct groom_fit *fit = small_fit();
    if (n_bytes < 1u << 20 && load(fit, bytes, n_bytes) == GROOM_OK)
        while (!groom_fit_done(fit) && groom_fit_step(fit, NULL, NULL) == GROOM_OK)
            continue;
    struct groom *groom;
    char *json;
    if (groom_fit_result(fit, NULL, &groom, NULL) == GROOM_OK)
        groom_destroy(groom);
    if (groom_fit_report_print(fit, &json, NULL) == GROOM_OK)
        free(json);
    groom_fit_destroy(fit);
    return 0;
}
