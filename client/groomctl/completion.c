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

int command_completion(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *shell = arguments->operands[0];
    (void)ctl;
    if (strcmp(shell, "bash") && strcmp(shell, "zsh"))
        return groomctl_usage_error("completion", "\"%s\" is no shell that it knows; take bash or zsh", shell);
    if (!strcmp(shell, "zsh")) /* zsh runs bash's completions */
        fputs("autoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n", stdout);
    print_bash();
    return DONE;
}
