/* The styles of the generator, after the synthetic grooms of Chang et al. 2025, Table 1. */
#include <math.h>

#include "sample/parts.h"

static const struct sample_style styles[] = {
    [GROOM_SAMPLE_STRAIGHT] = {.n_strands = 10000, .n_guides = 400, .n_operator_guides = 100,
        .length = 0.46, .length_low = 0.75, .cut = 0.20, .lift = 0.25, .comb_side = 0.9, .comb_front = -0.1,
        .gravity = 45, .parting = 0.018, .layer = 0.02, .n_operators = 3,
        .operators = {{GROOM_OPERATOR_SCALE, {0.06f}}, {GROOM_OPERATOR_CLUMP, {0.7f}},
                      {GROOM_OPERATOR_FRIZZ, {30.0f, 0.02f}}}},
    [GROOM_SAMPLE_WAVY] = {.n_strands = 10000, .n_guides = 400, .n_operator_guides = 130,
        .length = 0.36, .length_low = 0.75, .cut = 0.12, .lift = 0.3, .comb_side = 0.9, .comb_front = -0.15,
        .gravity = 40, .parting = -0.02, .layer = 0.026, .n_operators = 4,
        .operators = {{GROOM_OPERATOR_SCALE, {0.08f}}, {GROOM_OPERATOR_CURL, {0.005f, 18.0f, 2.0f, 0.25f}},
                      {GROOM_OPERATOR_CLUMP, {1.0f}}, {GROOM_OPERATOR_FRIZZ, {40.0f, 0.02f}}}},
    [GROOM_SAMPLE_CURLY] = {.n_strands = 10000, .n_guides = 400, .n_operator_guides = 200,
        .length = 0.40, .length_low = 0.75, .cut = 0.19, .lift = 0.4, .comb_side = 0.8, .comb_front = -0.1,
        .gravity = 28, .parting = 0.0, .layer = 0.030, .n_operators = 4,
        .operators = {{GROOM_OPERATOR_SCALE, {0.08f}}, {GROOM_OPERATOR_CURL, {0.009f, 32.0f, 4.0f, 0.15f}},
                      {GROOM_OPERATOR_CLUMP, {1.6f}}, {GROOM_OPERATOR_FRIZZ, {50.0f, 0.02f}}}},
    [GROOM_SAMPLE_COILY] = {.n_strands = 12000, .n_guides = 1200, .n_operator_guides = 1200,
        .length = 0.065, .length_low = 0.45, .lift = 1, .gravity = 2, .parting = NAN, .layer = 0, .n_operators = 4,
        .operators = {{GROOM_OPERATOR_SCALE, {0.1f}}, {GROOM_OPERATOR_CURL, {0.0045f, 110.0f, 12.0f, 0.08f}},
                      {GROOM_OPERATOR_CLUMP, {1.2f}}, {GROOM_OPERATOR_FRIZZ, {60.0f, 0.01f}}}},
    [GROOM_SAMPLE_SHORT] = {.n_strands = 15000, .n_guides = 400, .n_operator_guides = 200,
        .length = 0.055, .length_low = 0.15, .lift = 0.5, .comb_front = 0.7, .comb_side = 0.2, .gravity = 10,
        .parting = NAN, .layer = 0.008, .n_operators = 3,
        .operators = {{GROOM_OPERATOR_SCALE, {0.12f}}, {GROOM_OPERATOR_BEND, {0.25f, 0.3f}},
                      {GROOM_OPERATOR_FRIZZ, {80.0f, 0.006f}}}},
    [GROOM_SAMPLE_SPIKY] = {.n_strands = 10000, .n_guides = 350, .n_operator_guides = 180,
        .length = 0.10, .length_low = 0.5, .lift = 1, .comb_up = 0.35, .comb_front = -0.15, .gravity = 3,
        .parting = NAN, .layer = 0, .n_operators = 3,
        .operators = {{GROOM_OPERATOR_SCALE, {0.15f}}, {GROOM_OPERATOR_CLUMP, {3.0f}},
                      {GROOM_OPERATOR_FRIZZ, {40.0f, 0.01f}}}},
    [GROOM_SAMPLE_BENT] = {.n_strands = 10000, .n_guides = 400, .n_operator_guides = 100,
        .length = 0.42, .length_low = 0.75, .cut = 0.18, .lift = 0.3, .comb_side = 0.85, .comb_front = -0.1,
        .gravity = 38, .parting = 0.0, .layer = 0.028, .n_operators = 3,
        .operators = {{GROOM_OPERATOR_SCALE, {0.08f}}, {GROOM_OPERATOR_BEND, {0.7f, 0.45f}},
                      {GROOM_OPERATOR_FRIZZ, {30.0f, 0.015f}}}},
};

const struct sample_style *sample_style_of(groom_sample_style style) { return &styles[style]; }
