/* What reading and writing a document share: its text as a tree, and its large arrays. */
#ifndef MODEL_DOCUMENT_NODE_H
#define MODEL_DOCUMENT_NODE_H

#include <stddef.h>
#include <stdint.h>
#include <cjson/cJSON.h>

#include "groom/document.h"

/* --- the tree -------------------------------------------------------------- */

/* returns GROOM_OK with a tree for cJSON_Delete, or GROOM_EFORMAT with the byte at which it is not JSON */
groom_status document_parse(const char *json, size_t n_bytes, cJSON **root, struct groom_diag *diag);
/* returns GROOM_OK with a text for free(), or GROOM_ENOMEM */
groom_status document_print(const cJSON *root, char **json, size_t *n_bytes, struct groom_diag *diag);

/* Of the i-th random array of an operator: "u", or "u1" and "u2". */
const char *document_random_name(groom_operator_type type, uint32_t i);

/* --- arrays ------------------------------------------------------------------ */

enum document_dtype { DOCUMENT_F32, DOCUMENT_U32 };

#define DOCUMENT_MAX_DIMENSIONS 3

/* An array of a document whose dtype, shape and length have been checked against each other. */
struct document_array {
    const cJSON *node;
    char pointer[64]; /* JSON pointer, for messages */
    uint32_t n_dimensions;
    uint32_t shape[DOCUMENT_MAX_DIMENSIONS];
    size_t n_elements;
};

/* Whether a node is an array, inline or by reference or outlined. */
int document_array_is(const cJSON *node);

/* Look at `node`: an object of the dtype and number of dimensions that are expected, with as many
 * bytes as its shape says. Nothing is allocated, so a shape that lies costs nothing. */
groom_status document_array_check(const cJSON *node, const char *pointer, enum document_dtype dtype,
                                  uint32_t n_dimensions, const struct groom_array_finder *finder,
                                  struct document_array *array, struct groom_diag *diag);

/* Copy its elements, 4 bytes each, to out. */
groom_status document_array_copy(const struct document_array *array, const struct groom_array_finder *finder,
                                 void *out, struct groom_diag *diag);

/* A new node for these elements: inline, or kept elsewhere where there is a keeper. */
groom_status document_array_create(const void *elements, enum document_dtype dtype, const uint32_t *shape,
                                   uint32_t n_dimensions, const struct groom_array_keeper *keeper, cJSON **node);

/* Replace the bytes of an inline array by a reference, kept there; any other node stays, a damaged one among them. */
groom_status document_array_keep(cJSON *node, const struct groom_array_keeper *keeper);

/* Replace a reference by its bytes; a node that is inline already stays. */
groom_status document_array_inline(cJSON *node, const struct groom_array_finder *finder, struct groom_diag *diag);

/* --- layers (document_layer.c) -------------------------------------------------- */

/* Whether a layer of this type has this member beside its parameters. */
int document_layer_has(groom_operator_type type, const char *name);
/* Fill in what a layer holds from its node, whose place is /operators/<index>. */
groom_status document_layer_read(const cJSON *node, uint32_t index, const struct groom *groom,
                                 const struct groom_array_finder *finder, struct groom_operator *op,
                                 struct groom_diag *diag);
/* Add it to a node. */
groom_status document_layer_write(const struct groom *groom, const struct groom_operator *op,
                                  const struct groom_array_keeper *keeper, cJSON *node);

/* --- axes (document_axes.c) -------------------------------------------------------- */

/* Of a document that has them. */
groom_status document_axes_read(const cJSON *root, struct groom *groom, struct groom_diag *diag);
groom_status document_axes_write(const float axes[3][3], cJSON *root);

/* --- a base (document_base.c) ------------------------------------------------------ */

/* The groom of a document that has a "base": strands alone, without its chain. */
groom_status document_base_read(const cJSON *root, const struct groom_array_finder *finder,
                                const struct groom_context *context, struct groom **groom, struct groom_diag *diag);
/* Add "base" to the document. */
groom_status document_base_write(const struct groom *groom, const struct groom_array_keeper *keeper, cJSON *root);

#endif
