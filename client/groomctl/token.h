/* The token that groomctl shows: --token, GROOMD_TOKEN (or GROOM_TOKEN), --token-file, and last
 * $XDG_CONFIG_HOME/groom/token (~/.config/groom/token) where that is there. */
#ifndef GROOMCTL_TOKEN_H
#define GROOMCTL_TOKEN_H

#include "client/groomctl/arguments.h"

#define TOKEN_SIZE 256

/* token    "" where there is none
 * returns  0 where a file that was named cannot be read; it has been said why */
int token_find(const struct arguments *global, const struct arguments *arguments, char token[TOKEN_SIZE]);

#endif
