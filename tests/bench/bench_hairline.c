/* Table III: density changes of the roots under edits of the hairline, by the membrane, a harmonic
 * displacement and a thin-plate spline. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "groom/hairline.h"
#include "groom/mesh.h"
#include "tests/support/hairlines.h"

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int main(int argc, char **argv)
{
    static const struct {
        hairlines_shape shape;
        const char *name;
    } edits[] = {{HAIRLINES_STRAIGHT, "straight"}, {HAIRLINES_WIDOW, "widow"}, {HAIRLINES_ROUND, "round"}, {HAIRLINES_RECEDING, "receding"}};
    uint32_t n = argc > 1 ? (uint32_t)atoi(argv[1]) : 30000;
    float (*roots)[3], (*moved)[3] = malloc(n * sizeof *moved);
    struct groom_mesh *head = hairlines_sample(n, &roots);
    struct groom_scalp_region *region;
    struct groom_scalp_region_report scalp;
    struct groom_diag diag = {0};
    double start = seconds(), worst = 0, l1 = 0, linf = 0;
    if (groom_scalp_region_create(head, (const float (*)[3])roots, n, NULL, NULL, NULL, &region, &scalp, &diag) != GROOM_OK) {
        printf("%s\n", diag.detail);
        return 1;
    }
    printf("%u roots on %u triangles of %.0f cm2, %u boundary vertices, closing %.1f mm: %.3f s\n", n, scalp.n_triangles, 1e4 * scalp.area,
           scalp.n_boundary, 1e3 * (double)scalp.closing_m, seconds() - start);
    printf("%-10s %-11s %7s %7s %8s %9s %7s %7s %5s %6s\n", "edit", "method", "L1", "Linf", "flipped", "max move", "error", "energy", "steps", "s");
    for (size_t e = 0; e < sizeof edits / sizeof edits[0]; e++)
        for (int method = 0; method < GROOM_RELOCATE_COUNT; method++) {
            static struct groom_hairline hairline;
            struct groom_relocation_report report;
            hairlines_draw(region, edits[e].shape, 24, &hairline);
            hairline.method = (groom_relocate_method)method;
            start = seconds();
            groom_status st = groom_hairline_relocate(region, &hairline, NULL, moved, NULL, NULL, &report, &diag);
            double took = seconds() - start;
            if (st != GROOM_OK) {
                printf("%-10s %-11s %s %s\n", edits[e].name, groom_relocate_method_name(hairline.method), diag.pointer, diag.detail);
                continue;
            }
            printf("%-10s %-11s %7.4f %7.3f %8u %6.1f mm %4.2f mm %7.4f %2u/%2u %6.3f\n", edits[e].name,
                   groom_relocate_method_name(hairline.method), report.density_l1, report.density_linf, report.n_flipped,
                   1e3 * report.max_move, 1e3 * report.boundary_error, report.energy, report.load_steps, report.newton_iterations, took);
            if (method == GROOM_RELOCATE_MEMBRANE && e < 2) {
                worst = fmax(worst, took);
                l1 = fmax(l1, report.density_l1);
                linf = fmax(linf, report.density_linf);
            }
        }
    printf("figure retarget_hairline_seconds %.3f s\n", worst);
    printf("figure retarget_hairline_density_l1 %.4f 1\n", l1);
    printf("figure retarget_hairline_density_linf %.4f 1\n", linf);
    groom_scalp_region_destroy(region);
    groom_mesh_destroy(head);
    free(roots);
    free(moved);
    return 0;
}
