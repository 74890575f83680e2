/* The socket that the daemon listens on. */
#ifndef SERVER_LISTEN_H
#define SERVER_LISTEN_H

#include <stdbool.h>

#include "groom/diag.h"

struct listening {
    int fd;        /* bound and listening */
    char url[128]; /* "http://127.0.0.1:8080", with the port that was picked */
};

/* "HOST:PORT" or "[::1]:PORT"; HOST may be a name, port 0 picks a free one. guarded: there are
 * tokens, so that others may reach us; without them, loopback alone is taken.
 * returns  GROOM_EINVAL (not an address, not loopback), GROOM_EIO (in use, ...) */
GROOM_MUST_CHECK groom_status listen_open(const char *address, bool guarded, struct listening *listening,
                                          struct groom_diag *diag);

#endif
