/* The names of the views. */
#include "groom/render.h"

#include <string.h>

static const char *const names[] = {
#define VIEW_NAME(view, slug) [view] = slug,
    GROOM_VIEW_LIST(VIEW_NAME)
#undef VIEW_NAME
};

const char *groom_view_name(groom_view view)
{
    return (unsigned)view < GROOM_VIEW_COUNT ? names[view] : "unknown";
}

groom_status groom_view_parse(const char *name, groom_view *view, struct groom_diag *diag)
{
    for (int i = 0; i < GROOM_VIEW_COUNT; i++)
        if (!strcmp(name, names[i])) {
            *view = (groom_view)i;
            return GROOM_OK;
        }
    return groom_fail(diag, GROOM_EINVAL, "\"%.40s\" is not a view; take front, side, back or top", name);
}
