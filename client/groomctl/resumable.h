/* Large files in pieces (tus 1.0), so that a broken line costs what was under way and an interrupted
 * command goes on where it ended. Which upload belongs to which file is kept in
 * $XDG_STATE_HOME/groomctl (~/.local/state/groomctl), by the server, the file's path, size and time. */
#ifndef GROOMCTL_RESUMABLE_H
#define GROOMCTL_RESUMABLE_H

#include <stdbool.h>

#include "client/groomctl/sending.h"
#include "client/groomctl/transfer.h"
#include "proto/url.h"

/* Send a file and have it taken by the collection that `url` names with its query.
 * status   the exit status. returns  false where the server does not speak of pieces: send it plainly */
bool upload_resumable(struct groomctl *ctl, const struct url *url, int fd, uint64_t n_bytes, const char *path,
                      int *status, cJSON **answer);

#endif
