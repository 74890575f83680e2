/* The form of a checkpoint: a header, the state, a checksum of the state. Little-endian.
 *
 *   magic[8] version inputs payload_bytes | payload | checksum(payload)
 *
 * The payload's checksum finds what was damaged; what it says is checked all the same before it
 * becomes state, so that no file crashes a fit. */
#ifndef FIT_CHECKPOINT_H
#define FIT_CHECKPOINT_H

#include <stdint.h>

#define CHECKPOINT_VERSION 12

struct checkpoint_header {
    char magic[8];          /* "GROOMFIT" */
    uint64_t version;
    uint64_t inputs;        /* checksum of strands, head and options */
    uint64_t payload_bytes;
};

#endif
