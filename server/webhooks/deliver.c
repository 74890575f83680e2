#include "server/webhooks/webhooks.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cjson/cJSON.h>
#include <curl/curl.h>

#include "server/jobs/jobs.h"
#include "server/log.h"

#define N_THREADS   2
#define POLL_MS     500
#define MAX_ANSWER  65536
#define MAX_WAIT_MS (3600 * 1000)

struct webhooks {
    struct webhooks_options options;
    char *allow;
    pthread_t threads[N_THREADS];
    int n_threads;
    pthread_mutex_t lock;
    pthread_cond_t wake;
    atomic_bool stopping;
};

/* --- the message ------------------------------------------------------------------------------ */

/* {"type":"job.succeeded","timestamp":…,"data":{the job as GET shows it}} */
static groom_status write_body(struct webhooks *webhooks, const char *job_id, char **body, struct groom_diag *diag)
{
    struct store_job job = {0};
    char type[40], time[32];
    groom_status status = store_job_get(webhooks->options.store, job_id, &job, diag);
    if (status != GROOM_OK)
        return status;
    snprintf(type, sizeof type, "job.%s", store_job_state_name(job.state));
    store_time_text(job.finished_ms, time);
    cJSON *object = cJSON_CreateObject(), *data = jobs_json(&job);
    bool made = object && data && cJSON_AddStringToObject(object, "type", type) &&
                cJSON_AddStringToObject(object, "timestamp", time) && cJSON_AddItemToObject(object, "data", data);
    if (!made)
        cJSON_Delete(data);
    *body = made ? cJSON_PrintUnformatted(object) : NULL;
    cJSON_Delete(object);
    store_job_finish(&job);
    return *body ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory for a message");
}

/* --- the call ---------------------------------------------------------------------------------- */

struct call {
    struct webhooks *webhooks;
    bool refused; /* an address that may not be told */
    size_t n_answered;
    char error[CURL_ERROR_SIZE];
    long status;
};

/* libcurl is about to connect to this very address: whatever name led to it. */
static curl_socket_t on_socket(void *user, curlsocktype purpose, struct curl_sockaddr *address)
{
    struct call *call = user;
    if (purpose == CURLSOCKTYPE_IPCXN && webhook_address_allowed(&address->addr, call->webhooks->allow))
        return socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
    call->refused = true;
    return CURL_SOCKET_BAD;
}

/* Nobody reads the answer; one without end is cut. */
static size_t on_answer(char *bytes, size_t size, size_t n, void *user)
{
    struct call *call = user;
    (void)bytes;
    call->n_answered += size * n;
    return call->n_answered <= MAX_ANSWER ? size * n : 0;
}

static int on_progress(void *user, curl_off_t a, curl_off_t b, curl_off_t c, curl_off_t d)
{
    (void)a, (void)b, (void)c, (void)d;
    return atomic_load(&((struct call *)user)->webhooks->stopping);
}

static struct curl_slist *headers_of(const struct store_webhook *webhook, const char *body)
{
    char lines[3][160], signature[WEBHOOK_SIGNATURE_SIZE];
    struct curl_slist *list = NULL, *longer = NULL;
    int64_t now = store_now_ms() / 1000;
    if (webhook_sign(webhook->secret, webhook->id, now, body, signature) != GROOM_OK)
        return NULL;
    snprintf(lines[0], sizeof lines[0], "webhook-id: %s", webhook->id);
    snprintf(lines[1], sizeof lines[1], "webhook-timestamp: %lld", (long long)now);
    snprintf(lines[2], sizeof lines[2], "webhook-signature: %s", signature);
    const char *const all[] = {"Content-Type: application/json", "Expect:", lines[0], lines[1], lines[2]};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++, list = longer) {
        if (!(longer = curl_slist_append(list, all[i]))) {
            curl_slist_free_all(list);
            return NULL;
        }
    }
    return list;
}

