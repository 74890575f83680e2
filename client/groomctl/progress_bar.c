#include "client/groomctl/progress_bar.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define SMALLEST_BAR 10
#define LARGEST_BAR  40

void progress_time_left(double eta_s, char *text, size_t size)
{
    double s = isfinite(eta_s) ? floor(eta_s + 0.5) : -1;
    if (s < 0 || s > 1e7)
        snprintf(text, size, "%s", "");
    else if (s < 60)
        snprintf(text, size, "%.0f s left", s);
    else if (s < 3600)
        snprintf(text, size, "%d:%02d left", (int)s / 60, (int)s % 60);
    else
        snprintf(text, size, "%d h %02d min left", (int)s / 3600, (int)s / 60 % 60);
}

static double fraction_of(const struct progress_line *line)
{
    if (!(line->fraction > 0))
        return 0;
    return line->fraction < 1 ? line->fraction : 1;
}

/* What stands in front of the bar. */
static void head_text(const struct progress_line *line, char *text, size_t size)
{
    char stage[64] = "";
    if (line->stage && line->stage_count > 1)
        snprintf(stage, sizeof stage, "%.40s %u/%u", line->stage, line->stage_index + 1, line->stage_count);
    else if (line->stage)
        snprintf(stage, sizeof stage, "%.40s", line->stage);
    snprintf(text, size, "%s%s%s", line->label ? line->label : "", line->label && stage[0] ? "  " : "",
             stage);
}

/* What stands behind it: more of it, the higher the level. */
static void tail_text(const struct progress_line *line, int level, char *text, size_t size)
{
    char left[32], loss[64] = "";
    progress_time_left(line->eta_s, left, sizeof left);
    if (level >= 1 && line->loss_name)
        snprintf(loss, sizeof loss, "  %.20s %.4g", line->loss_name, line->loss);
    snprintf(text, size, "%3.0f %%%s%s%s%s%s", floor(100 * fraction_of(line)), loss, left[0] ? "  " : "",
             left, level >= 2 && line->note ? "  " : "", level >= 2 && line->note ? line->note : "");
}

static void draw_bar(double fraction, size_t width, char *text)
{
    size_t full = (size_t)(fraction * (double)width);
    text[0] = '[';
    for (size_t i = 0; i < width; i++)
        text[i + 1] = i < full ? '=' : i == full ? '>' : ' ';
    text[width + 1] = ']';
    text[width + 2] = '\0';
}

void progress_bar_text(const struct progress_line *line, size_t columns, char *text, size_t size)
{
    char head[128], tail[192], bar[LARGEST_BAR + 3];
    int level = 2;
    size_t used, width;
    head_text(line, head, sizeof head);
    do {
        tail_text(line, level, tail, sizeof tail);
        used = strlen(head) + strlen(tail) + (head[0] ? 1 : 0) + 3;
    } while (used + SMALLEST_BAR > columns && level-- > 0);
    width = columns > used + SMALLEST_BAR ? columns - used : SMALLEST_BAR;
    if (width > LARGEST_BAR)
        width = LARGEST_BAR;
    draw_bar(fraction_of(line), width, bar);
    snprintf(text, size < columns + 1 ? size : columns + 1, "%s%s%s %s", head, head[0] ? " " : "", bar, tail);
}

void progress_plain_text(const struct progress_line *line, char *text, size_t size)
{
    char head[128], tail[192];
    head_text(line, head, sizeof head);
    tail_text(line, 2, tail, sizeof tail);
    snprintf(text, size, "%s%s%s", head, head[0] ? "  " : "", tail + strspn(tail, " "));
}

size_t progress_columns(void)
{
    struct winsize window;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &window) || window.ws_col < 20)
        return 80;
    return window.ws_col < 250 ? window.ws_col : 250;
}

size_t progress_draw(const char (*lines)[256], size_t n, size_t n_before)
{
    if (n_before)
        fprintf(stderr, "\033[%zuA", n_before);
    for (size_t i = 0; i < n; i++)
        fprintf(stderr, "\r%s\033[K\n", lines[i]);
    if (n < n_before)
        fputs("\033[J", stderr);
    fflush(stderr);
    return n;
}
