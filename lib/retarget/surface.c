#include "retarget/surface.h"

#include <string.h>

#include "base/memory.h"
#include "geometry/sides.h"

#define NONE SURFACE_NONE

/* --- connectivity -------------------------------------------------------------------------- */

static int runs_up(const struct surface *surface, const struct mesh_side *side)
{
    return surface->corners[side->triangle][(side->corner + 1) % 3] == side->low;
}

static void join_across(struct surface *surface, const struct mesh_sides *sides)
{
    memset(surface->across, 0xff, surface->n_triangles * sizeof *surface->across);
    for (size_t first = 0, end; first < sides->n; first = end) {
        const struct mesh_side *s = &sides->sides[first];
        end = mesh_edge_end(sides, first);
        if (end - first != 2 || runs_up(surface, &s[0]) == runs_up(surface, &s[1]))
            continue;
        surface->across[s[0].triangle][s[0].corner] = s[1].triangle;
        surface->across[s[1].triangle][s[1].corner] = s[0].triangle;
    }
}

static void collect_stars(struct surface *surface)
{
    memset(surface->star_first, 0, ((size_t)surface->n_vertices + 1) * sizeof *surface->star_first);
    for (uint32_t t = 0; t < surface->n_triangles; t++)
        for (int i = 0; i < 3; i++)
            surface->star_first[surface->corners[t][i] + 1]++;
    for (uint32_t v = 0; v < surface->n_vertices; v++)
        surface->star_first[v + 1] += surface->star_first[v];
    for (uint32_t t = surface->n_triangles; t-- > 0;) /* from the end, so that the firsts end where they belong */
        for (int i = 0; i < 3; i++)
            surface->star[--surface->star_first[surface->corners[t][i] + 1]] = t;
    /* each first was moved to the one before it */
    memmove(surface->star_first, surface->star_first + 1, surface->n_vertices * sizeof *surface->star_first);
    surface->star_first[surface->n_vertices] = 3 * surface->n_triangles;
}

groom_status surface_init(struct surface *surface, const struct groom_mesh *mesh, const struct groom_allocator *allocator,
                          struct groom_diag *diag)
{
    struct mesh_sides sides = {0};
    uint32_t n = mesh->n_triangles;
    *surface = (struct surface){.mesh = mesh, .n_vertices = mesh->n_vertices, .n_triangles = n, .allocator = allocator};
    surface->welded = memory_array(allocator, mesh->n_vertices, sizeof *surface->welded);
    surface->corners = memory_array(allocator, n, sizeof *surface->corners);
    surface->across = memory_array(allocator, n, sizeof *surface->across);
    surface->star_first = memory_array(allocator, (size_t)mesh->n_vertices + 1, sizeof *surface->star_first);
    surface->star = memory_array(allocator, (size_t)3 * n, sizeof *surface->star);
    groom_status st = surface->welded && surface->corners && surface->across && surface->star_first && surface->star
                          ? mesh_sides_init(&sides, mesh, allocator, diag)
                          : groom_fail(diag, GROOM_ENOMEM, "no memory for the surface of the mesh");
    if (st == GROOM_OK) {
        memcpy(surface->welded, sides.welded, mesh->n_vertices * sizeof *surface->welded);
        for (uint32_t t = 0; t < n; t++)
            for (int i = 0; i < 3; i++)
                surface->corners[t][i] = sides.welded[mesh->triangles[t][i]];
        join_across(surface, &sides);
        collect_stars(surface);
    }
    mesh_sides_finish(&sides);
    return st;
}

void surface_finish(struct surface *surface)
{
    if (!surface->allocator)
        return;
    memory_release(surface->allocator, surface->welded, surface->n_vertices, sizeof *surface->welded);
    memory_release(surface->allocator, surface->corners, surface->n_triangles, sizeof *surface->corners);
    memory_release(surface->allocator, surface->across, surface->n_triangles, sizeof *surface->across);
    memory_release(surface->allocator, surface->star_first, (size_t)surface->n_vertices + 1, sizeof *surface->star_first);
    memory_release(surface->allocator, surface->star, (size_t)3 * surface->n_triangles, sizeof *surface->star);
    *surface = (struct surface){0};
}

