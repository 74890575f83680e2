/* A job's events and loss curves. */
#include <stdlib.h>

#include "server/store/database.h"

groom_status event_append(struct connection *c, const char *job_id, const char *type, const char *data,
                          int64_t now, struct groom_diag *diag)
{
    struct query count = query_open(c, "UPDATE jobs SET n_events = n_events + 1 WHERE id = ?1", diag);
    query_text(&count, 1, job_id);
    groom_status status = query_run(&count, NULL);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "INSERT INTO events (job_id, sequence, type, data, created)"
                                       " SELECT id, n_events, ?2, ?3, ?4 FROM jobs WHERE id = ?1", diag);
    query_text(&q, 1, job_id);
    query_text(&q, 2, type);
    query_text(&q, 3, data);
    query_integer(&q, 4, now);
    return query_run(&q, NULL);
}

static groom_status job_exists(struct connection *c, const char *job_id, struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT 1 FROM jobs WHERE id = ?1", diag);
    query_text(&q, 1, job_id);
    bool found = query_row(&q);
    groom_status status = query_end(&q);
    if (status == GROOM_OK && !found)
        status = groom_fail(diag, GROOM_ENOTFOUND, "there is no job %.40s", job_id);
    return status;
}

static groom_status read_events(struct connection *c, const char *job_id, int64_t after, uint32_t limit,
                                struct store_event_list *list, struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT sequence, type, data, created FROM events"
                                       " WHERE job_id = ?1 AND sequence > ?2 ORDER BY sequence LIMIT ?3", diag);
    query_text(&q, 1, job_id);
    query_integer(&q, 2, after);
    query_integer(&q, 3, limit ? limit : 1000);
    while (query_row(&q)) {
        struct store_event *event = query_append(&q, &list->items, &list->n, sizeof *event);
        if (!event)
            break;
        event->sequence = query_int64(&q, 0);
        event->type = query_string(&q, 1);
        event->data = query_string(&q, 2);
        event->created_ms = query_int64(&q, 3);
    }
    return query_end(&q);
}

groom_status store_events_since(struct store *store, const char *job_id, int64_t after, uint32_t limit,
                                struct store_event_list *list, struct groom_diag *diag)
{
    struct store_event_list found = {0};
    struct connection *c = read_begin(store);
    groom_status status = job_exists(c, job_id, diag);
    if (status == GROOM_OK)
        status = read_events(c, job_id, after, limit, &found, diag);
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_event_list_finish(&found);
    return status;
}

void store_event_list_finish(struct store_event_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++) {
        free(list->items[i].type);
        free(list->items[i].data);
    }
    free(list->items);
    *list = (struct store_event_list){0};
}

static groom_status read_losses(struct connection *c, const char *job_id, struct store_loss_list *list,
                                struct groom_diag *diag)
{
    struct query q = query_open(c, "SELECT stage, iteration, name, value FROM losses WHERE job_id = ?1"
                                       " ORDER BY seq", diag);
    query_text(&q, 1, job_id);
    while (query_row(&q)) {
        struct store_loss_row *loss = query_append(&q, &list->items, &list->n, sizeof *loss);
        if (!loss)
            break;
        loss->stage = query_string(&q, 0);
        loss->iteration = query_int64(&q, 1);
        loss->name = query_string(&q, 2);
        loss->value = query_double(&q, 3);
    }
    return query_end(&q);
}

groom_status store_losses_list(struct store *store, const char *job_id, struct store_loss_list *list,
                               struct groom_diag *diag)
{
    struct store_loss_list found = {0};
    struct connection *c = read_begin(store);
    groom_status status = job_exists(c, job_id, diag);
    if (status == GROOM_OK)
        status = read_losses(c, job_id, &found, diag);
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_loss_list_finish(&found);
    return status;
}

void store_loss_list_finish(struct store_loss_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++) {
        free(list->items[i].stage);
        free(list->items[i].name);
    }
    free(list->items);
    *list = (struct store_loss_list){0};
}
