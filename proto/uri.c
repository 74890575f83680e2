#include "proto/uri.h"

#include <stdlib.h>
#include <string.h>

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return -1;
}

/* Decode s in place; plus says whether '+' is a blank (in a query it is). */
static const char *decode(char *s, int plus)
{
    char *to = s;
    for (; *s; s++) {
        unsigned char c = (unsigned char)*s;
        if (c == '%') {
            int high = hex_digit(s[1]), low = high < 0 ? -1 : hex_digit(s[2]);
            if (low < 0)
                return "a % in the URL is not followed by two hexadecimal digits";
            c = (unsigned char)(high * 16 + low);
            s += 2;
        } else if (c == '+' && plus) {
            c = ' ';
        }
        if (c < 0x20 || c == 0x7f)
            return "the URL holds a control character";
        *to++ = (char)c;
    }
    *to = 0;
    return NULL;
}

/* Well-formed UTF-8 without overlong forms and surrogates. */
static int is_utf8(const char *text)
{
    const unsigned char *s = (const unsigned char *)text;
    while (*s) {
        int n = *s < 0x80                 ? 0
                : *s >= 0xc2 && *s < 0xe0 ? 1
                : *s >= 0xe0 && *s < 0xf0 ? 2
                : *s >= 0xf0 && *s < 0xf5 ? 3
                                          : -1;
        if (n < 0 || (*s == 0xe0 && s[1] < 0xa0) || (*s == 0xed && s[1] > 0x9f) ||
            (*s == 0xf0 && s[1] < 0x90) || (*s == 0xf4 && s[1] > 0x8f))
            return 0;
        for (s++; n > 0; n--, s++)
            if ((*s & 0xc0) != 0x80)
                return 0;
    }
    return 1;
}

static const char *add_segment(struct uri *uri, char *text)
{
    const char *wrong = decode(text, 0);
    if (wrong)
        return wrong;
    if (!strcmp(text, ".") || !strcmp(text, ".."))
        return "\".\" and \"..\" are not taken in a path";
    if (!is_utf8(text))
        return "the URL is not UTF-8";
    if (uri->n_segments == URI_MAX_SEGMENTS)
        return "the path has too many segments";
    uri->segment[uri->n_segments++] = text;
    return NULL;
}

static const char *split_path(struct uri *uri, char *path)
{
    if (*path != '/')
        return "the target of the request must begin with /";
    if (!path[1])
        return NULL;
    for (char *at = path + 1; at;) {
        char *end = strchr(at, '/');
        if (end)
            *end++ = 0;
        const char *wrong = add_segment(uri, at);
        if (wrong)
            return wrong;
        at = end;
    }
    return NULL;
}

static const char *add_parameter(struct uri *uri, char *name)
{
    char *value = strchr(name, '=');
    if (value)
        *value++ = 0;
    const char *wrong = decode(name, 1);
    if (!wrong && value)
        wrong = decode(value, 1);
    if (wrong)
        return wrong;
    if (!is_utf8(name) || (value && !is_utf8(value)))
        return "the query is not UTF-8";
    if (uri_query(uri, name))
        return "a query parameter stands twice";
    if (uri->n_parameters == URI_MAX_PARAMETERS)
        return "the query has too many parameters";
    uri->parameter[uri->n_parameters++] = (struct uri_parameter){name, value ? value : ""};
    return NULL;
}

static const char *split_query(struct uri *uri, char *query)
{
    for (char *at = query; at;) {
        char *end = strchr(at, '&');
        if (end)
            *end++ = 0;
        const char *wrong = *at ? add_parameter(uri, at) : NULL;
        if (wrong)
            return wrong;
        at = end;
    }
    return NULL;
}

/* "http://host:port/path" -> "/path"; a proxy may ask that way. */
static const char *skip_authority(const char *target)
{
    if (strncmp(target, "http://", 7))
        return target;
    const char *path = strchr(target + 7, '/');
    return path ? path : "/";
}

const char *uri_parse(const char *target, struct uri *uri)
{
    *uri = (struct uri){0};
    if (strlen(target) > URI_MAX_LENGTH)
        return "the URL is too long";
    if (!(uri->storage = strdup(skip_authority(target))))
        return "memory ran out";
    uri->storage[strcspn(uri->storage, "#")] = 0;
    char *query = strchr(uri->storage, '?');
    if (query)
        *query++ = 0;
    const char *wrong = split_path(uri, uri->storage);
    if (!wrong && query)
        wrong = split_query(uri, query);
    if (wrong)
        uri_finish(uri);
    return wrong;
}

void uri_finish(struct uri *uri)
{
    free(uri->storage);
    *uri = (struct uri){0};
}

const char *uri_query(const struct uri *uri, const char *name)
{
    for (size_t i = 0; i < uri->n_parameters; i++)
        if (!strcmp(uri->parameter[i].name, name))
            return uri->parameter[i].value;
    return NULL;
}
