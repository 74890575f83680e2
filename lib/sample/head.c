/* A head of the project's own: an ellipsoid with a brow, a nose, a chin, ears and a neck,
 * star-shaped about its middle, so that "inside" and "push out" are one number a direction. */
#include <math.h>

#include "sample/parts.h"

#define PI 3.14159265358979323846
#define N_RINGS 72
#define N_SECTORS 112

const double sample_head_centre[3] = {0, 1.64, 0};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
}

static void normalize(double v[3])
{
    double length = sqrt(dot(v, v));
    for (int c = 0; c < 3; c++)
        v[c] /= length;
}

/* --- the shape ------------------------------------------------------------------- */

/* exp(-(angle to a feature)^2 / width^2), by the chord */
static double bump(const double direction[3], double x, double y, double z, double width)
{
    double feature[3] = {x, y, z};
    normalize(feature);
    return exp(-2 * (1 - dot(direction, feature)) / (width * width));
}

static double ellipsoid(const double d[3])
{
    /* the skull is longer than it is wide, and the jaw narrower than the skull */
    double jaw = d[1] < 0 ? 1 - 0.22 * d[1] * d[1] : 1;
    double a = 0.078 * jaw, b = d[1] > 0 ? 0.108 : 0.120, c = d[2] > 0 ? 0.094 : 0.102;
    double x = d[0] / a, y = d[1] / b, z = d[2] / c;
    return 1 / sqrt(x * x + y * y + z * z);
}

/* A cylinder downwards, a little to the back, ended by a plane; 0 above. */
static double neck(const double d[3])
{
    double back = d[2] - 0.25 * d[1], across = sqrt(d[0] * d[0] + back * back);
    if (d[1] > -0.2)
        return 0;
    double side = across > 1e-6 ? 0.056 / across : 1, end = 0.21 / -d[1];
    return side < end ? side : end;
}

static double smooth_maximum(double a, double b, double width)
{
    double h = (a - b) / width;
    return h > 30 ? a : h < -30 ? b : b + width * log1p(exp(h));
}

double sample_head_radius(const double d[3])
{
    double skull = ellipsoid(d);
    skull += 0.022 * bump(d, 0, -0.16, 1, 0.13);                                         /* nose */
    skull += 0.010 * bump(d, 0, -0.82, 0.72, 0.25);                                      /* chin */
    skull += 0.004 * bump(d, 0, 0.22, 1, 0.35);                                          /* brow */
    skull -= 0.006 * (bump(d, 0.33, 0.02, 1, 0.13) + bump(d, -0.33, 0.02, 1, 0.13));     /* eyes */
    skull += 0.010 * (bump(d, 1, -0.14, -0.08, 0.12) + bump(d, -1, -0.14, -0.08, 0.12)); /* ears */
    return smooth_maximum(skull, neck(d), 0.004);
}

void sample_head_normal(const double direction[3], double normal[3])
{
    double axis[3] = {fabs(direction[1]) >= 0.9, fabs(direction[1]) < 0.9, 0};
    double tangent[2][3], slope[2][3], h = 1e-4;
    cross(axis, direction, tangent[0]);
    normalize(tangent[0]);
    cross(direction, tangent[0], tangent[1]);
    for (int t = 0; t < 2; t++) {
        double ahead[3], behind[3];
        for (int c = 0; c < 3; c++) {
            ahead[c] = direction[c] + h * tangent[t][c];
            behind[c] = direction[c] - h * tangent[t][c];
        }
        normalize(ahead);
        normalize(behind);
        double r_ahead = sample_head_radius(ahead), r_behind = sample_head_radius(behind);
        for (int c = 0; c < 3; c++)
            slope[t][c] = r_ahead * ahead[c] - r_behind * behind[c];
    }
    cross(slope[0], slope[1], normal);
    normalize(normal);
}

/* --- the scalp --------------------------------------------------------------------- */

/* The hairline: elevation (radians) of the scalp's lower edge at an angle from the face, symmetric. */
static double hairline(double from_face)
{
    static const double at[] = {0, 40, 62, 80, 100, 118, 140, 180};
    static const double elevation[] = {47, 43, 30, 14, 12, -14, -24, -28};
    double degrees = from_face * 180 / PI;
    int i = 0;
    while (i < 6 && degrees > at[i + 1])
        i++;
    double t = (degrees - at[i]) / (at[i + 1] - at[i]);
    t = t * t * (3 - 2 * t);
    return (elevation[i] + t * (elevation[i + 1] - elevation[i])) * PI / 180;
}

