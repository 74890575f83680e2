/* attempt: one attempt of one job, from the order to the result. */
#include <cjson/cJSON.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/document.h"
#include "groom/fit.h"
#include "groom/format.h"
#include "groom/mesh.h"
#include "groom/quality.h"
#include "groom/strands.h"
#include "proto/work.h"
#include "server/worker/blob.h"
#include "server/worker/checkpoint.h"
#include "server/worker/edit_attempt.h"
#include "server/worker/progress_report.h"
#include "server/worker/retarget_attempt.h"
#include "server/worker/worker.h"

static volatile sig_atomic_t stop;

static void on_signal(int number) { stop = number; }

struct attempt {
    int watched;
    struct work_link link;
    struct order order;
    struct groom_context context;
    struct progress_report report;
    struct checkpoints checkpoints;
    struct groom_strands *strands;
    struct groom_mesh *head;
    struct groom_fit *fit;
    struct groom *groom;  /* of the fit, once it is done */
    char *fit_report, *quality; /* JSON; quality: NULL where the strands cannot be compared */
    struct groom_diag diag;
};

/* --- what is needed ----------------------------------------------------------------------- */

static groom_status take_order(struct attempt *a)
{
    struct http_response response;
    groom_status st = work_link_call(&a->link, &(struct http_request){.method = "GET", .path = WORK_PATH_JOB},
                                     &response, &a->diag);
    if (st == GROOM_OK)
        st = order_parse(response.body, response.n_body, &a->order, &a->diag);
    http_response_finish(&response);
    if (st == GROOM_OK && strcmp(a->order.kind, "fit") && !order_is_edit(&a->order) && !order_is_retargeting(&a->order))
        st = groom_fail_field(&a->diag, GROOM_EINVAL, "/kind",
                              "this worker runs fits, edits in curvature space and retargetings, not jobs of kind \"%.15s\"",
                              a->order.kind);
    return st;
}

static groom_status read_strands(struct attempt *a, const struct blob *blob)
{
    struct groom_memory_source memory;
    struct groom_source source = groom_source_from_memory(&memory, blob->bytes, blob->n_bytes);
    struct groom_read_options options = {.frame = a->order.strands.frame};
    groom_status st = GROOM_OK;
    if (a->order.strands.format[0])
        st = groom_format_parse(a->order.strands.format, &options.format, &a->diag);
    if (st == GROOM_OK)
        st = groom_strands_read(&source, &options, &a->context, &a->strands, NULL, &a->diag);
    return st;
}

static groom_status read_head(struct attempt *a, const struct blob *blob)
{
    struct groom_memory_source memory;
    struct groom_source source = groom_source_from_memory(&memory, blob->bytes, blob->n_bytes);
    struct groom_mesh_read_options options = {.frame = a->order.head.frame};
    groom_status st = GROOM_OK;
    if (a->order.head.format[0])
        st = groom_mesh_format_parse(a->order.head.format, &options.format, &a->diag);
    if (st == GROOM_OK)
        st = groom_mesh_read(&source, &options, &a->context, &a->head, NULL, &a->diag);
    return st;
}

static groom_status take_input(struct attempt *a, const struct order_input *input,
                               groom_status (*read)(struct attempt *a, const struct blob *blob))
{
    struct blob blob;
    if (!input->blob.sha256[0])
        return GROOM_OK;
    groom_status st = blob_fetch(&a->link, &input->blob, &blob, &a->diag);
    if (st != GROOM_OK)
        return st;
    st = read(a, &blob);
    blob_release(&blob);
    return st;
}

static groom_status make_fit(struct attempt *a)
{
    struct groom_fit_options *options = malloc(sizeof *options);
    groom_status st;
    if (!options)
        return groom_fail(&a->diag, GROOM_ENOMEM, "no memory for the options");
    st = groom_fit_options_parse(a->order.options, strlen(a->order.options), options, &a->diag);
    if (st == GROOM_OK)
        st = groom_fit_create(a->strands, a->head, options, &a->context, &a->fit, &a->diag);
    free(options);
    groom_strands_destroy(a->strands);
    a->strands = NULL;
    return st;
}

static groom_status take_up(struct attempt *a)
{
    groom_status st = GROOM_OK;
    if (a->order.checkpoint.sha256[0])
        st = checkpoints_load(a->fit, &a->order.checkpoint, &a->link, &a->context, &a->diag);
    if (st == GROOM_OK)
        checkpoints_init(&a->checkpoints, a->fit);
    if (st == GROOM_OK)
        progress_report_follow(&a->report, a->fit);
    return st;
}

/* --- the work ---------------------------------------------------------------------------------- */

