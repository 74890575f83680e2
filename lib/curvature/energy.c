#include "curvature/energy.h"

/* The two derivatives of an element in the world: of its end's place, and of its end's orientation. */
struct element_pull {
    mat3 place; /* F D */
    mat3 turn;  /* F s V */
};

static struct element_pull pull_of(const struct chain_state *at, vec3 q, double s)
{
    vec3 theta = vec_scale(s, q);
    double x = vec_dot(theta, theta);
    trig5 f = trig5_of(x);
    return (struct element_pull){mat_mul(at->F, element_derivative(f, x, theta, s)),
                                 mat_scale(s, mat_mul(at->F, element_mean(f.B, f.C, x, theta)))};
}

struct located_anchor energy_locate(const struct chain *chain, double s, const double target[3])
{
    double begin = 0.0;
    uint32_t j = 0;
    while (j + 1 < chain->n && s >= begin + chain->length[j])
        begin += chain->length[j++];
    double local = fmin(fmax(s - begin, 0.0), chain->length[j]);
    return (struct located_anchor){j, local, {target[0], target[1], target[2]}};
}

void energy_junctions(const struct chain *chain, const double (*q)[3], struct chain_state *junction)
{
    junction[0] = chain->root;
    for (uint32_t j = 0; j < chain->n; j++)
        junction[j + 1] = chain_step(junction[j], vec_of(q[j]), chain->length[j]);
}

static double deviation(const struct sculpt_problem *p, const double (*q)[3])
{
    double sum = 0.0;
    for (uint32_t j = 0; j < p->chain.n; j++) {
        vec3 y = vec_sub(vec_of(q[j]), vec_of(p->rest[j]));
        sum += vec_dot(y, y);
    }
    return sum;
}

double energy_value(const struct sculpt_problem *p, const double (*q)[3], double *anchor_part)
{
    struct chain_state at = p->chain.root;
    double sum = 0.0;
    uint32_t k = 0;
    for (uint32_t j = 0; j < p->chain.n && k < p->n_anchors; j++) {
        for (; k < p->n_anchors && p->anchor[k].element == j; k++) {
            vec3 r = vec_sub(chain_point(at, vec_of(q[j]), p->anchor[k].s), vec_of(p->anchor[k].target));
            sum += vec_dot(r, r);
        }
        at = chain_step(at, vec_of(q[j]), p->chain.length[j]);
    }
    if (anchor_part)
        *anchor_part = sum;
    return sum + p->c * deviation(p, q);
}

/* Tip to root with the force n and the moment m about the world's origin of all anchors beyond. */
double energy_gradient(const struct sculpt_problem *p, const double (*q)[3], double (*gradient)[3],
                       struct chain_state *junction)
{
    vec3 n = {0.0, 0.0, 0.0}, m = n;
    double sum = 0.0;
    uint32_t k = p->n_anchors;
    energy_junctions(&p->chain, q, junction);
    for (uint32_t j = p->chain.n; j-- > 0;) {
        vec3 qj = vec_of(q[j]), y = vec_sub(qj, vec_of(p->rest[j]));
        struct element_pull pull = pull_of(&junction[j], qj, p->chain.length[j]);
        vec3 about_end = vec_sub(m, vec_cross(junction[j + 1].p, n));
        vec3 g = vec_add(mat_transposed_vec(pull.place, n), mat_transposed_vec(pull.turn, about_end));
        for (; k > 0 && p->anchor[k - 1].element == j; k--) {
            const struct located_anchor *a = &p->anchor[k - 1];
            vec3 x = chain_point(junction[j], qj, a->s), r = vec_sub(x, vec_of(a->target)), f = vec_scale(2.0, r);
            g = vec_add(g, mat_transposed_vec(pull_of(&junction[j], qj, a->s).place, f));
            n = vec_add(n, f);
            m = vec_add(m, vec_cross(x, f));
            sum += vec_dot(r, r);
        }
        vec_store(vec_add(g, vec_scale(2.0 * p->c, y)), gradient[j]);
        sum += p->c * vec_dot(y, y);
    }
    return sum;
}

mat3 energy_jacobian_block(const struct chain *chain, const double (*q)[3], const struct chain_state *junction,
                           uint32_t i, double s, uint32_t j)
{
    if (j > i)
        return mat_axial(0.0, 0.0, 0.0, (vec3){0.0, 0.0, 0.0});
    if (j == i)
        return pull_of(&junction[i], vec_of(q[i]), s).place;
    struct element_pull pull = pull_of(&junction[j], vec_of(q[j]), chain->length[j]);
    vec3 arm = vec_sub(chain_point(junction[i], vec_of(q[i]), s), junction[j + 1].p);
    return mat_add(pull.place, mat_scale(-1.0, cross_mat(arm, pull.turn)));
}
