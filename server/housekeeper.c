#include "server/housekeeper.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <time.h>

#include "server/jobs/jobs.h"
#include "server/log.h"
#include "server/store/store.h"

#define BATCH 100 /* rows of one transaction: others want to write, too */

struct housekeeper {
    struct housekeeper_options options;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool stopping;
};

static int64_t before(int64_t now_ms, uint64_t keep_s) { return keep_s ? now_ms - (int64_t)keep_s * 1000 : 0; }

static groom_status retire(const struct housekeeper_options *options, struct groom_diag *diag)
{
    int64_t now = store_now_ms();
    const struct store_retention retention = {.events_before_ms = before(now, options->keep_events_s),
                                              .keys_before_ms = now,
                                              .jobs_before_ms = before(now, options->keep_jobs_s),
                                              .preparations_before_ms = before(now, options->keep_preparations_s)};
    struct store_retired retired = {0};
    groom_status status;
    do
        status = store_retire(options->store, &retention, BATCH, &retired, diag);
    while (status == GROOM_OK &&
           (retired.n_jobs == BATCH || retired.n_event_streams == BATCH || retired.n_keys == BATCH ||
            retired.n_preparations == BATCH));
    return status;
}

groom_status housekeeper_round(const struct housekeeper_options *options, struct groom_diag *diag)
{
    uint64_t n_removed = 0;
    groom_status status = retire(options, diag);
    if (status == GROOM_OK)
        status = jobs_collect_blobs(options->jobs, &n_removed, diag);
    if (n_removed)
        log_message(CONFIG_LOG_INFO, "%llu blobs that nothing refers to have been removed",
                    (unsigned long long)n_removed);
    return status;
}

static bool wait_for_round(struct housekeeper *keeper)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_sec += keeper->options.round_s;
    pthread_mutex_lock(&keeper->lock);
    while (!keeper->stopping && pthread_cond_timedwait(&keeper->wake, &keeper->lock, &until) == 0)
        continue;
    bool go_on = !keeper->stopping;
    pthread_mutex_unlock(&keeper->lock);
    return go_on;
}

static void *keep_house(void *user)
{
    struct housekeeper *keeper = user;
    while (wait_for_round(keeper)) {
        struct groom_diag diag = {0};
        if (housekeeper_round(&keeper->options, &diag) != GROOM_OK)
            log_message(CONFIG_LOG_WARNING, "tidying up has failed and is tried again: %s", diag.detail);
    }
    return NULL;
}

groom_status housekeeper_start(const struct housekeeper_options *options, struct housekeeper **housekeeper,
                               struct groom_diag *diag)
{
    pthread_condattr_t monotonic;
    struct housekeeper *made = calloc(1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory to keep house");
    made->options = *options;
    if (!options->round_s)
        made->options.round_s = 300;
    pthread_mutex_init(&made->lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&made->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (pthread_create(&made->thread, NULL, keep_house, made) != 0) {
        pthread_cond_destroy(&made->wake);
        pthread_mutex_destroy(&made->lock);
        free(made);
        return groom_fail(diag, GROOM_ENOMEM, "no thread to keep house");
    }
    *housekeeper = made;
    return GROOM_OK;
}

void housekeeper_stop(struct housekeeper *housekeeper)
{
    if (!housekeeper)
        return;
    pthread_mutex_lock(&housekeeper->lock);
    housekeeper->stopping = true;
    pthread_cond_signal(&housekeeper->wake);
    pthread_mutex_unlock(&housekeeper->lock);
    pthread_join(housekeeper->thread, NULL);
    pthread_cond_destroy(&housekeeper->wake);
    pthread_mutex_destroy(&housekeeper->lock);
    free(housekeeper);
}
