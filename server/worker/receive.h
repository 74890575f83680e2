/* An answer of the daemon that may be as large as all strands: kept in a file without a name. */
#ifndef WORKER_RECEIVE_H
#define WORKER_RECEIVE_H

#include "server/worker/work_link.h"

/* GET `path`, from its beginning again where the line broke.
 * fd       the caller's to close; stands at its start
 * returns  what work_link_call returns, GROOM_ENOMEM, GROOM_EIO */
GROOM_MUST_CHECK groom_status receive(struct work_link *link, const char *path, int *fd, struct groom_diag *diag);

#endif
