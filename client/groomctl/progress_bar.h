/* Lines that say how far something is: for a terminal, redrawn in place, and for a log. */
#ifndef GROOMCTL_PROGRESS_BAR_H
#define GROOMCTL_PROGRESS_BAR_H

#include <stddef.h>

struct progress_line {
    const char *label;     /* in front: a job's id, a file's name; NULL: none */
    const char *stage;     /* NULL: none */
    unsigned stage_index, stage_count;
    double fraction;       /* 0..1; what is beyond is brought in */
    const char *loss_name; /* NULL: none */
    double loss;
    double eta_s;          /* below 0: not known */
    const char *note;      /* at the end: "queued, 2 before it"; NULL: none */
};

/* "2:05 left", "8 s left", "1 h 02 min left"; "" below 0. */
void progress_time_left(double eta_s, char *text, size_t size);

/* A line of at most `columns` characters with a bar: "initialize 1/5 [=====>    ]  52 %  ...".
 * Where it is narrow, the note goes first, then the loss, then the bar's own width. */
void progress_bar_text(const struct progress_line *line, size_t columns, char *text, size_t size);
/* The same for a log: no bar. */
void progress_plain_text(const struct progress_line *line, char *text, size_t size);

/* Columns of the terminal at standard error, 80 where that is not known. */
size_t progress_columns(void);
/* Draw n lines over the n_before that were drawn last; returns n. */
size_t progress_draw(const char (*lines)[256], size_t n, size_t n_before);

#endif
