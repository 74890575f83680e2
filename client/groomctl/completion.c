/* completion: what makes a shell complete commands, options, their values, ids and files; printed from
 * the same tables as the help.
 *   source <(groomctl completion bash)         zsh: source <(groomctl completion zsh) */
#include <stdio.h>
#include <string.h>

#include "client/groomctl/groomctl.h"

/* Values of options that have few. */
static const struct choice {
    const char *option, *values;
} choices[] = {
    {"unit", "m cm mm dm in"},
    {"head-unit", "m cm mm dm in"},
    {"up", "y z"},
    {"head-up", "y z"},
    {"quality", "draft standard high"},
    {"view", "front side back top"},
    {"light", "camera front"},
    {"style", "straight wavy curly coily short spiky bent"},
    {"state", "queued running succeeded failed cancelled"},
    {"format", "hair usda ply obj data json tfx npy npz monohair ct2hair"},
    {"output-format", "hair usda ply obj data json"},
};

static void print_options(const struct option_spec *table)
{
    for (; table && table->name; table++)
        printf(" --%s", table->name);
}

/* Which ids a command's operands name, for `groomctl list`; "" where they are no ids. */
static const char *listed(const struct command *command)
{
    static const struct {
        const char *operand, *list;
    } kinds[] = {{"JOB", "jobs"}, {"GROOM", "grooms"}, {"STRANDS", "strands"}, {"ID", "grooms strands heads jobs"}};
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
        if (!strncmp(command->operands, kinds[i].operand, strlen(kinds[i].operand)))
            return kinds[i].list;
    return strchr(command->operands, '|') && !strncmp(command->operands, "strands", 7) ? "kinds" : "";
}

static void print_bash(void)
{
    fputs("# groomctl completion bash\n"
          "_groomctl_ids() {\n"
          "    local kind\n"
          "    for kind in $1; do groomctl list $kind --limit 50 --json 2>/dev/null |\n"
          "        sed -n 's/.*\"id\":\"\\([a-z]*_[a-z0-9]*\\)\".*/\\1/p'; done\n"
          "}\n"
          "_groomctl() {\n"
          "    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} command= word options ids=\n"
          "    COMPREPLY=()\n"
          "    for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
          "        [[ $word == -* ]] || { command=$word; break; }\n"
          "    done\n"
          "    case $prev in\n", stdout);
    for (size_t i = 0; i < sizeof choices / sizeof choices[0]; i++)
        printf("        --%s) COMPREPLY=($(compgen -W '%s' -- \"$cur\")); return ;;\n", choices[i].option, choices[i].values);
    fputs("    esac\n    case $command in\n        '') options='", stdout);
    for (const struct command *c = groomctl_commands; c->name; c++)
        printf("%s%s", c == groomctl_commands ? "" : " ", c->name);
    print_options(groomctl_global_options);
    fputs("' ;;\n", stdout);
    for (const struct command *c = groomctl_commands; c->name; c++) {
        printf("        %s) options='", c->name);
        print_options(c->options);
        print_options(groomctl_global_options);
        printf("' ids='%s' ;;\n", listed(c));
    }
    fputs("    esac\n"
          "    [[ $cur == -* || -z $command ]] && COMPREPLY=($(compgen -W \"$options\" -- \"$cur\")) && return\n"
          "    [[ $ids == kinds ]] && COMPREPLY=($(compgen -W 'strands heads jobs grooms' -- \"$cur\")) && return\n"
          "    [[ -n $ids ]] && COMPREPLY=($(compgen -W \"$(_groomctl_ids \"$ids\")\" -- \"$cur\"))\n"
          "    COMPREPLY+=($(compgen -f -- \"$cur\"))\n"
          "}\n"
          "complete -o filenames -F _groomctl groomctl\n",
          stdout);
}

/* --- zsh ---------------------------------------------------------------------------------------- */

