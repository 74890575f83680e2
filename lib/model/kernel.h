/* What an operator's kernels see: a block of LANES strands. */
#ifndef MODEL_KERNEL_H
#define MODEL_KERNEL_H

#include "groom/groom.h"
#include "model/lanes.h"

/* Numbers of an operator guide's frame at a vertex: normal and binormal. */
#define FRAME_WIDTH 6
/* ... and of its bend axes: v, and w = e x v, both unit and perpendicular to the root direction e. */
#define AXIS_WIDTH 6

struct kernel_inputs {
    uint32_t m;         /* vertices */
    const lanes *root;  /* [3] of the strand */
    const lanes *guide; /* [3m] operator guide, in space; where the chain clumps */
    const lanes *frame; /* [FRAME_WIDTH * m]; where the chain curls */
    const lanes *axis;  /* [AXIS_WIDTH]; where the chain bends */
    const float (*noise)[4]; /* [NOISE_TABLE], where the chain frizzes */
    const float (*axes)[3];  /* [3] of the groom, along which noise shifts; NULL: those of space */
    float parameter[GROOM_OPERATOR_MAX_PARAMETERS];
    lanes random[GROOM_OPERATOR_MAX_RANDOM];
};

/* Adjoints of the above: d(loss)/d(that). */
struct kernel_adjoints {
    lanes *guide, *frame, *axis;                     /* added to */
    lanes parameter[GROOM_OPERATOR_MAX_PARAMETERS];  /* overwritten */
    lanes random[GROOM_OPERATOR_MAX_RANDOM];         /* overwritten */
};

/* A block's strands. Each operator measures what it makes, while that is in registers, or knows it from what it
 * was given: no other need measure it again. */
struct bundle {
    lanes *points; /* [3m] */
    lanes *at;     /* [m] arc length from the root to each vertex; NULL where nobody asks */
    lanes *fallen; /* [m] model/vec.h; NULL where nobody asks, or, in what an operator is given, has made it */
};

/* y = operator(x); x is measured. scratch: [KERNEL_SCRATCH(m)]; all distinct. */
typedef void kernel_forward(const struct kernel_inputs *in, struct bundle x, struct bundle y, lanes *scratch);
/* d: [3m], comes as the adjoint of y and leaves as the adjoint of x. */
typedef void kernel_backward(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict d,
                             struct kernel_adjoints *adjoints, lanes *restrict scratch);

#define KERNEL_SCRATCH(m) ((size_t)8 * (m))

/* Instruction sets that the bodies are compiled for. */
enum kernel_variant {
    KERNEL_BASELINE, /* what the compiler's flags allow */
    KERNEL_AVX2,     /* x86-64 only */
    KERNEL_VARIANTS
};

struct operator_kernels {
    kernel_forward *forward[KERNEL_VARIANTS];
    kernel_backward *backward[KERNEL_VARIANTS];
};

/* What a scale makes its strands longer by. */
void scale_factor(const struct kernel_inputs *in, float *factor);

/* The arc lengths of strands that no operator has made. */
typedef void kernel_measure(uint32_t m, const lanes *restrict x, lanes *restrict at);
extern kernel_measure *const kernel_measures[KERNEL_VARIANTS];

extern const struct operator_kernels scale_kernels, bend_kernels, curl_kernels, clump_kernels, frizz_kernels;

const struct operator_kernels *kernel_of(groom_operator_type type);

/* The fastest variant that this processor runs. */
enum kernel_variant kernel_best_variant(void);

/* Wrap the bodies name_forward and name_backward into the table name_kernels. */
#if defined(__x86_64__)
#define KERNEL_TARGET_AVX2 __attribute__((target("avx2")))
#define KERNEL_TABLE(name)                                                                                           \
    static void name##_forward_baseline(const struct kernel_inputs *in, struct bundle x, struct bundle y,             \
                                        lanes *scratch)                                                              \
    {                                                                                                                \
        name##_forward(in, x, y, scratch);                                                                           \
    }                                                                                                                \
    static void name##_backward_baseline(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict d,  \
                                         struct kernel_adjoints *adjoints, lanes *restrict scratch)                  \
    {                                                                                                                \
        name##_backward(in, x, d, adjoints, scratch);                                                                \
    }                                                                                                                \
    KERNEL_TARGET_AVX2 static void name##_forward_avx2(const struct kernel_inputs *in, struct bundle x,               \
                                                       struct bundle y, lanes *scratch)                              \
    {                                                                                                                \
        name##_forward(in, x, y, scratch);                                                                           \
    }                                                                                                                \
    KERNEL_TARGET_AVX2 static void name##_backward_avx2(const struct kernel_inputs *in, const lanes *restrict x,      \
                                                        lanes *restrict d, struct kernel_adjoints *adjoints,         \
                                                        lanes *restrict scratch)                                     \
    {                                                                                                                \
        name##_backward(in, x, d, adjoints, scratch);                                                                \
    }                                                                                                                \
    const struct operator_kernels name##_kernels = {{name##_forward_baseline, name##_forward_avx2},                  \
                                                    {name##_backward_baseline, name##_backward_avx2}};
#else
#define KERNEL_TABLE(name)                                                                                           \
    static void name##_forward_baseline(const struct kernel_inputs *in, struct bundle x, struct bundle y,             \
                                        lanes *scratch)                                                              \
    {                                                                                                                \
        name##_forward(in, x, y, scratch);                                                                           \
    }                                                                                                                \
    static void name##_backward_baseline(const struct kernel_inputs *in, const lanes *restrict x, lanes *restrict d,  \
                                         struct kernel_adjoints *adjoints, lanes *restrict scratch)                  \
    {                                                                                                                \
        name##_backward(in, x, d, adjoints, scratch);                                                                \
    }                                                                                                                \
    const struct operator_kernels name##_kernels = {{name##_forward_baseline}, {name##_backward_baseline}};
#endif

#endif
