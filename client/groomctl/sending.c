#include "client/groomctl/sending.h"

#include <stdio.h>
#include <time.h>

#include "client/groomctl/progress_bar.h"

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

void sending_init(struct sending *sending, const char *name, uint64_t n_before, uint64_t n_total)
{
    *sending = (struct sending){.name = name, .n_before = n_before, .n_total = n_total, .started = now_s()};
}

void sending_draw(void *user, uint64_t n_sent, uint64_t n_total)
{
    struct sending *s = user;
    double now = now_s(), elapsed = now - s->started, there = (double)(s->n_before + n_sent);
    char lines[1][256], note[48];
    if (now - s->drawn < 0.1 && n_sent < n_total)
        return;
    s->drawn = now;
    struct progress_line line = {
        .label = s->name, .fraction = s->n_total ? there / (double)s->n_total : 1, .eta_s = -1, .note = note};
    if (elapsed > 0.5 && n_sent)
        line.eta_s = elapsed * (double)(n_total - n_sent) / (double)n_sent;
    snprintf(note, sizeof note, "%.1f MB", (double)s->n_total * 1e-6);
    progress_bar_text(&line, progress_columns(), lines[0], sizeof lines[0]);
    s->n_lines = progress_draw((const char(*)[256])lines, 1, s->n_lines);
}

void sending_clear(struct sending *sending)
{
    if (sending->n_lines)
        progress_draw(NULL, 0, sending->n_lines);
    sending->n_lines = 0;
}
