/* Whatever a checkpoint says, a fit refuses it or goes on from it to its end. The input says after how many steps a
 * checkpoint is taken, and what is then changed in its payload: so it stays one as the format moves on. Header and checksum
 * are made anew, so that the fuzzer gets past them. */
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

/* --- checkpoints to be changed ---------------------------------------------------------------- */

#define MOST_BYTES (1u << 18)

struct saved { uint8_t bytes[MOST_BYTES]; size_t n; };

static groom_status append(void *user, const void *bytes, size_t n)
{
    struct saved *saved = user;
    if (n > MOST_BYTES - saved->n)
        return GROOM_ENOMEM;
    memcpy(saved->bytes + saved->n, bytes, n);
    saved->n += n;
    return GROOM_OK;
}

/* The payload of a checkpoint after so many steps, or of the last one. */
static void take_payload(uint32_t n_steps, struct saved *payload)
{
    struct groom_fit *fit = small_fit();
    struct groom_sink sink = {append, payload};
    payload->n = 0;
    for (uint32_t k = 0; k < n_steps && !groom_fit_done(fit); k++)
        if (groom_fit_step(fit, NULL, NULL) != GROOM_OK)
            abort();
    if (groom_fit_save(fit, sink, NULL) != GROOM_OK || payload->n < sizeof(struct checkpoint_header) + sizeof(uint64_t))
        abort();
    payload->n -= sizeof(struct checkpoint_header) + sizeof(uint64_t);
    memmove(payload->bytes, payload->bytes + sizeof(struct checkpoint_header), payload->n);
    groom_fit_destroy(fit);
}

#define CHANGE_BYTES 4 /* where, two bytes; how; with what */

/* One byte, a word of it, a bit of it, or the end there. */
static void change(struct saved *payload, const uint8_t how[CHANGE_BYTES])
{
    size_t at = ((size_t)how[0] | (size_t)how[1] << 8) % (payload->n + 1), left = payload->n - at;
    switch (how[2] % 4) {
    case 0: memset(payload->bytes + at, how[3], left < 1 ? left : 1); break;
    case 1: memset(payload->bytes + at, how[3], left < 4 ? left : 4); break;
    case 2:
        if (left > 0)
            payload->bytes[at] ^= (uint8_t)(1u << how[3] % 8);
        break;
    case 3: payload->n = at; break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    static struct saved payload;
    struct groom_fit *fit = small_fit();
    take_payload(n_bytes > 0 ? bytes[0] : 0, &payload);
    for (size_t k = 1; k + CHANGE_BYTES <= n_bytes; k += CHANGE_BYTES)
        change(&payload, bytes + k);
    if (n_bytes < 1u << 20 && load(fit, payload.bytes, payload.n) == GROOM_OK)
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
