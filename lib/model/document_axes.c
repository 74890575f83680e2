/* The axes that a groom's operators lean on, as three rows of three numbers; a groom that leans on those of space has
 * none in its document. What rows may be is groom_validate's to say. */
#include <stdio.h>

#include "model/document_node.h"

static groom_status refuse(struct groom_diag *diag)
{
    return groom_fail_field(diag, GROOM_EINVAL, "/axes",
                            "axes are three rows of three numbers, [[x,y,z],[x,y,z],[x,y,z]]; leave them out for those of space");
}

static int read_row(const cJSON *row, float out[3])
{
    int c = 0;
    const cJSON *number;
    if (!cJSON_IsArray(row) || cJSON_GetArraySize(row) != 3)
        return 0;
    cJSON_ArrayForEach(number, row)
    {
        if (!cJSON_IsNumber(number))
            return 0;
        out[c++] = (float)number->valuedouble;
    }
    return 1;
}

groom_status document_axes_read(const cJSON *root, struct groom *groom, struct groom_diag *diag)
{
    const cJSON *axes = cJSON_GetObjectItemCaseSensitive(root, "axes"), *row;
    int i = 0;
    if (!axes || cJSON_IsNull(axes))
        return GROOM_OK;
    if (!cJSON_IsArray(axes) || cJSON_GetArraySize(axes) != 3)
        return refuse(diag);
    cJSON_ArrayForEach(row, axes)
    {
        if (!read_row(row, groom->axes[i++]))
            return refuse(diag);
    }
    return GROOM_OK;
}

groom_status document_axes_write(const float axes[3][3], cJSON *root)
{
    char text[128];
    cJSON *rows = cJSON_AddArrayToObject(root, "axes");
    for (int i = 0; rows && i < 3; i++) {
        snprintf(text, sizeof text, "[%.9g,%.9g,%.9g]", (double)axes[i][0], (double)axes[i][1], (double)axes[i][2]);
        cJSON *row = cJSON_CreateRaw(text);
        if (!cJSON_AddItemToArray(rows, row)) {
            cJSON_Delete(row);
            return GROOM_ENOMEM;
        }
    }
    return rows ? GROOM_OK : GROOM_ENOMEM;
}
