/* Server-sent events, read piece by piece as the bytes come (WHATWG HTML, 9.2). */
#ifndef PROTO_EVENT_STREAM_H
#define PROTO_EVENT_STREAM_H

#include <stddef.h>

struct event {
    const char *name; /* "message" where the stream names none */
    const char *data; /* lines joined by \n */
    const char *id;   /* the last id seen, "" before the first */
};

struct event_stream {
    char line[16384];  /* the line under way; what is longer is cut */
    size_t n_line;
    char name[32], id[64];
    char data[16384];
    size_t n_data;
    int has_data;
    int after_cr;
    void (*on_event)(void *user, const struct event *event);
    void *user;
};

void event_stream_init(struct event_stream *stream,
                       void (*on_event)(void *user, const struct event *event), void *user);
/* Calls on_event for each event that these bytes complete. */
void event_stream_feed(struct event_stream *stream, const char *bytes, size_t n);
/* A broken line: drop the event under way, keep the id for Last-Event-ID. */
void event_stream_reconnect(struct event_stream *stream);

#endif
