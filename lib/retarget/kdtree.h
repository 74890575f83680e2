/* Nearest points in space, many at once, with points that may not be taken (those of the own strand). */
#ifndef RETARGET_KDTREE_H
#define RETARGET_KDTREE_H

#include <stdint.h>

#include "groom/context.h"
#include "groom/diag.h"

struct kdtree;

/* points   [n], finite; copied
 * owner    [n] what a point belongs to; borrowed until destroyed */
groom_status kdtree_create(const float (*points)[3], const uint32_t *owner, uint32_t n,
                           const struct groom_context *context, struct kdtree **tree, struct groom_diag *diag);
void kdtree_destroy(struct kdtree *tree); /* takes NULL */

struct kdtree_found {
    float squared;
    uint32_t id;
};

/* The k nearest points of other owners, nearest first, equal distances by lower index.
 * within   only points whose squared distance is not above
 * returns  how many there are, up to k */
uint32_t kdtree_find(const struct kdtree *tree, const float point[3], uint32_t owner, uint32_t k, float within,
                     struct kdtree_found *found);
/* The squared distance of a point of the tree. */
float kdtree_squared(const struct kdtree *tree, uint32_t id, const float point[3]);

#endif
