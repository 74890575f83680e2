#include "server/http/connections.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <time.h>

enum { HEAD, BODY, BUSY };

struct link {
    struct link *next, **before;
    int fd;
    atomic_int state;
    atomic_llong since_ms;
    atomic_ullong received;
    atomic_bool fresh; /* no request yet: there is no pause between requests to grant */
    bool gone;         /* the sweep's: its other side was seen to have ended */
};

struct connections {
    pthread_mutex_t lock;
    struct link *first;
    uint64_t n;
    const struct config *config;
};

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

struct connections *connections_create(const struct config *config)
{
    struct connections *connections = calloc(1, sizeof *connections);
    if (!connections)
        return NULL;
    pthread_mutex_init(&connections->lock, NULL);
    connections->config = config;
    return connections;
}

void connections_destroy(struct connections *connections)
{
    if (!connections)
        return;
    pthread_mutex_destroy(&connections->lock);
    free(connections);
}

static void enter(struct link *link, int state)
{
    atomic_store(&link->received, 0);
    atomic_store(&link->since_ms, now_ms());
    atomic_store(&link->state, state);
}

struct link *connections_open(struct connections *connections, int fd)
{
    struct link *link = calloc(1, sizeof *link);
    if (!link)
        return NULL;
    link->fd = fd;
    atomic_store(&link->fresh, true);
    enter(link, HEAD);
    pthread_mutex_lock(&connections->lock);
    link->next = connections->first;
    link->before = &connections->first;
    if (link->next)
        link->next->before = &link->next;
    connections->first = link;
    connections->n++;
    pthread_mutex_unlock(&connections->lock);
    return link;
}

void connections_close(struct connections *connections, struct link *link)
{
    pthread_mutex_lock(&connections->lock);
    *link->before = link->next;
    if (link->next)
        link->next->before = link->before;
    connections->n--;
    pthread_mutex_unlock(&connections->lock);
    free(link);
}

uint64_t connections_count(struct connections *connections)
{
    pthread_mutex_lock(&connections->lock);
    uint64_t n = connections->n;
    pthread_mutex_unlock(&connections->lock);
    return n;
}

void link_head(struct link *link) { enter(link, HEAD); }
void link_body(struct link *link) { enter(link, BODY); }
void link_received(struct link *link, uint64_t n_bytes) { atomic_fetch_add(&link->received, n_bytes); }

void link_busy(struct link *link)
{
    atomic_store(&link->fresh, false);
    enter(link, BUSY);
}

static int is_too_slow(const struct config *config, struct link *link, int64_t now)
{
    int64_t age = now - atomic_load(&link->since_ms), head = (int64_t)config->head_timeout_s * 1000;
    switch (atomic_load(&link->state)) {
    case HEAD:
        return age > head + (atomic_load(&link->fresh) ? 0 : (int64_t)config->idle_timeout_s * 1000);
    case BODY:
        return age > head && atomic_load(&link->received) < config->min_rate * (uint64_t)(age / 1000);
    default:
        return 0;
    }
}

/* The other side has ended in the middle of a body, and that twice in a row. libmicrohttpd 0.9.75 misses
 * it where the end came together with the last bytes (it takes a short read for an empty socket, and an
 * edge of epoll comes once): the request, and the upload that it holds, would wait for the idle timeout. */
static int has_ended(struct link *link)
{
    char byte;
    bool ended = atomic_load(&link->state) == BODY && recv(link->fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
    bool again = ended && link->gone;
    link->gone = ended;
    return again;
}

/* Shutting the socket makes libmicrohttpd see its end and close it in its own thread; the lock keeps
 * the descriptor from being another's by then. */
void connections_sweep(struct connections *connections)
{
    int64_t now = now_ms();
    pthread_mutex_lock(&connections->lock);
    for (struct link *link = connections->first; link; link = link->next)
        if (is_too_slow(connections->config, link, now) || has_ended(link))
            shutdown(link->fd, SHUT_RDWR);
    pthread_mutex_unlock(&connections->lock);
}
