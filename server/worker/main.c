/* groom-worker: see worker.h. */
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "server/worker/worker.h"

static const struct command {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *help;
} commands[] = {
    {"inspect", worker_inspect,
     "--kind strands|head [--format F] [--unit U] [--up y|z] [--max-vertices N]\n"
     "                 a file on standard input; what it holds, as JSON, on standard output"},
    {"convert", worker_convert,
     "[--from-format F] [--from-unit U] [--from-up y|z] --to-format F [--unit U] [--up y|z]\n"
     "                 [--vertices M] [--count N]   strands on standard input, another file on standard output"},
    {"convert-head", worker_convert_head,
     "[--format F] [--unit U] [--up y|z]\n"
     "                 a head on standard input; what was understood of it, as OBJ in metres, on standard output"},
    {"check-groom", worker_check_groom, "a groom document on standard input; its canonical form on standard output"},
    {"render", worker_render,
     "[--unit U] [--up y|z] [--head FILE] [--head-unit U] [--head-up y|z] [--view V] [--size N]\n"
     "                 [--format F] [--framed-as FILE] [--framed-format F] [--framed-unit U] [--framed-up y|z]\n"
     "                 strands on standard input; a picture of them, as PNG, on standard output"},
    {"compare", worker_compare,
     "--target FILE [--target-format F] [--target-unit U] [--target-up y|z] [--head FILE] [--head-unit U] [--head-up y|z]\n"
     "                 [--drawn FILE] [--format F] [--unit U] [--up y|z]   strands on standard input; how alike they are to the\n"
     "                 target's, as JSON, on standard output. --drawn: the same groom's before stage randoms"},
    {"hairline", worker_hairline,
     "--source FILE [--source-unit U] [--source-up y|z] --target FILE [--target-unit U] [--target-up y|z]\n"
     "                 [--asked JSON] [--points N] [--format F] [--unit U] [--up y|z]   strands on standard input; their\n"
     "                 front hairline as it is carried from the source's head to the target, as JSON"},
    {"attempt", worker_attempt,
     "[--watched] one attempt of a job, as GROOM_WORK_URL and GROOM_WORK_TOKEN name it; watched by a second\n"
     "                 process that tells the daemon how it died, where the launcher cannot"},
};
enum { N_COMMANDS = sizeof commands / sizeof commands[0] };

static int usage(FILE *out, int status)
{
    fputs("usage: groom-worker COMMAND ...    (groomd starts it; people use groomctl)\n", out);
    for (int i = 0; i < N_COMMANDS; i++) fprintf(out, "  %-12s   %s\n", commands[i].name, commands[i].help);
    fputs("exit status: 0 done, 1 refused or failed (with a problem document), 2 wrong usage\n", out);
    return status;
}

int main(int argc, char **argv)
{
    signal(SIGPIPE, SIG_IGN);
    if (argc >= 2 && !strcmp(argv[1], "--help")) return usage(stdout, WORKER_OK);
    for (int i = 0; i < N_COMMANDS && argc >= 2; i++)
        if (!strcmp(argv[1], commands[i].name)) return commands[i].run(argc - 1, argv + 1);
    if (argc >= 2) fprintf(stderr, "groom-worker: there is no command \"%s\"\n", argv[1]);
    return usage(stderr, WORKER_USAGE);
}
