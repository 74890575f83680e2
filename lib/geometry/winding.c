/* The generalized winding number (Jacobson et al. 2013) by a tree of dipoles (Barill et al. 2018):
 * a far cluster of triangles acts as its area vector at its centre, with the first-order term of
 * their Eq. 15; near triangles count by their exact solid angle (Van Oosterom and Strackee 1983). */
#include <string.h>

#include "base/memory.h"
#include "geometry/bvh.h"

#define LEAF_TRIANGLES 8
#define FAR 3.0 /* in radii of a cluster: where its dipole stands for it */

struct winding_node {
    struct vec centre, area;  /* area-weighted centre; sum of area vectors */
    double moment[3][3];      /* sum of (centroid - centre) times area vector: [i][j] = d_i a_j */
    double radius;            /* of the ball about the centre that holds all corners */
    uint32_t first, count;    /* triangles, in the tree's order */
    uint32_t right;           /* the left child follows its parent; 0: a leaf */
};

struct winding_tree {
    const struct groom_mesh *mesh;
    const struct groom_allocator *allocator;
    uint32_t *order;          /* [n_triangles] */
    struct winding_node *nodes;
    uint32_t n_nodes;
    size_t capacity;
};

static void corners_of(const struct groom_mesh *mesh, uint32_t t, struct vec c[3])
{
    for (int i = 0; i < 3; i++)
        c[i] = vec_of(mesh->points[mesh->triangles[t][i]]);
}

static struct vec area_vector(const struct vec c[3])
{
    return vec_scale(vec_cross(vec_sub(c[1], c[0]), vec_sub(c[2], c[0])), 0.5);
}

static struct vec centroid(const struct vec c[3]) { return vec_scale(vec_add(vec_add(c[0], c[1]), c[2]), 1.0 / 3); }

static double coordinate(struct vec v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

/* --- building ------------------------------------------------------------- */

static void summarize(const struct winding_tree *tree, struct winding_node *node)
{
    struct vec c[3], weighted = {0, 0, 0}, plain = {0, 0, 0};
    double total = 0;
    for (uint32_t i = 0; i < node->count; i++) {
        corners_of(tree->mesh, tree->order[node->first + i], c);
        struct vec a = area_vector(c);
        double size = vec_length(a);
        node->area = vec_add(node->area, a);
        weighted = vec_add(weighted, vec_scale(centroid(c), size));
        plain = vec_add(plain, centroid(c));
        total += size;
    }
    node->centre = total > 0 ? vec_scale(weighted, 1 / total) : vec_scale(plain, 1.0 / node->count);
    for (uint32_t i = 0; i < node->count; i++) {
        corners_of(tree->mesh, tree->order[node->first + i], c);
        struct vec a = area_vector(c), d = vec_sub(centroid(c), node->centre);
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                node->moment[j][k] += coordinate(d, j) * coordinate(a, k);
        for (int j = 0; j < 3; j++)
            node->radius = fmax(node->radius, vec_length(vec_sub(c[j], node->centre)));
    }
}

/* The longest axis of the box of centroids, and its middle. */
static int split_axis(const struct winding_tree *tree, uint32_t first, uint32_t count, double *middle)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    int axis = 0;
    for (uint32_t i = 0; i < count; i++) {
        struct vec c[3];
        corners_of(tree->mesh, tree->order[first + i], c);
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], coordinate(centroid(c), k));
            high[k] = fmax(high[k], coordinate(centroid(c), k));
        }
    }
    for (int k = 1; k < 3; k++)
        if (high[k] - low[k] > high[axis] - low[axis])
            axis = k;
    *middle = 0.5 * (low[axis] + high[axis]);
    return axis;
}

static uint32_t partition(struct winding_tree *tree, uint32_t first, uint32_t count)
{
    double middle;
    int axis = split_axis(tree, first, count, &middle);
    uint32_t n_left = 0;
    for (uint32_t i = 0; i < count; i++) {
        struct vec c[3];
        uint32_t t = tree->order[first + i];
        corners_of(tree->mesh, t, c);
        if (coordinate(centroid(c), axis) < middle) {
            tree->order[first + i] = tree->order[first + n_left];
            tree->order[first + n_left++] = t;
        }
    }
    return n_left;
}

