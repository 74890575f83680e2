/* The audit: a row for every change, written in the transaction of the change itself, so that neither
 * is without the other. The schema lets nobody alter or remove a row. */
#include <stdlib.h>

#include "server/actor.h"
#include "server/store/database.h"

groom_status audit_append(struct connection *c, const char *project, const char *action, const char *subject,
                          const char *detail, int64_t now, struct groom_diag *diag)
{
    const struct actor *actor = actor_get();
    struct query q = query_open(c, "INSERT INTO audit (created, request, token, name, project, action, subject,"
                                   " detail) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)", diag);
    query_integer(&q, 1, now);
    query_text(&q, 2, actor->request);
    query_text(&q, 3, actor->token);
    query_text(&q, 4, actor->name);
    query_text(&q, 5, project);
    query_text(&q, 6, action);
    query_text(&q, 7, subject);
    query_text(&q, 8, detail ? detail : "");
    return query_run(&q, NULL);
}

groom_status store_audit_add(struct store *store, const char *project, const char *action, const char *subject,
                             const char *detail, struct groom_diag *diag)
{
    struct connection *c;
    groom_status status = transaction_begin(store, &c, diag);
    if (status != GROOM_OK)
        return status;
    return transaction_end(c, audit_append(c, project, action, subject, detail, store_now_ms(), diag), diag);
}

static void read_entry(struct query *q, struct store_audit_entry *entry)
{
    entry->sequence = query_int64(q, 0);
    entry->created_ms = query_int64(q, 1);
    entry->request = query_string(q, 2);
    entry->token = query_string(q, 3);
    entry->name = query_string(q, 4);
    entry->project = query_string(q, 5);
    entry->action = query_string(q, 6);
    entry->subject = query_string(q, 7);
    entry->detail = query_string(q, 8);
}

groom_status store_audit_list(struct store *store, struct store_page page, struct store_audit_list *list,
                              struct groom_diag *diag)
{
    struct store_audit_list found = {0};
    struct connection *c = read_begin(store);
    struct query q = query_open(c, "SELECT seq, created, request, token, name, project, action, subject, detail"
                                   " FROM audit WHERE seq < ?1 ORDER BY seq DESC LIMIT ?2", diag);
    query_integer(&q, 1, page_before(page));
    query_integer(&q, 2, page_limit(page));
    while (query_row(&q)) {
        if ((int64_t)found.n == page_limit(page) - 1) {
            found.next = found.items[found.n - 1].sequence;
            break;
        }
        struct store_audit_entry *entry = query_append(&q, &found.items, &found.n, sizeof *entry);
        if (!entry)
            break;
        read_entry(&q, entry);
    }
    groom_status status = query_end(&q);
    read_end(c);
    if (status == GROOM_OK)
        *list = found;
    else
        store_audit_list_finish(&found);
    return status;
}

void store_audit_list_finish(struct store_audit_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->n; i++) {
        struct store_audit_entry *entry = &list->items[i];
        char *texts[] = {entry->request, entry->token, entry->name, entry->project, entry->action, entry->subject,
                         entry->detail};
        for (size_t k = 0; k < sizeof texts / sizeof texts[0]; k++)
            free(texts[k]);
    }
    free(list->items);
    *list = (struct store_audit_list){0};
}
