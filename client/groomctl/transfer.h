/* Files up and down, with a bar on a terminal. */
#ifndef GROOMCTL_TRANSFER_H
#define GROOMCTL_TRANSFER_H

#include "client/groomctl/api.h"
#include "client/groomctl/unit_hint.h"

/* How a file is to be read; members may be NULL. */
struct upload_options {
    const char *format, *unit, *up, *name;
    const char *resumable_from; /* bytes from which on a file is sent so that it can be gone on with */
};
/* From --format, --unit, --up, --name and --resumable-from. */
struct upload_options upload_options_of(const struct arguments *arguments);

/* Post a file. answer: the resource, the caller's to delete, on DONE. */
int upload_file(struct groomctl *ctl, enum sized_thing thing, const char *path, const struct upload_options *options,
                cJSON **answer);
/* What has come of it, for people; hints and warnings on standard error. */
void upload_describe(const struct groomctl *ctl, enum sized_thing thing, const struct upload_options *options,
                     const cJSON *answer);

/* The box of an upload's answer, metres; returns 0 where it has none. */
int upload_box(const cJSON *answer, struct sized_box *box);

/* The body of a GET into a file ("-": standard output). */
int download_file(struct groomctl *ctl, const char *url_path, const char *path);
/* After it: the file's name for people or, with --json, as an object. returns  status */
int download_said(const struct groomctl *ctl, const char *path, int status);

/* The format that a path's extension asks for, or NULL. */
const char *format_of_path(const char *path);

#endif
