/* Clusters of strands, the frames of their armatures, and anchors from frames that were moved. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "groom/curvature.h"
#include "groom/random.h"
#include "tests/support/superhelix.h"
#include "tests/support/test.h"

#define VERTICES 21

/* Straight strands from root to tip, VERTICES each. */
static struct groom_strands *straight(uint32_t n, const double (*root)[3], const double (*tip)[3])
{
    struct groom_strands *s;
    ck_ok(groom_strands_create(n, (uint64_t)n * VERTICES, NULL, &s, NULL));
    for (uint32_t i = 0; i < n; i++) {
        s->first[i + 1] = s->first[i] + VERTICES;
        for (uint32_t k = 0; k < VERTICES; k++)
            for (int c = 0; c < 3; c++)
                s->points[s->first[i] + k][c] =
                    (float)(root[i][c] + (tip[i][c] - root[i][c]) * k / (double)(VERTICES - 1));
    }
    return s;
}

/* Locks of strands that hang down from places on a circle, in an order that mixes them. */
enum { LOCKS = 5, STRANDS = 250 };
static struct groom_strands *locks(void)
{
    double root[STRANDS][3], tip[STRANDS][3];
    struct groom_random_key key = {3, 1};
    for (uint32_t i = 0; i < STRANDS; i++) {
        double around = 2.0 * M_PI * (i % LOCKS) / LOCKS;
        for (uint32_t c = 0; c < 3; c++)
            root[i][c] = 0.004 * groom_random_normal(key, i, c) + 0.1 * (c == 0 ? sin(around) : c == 2 ? cos(around) : 0.0);
        memcpy(tip[i], root[i], sizeof root[i]);
        tip[i][1] -= 0.2;
    }
    return straight(STRANDS, (const double (*)[3])root, (const double (*)[3])tip);
}

/* An oval bundle about +y, 0.3 m long, wide along x; the oval turns by `twist` radians to the tip. */
static struct groom_strands *oval(uint32_t n, double twist)
{
    struct groom_strands *s;
    ck_ok(groom_strands_create(n, (uint64_t)n * VERTICES, NULL, &s, NULL));
    for (uint32_t i = 0; i < n; i++) {
        double angle = 2.0 * M_PI * i / n, x = 0.03 * cos(angle), z = 0.01 * sin(angle);
        s->first[i + 1] = s->first[i] + VERTICES;
        for (uint32_t k = 0; k < VERTICES; k++) {
            double along = k / (double)(VERTICES - 1), turn = twist * along;
            float *p = s->points[s->first[i] + k];
            p[0] = (float)(x * cos(turn) - z * sin(turn));
            p[1] = (float)(0.3 * along);
            p[2] = (float)(x * sin(turn) + z * cos(turn));
        }
    }
    return s;
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void assert_orthonormal(const struct groom_cluster_frame *f)
{
    const double (*a)[3] = f->axes;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            ck_assert_double_eq_tol(dot(a[i], a[k]), i == k, 1e-12);
    double volume = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) + a[0][1] * (a[1][2] * a[2][0] - a[1][0] * a[2][2]) +
                    a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
    ck_assert_double_eq_tol(volume, 1.0, 1e-12);
}

/* --- clusters --------------------------------------------------------------------------- */

START_TEST(locks_become_clusters)
{
    struct groom_strands *s = locks();
    struct groom_clusters *c;
    ck_ok(groom_strands_cluster(s, LOCKS, 7, NULL, &c, NULL));
    ck_assert_uint_eq(c->n_clusters, LOCKS);
    ck_assert_uint_eq(c->first[LOCKS], STRANDS);
    for (uint32_t i = LOCKS; i < STRANDS; i++)
        ck_assert_uint_eq(c->of_strand[i], c->of_strand[i % LOCKS]);
    for (uint32_t k = 0; k < LOCKS; k++)
        for (uint32_t m = c->first[k]; m < c->first[k + 1]; m++) {
            ck_assert_uint_eq(c->of_strand[c->strands[m]], k);
            ck_assert(m == c->first[k] || c->strands[m] > c->strands[m - 1]);
        }
    groom_clusters_destroy(c), groom_strands_destroy(s);
}
END_TEST

