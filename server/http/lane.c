#include "server/http/lane.h"

#include <pthread.h>
#include <stdlib.h>

struct lane {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    struct task *first, **last;
    size_t n_queued, max_queued, n_threads;
    bool ending;
    pthread_t threads[];
};

static void *work(void *user)
{
    struct lane *lane = user;
    pthread_mutex_lock(&lane->lock);
    for (;;) {
        struct task *task = lane->first;
        if (!task && lane->ending)
            break;
        if (!task) {
            pthread_cond_wait(&lane->changed, &lane->lock);
            continue;
        }
        if (!(lane->first = task->next))
            lane->last = &lane->first;
        lane->n_queued--;
        pthread_mutex_unlock(&lane->lock);
        task->run(task);
        pthread_mutex_lock(&lane->lock);
    }
    pthread_mutex_unlock(&lane->lock);
    return NULL;
}

groom_status lane_create(size_t n_threads, size_t max_queued, struct lane **out)
{
    struct lane *lane = calloc(1, sizeof *lane + n_threads * sizeof lane->threads[0]);
    if (!lane)
        return GROOM_ENOMEM;
    pthread_mutex_init(&lane->lock, NULL);
    pthread_cond_init(&lane->changed, NULL);
    lane->last = &lane->first;
    lane->max_queued = max_queued;
    for (; lane->n_threads < n_threads; lane->n_threads++)
        if (pthread_create(&lane->threads[lane->n_threads], NULL, work, lane)) {
            lane_destroy(lane);
            return GROOM_ENOMEM;
        }
    *out = lane;
    return GROOM_OK;
}

void lane_destroy(struct lane *lane)
{
    if (!lane)
        return;
    pthread_mutex_lock(&lane->lock);
    lane->ending = true;
    pthread_cond_broadcast(&lane->changed);
    pthread_mutex_unlock(&lane->lock);
    for (size_t i = 0; i < lane->n_threads; i++)
        pthread_join(lane->threads[i], NULL);
    pthread_mutex_destroy(&lane->lock);
    pthread_cond_destroy(&lane->changed);
    free(lane);
}

static bool submit(struct lane *lane, struct task *task, bool always)
{
    pthread_mutex_lock(&lane->lock);
    bool taken = always || lane->n_queued < lane->max_queued;
    if (taken) {
        task->next = NULL;
        *lane->last = task;
        lane->last = &task->next;
        lane->n_queued++;
        pthread_cond_signal(&lane->changed);
    }
    pthread_mutex_unlock(&lane->lock);
    return taken;
}

bool lane_submit(struct lane *lane, struct task *task) { return submit(lane, task, false); }
void lane_continue(struct lane *lane, struct task *task) { submit(lane, task, true); }

size_t lane_queued(struct lane *lane)
{
    pthread_mutex_lock(&lane->lock);
    size_t n = lane->n_queued;
    pthread_mutex_unlock(&lane->lock);
    return n;
}
