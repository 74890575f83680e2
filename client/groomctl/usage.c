/* Usage and help, made of the tables. */
#include <stdarg.h>
#include <stdio.h>

#include "client/groomctl/usage.h"

static void print_options(FILE *out, const struct option_spec *table)
{
    for (; table && table->name; table++) {
        char left[48];
        snprintf(left, sizeof left, "%c%c%c --%s%s%s", table->letter ? '-' : ' ',
                 table->letter ? table->letter : ' ', table->letter ? ',' : ' ', table->name,
                 table->value ? " " : "", table->value ? table->value : "");
        fprintf(out, "  %-28s  %s\n", left, table->help);
    }
}

void usage_print(FILE *out)
{
    fputs("usage: groomctl [--server URL] [--json] COMMAND ...\n\n", out);
    for (const struct command *c = groomctl_commands; c->name; c++) {
        char left[64];
        snprintf(left, sizeof left, "%s %s", c->name, c->operands);
        fprintf(out, "  %-34s  %s\n", left, c->summary);
    }
    fputs("\noptions of every command:\n", out);
    print_options(out, groomctl_global_options);
    fputs("\n`groomctl COMMAND --help` lists a command's own. From a file to a groom in one line:\n"
          "  groomctl fit hair.data --unit cm --head-file body.obj -o out.usda\n"
          "exit status: 0 done, 1 refused or failed, 2 wrong usage, 130 interrupted\n",
          out);
}

void usage_print_command(FILE *out, const struct command *command)
{
    fprintf(out, "usage: groomctl %s%s%s%s\n%s\n", command->name, command->operands[0] ? " " : "",
            command->operands, command->options ? " [options]" : "", command->summary);
    if (command->options)
        fputs("\n", out);
    print_options(out, command->options);
    fputs("\noptions of every command:\n", out);
    print_options(out, groomctl_global_options);
}

int groomctl_usage_error(const char *command, const char *format, ...)
{
    va_list arguments;
    fprintf(stderr, "groomctl%s%s: ", command ? " " : "", command ? command : "");
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fprintf(stderr, "\n  see: groomctl %s%s--help\n", command ? command : "", command ? " " : "");
    return WRONG_USAGE;
}
