/* Arrays of NumPy for worked cases: version 1 or 2, row-major, and those in an archive that is not compressed. */
#ifndef SUPPORT_NPY_H
#define SUPPORT_NPY_H

#include <stddef.h>

struct npy_array {
    size_t n;       /* numbers */
    double *values; /* of floats and whole numbers of any size; free() it */
};

/* Fail the test where the file or the entry is missing. */
struct npy_array test_npy(const char *path);
struct npy_array test_npz(const char *path, const char *entry); /* "bone.npy" */

#endif
