/* Messages of a job's end: who is to be told, and how far that is. */
#include <stdio.h>
#include <stdlib.h>

#include "server/store/database.h"

static const char *const state_names[STORE_WEBHOOK_STATES] = {"waiting", "delivered", "given_up"};

const char *store_webhook_state_name(enum store_webhook_state state)
{
    return (unsigned)state < STORE_WEBHOOK_STATES ? state_names[state] : "unknown";
}

#define COLUMNS "id, job_id, url, secret, state, attempts, due, last_status, last_error, created, finished"

static void read_webhook(struct query *q, struct store_webhook *webhook)
{
    query_copy(q, 0, webhook->id, sizeof webhook->id);
    query_copy(q, 1, webhook->job_id, sizeof webhook->job_id);
    webhook->url = query_string(q, 2);
    webhook->secret = query_string(q, 3);
    webhook->state = (enum store_webhook_state)query_int64(q, 4);
    webhook->n_attempts = (uint32_t)query_int64(q, 5);
    webhook->due_ms = query_int64(q, 6);
    webhook->last_status = (int)query_int64(q, 7);
    webhook->last_error = query_string(q, 8);
    webhook->created_ms = query_int64(q, 9);
    webhook->finished_ms = query_int64(q, 10);
}

/* --- parts of a job's transactions ----------------------------------------------------------- */

groom_status webhook_insert(struct connection *c, const char *job_id, const struct store_webhook_new *webhook,
                            int64_t now, struct groom_diag *diag)
{
    char id[STORE_ID_SIZE];
    groom_status status = store_make_id("msg_", id);
    if (status != GROOM_OK)
        return groom_fail(diag, status, "a message could not be made");
    struct query q = query_open(c, "INSERT INTO webhooks (id, job_id, url, secret, created) VALUES (?1, ?2, ?3, ?4, ?5)",
                                diag);
    query_text(&q, 1, id);
    query_text(&q, 2, job_id);
    query_text(&q, 3, webhook->url);
    query_text(&q, 4, webhook->secret);
    query_integer(&q, 5, now);
    return query_run(&q, NULL);
}

groom_status webhooks_release(struct connection *c, const char *job_id, int64_t now, struct groom_diag *diag)
{
    struct query q = query_open(c, "UPDATE webhooks SET due = ?2 WHERE job_id = ?1 AND state = 0", diag);
    query_text(&q, 1, job_id);
    query_integer(&q, 2, now);
    return query_run(&q, NULL);
}

/* --- delivering --------------------------------------------------------------------------------- */

/* Asked often: the writer is troubled only where something is due. */
static groom_status any_due(struct store *store, int64_t now, bool *due, struct groom_diag *diag)
{
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT 1 FROM webhooks WHERE state = 0 AND due > 0 AND due <= ?1 LIMIT 1", diag);
    query_integer(&q, 1, now);
    *due = query_row(&q);
    groom_status status = query_end(&q);
    read_end(c);
    return status;
}

groom_status store_webhook_take(struct store *store, int64_t lease_ms, struct store_webhook *webhook, bool *taken,
                                struct groom_diag *diag)
{
    struct store_webhook row = {0};
    struct connection *c;
    int64_t now = store_now_ms();
    bool found = false;
    groom_status status = any_due(store, now, &found, diag);
    *taken = false;
    if (status != GROOM_OK || !found || (status = transaction_begin(store, &c, diag)) != GROOM_OK)
        return status;
    struct query q = query_open(c, "UPDATE webhooks SET attempts = attempts + 1, due = ?2 WHERE id ="
                                   " (SELECT id FROM webhooks WHERE state = 0 AND due > 0 AND due <= ?1"
                                   "  ORDER BY due LIMIT 1) RETURNING " COLUMNS, diag);
    query_integer(&q, 1, now);
    query_integer(&q, 2, now + lease_ms);
    if ((found = query_row(&q)))
        read_webhook(&q, &row);
    status = transaction_end(c, query_run(&q, NULL), diag);
    if (status == GROOM_OK && found) {
        *webhook = row;
        *taken = true;
    } else {
        store_webhook_finish(&row);
    }
    return status;
}

groom_status store_webhook_tried(struct store *store, const char *id, enum store_webhook_state state, int64_t due_ms,
                                 int last_status, const char *last_error, struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    struct query q = query_open(c, "UPDATE webhooks SET state = ?2, due = ?3, last_status = ?4, last_error = ?5,"
                                   " finished = ?6 WHERE id = ?1", diag);
    query_text(&q, 1, id);
    query_integer(&q, 2, state);
    query_integer(&q, 3, due_ms);
    query_integer(&q, 4, last_status);
    query_text(&q, 5, last_error);
    query_integer(&q, 6, state == STORE_WEBHOOK_WAITING ? 0 : store_now_ms());
    return transaction_end(c, query_run(&q, NULL), diag);
}

groom_status store_webhooks_list(struct store *store, const char *job_id, struct store_webhook_list *list,
                                 struct groom_diag *diag)
{
    struct store_webhook_list found = {0};
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT " COLUMNS " FROM webhooks WHERE job_id = ?1 ORDER BY rowid", diag);
    query_text(&q, 1, job_id);
    while (query_row(&q)) {
        struct store_webhook *webhook = query_append(&q, &found.items, &found.n, sizeof *webhook);
        if (!webhook)
            break;
        read_webhook(&q, webhook);
    }
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_webhook_list_finish(&found);
    return status;
}

void store_webhook_finish(struct store_webhook *webhook)
{
    if (!webhook)
        return;
    free(webhook->url);
    free(webhook->secret);
    free(webhook->last_error);
    *webhook = (struct store_webhook){0};
}

void store_webhook_list_finish(struct store_webhook_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++)
        store_webhook_finish(&list->items[i]);
    free(list->items);
    *list = (struct store_webhook_list){0};
}
