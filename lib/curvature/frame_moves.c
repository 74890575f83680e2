/* Frames that were moved, as anchors of the strands in their clusters (Shi et al. 2026, Section 5.3). */
#include <math.h>
#include <stdio.h>

#include "base/memory.h"
#include "curvature/chain.h"
#include "curvature/pieces.h"

void groom_anchors_destroy(struct groom_anchors *anchors)
{
    if (!anchors)
        return;
    const struct groom_allocator *a = anchors->allocator;
    memory_release(a, anchors->anchor, anchors->n, sizeof *anchors->anchor);
    memory_release(a, anchors, 1, sizeof *anchors);
}

static vec3 affine(const double (*map)[4], vec3 p)
{
    return (vec3){map[0][0] * p.x + map[0][1] * p.y + map[0][2] * p.z + map[0][3],
                  map[1][0] * p.x + map[1][1] * p.y + map[1][2] * p.z + map[1][3],
                  map[2][0] * p.x + map[2][1] * p.y + map[2][2] * p.z + map[2][3]};
}

/* x' = to.origin + to.axes^T from.axes (x - from.origin) */
void groom_frame_map(const struct groom_cluster_frame *from, const struct groom_cluster_frame *to, double map[3][4])
{
    for (int r = 0; r < 3; r++) {
        map[r][3] = to->origin[r];
        for (int c = 0; c < 3; c++) {
            map[r][c] = 0.0;
            for (int k = 0; k < 3; k++)
                map[r][c] += to->axes[k][r] * from->axes[k][c];
            map[r][3] -= map[r][c] * from->origin[c];
        }
    }
}

/* --- what is asked -------------------------------------------------------------------------- */

static groom_status refuse(struct groom_diag *diag, size_t i, const char *field, const char *sentence)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/frames/%zu/%s", i, field);
    return groom_fail_field(diag, GROOM_EINVAL, pointer, "frame %zu %s", i, sentence);
}

static groom_status check_move(const struct groom_clusters *c, const struct groom_frame_move *move, size_t i,
                               struct groom_diag *diag)
{
    char sentence[128];
    if (move->cluster >= c->n_clusters) {
        snprintf(sentence, sizeof sentence, "names cluster %u; there are %u", move->cluster, c->n_clusters);
        return refuse(diag, i, "cluster", sentence);
    }
    if (c->first[move->cluster] == c->first[move->cluster + 1]) {
        snprintf(sentence, sizeof sentence, "moves cluster %u, which has no strands", move->cluster);
        return refuse(diag, i, "cluster", sentence);
    }
    if (!(move->at >= 0.0 && move->at <= 1.0)) {
        snprintf(sentence, sizeof sentence, "is at %g of its strands: 0..1 is a strand", move->at);
        return refuse(diag, i, "at", sentence);
    }
    for (int k = 0; k < 12; k++)
        if (!isfinite(move->map[k / 4][k % 4])) {
            snprintf(sentence, sizeof sentence, "has a transform with a number that is not finite (row %d, column %d)", k / 4,
                     k % 4);
            return refuse(diag, i, "transform", sentence);
        }
    return GROOM_OK;
}

/* --- anchors ------------------------------------------------------------------------------------ */

struct moving {
    const struct groom_clusters *clusters;
    const struct groom_superhelices *helices;
    const struct groom_frame_move *move;
    struct groom_anchor *out; /* of this move; strand UINT32_MAX for a strand that cannot follow */
};

static struct groom_anchor anchor_of(const struct moving *m, uint32_t strand)
{
    double length = groom_superhelix_length(m->helices, strand), s = m->move->at * length, p[3];
    struct groom_anchor anchor = {.strand = length > 0.0 ? strand : UINT32_MAX, .at = m->move->at};
    groom_superhelix_sample(m->helices, strand, &s, 1, &p, NULL);
    vec_store(affine(m->move->map, vec_of(p)), anchor.position);
    return anchor;
}

