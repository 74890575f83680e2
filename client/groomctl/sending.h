/* The bar of a file on its way up. */
#ifndef GROOMCTL_SENDING_H
#define GROOMCTL_SENDING_H

#include <stddef.h>
#include <stdint.h>

struct sending {
    const char *name; /* borrowed */
    uint64_t n_before, n_total; /* bytes that were there before; in all */
    double started, drawn;
    size_t n_lines;
};

void sending_init(struct sending *sending, const char *name, uint64_t n_before, uint64_t n_total);
/* http_request.sent: n_sent of this call. */
void sending_draw(void *user, uint64_t n_sent, uint64_t n_total);
void sending_clear(struct sending *sending);

#endif
