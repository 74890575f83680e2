#include "client/groomctl/arguments.h"

#include <stdio.h>
#include <string.h>

#include "client/groomctl/nearest.h"

static const struct option_spec *find(const struct option_spec *table, const char *name, size_t n_name,
                                      char letter)
{
    for (; table && table->name; table++)
        if (letter ? table->letter == letter
                   : strlen(table->name) == n_name && !strncmp(table->name, name, n_name))
            return table;
    return NULL;
}

static int complain(struct arguments *arguments, const char *what, const char *text)
{
    snprintf(arguments->complaint, sizeof arguments->complaint, "%s %.120s", what, text);
    return 0;
}

struct reading {
    int argc, at;
    char *const *argv;
    const struct option_spec *table, *more;
    struct arguments *arguments;
};

static int add(struct reading *r, const struct option_spec *spec, const char *value)
{
    struct arguments *a = r->arguments;
    if (a->n_options == ARGUMENTS_MAX)
        return complain(a, "too many options, from", r->argv[r->at]);
    a->options[a->n_options].spec = spec;
    a->options[a->n_options++].value = value ? value : "";
    return 1;
}

/* With the option that may have been meant. */
static int complain_unknown(struct reading *r, const char *text, size_t n_name)
{
    struct nearest nearest;
    char more[48];
    nearest_init(&nearest, text + 2, n_name);
    for (const struct option_spec *spec = n_name ? r->table : NULL; spec && spec->name; spec++)
        nearest_offer(&nearest, spec->name);
    for (const struct option_spec *spec = n_name ? r->more : NULL; spec && spec->name; spec++)
        nearest_offer(&nearest, spec->name);
    snprintf(more, sizeof more, "; --%.40s is one", nearest.name ? nearest.name : "");
    snprintf(r->arguments->complaint, sizeof r->arguments->complaint, "there is no option %.120s%s", text, nearest.name ? more : "");
    return 0;
}

/* One option at argv[at], and its value where that is the next argument. */
static int read_option(struct reading *r)
{
    const char *text = r->argv[r->at], *name = text + 2, *value = NULL;
    int is_long = text[1] == '-';
    const char *equals = is_long ? strchr(name, '=') : NULL;
    char letter = is_long ? 0 : text[1];
    size_t n_name = equals ? (size_t)(equals - name) : strlen(name);
    const struct option_spec *spec = find(r->table, name, n_name, letter);
    if (!spec)
        spec = find(r->more, name, n_name, letter);
    if (!spec)
        return complain_unknown(r, text, is_long ? n_name : 0);
    if (equals)
        value = equals + 1;
    else if (!is_long && text[2])
        value = text + 2;
    if (!spec->value && value)
        return complain(r->arguments, "no value belongs to", text);
    if (spec->value && !value) {
        if (r->at + 1 >= r->argc)
            return complain(r->arguments, "a value is missing behind", text);
        return add(r, spec, r->argv[++r->at]);
    }
    return add(r, spec, value);
}

int arguments_parse(int argc, char *const *argv, const struct option_spec *table,
                    const struct option_spec *more, int stop_at_operand, int *argc_read,
                    struct arguments *arguments)
{
    struct reading r = {.argc = argc, .argv = argv, .table = table, .more = more, .arguments = arguments};
    int only_operands = 0;
    memset(arguments, 0, sizeof *arguments);
    for (; r.at < argc; r.at++) {
        const char *text = argv[r.at];
        if (!only_operands && !strcmp(text, "--")) {
            only_operands = 1;
        } else if (!only_operands && text[0] == '-' && text[1]) {
            if (!read_option(&r))
                return 0;
        } else {
            if (stop_at_operand)
                break;
            if (arguments->n_operands == ARGUMENTS_MAX)
                return complain(arguments, "too many arguments, from", text);
            arguments->operands[arguments->n_operands++] = text;
        }
    }
    if (argc_read)
        *argc_read = r.at;
    return 1;
}

const char *argument(const struct arguments *arguments, const char *name)
{
    for (size_t i = arguments->n_options; i-- > 0;)
        if (!strcmp(arguments->options[i].spec->name, name))
            return arguments->options[i].value;
    return NULL;
}

const char *argument_nth(const struct arguments *arguments, const char *name, size_t n)
{
    for (size_t i = 0; i < arguments->n_options; i++)
        if (!strcmp(arguments->options[i].spec->name, name) && n-- == 0)
            return arguments->options[i].value;
    return NULL;
}
