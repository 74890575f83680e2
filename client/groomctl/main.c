/* groomctl: see groomctl.h; the commands stand in commands.c. */
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "client/groomctl/nearest.h"
#include "client/groomctl/token.h"
#include "client/groomctl/usage.h"

static volatile sig_atomic_t interrupted;

static void on_signal(int number) { interrupted = number; }

int groomctl_interrupted(void) { return interrupted != 0; }

static int is_interrupted(void *user) { return interrupted != 0; }

/* The first Ctrl-C lets a command end cleanly; the second ends the process. */
static void catch_signals(void)
{
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = (int)SA_RESETHAND};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
}

static const char *setting(const struct arguments *first, const struct arguments *second, const char *name,
                           const char *variable, const char *otherwise)
{
    const char *value = argument(second, name);
    if (!value)
        value = argument(first, name);
    if (!value)
        value = getenv(variable);
    return value && *value ? value : otherwise;
}

static int open_client(struct groomctl *ctl, const struct arguments *global,
                       const struct arguments *arguments, const char *token)
{
    ctl->json = argument(global, "json") || argument(arguments, "json");
    ctl->is_terminal = isatty(STDERR_FILENO);
    ctl->server = setting(global, arguments, "server", "GROOM_SERVER", "http://127.0.0.1:8080");
    ctl->client = http_client_create(
        &(struct http_client_options){.base_url = ctl->server,
                                      .token = token[0] ? token : NULL,
                                      .agent = "groomctl",
                                      .interrupted = is_interrupted});
    return ctl->client != NULL;
}

static int run(const struct command *command, const struct arguments *global,
               const struct arguments *arguments)
{
    struct groomctl ctl;
    char token[TOKEN_SIZE];
    if (arguments->n_operands < command->min_operands)
        return groomctl_usage_error(command->name, "%s is missing", command->operands);
    if (arguments->n_operands > command->max_operands)
        return groomctl_usage_error(command->name, "\"%s\" is too much",
                                    arguments->operands[command->max_operands]);
    if (!token_find(global, arguments, token))
        return WRONG_USAGE;
    if (!open_client(&ctl, global, arguments, token))
        return REFUSED;
    int status = command->run(&ctl, arguments);
    http_client_destroy(ctl.client);
    return interrupted && status != DONE ? INTERRUPTED : status;
}

static int unknown_command(const char *name)
{
    struct nearest nearest;
    nearest_init(&nearest, name, strlen(name));
    for (const struct command *c = groomctl_commands; c->name; c++)
        nearest_offer(&nearest, c->name);
    if (nearest.name)
        return groomctl_usage_error(NULL, "there is no command \"%s\"; %s is one", name, nearest.name);
    return groomctl_usage_error(NULL, "there is no command \"%s\"", name);
}

int main(int argc, char **argv)
{
    static struct arguments global, arguments;
    int read = 0;
    if (!arguments_parse(argc - 1, argv + 1, groomctl_global_options, NULL, 1, &read, &global))
        return groomctl_usage_error(NULL, "%s", global.complaint);
    if (argument(&global, "help") && read + 1 == argc)
        return usage_print(stdout), DONE;
    if (read + 1 == argc)
        return usage_print(stderr), WRONG_USAGE;
    const struct command *command = groomctl_find_command(argv[read + 1]);
    if (!command)
        return unknown_command(argv[read + 1]);
    if (!arguments_parse(argc - read - 2, argv + read + 2, groomctl_global_options, command->options, 0, NULL,
                         &arguments))
        return groomctl_usage_error(command->name, "%s", arguments.complaint);
    if (argument(&global, "help") || argument(&arguments, "help"))
        return usage_print_command(stdout, command), DONE;
    catch_signals();
    return run(command, &global, &arguments);
}
