/* Strands into lanes and out of them; the kernel for this processor, chosen once. */
#include "base/memory.h"
#include "curvature/sculpt_group.h"

/* --- memory ------------------------------------------------------------------------- */

/* X(member, count), n elements and m anchors at most */
#define GROUP_ARRAYS(X)                                                                            \
    X(length, n) X(q, n) X(rest, n) X(step, n) X(trial, n) X(own_step, n) X(A, n) X(U, n)          \
    X(gain_v, n) X(gain_w, n) X(anchor, m) X(event, LANES * m)

void sculpt_group_destroy(struct sculpt_group *g)
{
    if (!g)
        return;
    const struct groom_allocator *a = g->allocator;
    size_t n = g->max_elements, m = g->max_anchors;
#define GROUP_RELEASE(member, count) memory_release(a, g->member, count, sizeof *g->member);
    GROUP_ARRAYS(GROUP_RELEASE)
#undef GROUP_RELEASE
    memory_release(a, g, 1, sizeof *g);
}

struct sculpt_group *sculpt_group_create(uint32_t max_elements, uint32_t max_anchors,
                                         const struct groom_allocator *allocator)
{
    struct sculpt_group *g = memory_array_zero(allocator, 1, sizeof *g);
    size_t n = max_elements, m = max_anchors;
    int good = 1;
    if (!g)
        return NULL;
    g->allocator = allocator;
    g->max_elements = max_elements;
    g->max_anchors = max_anchors;
#define GROUP_ALLOCATE(member, count) good &= (g->member = memory_array_zero(allocator, count, sizeof *g->member)) != NULL;
    GROUP_ARRAYS(GROUP_ALLOCATE)
#undef GROUP_ALLOCATE
    if (good)
        return g;
    sculpt_group_destroy(g);
    return NULL;
}

/* --- in and out ------------------------------------------------------------------------ */

static void put(vec3 *v, uint32_t lane, double x, double y, double z)
{
    v->x[lane] = x, v->y[lane] = y, v->z[lane] = z;
}

