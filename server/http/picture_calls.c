/* Pictures of a groom: stills from a view or a camera of one's own, and turntables. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <zlib.h>

#include "groom/render.h"
#include "server/grooms/grooms.h"
#include "server/http/handlers.h"

#define MOST_FRAMES 120
#define LARGEST_FRAME 1024
#define MOST_PIXELS 40000000u /* of all frames together: about half a minute, and 50 MB */

struct picture {
    struct grooms_shot shot;
    struct groom_render_camera camera;
    struct grooms_turntable turntable;
    bool turns;
    uint32_t revision;
};

/* --- the query ------------------------------------------------------------------------------- */

/* "512" (a square) or "1280x720" */
static bool query_size(struct request *request, uint32_t most, struct grooms_shot *shot)
{
    const char *text = request_query(request, "size");
    unsigned width = 0, height = 0;
    int end = 0;
    shot->width = shot->height = most < 512 ? most : 512;
    if (!text)
        return true;
    bool square = sscanf(text, "%5u%n", &width, &end) == 1 && !text[end];
    bool both = !square && sscanf(text, "%5ux%5u%n", &width, &height, &end) == 2 && !text[end];
    if (square)
        height = width;
    if ((square || both) && width >= GROOM_RENDER_MIN_SIZE && height >= GROOM_RENDER_MIN_SIZE && width <= most && height <= most) {
        shot->width = width;
        shot->height = height;
        return true;
    }
    respond_bad_query(request, "size", "size is \"%.40s\"; it must be pixels of a side (512) or of two (1280x720), each %d to %u",
                      text, GROOM_RENDER_MIN_SIZE, most);
    return false;
}

static bool query_view(struct request *request, struct grooms_shot *shot)
{
    static const char *const of_cameras[] = {"azimuth", "elevation", "distance", "eye", "target", "fov"};
    struct groom_diag diag = {0};
    const char *text = request_query(request, "view");
    if (!text)
        return true;
    for (size_t i = 0; i < sizeof of_cameras / sizeof of_cameras[0]; i++)
        if (request_query(request, of_cameras[i])) {
            respond_bad_query(request, "view", "view is %.20s, and %s is given too; a picture has one camera", text, of_cameras[i]);
            return false;
        }
    if (groom_view_parse(text, &shot->view, &diag) == GROOM_OK) {
        shot->camera = NULL;
        return true;
    }
    respond_bad_query(request, "view", "%s", diag.detail);
    return false;
}

static bool query_place(struct request *request, const char *name, double place[3], int *is_there)
{
    const char *text = request_query(request, name);
    int end = 0;
    if (!text)
        return true;
    *is_there = sscanf(text, "%lf,%lf,%lf%n", &place[0], &place[1], &place[2], &end) == 3 && !text[end];
    for (int k = 0; *is_there && k < 3; k++)
        *is_there = fabs(place[k]) <= 1e6;
    if (!*is_there)
        respond_bad_query(request, name, "%s is \"%.80s\"; it must be x,y,z in metres", name, text);
    return *is_there;
}

static bool query_light(struct request *request, struct groom_render_camera *camera)
{
    const char *text = request_query(request, "light");
    camera->light_stands = text && !strcmp(text, "front");
    if (!text || camera->light_stands || !strcmp(text, "camera"))
        return true;
    respond_bad_query(request, "light", "light is \"%.40s\"; it is one of camera, front", text);
    return false;
}

static bool query_camera(struct request *request, struct groom_render_camera *camera)
{
    const double quarter = 1.5708; /* pi / 2, as people round it */
    if (!request_query_real(request, "azimuth", -100, 100, &camera->azimuth) ||
        !request_query_real(request, "elevation", -quarter, quarter, &camera->elevation) ||
        !request_query_real(request, "distance", 0.001, 1e6, &camera->distance) ||
        !request_query_real(request, "fov", 0.01, 2.8, &camera->fov_y) ||
        !query_place(request, "target", camera->target, &camera->has_target) ||
        !query_place(request, "eye", camera->eye, &camera->is_placed) || !query_light(request, camera))
        return false;
    if (!camera->is_placed)
        return true;
    double apart = 0;
    for (int k = 0; k < 3; k++)
        apart += fabs(camera->eye[k] - camera->target[k]);
    if (camera->has_target && apart > 1e-9)
        return true;
    respond_bad_query(request, camera->has_target ? "eye" : "target", "eye needs a target, another place, to look at");
    return false;
}

