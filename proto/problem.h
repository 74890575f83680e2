/* Problem documents (RFC 9457): how every failure looks outside, whether groomd answers it over
 * HTTP or groom-worker prints it for the daemon to pass on.
 *
 *     {"type":"/problems/invalid-file","title":"...","status":422,"detail":"...",
 *      "instance":"/v1/strands","request":"6f1c...","pointer":"/operators/2/radius",
 *      "parameter":"unit","byte_offset":128}
 *
 * The last four are there only where they mean something. A problem is plain data: copy it, keep
 * it, no cleanup. */
#ifndef PROTO_PROBLEM_H
#define PROTO_PROBLEM_H

#include <stddef.h>
#include <stdint.h>

struct cJSON;

struct problem {
    int status;          /* HTTP status, 400..599 */
    char name[48];       /* "invalid-file": stable; the `type` is "/problems/" and this */
    char title[128];     /* what the name means, the same for every occurrence */
    char detail[512];    /* a sentence for the person who must mend it */
    char pointer[128];   /* JSON pointer of the refused field, or "" */
    char parameter[48];  /* query parameter that was refused, or "" */
    char instance[160];  /* path of the request, or "" */
    char request[40];    /* id of the request, as the log has it, or "" */
    int64_t byte_offset; /* where in the body, or -1 */
};

#define PROBLEM_MEDIA_TYPE "application/problem+json"

/* Fill a problem; pointer, parameter, instance and request are cleared, byte_offset is -1.
 * Returns its argument, so that a failure is one expression. */
struct problem *problem_set(struct problem *problem, int status, const char *name, const char *title,
                            const char *detail_format, ...) __attribute__((format(printf, 5, 6)));

/* A JSON object; the caller's to delete. NULL where memory is out. */
struct cJSON *problem_to_json(const struct problem *problem);
/* The same as text; the caller frees it. */
char *problem_print(const struct problem *problem);

/* Read a problem back. Members that are missing become empty, a status outside 400..599 becomes 500.
 * returns  1; 0 where json is not an object with a `type` */
int problem_from_json(const struct cJSON *json, struct problem *problem);

#endif
