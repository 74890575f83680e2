/* A job that a client asks for. What all kinds share is taken here, what is a kind's own in a file of its own
 * (fit_submission.c, …): each looks at its fields, answers the first that is wrong with its pointer, and leaves
 * inputs and options as the store keeps them. */
#ifndef HTTP_SUBMISSION_H
#define HTTP_SUBMISSION_H

#include <cjson/cJSON.h>

#include "server/http/request.h"

struct submission {
    const struct job_kind *kind;
    char *inputs, *options; /* JSON objects, malloc'ed */
    int32_t priority;
    struct store_webhook_new webhook; /* its texts are the body's */
    size_t n_webhooks;
};

struct job_kind {
    const char *name;    /* "fit" */
    const char *members; /* of its body beside kind, options, priority and webhook, blanks between */
    /* Fills in `inputs`. returns  false where it was refused (and answered) */
    bool (*take_inputs)(struct request *request, const cJSON *body, cJSON *inputs);
    /* All options with their defaults, by the library that will read them: malloc'ed text. Pointers are the options'. */
    groom_status (*complete_options)(const char *json, size_t n, char **complete, struct groom_diag *diag);
};

extern const struct job_kind job_kind_fit, job_kind_retarget;

/* Are all members of the body the kind's own, or every kind's? returns  false where it was refused (and answered) */
bool submission_only_known(struct request *request, const cJSON *body, const struct job_kind *kind);

/* Copies the id of an upload from object[key] to inputs[key], where that upload is there.
 * pointer  of the field in the body: "/source/head"
 * returns  false where it was refused (and answered) */
bool submission_take_upload(struct request *request, const cJSON *object, const char *key, const char *pointer,
                            enum store_asset_kind kind, bool needed, cJSON *inputs);

#endif
