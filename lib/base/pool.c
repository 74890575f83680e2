/* A small pthread pool. Pieces are handed out by an atomic counter; OpenMP would
 * show false races under ThreadSanitizer, and C11 threads crash there. pool_serial.c stands in
 * where there are no threads. */
#ifndef __wasm__
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/parallel.h"

struct loop {
    parallel_body *body;
    void *user;
    uint32_t n_pieces;
    atomic_uint next_piece;
};

struct groom_pool {
    uint32_t n_threads;       /* the caller counted */
    pthread_t *threads;       /* [n_threads - 1] */
    uint32_t n_started;

    pthread_mutex_t turn;     /* held by the thread whose loop runs */
    pthread_mutex_t lock;     /* guards what follows */
    pthread_cond_t wake, done;
    struct loop *loop;        /* the running one, or NULL */
    uint64_t generation;      /* counts loops, so that a worker takes part once in each */
    uint32_t n_busy;          /* workers inside the loop */
    int stopping;
};

/* Set in a thread that is inside a loop: a loop started there runs in place. */
static _Thread_local int inside_loop;

static void run_pieces(struct loop *loop, uint32_t thread)
{
    inside_loop = 1;
    for (;;) {
        uint32_t piece = atomic_fetch_add_explicit(&loop->next_piece, 1, memory_order_relaxed);
        if (piece >= loop->n_pieces)
            break;
        loop->body(loop->user, piece, thread);
    }
    inside_loop = 0;
}

struct worker_start {
    struct groom_pool *pool;
    uint32_t thread;
};

static void *worker_main(void *argument)
{
    struct worker_start start = *(struct worker_start *)argument;
    struct groom_pool *pool = start.pool;
    uint64_t seen = 0;
    free(argument);

    pthread_mutex_lock(&pool->lock);
    for (;;) {
        while (!pool->stopping && (!pool->loop || pool->generation == seen))
            pthread_cond_wait(&pool->wake, &pool->lock);
        if (pool->stopping)
            break;
        seen = pool->generation;
        struct loop *loop = pool->loop;
        pool->n_busy++;
        pthread_mutex_unlock(&pool->lock);
        run_pieces(loop, start.thread);
        pthread_mutex_lock(&pool->lock);
        if (--pool->n_busy == 0)
            pthread_cond_signal(&pool->done);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

static int start_worker(struct groom_pool *pool, uint32_t thread)
{
    struct worker_start *start = malloc(sizeof *start);
    if (!start)
        return -1;
    *start = (struct worker_start){pool, thread};
    if (pthread_create(&pool->threads[pool->n_started], NULL, worker_main, start) != 0) {
        free(start);
        return -1;
    }
    pool->n_started++;
    return 0;
}

groom_status groom_pool_create(uint32_t n_threads, struct groom_pool **out)
{
    struct groom_pool *pool = calloc(1, sizeof *pool);
    if (!pool)
        return GROOM_ENOMEM;
    if (n_threads == 0) {
        long n = sysconf(_SC_NPROCESSORS_ONLN);
        n_threads = n > 0 ? (uint32_t)n : 1;
    }
    pool->n_threads = n_threads;
    pthread_mutex_init(&pool->turn, NULL);
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->wake, NULL);
    pthread_cond_init(&pool->done, NULL);
    pool->threads = calloc(n_threads, sizeof *pool->threads);
    if (!pool->threads)
        goto fail;
    for (uint32_t i = 1; i < n_threads; i++)
        if (start_worker(pool, i) != 0)
            goto fail;
    *out = pool;
    return GROOM_OK;
fail:
    groom_pool_destroy(pool);
    return GROOM_ENOMEM;
}

void groom_pool_destroy(struct groom_pool *pool)
{
    if (!pool)
        return;
    pthread_mutex_lock(&pool->lock);
    pool->stopping = 1;
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->lock);
    for (uint32_t i = 0; i < pool->n_started; i++)
        pthread_join(pool->threads[i], NULL);
    pthread_cond_destroy(&pool->done);
    pthread_cond_destroy(&pool->wake);
    pthread_mutex_destroy(&pool->lock);
    pthread_mutex_destroy(&pool->turn);
    free(pool->threads);
    free(pool);
}

uint32_t groom_pool_threads(const struct groom_pool *pool) { return pool ? pool->n_threads : 1; }

static struct groom_pool *pool_of(const struct groom_context *context)
{
    return context ? context->pool : NULL;
}

uint32_t parallel_threads(const struct groom_context *context)
{
    return inside_loop ? 1 : groom_pool_threads(pool_of(context));
}

static void run_in_place(uint32_t n_pieces, parallel_body *body, void *user)
{
    for (uint32_t piece = 0; piece < n_pieces; piece++)
        body(user, piece, 0);
}

static void run_in_pool(struct groom_pool *pool, struct loop *loop)
{
    pthread_mutex_lock(&pool->turn);
    pthread_mutex_lock(&pool->lock);
    pool->loop = loop;
    pool->generation++;
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->lock);

    run_pieces(loop, 0);

    pthread_mutex_lock(&pool->lock);
    pool->loop = NULL; /* a worker that wakes only now finds nothing to join */
    while (pool->n_busy > 0)
        pthread_cond_wait(&pool->done, &pool->lock);
    pthread_mutex_unlock(&pool->lock);
    pthread_mutex_unlock(&pool->turn);
}

void parallel_for(const struct groom_context *context, uint32_t n_pieces, parallel_body *body, void *user)
{
    struct groom_pool *pool = pool_of(context);
    if (inside_loop || n_pieces < 2 || groom_pool_threads(pool) < 2) {
        run_in_place(n_pieces, body, user);
        return;
    }
    struct loop loop = {.body = body, .user = user, .n_pieces = n_pieces};
    atomic_init(&loop.next_piece, 0);
    run_in_pool(pool, &loop);
}

void parallel_once(struct parallel_once *once, void (*fill)(void))
{
    static pthread_mutex_t filling = PTHREAD_MUTEX_INITIALIZER;
    if (atomic_load_explicit(&once->filled, memory_order_acquire))
        return;
    pthread_mutex_lock(&filling);
    if (!atomic_load_explicit(&once->filled, memory_order_relaxed))
        fill();
    atomic_store_explicit(&once->filled, 1, memory_order_release);
    pthread_mutex_unlock(&filling);
}
#endif
