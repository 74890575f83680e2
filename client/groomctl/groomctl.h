/* groomctl: the command line of groomd. What every command sees. */
#ifndef GROOMCTL_H
#define GROOMCTL_H

#include <stddef.h>

#include "client/groomctl/arguments.h"
#include "proto/http_client.h"

/* Exit statuses. */
enum { DONE = 0, REFUSED = 1, WRONG_USAGE = 2, INTERRUPTED = 130 };

struct groomctl {
    const char *server;         /* as given; the client has it, too */
    int json;                   /* one JSON object a line on standard output, nothing for people */
    int is_terminal;            /* standard error is one: bars are drawn there */
    struct http_client *client;
};

/* Nonzero once Ctrl-C or SIGTERM came. */
int groomctl_interrupted(void);

struct command {
    const char *name;
    const char *operands;              /* "FILE", "JOB...", for the usage line */
    size_t min_operands, max_operands;
    const struct option_spec *options; /* ends with a NULL name; NULL: none */
    const char *summary;               /* one line */
    int (*run)(struct groomctl *ctl, const struct arguments *arguments);
};

/* All commands, in the order of the help; the table's end has a NULL name. */
extern const struct command groomctl_commands[];
const struct command *groomctl_find_command(const char *name); /* NULL where there is none */
extern const struct option_spec groomctl_global_options[];

/* "groomctl NAME: text" and a hint at --help, on standard error; returns WRONG_USAGE. */
int groomctl_usage_error(const char *command, const char *format, ...) __attribute__((format(printf, 2, 3)));

int command_upload(struct groomctl *ctl, const struct arguments *arguments);
int command_upload_head(struct groomctl *ctl, const struct arguments *arguments);
int command_fit(struct groomctl *ctl, const struct arguments *arguments);
int command_hairline(struct groomctl *ctl, const struct arguments *arguments);
int command_retarget(struct groomctl *ctl, const struct arguments *arguments);
int command_status(struct groomctl *ctl, const struct arguments *arguments);
int command_watch(struct groomctl *ctl, const struct arguments *arguments);
int command_cancel(struct groomctl *ctl, const struct arguments *arguments);
int command_losses(struct groomctl *ctl, const struct arguments *arguments);
int command_list(struct groomctl *ctl, const struct arguments *arguments);
int command_delete(struct groomctl *ctl, const struct arguments *arguments);
int command_get(struct groomctl *ctl, const struct arguments *arguments);
int command_export(struct groomctl *ctl, const struct arguments *arguments);
int command_analyze(struct groomctl *ctl, const struct arguments *arguments);
int command_preview(struct groomctl *ctl, const struct arguments *arguments);
int command_turntable(struct groomctl *ctl, const struct arguments *arguments);
int command_set_guides(struct groomctl *ctl, const struct arguments *arguments);
int command_clusters(struct groomctl *ctl, const struct arguments *arguments);
int command_deliveries(struct groomctl *ctl, const struct arguments *arguments);
int command_whoami(struct groomctl *ctl, const struct arguments *arguments);
int command_audit(struct groomctl *ctl, const struct arguments *arguments);
int command_metrics(struct groomctl *ctl, const struct arguments *arguments);
int command_openapi(struct groomctl *ctl, const struct arguments *arguments);
int command_import(struct groomctl *ctl, const struct arguments *arguments);
int command_set(struct groomctl *ctl, const struct arguments *arguments);
int command_patch(struct groomctl *ctl, const struct arguments *arguments);
int command_ruffle(struct groomctl *ctl, const struct arguments *arguments);
int command_sculpt(struct groomctl *ctl, const struct arguments *arguments);
int command_interpolate(struct groomctl *ctl, const struct arguments *arguments);
int command_curl_scale(struct groomctl *ctl, const struct arguments *arguments);
int command_revisions(struct groomctl *ctl, const struct arguments *arguments);
int command_revert(struct groomctl *ctl, const struct arguments *arguments);
int command_compare(struct groomctl *ctl, const struct arguments *arguments);
int command_sample(struct groomctl *ctl, const struct arguments *arguments);
int command_options(struct groomctl *ctl, const struct arguments *arguments);
int command_completion(struct groomctl *ctl, const struct arguments *arguments);
int command_manual(struct groomctl *ctl, const struct arguments *arguments);
int command_health(struct groomctl *ctl, const struct arguments *arguments);

#endif
