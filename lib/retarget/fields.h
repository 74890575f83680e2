/* What the parsers of skeletons, landmarks and hairlines share: points and names out of JSON. */
#ifndef RETARGET_FIELDS_H
#define RETARGET_FIELDS_H

#include <stddef.h>
#include <stdint.h>

#include "base/json.h"
#include "groom/diag.h"

#define FIELDS_MAX_COORDINATE 1e4 /* metres: what is farther off is of another unit */

/* The text as an object; pointer "" in the diag where it is none. The caller deletes *json.
 * what     what it should be: "a skeleton"
 * returns  GROOM_OK, GROOM_EINVAL, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status fields_object(const char *text, size_t n_bytes, const char *what, cJSON **json,
                                            struct groom_diag *diag);

/* Refuse members that names (n of them) does not list.
 * pointer  of the object, "" for the whole; what  "a bone" */
GROOM_MUST_CHECK groom_status fields_known(const cJSON *object, const char *const *names, size_t n, const char *pointer,
                                           const char *what, struct groom_diag *diag);

/* [x, y, z]; json may be NULL. */
GROOM_MUST_CHECK groom_status fields_point(const cJSON *json, const char *pointer, float out[3], struct groom_diag *diag);

/* A number in a closed range; json may be NULL. */
GROOM_MUST_CHECK groom_status fields_number(const cJSON *json, const char *pointer, double least, double most, double *out,
                                            struct groom_diag *diag);

/* Puts item into parent, under a name or at the end; takes it also where that fails.
 * returns  0 where memory is out */
int fields_add(cJSON *parent, const char *name, cJSON *item);
cJSON *fields_point_json(const float point[3]); /* NULL where memory is out */

#endif