double surface_area(const struct surface *surface, uint32_t t)
{
    const uint32_t *v = surface->corners[t];
    struct vec a = surface_point(surface, v[0]);
    return 0.5 * vec_length(vec_cross(vec_sub(surface_point(surface, v[1]), a), vec_sub(surface_point(surface, v[2]), a)));
}

/* --- distances along edges ------------------------------------------------------------------------ */

/* A heap of vertices by distance, then index, so that ties have one order. */
struct heap {
    uint32_t *vertex, *place; /* [n]; place NONE: not in it */
    uint32_t n;
    const double *key;
};

static int before(const struct heap *heap, uint32_t a, uint32_t b)
{
    double p = heap->key[a], q = heap->key[b];
    return p < q || (p == q && a < b);
}

static void heap_set(struct heap *heap, uint32_t at, uint32_t v)
{
    heap->vertex[at] = v;
    heap->place[v] = at;
}

static void heap_rise(struct heap *heap, uint32_t v)
{
    uint32_t at = heap->place[v] == NONE ? heap->n++ : heap->place[v];
    for (; at > 0 && before(heap, v, heap->vertex[(at - 1) / 2]); at = (at - 1) / 2)
        heap_set(heap, at, heap->vertex[(at - 1) / 2]);
    heap_set(heap, at, v);
}

static uint32_t heap_pop(struct heap *heap)
{
    uint32_t top = heap->vertex[0], last = heap->vertex[--heap->n], at = 0;
    heap->place[top] = NONE;
    if (heap->n == 0)
        return top;
    for (uint32_t child; (child = 2 * at + 1) < heap->n; at = child) {
        child += child + 1 < heap->n && before(heap, heap->vertex[child + 1], heap->vertex[child]);
        if (!before(heap, heap->vertex[child], last))
            break;
        heap_set(heap, at, heap->vertex[child]);
    }
    heap_set(heap, at, last);
    return top;
}

int surface_distances(const struct surface *surface, double limit, double *distance)
{
    struct heap heap = {.key = distance};
    uint32_t n = surface->n_vertices;
    heap.vertex = memory_array(surface->allocator, n, sizeof *heap.vertex);
    heap.place = memory_array(surface->allocator, n, sizeof *heap.place);
    int sound = heap.vertex && heap.place;
    if (sound)
        memset(heap.place, 0xff, n * sizeof *heap.place);
    for (uint32_t v = 0; sound && v < n; v++)
        if (distance[v] <= limit)
            heap_rise(&heap, v);
    while (sound && heap.n) {
        uint32_t v = heap_pop(&heap);
        for (uint32_t s = surface->star_first[v]; s < surface->star_first[v + 1]; s++)
            for (int i = 0; i < 3; i++) {
                uint32_t w = surface->corners[surface->star[s]][i];
                double reached = distance[v] + vec_length(vec_sub(surface_point(surface, w), surface_point(surface, v)));
                if (reached >= distance[w] || reached > limit)
                    continue;
                distance[w] = reached;
                heap_rise(&heap, w);
            }
    }
    memory_release(surface->allocator, heap.vertex, n, sizeof *heap.vertex);
    memory_release(surface->allocator, heap.place, n, sizeof *heap.place);
    return sound;
}

/* --- sets of triangles -------------------------------------------------------------------------------- */

/* Number the connected parts of those triangles whose byte is `value`: label [n_triangles], NONE elsewhere;
 * size [n_triangles] of each part. returns how many */
static uint32_t label_parts(const struct surface *surface, const unsigned char *set, unsigned char value,
                            const uint32_t *weight, uint32_t *label, double *size, uint32_t *queue)
{
    uint32_t n_parts = 0;
    memset(label, 0xff, surface->n_triangles * sizeof *label);
    for (uint32_t seed = 0; seed < surface->n_triangles; seed++) {
        uint32_t n = 0;
        if (set[seed] != value || label[seed] != NONE)
            continue;
        size[n_parts] = 0;
        label[seed] = n_parts;
        queue[n++] = seed;
        for (uint32_t at = 0; at < n; at++) {
            uint32_t t = queue[at];
            size[n_parts] += weight ? weight[t] : surface_area(surface, t);
            for (int i = 0; i < 3; i++) {
                uint32_t other = surface->across[t][i];
                if (other == NONE || set[other] != value || label[other] != NONE)
                    continue;
                label[other] = n_parts;
                queue[n++] = other;
            }
        }
        n_parts++;
    }
    return n_parts;
}

