/* What benchmarks of fits to known truths share: a row of styles from the command line, options that know what the
 * truth is made of, the truth drawn anew, and errors of parameters and of strands. They end the program where a call fails. */
#ifndef TESTS_SUPPORT_KNOWN_H
#define TESTS_SUPPORT_KNOWN_H

#include "fit/loss_strands.h"
#include "tests/support/guides.h"

/* --- the program --------------------------------------------------------------------------- */

struct known_run {
    uint32_t n_strands;
    const char *more[3]; /* words of the command line after the style; "" where there are none */
    const struct groom_context *context;
};

/* judge() for each style that `PROGRAM [n_strands [style|all [more...]]]` names. Returns main()'s status. */
int known_styles(int argc, char **argv, void (*judge)(groom_sample_style style, const struct known_run *run));

void known_must(groom_status status, const struct groom_diag *diag);
double known_seconds(void); /* of processor time, all threads */

/* --- fits --------------------------------------------------------------------------------------- */

/* Standard, seed 77, with the truth's operators named; its counts of guides too, or the fit's own. */
struct groom_fit_options known_options(const struct groom_sample *sample, int automatic);

/* The truth with other random numbers. */
struct groom *known_redrawn(const struct groom *truth, uint64_t seed, const struct groom_context *context);

/* In place of the fit's groom. */
void known_replace(struct groom_fit *fit, struct groom *groom);

/* --- errors ----------------------------------------------------------------------------------------- */

enum { KNOWN_PARAMETERS = 64 };
struct known_parameter {
    const char *of, *name; /* "clump", "profile" */
    double error;          /* per cent of the truth's */
};
/* Of operators in the truth's order; returns how many there are. */
uint32_t known_parameters(const struct groom *groom, const struct groom *truth, struct known_parameter parameter[KNOWN_PARAMETERS]);

struct known_errors { double size[4096]; uint32_t n; };
void known_add(struct known_errors *errors, const struct known_parameter *parameter, uint32_t n);
/* Lines `figure NAME_median_error ..` and `figure NAME_largest_error ..`; sorts them. */
void known_print(struct known_errors *errors, const char *name);

/* Of all strands, as the fit has resampled the capture. */
struct loss_strands known_strand_errors(const struct groom_fit *fit, const struct groom *groom, const struct groom_context *context);

#endif
