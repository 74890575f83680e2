/* The handlers, by resource, and the table that names them (routes.c). */
#ifndef HTTP_HANDLERS_H
#define HTTP_HANDLERS_H

#include "server/http/request.h"
#include "server/jobs/jobs.h"

extern const struct route http_routes[];
extern const size_t http_n_routes;

/* about.c: the service itself */
void about_health(struct request *request);
void about_ready(struct request *request);
void about_metrics(struct request *request);
void about_options(struct request *request);
void about_openapi(struct request *request);

/* studio.c: the web studio */
void studio_index(struct request *request);
void studio_file(struct request *request);

/* docs.c: the help */
void docs_index(struct request *request);
void docs_file(struct request *request);

/* page.c: the status page */
void page_index(struct request *request);
void page_style(struct request *request);

/* session_calls.c: who asks, and who asked for what */
void session_call_get(struct request *request);
void session_call_post(struct request *request);
void session_call_delete(struct request *request);
void audit_call_list(struct request *request);

/* assets.c: uploads */
/* May the token store so many bytes more? Asks the store. returns  false where it may not (and answered) */
bool assets_check_quota(struct request *request, uint64_t n_bytes);
int assets_check_upload(struct request *request);
void assets_post_strands(struct request *request);
void assets_list_strands(struct request *request);
void assets_get_strands(struct request *request);
void assets_get_strands_data(struct request *request);
void assets_post_head(struct request *request);
void assets_list_heads(struct request *request);
void assets_get_head(struct request *request);
void assets_delete_strands(struct request *request);
void assets_delete_head(struct request *request);
void assets_get_head_data(struct request *request);

/* hairline_calls.c */
void hairline_call_post(struct request *request);

/* uploads.c: uploads in pieces */
void uploads_call_options(struct request *request);
int uploads_check_post(struct request *request);
void uploads_call_post(struct request *request);
void uploads_call_get(struct request *request);
int uploads_check_patch(struct request *request);
void uploads_call_patch(struct request *request);
void uploads_call_delete(struct request *request);

/* job_calls.c, submission.c */
/* Whose job it is, and how many more may wait; of a queue that is full the answer says when to come again. */
void jobs_charge(struct request *request, struct jobs_request *submission);
void jobs_respond(struct request *request, int status, const struct store_job *job);
void jobs_call_post(struct request *request);
void jobs_call_list(struct request *request);
void jobs_call_get(struct request *request);
void jobs_call_delete(struct request *request);
void jobs_call_events(struct request *request);
void jobs_call_losses(struct request *request);
void jobs_call_deliveries(struct request *request); /* webhook_calls.c */

/* work_calls.c: what an attempt asks and tells */
void work_call_job(struct request *request);
void work_call_blob(struct request *request);
void work_call_progress(struct request *request);
int work_check_stage(struct request *request);
void work_call_checkpoint(struct request *request);
void work_call_result(struct request *request);
void work_call_failed(struct request *request);
void work_call_ended(struct request *request);

/* quality_calls.c, report_page.c */
void quality_call_groom(struct request *request);
void quality_call_strands(struct request *request);
void quality_call_picture(struct request *request);
void page_quality(struct request *request);

/* groom_calls.c */
void grooms_call_delete(struct request *request);
/* The contract's answer to everything that makes a revision. */
void grooms_respond_revision(struct request *request, const char *groom_id, uint32_t revision);
void grooms_call_list(struct request *request);
void grooms_call_import(struct request *request);
void grooms_call_get(struct request *request);
int grooms_check_patch(struct request *request);
void grooms_call_patch(struct request *request);
void grooms_call_strands(struct request *request);
void grooms_call_guides(struct request *request);
int grooms_check_guides(struct request *request);
void grooms_call_put_guides(struct request *request);
void grooms_call_revisions(struct request *request);
int grooms_check_edit(struct request *request);
void grooms_call_revert(struct request *request);
/* The revision of the query, 0 where none is named; and its number where that is the latest. return false where
 * they refused (and answered) */
bool grooms_query_revision(struct request *request, uint32_t *revision);
bool grooms_settle_revision(struct request *request, uint32_t *revision);

/* picture_calls.c */
void pictures_call_preview(struct request *request);
void pictures_call_turntable(struct request *request);

/* layer_calls.c */
void work_call_layer(struct request *request);
void work_call_groom(struct request *request);       /* retarget_work.c */
void work_call_preparation(struct request *request); /* retarget_work.c */
void work_call_strands(struct request *request);
void layers_call_ruffle(struct request *request);
void layers_call_sculpt(struct request *request);
void layers_call_interpolate(struct request *request);
void layers_call_curl_scale(struct request *request);
int layers_check(struct request *request);


/* analysis_calls.c: strands in curvature space, of grooms and of uploads */
void analysis_call_groom(struct request *request);
void analysis_call_strands(struct request *request);
void clusters_call_groom(struct request *request);
void clusters_call_strands(struct request *request);

#endif
