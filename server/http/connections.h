/* Every open connection, so that slow senders can be cut: libmicrohttpd's own timeout only sees
 * connections that are silent, and one byte a second is not silence. */
#ifndef HTTP_CONNECTIONS_H
#define HTTP_CONNECTIONS_H

#include <stdint.h>

#include "server/config.h"

struct connections;
struct link; /* one connection */

/* config is borrowed. NULL where memory is out. */
struct connections *connections_create(const struct config *config);
void connections_destroy(struct connections *connections); /* takes NULL; all must be closed */

struct link *connections_open(struct connections *connections, int fd); /* NULL: out of memory */
void connections_close(struct connections *connections, struct link *link);
uint64_t connections_count(struct connections *connections);

/* Where a connection stands. */
void link_head(struct link *link); /* waits for a request */
void link_body(struct link *link); /* a body is coming */
void link_received(struct link *link, uint64_t n_bytes);
void link_busy(struct link *link); /* the server's turn */

/* Shut what is too slow: no head within the time, a body below the rate, an end in the middle of a body.
 * Call a few times a second. */
void connections_sweep(struct connections *connections);

#endif
