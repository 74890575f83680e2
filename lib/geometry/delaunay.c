/* Delaunay triangulation on reentrant Qhull: the lower hull of the points lifted to a paraboloid. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <libqhull_r/qhull_ra.h>

#include "base/growing.h"
#include "base/memory.h"
#include "groom/spatial.h"

/* The points in the order of their places. */
struct ordered {
    float p[2];
    uint32_t index;
};

struct delaunay {
    const struct groom_allocator *allocator;
    const float (*points)[2];
    uint32_t n, n_places;
    struct ordered *ordered; /* [n] */
    double (*places)[2];     /* [n] the first n_places of them: distinct, about the origin, of size one */
    uint32_t *lowest;        /* [n] the lowest index at each place */
    struct growing triangles, edges; /* uint32_t[3], uint32_t[2] */
};

static int compare_ordered(const void *a, const void *b)
{
    const struct ordered *p = a, *q = b;
    for (int i = 0; i < 2; i++)
        if (p->p[i] != q->p[i])
            return p->p[i] < q->p[i] ? -1 : 1;
    return p->index < q->index ? -1 : p->index > q->index;
}

/* Distinct places, left to right then upwards; same_as of every point. */
static void gather_places(struct delaunay *d, uint32_t *same_as)
{
    for (uint32_t i = 0; i < d->n; i++)
        d->ordered[i] = (struct ordered){{d->points[i][0], d->points[i][1]}, i};
    qsort(d->ordered, d->n, sizeof *d->ordered, compare_ordered);
    for (uint32_t i = 0; i < d->n; i++) {
        struct ordered *o = &d->ordered[i];
        if (i == 0 || o->p[0] != o[-1].p[0] || o->p[1] != o[-1].p[1]) {
            d->places[d->n_places][0] = o->p[0];
            d->places[d->n_places][1] = o->p[1];
            d->lowest[d->n_places++] = o->index;
        }
        same_as[o->index] = d->lowest[d->n_places - 1];
    }
}

/* About the origin and of size one, so that Qhull's tolerances mean the same for all. */
static void normalize(struct delaunay *d)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (uint32_t i = 0; i < d->n_places; i++)
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], d->places[i][k]);
            high[k] = fmax(high[k], d->places[i][k]);
        }
    double size = fmax(high[0] - low[0], high[1] - low[1]);
    for (uint32_t i = 0; i < d->n_places; i++)
        for (int k = 0; k < 2; k++)
            d->places[i][k] = size > 0 ? (d->places[i][k] - 0.5 * (low[k] + high[k])) / size : 0;
}

static double turn(const double *a, const double *b, const double *c)
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Whether all lie on the line through the outermost two, within the rounding of float coordinates. */
static int is_line(const struct delaunay *d)
{
    const double *a = d->places[0], *b = d->places[d->n_places - 1];
    for (uint32_t i = 1; i + 1 < d->n_places; i++)
        if (fabs(turn(a, b, d->places[i])) > 1e-9)
            return 0;
    return 1;
}

/* --- Qhull ------------------------------------------------------------------------ */

static int add_triangle(struct delaunay *d, const uint32_t place[3])
{
    uint32_t v[3] = {place[0], place[1], place[2]};
    double t = turn(d->places[v[0]], d->places[v[1]], d->places[v[2]]);
    if (t == 0)
        return 1; /* four on a circle may leave a flat one on the hull */
    uint32_t *out = growing_add(&d->triangles, 1, d->allocator);
    if (!out)
        return 0;
    if (t < 0) {
        v[1] = place[2];
        v[2] = place[1];
    }
    for (int i = 0; i < 3; i++)
        v[i] = d->lowest[v[i]];
    int least = v[0] < v[1] ? (v[0] < v[2] ? 0 : 2) : (v[1] < v[2] ? 1 : 2);
    for (int i = 0; i < 3; i++)
        out[i] = v[(least + i) % 3];
    return 1;
}

