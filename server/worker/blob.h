/* Bytes by their SHA-256: from a shared folder where there is one, else over HTTP; never believed. */
#ifndef WORKER_BLOB_H
#define WORKER_BLOB_H

#include "server/worker/order.h"
#include "server/worker/work_link.h"

struct blob {
    unsigned char *bytes;
    size_t n_bytes;
    int is_map;
};

/* returns  GROOM_OK; GROOM_EIO (the bytes are not those of the hash, or cannot be had), GROOM_ENOMEM,
 *          what work_link_call returns */
GROOM_MUST_CHECK groom_status blob_fetch(struct work_link *link, const struct order_blob *name, struct blob *blob,
                                         struct groom_diag *diag);
void blob_release(struct blob *blob); /* takes zeroed values */

#endif
