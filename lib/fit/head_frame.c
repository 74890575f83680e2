#include "fit/head_frame.h"

#include <math.h>

#include "groom/mesh.h"

#define ASKED 200        /* roots */
#define FEWEST 8         /* strands that can tell */
#define HARDLY 0.1       /* share of roots that are near: head and strands do not meet */
#define MOST 0.6         /* they would */

#define LEAST_SIZE 8.0   /* of a head's box over `near`, which is a quarter of the roots' spread */
#define MOST_SIZE 200.0  /* a whole body's */

/* How the head may have to be read: `scale` times as large, with another axis up. */
static const struct { float scale; const char *words; } scales[] = {
    {1, ""},           {0.01f, "100 times smaller"},  {100, "100 times larger"},   {0.1f, "10 times smaller"},
    {10, "10 times larger"}, {0.001f, "1000 times smaller"}, {1000, "1000 times larger"}, {0.0254f, "39.37 times smaller"},
    {39.37008f, "39.37 times larger"}};
enum { AS_IT_IS, Z_WAS_UP, Y_WAS_UP, TURNS };
static const char *const turn_words[TURNS] = {"", "with up=z", "with up=y"};

/* Whether a head of this size may have grown these roots: not a speck among them, not a ground below them. */
static int is_plausible(double size, float near)
{
    return size >= LEAST_SIZE * (double)near && size <= MOST_SIZE * (double)near;
}

static double size_of(const struct groom_mesh *head)
{
    float low[3], high[3];
    double square = 0;
    groom_mesh_bounds(head, low, high);
    for (int c = 0; c < 3; c++)
        square += ((double)high[c] - low[c]) * ((double)high[c] - low[c]);
    return sqrt(square);
}

/* A place of the strands' frame in that of the head as it was read. */
static void to_head(const float p[3], float scale, int turn, float out[3])
{
    out[0] = p[0] / scale;
    out[1] = (turn == Z_WAS_UP ? -p[2] : turn == Y_WAS_UP ? p[2] : p[1]) / scale;
    out[2] = (turn == Z_WAS_UP ? p[1] : turn == Y_WAS_UP ? -p[1] : p[2]) / scale;
}

static double share_near(const struct groom_bvh *head, const struct groom_strands *strands, const unsigned char *outlier,
                         float near, float scale, int turn)
{
    uint32_t n = strands->n_strands, step = n / ASKED > 1 ? n / ASKED : 1, asked = 0, found = 0;
    struct groom_surface_point surface;
    for (uint32_t i = 0; i < n; i += step) {
        float p[3];
        if (outlier[i])
            continue;
        to_head(strands->points[strands->first[i]], scale, turn, p);
        found += groom_bvh_closest(head, p, near / scale, &surface) != 0;
        asked++;
    }
    return asked ? (double)found / asked : 1;
}

groom_status head_frame_check(const struct groom_bvh *head, const struct groom_strands *strands,
                              const unsigned char *outlier, float near, struct groom_diag *diag)
{
    double now = share_near(head, strands, outlier, near, 1, AS_IT_IS), size = size_of(groom_bvh_mesh(head));
    if (now >= HARDLY || strands->n_strands < FEWEST)
        return GROOM_OK;
    for (int turn = 0; turn < TURNS; turn++)
        for (size_t k = 0; k < sizeof scales / sizeof scales[0]; k++) {
            if (!is_plausible(size * (double)scales[k].scale, near))
                continue;
            double share = share_near(head, strands, outlier, near, scales[k].scale, turn);
            if (share >= MOST)
                return groom_fail_field(diag, GROOM_EINVAL, "/head",
                                        "the head is not in the strands' unit and axis: %.0f %% of the strands start within %.0f mm of it, "
                                        "but %.0f %% would if it were %s%s%s; upload it again with its own unit and up axis",
                                        100 * now, 1000 * (double)near, 100 * share, scales[k].words,
                                        scales[k].words[0] && turn ? " and read " : turn ? "read " : "", turn_words[turn]);
        }
    return GROOM_OK;
}
