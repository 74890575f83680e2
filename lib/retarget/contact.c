/* The half-spaces of Eq. 13. */
#include <math.h>

#include "geometry/vec.h"
#include "retarget/job.h"

static void absolute(const struct job *job, const float p[3], float out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = (float)(job->centre[c] + p[c]);
}

double contact_plane(const struct job *job, const float p[3], struct plane *plane)
{
    struct groom_surface_point near;
    float at[3];
    absolute(job, p, at);
    *plane = (struct plane){{0, 0, 0}, -INFINITY};
    if (!groom_bvh_closest(job->bvh, at, INFINITY, &near))
        return INFINITY;
    double above = 0;
    for (int c = 0; c < 3; c++) {
        plane->normal[c] = near.normal[c];
        above += near.normal[c] * (job->centre[c] + p[c] - near.position[c]);
    }
    plane->height = job->options->clearance - above;
    return above > 0 ? near.distance : 0;
}

float contact_away(const struct job *job, const float p[3])
{
    float at[3];
    absolute(job, p, at);
    return field_away(&job->field, at);
}