/* A checkpoint that cannot be kept (the daemon's disk is full) costs safety, not the job. */
static groom_status save(struct attempt *a)
{
    struct groom_diag diag = {0};
    groom_status st = checkpoints_save(&a->checkpoints, a->fit, 0, &a->link, &diag);
    if (st == GROOM_OK || st == GROOM_ECANCELLED)
        return st;
    fprintf(stderr, "groom-worker: warning: a checkpoint was not taken: %s\n", diag.detail);
    return GROOM_OK;
}

static groom_status work(struct attempt *a)
{
    groom_status st = progress_report_send(&a->report, 1);
    while (st == GROOM_OK && !groom_fit_done(a->fit)) {
        uint32_t stage = checkpoints_stage(a->fit);
        st = groom_fit_step(a->fit, &a->context, &a->diag);
        if (st == GROOM_OK)
            st = save(a);
        if (st == GROOM_OK)
            st = progress_report_send(&a->report, checkpoints_stage(a->fit) != stage);
    }
    return st;
}

/* --- the result --------------------------------------------------------------------------------- */

/* What the fit has made; the fit itself gives its memory back. */
static groom_status take_groom(struct attempt *a)
{
    groom_status st = groom_fit_report_print(a->fit, &a->fit_report, &a->diag);
    if (st == GROOM_OK)
        st = groom_fit_result(a->fit, &a->context, &a->groom, &a->diag);
    if (st != GROOM_OK)
        return st;
    snprintf(a->groom->name, sizeof a->groom->name, "%s", a->order.strands.name);
    progress_report_compare(&a->report);
    groom_fit_destroy(a->fit);
    a->fit = NULL;
    return GROOM_OK;
}

static groom_status compare(struct attempt *a, struct groom_diag *diag)
{
    struct groom_quality_target *target = NULL;
    struct groom_quality fitted, drawn;
    groom_status st = take_input(a, &a->order.strands, read_strands);
    if (st != GROOM_OK)
        *diag = a->diag;
    if (st == GROOM_OK)
        st = groom_quality_target_create(a->strands, a->head, NULL, &a->context, &target, diag);
    groom_strands_destroy(a->strands);
    a->strands = NULL;
    if (st == GROOM_OK)
        st = groom_quality_of_groom(target, a->groom, &a->context, &fitted, &drawn, diag);
    if (st == GROOM_OK)
        st = groom_quality_print(&fitted, &drawn, &a->quality, diag);
    groom_quality_target_destroy(target);
    return st;
}

/* A groom without a report is still a groom: one strand alone, say, cannot be cut into halves. */
static groom_status measure(struct attempt *a)
{
    struct groom_diag diag = {0};
    groom_status st = progress_report_send(&a->report, 1);
    if (st == GROOM_OK)
        st = compare(a, &diag);
    if (st == GROOM_OK || st == GROOM_ECANCELLED)
        return st;
    fprintf(stderr, "groom-worker: warning: there is no quality report: %s\n", diag.detail);
    return GROOM_OK;
}

/* The members of the document that the model does not own. */
static char *surroundings(const struct attempt *a)
{
    cJSON *around = cJSON_CreateObject(), *source, *fit;
    cJSON_AddStringToObject(around, "name", a->order.strands.name);
    source = cJSON_AddObjectToObject(around, "source");
    cJSON_AddStringToObject(source, "strands", a->order.strands.id);
    if (a->order.head.id[0])
        cJSON_AddStringToObject(source, "head", a->order.head.id);
    else
        cJSON_AddNullToObject(source, "head");
    cJSON_AddStringToObject(source, "job", a->order.job);
    fit = cJSON_Parse(a->fit_report);
    if (!fit)
        fit = cJSON_CreateObject();
    cJSON_AddItemToObject(fit, "options", cJSON_Parse(a->order.options));
    cJSON_AddItemToObject(around, "fit", fit);
    if (a->quality)
        cJSON_AddRawToObject(around, "quality", a->quality);
    char *text = cJSON_PrintUnformatted(around);
    cJSON_Delete(around);
    return text;
}

static groom_status write_result(struct attempt *a, char **json, size_t *n_bytes)
{
    char *around = surroundings(a);
    groom_status st = groom_document_write(a->groom, around, NULL, json, n_bytes, &a->diag);
    free(around);
    return st;
}

static groom_status deliver(struct attempt *a)
{
    char *json = NULL;
    size_t n_bytes = 0;
    groom_status st = progress_report_send(&a->report, 1);
    if (st == GROOM_OK)
        st = write_result(a, &json, &n_bytes);
    if (st == GROOM_OK)
        st = work_link_call(&a->link,
                            &(struct http_request){.method = "POST",
                                                   .path = WORK_PATH_RESULT,
                                                   .content_type = "application/json",
                                                   .body = json,
                                                   .n_body = n_bytes},
                            NULL, &a->diag);
    free(json);
    return st;
}

