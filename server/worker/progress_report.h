/* Telling the daemon where an attempt stands, at most twice a second, and hearing whether to stop. */
#ifndef WORKER_PROGRESS_REPORT_H
#define WORKER_PROGRESS_REPORT_H

#include "groom/fit.h"
#include "server/worker/work_link.h"

#define PROGRESS_MAX_LOSSES 512

struct progress_report {
    struct work_link *link;
    const struct groom_fit *fit;       /* NULL before there is one, and after it */
    double compared;                   /* 0..1 of the quality report that follows it; negative: not begun */
    uint32_t n_compared;               /* of its two comparisons that are done */
    struct groom_fit_progress plain;   /* of work that is no fit; stage NULL: none */
    double plain_begin, plain_end;     /* the part of it that the present stage is */
    double first_fraction, started_s;  /* of this attempt: what the time left is reckoned from */
    double sent_s;
    int halted;                        /* the daemon said cancel, or the line is gone: stop */
    int cancelled;                     /* the daemon said that the job is */
    struct groom_progress callbacks;   /* for the library's context */
    uint32_t n_losses;
    struct progress_loss { char stage[24], name[24]; uint64_t iteration; double value; } losses[PROGRESS_MAX_LOSSES];
};

void progress_report_init(struct progress_report *report, struct work_link *link);
/* From here on it knows the fit; where it stands now is where this attempt began. */
void progress_report_follow(struct progress_report *report, const struct groom_fit *fit);
/* The fit is done and may go; what the library reports from here on is the quality report's progress. */
void progress_report_compare(struct progress_report *report);
/* The same of an edit: stage `index` of `count`, between these parts of the whole. The library's own
 * fractions move within it. */
void progress_report_stage(struct progress_report *report, const char *stage, uint32_t index, uint32_t count, double begin,
                           double end);
/* Send where half a second has gone by, or `now`.
 * returns  GROOM_OK, GROOM_ECANCELLED */
GROOM_MUST_CHECK groom_status progress_report_send(struct progress_report *report, int now);

/* The message (proto/work.h); malloc'ed, NULL where memory is out. */
char *progress_report_text(const struct progress_report *report, double now_s);

#endif
