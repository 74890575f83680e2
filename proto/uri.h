/* The target of a request: path segments and query parameters, percent-decoded.
 *
 * Decoding comes after splitting, so that %2F is a character of an id and never a separator, and
 * what cannot be an honest target is refused: a broken escape, a NUL or other control character,
 * bytes that are no UTF-8, "." and ".." as segments, a parameter that stands twice. */
#ifndef PROTO_URI_H
#define PROTO_URI_H

#include <stddef.h>

#define URI_MAX_LENGTH     8192
#define URI_MAX_SEGMENTS   16
#define URI_MAX_PARAMETERS 32

struct uri_parameter {
    const char *name, *value; /* value is "" where there is no '=' */
};

/* Embedded; all strings point into `storage`. */
struct uri {
    size_t n_segments, n_parameters;
    const char *segment[URI_MAX_SEGMENTS]; /* "/" has none; a trailing '/' makes a last, empty one */
    struct uri_parameter parameter[URI_MAX_PARAMETERS];
    char *storage; /* owned */
};

/* target is what stands in the request line ("/v1/strands?unit=cm") or an absolute http URL.
 * returns  NULL, or a sentence that says what is wrong (static); uri is then empty */
const char *uri_parse(const char *target, struct uri *uri);
void uri_finish(struct uri *uri); /* takes a zeroed one */

/* The value of a query parameter, or NULL. */
const char *uri_query(const struct uri *uri, const char *name);

#endif
