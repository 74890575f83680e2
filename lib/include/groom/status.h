/* What a call of libgroom can answer.
 *
 * Every function that can fail returns a groom_status and hands objects out
 * through a pointer that it sets only on success. One list makes the enum, the
 * message, the stable name (the `type` of an HTTP problem) and the HTTP status,
 * so that a failure reads the same in C, on the command line and in JSON. */
#ifndef GROOM_STATUS_H
#define GROOM_STATUS_H

#ifdef __cplusplus
extern "C" {
#endif

/* X(constant, stable name, HTTP status, what it means) */
#define GROOM_STATUS_LIST(X)                                                                       \
    X(GROOM_OK,         "ok",                200, "success")                                       \
    X(GROOM_EINVAL,     "invalid-argument",  400, "an argument is out of range or of the wrong shape") \
    X(GROOM_EFORMAT,    "invalid-file",      422, "the data is not what its format promises")      \
    X(GROOM_ETRUNCATED, "truncated-file",    422, "the data ends before it is complete")           \
    X(GROOM_EUNKNOWN,   "unknown-format",    415, "the format was not recognised")                 \
    X(GROOM_ETOOBIG,    "too-large",         413, "the data is larger than the limit")             \
    X(GROOM_EEMPTY,     "empty",             422, "nothing usable is left")                        \
    X(GROOM_EDEGENERATE,"degenerate",        422, "the geometry admits no answer")                 \
    X(GROOM_ENOMEM,     "out-of-memory",     507, "memory ran out")                                \
    X(GROOM_EIO,        "io-error",          500, "reading or writing failed")                     \
    X(GROOM_ENOSPC,     "no-space",          507, "the disk is full")                              \
    X(GROOM_ECANCELLED, "cancelled",         409, "the work was cancelled")                        \
    X(GROOM_ENOTFOUND,  "not-found",         404, "no such thing")                                 \
    X(GROOM_ECONFLICT,  "conflict",          409, "it was changed meanwhile")                      \
    X(GROOM_ELIMIT,     "limit-reached",     429, "a limit is reached for now")                     \
    X(GROOM_EINTERNAL,  "internal",          500, "a library below failed in a way it should not")

typedef enum groom_status {
#define GROOM_STATUS_ENUM(name, slug, http, text) name,
    GROOM_STATUS_LIST(GROOM_STATUS_ENUM)
#undef GROOM_STATUS_ENUM
} groom_status;

#define GROOM_MUST_CHECK __attribute__((warn_unused_result))

/* Static strings and numbers, valid for any status; an unknown value reads as GROOM_EINTERNAL. */
const char *groom_status_message(groom_status status);
const char *groom_status_name(groom_status status); /* "invalid-file" */
int groom_status_http(groom_status status);

#ifdef __cplusplus
}
#endif
#endif
