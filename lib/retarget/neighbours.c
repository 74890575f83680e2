/* The k nearest particles on other strands and their weights by inverse distance: Eqs. 8, 9 and 14. Always of
 * the source. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "retarget/kdtree.h"
#include "retarget/batches.h"
#include "retarget/source.h"

#define PIECE 2048           /* rows */
#define BATCH 64             /* pieces between two looks at progress */
#define NEAREST 1e-7         /* metres: nearer neighbours weigh no more */

struct linking {
    const struct groom_retarget_source *source;
    const struct kdtree *tree;
    const float (*points)[3];  /* of the rows */
    const uint32_t *owner;     /* strand of each row */
    const uint8_t *left_out;   /* by strand; or NULL */
    struct graph *graph;
};

static void weigh(const struct kdtree_found *found, uint32_t n, uint32_t k, uint32_t *neighbour, float *weight)
{
    double sum = 0, inverse[16] = {0};
    for (uint32_t j = 0; j < n; j++)
        sum += inverse[j] = 1 / fmax(sqrt((double)found[j].squared), NEAREST);
    for (uint32_t j = 0; j < k; j++) {
        neighbour[j] = j < n ? found[j].id : 0;
        weight[j] = j < n ? (float)(inverse[j] / sum) : 0;
    }
}

/* The neighbours of the particle before are near as well: the farthest of them bounds the search. */
static float bound_by(const struct linking *linking, const struct kdtree_found *found, uint32_t n, uint32_t k, uint32_t owner,
                      uint32_t last_owner, const float point[3])
{
    float most = 0;
    if (n < k || owner != last_owner)
        return INFINITY;
    for (uint32_t j = 0; j < k; j++)
        most = fmaxf(most, kdtree_squared(linking->tree, found[j].id, point));
    return most;
}

static void link_piece(void *user, uint32_t piece, uint32_t thread)
{
    struct linking *linking = user;
    struct graph *graph = linking->graph;
    uint32_t first = piece * PIECE, k = graph->k, n = 0, last_owner = UINT32_MAX;
    struct kdtree_found found[16];
    (void)thread;
    for (uint32_t i = first; i < graph->n_rows && i - first < PIECE; i++) {
        uint32_t owner = linking->owner[i];
        if (linking->left_out && linking->left_out[owner]) {
            weigh(found, 0, k, graph->neighbour + (size_t)i * k, graph->weight + (size_t)i * k);
            continue;
        }
        float within = bound_by(linking, found, n, k, owner, last_owner, linking->points[i]);
        n = kdtree_find(linking->tree, linking->points[i], owner, k, within, found);
        weigh(found, n, k, graph->neighbour + (size_t)i * k, graph->weight + (size_t)i * k);
        last_owner = owner;
    }
}

static groom_status link_all(struct linking *linking, const struct groom_context *context, struct groom_diag *diag)
{
    struct batches batches = {.n_pieces = linking->graph->n_rows / PIECE + 1, .batch = BATCH, .from = 0.6, .to = 1,
                              .doing = "neighbours were looked for"};
    return batches_run(context, &batches, link_piece, linking, diag);
}

/* --- graphs --------------------------------------------------------------------- */

groom_status graph_init(struct graph *graph, uint32_t n_rows, uint32_t k, const struct groom_allocator *allocator)
{
    *graph = (struct graph){.n_rows = n_rows, .k = k};
    graph->neighbour = memory_array(allocator, (size_t)n_rows * k, sizeof *graph->neighbour);
    graph->weight = memory_array(allocator, (size_t)n_rows * k, sizeof *graph->weight);
    return graph->neighbour && graph->weight ? GROOM_OK : GROOM_ENOMEM;
}

void graph_finish(struct graph *graph, const struct groom_allocator *allocator)
{
    memory_release(allocator, graph->neighbour, (size_t)graph->n_rows * graph->k, sizeof *graph->neighbour);
    memory_release(allocator, graph->weight, (size_t)graph->n_rows * graph->k, sizeof *graph->weight);
    memset(graph, 0, sizeof *graph);
}

/* Particles of the guides, one after the other. */
struct guide_points {
    uint32_t n;
    float (*points)[3];
    uint32_t *owner;
};

