/* A folder of a test's own, gone with it. */
#ifndef SUPPORT_FOLDER_H
#define SUPPORT_FOLDER_H

#include <stddef.h>

/* Make an empty folder under $TMPDIR or /tmp; its path is static, valid until the next call. Fails the
 * test where it cannot. */
const char *test_folder_make(void);
/* Remove it with all that is in it. */
void test_folder_remove(void);
/* "<folder>/<name>", in one of a few static places that take turns. */
const char *test_folder_path(const char *name);
/* Files in it and in all folders below. */
size_t test_folder_files(void);

#endif
