/* PNG by libpng, whose memory comes from the context and whose errors come back as a status. */
#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>

#include "base/memory.h"
#include "groom/render.h"

struct encoder {
    const struct groom_allocator *allocator;
    struct groom_sink sink;
    groom_status status;
};

/* libpng's release does not say how much: the size stands before the memory. */
#define HEADER 64

static png_voidp allocate(png_structp png, png_alloc_size_t n)
{
    struct encoder *encoder = png_get_mem_ptr(png);
    size_t *memory = memory_array(encoder->allocator, 1, n + HEADER);
    if (!memory) {
        encoder->status = GROOM_ENOMEM;
        return NULL;
    }
    *memory = n + HEADER;
    return (char *)memory + HEADER;
}

static void release(png_structp png, png_voidp memory)
{
    struct encoder *encoder = png_get_mem_ptr(png);
    if (!memory)
        return;
    size_t *begin = (size_t *)(void *)((char *)memory - HEADER);
    memory_release(encoder->allocator, begin, 1, *begin);
}

static void write_bytes(png_structp png, png_bytep bytes, size_t n)
{
    struct encoder *encoder = png_get_io_ptr(png);
    encoder->status = encoder->sink.write(encoder->sink.user, bytes, n);
    if (encoder->status != GROOM_OK)
        png_error(png, "sink");
}

static void flush(png_structp png) { (void)png; }

static void fail(png_structp png, png_const_charp text)
{
    (void)text;
    png_longjmp(png, 1);
}

static void ignore(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

/* All that may longjmp, with nothing of its own to clean up. */
static int encode(png_structp png, png_infop info, const uint8_t *rgba, uint32_t width, uint32_t height)
{
    if (setjmp(png_jmpbuf(png)))
        return 0;
    png_set_IHDR(png, info, width, height, 8, PNG_COLOR_TYPE_RGBA, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_compression_level(png, 4);
    png_write_info(png, info);
    for (uint32_t y = 0; y < height; y++)
        png_write_row(png, rgba + (size_t)y * width * 4);
    png_write_end(png, info);
    return 1;
}

groom_status groom_png_write(const uint8_t *rgba, uint32_t width, uint32_t height, struct groom_sink sink,
                             const struct groom_context *context, struct groom_diag *diag)
{
    struct encoder encoder = {.allocator = memory_allocator(context), .sink = sink, .status = GROOM_OK};
    if (width == 0 || height == 0 || width > PNG_USER_WIDTH_MAX || height > PNG_USER_HEIGHT_MAX)
        return groom_fail(diag, GROOM_EINVAL, "a picture of %u x %u pixels is no PNG", width, height);
    png_structp png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, NULL, fail, ignore, &encoder, allocate, release);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    groom_status st = GROOM_ENOMEM;
    if (info) {
        png_set_write_fn(png, &encoder, write_bytes, flush);
        st = encode(png, info, rgba, width, height) ? GROOM_OK : encoder.status != GROOM_OK ? encoder.status : GROOM_EINTERNAL;
    }
    png_destroy_write_struct(&png, &info);
    if (st != GROOM_OK)
        return groom_fail(diag, st, "writing a PNG of %u x %u pixels: %s", width, height, groom_status_message(st));
    return GROOM_OK;
}
