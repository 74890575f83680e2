#include "client/groomctl/token.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *option(const struct arguments *global, const struct arguments *arguments, const char *name)
{
    const char *value = argument(arguments, name);
    return value ? value : argument(global, name);
}

/* Its first line. */
static int read_file(const char *path, char token[TOKEN_SIZE])
{
    FILE *file = fopen(path, "re");
    if (!file)
        return 0;
    if (!fgets(token, TOKEN_SIZE, file))
        token[0] = 0;
    fclose(file);
    token[strcspn(token, " \t\r\n")] = 0;
    return 1;
}

static void read_default(char token[TOKEN_SIZE])
{
    char path[1024];
    const char *folder = getenv("XDG_CONFIG_HOME"), *home = getenv("HOME");
    if (folder && *folder)
        snprintf(path, sizeof path, "%s/groom/token", folder);
    else if (home && *home)
        snprintf(path, sizeof path, "%s/.config/groom/token", home);
    else
        return;
    (void)read_file(path, token);
}

int token_find(const struct arguments *global, const struct arguments *arguments, char token[TOKEN_SIZE])
{
    const char *value = option(global, arguments, "token"), *path = option(global, arguments, "token-file");
    static const char *const variables[] = {"GROOMD_TOKEN", "GROOM_TOKEN"};
    for (size_t i = 0; !value && !path && i < sizeof variables / sizeof variables[0]; i++) {
        value = getenv(variables[i]);
        value = value && *value ? value : NULL;
    }
    token[0] = 0;
    if (value)
        snprintf(token, TOKEN_SIZE, "%s", value);
    else if (!path)
        read_default(token);
    else if (!read_file(path, token))
        return fprintf(stderr, "groomctl: the token file %s cannot be read: %s\n", path, strerror(errno)), 0;
    return 1;
}
