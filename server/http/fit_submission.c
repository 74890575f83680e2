/* Jobs of kind "fit". */
#include <stdlib.h>

#include "groom/fit.h"
#include "server/http/submission.h"

static bool take_inputs(struct request *request, const cJSON *body, cJSON *inputs)
{
    return submission_take_upload(request, body, "strands", "/strands", STORE_STRANDS, true, inputs) &&
           submission_take_upload(request, body, "head", "/head", STORE_HEAD, false, inputs);
}

static groom_status complete_options(const char *json, size_t n, char **complete, struct groom_diag *diag)
{
    struct groom_fit_options *options = malloc(sizeof *options);
    if (!options)
        return GROOM_ENOMEM;
    groom_status status = groom_fit_options_parse(json, n, options, diag);
    if (status == GROOM_OK)
        status = groom_fit_options_print(options, complete, diag);
    free(options);
    return status;
}

const struct job_kind job_kind_fit = {"fit", "strands head", take_inputs, complete_options};
