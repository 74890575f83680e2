/* A command line, read by tables of options.
 *
 * `--name value`, `--name=value`, `-n value`; options may stand anywhere, `--` ends them, and a
 * lone `-` is an operand. Strings are borrowed from argv. */
#ifndef GROOMCTL_ARGUMENTS_H
#define GROOMCTL_ARGUMENTS_H

#include <stddef.h>

struct option_spec {
    const char *name;  /* "unit", without dashes */
    char letter;       /* 'o' for -o; 0: none */
    const char *value; /* what stands behind it, for the help: "U"; NULL: nothing, it is a flag */
    const char *help;
};

#define ARGUMENTS_MAX 256
struct arguments {
    const char *operands[ARGUMENTS_MAX];
    size_t n_operands;
    struct { const struct option_spec *spec; const char *value; } options[ARGUMENTS_MAX];
    size_t n_options;
    char complaint[256]; /* what is wrong with them, or "" */
};

/* Reads argv[0..argc-1]. Tables end with a NULL name; the second may be NULL.
 * stop_at_operand  leave everything from the first operand on: *argc_read says how far it went
 * returns          1, or 0 with a complaint */
int arguments_parse(int argc, char *const *argv, const struct option_spec *table, const struct option_spec *more,
                    int stop_at_operand, int *argc_read, struct arguments *arguments);

/* The last value of an option, "" for a flag, NULL where it was not given. */
const char *argument(const struct arguments *arguments, const char *name);
/* The nth value of an option given several times, NULL beyond the last. */
const char *argument_nth(const struct arguments *arguments, const char *name, size_t n);

#endif
