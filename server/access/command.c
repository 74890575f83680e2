#include "server/access/command.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cjson/cJSON.h>

#include "server/access/access.h"
#include "server/config.h"

#define MAX_ARGUMENTS 64

static const char usage[] =
    "usage: groomd token create --name NAME [--project NAME] [--scopes LIST] [--expires TIME]\n"
    "                           [--requests-per-second N] [--bytes N] [--queued N] [--data DIR]\n"
    "       groomd token list [--json] [--data DIR]\n"
    "       groomd token revoke ID [--data DIR]\n\n"
    "Tokens of a data folder, whether a daemon runs on it or not. A token is printed once, when it is made.\n"
    "From the first one on groomd asks for a token with each request.\n\n"
    "  --name NAME              whose it is, for people\n"
    "  --project NAME           whose strands, jobs and grooms it sees, and no others [default]\n"
    "  --scopes LIST            of read (look), submit (upload, queue, edit), admin (audit, figures, jobs ahead of\n"
    "                           others) and work (which attempts have by themselves) [read,submit]\n"
    "  --expires TIME           12h, 90d: good for so long; never where absent\n"
    "  --requests-per-second N  on average; else the daemon's --token-requests\n"
    "  --bytes N                of its uploads (10G); else the daemon's --token-bytes\n"
    "  --queued N               of its jobs that wait; else the daemon's --token-queued\n"
    "  --json                   one JSON object a line\n";

struct wanted {
    struct config config;
    struct access_token token;
    const char *operand;
    bool json;
};

static int complain(const struct groom_diag *diag, int status)
{
    fprintf(stderr, "groomd token: %s\n", diag->detail);
    return status;
}

/* --- the arguments ------------------------------------------------------------------------ */

static groom_status take_text(const char *name, const char *value, char text[ACCESS_TEXT_SIZE],
                              struct groom_diag *diag)
{
    if (!value[0] || strlen(value) >= ACCESS_TEXT_SIZE)
        return groom_fail(diag, GROOM_EINVAL, "%s has 1 to %d bytes", name, ACCESS_TEXT_SIZE - 1);
    for (const char *c = value; *c; c++)
        if (iscntrl((unsigned char)*c))
            return groom_fail(diag, GROOM_EINVAL, "%s has no control characters", name);
    strcpy(text, value);
    return GROOM_OK;
}

/* A number with one of the suffixes behind it; factors[i] belongs to suffixes[i]. */
static groom_status take_number(const char *name, const char *value, const char *suffixes, const uint64_t *factors,
                                uint64_t *number, struct groom_diag *diag)
{
    char *end;
    errno = 0;
    uint64_t read = isdigit((unsigned char)value[0]) ? strtoull(value, &end, 10) : 0, factor = 1;
    const char *suffix = read && *end ? strchr(suffixes, *end) : NULL;
    if (suffix)
        factor = factors[suffix - suffixes];
    if (errno || !read || (*end && (!suffix || end[1])) || read > (uint64_t)1 << 52 || read * factor > (uint64_t)1 << 52)
        return groom_fail(diag, GROOM_EINVAL, "%s: \"%.40s\" is not a number from 1 (%s may stand behind it)", name,
                          value, suffixes[0] ? suffixes : "nothing");
    *number = read * factor;
    return GROOM_OK;
}

static groom_status take_option(struct wanted *wanted, const char *name, const char *value, struct groom_diag *diag)
{
    static const uint64_t times[] = {1, 60, 3600, 86400}, sizes[] = {1 << 10, 1 << 20, 1 << 30, (uint64_t)1 << 40};
    struct access_token *token = &wanted->token;
    uint64_t seconds;
    if (!strcmp(name, "--name"))
        return take_text(name, value, token->name, diag);
    if (!strcmp(name, "--project"))
        return take_text(name, value, token->project, diag);
    if (!strcmp(name, "--scopes") || !strcmp(name, "--scope"))
        return access_scopes_parse(value, &token->scopes, diag);
    if (!strcmp(name, "--requests-per-second"))
        return take_number(name, value, "", NULL, &token->limits.requests_per_s, diag);
    if (!strcmp(name, "--bytes"))
        return take_number(name, value, "KMGT", sizes, &token->limits.bytes, diag);
    if (!strcmp(name, "--queued"))
        return take_number(name, value, "", NULL, &token->limits.queued, diag);
    groom_status status = take_number(name, value, "smhd", times, &seconds, diag);
    if (status == GROOM_OK)
        token->expires_ms = (int64_t)(time(NULL) + (time_t)seconds) * 1000;
    return status;
}

static bool is_own(const char *name)
{
    static const char *const own[] = {"--name", "--project", "--scopes", "--scope", "--expires",
                                      "--requests-per-second", "--bytes", "--queued"};
    for (size_t i = 0; i < sizeof own / sizeof own[0]; i++)
        if (!strcmp(name, own[i]))
            return true;
    return false;
}

