#include "base/checksum.h"

#include <string.h>

static uint64_t mix(uint64_t hash, uint64_t word)
{
    hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 29;
}

static uint64_t word_at(const unsigned char *bytes)
{
    uint64_t word;
    memcpy(&word, bytes, sizeof word);
    return word;
}

void checksum_add(struct checksum *sum, const void *bytes, size_t n)
{
    if (n == 0) /* bytes may be NULL then */
        return;
    const unsigned char *at = bytes, *end = at + n;
    size_t pending = sum->n_bytes % 8;
    sum->n_bytes += n;
    while (pending > 0 && at < end) {
        sum->pending[pending++] = *at++;
        if (pending == 8) {
            sum->hash = mix(sum->hash, word_at(sum->pending));
            pending = 0;
        }
    }
    for (; end - at >= 8; at += 8)
        sum->hash = mix(sum->hash, word_at(at));
    memcpy(sum->pending, at, (size_t)(end - at));
}

uint64_t checksum_finish(const struct checksum *sum)
{
    unsigned char last[8] = {0};
    memcpy(last, sum->pending, sum->n_bytes % 8);
    return mix(mix(sum->hash, word_at(last)), sum->n_bytes);
}
