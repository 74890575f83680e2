/* Reading and writing strands on one core, in memory: each beside something in the same run.
 * Times are processor time of the thread, so that what else the machine does is not measured. */
#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "groom/format.h"
#include "tests/support/strand_files.h"

enum { N_STRANDS = 20000, M = 100, ROUNDS = 3 };

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void require(groom_status status, const char *what)
{
    if (status == GROOM_OK)
        return;
    fprintf(stderr, "bench_formats: %s: %s\n", what, groom_status_name(status));
    exit(1);
}

/* Curls at a head's height, 24 MB of points. */
static struct groom_strands *make_strands(void)
{
    struct groom_strands *strands;
    require(groom_strands_create(N_STRANDS, (uint64_t)N_STRANDS * M, NULL, &strands, NULL), "strands");
    for (uint32_t i = 0; i < N_STRANDS; i++) {
        strands->first[i + 1] = (i + 1) * M;
        for (uint32_t k = 0; k < M; k++) {
            float *x = strands->points[i * M + k], t = 0.1f * (float)k;
            x[0] = 0.1f * sinf((float)i) + 0.005f * cosf(t);
            x[1] = 1.7f - 0.002f * (float)k;
            x[2] = 0.1f * cosf((float)i) + 0.005f * sinf(t);
        }
    }
    return strands;
}

/* --- sinks ----------------------------------------------------------------------------- */

struct counter {
    unsigned char *out; /* room for the whole file */
    size_t n;
};

static groom_status copy_bytes(void *user, const void *bytes, size_t n)
{
    struct counter *counter = user;
    memcpy(counter->out + counter->n, bytes, n);
    counter->n += n;
    return GROOM_OK;
}

static double write_seconds(const struct groom_strands *strands, const struct groom_write_options *options,
                            struct counter *counter)
{
    double best = INFINITY;
    for (int round = 0; round < ROUNDS; round++) {
        double start = seconds();
        counter->n = 0;
        require(groom_strands_write(strands, options, (struct groom_sink){copy_bytes, counter}, NULL, NULL),
                "write");
        best = fmin(best, seconds() - start);
    }
    return best;
}

static double read_seconds(const unsigned char *bytes, size_t n)
{
    double best = INFINITY;
    for (int round = 0; round < ROUNDS; round++) {
        struct groom_strands *strands;
        double start = seconds();
        require(test_read(bytes, n, 0, NULL, NULL, &strands, NULL, NULL), "read");
        best = fmin(best, seconds() - start);
        groom_strands_destroy(strands);
    }
    return best;
}

/* memcpy of the same bytes: nothing that moves them can be faster */
static double copy_seconds(unsigned char *out, const unsigned char *bytes, size_t n)
{
    double best = INFINITY;
    for (int round = 0; round < ROUNDS; round++) {
        double start = seconds();
        memcpy(out, bytes, n);
        best = fmin(best, seconds() - start);
    }
    return best;
}

/* --- JSON beside cJSON -------------------------------------------------------------------- */

/* The first strands alone: cJSON takes 40 times the memory. */
static double cjson_mb_per_s(const unsigned char *bytes, size_t n)
{
    size_t cut = n < 4000000 ? n - 5 : 4000000;
    char *text = malloc(cut + 8);
    while (memcmp(bytes + cut, "\n[[", 3) != 0)
        cut--;
    memcpy(text, bytes, cut - 1); /* without the comma between strands */
    memcpy(text + cut - 1, "]}", 3);
    double start = seconds();
    cJSON *parsed = cJSON_Parse(text);
    double spent = seconds() - start;
    if (!parsed)
        require(GROOM_EINTERNAL, "cJSON");
    cJSON_Delete(parsed);
    free(text);
    return (double)cut * 1e-6 / spent;
}

static void bench_format(const struct groom_strands *strands, groom_format format, struct counter *counter,
                         unsigned char *spare)
{
    struct groom_write_options options = {.format = format},
                               converted = {.format = format, .frame = {0.01, GROOM_UP_Z}};
    const char *name = groom_format_name(format);
    double in_cm = write_seconds(strands, &converted, counter);
    double spent = write_seconds(strands, &options, counter), mb = (double)counter->n * 1e-6;
    double copy = copy_seconds(spare, counter->out, counter->n);
    printf("figure %s_write_mb_per_s %.0f MB/s %.2f of memcpy's speed; in cm and z up %.0f MB/s\n", name,
           mb / spent, copy / spent, mb / in_cm);
    if (!groom_format_readable(format))
        return;
    double read = read_seconds(counter->out, counter->n);
    if (format == GROOM_FORMAT_JSON) {
        double other = cjson_mb_per_s(counter->out, counter->n);
        printf(
            "figure json_parse_mb_per_s %.0f MB/s %.1f times cJSON's %.0f MB/s; %.1f M vertices a second\n",
            mb / read, mb / read / other, other, N_STRANDS * M * 1e-6 / read);
    } else {
        printf("figure %s_read_mb_per_s %.0f MB/s %.2f of memcpy's speed\n", name, mb / read, copy / read);
    }
}

int main(void)
{
    static const groom_format formats[] = {GROOM_FORMAT_HAIR, GROOM_FORMAT_DATA, GROOM_FORMAT_PLY,
                                           GROOM_FORMAT_OBJ,  GROOM_FORMAT_JSON, GROOM_FORMAT_USDA};
    struct groom_strands *strands = make_strands();
    size_t room = (size_t)strands->n_vertices * 64;
    struct counter counter = {malloc(room), 0};
    unsigned char *spare = malloc(room);
    if (!counter.out || !spare)
        return 1;
    memset(counter.out, 1, room); /* pages there, so that faults are not measured */
    memset(spare, 1, room);
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++)
        bench_format(strands, formats[i], &counter, spare);
    groom_strands_destroy(strands);
    free(counter.out);
    free(spare);
    return 0;
}
