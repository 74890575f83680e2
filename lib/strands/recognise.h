/* Which format some bytes are. */
#ifndef STRANDS_RECOGNISE_H
#define STRANDS_RECOGNISE_H

#include "groom/format.h"

struct recognised {
    groom_format format; /* GROOM_FORMAT_AUTO: none that is read here */
    int certain;         /* by a magic number or text; otherwise by counts that fit */
    uint32_t stride;     /* of .data records: bytes a point (12, or 16 with visibility) */
    const char *hint;    /* what it is instead, and what to do, or NULL */
};

/* bytes   the first n of the file (all of it where n == size)
 * size    of the whole file, or -1 */
struct recognised recognise(const unsigned char *bytes, size_t n, int64_t size);

#endif