struct labels {
    uint32_t *label, *queue;
    double *size;
};

static int labels_init(struct labels *labels, const struct surface *surface)
{
    labels->label = memory_array(surface->allocator, surface->n_triangles, sizeof *labels->label);
    labels->queue = memory_array(surface->allocator, surface->n_triangles, sizeof *labels->queue);
    labels->size = memory_array(surface->allocator, surface->n_triangles, sizeof *labels->size);
    return labels->label && labels->queue && labels->size;
}

static void labels_finish(struct labels *labels, const struct surface *surface)
{
    memory_release(surface->allocator, labels->label, surface->n_triangles, sizeof *labels->label);
    memory_release(surface->allocator, labels->queue, surface->n_triangles, sizeof *labels->queue);
    memory_release(surface->allocator, labels->size, surface->n_triangles, sizeof *labels->size);
}

static uint32_t largest(const double *size, uint32_t n)
{
    uint32_t best = 0;
    for (uint32_t i = 1; i < n; i++)
        if (size[i] > size[best])
            best = i;
    return best;
}

int surface_keep_largest(const struct surface *surface, unsigned char *set, const uint32_t *weight)
{
    struct labels labels;
    int sound = labels_init(&labels, surface);
    if (sound) {
        uint32_t n = label_parts(surface, set, 1, weight, labels.label, labels.size, labels.queue);
        uint32_t best = largest(labels.size, n);
        for (uint32_t t = 0; t < surface->n_triangles; t++)
            set[t] = set[t] && labels.label[t] == best;
    }
    labels_finish(&labels, surface);
    return sound;
}

static uint32_t fill_holes(const struct surface *surface, unsigned char *set, struct labels *labels)
{
    uint32_t n_filled = 0, n = label_parts(surface, set, 0, NULL, labels->label, labels->size, labels->queue);
    /* the queue is free again: which parts touch the set */
    memset(labels->queue, 0, n * sizeof *labels->queue);
    for (uint32_t t = 0; t < surface->n_triangles; t++)
        for (int i = 0; i < 3 && !set[t]; i++)
            labels->queue[labels->label[t]] |= surface->across[t][i] != NONE && set[surface->across[t][i]];
    for (uint32_t p = 0; p < n; p++)
        if (!labels->queue[p])
            labels->size[p] = -1;
    uint32_t outside = largest(labels->size, n);
    for (uint32_t t = 0; t < surface->n_triangles; t++)
        if (!set[t] && labels->label[t] != outside && labels->queue[labels->label[t]]) {
            set[t] = 1;
            n_filled++;
        }
    return n_filled;
}

/* How many separate fans of the set lie around a vertex: sides out of the vertex that the set begins at. */
static int fans_at(const struct surface *surface, const unsigned char *set, uint32_t v)
{
    int fans = 0;
    for (uint32_t s = surface->star_first[v]; s < surface->star_first[v + 1]; s++) {
        uint32_t t = surface->star[s];
        if (!set[t])
            continue;
        for (int i = 0; i < 3; i++)
            if (surface->corners[t][i] == v) { /* the side from v to the next corner is opposite to the one after */
                uint32_t other = surface->across[t][(i + 2) % 3];
                fans += other == NONE || !set[other];
            }
    }
    return fans;
}

static uint32_t mend_pinches(const struct surface *surface, unsigned char *set)
{
    uint32_t n_added = 0;
    for (uint32_t v = 0; v < surface->n_vertices; v++) {
        if (fans_at(surface, set, v) < 2)
            continue;
        for (uint32_t s = surface->star_first[v]; s < surface->star_first[v + 1]; s++) {
            n_added += !set[surface->star[s]];
            set[surface->star[s]] = 1;
        }
    }
    return n_added;
}

static uint32_t fill_notches(const struct surface *surface, unsigned char *set)
{
    uint32_t n_added = 0;
    for (uint32_t t = 0; t < surface->n_triangles; t++) {
        int around = 0;
        for (int i = 0; i < 3 && !set[t]; i++)
            around += surface->across[t][i] != NONE && set[surface->across[t][i]];
        if (around >= 2) {
            set[t] = 1;
            n_added++;
        }
    }
    return n_added;
}

