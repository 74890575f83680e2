#include "fit/sites.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/sort.h"

#define NEAR 6            /* sites that a strand may belong to */
#define MOST_STRANDS 64   /* a site, that are asked */
#define FEWEST_SITES 3    /* between which there are borders to speak of */
#define WIDEST 0.4        /* borders, of the distance between sites: */
#define NARROWER 0.7071   /* from one width to the next */
#define WIDTHS 4
#define OFF_MIDDLE 0.3    /* how far a site usually is from the middle of its strands at most, likewise */
#define STEPS 15         /* of a width */
#define STEP 0.6          /* of Newton's: sites move at once, and each is a neighbour's border */
#define LEAST_SHARE 1e-6  /* of a strand that is far from its own: no more unlikely than that */
#define LEAST_SPREAD 1e-3 /* of strands around their middle, likewise: less tells no directions */

/* On the scalp, in its coordinates. */
struct siting {
    const struct groom_fit *fit;
    const uint32_t *follows;
    uint32_t n_sites, n, every;    /* strands that are asked: every so many-th */
    float (*middle)[2];            /* [n_sites] of the strands */
    double (*at)[2], (*best)[2];   /* [n_sites] */
    double *count;                 /* [n_sites] */
    uint32_t *candidate;           /* [n][NEAR] sites */
    float *squared, (*query)[2];   /* [n][NEAR], [n] */
    double (*pull)[2], (*bend)[3]; /* [n_sites] slope of the likelihood; what it bends by: xx, xy, yy */
    double spacing, width;
};

static uint32_t strand_at(const struct siting *s, uint32_t at) { return at * s->every; }

static uint32_t site_of(const struct siting *s, uint32_t at) { return s->follows[strand_at(s, at)]; }

/* --- middles -------------------------------------------------------------------------------- */

static void find_middles(struct siting *s)
{
    memset(s->count, 0, s->n_sites * sizeof *s->count);
    memset(s->at, 0, s->n_sites * sizeof *s->at);
    for (uint32_t i = 0; i < s->fit->n; i++) {
        uint32_t o = s->follows[i];
        s->count[o]++;
        for (int c = 0; c < 2; c++)
            s->at[o][c] += (double)s->fit->root_uv[i][c];
    }
    for (uint32_t o = 0; o < s->n_sites; o++)
        for (int c = 0; c < 2; c++) {
            s->at[o][c] = s->count[o] > 0 ? s->at[o][c] / s->count[o] : (double)s->fit->root_uv[0][c];
            s->middle[o][c] = (float)s->at[o][c];
        }
}

/* The usual distance from a middle to the next. nearest, squared: room for [n_sites][2] */
static groom_status find_spacing(struct siting *s, const struct groom_neighbours *index, uint32_t *nearest, float *squared,
                                 const struct groom_context *context, struct groom_diag *diag)
{
    groom_status st = groom_neighbours_find(index, s->middle[0], s->n_sites, 2, nearest, squared, context, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t o = 0; o < s->n_sites; o++)
        squared[o] = squared[2 * o + 1];
    s->spacing = s->n_sites >= FEWEST_SITES ? sqrt((double)median_of_floats(squared, s->n_sites)) : 0; /* of one site there is no next */
    return GROOM_OK;
}

static groom_status find_candidates(struct siting *s, const struct groom_neighbours *index, const struct groom_context *context,
                                    struct groom_diag *diag)
{
    for (uint32_t at = 0; at < s->n; at++)
        memcpy(s->query[at], s->fit->root_uv[strand_at(s, at)], sizeof *s->query);
    return groom_neighbours_find(index, s->query[0], s->n, NEAR, s->candidate, s->squared, context, diag);
}

/* --- likelihood --------------------------------------------------------------------------------- */

/* How likely a strand is to belong to each of its candidates, exp(-distance^2 / 2 width^2) over their sum; 0: its own is
 * none of them, it tells nothing of borders. */
static int belonging(const struct siting *s, uint32_t at, double share[NEAR])
{
    const uint32_t *candidate = s->candidate + (size_t)at * NEAR;
    double square[NEAR], least = INFINITY, all = 0;
    int own = 0;
    for (int k = 0; k < NEAR; k++) {
        square[k] = INFINITY;
        if (candidate[k] == UINT32_MAX || s->count[candidate[k]] == 0)
            continue;
        double x = (double)s->query[at][0] - s->at[candidate[k]][0], y = (double)s->query[at][1] - s->at[candidate[k]][1];
        square[k] = x * x + y * y;
        least = fmin(least, square[k]);
        own |= candidate[k] == site_of(s, at);
    }
    if (!own)
        return 0;
    for (int k = 0; k < NEAR; k++)
        all += share[k] = square[k] < (double)INFINITY ? exp((least - square[k]) / (2 * s->width * s->width)) : 0;
    for (int k = 0; k < NEAR; k++)
        share[k] /= all;
    return 1;
}