/* Depth is bounded: a lopsided cut in the middle of space becomes one in the middle of the list. */
static uint32_t build(struct winding_tree *tree, uint32_t first, uint32_t count)
{
    uint32_t index = tree->n_nodes++;
    struct winding_node *node = &tree->nodes[index];
    *node = (struct winding_node){.first = first, .count = count};
    summarize(tree, node);
    if (count <= LEAF_TRIANGLES)
        return index;
    uint32_t n_left = partition(tree, first, count);
    if (n_left < count / 8 || n_left > count - count / 8 || n_left == 0 || n_left == count)
        n_left = count / 2;
    build(tree, first, n_left);
    node->right = build(tree, first + n_left, count - n_left);
    return index;
}

groom_status winding_tree_create(const struct groom_mesh *mesh, const struct groom_allocator *allocator,
                                 struct winding_tree **out, struct groom_diag *diag)
{
    struct winding_tree *tree = memory_array_zero(allocator, 1, sizeof *tree);
    if (tree) {
        tree->mesh = mesh;
        tree->allocator = allocator;
        tree->capacity = (size_t)mesh->n_triangles * 2;
        tree->order = memory_array(allocator, mesh->n_triangles, sizeof *tree->order);
        tree->nodes = memory_array(allocator, tree->capacity, sizeof *tree->nodes);
    }
    if (!tree || !tree->order || !tree->nodes) {
        winding_tree_destroy(tree);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the winding tree of %u triangles", mesh->n_triangles);
    }
    for (uint32_t i = 0; i < mesh->n_triangles; i++)
        tree->order[i] = i;
    build(tree, 0, mesh->n_triangles);
    *out = tree;
    return GROOM_OK;
}

void winding_tree_destroy(struct winding_tree *tree)
{
    if (!tree)
        return;
    memory_release(tree->allocator, tree->order, tree->mesh->n_triangles, sizeof *tree->order);
    memory_release(tree->allocator, tree->nodes, tree->capacity, sizeof *tree->nodes);
    memory_release(tree->allocator, tree, 1, sizeof *tree);
}

/* --- asking ---------------------------------------------------------------- */

/* The solid angle of a triangle, in units of the whole sphere; 0 on its plane and at its corners. */
static double solid_angle(struct vec p, const struct vec corner[3])
{
    struct vec a = vec_sub(corner[0], p), b = vec_sub(corner[1], p), c = vec_sub(corner[2], p);
    double la = vec_length(a), lb = vec_length(b), lc = vec_length(c);
    double numerator = vec_dot(a, vec_cross(b, c));
    double denominator = la * lb * lc + vec_dot(a, b) * lc + vec_dot(b, c) * la + vec_dot(c, a) * lb;
    return numerator == 0 ? 0 : atan2(numerator, denominator) / (2 * M_PI);
}

static double dipole(const struct winding_node *node, struct vec r, double distance)
{
    double inverse3 = 1 / (distance * distance * distance);
    const double(*m)[3] = node->moment;
    double rv[3] = {r.x, r.y, r.z}, trace = m[0][0] + m[1][1] + m[2][2], bent = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            bent += rv[i] * m[i][j] * rv[j];
    return (vec_dot(r, node->area) + trace - 3 * bent / (distance * distance)) * inverse3 / (4 * M_PI);
}

static double leaf(const struct winding_tree *tree, const struct winding_node *node, struct vec point)
{
    double sum = 0;
    for (uint32_t i = 0; i < node->count; i++) {
        struct vec c[3];
        corners_of(tree->mesh, tree->order[node->first + i], c);
        sum += solid_angle(point, c);
    }
    return sum;
}

double winding_number(const struct winding_tree *tree, struct vec point)
{
    uint32_t stack[192], n = 0; /* a child has at most 7/8 of its parent */
    double sum = 0;
    stack[n++] = 0;
    while (n) {
        uint32_t index = stack[--n];
        const struct winding_node *node = &tree->nodes[index];
        struct vec r = vec_sub(node->centre, point);
        double distance = vec_length(r);
        if (distance > FAR * node->radius && distance > 0) {
            sum += dipole(node, r, distance);
        } else if (node->right == 0) {
            sum += leaf(tree, node, point);
        } else {
            stack[n++] = node->right;
            stack[n++] = index + 1;
        }
    }
    return sum;
}
