/* The rotation that fits pairs of vectors best (Horn 1987). */
#ifndef RETARGET_ROTATION_H
#define RETARGET_ROTATION_H

/* s[i][j] = sum of weight y_i x_j over pairs; r maximises sum weight y . r x. The identity for s = 0. */
void rotation_fit(const double s[3][3], double r[3][3]);

#endif
