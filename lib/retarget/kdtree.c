/* A balanced tree whose shape follows from the number of points: a range is halved at its median along its
 * longest side until a leaf is left. The points lie in the tree's order, so that a leaf is one short run. */
#include "retarget/kdtree.h"

#include <math.h>

#include "base/memory.h"
#include "base/parallel.h"

#define LEAF 12
#define MOST_DEPTH 32
#define PARALLEL_LEVELS 5

struct split {
    float at;
    uint32_t axis;
};

struct kdtree {
    uint32_t n, n_splits, depth;
    float *x, *y, *z;    /* [n] in the tree's order */
    uint32_t *id;        /* [n] ... and what they were */
    uint32_t *place;     /* [n] the other way round */
    uint32_t *owner;     /* [n] in the tree's order */
    struct split *splits;/* [n_splits] children of i: 2 i + 1, 2 i + 2 */
    const struct groom_allocator *allocator;
};

/* --- building ------------------------------------------------------------------- */

struct build {
    struct kdtree *tree;
    const float (*points)[3];
    uint32_t level;
};

static void swap(uint32_t *a, uint32_t *b)
{
    uint32_t t = *a;
    *a = *b;
    *b = t;
}

static int before(const float (*points)[3], uint32_t a, uint32_t b, int axis)
{
    float p = points[a][axis], q = points[b][axis];
    return p < q || (p == q && a < b);
}

/* Hoare's selection: id[k] is what a sort would put there. */
static void select_nth(uint32_t *id, uint32_t n, uint32_t k, const float (*points)[3], int axis)
{
    uint32_t low = 0, high = n - 1;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (before(points, id[middle], id[low], axis))
            swap(&id[middle], &id[low]);
        if (before(points, id[high], id[low], axis))
            swap(&id[high], &id[low]);
        if (before(points, id[high], id[middle], axis))
            swap(&id[high], &id[middle]);
        uint32_t pivot = id[middle], i = low, j = high;
        while (i <= j) {
            while (before(points, id[i], pivot, axis))
                i++;
            while (before(points, pivot, id[j], axis))
                j--;
            if (i > j)
                break;
            swap(&id[i++], &id[j]);
            if (j == 0)
                break;
            j--;
        }
        if (k <= j)
            high = j;
        else if (k >= i)
            low = i;
        else
            break;
    }
}

static int longest_side(const uint32_t *id, uint32_t n, const float (*points)[3])
{
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    int axis = 0;
    for (uint32_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++) {
            low[c] = fminf(low[c], points[id[i]][c]);
            high[c] = fmaxf(high[c], points[id[i]][c]);
        }
    for (int c = 1; c < 3; c++)
        if (high[c] - low[c] > high[axis] - low[axis])
            axis = c;
    return axis;
}

/* Splits the range of `node`, and all below it down to level `until`. */
static void build_node(struct build *build, uint32_t node, uint32_t first, uint32_t n, uint32_t level, uint32_t until)
{
    struct kdtree *tree = build->tree;
    if (level == until || level == tree->depth)
        return;
    uint32_t *id = tree->id + first, half = n / 2;
    int axis = longest_side(id, n, build->points);
    select_nth(id, n, half, build->points, axis);
    tree->splits[node] = (struct split){build->points[id[half]][axis], (uint32_t)axis};
    build_node(build, 2 * node + 1, first, half, level + 1, until);
    build_node(build, 2 * node + 2, first + half, n - half, level + 1, until);
}

/* The range of the piece-th node of a level. */
static void build_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct build *build = user;
    uint32_t node = 0, first = 0, n = build->tree->n;
    (void)thread;
    for (uint32_t level = 0; level < build->level; level++) {
        uint32_t half = n / 2, right = piece >> (build->level - 1 - level) & 1;
        node = 2 * node + 1 + right;
        first += right ? half : 0;
        n = right ? n - half : half;
    }
    build_node(build, node, first, n, build->level, build->level < PARALLEL_LEVELS ? build->level + 1 : MOST_DEPTH);
}

static void place_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct build *build = user;
    struct kdtree *tree = build->tree;
    (void)thread;
    for (uint32_t i = piece * 65536; i < tree->n && i - piece * 65536 < 65536; i++) {
        const float *p = build->points[tree->id[i]];
        tree->x[i] = p[0], tree->y[i] = p[1], tree->z[i] = p[2];
        tree->place[tree->id[i]] = i;
    }
}

static void fill(struct kdtree *tree, const float (*points)[3], const uint32_t *owner, const struct groom_context *context)
{
    struct build build = {tree, points, 0};
    for (uint32_t i = 0; i < tree->n; i++)
        tree->id[i] = i;
    for (; build.level <= PARALLEL_LEVELS && build.level <= tree->depth; build.level++)
        parallel_for(context, 1u << build.level, build_piece, &build);
    parallel_for(context, tree->n / 65536 + 1, place_piece, &build);
    for (uint32_t i = 0; i < tree->n; i++)
        tree->owner[i] = owner[tree->id[i]];
}

