#include "proto/url.h"

#include <stdio.h>
#include <string.h>

static void append(struct url *url, const char *text, size_t n)
{
    if (url->length + n >= URL_SIZE) {
        url->overflow = 1;
        return;
    }
    memcpy(url->text + url->length, text, n);
    url->length += n;
    url->text[url->length] = '\0';
}

static int is_unreserved(unsigned char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '.' || c == '_' || c == '~';
}

static void append_encoded(struct url *url, const char *text)
{
    static const char hex[] = "0123456789ABCDEF";
    for (const unsigned char *c = (const unsigned char *)text; *c; c++) {
        char escaped[3] = {'%', hex[*c >> 4], hex[*c & 15]};
        if (is_unreserved(*c))
            append(url, (const char *)c, 1);
        else
            append(url, escaped, 3);
    }
}

void url_init(struct url *url, const char *path)
{
    memset(url, 0, sizeof *url);
    append(url, path, strlen(path));
}

void url_segment(struct url *url, const char *segment)
{
    append(url, "/", 1);
    append_encoded(url, segment);
}

void url_query(struct url *url, const char *name, const char *value)
{
    if (!value)
        return;
    append(url, url->has_query ? "&" : "?", 1);
    append(url, name, strlen(name));
    append(url, "=", 1);
    append_encoded(url, value);
    url->has_query = 1;
}

void url_query_number(struct url *url, const char *name, double value)
{
    char text[32];
    snprintf(text, sizeof text, "%.9g", value);
    url_query(url, name, text);
}