static groom_status gather_guides(const struct groom_retarget_source *source, struct guide_points *guides)
{
    const struct groom_strands *strands = source->strands;
    guides->n = source->guide_first[source->n_guides];
    guides->points = memory_array(source->allocator, guides->n, sizeof *guides->points);
    guides->owner = memory_array(source->allocator, guides->n, sizeof *guides->owner);
    if (!guides->points || !guides->owner)
        return GROOM_ENOMEM;
    for (uint32_t g = 0; g < source->n_guides; g++) {
        uint32_t at = source->guide_first[g], n = source->guide_first[g + 1] - at, strand = source->guides[g];
        memcpy(guides->points + at, strands->points + strands->first[strand], n * sizeof *guides->points);
        for (uint32_t j = 0; j < n; j++)
            guides->owner[at + j] = strand;
    }
    return GROOM_OK;
}

static groom_status owners(const struct groom_retarget_source *source, uint32_t **owner)
{
    const struct groom_strands *strands = source->strands;
    if (!(*owner = memory_array(source->allocator, strands->n_vertices, sizeof **owner)))
        return GROOM_ENOMEM;
    for (uint32_t s = 0; s < strands->n_strands; s++)
        for (uint32_t i = strands->first[s]; i < strands->first[s + 1]; i++)
            (*owner)[i] = s;
    return GROOM_OK;
}

static groom_status link_guides(struct groom_retarget_source *source, const uint32_t *owner,
                                const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_strands *strands = source->strands;
    struct guide_points guides = {0};
    struct kdtree *tree = NULL;
    struct linking linking = {.source = source};
    groom_status st = gather_guides(source, &guides);
    if (st == GROOM_OK)
        st = graph_init(&source->among_guides, guides.n, source->options.neighbours, source->allocator);
    if (st == GROOM_OK && source_has_fine(source))
        st = graph_init(&source->to_guides, strands->n_vertices, source->options.neighbours, source->allocator);
    if (st != GROOM_OK) {
        groom_fail(diag, st, "no memory for the neighbours of %u particles", strands->n_vertices);
        goto out;
    }
    if ((st = kdtree_create((const float(*)[3])guides.points, guides.owner, guides.n, context, &tree, diag)) != GROOM_OK)
        goto out;
    linking.tree = tree;
    linking.points = (const float(*)[3])guides.points;
    linking.owner = guides.owner;
    linking.graph = &source->among_guides;
    if ((st = link_all(&linking, context, diag)) != GROOM_OK || !source_has_fine(source))
        goto out;
    linking.points = (const float(*)[3])strands->points;
    linking.owner = owner;
    linking.left_out = source->is_guide;
    linking.graph = &source->to_guides;
    st = link_all(&linking, context, diag);
out:
    kdtree_destroy(tree);
    memory_release(source->allocator, guides.points, guides.n, sizeof *guides.points);
    memory_release(source->allocator, guides.owner, guides.n, sizeof *guides.owner);
    return st;
}

static groom_status link_everything(struct groom_retarget_source *source, const uint32_t *owner,
                                    const struct groom_context *context, struct groom_diag *diag)
{
    const struct groom_strands *strands = source->strands;
    struct kdtree *tree = NULL;
    struct linking linking = {.source = source, .points = (const float(*)[3])strands->points, .owner = owner,
                              .graph = &source->among_all};
    groom_status st = graph_init(&source->among_all, strands->n_vertices, source->options.neighbours, source->allocator);
    if (st != GROOM_OK)
        return groom_fail(diag, st, "no memory for the neighbours of %u particles", strands->n_vertices);
    if ((st = kdtree_create(linking.points, owner, strands->n_vertices, context, &tree, diag)) != GROOM_OK)
        return st;
    linking.tree = tree;
    st = link_all(&linking, context, diag);
    kdtree_destroy(tree);
    return st;
}

groom_status neighbours_find(struct groom_retarget_source *source, const struct groom_context *context,
                             struct groom_diag *diag)
{
    uint32_t *owner = NULL;
    groom_status st = owners(source, &owner);
    if (st != GROOM_OK)
        return groom_fail(diag, st, "no memory for the neighbours of %u particles", source->strands->n_vertices);
    int global = source->options.mode == GROOM_RETARGET_GLOBAL;
    if (!global)
        st = link_guides(source, owner, context, diag);
    if (st == GROOM_OK && (global || (source->options.sweeps > 0 && source_has_fine(source))))
        st = link_everything(source, owner, context, diag);
    memory_release(source->allocator, owner, source->strands->n_vertices, sizeof *owner);
    return st;
}
