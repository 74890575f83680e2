/* A skeleton from the shape of a mesh alone: slices across y tell head, neck and shoulders. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "geometry/sides.h"
#include "geometry/vec.h"
#include "groom/skeleton.h"

#define N_SLICES 256

/* Proportions, in widths of the head (w) or heights of it from its joint with the neck to the top (h). */
#define NARROWED 0.8        /* w: a slice below the widest that ends the skull */
#define LEAST_NECK 0.35     /* w: what is narrower is a chin or the end of the mesh */
#define NECK_SPREAD 1.15    /* of the narrowest: its slices belong to the neck */
#define SHOULDER_SPREAD 1.35 /* of the narrowest: there the shoulders begin */
#define NECK_LENGTH 0.08    /* h, at least */
#define SHOULDER_OUT 0.87   /* w: from the middle to a shoulder's joint */
#define LEAST_SHOULDER 0.6  /* w: what reaches less far out has none */
#define SHOULDER_DOWN 0.25  /* h: the joint below the skin */
#define CLAVICLE_DOWN 0.15  /* h: below the neck's base */
#define CROWN_DOWN 0.28     /* h: end of the head's bone below the top */
#define LEAST_ARM 0.35      /* h */
#define MOST_ARM 1.3        /* h: about where the elbow is */

struct slice {
    double low[2], high[2]; /* extent in x and z; empty: low > high */
};

struct shape {
    const struct groom_mesh *mesh;
    const unsigned char *taken; /* [n_triangles] of the largest shell */
    double top, step;           /* slice k lies at top - (k + 1/2) step */
    struct slice slices[N_SLICES];
    int widest, joint, base;    /* slices: of the head, of its joint with the neck, of the neck's end */
    int neck, shoulders;        /* whether there are */
    double width, height;       /* of the head */
};

static double slice_y(const struct shape *shape, int k) { return shape->top - (k + 0.5) * shape->step; }
static double slice_width(const struct shape *shape, int k) { return fmax(0, shape->slices[k].high[0] - shape->slices[k].low[0]); }
static double slice_middle(const struct shape *shape, int k, int axis)
{
    return 0.5 * (shape->slices[k].low[axis] + shape->slices[k].high[axis]);
}

/* --- the largest shell ------------------------------------------------------------------------ */

static uint32_t root_of(uint32_t *up, uint32_t v)
{
    while (up[v] != v)
        v = up[v] = up[up[v]];
    return v;
}

static void mark_largest(const struct groom_mesh *mesh, const struct mesh_sides *sides, uint32_t *up, uint32_t *count,
                         unsigned char *taken)
{
    uint32_t best = 0;
    for (uint32_t v = 0; v < mesh->n_vertices; v++)
        up[v] = v;
    for (size_t i = 0; i < sides->n; i++) {
        uint32_t a = root_of(up, sides->sides[i].low), b = root_of(up, sides->sides[i].high);
        up[a > b ? a : b] = a > b ? b : a;
    }
    for (uint32_t t = 0; t < mesh->n_triangles; t++)
        count[root_of(up, sides->welded[mesh->triangles[t][0]])]++;
    for (uint32_t v = 1; v < mesh->n_vertices; v++)
        if (count[v] > count[best])
            best = v;
    for (uint32_t t = 0; t < mesh->n_triangles; t++)
        taken[t] = root_of(up, sides->welded[mesh->triangles[t][0]]) == best;
}

static groom_status take_largest(const struct groom_mesh *mesh, unsigned char *taken,
                                 const struct groom_allocator *allocator, struct groom_diag *diag)
{
    struct mesh_sides sides = {0};
    uint32_t *up = memory_array(allocator, mesh->n_vertices, sizeof *up);
    uint32_t *count = memory_array_zero(allocator, mesh->n_vertices, sizeof *count);
    groom_status st = up && count ? mesh_sides_init(&sides, mesh, allocator, diag)
                                  : groom_fail(diag, GROOM_ENOMEM, "no memory to find a skeleton");
    if (st == GROOM_OK)
        mark_largest(mesh, &sides, up, count, taken);
    mesh_sides_finish(&sides);
    memory_release(allocator, up, mesh->n_vertices, sizeof *up);
    memory_release(allocator, count, mesh->n_vertices, sizeof *count);
    return st;
}

