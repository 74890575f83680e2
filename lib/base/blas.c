#include "base/blas.h"

#include <cblas.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/mman.h>

#include "base/parallel.h"

/* OpenBLAS's own, without a header: a work space for one product, which it keeps for later ones. Not there in
 * another BLAS, which then does as it does. */
__attribute__((weak)) void *blas_memory_alloc(int unused);
__attribute__((weak)) void blas_memory_free(void *space);

#define SPACE_BYTES ((size_t)129 << 20) /* of one, on every x86-64, and what is rounded up */
#define MAX_SPACES  256                 /* more than that are its own affair: it has a table of so many */

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static uint32_t n_reserved; /* work spaces that it has taken */

/* Is there room for one? Address space alone: none of it is touched before a product is. */
static bool has_room(void)
{
    void *space = mmap(NULL, SPACE_BYTES, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (space == MAP_FAILED)
        return false;
    munmap(space, SPACE_BYTES);
    return true;
}

/* All at once, so that they are different ones; then given back, for products to find. */
static bool reserve(uint32_t n)
{
    void *space[MAX_SPACES];
    uint32_t taken = 0;
    while (taken < n && (taken < n_reserved || has_room()))
        space[taken++] = blas_memory_alloc(0);
    for (uint32_t i = 0; i < taken; i++)
        blas_memory_free(space[i]);
    if (taken > n_reserved)
        n_reserved = taken;
    return taken == n;
}

groom_status blas_prepare(const struct groom_context *context, struct groom_diag *diag)
{
    uint32_t n = parallel_threads(context);
    bool done = true;
    if (n > MAX_SPACES)
        n = MAX_SPACES;
    pthread_mutex_lock(&lock);
    if (n > n_reserved) {
        openblas_set_num_threads(1);
        done = !blas_memory_alloc || !blas_memory_free || reserve(n);
    }
    pthread_mutex_unlock(&lock);
    return done ? GROOM_OK
                : groom_fail(diag, GROOM_ENOMEM, "no memory for matrix products: each of %u threads takes 128 MiB of address space", n);
}