/* Our own options here; what is left is the daemon's (--data, --config). */
static groom_status take_arguments(struct wanted *wanted, int argc, char *const *argv, char *const *environment,
                                   struct groom_diag *diag)
{
    char *rest[MAX_ARGUMENTS + 1] = {argv[0]};
    int n_rest = 1;
    enum config_action action;
    groom_status status;
    if (argc >= MAX_ARGUMENTS)
        return groom_fail(diag, GROOM_EINVAL, "too many arguments");
    for (int i = 2; i < argc; i++) {
        char name[64];
        size_t n = strcspn(argv[i], "=");
        snprintf(name, sizeof name, "%.*s", (int)n, argv[i]);
        if (!strcmp(name, "--json")) {
            wanted->json = true;
        } else if (is_own(name)) {
            const char *value = argv[i][n] ? argv[i] + n + 1 : ++i < argc ? argv[i] : "";
            if ((status = take_option(wanted, name, value, diag)) != GROOM_OK)
                return status;
        } else if (argv[i][0] != '-' && !wanted->operand) {
            wanted->operand = argv[i];
        } else {
            rest[n_rest++] = argv[i];
            if (!argv[i][n] && i + 1 < argc)
                rest[n_rest++] = argv[++i];
        }
    }
    return config_load(n_rest, rest, environment, &wanted->config, &action, diag);
}

/* --- the three ------------------------------------------------------------------------------ */

static int create(struct wanted *wanted)
{
    struct groom_diag diag = {0};
    char token[ACCESS_TOKEN_SIZE];
    if (!wanted->token.name[0] || wanted->operand) {
        fputs(usage, stderr);
        return 2;
    }
    if (!wanted->token.project[0])
        strcpy(wanted->token.project, "default");
    if (!wanted->token.scopes)
        wanted->token.scopes = ACCESS_READ | ACCESS_SUBMIT;
    groom_status status = access_create(wanted->config.data, &wanted->token, token, &diag);
    if (status != GROOM_OK)
        return complain(&diag, status == GROOM_EINVAL ? 2 : 1);
    if (wanted->json)
        printf("{\"id\":\"%s\",\"token\":\"%s\"}\n", wanted->token.id, token);
    else
        printf("%s\n", token);
    fprintf(stderr, "%s of %s, project %s. It is not shown again; send it as `Authorization: Bearer TOKEN`\n",
            wanted->token.id, wanted->token.name, wanted->token.project);
    return 0;
}

static void print_time(int64_t time_ms, const char *none, char text[32])
{
    time_t seconds = (time_t)(time_ms / 1000);
    struct tm utc;
    gmtime_r(&seconds, &utc);
    if (time_ms)
        strftime(text, 32, "%Y-%m-%dT%H:%M:%SZ", &utc);
    else
        snprintf(text, 32, "%s", none);
}

static const char *state_of(const struct access_token *token)
{
    if (token->revoked_ms)
        return "revoked";
    return token->expires_ms && token->expires_ms <= (int64_t)time(NULL) * 1000 ? "expired" : "good";
}

static void print_json(const struct access_token *token, const char *scopes)
{
    char created[32], expires[32];
    cJSON *object = cJSON_CreateObject();
    print_time(token->created_ms, "", created);
    print_time(token->expires_ms, "", expires);
    cJSON_AddStringToObject(object, "id", token->id);
    cJSON_AddStringToObject(object, "name", token->name);
    cJSON_AddStringToObject(object, "project", token->project);
    cJSON_AddStringToObject(object, "scopes", scopes);
    cJSON_AddStringToObject(object, "state", state_of(token));
    cJSON_AddStringToObject(object, "created_at", created);
    cJSON_AddItemToObject(object, "expires_at", token->expires_ms ? cJSON_CreateString(expires) : cJSON_CreateNull());
    char *text = cJSON_PrintUnformatted(object);
    puts(text ? text : "{}");
    cJSON_free(text);
    cJSON_Delete(object);
}

static int list(const struct wanted *wanted)
{
    struct access_list tokens = {0};
    struct groom_diag diag = {0};
    if (access_list_read(wanted->config.data, &tokens, &diag) != GROOM_OK)
        return complain(&diag, 1);
    if (!wanted->json)
        printf("%-25s %-8s %-16s %-16s %-24s %s\n", "id", "state", "project", "name", "scopes", "expires");
    for (size_t i = 0; i < tokens.n; i++) {
        const struct access_token *token = &tokens.items[i];
        char scopes[ACCESS_TEXT_SIZE], expires[32];
        access_scopes_print(token->scopes, scopes);
        print_time(token->expires_ms, "never", expires);
        if (wanted->json)
            print_json(token, scopes);
        else
            printf("%-25s %-8s %-16s %-16s %-24s %s\n", token->id, state_of(token), token->project, token->name,
                   scopes, expires);
    }
    access_list_finish(&tokens);
    return 0;
}

static int revoke(const struct wanted *wanted)
{
    struct groom_diag diag = {0};
    if (!wanted->operand) {
        fputs(usage, stderr);
        return 2;
    }
    if (access_revoke(wanted->config.data, wanted->operand, &diag) != GROOM_OK)
        return complain(&diag, 1);
    fprintf(stderr, "%s is revoked\n", wanted->operand);
    return 0;
}

int access_command(int argc, char *const *argv, char *const *environment)
{
    static struct wanted wanted;
    struct groom_diag diag = {0};
    const char *what = argc > 1 ? argv[1] : "";
    for (int i = 1; i < argc; i++)
        if (!strcmp(argv[i], "--help") || !strcmp(argv[i], "-h")) {
            fputs(usage, stdout);
            return 0;
        }
    if (take_arguments(&wanted, argc, argv, environment, &diag) != GROOM_OK)
        return complain(&diag, 2);
    if (!strcmp(what, "create"))
        return create(&wanted);
    if (!strcmp(what, "list"))
        return list(&wanted);
    if (!strcmp(what, "revoke"))
        return revoke(&wanted);
    fputs(usage, stderr);
    return 2;
}
