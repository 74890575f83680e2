/* Following jobs. */
#ifndef GROOMCTL_JOBS_H
#define GROOMCTL_JOBS_H

#include "client/groomctl/api.h"
#include "client/groomctl/progress_bar.h"
#include "proto/event_stream.h"
#include "proto/job.h"

#define JOBS_MAX_WATCHED 64

/* What is known of one job. */
struct job_view {
    char id[64];
    job_state state;
    char stage[32], loss_name[32], groom[64];
    unsigned stage_index, stage_count;
    double progress, eta_s, loss;
    int has_loss;
    int queue_position;       /* -1: not known */
    char problem[512];        /* why it failed */
};

void job_view_init(struct job_view *view, const char *id);
/* Take over what a job resource (GET /v1/jobs/{id}) says. */
void job_view_resource(struct job_view *view, const cJSON *job);
/* Take over an event. Returns 1 where a line of a log should say so: another state or stage, or
 * a tenth of the work. */
int job_view_event(struct job_view *view, const char *event, const cJSON *data);
/* The line that shows it; borrows from the view. `note` has room for what stands at its end. */
void job_view_line(const struct job_view *view, int with_id, char note[64], struct progress_line *line);
/* What has come of an ended job, on standard output, or on standard error where it failed. */
void job_view_print_end(const struct job_view *view);

/* Follow jobs to their ends. with_json: events as JSON lines. Returns DONE where all succeeded,
 * REFUSED, or INTERRUPTED (after saying that they go on). views[n] have their ids set. */
int jobs_watch_all(struct groomctl *ctl, struct job_view *views, size_t n);

/* GET /v1/jobs/{id} into a view. */
int jobs_look(struct groomctl *ctl, struct job_view *view, cJSON **resource);

#endif