static void set_call(CURL *curl, struct call *call, const struct store_webhook *webhook, const char *body,
                     struct curl_slist *headers)
{
    long timeout = call->webhooks->options.timeout_s;
    curl_easy_setopt(curl, CURLOPT_URL, webhook->url);
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 0L);
    curl_easy_setopt(curl, CURLOPT_PROXY, "");
    curl_easy_setopt(curl, CURLOPT_NETRC, (long)CURL_NETRC_IGNORED);
    curl_easy_setopt(curl, CURLOPT_OPENSOCKETFUNCTION, on_socket);
    curl_easy_setopt(curl, CURLOPT_OPENSOCKETDATA, call);
    curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl, CURLOPT_TIMEOUT, timeout);
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, timeout);
    curl_easy_setopt(curl, CURLOPT_USERAGENT, "groomd");
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
    curl_easy_setopt(curl, CURLOPT_POSTFIELDS, body);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, on_answer);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, call);
    curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, on_progress);
    curl_easy_setopt(curl, CURLOPT_XFERINFODATA, call);
    curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, call->error);
}

static void perform(struct call *call, const struct store_webhook *webhook, const char *body)
{
    CURL *curl = curl_easy_init();
    struct curl_slist *headers = headers_of(webhook, body);
    if (!curl || !headers) {
        snprintf(call->error, sizeof call->error, "no memory");
    } else {
        set_call(curl, call, webhook, body, headers);
        CURLcode code = curl_easy_perform(curl);
        if (call->refused)
            snprintf(call->error, sizeof call->error,
                     "its address is this machine's or a private network's (--webhook-allow)");
        else if (code != CURLE_OK && !call->error[0])
            snprintf(call->error, sizeof call->error, "%s", curl_easy_strerror(code));
        else if (code == CURLE_OK)
            call->error[0] = 0;
        if (!call->refused)
            curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &call->status);
    }
    curl_slist_free_all(headers);
    curl_easy_cleanup(curl);
}

/* --- what came of it ------------------------------------------------------------------------------ */

static int64_t pause_ms(const struct webhooks *webhooks, uint32_t n_attempts)
{
    int64_t ms = webhooks->options.backoff_ms;
    for (uint32_t i = 1; i < n_attempts && ms < MAX_WAIT_MS; i++)
        ms *= 4;
    return ms < MAX_WAIT_MS ? ms : MAX_WAIT_MS;
}

static void log_try(const struct store_webhook *webhook, const char *outcome, long status, const char *error)
{
    char members[900], words[400];
    snprintf(members, sizeof members, "\"webhook\":\"%s\",\"job\":\"%s\",\"attempt\":%u,\"outcome\":\"%s\",\"status\":%ld,"
             "\"error\":\"%s\"", webhook->id, webhook->job_id, webhook->n_attempts, outcome, status,
             log_escape(error, words, sizeof words));
    log_members(CONFIG_LOG_INFO, "webhook", members);
}

/* 2xx is heard; 410 says that nobody wants to hear any more. */
static void note_outcome(struct webhooks *webhooks, const struct store_webhook *webhook, const struct call *call)
{
    char error[CURL_ERROR_SIZE], words[600];
    struct groom_diag diag = {0};
    enum store_webhook_state state = STORE_WEBHOOK_WAITING;
    snprintf(error, sizeof error, "%s", call->error);
    if (call->status >= 200 && call->status < 300)
        state = STORE_WEBHOOK_DELIVERED;
    else if (call->status == 410 || webhook->n_attempts >= webhooks->options.max_attempts)
        state = STORE_WEBHOOK_GIVEN_UP;
    if (state == STORE_WEBHOOK_DELIVERED)
        error[0] = 0;
    else if (call->status >= 300)
        snprintf(error, sizeof error, "answered %ld%s", call->status, call->status < 400 ? ", and redirects are not followed" : "");
    int64_t due = state == STORE_WEBHOOK_WAITING ? store_now_ms() + pause_ms(webhooks, webhook->n_attempts) : 0;
    log_try(webhook, store_webhook_state_name(state), call->status, error);
    if (store_webhook_tried(webhooks->options.store, webhook->id, state, due, (int)call->status, error, &diag) != GROOM_OK)
        log_job(CONFIG_LOG_WARNING, "what came of a webhook could not be written", webhook->job_id, 0, "\"error\":\"%s\"",
                log_escape(diag.detail, words, sizeof words));
}