/* --- slices ------------------------------------------------------------------------------------- */

static void cut_edge(struct shape *shape, const float a[3], const float b[3])
{
    const float *upper = a[1] > b[1] ? a : b, *lower = a[1] > b[1] ? b : a;
    int first = (int)ceil((shape->top - (double)upper[1]) / shape->step - 0.5);
    int last = (int)floor((shape->top - (double)lower[1]) / shape->step - 0.5);
    for (int k = first < 0 ? 0 : first; k <= last && k < N_SLICES; k++) {
        double rise = (double)upper[1] - lower[1], t = rise > 0 ? (slice_y(shape, k) - lower[1]) / rise : 0;
        for (int axis = 0; axis < 2; axis++) {
            double at = lower[2 * axis] + t * ((double)upper[2 * axis] - lower[2 * axis]);
            shape->slices[k].low[axis] = fmin(shape->slices[k].low[axis], at);
            shape->slices[k].high[axis] = fmax(shape->slices[k].high[axis], at);
        }
    }
}

static groom_status cut_slices(struct shape *shape, struct groom_diag *diag)
{
    const struct groom_mesh *mesh = shape->mesh;
    double low = INFINITY, high = -INFINITY;
    for (uint32_t t = 0; t < mesh->n_triangles; t++)
        for (int i = 0; shape->taken[t] && i < 3; i++) {
            low = fmin(low, mesh->points[mesh->triangles[t][i]][1]);
            high = fmax(high, mesh->points[mesh->triangles[t][i]][1]);
        }
    if (!(high - low > GROOM_BONE_MIN_LENGTH))
        return groom_fail(diag, GROOM_EDEGENERATE, "the mesh has no height: no skeleton can be found in it");
    shape->top = high;
    shape->step = (high - low) / N_SLICES;
    for (int k = 0; k < N_SLICES; k++)
        shape->slices[k] = (struct slice){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (uint32_t t = 0; t < mesh->n_triangles; t++)
        for (int i = 0; shape->taken[t] && i < 3; i++)
            cut_edge(shape, mesh->points[mesh->triangles[t][i]], mesh->points[mesh->triangles[t][(i + 1) % 3]]);
    return GROOM_OK;
}

/* --- head and neck -------------------------------------------------------------------------------- */

/* The widest slice before the first that is much narrower; returns that narrower one, or N_SLICES. */
static int end_of_skull(struct shape *shape)
{
    int k = 0;
    for (shape->widest = 0; k < N_SLICES; k++) {
        if (slice_width(shape, k) > slice_width(shape, shape->widest))
            shape->widest = k;
        if (slice_width(shape, k) < NARROWED * slice_width(shape, shape->widest))
            break;
    }
    shape->width = slice_width(shape, shape->widest);
    return k;
}

/* The narrowest slice from `from` on, before the shoulders or the end. */
static int narrowest_slice(struct shape *shape, int from)
{
    int narrowest = from;
    for (int k = from; k < N_SLICES && slice_width(shape, k) >= LEAST_NECK * shape->width; k++) {
        if (slice_width(shape, k) < slice_width(shape, narrowest))
            narrowest = k;
        shape->base = k;
        if (slice_width(shape, k) > SHOULDER_SPREAD * slice_width(shape, narrowest)) {
            shape->shoulders = 1;
            break;
        }
    }
    return narrowest;
}

static void find_neck(struct shape *shape)
{
    int skull_end = end_of_skull(shape);
    shape->neck = shape->shoulders = 0;
    if (skull_end < N_SLICES) {
        int narrowest = narrowest_slice(shape, skull_end);
        for (shape->joint = skull_end; slice_width(shape, shape->joint) > NECK_SPREAD * slice_width(shape, narrowest); )
            shape->joint++;
        shape->neck = slice_width(shape, narrowest) >= LEAST_NECK * shape->width &&
                      shape->base - shape->joint >= NECK_LENGTH * shape->joint;
    }
    if (!shape->neck) {
        shape->shoulders = 0;
        shape->joint = N_SLICES - 1 - N_SLICES / 8;
    }
    shape->height = shape->top - slice_y(shape, shape->joint);
}

static struct groom_bone *add_bone(struct groom_skeleton *skeleton, const char *name, struct vec head, struct vec tail)
{
    struct groom_bone *bone = &skeleton->bones[skeleton->n_bones++];
    strcpy(bone->name, name);
    vec_store(head, bone->head);
    vec_store(tail, bone->tail);
    return bone;
}

static void add_head(const struct shape *shape, struct groom_skeleton *skeleton)
{
    int at = shape->neck ? (2 * shape->joint + 3 * shape->base) / 5 : shape->widest; /* below the chin */
    struct vec joint = {slice_middle(shape, at, 0), slice_y(shape, shape->joint), slice_middle(shape, at, 1)};
    struct vec crown = {slice_middle(shape, shape->widest, 0), shape->top - CROWN_DOWN * shape->height,
                        slice_middle(shape, shape->widest, 1)};
    struct vec base = {joint.x, slice_y(shape, shape->base), joint.z};
    add_bone(skeleton, "head", joint, crown);
    if (shape->neck)
        add_bone(skeleton, "neck", base, joint);
}

/* --- shoulders and arms ------------------------------------------------------------------------------ */

/* How far the mesh reaches to one side (-1, 1) within a head's height below the neck. */
static double reach_of(const struct shape *shape, double middle, int side)
{
    double reach = 0;
    for (int k = shape->base; k < N_SLICES && k < shape->base + shape->joint; k++)
        reach = fmax(reach, side > 0 ? shape->slices[k].high[0] - middle : middle - shape->slices[k].low[0]);
    return reach;
}

/* Where the surface crosses the plane at x, below the neck's joint: its top, and the middle of what
 * of it lies within `depth` of that. returns 0 where it does not */
static int column_at(const struct shape *shape, double x, double depth, double *top, struct vec *middle)
{
    const struct groom_mesh *mesh = shape->mesh;
    double low = INFINITY, high = -INFINITY, bottom = INFINITY;
    *top = -INFINITY;
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t t = 0; t < mesh->n_triangles; t++)
            for (int i = 0; shape->taken[t] && i < 3; i++) {
                struct vec a = vec_of(mesh->points[mesh->triangles[t][i]]), b = vec_of(mesh->points[mesh->triangles[t][(i + 1) % 3]]);
                if ((a.x < x) == (b.x < x))
                    continue;
                struct vec p = vec_add(a, vec_scale(vec_sub(b, a), (x - a.x) / (b.x - a.x)));
                if (p.y > slice_y(shape, shape->joint))
                    continue;
                if (pass == 0)
                    *top = fmax(*top, p.y);
                else if (p.y > *top - depth) {
                    low = fmin(low, p.z);
                    high = fmax(high, p.z);
                    bottom = fmin(bottom, p.y);
                }
            }
    *middle = (struct vec){x, 0.5 * (*top + bottom), 0.5 * (low + high)};
    return isfinite(*top) && isfinite(middle->z);
}

