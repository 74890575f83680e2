/* Values of the command line that several commands take. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "proto/work.h"
#include "server/worker/worker.h"

unsigned worker_threads(void)
{
    const char *text = getenv(WORK_ENV_THREADS);
    unsigned long n = text ? strtoul(text, NULL, 10) : 0;
    return n <= 1024 ? (unsigned)n : 1024;
}

const char *worker_format_name(const char *text) { return *text && strcmp(text, "auto") ? text : NULL; }

groom_status worker_frame_parse(const char *unit, const char *up, struct groom_frame *frame,
                                struct groom_diag *diag)
{
    groom_status st = GROOM_OK;
    *frame = (struct groom_frame){.unit_m = 1, .up = GROOM_UP_Y};
    if (unit)
        st = groom_unit_parse(unit, &frame->unit_m, diag);
    if (st == GROOM_OK && up)
        st = groom_up_parse(up, &frame->up, diag);
    return st;
}

groom_status worker_count_parse(const char *option, const char *text, unsigned long long maximum,
                                unsigned long long *value, struct groom_diag *diag)
{
    char *end;
    *value = 0;
    if (!text)
        return GROOM_OK;
    errno = 0;
    *value = strtoull(text, &end, 10);
    if (errno || end == text || *end || text[0] == '-' || *value > maximum)
        return groom_fail(diag, GROOM_EINVAL, "%s is \"%.40s\"; it must be a whole number up to %llu", option,
                          text, maximum);
    return GROOM_OK;
}