/* --- ways to end ----------------------------------------------------------------------------------- */

/* Asked to end from outside, the next attempt is to find everything that this one has done. */
static int leave(struct attempt *a)
{
    struct groom_diag ignored;
    a->link.closing = 1;
    if (stop && a->fit && checkpoints_save(&a->checkpoints, a->fit, 1, &a->link, &ignored) != GROOM_OK)
        fprintf(stderr, "groom-worker: the last checkpoint was not taken\n");
    if (a->watched && a->report.cancelled) /* it need not wait for the cluster to notice */
        work_link_farewell(&a->link, a->link.why);
    fprintf(stderr, "groom-worker: stopped: %s\n", stop ? "asked to, by a signal" : a->link.why);
    return WORK_EXIT_STOPPED;
}

static int fail(struct attempt *a, groom_status status)
{
    char *text = worker_problem_text(status, &a->diag);
    struct http_request request = {.method = "POST",
                                   .path = WORK_PATH_FAILED,
                                   .content_type = "application/json",
                                   .body = text,
                                   .n_body = text ? strlen(text) : 0};
    fprintf(stderr, "groom-worker: failed: %s\n", text ? text : groom_status_message(status));
    groom_status st = text ? work_link_call(&a->link, &request, NULL, NULL) : GROOM_ENOMEM;
    free(text);
    return st == GROOM_OK ? WORK_EXIT_FAILED : WORK_EXIT_STOPPED;
}

static void release(struct attempt *a)
{
    free(a->fit_report);
    free(a->quality);
    groom_destroy(a->groom);
    groom_fit_destroy(a->fit);
    groom_mesh_destroy(a->head);
    groom_strands_destroy(a->strands);
    checkpoints_finish(&a->checkpoints);
    order_finish(&a->order);
    groom_pool_destroy(a->context.pool);
    work_link_close(&a->link);
    free(a);
}

static groom_status run_edit(struct attempt *a)
{
    groom_status st = take_input(a, &a->order.head, read_head);
    return st == GROOM_OK ? edit_attempt(&a->link, a->head, &a->context, &a->report, &a->diag) : st;
}

static groom_status run(struct attempt *a)
{
    groom_status st = take_order(a);
    if (st == GROOM_OK && order_is_edit(&a->order))
        return run_edit(a);
    if (st == GROOM_OK && order_is_retargeting(&a->order))
        return retarget_attempt(&a->link, &a->order, &a->context, &a->report, &a->diag);
    if (st == GROOM_OK)
        st = take_input(a, &a->order.strands, read_strands);
    if (st == GROOM_OK)
        st = take_input(a, &a->order.head, read_head);
    if (st == GROOM_OK)
        st = make_fit(a);
    if (st == GROOM_OK)
        st = take_up(a);
    if (st == GROOM_OK)
        st = work(a);
    if (st == GROOM_OK)
        st = take_groom(a);
    if (st == GROOM_OK)
        st = measure(a);
    if (st == GROOM_OK)
        st = deliver(a);
    return st;
}

static int attempt(const char *url, const char *token, int watched)
{
    struct attempt *a = calloc(1, sizeof *a);
    if (!a || !work_link_open(&a->link, url, token, &stop)) {
        free(a);
        return WORK_EXIT_STOPPED;
    }
    a->watched = watched;
    progress_report_init(&a->report, &a->link);
    a->context.progress = &a->report.callbacks;
    groom_status st = groom_pool_create(worker_threads(), &a->context.pool);
    if (st == GROOM_OK)
        st = run(a);
    int status = st == GROOM_OK ? WORK_EXIT_DONE : st == GROOM_ECANCELLED ? leave(a) : fail(a, st);
    release(a);
    return status;
}

int worker_attempt(int argc, char **argv)
{
    const char *url = getenv(WORK_ENV_URL), *token = getenv(WORK_ENV_TOKEN);
    struct sigaction action = {.sa_handler = on_signal};
    int watched = argc == 2 && !strcmp(argv[1], "--watched"), status;
    if (argc != 1 + watched || !url || !token) {
        fputs("groom-worker attempt: takes no argument but --watched; " WORK_ENV_URL " and " WORK_ENV_TOKEN
              " name the work. groomd starts it.\n",
              stderr);
        return WORK_EXIT_USAGE;
    }
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    if (watched && worker_watch(url, token, &status))
        return status;
    return attempt(url, token, watched);
}