/* Part of the surface of an arm: beyond the joint, in a cone around `along` (any direction where it is zero). */
static int on_arm(const struct shape *shape, struct vec off, int side, struct vec along)
{
    double distance = vec_length(off), h = shape->height;
    return side * off.x > -0.1 * h && distance > 0.3 * h && distance < 1.2 * MOST_ARM * h && off.y < 0.3 * h &&
           vec_dot(off, along) >= 0.8 * distance * vec_length(along);
}

/* The mean direction of the arm's surface from the joint, and how far it goes. returns 0 for none */
static double arm_along(const struct shape *shape, struct vec joint, int side, struct vec *along)
{
    const struct groom_mesh *mesh = shape->mesh;
    double reach = 0;
    *along = (struct vec){0, 0, 0};
    for (int pass = 0; pass < 4; pass++) {
        struct vec sum = {0, 0, 0};
        reach = 0;
        for (uint32_t t = 0; t < mesh->n_triangles; t++) {
            struct vec corner[3], off;
            if (!shape->taken[t])
                continue;
            for (int i = 0; i < 3; i++)
                corner[i] = vec_of(mesh->points[mesh->triangles[t][i]]);
            off = vec_sub(vec_scale(vec_add(corner[0], vec_add(corner[1], corner[2])), 1.0 / 3), joint);
            if (!on_arm(shape, off, side, *along))
                continue;
            double area = vec_length(vec_cross(vec_sub(corner[1], corner[0]), vec_sub(corner[2], corner[0])));
            sum = vec_add(sum, vec_scale(vec_unit(off), area));
            reach = fmax(reach, vec_dot(off, *along));
        }
        if (pass < 3)
            *along = vec_unit(sum);
    }
    return reach;
}

