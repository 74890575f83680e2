#include "server/http/follow.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <time.h>

#include "server/http/lane.h"

struct follower {
    struct task task; /* first */
    struct followers *followers;
    struct follower *next, **before;
    struct jobs_watch *watch;
    void (*act)(struct follower *, void *);
    void (*release)(void *);
    void *user;
    pthread_mutex_t acting;
    atomic_bool queued, ended;
    atomic_int references; /* the owner, and each time that it stands in the lane */
    atomic_llong due_ms;
};

struct followers {
    pthread_mutex_t lock;
    struct follower *first;
    struct jobs *jobs;
    struct lane *lane;
};

int64_t follow_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

struct followers *followers_create(struct jobs *jobs, struct lane *lane)
{
    struct followers *followers = calloc(1, sizeof *followers);
    if (!followers)
        return NULL;
    pthread_mutex_init(&followers->lock, NULL);
    followers->jobs = jobs;
    followers->lane = lane;
    return followers;
}

void followers_destroy(struct followers *followers)
{
    if (!followers)
        return;
    pthread_mutex_destroy(&followers->lock);
    free(followers);
}

static void poke_if(struct followers *followers, int64_t now)
{
    pthread_mutex_lock(&followers->lock);
    for (struct follower *follower = followers->first; follower; follower = follower->next)
        if (atomic_load(&follower->due_ms) <= now)
            follower_poke(follower);
    pthread_mutex_unlock(&followers->lock);
}

void followers_tick(struct followers *followers) { poke_if(followers, follow_now_ms()); }
void followers_wake(struct followers *followers) { poke_if(followers, INT64_MAX); }

static void let_go(struct follower *follower)
{
    if (atomic_fetch_sub(&follower->references, 1) != 1)
        return;
    if (follower->release)
        follower->release(follower->user);
    pthread_mutex_destroy(&follower->acting);
    free(follower);
}

static void run(struct task *task)
{
    struct follower *follower = (struct follower *)task;
    atomic_store(&follower->queued, false);
    pthread_mutex_lock(&follower->acting);
    if (!atomic_load(&follower->ended))
        follower->act(follower, follower->user);
    pthread_mutex_unlock(&follower->acting);
    let_go(follower);
}

void follower_poke(struct follower *follower)
{
    if (atomic_exchange(&follower->queued, true))
        return;
    atomic_fetch_add(&follower->references, 1);
    lane_continue(follower->followers->lane, &follower->task);
}

static void wake(void *user) { follower_poke(user); }

static void enlist(struct followers *followers, struct follower *follower)
{
    pthread_mutex_lock(&followers->lock);
    follower->next = followers->first;
    follower->before = &followers->first;
    if (follower->next)
        follower->next->before = &follower->next;
    followers->first = follower;
    pthread_mutex_unlock(&followers->lock);
}

static void unlist(struct followers *followers, struct follower *follower)
{
    pthread_mutex_lock(&followers->lock);
    *follower->before = follower->next;
    if (follower->next)
        follower->next->before = follower->before;
    pthread_mutex_unlock(&followers->lock);
}

groom_status follower_create(struct followers *followers, const char *job_id,
                             void (*act)(struct follower *, void *), void (*release)(void *), void *user,
                             struct follower **out)
{
    struct follower *follower = calloc(1, sizeof *follower);
    if (!follower)
        return GROOM_ENOMEM;
    follower->task.run = run;
    follower->followers = followers;
    follower->act = act;
    follower->release = release;
    follower->user = user;
    pthread_mutex_init(&follower->acting, NULL);
    atomic_store(&follower->references, 2); /* the owner's, and this function's own */
    atomic_store(&follower->due_ms, INT64_MAX);
    *out = follower;
    /* a waker may come at once: it waits here until the follower is whole */
    pthread_mutex_lock(&follower->acting);
    groom_status status = jobs_watch(followers->jobs, job_id, wake, follower, &follower->watch);
    if (status == GROOM_OK) {
        enlist(followers, follower);
        follower_poke(follower);
    }
    pthread_mutex_unlock(&follower->acting);
    if (status == GROOM_OK) {
        let_go(follower);
        return GROOM_OK;
    }
    *out = NULL;
    pthread_mutex_destroy(&follower->acting);
    free(follower);
    return status;
}

void follower_due(struct follower *follower, int64_t due_ms) { atomic_store(&follower->due_ms, due_ms); }

void follower_end(struct follower *follower)
{
    atomic_store(&follower->ended, true);
    unlist(follower->followers, follower);
    jobs_unwatch(follower->followers->jobs, follower->watch);
    let_go(follower);
}
