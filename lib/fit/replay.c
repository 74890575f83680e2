#include "fit/replay.h"

#include <string.h>

static void record_piece(void *user, uint32_t first, uint32_t n, const float (*points)[3], float (*d_points)[3])
{
    const struct replay *replay = user;
    memcpy(replay->points + (size_t)first * replay->m, points, (size_t)n * replay->m * sizeof *points);
    memset(d_points, 0, (size_t)n * replay->m * sizeof *d_points);
}

static void play_piece(void *user, uint32_t first, uint32_t n, const float (*points)[3], float (*d_points)[3])
{
    const struct replay *replay = user;
    (void)points;
    memcpy(d_points, replay->points + (size_t)first * replay->m, (size_t)n * replay->m * sizeof *d_points);
}

struct groom_adjoint replay_record(struct replay *replay) { return (struct groom_adjoint){record_piece, replay}; }
struct groom_adjoint replay_play(struct replay *replay) { return (struct groom_adjoint){play_piece, replay}; }