static int take_facets(struct delaunay *d, qhT *qh)
{
    for (facetT *facet = qh->facet_list; facet && facet->next; facet = facet->next) {
        uint32_t place[3];
        int n = 0;
        if (facet->upperdelaunay)
            continue;
        for (vertexT **vertex = SETaddr_(facet->vertices, vertexT); *vertex; vertex++) {
            int id = qh_pointid(qh, (*vertex)->point);
            if (n < 3 && id >= 0 && (uint32_t)id < d->n_places)
                place[n++] = (uint32_t)id;
        }
        if (n == 3 && !add_triangle(d, place))
            return 0;
    }
    return 1;
}

static groom_status run_qhull(struct delaunay *d, struct groom_diag *diag)
{
    qhT *qh = memory_array_zero(d->allocator, 1, sizeof *qh);
    char words[1024] = "", options[] = "qhull d Qbb Qc Qz Qt";
    FILE *errors = qh ? fmemopen(words, sizeof words - 1, "w") : NULL;
    groom_status st = GROOM_OK;
    int left, in_use;
    if (!errors) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for a triangulation of %u points", d->n);
        goto out;
    }
    qh_zero(qh, errors);
    if (qh_new_qhull(qh, 2, (int)d->n_places, (double *)d->places, 0, options, NULL, errors) != 0) {
        fflush(errors);
        words[strcspn(words, "\n")] = '\0';
        st = groom_fail(diag, GROOM_EINTERNAL, "Qhull could not triangulate %u points: %.200s", d->n, words);
    } else if (!take_facets(d, qh)) {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for the triangles of %u points", d->n);
    }
    qh_freeqhull(qh, !qh_ALL);
    qh_memfreeshort(qh, &left, &in_use);
out:
    if (errors)
        fclose(errors);
    memory_release(d->allocator, qh, 1, sizeof *qh);
    return st;
}

/* --- edges -------------------------------------------------------------------------- */

static int add_edge(struct delaunay *d, uint32_t a, uint32_t b)
{
    uint32_t *edge = growing_add(&d->edges, 1, d->allocator);
    if (!edge)
        return 0;
    edge[0] = a < b ? a : b;
    edge[1] = a < b ? b : a;
    return 1;
}

static int add_path(struct delaunay *d)
{
    for (uint32_t i = 0; i + 1 < d->n_places; i++)
        if (!add_edge(d, d->lowest[i], d->lowest[i + 1]))
            return 0;
    return 1;
}

static int add_sides(struct delaunay *d)
{
    const uint32_t(*t)[3] = d->triangles.items;
    for (size_t i = 0; i < d->triangles.count; i++)
        for (int k = 0; k < 3; k++)
            if (!add_edge(d, t[i][k], t[i][(k + 1) % 3]))
                return 0;
    return 1;
}

static int compare_numbers(const uint32_t *a, const uint32_t *b, int n)
{
    for (int i = 0; i < n; i++)
        if (a[i] != b[i])
            return a[i] < b[i] ? -1 : 1;
    return 0;
}
static int compare_triangles(const void *a, const void *b) { return compare_numbers(a, b, 3); }
static int compare_edges(const void *a, const void *b) { return compare_numbers(a, b, 2); }

/* Each edge once. */
static void sort_edges(struct growing *edges)
{
    uint32_t(*e)[2] = edges->items;
    size_t n = 0;
    if (edges->count == 0)
        return;
    qsort(e, edges->count, sizeof *e, compare_edges);
    for (size_t i = 0; i < edges->count; i++)
        if (i == 0 || memcmp(e[i], e[n - 1], sizeof *e) != 0)
            memmove(e[n++], e[i], sizeof *e);
    edges->count = n;
}

/* --- the whole ------------------------------------------------------------------------ */

static groom_status connect(struct delaunay *d, struct groom_diag *diag)
{
    int added;
    normalize(d);
    if (d->n_places < 3 || is_line(d)) {
        added = add_path(d);
    } else {
        groom_status st = run_qhull(d, diag);
        if (st != GROOM_OK)
            return st;
        added = add_sides(d);
    }
    if (!added)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the edges of %u points", d->n);
    if (d->triangles.count)
        qsort(d->triangles.items, d->triangles.count, sizeof(uint32_t[3]), compare_triangles);
    sort_edges(&d->edges);
    return GROOM_OK;
}

