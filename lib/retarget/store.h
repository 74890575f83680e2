/* The file of what a retargeting prepared: this header, the payload, its checksum (base/checksum.h). */
#ifndef RETARGET_STORE_H
#define RETARGET_STORE_H

#include <stdint.h>

#define STORE_MAGIC "GROOMRTG"
#define STORE_VERSION 2

struct store_header {
    char magic[8];
    uint64_t version, inputs, payload_bytes;
};

#endif
