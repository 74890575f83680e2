/* The table of operators: what each is called, its parameters, and the random numbers it draws. */
#include <string.h>

#include "groom/groom.h"

#define COUNT(array) ((uint32_t)(sizeof(array) / sizeof(array)[0]))

static const struct groom_operator_parameter scale_parameters[] = {
    {"random_scale", "", 0.0f, 1.0f, 0.5f, 0.1f,
     "How much strands differ in length: 0.1 makes them up to a tenth longer or shorter."},
};
static const struct groom_operator_parameter bend_parameters[] = {
    {"angle", "rad", 0.0f, 6.2831855f, 3.1415927f, 0.5f,
     "How far a strand's tip is turned, each strand about an axis of its own."},
    {"start", "", 0.0f, 1.0f, 1.0f, 0.3f, "Where along the strand the bend sets in: 0 at the root, 1 at the tip."},
};
static const struct groom_operator_parameter curl_parameters[] = {
    {"radius", "m", 0.0f, 0.2f, 0.03f, 0.005f, "Radius of the curls; they widen towards the tip."},
    {"frequency", "1/m", 0.0f, 2000.0f, 200.0f, 40.0f, "Turns in a metre of hair."},
    {"random_frequency", "1/m", 0.0f, 1000.0f, 100.0f, 4.0f, "How much the turns in a metre differ from curl to curl."},
    {"start", "", 0.0f, 1.0f, 1.0f, 0.1f, "Where along the strand the curl sets in: 0 at the root, 1 at the tip."},
};
static const struct groom_operator_parameter clump_parameters[] = {
    {"profile", "", 0.0f, 100.0f, 10.0f, 1.0f,
     "How fast strands close in on their operator guide towards the tip; 0 leaves them where they are."},
};
static const struct groom_operator_parameter frizz_parameters[] = {
    {"frequency", "1/m", 0.0f, 5000.0f, 500.0f, 50.0f, "Waves of the noise in a metre of hair."},
    {"amplitude", "m", 0.0f, 0.2f, 0.03f, 0.004f, "Size of the noise; strands move by about a tenth of it."},
};
static const struct groom_operator_parameter ruffle_parameters[] = {
    {"rho", "", 0.0f, 1.0f, 1.0f, 0.3f, "How much of the hair is exchanged between strands: the chance of each piece."},
    {"blend", "", 0.0f, 1.0f, 1.0f, 1.0f, "How far each piece goes from its own shape to the other strand's."},
    {"match_elements", "count", 0.0f, 4096.0f, 20.0f, 4.0f, "Pieces next to the root that stay as they are."},
};
static const struct groom_operator_parameter sculpt_parameters[] = {
    {"stiffness", "cm^4", 0.0f, 1e6f, 100.0f, 10.0f,
     "How much strands keep their curls: 0 gives way to the anchors wherever these pull."},
};
static const struct groom_operator_parameter interpolate_parameters[] = {
    {"t", "", 0.0f, 1.0f, 1.0f, 0.5f, "0 is this groom, 1 the other."},
};
static const struct groom_operator_parameter curl_scale_parameters[] = {
    {"radius", "", 0.01f, 100.0f, 3.0f, 1.0f, "Factor of the radius of each curl."},
    {"step", "", 0.01f, 100.0f, 3.0f, 1.0f, "Factor of the rise of each turn."},
    {"ramp_root", "", 0.0f, 1.0f, 1.0f, 1.0f, "How much of the change there is at the root."},
    {"ramp_tip", "", 0.0f, 1.0f, 1.0f, 1.0f, "How much of the change there is at the tip."},
    {"largest_radius", "m", 0.0f, 10.0f, 0.1f, 0.0f, "Bends wider than this are not curls and stay; 0: all are."},
};

static const struct groom_operator_random truncated_normal[] = {{"u", -1.0f, 1.0f}};
static const struct groom_operator_random uniform[] = {{"u", 0.0f, 1.0f}};
static const struct groom_operator_random curl_random[] = {{"u1", -1.0f, 1.0f}, {"u2", 0.0f, 1.0f}};