START_TEST(clusters_depend_on_the_seed_and_not_on_the_pool)
{
    struct groom_strands *s = locks();
    struct groom_clusters *a, *b, *c;
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(groom_strands_cluster(s, 12, 7, NULL, &a, NULL));
    ck_ok(groom_strands_cluster(s, 12, 7, &context, &b, NULL));
    ck_ok(groom_strands_cluster(s, 12, 8, &context, &c, NULL));
    ck_assert_mem_eq(a->of_strand, b->of_strand, STRANDS * sizeof *a->of_strand);
    ck_assert_mem_ne(a->of_strand, c->of_strand, STRANDS * sizeof *a->of_strand);
    groom_pool_destroy(pool);
    groom_clusters_destroy(a), groom_clusters_destroy(b), groom_clusters_destroy(c), groom_strands_destroy(s);
}
END_TEST

START_TEST(no_cluster_is_empty_where_strands_differ)
{
    struct groom_strands *s = locks();
    struct groom_clusters *c;
    ck_ok(groom_strands_cluster(s, STRANDS, 1, NULL, &c, NULL));
    for (uint32_t k = 0; k < STRANDS; k++)
        ck_assert_uint_eq(c->first[k + 1] - c->first[k], 1);
    groom_clusters_destroy(c), groom_strands_destroy(s);
}
END_TEST