static void add_shoulder(const struct shape *shape, struct groom_skeleton *skeleton, int side)
{
    struct vec base = vec_of(skeleton->bones[1].head), along, joint;
    double reach = reach_of(shape, base.x, side), out = fmin(SHOULDER_OUT * shape->width, 0.8 * reach), top;
    double down = SHOULDER_DOWN * shape->height;
    if (reach < LEAST_SHOULDER * shape->width || !column_at(shape, base.x + side * out, 2 * down, &top, &joint))
        return;
    joint.y = fmax(joint.y, top - down); /* a bust may end above */
    struct vec inner = {base.x + side * 0.12 * out, base.y - CLAVICLE_DOWN * shape->height, base.z};
    add_bone(skeleton, side > 0 ? "left_shoulder" : "right_shoulder", inner, joint);
    double arm = fmin(0.9 * arm_along(shape, joint, side, &along), MOST_ARM * shape->height);
    if (arm >= LEAST_ARM * shape->height)
        add_bone(skeleton, side > 0 ? "left_upper_arm" : "right_upper_arm", joint, vec_add(joint, vec_scale(along, arm)));
}

groom_status groom_skeleton_make(const struct groom_mesh *mesh, const struct groom_context *context,
                                 struct groom_skeleton *out, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = memory_allocator(context);
    struct groom_skeleton skeleton = {0};
    struct shape shape = {.mesh = mesh};
    if (mesh->n_triangles == 0)
        return groom_fail(diag, GROOM_EDEGENERATE, "the mesh has no triangle: no skeleton can be found in it");
    unsigned char *taken = memory_array(allocator, mesh->n_triangles, sizeof *taken);
    groom_status st = taken ? take_largest(mesh, taken, allocator, diag)
                            : groom_fail(diag, GROOM_ENOMEM, "no memory to find a skeleton");
    shape.taken = taken;
    if (st == GROOM_OK)
        st = cut_slices(&shape, diag);
    if (st == GROOM_OK) {
        find_neck(&shape);
        add_head(&shape, &skeleton);
        for (int side = 1; side >= -1 && shape.shoulders; side -= 2)
            add_shoulder(&shape, &skeleton, side);
        st = groom_skeleton_validate(&skeleton, diag);
    }
    memory_release(allocator, taken, mesh->n_triangles, sizeof *taken);
    if (st == GROOM_OK)
        *out = skeleton;
    return st;
}
