/* Names of formats, units and axes. */
#include "groom/format.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct format_row {
    const char *name, *media_type, *extension;
    int readable, writable;
};

static const struct format_row rows[GROOM_FORMAT_COUNT] = {
    [GROOM_FORMAT_AUTO] = {"auto", "application/octet-stream", "bin", 1, 0},
#define ROW(constant, name, media, extension, readable, writable, text)                                      \
    [constant] = {name, media, extension, readable, writable},
    GROOM_FORMAT_LIST(ROW)
#undef ROW
};

static const struct format_row *row_of(groom_format format)
{
    return &rows[(unsigned)format < GROOM_FORMAT_COUNT ? format : GROOM_FORMAT_AUTO];
}

const char *groom_format_name(groom_format format) { return row_of(format)->name; }
const char *groom_format_media_type(groom_format format) { return row_of(format)->media_type; }
const char *groom_format_extension(groom_format format) { return row_of(format)->extension; }
int groom_format_readable(groom_format format) { return row_of(format)->readable; }
int groom_format_writable(groom_format format) { return row_of(format)->writable; }

static groom_status refuse_name(const char *name, struct groom_diag *diag)
{
    char names[256] = "";
    for (int f = GROOM_FORMAT_AUTO + 1; f < GROOM_FORMAT_COUNT; f++) {
        size_t at = strlen(names);
        snprintf(names + at, sizeof names - at, "%s%s", at ? ", " : "", rows[f].name);
    }
    return groom_fail(diag, GROOM_EINVAL, "\"%.40s\" is no format; it may be auto, %s", name, names);
}

groom_status groom_format_parse(const char *name, groom_format *format, struct groom_diag *diag)
{
    static const struct {
        const char *alias;
        groom_format format;
    } aliases[] = {{"usd", GROOM_FORMAT_USDA}, {"bin", GROOM_FORMAT_CT2HAIR}};
    for (size_t i = 0; i < sizeof aliases / sizeof aliases[0]; i++)
        if (strcmp(name, aliases[i].alias) == 0) {
            *format = aliases[i].format;
            return GROOM_OK;
        }
    for (int f = GROOM_FORMAT_AUTO; f < GROOM_FORMAT_COUNT; f++)
        if (strcmp(name, rows[f].name) == 0) {
            *format = (groom_format)f;
            return GROOM_OK;
        }
    return refuse_name(name, diag);
}
