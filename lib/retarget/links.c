#include "retarget/links.h"

#include <string.h>

#include "base/memory.h"

static size_t n_links(const struct coupled *hair) { return (size_t)hair->n * hair->graph->k; }

static void count_back(struct links *links)
{
    const struct graph *graph = links->hair->graph;
    memset(links->back_first, 0, ((size_t)links->hair->n + 1) * sizeof *links->back_first);
    for (size_t l = 0; l < n_links(links->hair); l++)
        links->back_first[graph->neighbour[l] + 1] += graph->weight[l] > 0;
    for (uint32_t i = 0; i < links->hair->n; i++)
        links->back_first[i + 1] += links->back_first[i];
}

/* Fills rows from their ends down, so that first[i] is right once all are in. */
static void fill_back(struct links *links)
{
    const struct graph *graph = links->hair->graph;
    for (uint32_t i = 0; i < links->hair->n; i++)
        links->back_first[i] = links->back_first[i + 1];
    for (uint32_t row = links->hair->n; row-- > 0;)
        for (uint32_t j = graph->k; j-- > 0;) {
            size_t l = (size_t)row * graph->k + j;
            if (graph->weight[l] > 0) {
                uint32_t at = --links->back_first[graph->neighbour[l]];
                links->back_row[at] = row;
                links->back_weight[at] = graph->weight[l];
            }
        }
}

static void set_diagonal(struct links *links)
{
    for (uint32_t i = 0; i < links->hair->n; i++) {
        double own = links_any(links, i) ? links_gamma(links, i) : 0;
        for (uint32_t l = links->back_first[i]; l < links->back_first[i + 1]; l++)
            own += links_gamma(links, links->back_row[l]) * (double)links->back_weight[l] * links->back_weight[l];
        links->diagonal[i] = (float)(links->alpha * own + links->beta * links_gamma(links, i));
    }
}

groom_status links_init(struct links *links, const struct job *job, const struct coupled *hair, struct groom_diag *diag)
{
    const struct groom_allocator *allocator = job->allocator;
    *links = (struct links){.hair = hair, .alpha = (float)job->options->alpha, .beta = (float)job->options->beta};
    links->back_first = memory_array(allocator, (size_t)hair->n + 1, sizeof *links->back_first);
    links->back_row = memory_array(allocator, n_links(hair), sizeof *links->back_row);
    links->back_weight = memory_array(allocator, n_links(hair), sizeof *links->back_weight);
    links->diagonal = memory_array(allocator, hair->n, sizeof *links->diagonal);
    if (!links->back_first || !links->back_row || !links->back_weight || !links->diagonal)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for what %u particles are to each other", hair->n);
    count_back(links);
    fill_back(links);
    set_diagonal(links);
    return GROOM_OK;
}

void links_finish(struct links *links, const struct groom_allocator *allocator)
{
    memory_release(allocator, links->back_first, (size_t)links->hair->n + 1, sizeof *links->back_first);
    memory_release(allocator, links->back_row, n_links(links->hair), sizeof *links->back_row);
    memory_release(allocator, links->back_weight, n_links(links->hair), sizeof *links->back_weight);
    memory_release(allocator, links->diagonal, links->hair->n, sizeof *links->diagonal);
}
