#include "groom/status.h"

struct status_row {
    const char *name, *message;
    int http;
};

static const struct status_row rows[] = {
#define STATUS_ROW(constant, slug, http, text) [constant] = {slug, text, http},
    GROOM_STATUS_LIST(STATUS_ROW)
#undef STATUS_ROW
};

static const struct status_row *row_of(groom_status status)
{
    unsigned at = (unsigned)status;
    return &rows[at < sizeof rows / sizeof rows[0] ? at : GROOM_EINTERNAL];
}

const char *groom_status_message(groom_status status) { return row_of(status)->message; }
const char *groom_status_name(groom_status status) { return row_of(status)->name; }
int groom_status_http(groom_status status) { return row_of(status)->http; }
