/* preview and turntable. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "client/groomctl/progress_bar.h"
#include "client/groomctl/transfer.h"
#include "proto/url.h"

/* Degrees for people, radians for the server. returns  0 where it is no number (and said so) */
static int take_degrees(const struct arguments *arguments, const char *command, const char *name, struct url *url)
{
    const char *text = argument(arguments, name);
    char *end, radians[32];
    if (!text)
        return 1;
    double degrees = strtod(text, &end);
    if (end == text || *end || !isfinite(degrees)) {
        groomctl_usage_error(command, "--%s is \"%s\"; it must be a number of degrees", name, text);
        return 0;
    }
    snprintf(radians, sizeof radians, "%.17g", degrees * M_PI / 180);
    url_query(url, name, radians);
    return 1;
}

static int take_camera(const struct arguments *arguments, const char *command, struct url *url)
{
    url_query(url, "size", argument(arguments, "size"));
    url_query(url, "light", argument(arguments, "light"));
    url_query(url, "revision", argument(arguments, "revision"));
    return take_degrees(arguments, command, "azimuth", url) && take_degrees(arguments, command, "elevation", url);
}

static void picture_url(struct url *url, const char *groom, const char *name)
{
    url_init(url, "/v1/grooms");
    url_segment(url, groom);
    url_segment(url, name);
}

int command_preview(struct groomctl *ctl, const struct arguments *arguments)
{
    static const char *const plain[] = {"view", "distance", "target", "eye"};
    const char *path = argument(arguments, "output");
    struct url url;
    if (!path)
        return groomctl_usage_error("preview", "-o FILE.png is needed (\"-\" for standard output)");
    picture_url(&url, arguments->operands[0], "preview.png");
    for (size_t i = 0; i < sizeof plain / sizeof plain[0]; i++)
        url_query(&url, plain[i], argument(arguments, plain[i]));
    if (!take_camera(arguments, "preview", &url) || !take_degrees(arguments, "preview", "fov", &url))
        return WRONG_USAGE;
    return download_said(ctl, path, download_file(ctl, url.text, path));
}

/* --- turntable -------------------------------------------------------------------------------- */

struct turn {
    unsigned long frames;
    double seconds; /* 0: the server's own */
};

static int read_turn(const struct arguments *arguments, struct turn *turn)
{
    const char *frames = argument(arguments, "frames"), *seconds = argument(arguments, "seconds");
    char *end;
    *turn = (struct turn){.frames = 36};
    if (frames) {
        turn->frames = strtoul(frames, &end, 10);
        if (end == frames || *end || turn->frames < 2 || turn->frames > 120)
            return groomctl_usage_error("turntable", "--frames is \"%s\"; it must be a whole number from 2 to 120", frames);
    }
    if (seconds) {
        turn->seconds = strtod(seconds, &end);
        if (end == seconds || *end || !(turn->seconds >= 0.01 * (double)turn->frames && turn->seconds <= 10 * (double)turn->frames))
            return groomctl_usage_error("turntable", "--seconds is \"%s\"; %lu frames take %g to %lu s", seconds, turn->frames,
                                        0.01 * (double)turn->frames, 10 * turn->frames);
    }
    return DONE;
}

static void turn_url(const struct arguments *arguments, const struct turn *turn, struct url *url)
{
    picture_url(url, arguments->operands[0], "turntable.png");
    url_query_number(url, "frames", (double)turn->frames);
    if (turn->seconds > 0)
        url_query_number(url, "frame_ms", round(1000 * turn->seconds / (double)turn->frames));
}

static void draw_progress(const struct groomctl *ctl, unsigned long done, const struct turn *turn, size_t *n_lines)
{
    char lines[1][256];
    struct progress_line line = {.label = "turntable", .fraction = (double)done / (double)turn->frames, .eta_s = -1};
    if (!ctl->is_terminal || ctl->json)
        return;
    progress_bar_text(&line, progress_columns(), lines[0], sizeof lines[0]);
    *n_lines = done < turn->frames ? progress_draw((const char(*)[256])lines, 1, *n_lines) : progress_draw(NULL, 0, *n_lines);
}

static int one_still(struct groomctl *ctl, const struct arguments *arguments, const struct turn *turn, unsigned long frame,
                     const char *folder)
{
    char path[4096];
    struct url url;
    turn_url(arguments, turn, &url);
    url_query_number(&url, "frame", (double)frame);
    if (!take_camera(arguments, "turntable", &url))
        return WRONG_USAGE;
    if ((size_t)snprintf(path, sizeof path, "%s/frame_%04lu.png", folder, frame) >= sizeof path)
        return groomctl_usage_error("turntable", "the folder's name is too long");
    return download_file(ctl, url.text, path);
}

static int all_stills(struct groomctl *ctl, const struct arguments *arguments, const struct turn *turn, const char *folder)
{
    size_t n_lines = 0;
    int status = DONE;
    if (mkdir(folder, 0777) && errno != EEXIST) {
        fprintf(stderr, "groomctl: folder %s cannot be made: %s\n", folder, strerror(errno));
        return REFUSED;
    }
    for (unsigned long i = 0; i < turn->frames && status == DONE; i++) {
        status = one_still(ctl, arguments, turn, i, folder);
        draw_progress(ctl, i + 1, turn, &n_lines);
    }
    return download_said(ctl, folder, status);
}

int command_turntable(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *path = argument(arguments, "output"), *folder = argument(arguments, "stills");
    struct turn turn;
    struct url url;
    if (!path == !folder)
        return groomctl_usage_error("turntable", "-o FILE.png or --stills FOLDER is needed, one of them");
    int status = read_turn(arguments, &turn);
    if (status != DONE)
        return status;
    if (folder)
        return all_stills(ctl, arguments, &turn, folder);
    turn_url(arguments, &turn, &url);
    if (!take_camera(arguments, "turntable", &url))
        return WRONG_USAGE;
    return download_said(ctl, path, download_file(ctl, url.text, path));
}
