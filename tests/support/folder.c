#include "tests/support/folder.h"

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "tests/support/test.h"

static char folder[256];
static size_t n_files;

const char *test_folder_make(void)
{
    const char *parent = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%.200s/groomd-test-XXXXXX", parent ? parent : "/tmp");
    ck_assert_msg(mkdtemp(folder) != NULL, "%s cannot be made", folder);
    return folder;
}

static int remove_one(const char *path, const struct stat *info, int type, struct FTW *at)
{
    (void)info, (void)type, (void)at;
    return remove(path);
}

void test_folder_remove(void)
{
    if (folder[0])
        nftw(folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
    folder[0] = 0;
}

const char *test_folder_path(const char *name)
{
    static char paths[8][512];
    static unsigned turn;
    char *path = paths[turn++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static int count_one(const char *path, const struct stat *info, int type, struct FTW *at)
{
    (void)path, (void)info, (void)at;
    n_files += type == FTW_F;
    return 0;
}

size_t test_folder_files(void)
{
    n_files = 0;
    nftw(folder, count_one, 16, FTW_PHYS);
    return n_files;
}