int surface_fill(const struct surface *surface, unsigned char *set)
{
    struct labels labels;
    int sound = labels_init(&labels, surface);
    for (int round = 0; sound && round < 100; round++)
        if (fill_holes(surface, set, &labels) + fill_notches(surface, set) + mend_pinches(surface, set) == 0)
            break;
    labels_finish(&labels, surface);
    return sound;
}

/* --- sheets ------------------------------------------------------------------------------------------------ */

static void number(struct sheet *sheet, const struct surface *surface, const unsigned char *set)
{
    memset(sheet->local_vertex, 0xff, surface->n_vertices * sizeof *sheet->local_vertex);
    memset(sheet->local_triangle, 0xff, surface->n_triangles * sizeof *sheet->local_triangle);
    for (uint32_t t = 0; t < surface->n_triangles; t++) {
        if (!set[t])
            continue;
        sheet->local_triangle[t] = sheet->n_triangles;
        sheet->triangle_of[sheet->n_triangles] = t;
        for (int i = 0; i < 3; i++) {
            uint32_t v = surface->corners[t][i];
            if (sheet->local_vertex[v] == NONE) {
                sheet->local_vertex[v] = sheet->n_vertices;
                sheet->vertex_of[sheet->n_vertices++] = v;
            }
            sheet->triangles[sheet->n_triangles][i] = sheet->local_vertex[v];
        }
        sheet->n_triangles++;
    }
    for (uint32_t t = 0; t < sheet->n_triangles; t++)
        for (int i = 0; i < 3; i++) {
            uint32_t other = surface->across[sheet->triangle_of[t]][i];
            sheet->across[t][i] = other == NONE ? NONE : sheet->local_triangle[other];
        }
}

/* next [n_vertices] along the boundary; the longest loop by length goes to sheet->loop. */
static void find_loops(struct sheet *sheet, const struct surface *surface, uint32_t *next)
{
    uint32_t best = NONE;
    double longest = -1;
    memset(next, 0xff, sheet->n_vertices * sizeof *next);
    for (uint32_t t = 0; t < sheet->n_triangles; t++)
        for (int i = 0; i < 3; i++)
            if (sheet->across[t][i] == NONE)
                next[sheet->triangles[t][(i + 1) % 3]] = sheet->triangles[t][(i + 2) % 3];
    for (uint32_t v = 0; v < sheet->n_vertices; v++) {
        double length = 0;
        uint32_t w = v, steps = 0;
        if (next[v] == NONE)
            continue;
        do {
            length += vec_length(vec_sub(surface_point(surface, sheet->vertex_of[next[w]]), surface_point(surface, sheet->vertex_of[w])));
            w = next[w];
        } while (w != v && w > v && next[w] != NONE && ++steps < sheet->n_vertices);
        if (w != v) /* not the lowest of its loop */
            continue;
        sheet->n_loops++;
        if (length > longest) {
            longest = length;
            best = v;
        }
    }
    for (uint32_t w = best; best != NONE && (w != best || sheet->n_loop == 0); w = next[w])
        sheet->loop[sheet->n_loop++] = w;
}

static void add_to_row(struct sheet *sheet, uint32_t row, uint32_t column, uint32_t *length)
{
    uint32_t *entries = sheet->row + sheet->row_first[row], at = length[row];
    for (uint32_t i = 0; i < at; i++)
        if (entries[i] == column)
            return;
    for (; at > 0 && entries[at - 1] > column; at--)
        entries[at] = entries[at - 1];
    entries[at] = column;
    length[row]++;
}

