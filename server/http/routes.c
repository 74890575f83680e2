/* Every call that groomd answers. proto/openapi.yaml describes each; a test holds the two together. */
#include "server/http/handlers.h"

/* clang-format off */
const struct route http_routes[] = {
    {"GET", "/", studio_index, BODY_NONE, LANE_INLINE, "", 0, NULL},
    {"GET", "/studio/{file}", studio_file, BODY_NONE, LANE_INLINE, "", 0, NULL},
    {"GET", "/status", page_index, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"GET", "/status.css", page_style, BODY_NONE, LANE_INLINE, "", 0, NULL},
    {"GET", "/healthz", about_health, BODY_NONE, LANE_INLINE, "", ROUTE_QUIET, NULL},
    {"GET", "/readyz", about_ready, BODY_NONE, LANE_FAST, "", ROUTE_QUIET, NULL},
    {"GET", "/metrics", about_metrics, BODY_NONE, LANE_FAST, "", ROUTE_QUIET, NULL},
    {"GET", "/openapi.json", about_openapi, BODY_NONE, LANE_INLINE, "", 0, NULL},
    {"GET", "/v1/options", about_options, BODY_NONE, LANE_FAST, "", 0, NULL},

    {"POST", "/v1/strands", assets_post_strands, BODY_BLOB, LANE_SLOW, "format unit up name upload", 0, assets_check_upload},
    {"GET", "/v1/strands", assets_list_strands, BODY_NONE, LANE_FAST, "limit before", 0, NULL},
    {"GET", "/v1/strands/{id}", assets_get_strands, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"DELETE", "/v1/strands/{id}", assets_delete_strands, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"GET", "/v1/strands/{id}/data", assets_get_strands_data, BODY_NONE, LANE_SLOW, "format unit up count vertices", 0, NULL},
    {"GET", "/v1/strands/{id}/analysis", analysis_call_strands, BODY_NONE, LANE_SLOW, "count elements tolerance straight_below wavy_below arrays format", 0, NULL},
    {"GET", "/v1/strands/{id}/clusters", clusters_call_strands, BODY_NONE, LANE_SLOW, "count seed frames", 0, NULL},
    {"POST", "/v1/heads", assets_post_head, BODY_BLOB, LANE_SLOW, "format unit up name upload", 0, assets_check_upload},
    {"GET", "/v1/heads", assets_list_heads, BODY_NONE, LANE_FAST, "limit before", 0, NULL},
    {"GET", "/v1/heads/{id}", assets_get_head, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"DELETE", "/v1/heads/{id}", assets_delete_head, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"GET", "/v1/heads/{id}/data", assets_get_head_data, BODY_NONE, LANE_FAST, "", 0, NULL},

    {"OPTIONS", "/v1/uploads", uploads_call_options, BODY_NONE, LANE_INLINE, "", ROUTE_TUS, NULL},
    {"POST", "/v1/uploads", uploads_call_post, BODY_UPLOAD, LANE_FAST, "", ROUTE_TUS | ROUTE_WAITS, uploads_check_post},
    {"GET", "/v1/uploads/{id}", uploads_call_get, BODY_NONE, LANE_FAST, "", ROUTE_TUS, NULL},
    {"PATCH", "/v1/uploads/{id}", uploads_call_patch, BODY_UPLOAD, LANE_SLOW, "", ROUTE_TUS | ROUTE_WAITS, uploads_check_patch},
    {"DELETE", "/v1/uploads/{id}", uploads_call_delete, BODY_NONE, LANE_FAST, "", ROUTE_TUS, NULL},

    {"POST", "/v1/jobs", jobs_call_post, BODY_MEMORY, LANE_FAST, "", 0, NULL},
    {"GET", "/v1/jobs", jobs_call_list, BODY_NONE, LANE_FAST, "state limit before", 0, NULL},
    {"GET", "/v1/jobs/{id}", jobs_call_get, BODY_NONE, LANE_FAST, "", ROUTE_RESUMES, NULL},
    {"DELETE", "/v1/jobs/{id}", jobs_call_delete, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"GET", "/v1/jobs/{id}/events", jobs_call_events, BODY_NONE, LANE_FAST, "after", 0, NULL},
    {"GET", "/v1/jobs/{id}/losses", jobs_call_losses, BODY_NONE, LANE_FAST, "", 0, NULL},

    {"GET", "/v1/grooms", grooms_call_list, BODY_NONE, LANE_FAST, "limit before", 0, NULL},
    {"POST", "/v1/grooms", grooms_call_import, BODY_FILE, LANE_SLOW, "", 0, NULL},
    {"GET", "/v1/grooms/{id}", grooms_call_get, BODY_NONE, LANE_SLOW, "revision arrays", 0, NULL},
    {"DELETE", "/v1/grooms/{id}", grooms_call_delete, BODY_NONE, LANE_FAST, "", 0, NULL},
    {"PATCH", "/v1/grooms/{id}", grooms_call_patch, BODY_MEMORY, LANE_SLOW, "", 0, grooms_check_patch},
    {"GET", "/v1/grooms/{id}/strands", grooms_call_strands, BODY_NONE, LANE_SLOW, "format revision count unit up", 0, NULL},
    {"GET", "/v1/grooms/{id}/guides", grooms_call_guides, BODY_NONE, LANE_SLOW, "format revision unit up", 0, NULL},
    {"PUT", "/v1/grooms/{id}/guides", grooms_call_put_guides, BODY_FILE, LANE_SLOW, "format unit up", 0, grooms_check_guides},
    {"GET", "/v1/grooms/{id}/revisions", grooms_call_revisions, BODY_NONE, LANE_FAST, "limit before", 0, NULL},
    {"POST", "/v1/grooms/{id}/revert", grooms_call_revert, BODY_MEMORY, LANE_FAST, "", 0, grooms_check_edit},
    {"GET", "/v1/grooms/{id}/preview.png", grooms_call_preview, BODY_NONE, LANE_SLOW, "view size revision", 0, NULL},
    {"GET", "/v1/grooms/{id}/analysis", analysis_call_groom, BODY_NONE, LANE_SLOW, "revision count elements tolerance straight_below wavy_below arrays format", 0, NULL},
    {"GET", "/v1/grooms/{id}/clusters", clusters_call_groom, BODY_NONE, LANE_SLOW, "revision count seed frames", 0, NULL},

    {"POST", "/v1/grooms/{id}/ruffle", layers_call_ruffle, BODY_FILE, LANE_SLOW, "", 0, layers_check},
    {"POST", "/v1/grooms/{id}/sculpt", layers_call_sculpt, BODY_FILE, LANE_SLOW, "", 0, layers_check},
    {"POST", "/v1/grooms/{id}/interpolate", layers_call_interpolate, BODY_FILE, LANE_SLOW, "", 0, layers_check},
    {"POST", "/v1/grooms/{id}/curl-scale", layers_call_curl_scale, BODY_FILE, LANE_SLOW, "", 0, layers_check},
    {"POST", "/v1/strands/{id}/ruffle", layers_call_ruffle, BODY_FILE, LANE_SLOW, "", 0, layers_check},
    {"POST", "/v1/strands/{id}/sculpt", layers_call_sculpt, BODY_FILE, LANE_SLOW, "", 0, layers_check},
    {"POST", "/v1/strands/{id}/interpolate", layers_call_interpolate, BODY_FILE, LANE_SLOW, "", 0, layers_check},
    {"POST", "/v1/strands/{id}/curl-scale", layers_call_curl_scale, BODY_FILE, LANE_SLOW, "", 0, layers_check},

    {"GET", "/v1/work/job", work_call_job, BODY_NONE, LANE_FAST, "", ROUTE_WORK, NULL},
    {"GET", "/v1/work/blobs/{sha256}", work_call_blob, BODY_NONE, LANE_FAST, "", ROUTE_WORK, NULL},
    {"POST", "/v1/work/progress", work_call_progress, BODY_MEMORY, LANE_FAST, "", ROUTE_WORK | ROUTE_QUIET, NULL},
    {"PUT", "/v1/work/checkpoint", work_call_checkpoint, BODY_BLOB, LANE_SLOW, "stage", ROUTE_WORK, work_check_stage},
    {"POST", "/v1/work/result", work_call_result, BODY_FILE, LANE_SLOW, "", ROUTE_WORK, NULL},
    {"POST", "/v1/work/failed", work_call_failed, BODY_MEMORY, LANE_FAST, "", ROUTE_WORK, NULL},
    {"POST", "/v1/work/ended", work_call_ended, BODY_MEMORY, LANE_FAST, "", ROUTE_WORK, NULL},
};
/* clang-format on */
const size_t http_n_routes = sizeof http_routes / sizeof http_routes[0];
