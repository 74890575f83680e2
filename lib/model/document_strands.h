/* Dense strands inside a document: {"vertices":u32[n],"points":f32[sum,3]}. */
#ifndef MODEL_DOCUMENT_STRANDS_H
#define MODEL_DOCUMENT_STRANDS_H

#include "groom/strands.h"
#include "model/document_node.h"

/* pointer: where the node stands, for messages. */
groom_status document_strands_read(const cJSON *node, const char *pointer, const struct groom_array_finder *finder,
                                   const struct groom_context *context, struct groom_strands **strands,
                                   struct groom_diag *diag);
groom_status document_strands_write(uint32_t n_strands, const uint32_t *first, const float (*points)[3],
                                    const struct groom_array_keeper *keeper, cJSON *node);

#endif
