/* Animated PNG, chunk by chunk: a still PNG (IHDR, IDAT, IEND) with chunks around its picture that say that more
 * are to come (acTL), how long each is shown (fcTL), and the others (fdAT). See the PNG specification, third
 * edition, 5.13; libpng as packaged writes none of it. */
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/memory.h"
#include "groom/render.h"

#define LEVEL 6
#define N_FILTERS 5

struct groom_animation {
    struct groom_animation_options options;
    struct groom_sink sink;
    const struct groom_allocator *allocator;
    uint32_t n_added, sequence;
    size_t row_bytes, n_packed;     /* row_bytes: without its filter's byte */
    uint8_t *rows;                  /* [2][row_bytes]: the row before and this one */
    uint8_t *tries;                 /* [N_FILTERS][1 + row_bytes] */
    uint8_t *packed;                /* [n_packed] a frame's compressed rows */
};

static void put_u32(uint8_t *at, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> (24 - 8 * i));
}

static void put_u16(uint8_t *at, uint32_t value)
{
    at[0] = (uint8_t)(value >> 8);
    at[1] = (uint8_t)value;
}

/* --- chunks -------------------------------------------------------------------------------- */

/* Some chunks begin with a few bytes that do not stand with the others: `lead`. */
static groom_status put_chunk(const struct groom_animation *a, const char type[4], const uint8_t *lead, size_t n_lead,
                              const uint8_t *bytes, size_t n_bytes)
{
    uint8_t head[8], tail[4];
    put_u32(head, (uint32_t)(n_lead + n_bytes));
    memcpy(head + 4, type, 4);
    uLong crc = crc32(0, head + 4, 4);
    if (n_lead)
        crc = crc32(crc, lead, (uInt)n_lead);
    if (n_bytes)
        crc = crc32(crc, bytes, (uInt)n_bytes);
    put_u32(tail, (uint32_t)crc);
    const struct { const void *at; size_t n; } parts[] = {{head, 8}, {lead, n_lead}, {bytes, n_bytes}, {tail, 4}};
    for (size_t i = 0; i < 4; i++) {
        groom_status st = parts[i].n ? a->sink.write(a->sink.user, parts[i].at, parts[i].n) : GROOM_OK;
        if (st != GROOM_OK)
            return st;
    }
    return GROOM_OK;
}

static groom_status put_begin(const struct groom_animation *a)
{
    static const uint8_t signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'}, perceptual[1] = {0};
    uint8_t header[13] = {0}, control[8] = {0};
    put_u32(header, a->options.width);
    put_u32(header + 4, a->options.height);
    header[8] = 8; /* bits a channel */
    header[9] = 2; /* red, green, blue */
    put_u32(control, a->options.n_frames); /* then 0: for ever */
    groom_status st = a->sink.write(a->sink.user, signature, sizeof signature);
    if (st == GROOM_OK)
        st = put_chunk(a, "IHDR", header, sizeof header, NULL, 0);
    if (st == GROOM_OK)
        st = put_chunk(a, "sRGB", perceptual, sizeof perceptual, NULL, 0);
    return st == GROOM_OK ? put_chunk(a, "acTL", control, sizeof control, NULL, 0) : st;
}

static groom_status put_frame_control(struct groom_animation *a)
{
    uint8_t control[26] = {0};
    put_u32(control, a->sequence++);
    put_u32(control + 4, a->options.width);
    put_u32(control + 8, a->options.height);
    put_u16(control + 20, a->options.frame_ms);
    put_u16(control + 22, 1000);
    return put_chunk(a, "fcTL", control, sizeof control, NULL, 0);
}

/* --- rows ------------------------------------------------------------------------------------ */

static int paeth(int left, int up, int corner)
{
    int p = left + up - corner, a = abs(p - left), b = abs(p - up), c = abs(p - corner);
    return a <= b && a <= c ? left : b <= c ? up : corner;
}

/* The row under one of PNG's filters; returns the sum of what is left, as signed bytes: the less, the better it packs. */
static size_t filter_row(int filter, const uint8_t *row, const uint8_t *before, size_t n, uint8_t *out)
{
    size_t sum = 0;
    out[0] = (uint8_t)filter;
    for (size_t i = 0; i < n; i++) {
        int left = i >= 3 ? row[i - 3] : 0, up = before[i], corner = i >= 3 ? before[i - 3] : 0;
        int guess = filter == 1 ? left : filter == 2 ? up : filter == 3 ? (left + up) / 2 : filter == 4 ? paeth(left, up, corner) : 0;
        out[i + 1] = (uint8_t)(row[i] - guess);
        sum += out[i + 1] < 128 ? out[i + 1] : 256u - out[i + 1];
    }
    return sum;
}

static const uint8_t *best_row(struct groom_animation *a, const uint8_t *row, const uint8_t *before)
{
    size_t least = SIZE_MAX;
    const uint8_t *best = NULL;
    for (int filter = 0; filter < N_FILTERS; filter++) {
        uint8_t *out = a->tries + (size_t)filter * (1 + a->row_bytes);
        size_t sum = filter_row(filter, row, before, a->row_bytes, out);
        if (sum < least) {
            least = sum;
            best = out;
        }
    }
    return best;
}