static int delaunay_init(struct delaunay *d, const float (*points)[2], uint32_t n, const struct groom_allocator *allocator)
{
    *d = (struct delaunay){.allocator = allocator, .points = points, .n = n,
                           .triangles = growing_of(sizeof(uint32_t[3])), .edges = growing_of(sizeof(uint32_t[2]))};
    d->ordered = memory_array(allocator, n, sizeof *d->ordered);
    d->places = memory_array(allocator, n, sizeof *d->places);
    d->lowest = memory_array(allocator, n, sizeof *d->lowest);
    return d->ordered && d->places && d->lowest;
}

static void delaunay_finish(struct delaunay *d)
{
    memory_release(d->allocator, d->ordered, d->n, sizeof *d->ordered);
    memory_release(d->allocator, d->places, d->n, sizeof *d->places);
    memory_release(d->allocator, d->lowest, d->n, sizeof *d->lowest);
    growing_finish(&d->triangles, d->allocator);
    growing_finish(&d->edges, d->allocator);
}

static int pack(const struct delaunay *d, struct groom_triangulation *t)
{
    t->triangles = memory_array(d->allocator, d->triangles.count, sizeof *t->triangles);
    t->n_triangles = (uint32_t)d->triangles.count;
    t->edges = memory_array(d->allocator, d->edges.count, sizeof *t->edges);
    t->n_edges = (uint32_t)d->edges.count;
    if (!t->triangles || !t->edges)
        return 0;
    if (t->n_triangles)
        memcpy(t->triangles, d->triangles.items, t->n_triangles * sizeof *t->triangles);
    if (t->n_edges)
        memcpy(t->edges, d->edges.items, t->n_edges * sizeof *t->edges);
    return 1;
}

static int all_finite(const float (*points)[2], uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        if (!(fabsf(points[i][0]) <= 1e15f && fabsf(points[i][1]) <= 1e15f))
            return 0;
    return 1;
}

groom_status groom_triangulation_create(const float (*points)[2], uint32_t n, const struct groom_context *context,
                                        struct groom_triangulation **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_triangulation *t = NULL;
    struct delaunay d = {0};
    if (n == 0)
        return groom_fail(diag, GROOM_EEMPTY, "there is no point to triangulate");
    if (n > INT32_MAX || !all_finite(points, n))
        return groom_fail(diag, GROOM_EINVAL, "a point is not finite or beyond 1e15, or there are more than 2^31-1");
    groom_status st = groom_fail(diag, GROOM_ENOMEM, "no memory for a triangulation of %u points", n);
    int ready = delaunay_init(&d, points, n, allocator);
    t = memory_array_zero(allocator, 1, sizeof *t);
    if (t) {
        t->allocator = allocator;
        t->n_points = n;
    }
    if (!ready || !t)
        goto out;
    t->same_as = memory_array(allocator, n, sizeof *t->same_as);
    if (!t->same_as)
        goto out;
    gather_places(&d, t->same_as);
    st = connect(&d, diag);
    if (st == GROOM_OK && !pack(&d, t))
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for a triangulation of %u points", n);
    if (st == GROOM_OK) {
        *out = t;
        t = NULL;
    }
out:
    groom_triangulation_destroy(t);
    delaunay_finish(&d);
    return st;
}

void groom_triangulation_destroy(struct groom_triangulation *t)
{
    if (!t)
        return;
    memory_release(t->allocator, t->same_as, t->n_points, sizeof *t->same_as);
    memory_release(t->allocator, t->triangles, t->n_triangles, sizeof *t->triangles);
    memory_release(t->allocator, t->edges, t->n_edges, sizeof *t->edges);
    memory_release(t->allocator, t, 1, sizeof *t);
}
