/* Quality reports, and the pictures that go with them. */
#include "server/http/quality_calls.h"

#include <stdio.h>
#include <string.h>

#include "server/http/handlers.h"

bool quality_query(struct request *request, struct grooms_comparison *what)
{
    uint64_t revision = 0;
    if (!request_query_number(request, "revision", 1, UINT32_MAX, &revision))
        return false;
    *what = (struct grooms_comparison){request->parameter[0], (uint32_t)revision, request_query(request, "with")};
    return true;
}

static void respond_report(struct request *request, const struct grooms_comparison *what)
{
    char *json;
    size_t n_bytes;
    struct groom_diag diag = {0};
    groom_status status = grooms_quality(request->service->grooms, what, &json, &n_bytes, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "application/json", json, n_bytes);
}

void quality_call_groom(struct request *request)
{
    struct grooms_comparison what;
    if (quality_query(request, &what))
        respond_report(request, &what);
}

void quality_call_strands(struct request *request)
{
    struct grooms_comparison what = {request->parameter[0], 0, request_query(request, "with")};
    if (what.with)
        respond_report(request, &what);
    else
        respond_bad_query(request, "with", "with is missing: the strands or the groom to compare these with");
}

/* --- pictures ------------------------------------------------------------------------------- */

static bool query_picture(struct request *request, enum grooms_picture *of)
{
    static const char *const names[] = {"target", "groom", "drawn"};
    const char *text = request_query(request, "of");
    *of = GROOMS_PICTURE_GROOM;
    for (size_t i = 0; text && i < sizeof names / sizeof names[0]; i++)
        if (!strcmp(text, names[i])) {
            *of = (enum grooms_picture)i;
            text = NULL;
        }
    if (text)
        respond_bad_query(request, "of", "of is %.40s; it is one of target, groom, drawn", text);
    return !text;
}

static bool query_view(struct request *request, groom_view *view)
{
    struct groom_diag diag = {0};
    const char *text = request_query(request, "view");
    *view = GROOM_VIEW_FRONT;
    if (!text || groom_view_parse(text, view, &diag) == GROOM_OK)
        return true;
    respond_bad_query(request, "view", "%s", diag.detail);
    return false;
}

void quality_call_picture(struct request *request)
{
    struct grooms_comparison what;
    enum grooms_picture of;
    groom_view view;
    uint64_t size = 512;
    char *png;
    size_t n_bytes;
    struct groom_diag diag = {0};
    if (!quality_query(request, &what) || !query_picture(request, &of) || !query_view(request, &view) ||
        !request_query_number(request, "size", GROOM_RENDER_MIN_SIZE, GROOM_RENDER_MAX_SIZE, &size))
        return;
    groom_status status = grooms_quality_picture(request->service->grooms, &what, of, view, (uint32_t)size, &png,
                                                 &n_bytes, &diag);
    if (status != GROOM_OK)
        respond_failure(request, status, &diag);
    else
        respond_bytes(request, 200, "image/png", png, n_bytes);
}
