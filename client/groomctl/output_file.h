/* Files that are whole or not there: written under a temporary name beside, then renamed. */
#ifndef GROOMCTL_OUTPUT_FILE_H
#define GROOMCTL_OUTPUT_FILE_H

#include <stddef.h>
#include <stdint.h>

#include "groom/io.h"

struct output_file {
    int fd;
    int is_stdout;          /* the path was "-" */
    uint64_t n_bytes;       /* written */
    char path[4096], temporary[4096 + 16];
    char failure[160];      /* what the system said, or "" */
};

/* All return 1, or 0 after saying on standard error what failed. */
int output_file_open(struct output_file *file, const char *path);
int output_file_write(struct output_file *file, const void *bytes, size_t n); /* says nothing */
int output_file_commit(struct output_file *file);
/* Takes one that is not open. Nothing stays. */
void output_file_abort(struct output_file *file);
/* Forget what was written so far. */
void output_file_restart(struct output_file *file);

/* Whether the path's folder can be written to; says so where not. For before long work. */
int output_file_check(const char *path);

struct groom_sink output_file_sink(struct output_file *file);
/* The whole of it. */
int output_file_save(const char *path, const void *bytes, size_t n);

#endif