/* zlib's memory comes from the allocator; what it releases does not say its size, so that stands in front. */
#define HEADER 64

static voidpf allocate(voidpf user, uInt n, uInt size)
{
    size_t bytes = (size_t)n * size + HEADER, *memory = memory_array(user, 1, bytes);
    if (!memory)
        return NULL;
    *memory = bytes;
    return (char *)memory + HEADER;
}

static void release(voidpf user, voidpf memory)
{
    size_t *begin = (size_t *)(void *)((char *)memory - HEADER);
    memory_release(user, begin, 1, *begin);
}

/* A frame's rows, filtered and compressed, into a->packed; returns 0 where memory ran out. */
static size_t pack(struct groom_animation *a, const uint8_t *rgba)
{
    z_stream z = {.zalloc = allocate, .zfree = release, .opaque = (voidpf)(uintptr_t)a->allocator, .next_out = a->packed, .avail_out = (uInt)a->n_packed};
    if (deflateInit(&z, LEVEL) != Z_OK)
        return 0;
    memset(a->rows, 0, 2 * a->row_bytes);
    for (uint32_t y = 0; y < a->options.height; y++) {
        uint8_t *row = a->rows + (y & 1) * a->row_bytes, *before = a->rows + (~y & 1) * a->row_bytes;
        for (uint32_t x = 0; x < a->options.width; x++)
            memcpy(row + 3 * (size_t)x, rgba + 4 * ((size_t)y * a->options.width + x), 3);
        z.next_in = (Bytef *)(uintptr_t)best_row(a, row, before);
        z.avail_in = (uInt)(1 + a->row_bytes);
        deflate(&z, y + 1 == a->options.height ? Z_FINISH : Z_NO_FLUSH);
    }
    size_t n = z.total_out;
    deflateEnd(&z);
    return n;
}

/* --- the animation ------------------------------------------------------------------------------ */

groom_status groom_animation_create(const struct groom_animation_options *options, struct groom_sink sink,
                                    const struct groom_context *context, struct groom_animation **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    const uint32_t most = GROOM_RENDER_MAX_SIZE;
    if (!options->width || !options->height || options->width > most || options->height > most || !options->n_frames ||
        options->n_frames > 65535 || !options->frame_ms || options->frame_ms > 65535)
        return groom_fail(diag, GROOM_EINVAL, "an animation has sides of 1..%u pixels, and 1..65535 frames of 1..65535 ms", most);
    struct groom_animation *a = memory_array_zero(allocator, 1, sizeof *a);
    if (!a)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for an animation");
    *a = (struct groom_animation){.options = *options, .sink = sink, .allocator = allocator, .row_bytes = 3 * (size_t)options->width};
    a->n_packed = compressBound((uLong)((1 + a->row_bytes) * options->height)) + 4096;
    a->rows = memory_array(allocator, 2, a->row_bytes);
    a->tries = memory_array(allocator, N_FILTERS, 1 + a->row_bytes);
    a->packed = memory_array(allocator, 1, a->n_packed);
    groom_status st = a->rows && a->tries && a->packed ? put_begin(a) : GROOM_ENOMEM;
    if (st == GROOM_OK) {
        *out = a;
        return GROOM_OK;
    }
    groom_animation_destroy(a);
    return groom_fail(diag, st, "beginning an animated PNG: %s", groom_status_message(st));
}

groom_status groom_animation_add(struct groom_animation *a, const uint8_t *rgba, struct groom_diag *diag)
{
    uint8_t sequence[4];
    if (a->n_added == a->options.n_frames)
        return groom_fail(diag, GROOM_EINVAL, "the animation has its %u frames", a->n_added);
    size_t n = pack(a, rgba);
    groom_status st = n ? put_frame_control(a) : GROOM_ENOMEM;
    if (st == GROOM_OK && a->n_added == 0)
        st = put_chunk(a, "IDAT", NULL, 0, a->packed, n);
    else if (st == GROOM_OK) {
        put_u32(sequence, a->sequence++);
        st = put_chunk(a, "fdAT", sequence, 4, a->packed, n);
    }
    a->n_added++;
    return st == GROOM_OK ? st : groom_fail(diag, st, "writing an animated PNG: %s", groom_status_message(st));
}

groom_status groom_animation_finish(struct groom_animation *a, struct groom_diag *diag)
{
    if (a->n_added < a->options.n_frames)
        return groom_fail(diag, GROOM_EINVAL, "the animation has %u of its %u frames", a->n_added, a->options.n_frames);
    groom_status st = put_chunk(a, "IEND", NULL, 0, NULL, 0);
    return st == GROOM_OK ? st : groom_fail(diag, st, "ending an animated PNG: %s", groom_status_message(st));
}

void groom_animation_destroy(struct groom_animation *a)
{
    if (!a)
        return;
    memory_release(a->allocator, a->rows, 2, a->row_bytes);
    memory_release(a->allocator, a->tries, N_FILTERS, 1 + a->row_bytes);
    memory_release(a->allocator, a->packed, 1, a->n_packed);
    memory_release(a->allocator, a, 1, sizeof *a);
}
