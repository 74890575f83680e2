/* What commands that queue a job share: inputs by id or by file, options, who is told, and the wait for the end.
 * They return exit statuses; what is wrong has been said. */
#ifndef GROOMCTL_SUBMIT_H
#define GROOMCTL_SUBMIT_H

#include "client/groomctl/api.h"
#include "client/groomctl/unit_hint.h"

/* --output names a format and can be written to: asked before minutes of work, not after. */
int submit_check_output(const char *command, const struct arguments *arguments);

/* Strands or a head: an id stays as it is; anything else is a file to upload.
 * answer  the upload, the caller's to delete */
int submit_input(struct groomctl *ctl, const struct arguments *arguments, enum sized_thing thing, const char *what,
                 cJSON **answer);
/* A hint where hair and head are not in one place. Either may be NULL. */
void submit_hint_where_apart(const cJSON *strands, const cJSON *head);

/* Of --options FILE, or empty. */
int submit_options_file(const struct arguments *arguments, cJSON **options);
/* --option PATH=VALUE, each on top of what there is. */
int submit_options_paths(const char *command, const struct arguments *arguments, cJSON *options);

/* POST /v1/jobs with --priority and --webhook added, once however often the line breaks. body is borrowed. */
int submit_job(struct groomctl *ctl, const char *command, const struct arguments *arguments, cJSON *body, cJSON **job);

/* Say which job it is; where --wait, --output or --groom-id-file ask for it follow it to its end, and write what they
 * ask for. `ended`, where not NULL, is told of the job that has succeeded. */
int submit_follow(struct groomctl *ctl, const struct arguments *arguments, const cJSON *job,
                  void (*ended)(struct groomctl *ctl, const cJSON *job));

#endif
