#include "groom/io.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* A plain decimal number: strtod alone would also take hexadecimal, "inf" and "nan". */
static int parse_positive(const char *text, double *value)
{
    char *end;
    if (!*text || strspn(text, "0123456789+-.eE") != strlen(text))
        return 0;
    *value = strtod(text, &end);
    return *end == '\0' && *value > 0 && isfinite(*value);
}

groom_status groom_unit_parse(const char *text, double *unit_m, struct groom_diag *diag)
{
    static const struct { const char *name; double unit_m; } units[] = {
        {"m", 1}, {"dm", 0.1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}};
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++)
        if (strcmp(text, units[i].name) == 0) {
            *unit_m = units[i].unit_m;
            return GROOM_OK;
        }
    double value;
    if (!parse_positive(text, &value))
        return groom_fail(diag, GROOM_EINVAL,
                          "\"%.40s\" is no unit; it may be m, cm, mm, dm, in or a positive number of metres", text);
    *unit_m = value;
    return GROOM_OK;
}

groom_status groom_up_parse(const char *text, groom_up *up, struct groom_diag *diag)
{
    if (strcmp(text, "y") != 0 && strcmp(text, "z") != 0)
        return groom_fail(diag, GROOM_EINVAL, "\"%.40s\" is no up axis; it may be y or z", text);
    *up = text[0] == 'y' ? GROOM_UP_Y : GROOM_UP_Z;
    return GROOM_OK;
}

void groom_frame_to_metres(struct groom_frame frame, const float in[3], float out[3])
{
    double s = frame.unit_m == 0.0 ? 1.0 : frame.unit_m;
    double x = in[0], y = in[1], z = in[2];
    out[0] = (float)(x * s);
    out[1] = (float)((frame.up == GROOM_UP_Z ? z : y) * s);
    out[2] = (float)((frame.up == GROOM_UP_Z ? -y : z) * s);
}

void groom_frame_from_metres(struct groom_frame frame, const float in[3], float out[3])
{
    double s = frame.unit_m == 0.0 ? 1.0 : frame.unit_m;
    double x = in[0], y = in[1], z = in[2];
    out[0] = (float)(x / s);
    out[1] = (float)((frame.up == GROOM_UP_Z ? -z : y) / s);
    out[2] = (float)((frame.up == GROOM_UP_Z ? y : z) / s);
}

static int64_t read_memory(void *user, void *buffer, size_t capacity)
{
    struct groom_memory_source *state = user;
    size_t left = state->n_bytes - state->at;
    size_t n = capacity < left ? capacity : left;
    if (n > 0)
        memcpy(buffer, state->bytes + state->at, n);
    state->at += n;
    return (int64_t)n;
}

struct groom_source groom_source_from_memory(struct groom_memory_source *state, const void *bytes, size_t n_bytes)
{
    *state = (struct groom_memory_source){.bytes = bytes, .n_bytes = n_bytes};
    return (struct groom_source){.read = read_memory, .user = state, .size = (int64_t)n_bytes};
}

/* The descriptor travels in the pointer, so that a source needs no cleanup. */
static int64_t read_fd(void *user, void *buffer, size_t capacity)
{
    for (;;) {
        ssize_t n = read((int)(intptr_t)user, buffer, capacity);
        if (n >= 0 || errno != EINTR)
            return n;
    }
}

/* Bytes from here to the end of a regular file, or -1. */
static int64_t bytes_left(int fd)
{
    struct stat info;
    off_t at = lseek(fd, 0, SEEK_CUR);
    if (at < 0 || fstat(fd, &info) != 0 || !S_ISREG(info.st_mode))
        return -1;
    return info.st_size > at ? info.st_size - at : 0;
}

struct groom_source groom_source_from_fd(int fd)
{
    return (struct groom_source){.read = read_fd, .user = (void *)(intptr_t)fd, .size = bytes_left(fd)};
}
