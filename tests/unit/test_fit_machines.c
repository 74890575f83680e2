/* A fit on another machine: its OpenBLAS has other kernels and its C library other functions, and the groom is the same to the bit.
 * A job that died on one node of a cluster is gone on with on another. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/checksum.h"
#include "groom/fit.h"
#include "groom/sample.h"
#include "tests/support/test.h"

/* What may be set before a process begins: kernels that every processor runs, the C library's functions without some
 * instructions, and memory that is full of something where it was 0. */
static const char *const machines[] = {"GROOM_AS_IT_IS=1", "OPENBLAS_CORETYPE=Prescott", "OPENBLAS_CORETYPE=Barcelona",
                                       "GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2,-AVX512F", "MALLOC_PERTURB_=90"};
enum { MACHINES = sizeof machines / sizeof *machines };

/* --- the process on the other machine ----------------------------------------------------------- */

static groom_status fit(struct groom **groom)
{
    struct groom_sample_options capture;
    struct groom_fit_options *options = malloc(sizeof *options);
    struct groom_sample *sample;
    struct groom_fit *fit;
    groom_sample_options_capture(GROOM_SAMPLE_CURLY, &capture);
    capture.n_strands = 400;
    capture.n_vertices = 40;
    capture.n_guides = 60;
    capture.n_operator_guides = 20;
    groom_fit_options_init(GROOM_FIT_STANDARD, options);
    options->vertices = 40;
    options->guides = 40;
    groom_status st = groom_sample_create(&capture, NULL, &sample, NULL);
    if (st == GROOM_OK)
        st = groom_fit_create(sample->capture, sample->head, options, NULL, &fit, NULL);
    while (st == GROOM_OK && !groom_fit_done(fit))
        st = groom_fit_step(fit, NULL, NULL);
    return st == GROOM_OK ? groom_fit_result(fit, NULL, groom, NULL) : st;
}

/* What its strands are a function of, and its parameters to be read. */
static int print_groom(void)
{
    struct groom *groom;
    struct checksum sum = {0};
    if (fit(&groom) != GROOM_OK)
        return 1;
    checksum_add(&sum, groom->guides, (size_t)groom->n_guides * groom->n_vertices * sizeof *groom->guides);
    checksum_add(&sum, groom->instancing_weight, (size_t)groom->n_strands * groom->n_instancing * sizeof *groom->instancing_weight);
    for (uint32_t o = 0; o < groom->n_operators; o++) {
        const struct groom_operator *op = &groom->operators[o];
        size_t n = groom_operator_random_per_guide(op->type) ? groom->n_operator_guides : groom->n_strands;
        checksum_add(&sum, op->parameter, sizeof op->parameter);
        for (uint32_t r = 0; r < groom_operator_random_arrays(op->type); r++)
            checksum_add(&sum, op->random[r], n * sizeof *op->random[r]);
        printf("%a %a ", (double)op->parameter[0], (double)op->parameter[1]);
    }
    printf("%016llx\n", (unsigned long long)checksum_finish(&sum));
    return 0;
}

/* --- and who asks it --------------------------------------------------------------------------------- */

static void groom_of_machine(const char *machine, char *groom, int size)
{
    char command[600], self[400];
    ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    ck_assert_int_gt(n, 0);
    self[n] = 0;
    snprintf(command, sizeof command, "env '%s' '%s' groom", machine, self);
    FILE *pipe = popen(command, "r");
    ck_assert_ptr_nonnull(pipe);
    ck_assert_ptr_nonnull(fgets(groom, size, pipe));
    ck_assert_int_eq(pclose(pipe), 0);
}

START_TEST(another_machine_gives_the_same_bits)
{
    char first[1000], other[1000];
    groom_of_machine(machines[0], first, sizeof first);
    for (int i = 1; i < MACHINES; i++) {
        groom_of_machine(machines[i], other, sizeof other);
        ck_assert_msg(!strcmp(first, other), "%s:\n%s%s", machines[i], other, first);
    }
}
END_TEST

int main(int argc, char **argv)
{
    const TTest *const tests[] = {another_machine_gives_the_same_bits};
    (void)argv;
    return argc > 1 ? print_groom() : test_run("fit_machines", tests, 1);
}
