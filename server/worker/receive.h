/* Answers of the daemon that may be as large as all strands. Both calls begin anew where the line broke. */
#ifndef WORKER_RECEIVE_H
#define WORKER_RECEIVE_H

#include "groom/context.h"
#include "groom/strands.h"
#include "server/worker/work_link.h"

/* GET `path` into a file without a name.
 * fd       the caller's to close; stands at its start
 * returns  what work_link_call returns, GROOM_ENOMEM, GROOM_EIO */
GROOM_MUST_CHECK groom_status receive_file(struct work_link *link, const char *path, int *fd, struct groom_diag *diag);

/* GET WORK_PATH_STRANDS (proto/strand_stream.h) straight to where strands lie in memory.
 * returns  what work_link_call returns, GROOM_EIO (it is no such stream, or there is no room for it) */
GROOM_MUST_CHECK groom_status receive_strands(struct work_link *link, const struct groom_context *context,
                                              struct groom_strands **strands, struct groom_diag *diag);

#endif