groom_status kdtree_create(const float (*points)[3], const uint32_t *owner, uint32_t n,
                           const struct groom_context *context, struct kdtree **out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct kdtree *tree = memory_array_zero(allocator, 1, sizeof *tree);
    if (!tree)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to index %u points", n);
    tree->allocator = allocator;
    tree->n = n;
    for (uint32_t left = n; left > LEAF; left -= left / 2)
        tree->depth++;
    tree->n_splits = (1u << tree->depth) - 1;
    tree->x = memory_array(allocator, n, sizeof *tree->x);
    tree->y = memory_array(allocator, n, sizeof *tree->y);
    tree->z = memory_array(allocator, n, sizeof *tree->z);
    tree->id = memory_array(allocator, n, sizeof *tree->id);
    tree->place = memory_array(allocator, n, sizeof *tree->place);
    tree->owner = memory_array(allocator, n, sizeof *tree->owner);
    tree->splits = memory_array(allocator, tree->n_splits, sizeof *tree->splits);
    if (!tree->x || !tree->y || !tree->z || !tree->id || !tree->place || !tree->owner || !tree->splits) {
        kdtree_destroy(tree);
        return groom_fail(diag, GROOM_ENOMEM, "no memory to index %u points", n);
    }
    fill(tree, points, owner, context);
    *out = tree;
    return GROOM_OK;
}

void kdtree_destroy(struct kdtree *tree)
{
    if (!tree)
        return;
    memory_release(tree->allocator, tree->x, tree->n, sizeof *tree->x);
    memory_release(tree->allocator, tree->y, tree->n, sizeof *tree->y);
    memory_release(tree->allocator, tree->z, tree->n, sizeof *tree->z);
    memory_release(tree->allocator, tree->id, tree->n, sizeof *tree->id);
    memory_release(tree->allocator, tree->place, tree->n, sizeof *tree->place);
    memory_release(tree->allocator, tree->owner, tree->n, sizeof *tree->owner);
    memory_release(tree->allocator, tree->splits, tree->n_splits, sizeof *tree->splits);
    memory_release(tree->allocator, tree, 1, sizeof *tree);
}

/* --- asking ---------------------------------------------------------------------- */

struct find {
    const struct kdtree *tree;
    const float *point;
    uint32_t owner, k, n;
    float worst; /* squared; what is farther is of no use */
    struct kdtree_found *found;
};

static float squared_to(const struct kdtree *tree, uint32_t place, const float p[3])
{
    float dx = tree->x[place] - p[0], dy = tree->y[place] - p[1], dz = tree->z[place] - p[2];
    return dx * dx + dy * dy + dz * dz;
}

static int nearer(struct kdtree_found a, struct kdtree_found b)
{
    return a.squared < b.squared || (a.squared == b.squared && a.id < b.id);
}

static void take(struct find *find, struct kdtree_found one)
{
    uint32_t at = find->n;
    if (at == find->k && !nearer(one, find->found[at - 1]))
        return;
    if (at == find->k)
        at--;
    else
        find->n++;
    for (; at > 0 && nearer(one, find->found[at - 1]); at--)
        find->found[at] = find->found[at - 1];
    find->found[at] = one;
    if (find->n == find->k && find->found[find->k - 1].squared < find->worst)
        find->worst = find->found[find->k - 1].squared;
}

static void visit_leaf(struct find *find, uint32_t first, uint32_t n)
{
    float squared[LEAF];
    for (uint32_t i = 0; i < n; i++)
        squared[i] = squared_to(find->tree, first + i, find->point);
    for (uint32_t i = 0; i < n; i++)
        if (squared[i] <= find->worst && find->tree->owner[first + i] != find->owner)
            take(find, (struct kdtree_found){squared[i], find->tree->id[first + i]});
}

/* off: the vector from the query to the node's box, along each axis; `away` its square. */
static void visit(struct find *find, uint32_t node, uint32_t level, uint32_t first, uint32_t n, float off[3], float away)
{
    const struct kdtree *tree = find->tree;
    if (level == tree->depth) {
        visit_leaf(find, first, n);
        return;
    }
    struct split split = tree->splits[node];
    float d = find->point[split.axis] - split.at, old = off[split.axis];
    uint32_t half = n / 2;
    int right = d > 0;
    if (right)
        visit(find, 2 * node + 2, level + 1, first + half, n - half, off, away);
    else
        visit(find, 2 * node + 1, level + 1, first, half, off, away);
    float far = away - old * old + d * d;
    if (far * 0.99999f > find->worst)
        return;
    off[split.axis] = d;
    if (right)
        visit(find, 2 * node + 1, level + 1, first, half, off, far);
    else
        visit(find, 2 * node + 2, level + 1, first + half, n - half, off, far);
    off[split.axis] = old;
}

uint32_t kdtree_find(const struct kdtree *tree, const float point[3], uint32_t owner, uint32_t k, float within,
                     struct kdtree_found *found)
{
    struct find find = {.tree = tree, .point = point, .owner = owner, .k = k, .worst = within, .found = found};
    float off[3] = {0, 0, 0};
    visit(&find, 0, 0, 0, tree->n, off, 0);
    return find.n;
}

float kdtree_squared(const struct kdtree *tree, uint32_t id, const float point[3])
{
    return squared_to(tree, tree->place[id], point);
}