static bool query_turntable(struct request *request, struct picture *picture)
{
    uint64_t frames = 36, frame = 0, frame_ms = 100;
    if (!request_query_number(request, "frames", 2, MOST_FRAMES, &frames) ||
        !request_query_number(request, "frame", 0, frames - 1, &frame) ||
        !request_query_number(request, "frame_ms", 10, 10000, &frame_ms))
        return false;
    picture->turns = true;
    picture->camera.all_around = 1;
    picture->turntable = (struct grooms_turntable){.n_frames = (uint32_t)frames, .frame_ms = (uint32_t)frame_ms,
                                                   .one_frame = request_query(request, "frame") != NULL, .frame = (uint32_t)frame};
    uint64_t pixels = (uint64_t)picture->shot.width * picture->shot.height * frames;
    if (picture->turntable.one_frame || pixels <= MOST_PIXELS)
        return true;
    respond_bad_query(request, "frames", "%llu frames of %u x %u pixels are more than %u together; ask for fewer or smaller ones, "
                      "or for each on its own by frame=", (unsigned long long)frames, picture->shot.width, picture->shot.height, MOST_PIXELS);
    return false;
}

/* --- the answer ------------------------------------------------------------------------------- */

/* What the picture depends on, as 32 bits. */
static unsigned long mark_of(const struct picture *p)
{
    const struct groom_render_camera *c = &p->camera;
    char text[512];
    int n = snprintf(text, sizeof text, "%d %ux%u %.9g %.9g %.9g %.9g %d%d%d %.9g,%.9g,%.9g %.9g,%.9g,%.9g %d %u %u %d %u",
                     p->shot.camera ? -1 : (int)p->shot.view, p->shot.width, p->shot.height, c->azimuth, c->elevation, c->distance,
                     c->fov_y, c->is_placed, c->has_target, c->light_stands, c->eye[0], c->eye[1], c->eye[2], c->target[0],
                     c->target[1], c->target[2], p->turns, p->turntable.n_frames, p->turntable.frame_ms, p->turntable.one_frame,
                     p->turntable.frame);
    return crc32(0, (const Bytef *)text, (uInt)n);
}

static void respond_picture(struct request *request, struct picture *picture)
{
    char *png, etag[64];
    size_t n_bytes;
    struct groom_diag diag = {0};
    if (!grooms_query_revision(request, &picture->revision) || !grooms_settle_revision(request, &picture->revision))
        return;
    snprintf(etag, sizeof etag, "%u-%08lx", picture->revision, mark_of(picture));
    if (request_not_modified(request, etag))
        return;
    groom_status status = grooms_preview(request->service->grooms, request->parameter[0], picture->revision, &picture->shot,
                                         picture->turns ? &picture->turntable : NULL, &png, &n_bytes, &diag);
    if (status != GROOM_OK) {
        respond_failure(request, status, &diag);
        return;
    }
    respond_bytes(request, 200, picture->turns && !picture->turntable.one_frame ? "image/apng" : "image/png", png, n_bytes);
    respond_etag(request, "%s", etag);
}

void pictures_call_preview(struct request *request)
{
    struct picture picture = {0};
    picture.shot.camera = &picture.camera;
    if (query_size(request, GROOM_RENDER_MAX_SIZE, &picture.shot) && query_view(request, &picture.shot) &&
        query_camera(request, &picture.camera))
        respond_picture(request, &picture);
}

void pictures_call_turntable(struct request *request)
{
    struct picture picture = {0};
    picture.shot.camera = &picture.camera;
    if (query_size(request, LARGEST_FRAME, &picture.shot) && query_camera(request, &picture.camera) &&
        query_turntable(request, &picture))
        respond_picture(request, &picture);
}