int sample_head_is_scalp(const double d[3], double *height)
{
    double elevation = asin(d[1] < 1 ? d[1] : 1), edge = hairline(fabs(atan2(d[0], d[2])));
    if (height)
        *height = (elevation - edge) / (0.5 * PI - edge);
    return elevation > edge;
}

/* The R2 sequence (Roberts 2018): evenly spread in the unit square for any prefix; here in equal
 * areas of the sphere above -30 degrees, of which the scalp is a part. */
void sample_head_roots(uint32_t n, double offset, float (*roots)[3])
{
    const double plastic = 1.32471795724474602596;
    double step[2] = {1 / plastic, 1 / (plastic * plastic)};
    uint32_t found = 0;
    for (double i = 1; found < n; i++) {
        double u = fmod(0.5 + offset + i * step[0], 1), v = fmod(0.5 + 0.7 * offset + i * step[1], 1);
        double y = 1 - 1.5 * v, ring = sqrt(1 - y * y), angle = 2 * PI * u;
        double d[3] = {ring * sin(angle), y, ring * cos(angle)};
        if (!sample_head_is_scalp(d, NULL))
            continue;
        double radius = sample_head_radius(d);
        for (int c = 0; c < 3; c++)
            roots[found][c] = (float)(sample_head_centre[c] + radius * d[c]);
        found++;
    }
}

/* --- the mesh ------------------------------------------------------------------------ */

/* Rings around the vertical axis, from the crown (0) to the middle of the neck's end (N_RINGS). */
static uint32_t vertex_at(uint32_t ring, uint32_t sector)
{
    if (ring == 0)
        return 0;
    return ring == N_RINGS ? 1 + (N_RINGS - 1) * N_SECTORS : 1 + (ring - 1) * N_SECTORS + sector % N_SECTORS;
}

/* Texture coordinates are the azimuthal equidistant map about the crown: one chart, no seam. */
static void place_vertex(struct groom_mesh *head, uint32_t ring, uint32_t sector)
{
    double polar = PI * ring / N_RINGS, angle = 2 * PI * sector / N_SECTORS;
    double d[3] = {sin(polar) * sin(angle), cos(polar), sin(polar) * cos(angle)};
    double radius = sample_head_radius(d);
    uint32_t v = vertex_at(ring, sector);
    for (int c = 0; c < 3; c++)
        head->points[v][c] = (float)(sample_head_centre[c] + radius * d[c]);
    head->uvs[v][0] = (float)(0.5 + 0.5 * polar / PI * sin(angle));
    head->uvs[v][1] = (float)(0.5 - 0.5 * polar / PI * cos(angle));
}

static uint32_t put_triangle(struct groom_mesh *head, uint32_t at, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t corners[3] = {a, b, c};
    for (int i = 0; i < 3; i++)
        head->triangles[at][i] = head->uv_triangles[at][i] = corners[i];
    return at + 1;
}

static void place_triangles(struct groom_mesh *head)
{
    uint32_t at = 0;
    for (uint32_t r = 0; r < N_RINGS; r++)
        for (uint32_t s = 0; s < N_SECTORS; s++) {
            if (r + 1 < N_RINGS)
                at = put_triangle(head, at, vertex_at(r, s), vertex_at(r + 1, s), vertex_at(r + 1, s + 1));
            if (r > 0)
                at = put_triangle(head, at, vertex_at(r, s), vertex_at(r + 1, s + 1), vertex_at(r, s + 1));
        }
}

groom_status sample_head_create(const struct groom_context *context, struct groom_mesh **out,
                                struct groom_diag *diag)
{
    const uint32_t n_vertices = 2 + (N_RINGS - 1) * N_SECTORS, n_triangles = 2 * (N_RINGS - 1) * N_SECTORS;
    struct groom_mesh *head;
    groom_status st = groom_mesh_create(n_vertices, n_triangles, n_vertices, context, &head, diag);
    if (st != GROOM_OK)
        return st;
    for (uint32_t ring = 0; ring <= N_RINGS; ring++)
        for (uint32_t sector = 0; sector < N_SECTORS; sector++)
            place_vertex(head, ring, sector);
    place_triangles(head);
    *out = head;
    return GROOM_OK;
}
