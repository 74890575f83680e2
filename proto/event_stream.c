#include "proto/event_stream.h"

#include <stdio.h>
#include <string.h>

void event_stream_init(struct event_stream *stream, void (*on_event)(void *user, const struct event *event),
                       void *user)
{
    memset(stream, 0, sizeof *stream);
    stream->on_event = on_event;
    stream->user = user;
}

static void clear_event(struct event_stream *stream)
{
    stream->name[0] = '\0';
    stream->n_data = 0;
    stream->has_data = 0;
}

static void dispatch(struct event_stream *stream)
{
    struct event event = {stream->name[0] ? stream->name : "message", stream->data, stream->id};
    stream->data[stream->n_data] = '\0';
    if (stream->has_data)
        stream->on_event(stream->user, &event);
    clear_event(stream);
}

static void add_data(struct event_stream *stream, const char *value)
{
    size_t n = strlen(value), room = sizeof stream->data - 1 - stream->n_data;
    if (stream->has_data && room) {
        stream->data[stream->n_data++] = '\n';
        room--;
    }
    if (n > room)
        n = room;
    memcpy(stream->data + stream->n_data, value, n);
    stream->n_data += n;
    stream->has_data = 1;
}

/* One whole line: a field, a comment, or the blank that ends an event. */
static void take_line(struct event_stream *stream)
{
    char *line = stream->line, *value;
    line[stream->n_line] = '\0';
    if (!stream->n_line) {
        dispatch(stream);
        return;
    }
    stream->n_line = 0;
    if (line[0] == ':')
        return;
    value = strchr(line, ':');
    if (value) {
        *value++ = '\0';
        if (*value == ' ')
            value++;
    } else {
        value = line + strlen(line);
    }
    if (!strcmp(line, "data"))
        add_data(stream, value);
    else if (!strcmp(line, "event"))
        snprintf(stream->name, sizeof stream->name, "%.31s", value);
    else if (!strcmp(line, "id"))
        snprintf(stream->id, sizeof stream->id, "%.63s", value);
}

/* Lines end with \n, \r or \r\n. */
static void feed_byte(struct event_stream *stream, char c)
{
    int after_cr = stream->after_cr;
    stream->after_cr = c == '\r';
    if (c == '\n' && after_cr)
        return;
    if (c == '\n' || c == '\r')
        take_line(stream);
    else if (stream->n_line < sizeof stream->line - 1)
        stream->line[stream->n_line++] = c;
}

void event_stream_feed(struct event_stream *stream, const char *bytes, size_t n)
{
    for (size_t i = 0; i < n; i++)
        feed_byte(stream, bytes[i]);
}

void event_stream_reconnect(struct event_stream *stream)
{
    stream->n_line = 0;
    stream->after_cr = 0;
    clear_event(stream);
}
