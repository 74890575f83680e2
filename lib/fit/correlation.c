/* Sums of a tile of the product stay in registers over a block of rows, which stays in the cache. */
#include "fit/correlation.h"

#include <string.h>

#include "base/parallel.h"

#define BLOCK 64 /* rows: the fewer are summed at once, the less is rounded away */
#define WIDTH 8   /* one vector of AVX2 */
#define VECTORS (CORRELATION_COLUMNS / WIDTH)
#define MOST_TILES (CORRELATION_MOST / CORRELATION_COLUMNS)

typedef float vector __attribute__((vector_size(WIDTH * sizeof(float))));
struct tile { vector sum[CORRELATION_ROWS][VECTORS]; };

struct correlating {
    enum kernel_variant variant;
    const float *values;
    uint32_t n_rows, n;
    float *out;
};

#define INLINE static inline __attribute__((always_inline))

/* The last one ends with the last column, and upon a part of the one before. */
INLINE uint32_t column_of_tile(const struct correlating *job, uint32_t t)
{
    uint32_t last = job->n - CORRELATION_COLUMNS, g = t * CORRELATION_COLUMNS;
    return g < last ? g : last;
}

/* Columns f.. times columns g.. */
INLINE void add_rows(const struct correlating *job, uint32_t first, uint32_t end, uint32_t f, uint32_t g, struct tile *tile)
{
    struct tile block = {0};
    for (uint32_t i = first; i < end; i++) {
        const float *row = job->values + (size_t)i * job->n;
        vector other[VECTORS];
        memcpy(other, row + g, sizeof other);
        for (int r = 0; r < CORRELATION_ROWS; r++)
            for (int v = 0; v < VECTORS; v++)
                block.sum[r][v] += row[f + (uint32_t)r] * other[v];
    }
    for (int r = 0; r < CORRELATION_ROWS; r++)
        for (int v = 0; v < VECTORS; v++)
            tile->sum[r][v] += block.sum[r][v];
}

INLINE void correlate(const struct correlating *job, uint32_t f)
{
    struct tile tile[MOST_TILES] = {0};
    uint32_t n_tiles = (f + CORRELATION_ROWS - 1) / CORRELATION_COLUMNS + 1; /* as far as the diagonal */
    for (uint32_t first = 0; first < job->n_rows; first += BLOCK) {
        uint32_t end = job->n_rows - first < BLOCK ? job->n_rows : first + BLOCK;
        for (uint32_t t = 0; t < n_tiles; t++)
            add_rows(job, first, end, f, column_of_tile(job, t), &tile[t]);
    }
    for (uint32_t t = 0; t < n_tiles; t++)
        for (uint32_t r = 0; r < CORRELATION_ROWS; r++)
            memcpy(job->out + (size_t)(f + r) * job->n + column_of_tile(job, t), tile[t].sum[r], sizeof tile[t].sum[r]);
}

static void correlate_baseline(const struct correlating *job, uint32_t f) { correlate(job, f); }

#if defined(__x86_64__)
KERNEL_TARGET_AVX2 static void correlate_avx2(const struct correlating *job, uint32_t f) { correlate(job, f); }
#else
#define correlate_avx2 correlate_baseline
#endif

static void correlate_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct correlating *job = user;
    (void)thread;
    if (job->variant == KERNEL_AVX2)
        correlate_avx2(job, piece * CORRELATION_ROWS);
    else
        correlate_baseline(job, piece * CORRELATION_ROWS);
}

void correlation_with(enum kernel_variant variant, const float *values, uint32_t n_rows, uint32_t n, float *out,
                      const struct groom_context *context)
{
    struct correlating job = {variant, values, n_rows, n, out};
    parallel_for(context, n / CORRELATION_ROWS, correlate_piece, &job);
}

void correlation_of(const float *values, uint32_t n_rows, uint32_t n, float *out, const struct groom_context *context)
{
    correlation_with(kernel_best_variant(), values, n_rows, n, out, context);
}
