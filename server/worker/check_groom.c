/* check-groom: a groom document of someone else's, read, validated and written in its canonical form. */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "groom/document.h"
#include "server/worker/worker.h"

/* 200 000 strands with everything that a groom may hold are some 80 MB of JSON. */
#define MAX_DOCUMENT ((size_t)1 << 30)

static groom_status check(void *unused, struct worker_input *input, const struct groom_context *context,
                          struct groom_diag *diag)
{
    static const int output = STDOUT_FILENO;
    char *text = NULL, *canonical = NULL;
    size_t n = 0, n_canonical = 0;
    struct groom *groom = NULL;
    groom_status st = worker_input_text(input, MAX_DOCUMENT, &text, &n, diag);
    if (st == GROOM_OK)
        st = groom_document_read(text, n, NULL, context, &groom, diag);
    if (st == GROOM_OK)
        st = groom_document_write(groom, text, NULL, &canonical, &n_canonical, diag);
    if (st == GROOM_OK) {
        struct groom_sink sink = worker_fd_sink(&output);
        st = sink.write(sink.user, canonical, n_canonical);
    }
    groom_destroy(groom);
    free(text);
    free(canonical);
    return st;
}

int worker_check_groom(int argc, char **argv)
{
    if (argc == 1)
        return worker_run_sandboxed(check, NULL);
    fprintf(stderr, "groom-worker check-groom: takes no argument (\"%s\")\n", argv[1]);
    return WORKER_USAGE;
}
