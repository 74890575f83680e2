#include "groom/diag.h"

#include <stdarg.h>
#include <stdio.h>

static groom_status fill(struct groom_diag *diag, groom_status status, int64_t byte_offset,
                         const char *pointer, const char *format, va_list arguments)
    __attribute__((format(printf, 5, 0)));

static groom_status fill(struct groom_diag *diag, groom_status status, int64_t byte_offset,
                         const char *pointer, const char *format, va_list arguments)
{
    if (!diag)
        return status;
    diag->status = status;
    diag->byte_offset = byte_offset;
    snprintf(diag->pointer, sizeof diag->pointer, "%s", pointer);
    vsnprintf(diag->detail, sizeof diag->detail, format, arguments);
    return status;
}

groom_status groom_fail(struct groom_diag *diag, groom_status status, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fill(diag, status, -1, "", format, arguments);
    va_end(arguments);
    return status;
}

groom_status groom_fail_at(struct groom_diag *diag, groom_status status, int64_t byte_offset,
                           const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fill(diag, status, byte_offset, "", format, arguments);
    va_end(arguments);
    return status;
}

groom_status groom_fail_field(struct groom_diag *diag, groom_status status, const char *pointer,
                              const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fill(diag, status, -1, pointer, format, arguments);
    va_end(arguments);
    return status;
}
