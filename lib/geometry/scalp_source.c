#include "groom/scalp.h"

const char *groom_scalp_source_name(groom_scalp_source source)
{
    static const char *const names[] = {"mesh_uv", "computed", "roots", "file"};
    return (unsigned)source < sizeof names / sizeof names[0] ? names[source] : "computed";
}