START_TEST(clustering_refuses_counts_and_strands_that_make_no_sense)
{
    struct groom_strands *s = locks();
    struct groom_clusters *c = NULL;
    struct groom_diag diag = {0};
    ck_status(groom_strands_cluster(s, 0, 1, NULL, &c, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/clusters/count");
    ck_status(groom_strands_cluster(s, STRANDS + 1, 1, NULL, &c, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/clusters/count");
    s->points[s->first[4]][1] = NAN;
    ck_status(groom_strands_cluster(s, 2, 1, NULL, &c, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "root of strand 4"));
    ck_assert_ptr_null(c);
    groom_strands_destroy(s);
}
END_TEST

/* --- frames ------------------------------------------------------------------------------- */

static void frames_of(const struct groom_strands *s, const double *at, uint32_t n, struct groom_cluster_frame *out)
{
    struct groom_clusters *c;
    ck_ok(groom_strands_cluster(s, 1, 1, NULL, &c, NULL));
    ck_ok(groom_clusters_frames(c, s, at, n, NULL, out, NULL));
    groom_clusters_destroy(c);
    for (uint32_t k = 0; k < n; k++)
        assert_orthonormal(&out[k]);
}

START_TEST(frames_stand_along_the_mean_strand_and_its_principal_directions)
{
    struct groom_strands *s = oval(64, 0.0);
    const double at[] = {0.0, 0.35, 1.0};
    struct groom_cluster_frame f[3];
    frames_of(s, at, 3, f);
    for (int k = 0; k < 3; k++) {
        const double where[3] = {0.0, 0.3 * at[k], 0.0};
        ck_assert_double_eq(f[k].at, at[k]);
        for (int c = 0; c < 3; c++)
            ck_assert_double_eq_tol(f[k].origin[c], where[c], 1e-7);
        ck_assert_double_eq_tol(f[k].axes[0][1], 1.0, 1e-9);
        ck_assert_double_eq_tol(fabs(f[k].axes[1][0]), 1.0, 1e-9);
        ck_assert_double_eq_tol(f[k].extent[0], 0.0, 1e-7);
        ck_assert_double_eq_tol(f[k].extent[1], 0.03 / sqrt(2.0), 1e-7);
        ck_assert_double_eq_tol(f[k].extent[2], 0.01 / sqrt(2.0), 1e-7);
    }
    groom_strands_destroy(s);
}
END_TEST

/* Where the widest direction goes round by 270 degrees, the frames go round with it and never jump. */
START_TEST(frames_turn_with_their_strands_as_little_as_may_be)
{
    enum { N = 12 };
    const double twist = 1.5 * M_PI;
    struct groom_strands *s = oval(64, twist);
    struct groom_cluster_frame f[N];
    double at[N], first;
    for (uint32_t k = 0; k < N; k++)
        at[k] = (k + 1.0) / N;
    frames_of(s, at, N, f);
    for (uint32_t k = 0; k + 1 < N; k++) /* 0.39 rad a joint; by arc length of strands that wind, a little less even */
        ck_assert_double_gt(dot(f[k].axes[1], f[k + 1].axes[1]), cos(0.45));
    first = atan2(f[0].axes[1][2], f[0].axes[1][0]) - twist / N;
    ck_assert_double_eq_tol(fabs(remainder(first, M_PI)), 0.0, 0.05);
    ck_assert_double_eq_tol(f[N - 1].extent[1], 0.03 / sqrt(2.0), 1e-3);
    groom_strands_destroy(s);
}
END_TEST

START_TEST(one_strand_no_length_and_no_strand_have_frames_too)
{
    const double root[3][3] = {{0.1, 0.2, 0.3}, {0.1, 0.2, 0.3}, {0.1, 0.2, 0.3}}, at[2] = {0.5, 1.0};
    struct groom_strands *s = straight(3, root, root);
    struct groom_clusters *c;
    struct groom_cluster_frame f[2][2];
    ck_ok(groom_strands_cluster(s, 2, 1, NULL, &c, NULL)); /* three strands in one place: one cluster stays empty */
    ck_assert_uint_eq(c->first[1], 3);
    ck_ok(groom_clusters_frames(c, s, at, 2, NULL, f[0], NULL));
    for (int k = 0; k < 4; k++)
        assert_orthonormal(&f[k / 2][k % 2]);
    ck_assert_double_eq_tol(f[0][1].origin[2], 0.3, 1e-7);
    ck_assert_double_eq(f[1][1].origin[2], 0.0);
    groom_clusters_destroy(c), groom_strands_destroy(s);
}
END_TEST

START_TEST(frames_do_not_depend_on_the_pool)
{
    struct groom_strands *s = locks();
    struct groom_clusters *c;
    struct groom_cluster_frame a[LOCKS][4] = {0}, b[LOCKS][4] = {0};
    const double at[4] = {0.1, 0.4, 0.7, 1.0};
    struct groom_pool *pool;
    ck_ok(groom_pool_create(3, &pool));
    struct groom_context context = {.pool = pool};
    ck_ok(groom_strands_cluster(s, LOCKS, 1, NULL, &c, NULL));
    ck_ok(groom_clusters_frames(c, s, at, 4, NULL, a[0], NULL));
    ck_ok(groom_clusters_frames(c, s, at, 4, &context, b[0], NULL));
    ck_assert_mem_eq(a, b, sizeof a);
    groom_pool_destroy(pool);
    groom_clusters_destroy(c), groom_strands_destroy(s);
}
END_TEST

START_TEST(frames_refuse_stations_off_the_strand)
{
    struct groom_strands *s = locks();
    struct groom_clusters *c;
    struct groom_cluster_frame f[LOCKS][2];
    const double beyond[2] = {0.5, 1.5}, falling[2] = {0.5, 0.4}, not_a_number[2] = {0.5, NAN};
    ck_ok(groom_strands_cluster(s, LOCKS, 1, NULL, &c, NULL));
    ck_status(groom_clusters_frames(c, s, beyond, 2, NULL, f[0], NULL), GROOM_EINVAL);
    ck_status(groom_clusters_frames(c, s, falling, 2, NULL, f[0], NULL), GROOM_EINVAL);
    ck_status(groom_clusters_frames(c, s, not_a_number, 2, NULL, f[0], NULL), GROOM_EINVAL);
    groom_clusters_destroy(c), groom_strands_destroy(s);
}
END_TEST

START_TEST(a_frame_map_takes_one_frame_to_the_other)
{
    struct groom_cluster_frame from = {.origin = {0.1, -0.2, 0.3}}, to = {.origin = {-1.0, 0.5, 2.0}};
    double map[3][4];
    random_frame(4, 0, from.axes), random_frame(4, 1, to.axes);
    groom_frame_map(&from, &to, map);
    for (int k = -1; k < 3; k++) /* the origin, and the ends of the axes */
        for (int r = 0; r < 3; r++) {
            double x = map[r][3], expected = to.origin[r] + (k < 0 ? 0.0 : to.axes[k][r]);
            for (int c = 0; c < 3; c++)
                x += map[r][c] * (from.origin[c] + (k < 0 ? 0.0 : from.axes[k][c]));
            ck_assert_double_eq_tol(x, expected, 1e-14);
        }
}
END_TEST

/* --- moves ---------------------------------------------------------------------------------- */

/* Coils, the polylines that they are, and clusters of these. */
struct scene {
    struct groom_superhelices *helices;
    struct groom_strands *strands;
    struct groom_clusters *clusters;
};

static struct scene scene_of(uint32_t n_strands, uint32_t n_clusters)
{
    struct scene s;
    s.helices = superhelix_coils(n_strands, 45, 11, 0);
    ck_ok(groom_strands_create(n_strands, (uint64_t)n_strands * 100, NULL, &s.strands, NULL));
    for (uint32_t i = 0; i < n_strands; i++)
        s.strands->first[i + 1] = 100 * (i + 1);
    ck_ok(groom_superhelices_sample(s.helices, 100, s.strands->points, NULL, NULL));
    ck_ok(groom_strands_cluster(s.strands, n_clusters, 5, NULL, &s.clusters, NULL));
    return s;
}

static void scene_finish(struct scene *s)
{
    groom_clusters_destroy(s->clusters), groom_strands_destroy(s->strands), groom_superhelices_destroy(s->helices);
}

static const struct groom_frame_move stay = {.cluster = 1, .at = 0.5, .map = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

START_TEST(the_identity_anchors_strands_where_they_are)
{
    struct scene s = scene_of(40, 3);
    struct groom_superhelices *before;
    struct groom_anchors *anchors;
    struct groom_sculpt_options options = groom_sculpt_options_default();
    ck_ok(groom_superhelices_copy(s.helices, NULL, &before, NULL));
    ck_ok(groom_clusters_move(s.clusters, s.helices, &stay, 1, NULL, &anchors, NULL));
    ck_assert_uint_eq(anchors->n, s.clusters->first[2] - s.clusters->first[1]);
    for (size_t k = 0; k < anchors->n; k++)
        ck_assert_uint_eq(anchors->anchor[k].strand, s.clusters->strands[s.clusters->first[1] + k]);
    ck_ok(groom_superhelices_sculpt(s.helices, NULL, anchors->anchor, anchors->n, &options, NULL, NULL, NULL));
    for (uint32_t j = 0; j < s.helices->n_elements; j++)
        for (int c = 0; c < 3; c++)
            ck_assert_double_eq_tol(s.helices->q[j][c], before->q[j][c], 1e-6);
    groom_anchors_destroy(anchors), groom_superhelices_destroy(before);
    scene_finish(&s);
}
END_TEST

START_TEST(moved_frames_take_their_control_points_along)
{
    struct scene s = scene_of(40, 3);
    struct groom_frame_move moves[2] = {stay, {.cluster = 2, .at = 1.0, .map = {{0, -1, 0, 0.1}, {1, 0, 0, 0}, {0, 0, 2, -0.3}}}};
    struct groom_anchors *anchors;
    ck_ok(groom_clusters_move(s.clusters, s.helices, moves, 2, NULL, &anchors, NULL));
    uint32_t n_first = s.clusters->first[2] - s.clusters->first[1];
    ck_assert_uint_eq(anchors->n, n_first + s.clusters->first[3] - s.clusters->first[2]);
    for (size_t k = n_first; k < anchors->n; k++) {
        const struct groom_anchor *a = &anchors->anchor[k];
        double arc = groom_superhelix_length(s.helices, a->strand), p[3];
        groom_superhelix_sample(s.helices, a->strand, &arc, 1, &p, NULL);
        const double expected[3] = {0.1 - p[1], p[0], 2.0 * p[2] - 0.3};
        ck_assert_uint_eq(s.clusters->of_strand[a->strand], 2);
        ck_assert_double_eq(a->at, 1.0);
        for (int c = 0; c < 3; c++)
            ck_assert_double_eq_tol(a->position[c], expected[c], 1e-12);
    }
    groom_anchors_destroy(anchors);
    scene_finish(&s);
}
END_TEST

static void assert_refused(const struct scene *s, struct groom_frame_move move, const char *pointer)
{
    struct groom_frame_move moves[2] = {stay, move};
    struct groom_anchors *anchors = NULL;
    struct groom_diag diag = {0};
    ck_status(groom_clusters_move(s->clusters, s->helices, moves, 2, NULL, &anchors, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, pointer);
    ck_assert_ptr_null(anchors);
}

START_TEST(bad_moves_are_refused_by_their_field)
{
    struct scene s = scene_of(40, 3);
    struct groom_frame_move move = stay;
    move.cluster = 3, assert_refused(&s, move, "/frames/1/cluster"), move = stay;
    move.at = -0.1, assert_refused(&s, move, "/frames/1/at"), move = stay;
    move.at = NAN, assert_refused(&s, move, "/frames/1/at"), move = stay;
    move.map[1][3] = NAN, assert_refused(&s, move, "/frames/1/transform"), move = stay;
    move.map[2][2] = INFINITY, assert_refused(&s, move, "/frames/1/transform"), move = stay;
    move.map[0][0] = 1e308, move.map[0][1] = 1e308, move.map[0][3] = 1e308;
    for (uint32_t i = 0; i < s.helices->n_strands; i++)
        s.helices->root[i][0] = 1e3;
    assert_refused(&s, move, "/frames/1/transform");
    scene_finish(&s);
}
END_TEST

START_TEST(an_empty_cluster_cannot_be_moved)
{
    const double root[3][3] = {{0}}, tip[3][3] = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
    struct scene s = {.strands = straight(3, root, tip), .helices = superhelix_coils(3, 10, 1, 0)};
    ck_ok(groom_strands_cluster(s.strands, 2, 1, NULL, &s.clusters, NULL));
    struct groom_frame_move move = stay;
    struct groom_anchors *anchors = NULL;
    struct groom_diag diag = {0};
    ck_status(groom_clusters_move(s.clusters, s.helices, &move, 1, NULL, &anchors, &diag), GROOM_EINVAL);
    ck_assert_str_eq(diag.pointer, "/frames/0/cluster");
    ck_assert_ptr_nonnull(strstr(diag.detail, "no strands"));
    scene_finish(&s);
}
END_TEST

START_TEST(strands_of_no_length_get_no_anchor)
{
    struct scene s = scene_of(40, 1);
    struct groom_frame_move move = stay;
    struct groom_anchors *anchors;
    memset(&s.helices->length[45 * 7], 0, 45 * sizeof *s.helices->length);
    move.cluster = 0;
    ck_ok(groom_clusters_move(s.clusters, s.helices, &move, 1, NULL, &anchors, NULL));
    ck_assert_uint_eq(anchors->n, 39);
    for (size_t k = 0; k < anchors->n; k++)
        ck_assert_uint_ne(anchors->anchor[k].strand, 7);
    groom_anchors_destroy(anchors);
    scene_finish(&s);
}
END_TEST

/* Whichever allocation fails: ENOMEM, and nothing is left behind. */
static groom_status whole_way(const struct scene *s, const struct groom_context *context)
{
    static const double at[2] = {0.5, 1.0};
    struct groom_cluster_frame frames[3][2];
    struct groom_clusters *c = NULL;
    struct groom_anchors *anchors = NULL;
    groom_status st = groom_strands_cluster(s->strands, 3, 5, context, &c, NULL);
    if (st == GROOM_OK)
        st = groom_clusters_frames(c, s->strands, at, 2, context, frames[0], NULL);
    if (st == GROOM_OK)
        st = groom_clusters_move(c, s->helices, &stay, 1, context, &anchors, NULL);
    groom_anchors_destroy(anchors), groom_clusters_destroy(c);
    return st;
}

START_TEST(failing_allocations_are_reported_and_leak_nothing)
{
    struct scene s = scene_of(40, 3);
    groom_status st = GROOM_ENOMEM;
    for (size_t n = 0; st != GROOM_OK; n++) {
        struct groom_allocator allocator;
        struct test_failing_allocator state;
        struct groom_context context = {.allocator = &allocator};
        test_failing_allocator_init(&state, n, &allocator);
        st = whole_way(&s, &context);
        ck_assert(st == GROOM_OK || st == GROOM_ENOMEM);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
    }
    scene_finish(&s);
}
END_TEST

TEST_SUITE("clusters", locks_become_clusters, clusters_depend_on_the_seed_and_not_on_the_pool,
           no_cluster_is_empty_where_strands_differ, clustering_refuses_counts_and_strands_that_make_no_sense,
           frames_stand_along_the_mean_strand_and_its_principal_directions,
           frames_turn_with_their_strands_as_little_as_may_be, one_strand_no_length_and_no_strand_have_frames_too,
           frames_do_not_depend_on_the_pool, frames_refuse_stations_off_the_strand,
           a_frame_map_takes_one_frame_to_the_other, the_identity_anchors_strands_where_they_are,
           moved_frames_take_their_control_points_along, bad_moves_are_refused_by_their_field,
           an_empty_cluster_cannot_be_moved, strands_of_no_length_get_no_anchor,
           failing_allocations_are_reported_and_leak_nothing)
