/* What somebody may have meant who mistyped a name. */
#ifndef GROOMCTL_NEAREST_H
#define GROOMCTL_NEAREST_H

#include <stddef.h>

/* Keep the name that is nearest to `typed` among those offered one after another. */
struct nearest {
    const char *typed, *name; /* name: NULL while nothing is near enough */
    size_t n_typed, distance;
};
void nearest_init(struct nearest *nearest, const char *typed, size_t n_typed);
void nearest_offer(struct nearest *nearest, const char *name);

#endif