static void add_strand(struct siting *s, uint32_t at)
{
    double share[NEAR], square = s->width * s->width;
    if (!belonging(s, at, share))
        return;
    for (int k = 0; k < NEAR; k++) {
        uint32_t o = s->candidate[(size_t)at * NEAR + k];
        double more = (share[k] > 0 && o == site_of(s, at) ? 1 : 0) - share[k], bend = share[k] * (1 - share[k]);
        if (share[k] == 0)
            continue;
        double x = ((double)s->query[at][0] - s->at[o][0]) / square, y = ((double)s->query[at][1] - s->at[o][1]) / square;
        s->pull[o][0] += more * x;
        s->pull[o][1] += more * y;
        s->bend[o][0] += bend * x * x;
        s->bend[o][1] += bend * x * y;
        s->bend[o][2] += bend * y * y;
    }
}

/* Newton's step of one site, no farther than a border is wide. */
static void move_site(struct siting *s, uint32_t o, double hold)
{
    double x = s->pull[o][0] + hold * ((double)s->middle[o][0] - s->at[o][0]);
    double y = s->pull[o][1] + hold * ((double)s->middle[o][1] - s->at[o][1]);
    double xx = s->bend[o][0] + hold, xy = s->bend[o][1], yy = s->bend[o][2] + hold, determinant = xx * yy - xy * xy;
    double along_x = STEP * (yy * x - xy * y) / determinant, along_y = STEP * (xx * y - xy * x) / determinant;
    double over = fmax(1, sqrt(along_x * along_x + along_y * along_y) / s->width);
    s->at[o][0] += along_x / over;
    s->at[o][1] += along_y / over;
}

static void settle(struct siting *s)
{
    double usual = OFF_MIDDLE * s->spacing, hold = 1 / (usual * usual);
    for (int step = 0; step < STEPS; step++) {
        memset(s->pull, 0, s->n_sites * sizeof *s->pull);
        memset(s->bend, 0, s->n_sites * sizeof *s->bend);
        for (uint32_t at = 0; at < s->n; at++)
            add_strand(s, at);
        for (uint32_t o = 0; o < s->n_sites; o++)
            if (s->count[o] > 0)
                move_site(s, o, hold);
    }
}

/* Minus the logarithm of the likelihood of who follows whom. */
static double unlikeliness(const struct siting *s)
{
    double sum = 0, share[NEAR];
    for (uint32_t at = 0; at < s->n; at++)
        if (belonging(s, at, share))
            for (int k = 0; k < NEAR; k++)
                if (s->candidate[(size_t)at * NEAR + k] == site_of(s, at))
                    sum -= log(fmax(share[k], LEAST_SHARE));
    return sum;
}

/* With borders as sharp as is likeliest: those of bundles that were told apart with doubt are wide, and sites stay near
 * the middles then. */
static void find_likeliest(struct siting *s)
{
    double least = INFINITY;
    s->width = WIDEST * s->spacing;
    for (int k = 0; k < WIDTHS; k++, s->width *= NARROWER) {
        settle(s);
        double here = unlikeliness(s);
        if (here < least) {
            least = here;
            memcpy(s->best, s->at, s->n_sites * sizeof *s->best);
        }
    }
    memcpy(s->at, s->best, s->n_sites * sizeof *s->at);
}

/* --- back onto the head --------------------------------------------------------------------------- */

/* How places go with coordinates among the strands of a site: means, sums of what is off these, then a linear map. (Sums of
 * places as they are would round away what a few strands, nearly on a line, tell of what is off it.) */
struct map { double n, middle[2], place[3], square[3], mixed[3][2]; };

static void add_to_means(struct map *map, const struct siting *s, uint32_t i)
{
    map->n++;
    for (int c = 0; c < 2; c++)
        map->middle[c] += ((double)s->fit->root_uv[i][c] - map->middle[c]) / map->n;
    for (int c = 0; c < 3; c++)
        map->place[c] += ((double)s->fit->roots[i][c] - map->place[c]) / map->n;
}

static void add_to_map(struct map *map, const struct siting *s, uint32_t i)
{
    double u = (double)s->fit->root_uv[i][0] - map->middle[0], v = (double)s->fit->root_uv[i][1] - map->middle[1];
    map->square[0] += u * u;
    map->square[1] += u * v;
    map->square[2] += v * v;
    for (int c = 0; c < 3; c++) {
        double x = (double)s->fit->roots[i][c] - map->place[c];
        map->mixed[c][0] += u * x;
        map->mixed[c][1] += v * x;
    }
}

