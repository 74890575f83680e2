/* Building paths with queries, percent-encoded (RFC 3986). */
#ifndef PROTO_URL_H
#define PROTO_URL_H

#include <stddef.h>

#define URL_SIZE 1024
struct url {
    char text[URL_SIZE];
    size_t length;
    int has_query;
    int overflow; /* something did not fit: the text is cut and must not be used */
};

/* Start with a path that needs no encoding: "/v1/strands". */
void url_init(struct url *url, const char *path);
/* "/segment", encoded. */
void url_segment(struct url *url, const char *segment);
/* "?name=value" or "&name=value", the value encoded; nothing happens for a NULL value. */
void url_query(struct url *url, const char *name, const char *value);
void url_query_number(struct url *url, const char *name, double value);

#endif
