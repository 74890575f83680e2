/* The groom document: a struct groom as JSON ("groom/1").
 *
 *   {"format":"groom/1","unit":"m","name":…,
 *    "strands":{"count","vertices","scalp","roots":f32[n,3],"root_uv":f32[n,2]},
 *    "guides":{"count","vertices","points":f32[ng,m,3],"root_uv":f32[ng,2]},
 *    "instancing":{"guide":u32[n,k],"weight":f32[n,k]},
 *    "operator_guides":{"guide":u32[nop],"of_strand":u32[n]},
 *    "operators":[{"type":"curl","id":3,"enabled":true,"seed":1,"radius":0.006,…,
 *                  "random":{"u1":f32[nop],"u2":f32[nop]}},…]}
 *
 * Where operators lean on other axes than those of space (groom.axes), there is "axes":[[x,y,z],[x,y,z],[x,y,z]].
 *
 * A groom made of uploaded strands has, in place of guides, instancing and operator_guides, its strands:
 *    "base":{"strands":"str_…","vertices":u32[n],"points":f32[sum of vertices,3]}
 * where "vertices" says how many each strand has; then strands.roots is what the base begins with.
 *
 * Layers stand in the chain like operators, with these members beside their parameters:
 *    {"type":"ruffle","rho","blend","match_elements","elements","groups"}
 *    {"type":"sculpt","stiffness","elements","anchors","contact","clusters":{"count","seed"},
 *     "frames":[{"cluster","at","transform":[[…4],[…4],[…4]]},…]}
 *    {"type":"interpolate","t","elements","target":{"groom","revision","vertices":u32[],"points":f32[,3]}}
 *    {"type":"curl_scale","radius","step","ramp_root","ramp_tip","largest_radius","elements","groups","group",
 *     "keep":"length"|"turns","hold_direction":bool}
 * elements   a number for every strand, or "auto"
 * groups     "all", "operator_guides", {"count","seed"} for k-means over root and tip, or a group for each
 *            strand: u32[n], or a list
 * anchors    {"strand":u32[a],"at":f32[a],"position":f32[a,3]}, or a list of {"strand","at","position":[x,y,z]};
 *            contact, likewise, is what holds strands outside the head
 *
 * and around these the members that the model does not own (id, revision, parent, source, fit, …),
 * which pass through untouched. Metres, y up, root first. Numbers are printed with nine digits and
 * arrays carry their bits, so that a document read back is the same groom, bit for bit.
 *
 * A large array stands in a document in one of two ways:
 *   inline        {"dtype":"f32","shape":[n,3],"data":"<base64, little-endian, row-major>"}
 *   by reference  {"dtype":"f32","shape":[n,3],"$array":"<name>"}, its bytes kept elsewhere,
 *                 as the daemon does, so that revisions share what they do not change.
 *
 * An operator may leave out what can be supplied: parameters (their initial values), `id` (the next
 * free one), `enabled` (true), `seed` (1), `random` (drawn from seed and id). */
#ifndef GROOM_DOCUMENT_H
#define GROOM_DOCUMENT_H

#include <stddef.h>

#include "groom/context.h"
#include "groom/diag.h"
#include "groom/groom.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A name of an array that is kept elsewhere; a SHA-256 in hexadecimal fits. */
#define GROOM_ARRAY_REFERENCE_SIZE 72

/* Keeps an array while a document is written, and says by what name to find it. */
struct groom_array_keeper {
    groom_status (*keep)(void *user, const void *bytes, size_t n_bytes,
                         char reference[GROOM_ARRAY_REFERENCE_SIZE]);
    void *user;
};

/* Finds an array while a document is read. The bytes are borrowed until the read returns.
 * An unknown name is GROOM_ENOTFOUND. */
struct groom_array_finder {
    groom_status (*find)(void *user, const char *reference, const void **bytes, size_t *n_bytes);
    void *user;
};

/* Read and validate a document.
 * json      n_bytes of UTF-8, borrowed
 * finder    NULL: references are refused, every array must be inline
 * groom     owned by the caller
 * returns   GROOM_OK; GROOM_EINVAL with the JSON pointer of the culprit; GROOM_EFORMAT (not JSON, not
 *           a groom document), GROOM_ENOMEM, what the finder answers */
GROOM_MUST_CHECK groom_status groom_document_read(const char *json, size_t n_bytes,
                                                  const struct groom_array_finder *finder,
                                                  const struct groom_context *context,
                                                  struct groom **groom, struct groom_diag *diag);

/* Write a document.
 * around    a JSON object whose members that the model does not own are kept, or NULL
 * keeper    takes every array, those of `around` that are inline among them; NULL: arrays inline, or as they are
 * json      zero-terminated, released by the caller with free()
 * returns   GROOM_OK, GROOM_EFORMAT (around is not a JSON object), GROOM_ENOMEM, what the keeper answers */
GROOM_MUST_CHECK groom_status groom_document_write(const struct groom *groom, const char *around,
                                                   const struct groom_array_keeper *keeper, char **json,
                                                   size_t *n_bytes, struct groom_diag *diag);

/* One operator alone: the same object as in a document's "operators".
 * read     inserted at `index` of the groom; pointers are below /operators/<index>. Without an "id" it gets
 *          the next free one. The groom is as it was on error
 * write    json is released with free() */
GROOM_MUST_CHECK groom_status groom_document_operator_read(const char *json, size_t n_bytes,
                                                           const struct groom_array_finder *finder,
                                                           struct groom *groom, uint32_t index,
                                                           struct groom_diag *diag);
GROOM_MUST_CHECK groom_status groom_document_operator_write(const struct groom *groom, uint32_t index,
                                                            const struct groom_array_keeper *keeper, char **json,
                                                            size_t *n_bytes, struct groom_diag *diag);

/* An array as it stands in a document, inline: f32 or u32 (is_float 0) of this shape (1 to 3 dimensions).
 * json is released with free(). returns GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status groom_document_array_write(const void *elements, int is_float, const uint32_t *shape,
                                                         uint32_t n_dimensions, char **json, size_t *n_bytes);

/* The same document with its arrays standing another way, the groom itself not looked at.
 * inline_arrays        replace references by their bytes */
GROOM_MUST_CHECK groom_status groom_document_inline(const char *json, size_t n_bytes,
                                                    const struct groom_array_finder *finder, char **out,
                                                    size_t *n_out, struct groom_diag *diag);
/* leave the arrays' data (or reference) out, keep dtype and shape */
GROOM_MUST_CHECK groom_status groom_document_outline(const char *json, size_t n_bytes, char **out,
                                                     size_t *n_out, struct groom_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
