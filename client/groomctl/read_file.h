/* Small files of the command line; "-" is standard input. */
#ifndef GROOMCTL_READ_FILE_H
#define GROOMCTL_READ_FILE_H

#include <cjson/cJSON.h>
#include <stddef.h>

/* The bytes with a zero behind them, malloc'ed; NULL after saying on standard error what failed. */
char *read_whole_file(const char *path, size_t *n_bytes);
/* The same as JSON. */
cJSON *read_json_file(const char *path);

#endif
