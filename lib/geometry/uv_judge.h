/* Whether the texture coordinates of a head serve as a chart of its scalp. */
#ifndef GEOMETRY_UV_JUDGE_H
#define GEOMETRY_UV_JUDGE_H

#include "groom/context.h"
#include "groom/diag.h"

enum uv_verdict { UV_SERVES, UV_TOO_FEW_ROOTS, UV_NO_AREA, UV_SEAM, UV_STACKED, UV_UNEVEN };

struct uv_judgement {
    enum uv_verdict verdict;
    double metres; /* of scalp for one unit of uv: the median over neighbours */
};

/* points, uvs  [n] places on the scalp and their texture coordinates, finite
 * returns      GROOM_OK, GROOM_ENOMEM */
GROOM_MUST_CHECK groom_status uv_judge(const float (*points)[3], const float (*uvs)[2], uint32_t n,
                                       const struct groom_context *context, struct uv_judgement *judgement,
                                       struct groom_diag *diag);

const char *uv_verdict_words(enum uv_verdict verdict);

#endif
