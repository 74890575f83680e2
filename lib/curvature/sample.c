/* From super-helices to points: Eqs. 2-8 along each strand. */
#include <math.h>

#include "curvature/chain.h"
#include "curvature/pieces.h"

/* Walks forward over the elements; steps back only where a station lies behind. */
struct walker {
    const struct chain *chain;
    struct chain_state at; /* where element `j` begins */
    double begin;          /* its arc length */
    uint32_t j;
};

static void walker_rewind(struct walker *w)
{
    w->at = w->chain->root;
    w->begin = 0.0;
    w->j = 0;
}

/* Move to the element that holds arc length s; a junction belongs to the next one. */
static void walker_seek(struct walker *w, double s)
{
    const struct chain *c = w->chain;
    if (s < w->begin)
        walker_rewind(w);
    while (w->j + 1 < c->n && s >= w->begin + c->length[w->j]) {
        w->at = chain_step(w->at, vec_of(c->q[w->j]), c->length[w->j]);
        w->begin += c->length[w->j];
        w->j++;
    }
}

/* s, kept inside the walker's element: past the tip it stays there. NaN goes to the root. */
static double local_arc(const struct walker *w, double s)
{
    double local = fmin(s - w->begin, w->chain->length[w->j]);
    return local > 0.0 ? local : 0.0;
}

void groom_superhelix_sample(const struct groom_superhelices *helices, uint32_t strand, const double *arc,
                             uint32_t n, double (*points)[3], double (*frames)[3][3])
{
    struct chain chain = chain_of(helices, strand);
    struct walker w = {.chain = &chain};
    walker_rewind(&w);
    for (uint32_t i = 0; i < n; i++) {
        walker_seek(&w, arc[i]);
        vec3 q = vec_of(chain.q[w.j]);
        double s = local_arc(&w, arc[i]);
        if (frames) {
            struct chain_state here = chain_step(w.at, q, s);
            vec_store(here.p, points[i]);
            mat_store(here.F, frames[i]);
        } else {
            vec_store(chain_point(w.at, q, s), points[i]);
        }
    }
}

static void store_float(vec3 p, float out[3])
{
    out[0] = (float)p.x, out[1] = (float)p.y, out[2] = (float)p.z;
}

struct sampling {
    const struct groom_superhelices *helices;
    uint32_t n_vertices;   /* of each strand, or */
    const uint32_t *first; /* where each strand's stations begin */
    const float *at;
    float (*out)[3];
};

static void sample_strand(const struct sampling *job, uint32_t i)
{
    struct chain chain = chain_of(job->helices, i);
    struct walker w = {.chain = &chain};
    double length = groom_superhelix_length(job->helices, i);
    uint32_t n = job->first ? job->first[i + 1] - job->first[i] : job->n_vertices;
    size_t begin = job->first ? job->first[i] : (size_t)i * n;
    walker_rewind(&w);
    for (uint32_t k = 0; k < n; k++) {
        double fraction = job->first ? (double)job->at[begin + k] : (double)k / (double)(n - 1);
        double s = fraction * length;
        walker_seek(&w, s);
        store_float(chain_point(w.at, vec_of(chain.q[w.j]), local_arc(&w, s)), job->out[begin + k]);
    }
}

static void sample_piece(void *user, uint32_t piece, uint32_t thread)
{
    const struct sampling *job = user;
    uint32_t begin, end;
    (void)thread;
    piece_bounds(job->helices->n_strands, piece, &begin, &end);
    for (uint32_t i = begin; i < end; i++)
        sample_strand(job, i);
}

static void sample_all(struct sampling *job, const struct groom_context *context)
{
    parallel_for(context, piece_count(job->helices->n_strands), sample_piece, job);
}

groom_status groom_superhelices_sample(const struct groom_superhelices *helices, uint32_t n_vertices,
                                       float (*out)[3], const struct groom_context *context,
                                       struct groom_diag *diag)
{
    if (n_vertices < 2)
        return groom_fail(diag, GROOM_EINVAL, "%u vertices a strand: at least 2 are needed", n_vertices);
    struct sampling job = {.helices = helices, .n_vertices = n_vertices, .out = out};
    sample_all(&job, context);
    return GROOM_OK;
}

groom_status groom_superhelices_sample_at(const struct groom_superhelices *helices, const uint32_t *first,
                                          const float *at, float (*out)[3],
                                          const struct groom_context *context, struct groom_diag *diag)
{
    for (uint32_t i = 0; i < helices->n_strands; i++)
        for (uint32_t k = first[i]; k < first[i + 1]; k++)
            if (!(at[k] >= 0.0f && at[k] <= 1.0f))
                return groom_fail(diag, GROOM_EINVAL, "station %u of strand %u is %g: it must lie in 0..1",
                                  k - first[i], i, (double)at[k]);
    struct sampling job = {.helices = helices, .first = first, .at = at, .out = out};
    sample_all(&job, context);
    return GROOM_OK;
}
