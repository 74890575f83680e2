/* Where bytes come from and go to, and the frame that the numbers in a file stand in: what the
 * strand formats (groom/format.h), meshes (groom/mesh.h) and pictures (groom/render.h) share. */
#ifndef GROOM_IO_H
#define GROOM_IO_H

#include <stddef.h>
#include <stdint.h>

#include "groom/diag.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- units and axes ------------------------------------------------------ */

typedef enum groom_up { GROOM_UP_Y = 0, GROOM_UP_Z = 1 } groom_up;

/* The frame of a file: metres in one of its units, and its up axis. With z up,
 * (x, y, z) in the file is (x, z, -y) inside; writing undoes it. A unit_m of 0 means metres. */
struct groom_frame {
    double unit_m; /* 1 for metres, 0.01 for centimetres */
    groom_up up;
};

/* "m", "cm", "mm", "dm", "in" or a positive number of metres; "y" or "z". */
GROOM_MUST_CHECK groom_status groom_unit_parse(const char *text, double *unit_m, struct groom_diag *diag);
GROOM_MUST_CHECK groom_status groom_up_parse(const char *text, groom_up *up, struct groom_diag *diag);

/* One point of a file in metres, y up; and back. In place (in == out) is allowed. */
void groom_frame_to_metres(struct groom_frame frame, const float in[3], float out[3]);
void groom_frame_from_metres(struct groom_frame frame, const float in[3], float out[3]);

/* --- bytes ---------------------------------------------------------------- */

/* Where bytes come from. `read` returns how many bytes it put into buffer (up to capacity),
 * 0 at the end, -1 on failure; it may block. size is -1 where it is not known beforehand. */
struct groom_source {
    int64_t (*read)(void *user, void *buffer, size_t capacity);
    void *user;
    int64_t size;
};

struct groom_memory_source { const unsigned char *bytes; size_t n_bytes, at; };
/* A source over bytes that the caller keeps. */
struct groom_source groom_source_from_memory(struct groom_memory_source *state,
                                             const void *bytes, size_t n_bytes);
/* A source over an open file descriptor (read from where it stands; not closed). */
struct groom_source groom_source_from_fd(int fd);

/* Where bytes go: all n bytes or a failure (GROOM_EIO, GROOM_ENOSPC, GROOM_ECANCELLED). */
struct groom_sink {
    groom_status (*write)(void *user, const void *bytes, size_t n_bytes);
    void *user;
};

#ifdef __cplusplus
}
#endif
#endif