/* The place of coordinates; strands that lie on a line tell nothing of what is off it. */
static void place_of(const struct map *map, double least, const double at[2], double place[3])
{
    double uu = map->square[0] + map->n * least, uv = map->square[1], vv = map->square[2] + map->n * least;
    double determinant = uu * vv - uv * uv, inverse = determinant > 0 ? 1 / determinant : 0;
    for (int c = 0; c < 3; c++) {
        double along_u = inverse * (vv * map->mixed[c][0] - uv * map->mixed[c][1]);
        double along_v = inverse * (uu * map->mixed[c][1] - uv * map->mixed[c][0]);
        place[c] = map->place[c] + along_u * (at[0] - map->middle[0]) + along_v * (at[1] - map->middle[1]);
    }
}

static void place_sites(const struct siting *s, struct map *map, struct site *site)
{
    double least = LEAST_SPREAD * s->spacing * s->spacing;
    memset(map, 0, s->n_sites * sizeof *map);
    for (uint32_t i = 0; i < s->fit->n; i++)
        add_to_means(&map[s->follows[i]], s, i);
    for (uint32_t i = 0; i < s->fit->n; i++)
        add_to_map(&map[s->follows[i]], s, i);
    for (uint32_t o = 0; o < s->n_sites; o++) {
        struct groom_surface_point surface;
        site[o] = (struct site){.n = s->count[o]};
        if (s->count[o] == 0)
            continue;
        place_of(&map[o], least, s->at[o], site[o].at);
        const float near[3] = {(float)site[o].at[0], (float)site[o].at[1], (float)site[o].at[2]};
        if (s->fit->bvh && groom_bvh_closest(s->fit->bvh, near, INFINITY, &surface))
            for (int c = 0; c < 3; c++)
                site[o].at[c] = (double)surface.position[c];
    }
}

/* --- all ---------------------------------------------------------------------------------------------- */

static groom_status find(struct siting *s, const struct groom_context *context, struct groom_diag *diag)
{
    struct groom_neighbours *index = NULL;
    find_middles(s);
    groom_status st = groom_neighbours_create(s->middle[0], s->n_sites, 2, context, &index, diag);
    if (st == GROOM_OK)
        st = find_spacing(s, index, s->candidate, s->squared, context, diag);
    if (st == GROOM_OK)
        st = find_candidates(s, index, context, diag);
    groom_neighbours_destroy(index);
    if (st == GROOM_OK && s->spacing > 0)
        find_likeliest(s);
    return st;
}

groom_status sites_find(const struct groom_fit *fit, const uint32_t *follows, uint32_t n_sites, struct site *site,
                        const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    uint32_t most = MOST_STRANDS * n_sites;
    struct siting s = {.fit = fit, .follows = follows, .n_sites = n_sites, .every = 1 + (fit->n - 1) / most};
    s.n = 1 + (fit->n - 1) / s.every;
    size_t rows = s.n > n_sites ? s.n : n_sites;
    s.middle = memory_array(allocator, n_sites, sizeof *s.middle);
    s.at = memory_array(allocator, n_sites, sizeof *s.at);
    s.best = memory_array(allocator, n_sites, sizeof *s.best);
    s.count = memory_array(allocator, n_sites, sizeof *s.count);
    s.candidate = memory_array(allocator, rows, NEAR * sizeof *s.candidate);
    s.squared = memory_array(allocator, rows, NEAR * sizeof *s.squared);
    s.query = memory_array(allocator, s.n, sizeof *s.query);
    s.pull = memory_array(allocator, n_sites, sizeof *s.pull);
    s.bend = memory_array(allocator, n_sites, sizeof *s.bend);
    struct map *map = memory_array(allocator, n_sites, sizeof *map);
    groom_status st = s.middle && s.at && s.best && s.count && s.candidate && s.squared && s.query && s.pull && s.bend && map
                          ? GROOM_OK
                          : groom_fail(diag, GROOM_ENOMEM, "no memory to place %u operator guides", n_sites);
    if (st == GROOM_OK && (st = find(&s, context, diag)) == GROOM_OK)
        place_sites(&s, map, site);
    memory_release(allocator, s.middle, n_sites, sizeof *s.middle);
    memory_release(allocator, s.at, n_sites, sizeof *s.at);
    memory_release(allocator, s.best, n_sites, sizeof *s.best);
    memory_release(allocator, s.count, n_sites, sizeof *s.count);
    memory_release(allocator, s.candidate, rows, NEAR * sizeof *s.candidate);
    memory_release(allocator, s.squared, rows, NEAR * sizeof *s.squared);
    memory_release(allocator, s.query, s.n, sizeof *s.query);
    memory_release(allocator, s.pull, n_sites, sizeof *s.pull);
    memory_release(allocator, s.bend, n_sites, sizeof *s.bend);
    memory_release(allocator, map, n_sites, sizeof *map);
    return st;
}
