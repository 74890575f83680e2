/* What tests of the fit's stages share: states saved and taken up, steps without memory, losses by name. */
#ifndef TESTS_SUPPORT_FITS_H
#define TESTS_SUPPORT_FITS_H

#include "groom/fit.h"

struct fits_state { unsigned char *bytes; size_t n, room; }; /* free(bytes) */
struct fits_state fits_save(const struct groom_fit *fit);
groom_status fits_load(struct groom_fit *fit, const struct fits_state *state, struct groom_diag *diag);

/* `fresh` goes on from where `fit` stands; destroys `fit`, returns `fresh`. */
struct groom_fit *fits_pass_on(struct groom_fit *fit, struct groom_fit *fresh);

/* To the end, each step with every allocation failing once before it may succeed, after which nothing may be left over.
 * Returns how many failed. */
size_t fits_finish_without_memory(struct groom_fit *fit);

const struct groom_fit_loss *fits_loss(const struct groom_fit *fit, const char *stage, const char *name);

/* Whether one of the report's notes holds these words. */
int fits_is_noted(const struct groom_fit *fit, const char *words);

#endif
