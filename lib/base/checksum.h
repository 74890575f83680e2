/* A 64-bit checksum against accidents (not against forgers), 8 bytes at a time. It depends on the
 * bytes in their order, not on how they were cut into calls. */
#ifndef BASE_CHECKSUM_H
#define BASE_CHECKSUM_H

#include <stddef.h>
#include <stdint.h>

struct checksum {
    uint64_t hash, n_bytes;
    unsigned char pending[8]; /* the last n_bytes % 8 */
};

/* Start from {0}. */
void checksum_add(struct checksum *sum, const void *bytes, size_t n);
uint64_t checksum_finish(const struct checksum *sum);

#endif