static void move_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct moving *m = user;
    const uint32_t *first = m->clusters->first + m->move->cluster;
    uint32_t begin, end;
    (void)thread;
    piece_bounds(first[1] - first[0], piece, &begin, &end);
    for (uint32_t k = begin; k < end; k++)
        m->out[k] = anchor_of(m, m->clusters->strands[first[0] + k]);
}

static groom_status check_reach(const struct groom_anchor *anchors, size_t n, size_t i, struct groom_diag *diag)
{
    for (size_t k = 0; k < n; k++)
        for (int c = 0; c < 3; c++)
            if (!isfinite(anchors[k].position[c]))
                return refuse(diag, i, "transform", "takes a point beyond what can be counted");
    return GROOM_OK;
}

static size_t leave_out_lengthless(struct groom_anchor *anchors, size_t n)
{
    size_t kept = 0;
    for (size_t k = 0; k < n; k++)
        if (anchors[k].strand != UINT32_MAX)
            anchors[kept++] = anchors[k];
    return kept;
}

/* all: room for an anchor a move and strand of its cluster */
static groom_status fill_anchors(struct moving *m, const struct groom_frame_move *moves, size_t n_moves,
                                 const struct groom_context *context, struct groom_anchor *all, size_t *n_kept,
                                 struct groom_diag *diag)
{
    *n_kept = 0;
    for (size_t i = 0; i < n_moves; i++) {
        const uint32_t *first = m->clusters->first + moves[i].cluster;
        uint32_t n = first[1] - first[0];
        m->move = &moves[i];
        m->out = all + *n_kept;
        parallel_for(context, piece_count(n), move_piece, m);
        groom_status st = check_reach(m->out, n, i, diag);
        if (st != GROOM_OK)
            return st;
        *n_kept += leave_out_lengthless(m->out, n);
    }
    return GROOM_OK;
}

static groom_status anchors_create(const struct groom_anchor *from, size_t n, const struct groom_context *context,
                                   struct groom_anchors **anchors, struct groom_diag *diag)
{
    const struct groom_allocator *a = memory_allocator(context);
    struct groom_anchors *made = memory_array_zero(a, 1, sizeof *made);
    if (!made || !(made->anchor = memory_array(a, n, sizeof *made->anchor))) {
        memory_release(a, made, 1, sizeof *made);
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %zu anchors", n);
    }
    made->n = n;
    made->allocator = a;
    for (size_t k = 0; k < n; k++)
        made->anchor[k] = from[k];
    *anchors = made;
    return GROOM_OK;
}

groom_status groom_clusters_move(const struct groom_clusters *clusters, const struct groom_superhelices *helices,
                                 const struct groom_frame_move *moves, size_t n_moves,
                                 const struct groom_context *context, struct groom_anchors **anchors,
                                 struct groom_diag *diag)
{
    const struct groom_allocator *a = memory_allocator(context);
    struct moving moving = {.clusters = clusters, .helices = helices};
    size_t most = 0, n_kept = 0;
    groom_status st = GROOM_OK;
    if (helices->n_strands != clusters->n_strands)
        return groom_fail(diag, GROOM_EINVAL, "the clusters are of %u strands, not of these %u", clusters->n_strands,
                          helices->n_strands);
    for (size_t i = 0; i < n_moves; i++) {
        if ((st = check_move(clusters, &moves[i], i, diag)) != GROOM_OK)
            return st;
        most += clusters->first[moves[i].cluster + 1] - clusters->first[moves[i].cluster];
    }
    struct groom_anchor *all = memory_array(a, most, sizeof *all);
    if (!all)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for %zu anchors", most);
    st = fill_anchors(&moving, moves, n_moves, context, all, &n_kept, diag);
    if (st == GROOM_OK)
        st = anchors_create(all, n_kept, context, anchors, diag);
    memory_release(a, all, most, sizeof *all);
    return st;
}
