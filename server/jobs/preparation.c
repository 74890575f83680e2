#include "server/jobs/preparation.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "server/jobs/inputs.h"
#include "server/jobs/queue.h"
#include "server/jobs/work.h"

struct name {
    char key[STORE_HASH_SIZE];
    char subject[STORE_ID_SIZE]; /* the strands or the groom; "" where nothing is kept */
};

static void copy_member(cJSON *to, const cJSON *from, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(from, name);
    if (item)
        cJSON_AddItemToObject(to, name, cJSON_Duplicate(item, true));
}

/* The guides of a procedural groom are few: they are worked out anew. */
static const char *subject_of(const struct store_job *job, const cJSON *request)
{
    const cJSON *dense = cJSON_GetObjectItemCaseSensitive(request, "dense");
    if (strcmp(job->kind, "retarget") != 0)
        return NULL;
    return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(request, cJSON_IsTrue(dense) ? "groom" : "strands"));
}

static groom_status find_name(const struct store_job *job, struct name *name)
{
    static const char *const of_request[] = {"strands", "groom", "revision", "dense", "source"};
    static const char *const of_options[] = {"neighbours", "guides", "sigma_bone", "mode", "seed"};
    cJSON *request = cJSON_Parse(job->request), *options = cJSON_Parse(job->options), *all = cJSON_CreateObject();
    const char *subject = subject_of(job, request);
    *name = (struct name){0};
    for (size_t i = 0; i < sizeof of_request / sizeof of_request[0]; i++)
        copy_member(all, request, of_request[i]);
    for (size_t i = 0; i < sizeof of_options / sizeof of_options[0]; i++)
        copy_member(all, options, of_options[i]);
    char *text = cJSON_PrintUnformatted(all);
    if (text && subject) {
        work_hash(text, strlen(text), name->key);
        strncpy(name->subject, subject, sizeof name->subject - 1);
    }
    bool out_of_memory = !text;
    cJSON_free(text);
    cJSON_Delete(all);
    cJSON_Delete(options);
    cJSON_Delete(request);
    return out_of_memory ? GROOM_ENOMEM : GROOM_OK;
}

groom_status preparation_describe(struct jobs *jobs, const struct store_job *job, cJSON *object, struct groom_diag *diag)
{
    struct name name;
    struct store_preparation found;
    groom_status status = find_name(job, &name);
    if (status != GROOM_OK || !name.subject[0])
        return status;
    if ((status = store_preparation_get(jobs->store, name.key, &found, diag)) == GROOM_ENOTFOUND)
        return cJSON_AddNullToObject(object, "preparation") ? GROOM_OK : GROOM_ENOMEM;
    if (status != GROOM_OK)
        return status;
    cJSON *item = cJSON_AddObjectToObject(object, "preparation");
    cJSON_AddStringToObject(item, "sha256", found.sha256);
    cJSON_AddNumberToObject(item, "bytes", (double)found.n_bytes);
    inputs_add_path(jobs, item, found.sha256);
    return GROOM_OK;
}

groom_status preparation_is(struct jobs *jobs, const struct store_job *job, const char *sha256, bool *is,
                            struct groom_diag *diag)
{
    struct name name;
    struct store_preparation found;
    groom_status status = find_name(job, &name);
    if (status == GROOM_OK && name.subject[0])
        status = store_preparation_get(jobs->store, name.key, &found, diag);
    if (status == GROOM_OK && name.subject[0])
        *is = strcmp(found.sha256, sha256) == 0;
    return status == GROOM_ENOTFOUND ? GROOM_OK : status;
}

groom_status preparation_keep(struct jobs *jobs, const struct store_attempt_ref *ref, const struct store_job *job,
                              const char *sha256, uint64_t n_bytes, struct groom_diag *diag)
{
    struct name name;
    struct store_preparation made = {.n_bytes = n_bytes};
    groom_status status = find_name(job, &name);
    if (status == GROOM_OK && !name.subject[0])
        status = groom_fail(diag, GROOM_EINVAL, "a job of kind %.20s prepares nothing for others", job->kind);
    if (status != GROOM_OK)
        return status;
    strncpy(made.sha256, sha256, sizeof made.sha256 - 1);
    return store_attempt_preparation(jobs->store, ref, name.key, name.subject, &made, diag);
}
