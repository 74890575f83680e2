/* manual: the man page, in roff, printed from the tables of the help: groomctl manual | man -l - */
#include <stdio.h>

#include "client/groomctl/groomctl.h"

/* Text as roff has it: hyphens that are to be typed, and no line that begins like a request. */
static void put(const char *text)
{
    for (const char *at = text; *at; at++)
        if (*at == '-')
            fputs("\\-", stdout);
        else if (*at == '\\')
            fputs("\\e", stdout);
        else if (at == text && (*at == '.' || *at == '\''))
            printf("\\&%c", *at);
        else
            putchar(*at);
}

static void print_options(const struct option_spec *table)
{
    for (; table && table->name; table++) {
        fputs(".TP\n", stdout);
        if (table->letter)
            printf("\\fB\\-%c\\fR, ", table->letter);
        fputs("\\fB\\-\\-", stdout);
        put(table->name);
        fputs("\\fR", stdout);
        if (table->value)
            printf(" \\fI%s\\fR", table->value);
        putchar('\n');
        put(table->help);
        putchar('\n');
    }
}

static void print_command(const struct command *command)
{
    fputs(".SS ", stdout);
    put(command->name);
    printf(" %s\n", command->operands);
    put(command->summary);
    fputs(".\n", stdout);
    print_options(command->options);
}

int command_manual(struct groomctl *ctl, const struct arguments *arguments)
{
    (void)ctl, (void)arguments;
    fputs(".TH GROOMCTL 1 \"\" groomd \"User Commands\"\n"
          ".SH NAME\ngroomctl \\- upload hair, fit procedural grooms, edit and export them\n"
          ".SH SYNOPSIS\n.B groomctl\n[\\fB\\-\\-server\\fR \\fIURL\\fR] [\\fB\\-\\-json\\fR] \\fICOMMAND\\fR ...\n"
          ".SH DESCRIPTION\nThe command line of groomd, which turns captured hair strands into guides and a chain of operators.\n"
          "From a file to a groom in one line:\n.PP\n.EX\n"
          "groomctl fit hair.data \\-\\-unit cm \\-\\-head\\-file body.obj \\-o out.usda\n.EE\n"
          ".SH COMMANDS\n",
          stdout);
    for (const struct command *c = groomctl_commands; c->name; c++)
        print_command(c);
    fputs(".SH OPTIONS OF EVERY COMMAND\n", stdout);
    print_options(groomctl_global_options);
    fputs(".SH EXIT STATUS\n0 done, 1 refused or failed, 2 wrong usage, 130 interrupted.\n"
          ".SH ENVIRONMENT\n.TP\n.B GROOM_SERVER\nthe daemon's address\n.TP\n.B GROOMD_TOKEN\nwho is asking\n"
          ".SH FILES\n.TP\n.I ~/.config/groom/token\nthe token, where nothing else names one\n"
          ".TP\n.I ~/.local/state/groomctl/upload\\-*\nuploads that were interrupted; the same command goes on with them\n"
          ".SH EXAMPLES\nStep by step:\n.PP\n.EX\n"
          "groomctl upload hair.data \\-\\-unit cm\n"
          "groomctl fit str_... \\-\\-head\\-file head.obj \\-\\-wait\n"
          "groomctl set grm_... /operators/2/radius=0.008\n"
          "groomctl turntable grm_... \\-o turn.png\n"
          "groomctl export grm_... \\-o groom.usda \\-\\-unit cm\n.EE\n"
          ".PP\nAll jobs at once:\n.PP\n.EX\ngroomctl watch \\-\\-all\n.EE\n"
          ".SH SHELLS\nsource <(groomctl completion bash), or zsh\n",
          stdout);
    return DONE;
}
