/* Skeletons as JSON, and what makes one sound. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "groom/skeleton.h"
#include "retarget/fields.h"

/* --- soundness ----------------------------------------------------------------------------- */

static groom_status check_bone(const struct groom_skeleton *skeleton, uint32_t b, struct groom_diag *diag)
{
    const struct groom_bone *bone = &skeleton->bones[b];
    char pointer[32];
    double squared = 0;
    snprintf(pointer, sizeof pointer, "/bones/%u", b);
    if (bone->name[0] == 0 || strnlen(bone->name, sizeof bone->name) == sizeof bone->name)
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "a bone must have a name of 1 to 31 bytes");
    for (int c = 0; c < 3; c++) {
        if (!isfinite(bone->head[c]) || !isfinite(bone->tail[c]))
            return groom_fail_field(diag, GROOM_EINVAL, pointer, "the ends of bone \"%s\" are not finite", bone->name);
        squared += ((double)bone->tail[c] - bone->head[c]) * ((double)bone->tail[c] - bone->head[c]);
    }
    if (squared < (double)GROOM_BONE_MIN_LENGTH * GROOM_BONE_MIN_LENGTH)
        return groom_fail_field(diag, GROOM_EINVAL, pointer, "bone \"%s\" has no length: its head and tail must be %g m apart "
                                "at least", bone->name, (double)GROOM_BONE_MIN_LENGTH);
    for (uint32_t other = 0; other < b; other++)
        if (strcmp(bone->name, skeleton->bones[other].name) == 0)
            return groom_fail_field(diag, GROOM_EINVAL, pointer, "bones %u and %u are both named \"%s\"", other, b, bone->name);
    return GROOM_OK;
}

groom_status groom_skeleton_validate(const struct groom_skeleton *skeleton, struct groom_diag *diag)
{
    groom_status st = GROOM_OK;
    if (skeleton->n_bones == 0 || skeleton->n_bones > GROOM_SKELETON_MAX_BONES)
        return groom_fail_field(diag, GROOM_EINVAL, "/bones", "a skeleton must have 1 to %d bones", GROOM_SKELETON_MAX_BONES);
    for (uint32_t b = 0; b < skeleton->n_bones && st == GROOM_OK; b++)
        st = check_bone(skeleton, b, diag);
    return st;
}

/* --- reading --------------------------------------------------------------------------------- */

static groom_status parse_bone(const cJSON *json, uint32_t b, struct groom_bone *bone, struct groom_diag *diag)
{
    static const char *const names[] = {"name", "head", "tail"};
    char pointer[32], end[40];
    const cJSON *name = cJSON_GetObjectItemCaseSensitive(json, "name");
    snprintf(pointer, sizeof pointer, "/bones/%u", b);
    groom_status st = fields_known(json, names, 3, pointer, "a bone", diag);
    if (st != GROOM_OK)
        return st;
    snprintf(end, sizeof end, "%s/name", pointer);
    if (!cJSON_IsString(name) || !name->valuestring[0] || strlen(name->valuestring) >= sizeof bone->name)
        return groom_fail_field(diag, GROOM_EINVAL, end, "a bone must have a name of 1 to 31 bytes");
    strcpy(bone->name, name->valuestring);
    snprintf(end, sizeof end, "%s/head", pointer);
    st = fields_point(cJSON_GetObjectItemCaseSensitive(json, "head"), end, bone->head, diag);
    snprintf(end, sizeof end, "%s/tail", pointer);
    return st == GROOM_OK ? fields_point(cJSON_GetObjectItemCaseSensitive(json, "tail"), end, bone->tail, diag) : st;
}

static groom_status parse(const cJSON *json, struct groom_skeleton *skeleton, struct groom_diag *diag)
{
    static const char *const names[] = {"bones"};
    const cJSON *bones = cJSON_GetObjectItemCaseSensitive(json, "bones"), *bone;
    groom_status st = fields_known(json, names, 1, "", "a skeleton", diag);
    if (st != GROOM_OK)
        return st;
    if (!cJSON_IsArray(bones) || cJSON_GetArraySize(bones) > GROOM_SKELETON_MAX_BONES)
        return groom_fail_field(diag, GROOM_EINVAL, "/bones", "a skeleton must have a list of 1 to %d bones",
                                GROOM_SKELETON_MAX_BONES);
    cJSON_ArrayForEach(bone, bones) {
        st = parse_bone(bone, skeleton->n_bones, &skeleton->bones[skeleton->n_bones], diag);
        if (st != GROOM_OK)
            return st;
        skeleton->n_bones++;
    }
    return groom_skeleton_validate(skeleton, diag);
}

groom_status groom_skeleton_parse(const char *text, size_t n_bytes, struct groom_skeleton *out, struct groom_diag *diag)
{
    struct groom_skeleton skeleton = {0};
    cJSON *json;
    groom_status st = fields_object(text, n_bytes, "a skeleton", &json, diag);
    if (st != GROOM_OK)
        return st;
    st = parse(json, &skeleton, diag);
    cJSON_Delete(json);
    if (st == GROOM_OK)
        *out = skeleton;
    return st;
}

/* --- writing ---------------------------------------------------------------------------------- */

static cJSON *bone_json(const struct groom_bone *bone)
{
    cJSON *json = cJSON_CreateObject();
    if (json && cJSON_AddStringToObject(json, "name", bone->name) && fields_add(json, "head", fields_point_json(bone->head)) &&
        fields_add(json, "tail", fields_point_json(bone->tail)))
        return json;
    cJSON_Delete(json);
    return NULL;
}

groom_status groom_skeleton_print(const struct groom_skeleton *skeleton, char **out, struct groom_diag *diag)
{
    cJSON *json = cJSON_CreateObject(), *bones = cJSON_AddArrayToObject(json, "bones");
    int sound = bones != NULL;
    for (uint32_t b = 0; sound && b < skeleton->n_bones; b++)
        sound = fields_add(bones, NULL, bone_json(&skeleton->bones[b]));
    char *text = sound ? cJSON_PrintUnformatted(json) : NULL;
    cJSON_Delete(json);
    if (!text)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to print the skeleton");
    *out = text;
    return GROOM_OK;
}

/* --- two skeletons ------------------------------------------------------------------------------ */

static const struct groom_bone *bone_named(const struct groom_skeleton *skeleton, const char *name)
{
    for (uint32_t b = 0; b < skeleton->n_bones; b++)
        if (strcmp(skeleton->bones[b].name, name) == 0)
            return &skeleton->bones[b];
    return NULL;
}

groom_status groom_skeleton_match(const struct groom_skeleton *a, struct groom_skeleton *b, struct groom_diag *diag)
{
    struct groom_skeleton ordered = {.n_bones = a->n_bones};
    for (uint32_t i = 0; i < a->n_bones; i++) {
        const struct groom_bone *bone = bone_named(b, a->bones[i].name);
        if (!bone)
            return groom_fail_field(diag, GROOM_EINVAL, "/bones", "the target's skeleton has no bone \"%s\", which the source's "
                                    "has: both must name the same bones", a->bones[i].name);
        ordered.bones[i] = *bone;
    }
    for (uint32_t i = 0; i < b->n_bones; i++)
        if (!bone_named(a, b->bones[i].name))
            return groom_fail_field(diag, GROOM_EINVAL, "/bones", "the source's skeleton has no bone \"%s\", which the target's "
                                    "has: both must name the same bones", b->bones[i].name);
    *b = ordered;
    return GROOM_OK;
}
