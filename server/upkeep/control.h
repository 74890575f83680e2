/* How `groomd check` and `groomd backup` reach the daemon that has the data folder: a socket in it that only
 * its owner may use. One line asks ("check", "backup /folder", "backup-copy /folder"), lines answer: a kind
 * ('p', 'n', 's' of upkeep.h), a blank, a text; the last is "e STATUS TEXT". One request at a time.
 *
 * threads   control_start makes one; control_ask blocks */
#ifndef UPKEEP_CONTROL_H
#define UPKEEP_CONTROL_H

#include "server/upkeep/upkeep.h"

struct control;

/* upkeep: store and blobs borrowed, folder copied; `say` is not used.
 * returns  GROOM_EIO, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status control_start(const struct upkeep *upkeep, struct control **control,
                                            struct groom_diag *diag);
/* Waits a second for a request under way. Takes NULL.
 * returns  false where one goes on: then the process must end without taking away what it works with */
bool control_stop(struct control *control);

/* Ask the daemon of a data folder; its lines go to `say`.
 * returns  what the call there returned; GROOM_ENOTFOUND: no daemon has this folder */
GROOM_MUST_CHECK groom_status control_ask(const char *folder, const char *request,
                                          void (*say)(void *user, char kind, const char *text), void *user,
                                          struct groom_diag *diag);

#endif
