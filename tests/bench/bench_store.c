/* How long a look at a job takes while others write: progress as workers report it, and a groom whose
 * arrays are 16 MB. The folder is build/bench-data (or $GROOM_BENCH_FOLDER), on the disk that is built
 * on. */
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "server/store/store.h"

#define N_LOOKS    4000
#define ARRAY_SIZE (16u << 20)

static struct store *store;
static atomic_bool over;
static atomic_long n_writes;

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void *report_progress(void *user)
{
    const struct store_attempt_ref *ref = user;
    struct store_event_new event = {"progress", "{\"progress\":0.5}"};
    struct store_progress progress = {.progress = 0.5, .eta_s = 1, .events = &event, .n_events = 1};
    bool cancel;
    while (!atomic_load(&over) && store_attempt_progress(store, ref, &progress, &cancel, NULL) == GROOM_OK)
        atomic_fetch_add(&n_writes, 1);
    return NULL;
}

static void *write_grooms(void *user)
{
    char *bytes = calloc(1, ARRAY_SIZE);
    for (unsigned i = 0; bytes && !atomic_load(&over); i++) {
        char id[STORE_ID_SIZE];
        struct store_array array = {.bytes = bytes, .n_bytes = ARRAY_SIZE};
        struct store_revision_new revision = {.groom_id = id, .document = "{}", .arrays = &array, .n_arrays = 1};
        snprintf(array.sha256, sizeof array.sha256, "%064x", i);
        if (store_make_id("grm_", id) != GROOM_OK || store_groom_create(store, &revision, NULL) != GROOM_OK)
            break;
        usleep(100000);
    }
    free(bytes);
    return user;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static int look(const char *id)
{
    static double took[N_LOOKS];
    for (int i = 0; i < N_LOOKS; i++) {
        struct store_job job;
        double start = seconds();
        if (store_job_get(store, id, &job, NULL) != GROOM_OK)
            return 1;
        took[i] = seconds() - start;
        store_job_finish(&job);
        usleep(1000);
    }
    qsort(took, N_LOOKS, sizeof took[0], compare);
    printf("figure store_look_p50_us %.0f us look at a job while others write, median\n", took[N_LOOKS / 2] * 1e6);
    printf("figure store_look_p99_us %.0f us the same, 99th percentile\n", took[N_LOOKS * 99 / 100] * 1e6);
    printf("figure store_look_max_us %.0f us the same, longest\n", took[N_LOOKS - 1] * 1e6);
    return 0;
}

static int measure(void)
{
    struct store_job_new job = {.id = "job_bench", .kind = "fit", .request = "{}", .options = "{}"};
    struct store_attempt_ref ref;
    const char *id = job.id;
    bool taken;
    int64_t next;
    pthread_t reporter, writer;
    if (store_job_create(store, &job, NULL) != GROOM_OK ||
        store_job_take(store, "token", &ref, &taken, &next, NULL) != GROOM_OK || !taken)
        return 1;
    pthread_create(&reporter, NULL, report_progress, &ref);
    pthread_create(&writer, NULL, write_grooms, NULL);
    double start = seconds();
    int failed = look(id);
    double took = seconds() - start;
    atomic_store(&over, true);
    pthread_join(reporter, NULL);
    pthread_join(writer, NULL);
    printf("figure store_writes_per_second %.0f 1/s progress reports acknowledged meanwhile\n",
           (double)atomic_load(&n_writes) / took);
    return failed;
}

int main(void)
{
    const char *folder = getenv("GROOM_BENCH_FOLDER");
    char path[512], aside[540];
    folder = folder ? folder : "build/bench-data";
    mkdir("build", 0777);
    mkdir(folder, 0777);
    snprintf(path, sizeof path, "%s/store.%ld.db", folder, (long)getpid());
    if (store_open(path, &store, NULL) != GROOM_OK)
        return 1;
    int failed = measure();
    store_close(store);
    unlink(path);
    snprintf(aside, sizeof aside, "%s-wal", path);
    unlink(aside);
    return failed;
}
