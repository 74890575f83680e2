/* What an attempt is told to do (proto/work.h, "The order"). */
#ifndef WORKER_ORDER_H
#define WORKER_ORDER_H

#include <stdint.h>

#include "groom/diag.h"
#include "groom/io.h"

#define ORDER_HASH_SIZE 65

/* Bytes that the attempt needs, by their name. */
struct order_blob {
    char sha256[ORDER_HASH_SIZE]; /* lower-case hexadecimal; "" where there is none */
    uint64_t n_bytes;
    char path[1024];              /* where it lies on this machine, or "" */
};

struct order_input {
    struct order_blob blob;
    char id[40];
    char name[128];
    char format[16];              /* "" : recognise it */
    struct groom_frame frame;
};

#define ORDER_MOST_TARGETS 16

struct order {
    char job[40], kind[16];
    uint32_t attempt;
    char *options;                /* JSON object */
    struct order_input strands;
    struct order_input head;      /* blob.sha256 "" where there is none */
    struct order_blob checkpoint; /* sha256 "" where there is none */

    /* of a retargeting */
    char *request;                /* JSON object: skeletons, landmarks, hairlines */
    struct order_input source;    /* the body that the hair is on */
    struct order_input targets[ORDER_MOST_TARGETS];
    uint32_t n_targets;
    int keeps_preparation;        /* what is worked out of the source is handed in, or is there: */
    struct order_blob preparation; /* sha256 "" where it is not there yet */
};

/* returns  GROOM_OK; GROOM_EFORMAT (not an order); GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status order_parse(const char *json, size_t n_bytes, struct order *order,
                                          struct groom_diag *diag);
/* Whether it is an edit in curvature space: its strands come from the daemon, evaluated. */
int order_is_edit(const struct order *order);
int order_is_retargeting(const struct order *order);
void order_finish(struct order *order); /* takes zeroed values */

#endif
