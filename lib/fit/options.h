/* The table behind groom_fit_options. */
#ifndef FIT_OPTIONS_H
#define FIT_OPTIONS_H

#include <stddef.h>

#include "groom/fit.h"

enum option_type {
    OPTION_GROUP,         /* an object of options */
    OPTION_GROUP_OR_NULL, /* the same, or null, which leaves it out */
    OPTION_U32,
    OPTION_U32_OR_AUTO,   /* "auto" is 0 */
    OPTION_U64,
    OPTION_REAL,
    OPTION_REAL_OR_AUTO,  /* "auto" is 0 */
    OPTION_BOOLEAN,
    OPTION_QUALITY,
    OPTION_METHOD,
    OPTION_OPERATORS,
    OPTION_CAMERAS
};

struct option_row {
    const char *path;    /* JSON pointer */
    enum option_type type;
    size_t offset;       /* in struct groom_fit_options */
    double initial[3];   /* for draft, standard, high */
    double minimum, maximum;
    const char *help;
};

/* Parents stand before their members. */
extern const struct option_row options_table[];
extern const size_t options_n_rows;

/* The row of a path, or NULL. */
const struct option_row *options_find(const char *path);
/* Does `path` lie directly in `group` ("" for the top)? Then its last name, else NULL. */
const char *options_member(const char *path, const char *group);

extern const char *const options_quality_names[3];
extern const char *const options_method_names[2];

#endif
