/* OpenBLAS, one thread: our own pool cuts the work into fixed pieces, so that the pieces, and with
 * them the bits, do not depend on the machine's number of processors. */
#ifndef BASE_BLAS_H
#define BASE_BLAS_H

/* Before the first product. Sets OpenBLAS's threads to 1 for the whole process. */
void blas_prepare(void);

#endif