/* An idle lane is a strand of no length at rest, whose anchors are where they should be. */
static const double identity[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const struct lane_input idle = {.frame = identity, .c = 1.0};

static void load_lane(struct sculpt_group *g, uint32_t lane, const struct lane_input *in)
{
    const double(*f)[3] = in->frame;
    uint32_t n = in->n, m = in->m;
    put(&g->root.t, lane, f[0][0], f[0][1], f[0][2]);
    put(&g->root.u, lane, f[1][0], f[1][1], f[1][2]);
    put(&g->root.v, lane, f[2][0], f[2][1], f[2][2]);
    g->c[lane] = in->c;
    g->n_coordinates[lane] = m ? 3.0 * m : 3.0;
    g->least_energy[lane] = in->least_energy;
    for (uint32_t j = 0; j < g->n; j++) {
        g->length[j][lane] = j < n ? in->length[j] : 0.0;
        put(&g->q[j], lane, j < n ? in->q[j][0] : 0.0, j < n ? in->q[j][1] : 0.0, j < n ? in->q[j][2] : 0.0);
        put(&g->rest[j], lane, j < n ? in->rest[j][0] : 0.0, j < n ? in->rest[j][1] : 0.0,
            j < n ? in->rest[j][2] : 0.0);
    }
    for (uint32_t k = 0; k < g->m; k++) { /* missing ones come first: anchors rise along the strand */
        static const struct located_anchor none = {0, 0.0, {0.0, 0.0, 0.0}};
        const struct located_anchor *a = k + m >= g->m ? &in->anchor[k + m - g->m] : &none;
        g->anchor[k].s[lane] = a->s;
        g->anchor[k].element[lane] = a->element;
        put(&g->anchor[k].target, lane, a->target[0], a->target[1], a->target[2]);
    }
}

/* How the solver finds a lane that has just been loaded; nothing of the strand before shows through. */
static void reset_lane(struct sculpt_group *g, uint32_t lane, int used)
{
    g->active[lane] = g->fresh[lane] = used ? -1 : 0;
    g->energy[lane] = g->energy_before[lane] = g->iterations[lane] = 0.0;
    g->mu[lane] = -1.0;
    g->grow[lane] = 3.0;
    g->curved[lane] = 0;
}

/* Anchors of all lanes by element; insertion, for they come nearly sorted. */
static void sort_events(struct sculpt_group *g)
{
    g->n_events = 0;
    for (uint32_t k = 0; k < g->m; k++)
        for (uint32_t lane = 0; lane < LANES; lane++) {
            struct sculpt_event e = {(uint32_t)g->anchor[k].element[lane], k, lane};
            uint32_t to = g->n_events++;
            for (; to > 0 && g->event[to - 1].element > e.element; to--)
                g->event[to] = g->event[to - 1];
            g->event[to] = e;
        }
}

/* What the anchors miss by: the last pass was at the result. */
static void put_misses(const struct sculpt_group *g, uint32_t lane, uint32_t m, struct lane_output *out)
{
    out->miss_max = out->miss_mean = 0.0;
    for (uint32_t k = g->m - m; k < g->m; k++) {
        const vec3 *r = &g->anchor[k].r;
        double miss = sqrt(r->x[lane] * r->x[lane] + r->y[lane] * r->y[lane] + r->z[lane] * r->z[lane]);
        out->miss_max = miss > out->miss_max ? miss : out->miss_max;
        out->miss_mean += miss / m;
    }
}

static void put_out(struct sculpt_group *g, uint32_t lane)
{
    uint32_t i = g->strand[lane];
    double(*q)[3] = g->result[i];
    for (uint32_t j = 0; j < g->in[i].n; j++)
        q[j][0] = g->q[j].x[lane], q[j][1] = g->q[j].y[lane], q[j][2] = g->q[j].z[lane];
    g->out[i] = (struct lane_output){.energy_before = g->energy_before[lane], .energy = g->energy[lane],
                                     .iterations = (uint32_t)g->iterations[lane], .active = !g->converged[lane]};
    put_misses(g, lane, g->in[i].m, &g->out[i]);
}

void sculpt_group_exchange(struct sculpt_group *g)
{
    int changed = 0;
    g->fresh = (lane_mask){0};
    for (uint32_t lane = 0; lane < LANES; lane++) {
        if (g->active[lane] || (g->strand[lane] == UINT32_MAX && g->next >= g->n_in))
            continue;
        if (g->strand[lane] != UINT32_MAX)
            put_out(g, lane);
        int used = g->next < g->n_in;
        g->strand[lane] = used ? g->next++ : UINT32_MAX;
        load_lane(g, lane, used ? &g->in[g->strand[lane]] : &idle);
        reset_lane(g, lane, used);
        changed = 1;
    }
    if (changed)
        sort_events(g);
}

/* --- the solver -------------------------------------------------------------------------- */

typedef void sculpt_kernel(struct sculpt_group *, const struct sculpt_settings *);

static sculpt_kernel *choose_kernel(void)
{
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2"))
        return sculpt_group_avx2;
#endif
    return sculpt_group_generic;
}

void sculpt_group_solve(struct sculpt_group *g, const struct lane_input *in, uint32_t n_in,
                        const struct sculpt_settings *settings, double (*const q[])[3], struct lane_output *out)
{
    g->n = g->m = 1;
    for (uint32_t i = 0; i < n_in; i++) {
        g->n = in[i].n > g->n ? in[i].n : g->n;
        g->m = in[i].m > g->m ? in[i].m : g->m;
    }
    g->in = in, g->out = out, g->result = q;
    g->n_in = n_in;
    g->next = 0;
    for (uint32_t lane = 0; lane < LANES; lane++) {
        g->strand[lane] = UINT32_MAX;
        load_lane(g, lane, &idle);
        reset_lane(g, lane, 0);
    }
    sort_events(g);
    choose_kernel()(g, settings);
}
