/* How fast 120 MB become an acknowledged, synced blob, and what a commit of the store costs. The
 * folder is build/bench-data (or $GROOM_BENCH_FOLDER), so that it is on the disk that is built on. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "server/blobs/blobs.h"
#include "server/store/store.h"

#define N_BYTES (120u * 1000 * 1000)
#define CHUNK (128u << 10) /* as HTTP hands them over */

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static groom_status nobody(void *user, const char *sha256, bool *referenced)
{
    (void)user, (void)sha256;
    *referenced = false;
    return GROOM_OK;
}

static groom_status write_one(struct blobs *blobs, const char *bytes, uint64_t n_expected, double *took)
{
    struct blobs_writer *writer;
    char sha256[BLOBS_HASH_SIZE];
    double start = seconds();
    groom_status status = blobs_begin(blobs, n_expected, &writer, NULL);
    if (status != GROOM_OK)
        return status;
    for (size_t at = 0; at < N_BYTES; at += CHUNK) {
        size_t n = N_BYTES - at < CHUNK ? N_BYTES - at : CHUNK;
        if ((status = blobs_write(writer, bytes + at, n, NULL)) != GROOM_OK) {
            blobs_abort(writer);
            return status;
        }
    }
    status = blobs_commit(writer, NULL, sha256, NULL);
    *took = seconds() - start;
    if (status != GROOM_OK)
        return status;
    blobs_unpin(blobs, sha256);
    return blobs_collect(blobs, sha256, nobody, NULL, NULL, NULL);
}

static groom_status bench_blobs(const char *folder)
{
    char path[512];
    struct blobs *blobs;
    double best = 1e9;
    char *bytes = malloc(N_BYTES);
    snprintf(path, sizeof path, "%s/blobs", folder);
    groom_status status = bytes ? blobs_open(path, NULL, &blobs, NULL) : GROOM_ENOMEM;
    if (status != GROOM_OK) {
        free(bytes);
        return status;
    }
    for (size_t i = 0; i < N_BYTES; i++)
        bytes[i] = (char)(i * 2654435761u >> 24);
    for (int i = 0; status == GROOM_OK && i < 5; i++) {
        double took = 1e9;
        status = write_one(blobs, bytes, N_BYTES, &took);
        best = took < best ? took : best;
    }
    if (status == GROOM_OK)
        printf("figure blob_write_mb_per_s %.0f MB/s hashed, synced and named, 120 MB, best of 5\n",
               N_BYTES / 1e6 / best);
    blobs_close(blobs);
    free(bytes);
    return status;
}

static groom_status bench_store(const char *folder)
{
    char path[512], id[STORE_ID_SIZE];
    struct store *store;
    const int n = 500;
    snprintf(path, sizeof path, "%s/bench.db", folder);
    remove(path);
    groom_status status = store_open(path, &store, NULL);
    if (status != GROOM_OK)
        return status;
    double start = seconds();
    for (int i = 0; status == GROOM_OK && i < n; i++) {
        struct store_job_new job = {.id = id, .kind = "fit", .request = "{}", .options = "{}"};
        if ((status = store_make_id("job_", id)) == GROOM_OK)
            status = store_job_create(store, &job, NULL);
    }
    printf("figure job_commits_per_s %.0f 1/s durable job creations, one thread\n", n / (seconds() - start));
    store_close(store);
    return status;
}

int main(void)
{
    const char *folder = getenv("GROOM_BENCH_FOLDER");
    if (!folder)
        folder = "build/bench-data";
    mkdir(folder, 0755);
    groom_status status = bench_blobs(folder);
    if (status == GROOM_OK)
        status = bench_store(folder);
    if (status != GROOM_OK)
        fprintf(stderr, "bench_blobs: %s\n", groom_status_name(status));
    return status == GROOM_OK ? 0 : 1;
}
