/* groom-worker's commands for this room: strands and heads that were uploaded are parsed there alone. */
#ifndef GROOMS_TOOL_H
#define GROOMS_TOOL_H

#include "server/grooms/room.h"

/* A command line that owns its texts. */
struct tool_arguments {
    const char *argv[48];
    size_t n, n_text;
    char text[65536]; /* landmarks of a head are tens of kilobytes */
};
void tool_arguments_init(struct tool_arguments *arguments, const struct grooms *grooms, const char *command);
void tool_add(struct tool_arguments *arguments, const char *name, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* --head and its frame. A head that is not here (the groom came from elsewhere), or not in the project of
 * what is shown (of_id), is left out. */
void tool_add_head(struct tool_arguments *arguments, struct grooms *grooms, const char *of_id, const char *head_id);

/* The strands of a revision as a HAIR file without a name, in metres, read from its start. */
groom_status tool_strands_file(struct grooms *grooms, const char *groom_id, uint32_t revision, bool drawn, int *fd,
                               struct groom_diag *diag);

/* What the command prints (malloc'ed, zero-terminated).
 * complaint  "the picture could not be drawn", where it fails without a word of its own
 * returns    GROOM_OK, the status of the problem that it printed, GROOM_EINTERNAL */
groom_status tool_output(const struct tool_arguments *arguments, int stdin_fd, const char *complaint, char **output,
                         size_t *n_output, struct groom_diag *diag);

#endif
