#ifndef GROOMCTL_USAGE_H
#define GROOMCTL_USAGE_H

#include <stdio.h>

#include "client/groomctl/groomctl.h"

void usage_print(FILE *out);
void usage_print_command(FILE *out, const struct command *command);

#endif