/* Text within single quotes and a description's brackets. */
static void put_description(const char *text)
{
    for (; *text; text++)
        if (*text == '\'')
            fputs("'\\''", stdout);
        else if (strchr("[]:\\", *text))
            printf("\\%c", *text);
        else
            putchar(*text);
}

static const char *values_of(const char *option)
{
    for (size_t i = 0; i < sizeof choices / sizeof choices[0]; i++)
        if (!strcmp(choices[i].option, option))
            return choices[i].values;
    return NULL;
}

/* '(-o --output)'{-o,--output}'[where to]:FILE:_files' */
static void print_zsh_option(const struct option_spec *option)
{
    const char *values = values_of(option->name);
    if (option->letter)
        printf(" '(-%c --%s)'{-%c,--%s}'", option->letter, option->name, option->letter, option->name);
    else
        printf(" '*--%s", option->name);
    putchar('[');
    put_description(option->help);
    putchar(']');
    if (option->value && values)
        printf(":%s:(%s)", option->value, values);
    else if (option->value)
        printf(":%s:%s", option->value, strstr(option->value, "FILE") || strstr(option->value, "FOLDER") ? "_files" : " ");
    putchar('\'');
}

static void print_zsh_options(const struct option_spec *table)
{
    for (; table && table->name; table++)
        print_zsh_option(table);
}

static void print_zsh_operands(const struct command *command)
{
    const char *ids = listed(command);
    if (!strcmp(ids, "kinds"))
        fputs(" '1:kind:(strands heads jobs grooms)'", stdout);
    else if (ids[0])
        printf(" '*:id:_groomctl_ids %s'", ids);
    else if (command->max_operands)
        fputs(" '*:file:_files'", stdout);
}

static void print_zsh(void)
{
    fputs("#compdef groomctl\n"
          "# groomctl completion zsh: sourced, or kept as _groomctl in a folder of $fpath\n"
          "_groomctl_ids() {\n"
          "    local kind; local -a ids\n"
          "    for kind in $argv; do\n"
          "        [[ $kind == (grooms|strands|heads|jobs) ]] || continue\n"
          "        ids+=(${(f)\"$(groomctl list $kind --limit 50 --json 2>/dev/null | sed -n 's/.*\"id\":\"\\([a-z]*_[a-z0-9]*\\)\".*/\\1/p')\"})\n"
          "    done\n"
          "    compadd -a ids\n"
          "    _files\n"
          "}\n"
          "_groomctl() {\n"
          "    local context state line; typeset -A opt_args\n"
          "    local -a commands=(\n", stdout);
    for (const struct command *c = groomctl_commands; c->name; c++) {
        printf("        '%s:", c->name);
        put_description(c->summary);
        fputs("'\n", stdout);
    }
    fputs("    )\n    _arguments -C", stdout);
    print_zsh_options(groomctl_global_options);
    fputs(" '1:command:->command' '*::argument:->argument'\n"
          "    case $state in\n"
          "        command) _describe command commands ;;\n"
          "        argument) case $words[1] in\n", stdout);
    for (const struct command *c = groomctl_commands; c->name; c++) {
        printf("            %s) _arguments", c->name);
        print_zsh_options(c->options);
        print_zsh_options(groomctl_global_options);
        print_zsh_operands(c);
        fputs(" ;;\n", stdout);
    }
    fputs("        esac ;;\n    esac\n}\n"
          "if [[ $funcstack[1] == _groomctl ]]; then _groomctl \"$@\"; else\n"
          "    (( $+functions[compdef] )) || { autoload -U compinit && compinit }\n"
          "    compdef _groomctl groomctl\nfi\n", stdout);
}

int command_completion(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *shell = arguments->operands[0];
    (void)ctl;
    if (strcmp(shell, "bash") && strcmp(shell, "zsh"))
        return groomctl_usage_error("completion", "\"%s\" is no shell that it knows; take bash or zsh", shell);
    if (!strcmp(shell, "zsh"))
        print_zsh();
    else
        print_bash();
    return DONE;
}
