#include "server/jobs/stage_clock.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define MAX_TIMES 64 /* stages of all kinds of jobs; names beyond are counted as "other" */

const struct histogram_bounds stage_clock_bounds = {
    14, {0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60, 120, 300, 600, 1800, 3600}};

/* A job whose attempt is in a stage. */
struct running {
    char job_id[STORE_ID_SIZE];
    uint32_t attempt;
    struct stage_times *times; /* of its stage */
    int64_t since_us;
    struct running *next;
};

struct stage_clock {
    pthread_mutex_t lock;
    struct running *running;
    struct stage_times times[MAX_TIMES + 1];
    size_t n_times;
};

static int64_t now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

struct stage_clock *stage_clock_create(void)
{
    struct stage_clock *clock = calloc(1, sizeof *clock);
    if (clock)
        pthread_mutex_init(&clock->lock, NULL);
    return clock;
}

void stage_clock_destroy(struct stage_clock *clock)
{
    if (!clock)
        return;
    while (clock->running) {
        struct running *next = clock->running->next;
        free(clock->running);
        clock->running = next;
    }
    pthread_mutex_destroy(&clock->lock);
    free(clock);
}

/* --- with the lock held ------------------------------------------------------------------ */

static struct stage_times *times_of(struct stage_clock *clock, const char *kind, const char *stage)
{
    for (size_t i = 0; i < clock->n_times; i++)
        if (!strcmp(clock->times[i].kind, kind) && !strcmp(clock->times[i].stage, stage))
            return &clock->times[i];
    if (clock->n_times == MAX_TIMES) {
        kind = "any";
        stage = "other";
    }
    if (clock->n_times > MAX_TIMES)
        return &clock->times[MAX_TIMES];
    struct stage_times *times = &clock->times[clock->n_times];
    snprintf(times->kind, sizeof times->kind, "%s", kind);
    snprintf(times->stage, sizeof times->stage, "%s", stage);
    clock->n_times++;
    return times;
}

static struct running **find(struct stage_clock *clock, const char *job_id)
{
    struct running **at = &clock->running;
    while (*at && strcmp((*at)->job_id, job_id) != 0)
        at = &(*at)->next;
    return at;
}

static void count(struct running *running)
{
    if (running->times)
        histogram_add(&running->times->histogram, &stage_clock_bounds, (double)(now_us() - running->since_us) * 1e-6);
}

/* --- what happens -------------------------------------------------------------------------- */

void stage_clock_enter(struct stage_clock *clock, const struct store_attempt_ref *ref, const char *kind, const char *stage)
{
    pthread_mutex_lock(&clock->lock);
    struct running *running = *find(clock, ref->job_id);
    struct stage_times *times = times_of(clock, kind, stage);
    if (!running && (running = calloc(1, sizeof *running))) { /* no memory: it is not counted */
        memcpy(running->job_id, ref->job_id, sizeof running->job_id);
        running->attempt = ref->number;
        running->since_us = now_us();
        running->next = clock->running;
        clock->running = running;
    }
    if (running && (running->times != times || running->attempt != ref->number)) {
        if (running->attempt == ref->number)
            count(running);
        running->attempt = ref->number;
        running->times = times;
        running->since_us = now_us();
    }
    pthread_mutex_unlock(&clock->lock);
}

void stage_clock_leave(struct stage_clock *clock, const char *job_id, bool done)
{
    pthread_mutex_lock(&clock->lock);
    struct running **at = find(clock, job_id), *running = *at;
    if (running) {
        if (done)
            count(running);
        *at = running->next;
        free(running);
    }
    pthread_mutex_unlock(&clock->lock);
}

const struct stage_times *stage_clock_times(struct stage_clock *clock, size_t index)
{
    pthread_mutex_lock(&clock->lock);
    const struct stage_times *times = index < clock->n_times ? &clock->times[index] : NULL;
    pthread_mutex_unlock(&clock->lock);
    return times;
}
