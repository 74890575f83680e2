#include "server/http/events.h"

#include <microhttpd.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/server.h"

#define HEARTBEAT_MS 15000
#define BATCH        256

struct text {
    char *bytes;
    size_t n, capacity;
};

/* Two sides meet here: act (in a lane) reads events into `next` and hands them over under `lock`; the
 * reader (an HTTP thread) takes them from `text`. */
struct event_feed {
    pthread_mutex_t lock;
    struct text text; /* what is being sent, */
    size_t at;        /* up to here */
    bool suspended, more, done;
    /* act's alone */
    struct text next;
    int64_t after; /* sequence of the last event that was read */
    bool was_end;
    /* fixed */
    struct follower *follower;
    struct MHD_Connection *connection; /* touched by act only while it is suspended, and so is there */
    const struct service *service;
    struct server *server;
    char job_id[STORE_ID_SIZE];
};

/* --- filling ------------------------------------------------------------------------- */

static bool put(struct text *text, const char *bytes, size_t n)
{
    if (text->n + n > text->capacity) {
        size_t capacity = 2 * (text->n + n) + 1024;
        char *larger = realloc(text->bytes, capacity);
        if (!larger)
            return false;
        text->bytes = larger;
        text->capacity = capacity;
    }
    memcpy(text->bytes + text->n, bytes, n);
    text->n += n;
    return true;
}

static bool put_event(struct text *text, const struct store_event *event)
{
    char head[96];
    int n = snprintf(head, sizeof head, "id: %lld\nevent: %.40s\ndata: ", (long long)event->sequence,
                     event->type);
    return put(text, head, (size_t)n) && put(text, event->data, strcspn(event->data, "\r\n")) &&
           put(text, "\n\n", 2);
}

static bool job_is_over(const struct event_feed *feed)
{
    struct store_job job = {0};
    if (jobs_get(feed->service->jobs, feed->job_id, &job, NULL) != GROOM_OK)
        return true;
    bool over = store_job_state_is_end(job.state);
    store_job_finish(&job);
    return over;
}

/* Read what came since into `next`. The state is read first: a job that is over before its events are
 * read has no others. Where the events cannot be read the stream ends, and the client comes again. */
static void read_next(struct event_feed *feed, bool *more, bool *done)
{
    struct store_event_list events = {0};
    feed->next.n = 0;
    feed->was_end = feed->was_end || job_is_over(feed);
    *done =
        jobs_events_since(feed->service->jobs, feed->job_id, feed->after, BATCH, &events, NULL) != GROOM_OK;
    for (size_t i = 0; i < events.n && put_event(&feed->next, &events.items[i]); i++)
        feed->after = events.items[i].sequence;
    *more = events.n == BATCH;
    *done |= feed->was_end && !*more;
    store_event_list_finish(&events);
    if (feed->next.n == 0 && !*done)
        put(&feed->next, ": still here\n\n", 14);
}

static void hand_over(struct event_feed *feed, bool more, bool done)
{
    struct text empty = feed->text;
    feed->text = feed->next;
    feed->next = empty;
    feed->at = 0;
    feed->more = more;
    feed->done = done;
}

static void act(struct follower *follower, void *user)
{
    struct event_feed *feed = user;
    bool more = false, done = false;
    pthread_mutex_lock(&feed->lock);
    bool wanted = feed->at == feed->text.n && !feed->done;
    feed->more |= !wanted; /* a slow client gets the rest when it has read what it has */
    pthread_mutex_unlock(&feed->lock);
    if (wanted)
        read_next(feed, &more, &done);
    follower_due(follower, follow_now_ms() + HEARTBEAT_MS);
    pthread_mutex_lock(&feed->lock);
    if (wanted)
        hand_over(feed, more, done);
    feed->done |= server_is_draining(feed->server);
    if (feed->suspended && (feed->text.n > feed->at || feed->done)) {
        feed->suspended = false;
        MHD_resume_connection(feed->connection);
        server_resumed(feed->server);
    }
    pthread_mutex_unlock(&feed->lock);
}

/* --- emptying -------------------------------------------------------------------------- */

static ssize_t take(void *user, uint64_t position, char *buffer, size_t capacity)
{
    struct event_feed *feed = user;
    ssize_t n = 0;
    (void)position;
    pthread_mutex_lock(&feed->lock);
    if (feed->at < feed->text.n) {
        size_t left = feed->text.n - feed->at;
        n = (ssize_t)(left < capacity ? left : capacity);
        memcpy(buffer, feed->text.bytes + feed->at, (size_t)n);
        feed->at += (size_t)n;
    } else if (feed->done || !server_suspended(feed->server)) {
        n = MHD_CONTENT_READER_END_OF_STREAM;
    } else {
        MHD_suspend_connection(feed->connection);
        feed->suspended = true;
        if (feed->more)
            follower_poke(feed->follower);
    }
    pthread_mutex_unlock(&feed->lock);
    return n;
}

static void release(void *user)
{
    struct event_feed *feed = user;
    pthread_mutex_destroy(&feed->lock);
    free(feed->text.bytes);
    free(feed->next.bytes);
    free(feed);
}

void events_drop(struct event_feed *feed)
{
    metrics_stream(server_metrics(feed->server), -1);
    follower_end(feed->follower);
}

static void drop(void *user) { events_drop(user); }

struct MHD_Response *events_create_response(struct event_feed *feed)
{
    struct MHD_Response *response =
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, 16384, take, feed, drop);
    if (!response)
        events_drop(feed);
    return response;
}

void events_respond(struct request *request, const char *job_id, int64_t after)
{
    static const char greeting[] = "retry: 2000\n\n";
    struct event_feed *feed = calloc(1, sizeof *feed);
    if (!feed) {
        respond_failure(request, GROOM_ENOMEM, NULL);
        return;
    }
    pthread_mutex_init(&feed->lock, NULL);
    feed->connection = request->connection;
    feed->service = request->service;
    feed->server = request->server;
    feed->after = after;
    snprintf(feed->job_id, sizeof feed->job_id, "%s", job_id);
    feed->more = true;
    bool greeted = put(&feed->text, greeting, sizeof greeting - 1);
    groom_status status =
        follower_create(server_followers(request->server), job_id, act, release, feed, &feed->follower);
    if (status != GROOM_OK || !greeted) {
        if (status == GROOM_OK)
            follower_end(feed->follower);
        else
            release(feed);
        respond_failure(request, GROOM_ENOMEM, NULL);
        return;
    }
    metrics_stream(server_metrics(request->server), 1);
    respond_events(request, feed);
    respond_header(request, "X-Accel-Buffering", "no");
}