static void deliver(struct webhooks *webhooks, const struct store_webhook *webhook)
{
    struct call call = {.webhooks = webhooks};
    struct groom_diag diag = {0};
    char *body = NULL;
    if (write_body(webhooks, webhook->job_id, &body, &diag) == GROOM_OK)
        perform(&call, webhook, body);
    else
        snprintf(call.error, sizeof call.error, "%.200s", diag.detail);
    free(body);
    if (!atomic_load(&webhooks->stopping)) /* else its lease ends, and the next daemon tries */
        note_outcome(webhooks, webhook, &call);
}

/* --- threads ------------------------------------------------------------------------------------------ */

static void sleep_a_while(struct webhooks *webhooks)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += POLL_MS * 1000000L;
    until.tv_sec += until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    pthread_mutex_lock(&webhooks->lock);
    if (!atomic_load(&webhooks->stopping))
        pthread_cond_timedwait(&webhooks->wake, &webhooks->lock, &until);
    pthread_mutex_unlock(&webhooks->lock);
}

static void *run(void *user)
{
    struct webhooks *webhooks = user;
    while (!atomic_load(&webhooks->stopping)) {
        struct store_webhook webhook = {0};
        bool taken = false;
        int64_t lease = 2000 * (int64_t)webhooks->options.timeout_s;
        groom_status status = store_webhook_take(webhooks->options.store, lease, &webhook, &taken, NULL);
        if (status == GROOM_OK && taken)
            deliver(webhooks, &webhook);
        else
            sleep_a_while(webhooks);
        store_webhook_finish(&webhook);
    }
    return NULL;
}

static void start_curl(void) { curl_global_init(CURL_GLOBAL_DEFAULT); }

groom_status webhooks_start(const struct webhooks_options *options, struct webhooks **webhooks, struct groom_diag *diag)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_condattr_t monotonic;
    groom_status status = webhook_allow_check(options->allow ? options->allow : "", diag);
    if (status != GROOM_OK)
        return status;
    struct webhooks *made = calloc(1, sizeof *made);
    if (!made)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for webhooks");
    pthread_once(&once, start_curl);
    made->options = *options;
    made->options.timeout_s = options->timeout_s ? options->timeout_s : 10;
    made->options.backoff_ms = options->backoff_ms ? options->backoff_ms : 5000;
    pthread_mutex_init(&made->lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&made->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (!(made->allow = strdup(options->allow ? options->allow : "")))
        status = GROOM_ENOMEM;
    for (; status == GROOM_OK && made->n_threads < N_THREADS; made->n_threads++)
        if (pthread_create(&made->threads[made->n_threads], NULL, run, made) != 0) {
            status = GROOM_ENOMEM;
            break;
        }
    if (status != GROOM_OK) {
        webhooks_stop(made);
        return groom_fail(diag, status, "no memory or thread for webhooks");
    }
    *webhooks = made;
    return GROOM_OK;
}

void webhooks_stop(struct webhooks *webhooks)
{
    if (!webhooks)
        return;
    pthread_mutex_lock(&webhooks->lock);
    atomic_store(&webhooks->stopping, true);
    pthread_cond_broadcast(&webhooks->wake);
    pthread_mutex_unlock(&webhooks->lock);
    for (int i = 0; i < webhooks->n_threads; i++)
        pthread_join(webhooks->threads[i], NULL);
    pthread_cond_destroy(&webhooks->wake);
    pthread_mutex_destroy(&webhooks->lock);
    free(webhooks->allow);
    free(webhooks);
}
