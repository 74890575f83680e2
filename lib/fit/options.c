/* Every option of a fit, once: the path in JSON, where it is kept, its defaults, its range and what
 * it does. The numbers are those of Chang et al. 2025, Section 6, where the paper gives them. */
#include "fit/options.h"

#include <string.h>

#define AT(member) offsetof(struct groom_fit_options, member)
#define ALL(x) {x, x, x}

const struct option_row options_table[] = {
    {"/vertices", OPTION_U32, AT(vertices), ALL(100), 3, 1000,
     "Vertices of each strand and guide; the capture is resampled to it."},
    {"/guides", OPTION_U32_OR_AUTO, AT(guides), ALL(0), 1, 10000,
     "Guide strands. auto: 4 for each square root of the number of strands, or one for each curl where curls are small; at least 4 strands a guide, but where there are no more than 16."},
    {"/operator_guides", OPTION_U32_OR_AUTO, AT(operator_guides), ALL(0), 1, 10000,
     "Guides that operators work around, chosen among the guides. auto: half of them, a quarter where strands are few, or one for each curl where curls are small."},
    {"/operators", OPTION_OPERATORS, AT(operators), ALL(0), 0, GROOM_FIT_MAX_OPERATORS,
     "The chain of operators, first to last. auto: scale, bend, curl, clump, frizz, of which a bend, curl or clump that the hair does not need is left at 0."},
    {"/interpolation_guides", OPTION_U32, AT(interpolation_guides), ALL(3), 1, 16,
     "Guides that each strand blends."},
    {"/seed", OPTION_U64, AT(seed), ALL(1), 0, 999999999999999.0,
     "Seed of the groom's random numbers. What the fit estimates with draws of its own does not depend on it."},
    {"/quality", OPTION_QUALITY, AT(quality), {0, 1, 2}, 0, 2,
     "How much work to spend: sets the defaults of the stages."},
    {"/visibility", OPTION_GROUP_OR_NULL, 0, ALL(0), 0, 0,
     "What the capture was seen by: strands that no camera sees leave the losses of the stages."},
    {"/visibility/cameras", OPTION_CAMERAS, AT(cameras), ALL(0), 0, GROOM_FIT_MAX_CAMERAS,
     "Pinhole cameras: pixels and metres, world to camera, x right, y down, z forward; or NeRF's transforms.json; or COLMAP's text."},
    {"/visibility/least_seen", OPTION_REAL, AT(least_seen), ALL(0.1), 0, 1,
     "Share of a strand's vertices that some camera must see; strands of which less is seen leave the losses."},
    {"/stages", OPTION_GROUP, 0, ALL(0), 0, 0, "The hyperparameters of each stage."},

#define ROW(stage, member, type, draft, standard, high, minimum, maximum, help)                              \
    {"/stages/" #stage "/" #member, type, AT(stages.stage.member), {draft, standard, high}, minimum, maximum, help}

    {"/stages/initialize", OPTION_GROUP, 0, ALL(0), 0, 0,
     "Clustering, smoothing, operator guides, assignment (Section 5.2)."},
    ROW(initialize, lambda_smooth, OPTION_REAL, 1, 1, 1, 0, 1e6, "Step of the heat equation that smooths guides (Eq. 6)."),
    ROW(initialize, n_smooth, OPTION_U32, 80, 80, 80, 0, 100000, "Steps of the heat equation."),
    ROW(initialize, fixed_fraction, OPTION_REAL, 0.05, 0.05, 0.05, 0, 1,
        "Fraction of a guide's vertices at the root that smoothing leaves alone."),
    ROW(initialize, cluster_iterations, OPTION_U32, 5, 12, 30, 1, 1000,
        "Iterations of K-means at most; it stops where no strand changes its cluster."),
    ROW(initialize, medoid_iterations, OPTION_U32, 2, 8, 30, 0, 1000,
        "Passes of swaps of K-medoids at most; it stops where no swap is an improvement."),
    ROW(initialize, sigma_instance, OPTION_REAL_OR_AUTO, 0, 0, 0, 1e-6, 10,
        "Width of the instancing weights in scalp coordinates (Eq. 3). auto: 1.5 times the median spacing of guides."),
    ROW(initialize, head_clearance, OPTION_REAL, 0.002, 0.002, 0.002, 0, 0.1,
        "Metres inside the head that do not count as a penetration; for a head of ordinary size, scaled with it."),
    ROW(initialize, estimate_operators, OPTION_BOOLEAN, 1, 1, 1, 0, 1,
        "Start operators from estimates off the strands; else from their documented initial values."),

    {"/stages/instance_weights", OPTION_GROUP, 0, ALL(0), 0, 0, "Instancing weights of each strand (Section 5.3)."},
    ROW(instance_weights, method, OPTION_METHOD, 0, 0, 0, 0, 1,
        "direct: constrained least squares, strand by strand. paper: Adam on Eq. 5, the guides nearest on the scalp."),
    ROW(instance_weights, candidates, OPTION_U32, 12, 12, 12, 1, 32,
        "Guides near a strand among which it chooses the interpolation_guides that it blends."),
    ROW(instance_weights, distance_pull, OPTION_REAL_OR_AUTO, 0, 0, 0, 1e-9, 1e6,
        "Pull towards the weights by distance, over what free weights leave of the usual strand. auto: 100 where the operators are named, 10 where they are not."),
    ROW(instance_weights, iterations, OPTION_U32, 2000, 2000, 2000, 0, 1000000,
        "Gradient steps of the paper's method."),
    ROW(instance_weights, learning_rate, OPTION_REAL, 30, 30, 30, 0, 1e6,
        "Learning rate of the paper's method."),

    {"/stages/guides", OPTION_GROUP, 0, ALL(0), 0, 0, "The shape of the guides (Section 5.4)."},
    ROW(guides, method, OPTION_METHOD, 0, 0, 0, 0, 1,
        "direct: a linear system, smooth along guides and across the scalp. paper: filtered gradient steps on curvatures (Eqs. 7 to 10)."),
    ROW(guides, cycles, OPTION_REAL, 3, 3, 3, 0.01, 1e3,
        "Waves along a guide that keep half of their size: shorter ones are left to the operators. Two thirds of them as long as curls are not known."),
    ROW(guides, across, OPTION_REAL_OR_AUTO, 3, 0, 0, 1e-6, 1e6,
        "Pull of each guide towards its neighbours on the scalp, over that of its own strands. auto: what foretells strands best that were left out; 3 where operators move strands together."),
    ROW(guides, sigma_d, OPTION_REAL, 0.3, 0.3, 0.3, 1e-6, 1e3,
        "How far the root directions of neighbours may differ until they leave each other alone, by either method."),
    ROW(guides, iterations, OPTION_U32, 3000, 3000, 3000, 0, 1000000, "Gradient steps of the paper's method."),
    ROW(guides, learning_rate_curvature, OPTION_REAL, 5e-2, 5e-2, 5e-2, 0, 1e3,
        "Learning rate of curvatures of the paper's method."),
    ROW(guides, learning_rate_length, OPTION_REAL, 1.5e-3, 1.5e-3, 1.5e-3, 0, 1e3,
        "Learning rate of segment lengths of the paper's method."),
    ROW(guides, learning_rate_angle, OPTION_REAL, 5e-2, 5e-2, 5e-2, 0, 1e3,
        "Learning rate of root angles of the paper's method."),
    ROW(guides, lambda, OPTION_REAL, 10, 10, 10, 0, 1e6, "Strength of the gradient filter of the paper's method."),
    ROW(guides, sigma_phi, OPTION_REAL, 0.4, 0.4, 0.4, 1e-6, 1e3,
        "Width of the splat onto sphere directions in the gradient filter of the paper's method."),

    {"/stages/operators", OPTION_GROUP, 0, ALL(0), 0, 0, "The parameters of the operators (Section 5.5)."},
    ROW(operators, method, OPTION_METHOD, 0, 0, 0, 0, 1,
        "direct: statistics of neighbouring strands are matched. paper: Adam on shape, scale and clump in turn (Eqs. 11 to 18)."),
    ROW(operators, pairs, OPTION_U32, 1000, 1500, 3000, 1, 100000,
        "Pairs of neighbouring strands of which statistics are matched."),
    ROW(operators, refinements, OPTION_U32, 7, 11, 30, 0, 1000,
        "Steps of refinement at most; it stops where none gets lower. 0 leaves the operators as they started."),
    ROW(operators, iterations, OPTION_U32, 3000, 3000, 3000, 0, 1000000,
        "Gradient steps on each of the three losses, of the paper's method."),
    ROW(operators, alternate, OPTION_U32, 200, 200, 200, 1, 1000000,
        "Steps on one loss before the next one's turn, of the paper's method."),
    ROW(operators, learning_rate, OPTION_REAL, 1e-2, 1e-2, 1e-2, 0, 1e3, "Learning rate of the paper's method."),
    ROW(operators, lambda_e, OPTION_REAL, 400, 400, 400, 0, 1e9, "Weight of the segment loss (Eq. 12)."),
    ROW(operators, sigma_scale, OPTION_REAL, 0.1, 0.1, 0.1, 1e-6, 1e3, "Width of the kernel of lengths (Eq. 14)."),
    ROW(operators, sigma_clump, OPTION_REAL, 0.1, 0.1, 0.1, 1e-6, 1e3, "Width of the kernel of distances (Eq. 16)."),
    ROW(operators, batch_fraction, OPTION_REAL, 0.01, 0.01, 0.01, 1e-6, 1, "Fraction of strands in a kernel."),
    ROW(operators, batch_maximum, OPTION_U32, 200, 200, 200, 2, 10000, "Strands in a kernel at most."),
    ROW(operators, batches, OPTION_U32, 5, 5, 5, 1, 10000, "Kernels in a step of the paper's method."),
    ROW(operators, batches_late, OPTION_U32, 50, 50, 50, 1, 10000, "Kernels of which the losses are measured; in a step of the paper's method, those of its last quarter."),

    {"/stages/randoms", OPTION_GROUP, 0, ALL(0), 0, 0, "The random numbers of each strand (Section 5.6)."},
    ROW(randoms, method, OPTION_METHOD, 0, 0, 0, 0, 1,
        "direct: values of each number's range are tried. paper: Adam on Eq. 19 with noise on its gradients (Eqs. 20, 21)."),
    ROW(randoms, rounds, OPTION_U32, 1, 2, 3, 0, 100,
        "Rounds over the operators' random numbers. 0 leaves them as they were drawn; from 2 on there is one more for curls of a few strands a guide."),
    ROW(randoms, values, OPTION_U32, 64, 80, 128, 2, 10000,
        "Values of a strand's number that are tried over its range before the best is refined."),
    ROW(randoms, strands, OPTION_U32, 8, 16, 64, 1, 100000,
        "Strands of an operator guide that are asked about the two numbers of its curl."),
    ROW(randoms, lambda_d, OPTION_REAL, 2, 2, 2, 0, 1e9, "Weight of directions (Eq. 19)."),
    ROW(randoms, lambda_l, OPTION_REAL, 1e-2, 1e-2, 1e-2, 0, 1e9, "Weight of lengths (Eq. 19)."),
    ROW(randoms, lambda_x, OPTION_REAL, 3, 3, 3, 0, 1e9,
        "Weight of squared distances from the target over that of directions, both relative to what they were with the numbers as drawn."),
    ROW(randoms, hold, OPTION_REAL, 0.1, 0.1, 0.1, 0, 1e9,
        "Cost of moving an instancing weight by 1, squared, while a strand's numbers are refined with them."),
    ROW(randoms, across, OPTION_REAL, 0.1, 0.1, 0.1, 1e-6, 1e6,
        "Pull of each guide towards its neighbours on the scalp where guides are solved again, between rounds, for the numbers found."),
    ROW(randoms, refinements, OPTION_U32, 0, 2, 4, 0, 1000,
        "Refinements of the operators' parameters at most, between rounds, for guides solved again; it stops where none gets lower."),
    ROW(randoms, iterations, OPTION_U32, 3000, 3000, 3000, 0, 1000000, "Gradient steps of the paper's method."),
    ROW(randoms, learning_rate, OPTION_REAL, 0.1, 0.1, 0.1, 0, 1e3, "Learning rate of the paper's method."),
    ROW(randoms, noise_first, OPTION_REAL, 1.5, 1.5, 1.5, 0, 1e3,
        "Noise on the gradient in the first step of the paper's method (Eq. 21)."),
    ROW(randoms, noise_last, OPTION_REAL, 0.5, 0.5, 0.5, 0, 1e3,
        "Noise on the gradient in the last step of the paper's method (Eq. 21)."),
};

const size_t options_n_rows = sizeof options_table / sizeof options_table[0];
const char *const options_quality_names[3] = {"draft", "standard", "high"};
const char *const options_method_names[2] = {"direct", "paper"};

const struct option_row *options_find(const char *path)
{
    for (size_t i = 0; i < options_n_rows; i++)
        if (strcmp(options_table[i].path, path) == 0)
            return &options_table[i];
    return NULL;
}

const char *options_member(const char *path, const char *group)
{
    size_t n = strlen(group);
    if (strncmp(path, group, n) != 0 || path[n] != '/')
        return NULL;
    return strchr(path + n + 1, '/') ? NULL : path + n + 1;
}

static void set_default(const struct option_row *row, double value, struct groom_fit_options *options)
{
    void *at = (char *)options + row->offset;
    switch (row->type) {
    case OPTION_U32:
    case OPTION_U32_OR_AUTO: *(uint32_t *)at = (uint32_t)value; break;
    case OPTION_U64: *(uint64_t *)at = (uint64_t)value; break;
    case OPTION_REAL:
    case OPTION_REAL_OR_AUTO: *(double *)at = value; break;
    case OPTION_BOOLEAN: *(int *)at = value != 0; break;
    case OPTION_METHOD: *(groom_fit_method *)at = (groom_fit_method)value; break;
    case OPTION_QUALITY: *(groom_fit_quality *)at = (groom_fit_quality)value; break;
    case OPTION_OPERATORS:
        options->operators_auto = 1;
        for (uint32_t i = 0; i < GROOM_OPERATOR_COUNT; i++)
            options->operators[i] = (groom_operator_type)i;
        options->n_operators = GROOM_OPERATOR_COUNT;
        break;
    case OPTION_CAMERAS: options->n_cameras = 0; break;
    case OPTION_GROUP:
    case OPTION_GROUP_OR_NULL: break;
    }
}

void groom_fit_options_init(groom_fit_quality quality, struct groom_fit_options *options)
{
    memset(options, 0, sizeof *options);
    for (size_t i = 0; i < options_n_rows; i++)
        set_default(&options_table[i], options_table[i].initial[quality], options);
}
