/* JSON as it is written, piece by piece into a sink: answers whose arrays are too large for a tree. */
#ifndef BASE_JSON_STREAM_H
#define BASE_JSON_STREAM_H

#include <stddef.h>
#include <stdint.h>

#include "groom/io.h"

#define JSON_STREAM_DEPTH 16

/* Commas are its own to set. After a first failure everything does nothing. */
struct json_stream {
    struct groom_sink sink;
    groom_status status;
    int depth;
    int has_members[JSON_STREAM_DEPTH + 1];
    size_t n;
    char buffer[8192];
};

void json_stream_init(struct json_stream *stream, struct groom_sink sink);
/* The first failure, after all is written. */
GROOM_MUST_CHECK groom_status json_stream_finish(struct json_stream *stream);

/* name: of the member, where the value stands in an object; NULL in an array. Names need no escapes. */
void json_stream_open(struct json_stream *stream, const char *name, char bracket); /* '{' or '[' */
void json_stream_close(struct json_stream *stream, char bracket);                  /* '}' or ']' */
void json_stream_number(struct json_stream *stream, const char *name, double value); /* %.9g; null where not finite */
void json_stream_integer(struct json_stream *stream, const char *name, uint64_t value);
void json_stream_text(struct json_stream *stream, const char *name, const char *text); /* escaped */

/* {"dtype","shape","data"} of 4-byte numbers that `column` gathers: values begin..begin+n-1 into out. */
typedef void json_stream_column(const void *user, size_t begin, size_t n, void *out);
void json_stream_array(struct json_stream *stream, const char *name, const char *dtype, const uint64_t *shape,
                       unsigned n_dimensions, json_stream_column *column, const void *user);
/* The same of numbers that lie one after the other. */
void json_stream_packed(struct json_stream *stream, const char *name, const char *dtype, const uint64_t *shape,
                        unsigned n_dimensions, const void *numbers);

#endif