/* Rows with room for every side twice, then packed. length [n_vertices] zero */
static void find_rows(struct sheet *sheet, uint32_t *length)
{
    memset(sheet->row_first, 0, ((size_t)sheet->n_vertices + 1) * sizeof *sheet->row_first);
    for (uint32_t t = 0; t < sheet->n_triangles; t++)
        for (int i = 0; i < 3; i++)
            sheet->row_first[sheet->triangles[t][i] + 1] += 2;
    for (uint32_t v = 0; v < sheet->n_vertices; v++)
        sheet->row_first[v + 1] += sheet->row_first[v] + 1;
    for (uint32_t v = 0; v < sheet->n_vertices; v++)
        add_to_row(sheet, v, v, length);
    for (uint32_t t = 0; t < sheet->n_triangles; t++)
        for (int i = 0; i < 3; i++)
            for (int j = 1; j < 3; j++)
                add_to_row(sheet, sheet->triangles[t][i], sheet->triangles[t][(i + j) % 3], length);
    uint32_t at = 0;
    for (uint32_t v = 0; v < sheet->n_vertices; v++) {
        uint32_t first = sheet->row_first[v];
        memmove(sheet->row + at, sheet->row + first, length[v] * sizeof *sheet->row);
        sheet->row_first[v] = at;
        at += length[v];
    }
    sheet->row_first[sheet->n_vertices] = at;
}

uint32_t sheet_entry(const struct sheet *sheet, uint32_t row, uint32_t column)
{
    uint32_t low = sheet->row_first[row], high = sheet->row_first[row + 1];
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (sheet->row[middle] <= column)
            low = middle;
        else
            high = middle;
    }
    return low;
}

groom_status sheet_init(struct sheet *sheet, const struct surface *surface, const unsigned char *set, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = surface->allocator;
    uint32_t n_vertices = surface->n_vertices, n_triangles = surface->n_triangles;
    *sheet = (struct sheet){.allocator = allocator, .n_surface_vertices = n_vertices, .n_surface_triangles = n_triangles};
    sheet->local_vertex = memory_array(allocator, n_vertices, sizeof *sheet->local_vertex);
    sheet->local_triangle = memory_array(allocator, n_triangles, sizeof *sheet->local_triangle);
    sheet->vertex_of = memory_array(allocator, n_vertices, sizeof *sheet->vertex_of);
    sheet->triangle_of = memory_array(allocator, n_triangles, sizeof *sheet->triangle_of);
    sheet->triangles = memory_array(allocator, n_triangles, sizeof *sheet->triangles);
    sheet->across = memory_array(allocator, n_triangles, sizeof *sheet->across);
    sheet->loop = memory_array(allocator, n_vertices, sizeof *sheet->loop);
    sheet->row_first = memory_array(allocator, (size_t)n_vertices + 1, sizeof *sheet->row_first);
    sheet->row = memory_array(allocator, (size_t)6 * n_triangles + n_vertices, sizeof *sheet->row);
    uint32_t *scratch = memory_array_zero(allocator, n_vertices, sizeof *scratch);
    groom_status st = GROOM_OK;
    if (sheet->local_vertex && sheet->local_triangle && sheet->vertex_of && sheet->triangle_of && sheet->triangles &&
        sheet->across && sheet->loop && sheet->row_first && sheet->row && scratch) {
        number(sheet, surface, set);
        find_rows(sheet, scratch);
        find_loops(sheet, surface, scratch);
    } else {
        st = groom_fail(diag, GROOM_ENOMEM, "no memory for a piece of the surface");
    }
    memory_release(allocator, scratch, n_vertices, sizeof *scratch);
    return st;
}

void sheet_finish(struct sheet *sheet)
{
    const struct groom_allocator *allocator = sheet->allocator;
    if (!allocator)
        return;
    uint32_t n_vertices = sheet->n_surface_vertices, n_triangles = sheet->n_surface_triangles;
    memory_release(allocator, sheet->local_vertex, n_vertices, sizeof *sheet->local_vertex);
    memory_release(allocator, sheet->local_triangle, n_triangles, sizeof *sheet->local_triangle);
    memory_release(allocator, sheet->vertex_of, n_vertices, sizeof *sheet->vertex_of);
    memory_release(allocator, sheet->triangle_of, n_triangles, sizeof *sheet->triangle_of);
    memory_release(allocator, sheet->triangles, n_triangles, sizeof *sheet->triangles);
    memory_release(allocator, sheet->across, n_triangles, sizeof *sheet->across);
    memory_release(allocator, sheet->loop, n_vertices, sizeof *sheet->loop);
    memory_release(allocator, sheet->row_first, (size_t)n_vertices + 1, sizeof *sheet->row_first);
    memory_release(allocator, sheet->row, (size_t)6 * n_triangles + n_vertices, sizeof *sheet->row);
    *sheet = (struct sheet){0};
}
