#include "base/json_stream.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/base64.h"

/* --- bytes ------------------------------------------------------------------------------ */

static void flush(struct json_stream *s)
{
    if (s->status == GROOM_OK && s->n)
        s->status = s->sink.write(s->sink.user, s->buffer, s->n);
    s->n = 0;
}

static void put(struct json_stream *s, const char *text, size_t n)
{
    while (n > 0) {
        size_t room = sizeof s->buffer - s->n, now = n < room ? n : room;
        memcpy(s->buffer + s->n, text, now);
        s->n += now;
        text += now;
        n -= now;
        if (s->n == sizeof s->buffer)
            flush(s);
    }
}

static void put_text(struct json_stream *s, const char *text) { put(s, text, strlen(text)); }

/* --- structure --------------------------------------------------------------------------- */

void json_stream_init(struct json_stream *s, struct groom_sink sink)
{
    s->sink = sink;
    s->status = GROOM_OK;
    s->depth = 0;
    s->has_members[0] = 0;
    s->n = 0;
}

groom_status json_stream_finish(struct json_stream *s)
{
    assert(s->depth == 0);
    flush(s);
    return s->status;
}

static void begin_value(struct json_stream *s, const char *name)
{
    if (s->has_members[s->depth]++)
        put(s, ",", 1);
    if (name) {
        put(s, "\"", 1);
        put_text(s, name);
        put(s, "\":", 2);
    }
}

void json_stream_open(struct json_stream *s, const char *name, char bracket)
{
    assert(s->depth < JSON_STREAM_DEPTH);
    begin_value(s, name);
    put(s, &bracket, 1);
    s->has_members[++s->depth] = 0;
}

void json_stream_close(struct json_stream *s, char bracket)
{
    assert(s->depth > 0);
    s->depth--;
    put(s, &bracket, 1);
}

void json_stream_number(struct json_stream *s, const char *name, double value)
{
    char text[32] = "null";
    if (isfinite(value))
        snprintf(text, sizeof text, "%.9g", value);
    begin_value(s, name);
    put_text(s, text);
}

void json_stream_integer(struct json_stream *s, const char *name, uint64_t value)
{
    char text[32];
    snprintf(text, sizeof text, "%llu", (unsigned long long)value);
    begin_value(s, name);
    put_text(s, text);
}

void json_stream_text(struct json_stream *s, const char *name, const char *text)
{
    char escape[8];
    begin_value(s, name);
    put(s, "\"", 1);
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\')
            put(s, "\\", 1);
        if (c < 0x20) {
            snprintf(escape, sizeof escape, "\\u%04x", c);
            put_text(s, escape);
        } else {
            put(s, text, 1);
        }
    }
    put(s, "\"", 1);
}

/* --- arrays -------------------------------------------------------------------------------- */

/* A multiple of three numbers is a whole number of base64's groups, so that only the last piece is padded. */
#define NUMBERS_A_PIECE 3072

void json_stream_array(struct json_stream *s, const char *name, const char *dtype, const uint64_t *shape,
                       unsigned n_dimensions, json_stream_column *column, const void *user)
{
    uint32_t numbers[NUMBERS_A_PIECE];
    char text[NUMBERS_A_PIECE * 16 / 3 + 8];
    uint64_t total = 1;
    json_stream_open(s, name, '{');
    json_stream_text(s, "dtype", dtype);
    json_stream_open(s, "shape", '[');
    for (unsigned k = 0; k < n_dimensions; k++) {
        json_stream_integer(s, NULL, shape[k]);
        total *= shape[k];
    }
    json_stream_close(s, ']');
    begin_value(s, "data");
    put(s, "\"", 1);
    for (uint64_t at = 0; at < total && s->status == GROOM_OK; at += NUMBERS_A_PIECE) {
        size_t n = total - at < NUMBERS_A_PIECE ? (size_t)(total - at) : NUMBERS_A_PIECE;
        column(user, (size_t)at, n, numbers);
        base64_encode(numbers, n * sizeof *numbers, text);
        put(s, text, base64_encoded_length(n * sizeof *numbers));
    }
    put(s, "\"", 1);
    json_stream_close(s, '}');
}

static void copy_packed(const void *user, size_t begin, size_t n, void *out)
{
    memcpy(out, (const uint32_t *)user + begin, n * sizeof(uint32_t));
}

void json_stream_packed(struct json_stream *s, const char *name, const char *dtype, const uint64_t *shape,
                        unsigned n_dimensions, const void *numbers)
{
    json_stream_array(s, name, dtype, shape, n_dimensions, copy_packed, numbers);
}