struct operator_entry {
    const char *name;
    uint32_t n_random;
    int per_guide, needs_guides;
    const struct groom_operator_parameter *parameters;
    uint32_t n_parameters;
    const struct groom_operator_random *randoms;
};

#define ENTRY(constant, slug, n_random, per_guide, needs_guides) {slug, n_random, per_guide, needs_guides, constant##_TABLES}
#define GROOM_OPERATOR_SCALE_TABLES scale_parameters, COUNT(scale_parameters), truncated_normal
#define GROOM_OPERATOR_BEND_TABLES bend_parameters, COUNT(bend_parameters), truncated_normal
#define GROOM_OPERATOR_CURL_TABLES curl_parameters, COUNT(curl_parameters), curl_random
#define GROOM_OPERATOR_CLUMP_TABLES clump_parameters, COUNT(clump_parameters), NULL
#define GROOM_OPERATOR_FRIZZ_TABLES frizz_parameters, COUNT(frizz_parameters), uniform
#define GROOM_OPERATOR_RUFFLE_TABLES ruffle_parameters, COUNT(ruffle_parameters), NULL
#define GROOM_OPERATOR_SCULPT_TABLES sculpt_parameters, COUNT(sculpt_parameters), NULL
#define GROOM_OPERATOR_INTERPOLATE_TABLES interpolate_parameters, COUNT(interpolate_parameters), NULL
#define GROOM_OPERATOR_CURL_SCALE_TABLES curl_scale_parameters, COUNT(curl_scale_parameters), NULL

static const struct operator_entry table[GROOM_OPERATOR_TYPES] = {
#define OPERATOR_ROW(constant, slug, n_random, per_guide, needs_guides)                                              \
    [constant] = ENTRY(constant, slug, n_random, per_guide, needs_guides),
    GROOM_OPERATOR_LIST(OPERATOR_ROW)
#undef OPERATOR_ROW
#define LAYER_ROW(constant, slug) [constant] = ENTRY(constant, slug, 0, 0, 0),
    GROOM_LAYER_LIST(LAYER_ROW)
#undef LAYER_ROW
};

static const struct operator_entry *entry_of(groom_operator_type type)
{
    static const struct operator_entry nothing = {.name = "unknown"};
    return (unsigned)type < GROOM_OPERATOR_TYPES ? &table[type] : &nothing;
}

const char *groom_operator_name(groom_operator_type type) { return entry_of(type)->name; }

const struct groom_operator_parameter *groom_operator_parameters(groom_operator_type type, uint32_t *n)
{
    *n = entry_of(type)->n_parameters;
    return entry_of(type)->parameters;
}

const struct groom_operator_random *groom_operator_randoms(groom_operator_type type, uint32_t *n)
{
    *n = entry_of(type)->n_random;
    return entry_of(type)->randoms;
}

uint32_t groom_operator_random_arrays(groom_operator_type type) { return entry_of(type)->n_random; }

int groom_operator_random_per_guide(groom_operator_type type) { return entry_of(type)->per_guide; }

int groom_operator_needs_guides(groom_operator_type type) { return entry_of(type)->needs_guides; }

int groom_operator_is_layer(groom_operator_type type)
{
    return (unsigned)type >= GROOM_OPERATOR_COUNT && (unsigned)type < GROOM_OPERATOR_TYPES;
}

groom_status groom_operator_parse(const char *name, groom_operator_type *type, struct groom_diag *diag)
{
    for (unsigned i = 0; i < GROOM_OPERATOR_TYPES; i++)
        if (strcmp(name, table[i].name) == 0) {
            *type = (groom_operator_type)i;
            return GROOM_OK;
        }
#define OPERATOR_WORD(constant, slug, n_random, per_guide, needs_guides) " " slug
#define LAYER_WORD(constant, slug) " " slug
    return groom_fail(diag, GROOM_EINVAL, "there is no operator \"%.40s\"; choose one of:%s", name,
                      GROOM_OPERATOR_LIST(OPERATOR_WORD) GROOM_LAYER_LIST(LAYER_WORD));
#undef OPERATOR_WORD
#undef LAYER_WORD
}
