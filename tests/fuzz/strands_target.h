/* The body of every strand reader's fuzz target: bytes in, and the same answer each time, whole or
 * in pieces from a source that does not know its size. */
#ifndef FUZZ_STRANDS_TARGET_H
#define FUZZ_STRANDS_TARGET_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "groom/format.h"

struct fuzz_answer {
    groom_status status;
    struct groom_strands *strands;
    struct groom_read_report report;
    struct groom_diag diag;
};

struct fuzz_pieces {
    struct groom_memory_source memory;
    struct groom_source source;
};

static int64_t fuzz_read_piece(void *user, void *buffer, size_t capacity)
{
    struct fuzz_pieces *pieces = user;
    return pieces->source.read(pieces->source.user, buffer, capacity < 61 ? capacity : 61);
}

static struct fuzz_answer fuzz_read(groom_format format, const uint8_t *bytes, size_t n, int in_pieces)
{
    /* centimetres and z up, so that both conversions run; a limit that keeps the fuzzer quick */
    struct groom_read_options options = {format, {0.01, GROOM_UP_Z}, 1u << 20};
    struct fuzz_answer answer = {.strands = NULL};
    struct fuzz_pieces pieces;
    pieces.source = groom_source_from_memory(&pieces.memory, bytes, n);
    struct groom_source slow = {fuzz_read_piece, &pieces, -1};
    answer.status = groom_strands_read(in_pieces ? &slow : &pieces.source, &options, NULL, &answer.strands,
                                       &answer.report, &answer.diag);
    return answer;
}

static void fuzz_check(int condition)
{
    if (!condition)
        abort();
}

/* What every caller relies on. */
static void fuzz_check_answer(const struct fuzz_answer *answer)
{
    const struct groom_strands *strands = answer->strands;
    fuzz_check((answer->status == GROOM_OK) == (strands != NULL));
    if (!strands) {
        fuzz_check(answer->diag.status == answer->status && answer->diag.detail[0] &&
                   answer->diag.byte_offset >= 0);
        return;
    }
    fuzz_check(strands->n_strands > 0 && strands->first[0] == 0 &&
               strands->first[strands->n_strands] == strands->n_vertices);
    for (uint32_t i = 0; i < strands->n_strands; i++)
        fuzz_check(strands->first[i + 1] >= strands->first[i] + 2 &&
                   groom_polyline_length((const float(*)[3])(strands->points + strands->first[i]),
                                         strands->first[i + 1] - strands->first[i]) > 0);
    for (uint32_t i = 0; i < strands->n_vertices; i++)
        for (int k = 0; k < 3; k++)
            fuzz_check(isfinite(strands->points[i][k]));
    for (uint32_t i = 0; strands->root_uv && i < strands->n_strands; i++)
        fuzz_check(isfinite(strands->root_uv[i][0]) && isfinite(strands->root_uv[i][1]));
}

static void fuzz_check_same(const struct fuzz_answer *a, const struct fuzz_answer *b)
{
    fuzz_check(a->status == b->status && strcmp(a->diag.detail, b->diag.detail) == 0);
    fuzz_check(memcmp(&a->report, &b->report, sizeof a->report) == 0);
    if (a->strands)
        fuzz_check(
            a->strands->n_vertices == b->strands->n_vertices &&
            memcmp(a->strands->points, b->strands->points, a->strands->n_vertices * sizeof(float[3])) == 0);
}

static int fuzz_strands(groom_format format, const uint8_t *bytes, size_t n)
{
    struct fuzz_answer answers[3];
    for (int i = 0; i < 3; i++) {
        answers[i] = fuzz_read(format, bytes, n, i == 2);
        fuzz_check_answer(&answers[i]);
    }
    fuzz_check_same(&answers[0], &answers[1]);
    /* Without a size some counts are believed a little longer; strands, once read, are the same. */
    if (answers[0].status == GROOM_OK && answers[2].status == GROOM_OK &&
        answers[0].report.format == answers[2].report.format)
        fuzz_check(answers[0].strands->n_vertices == answers[2].strands->n_vertices);
    for (int i = 0; i < 3; i++)
        groom_strands_destroy(answers[i].strands);
    return 0;
}

#define FUZZ_STRANDS(format)                                                                                 \
    int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);                                        \
    int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)                                         \
    {                                                                                                        \
        return fuzz_strands(format, bytes, n_bytes);                                                         \
    }

#endif
