#include "server/jobs/size.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "server/jobs/queue.h"

/* Measured with groomctl sample and quality standard (deploy/README.md has the table). */
#define BASE_BYTES       ((uint64_t)512 << 20)
#define BYTES_PER_VERTEX 400
#define BASE_S           600
#define VERTICES_PER_S   2000 /* of one thread */
#define VERTICES_PER_THREAD 250000
#define MAX_THREADS      8

struct launch_size size_of_fit(uint64_t n_vertices, const char *quality)
{
    uint64_t threads = 1 + n_vertices / VERTICES_PER_THREAD;
    uint64_t effort = !strcmp(quality, "high") ? 4 : 1;
    if (threads > MAX_THREADS)
        threads = MAX_THREADS;
    return (struct launch_size){.threads = (uint32_t)threads,
                                .memory_bytes = BASE_BYTES + BYTES_PER_VERTEX * n_vertices,
                                .wall_s = BASE_S + effort * n_vertices / VERTICES_PER_S};
}

static const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

static double number(const cJSON *object, const char *name)
{
    const cJSON *item = member(object, name);
    return cJSON_IsNumber(item) && item->valuedouble > 0 ? item->valuedouble : 0;
}

static double vertices_of_upload(struct jobs *jobs, const char *id)
{
    struct store_asset asset = {0};
    if (store_asset_get(jobs->store, NULL, STORE_STRANDS, id, &asset, NULL) != GROOM_OK)
        return 0;
    cJSON *metadata = cJSON_Parse(asset.metadata);
    double n = number(metadata, "vertices");
    cJSON_Delete(metadata);
    store_asset_finish(&asset);
    return n;
}

/* As it is evaluated. */
static double vertices_of_groom(struct jobs *jobs, const char *id, uint32_t revision)
{
    struct store_revision row = {0};
    if (store_revision_get(jobs->store, id, revision, &row, NULL) != GROOM_OK)
        return 0;
    cJSON *document = cJSON_Parse(row.document);
    const cJSON *strands = member(document, "strands");
    double n = number(strands, "count") * number(strands, "vertices");
    cJSON_Delete(document);
    store_revision_finish(&row);
    return n;
}

static uint64_t count_vertices(struct jobs *jobs, const cJSON *request)
{
    const char *strands = cJSON_GetStringValue(member(request, "strands")),
               *groom = cJSON_GetStringValue(member(request, "groom"));
    if (strands)
        return (uint64_t)vertices_of_upload(jobs, strands);
    return groom ? (uint64_t)vertices_of_groom(jobs, groom, (uint32_t)number(request, "revision")) : 0;
}

struct launch_size size_of_job(struct jobs *jobs, const char *job_id)
{
    struct store_job job = {0};
    if (store_job_get(jobs->store, job_id, &job, NULL) != GROOM_OK)
        return size_of_fit(0, "");
    cJSON *request = cJSON_Parse(job.request), *options = cJSON_Parse(job.options);
    const char *quality = cJSON_GetStringValue(member(options, "quality"));
    struct launch_size size = size_of_fit(count_vertices(jobs, request), quality ? quality : "");
    cJSON_Delete(request);
    cJSON_Delete(options);
    store_job_finish(&job);
    return size;
}
