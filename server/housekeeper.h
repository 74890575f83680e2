/* The thread that tidies up: what only helped along the way goes after a time (--keep-…), blobs that no
 * row refers to go. What users made stays until they remove it.
 *
 *   kept for ever     uploads, grooms and revisions, finished jobs with their result, states, stages and losses
 *   --keep-events     the progress and loss events of a finished job's stream
 *   --keep-keys       idempotency keys, when they expire
 *   --keep-jobs       finished jobs altogether; 0, the default: for ever
 *   --keep-preparations  what was worked out of strands for their next retargeting, since it was last used
 *   --upload-expiry   uploads in pieces that nobody used (server/uploads)
 *   at a job's end    its checkpoint */
#ifndef SERVER_HOUSEKEEPER_H
#define SERVER_HOUSEKEEPER_H

#include <stdint.h>

#include "groom/diag.h"

struct housekeeper;
struct jobs;
struct store;

struct housekeeper_options {
    struct store *store; /* borrowed, as are the jobs */
    struct jobs *jobs;
    uint64_t keep_events_s, keep_jobs_s, keep_preparations_s; /* 0: for ever */
    uint32_t round_s;                                         /* 0: 300 */
};

GROOM_MUST_CHECK groom_status housekeeper_start(const struct housekeeper_options *options,
                                                struct housekeeper **housekeeper, struct groom_diag *diag);
void housekeeper_stop(struct housekeeper *housekeeper); /* takes NULL */
/* One round, now. */
GROOM_MUST_CHECK groom_status housekeeper_round(const struct housekeeper_options *options, struct groom_diag *diag);

#endif
