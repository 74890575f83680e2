/* The detail of a failure: what was wrong, where, and what to mend.
 *
 * Functions take an optional `struct groom_diag *` as their last parameter and
 * fill it when they return something other than GROOM_OK; NULL is always
 * allowed. A diag is plain data: copy it, keep it, no cleanup. */
#ifndef GROOM_DIAG_H
#define GROOM_DIAG_H

#include <stdint.h>

#include "groom/status.h"

#ifdef __cplusplus
extern "C" {
#endif

struct groom_diag {
    groom_status status;
    int64_t byte_offset; /* where in the input, or -1 where that has no meaning */
    char pointer[128];   /* JSON pointer of the offending field ("/operators/2/radius"), or "" */
    char detail[384];    /* a sentence for the person who must mend it */
};

/* Fill `diag` (NULL: nothing happens) and return `status`, so that a failure is one line:
 *   return groom_fail(diag, GROOM_EINVAL, "k is %u; it must be 1..%u", k, max); */
groom_status groom_fail(struct groom_diag *diag, groom_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The same with the byte of the input at which the reader gave up. */
groom_status groom_fail_at(struct groom_diag *diag, groom_status status, int64_t byte_offset,
                           const char *format, ...) __attribute__((format(printf, 4, 5)));

/* The same with the JSON pointer of the field that was refused. */
groom_status groom_fail_field(struct groom_diag *diag, groom_status status, const char *pointer,
                              const char *format, ...) __attribute__((format(printf, 4, 5)));

#ifdef __cplusplus
}
#endif
#endif
