/* Failures as problem documents. */
#include <stdio.h>
#include <stdlib.h>

#include "proto/problem.h"
#include "server/worker/worker.h"

char *worker_problem_text(groom_status status, const struct groom_diag *diag)
{
    struct problem problem;
    int has_detail = diag && diag->status == status;
    problem_set(&problem, groom_status_http(status), groom_status_name(status), groom_status_message(status),
                "%s", has_detail ? diag->detail : "");
    if (has_detail) {
        snprintf(problem.pointer, sizeof problem.pointer, "%s", diag->pointer);
        problem.byte_offset = diag->byte_offset;
    }
    return problem_print(&problem);
}

int worker_print_problem(groom_status status, const struct groom_diag *diag)
{
    char *text = worker_problem_text(status, diag);
    puts(text ? text : "{\"status\":507,\"type\":\"/problems/out-of-memory\",\"title\":\"memory ran out\"}");
    free(text);
    return WORKER_FAILED;
}
