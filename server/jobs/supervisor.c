/* One thread, N slots. A turn of its loop: see to the slots whose job changed, poll those that run,
 * give stopping ones what their time has come for, fill the free ones; then sleep. */
#include "server/jobs/supervisor.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "proto/problem.h"
#include "proto/work.h"
#include "server/jobs/queue.h"
#include "server/jobs/size.h"
#include "server/jobs/work.h"
#include "server/log.h"

#define TAIL_BYTES 2048      /* of a log, as last words */
#define RETRY_MS 500         /* where the store failed */
#define EXIT_PATIENCE 5      /* graces that a worker has to exit after its job has ended */

/* How far the stopping of a worker has come. */
enum stopping { NOT_STOPPING, TERMINATE_NEXT, KILL_NEXT, KILLED };

struct slot {
    bool used;
    struct store_attempt_ref ref;
    char handle[LAUNCH_HANDLE_SIZE];
    char log_path[PATH_MAX];
    enum stopping stopping;
    int64_t stop_ms;         /* when the next step of stopping is due */
    bool adopted;            /* a former daemon launched it */
    bool drained;            /* it was stopped by us, not by itself */
    bool over_time;          /* it has taken more than it may */
    int64_t late_ms;         /* when it has; 0: never */
    bool ended;              /* the process has; what is left is to say so */
    char words[LAUNCH_HANDLE_SIZE + 384]; /* how it ended */
    int64_t retry_ms;
};

struct supervisor {
    struct jobs *jobs;
    struct supervisor_options options;
    pthread_t thread;
    pthread_mutex_t lock;    /* of the next group; never held while the store is asked */
    pthread_cond_t wake;
    bool nudged, draining, joined;
    uint32_t drain_grace_ms;
    struct supervisor_counts counts;

    struct slot *slots;      /* the thread's own, and what follows */
    uint32_t n_places;       /* of the array: n_slots, and room for what was adopted */
    bool look;               /* there may be something to take */
    int64_t take_ms;         /* when a back-off ends; 0: none */
};

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* slot NULL: it is about no job. */
static void complain(const struct slot *slot, const char *what, const struct groom_diag *diag)
{
    char words[600];
    if (slot)
        log_job(CONFIG_LOG_ERROR, what, slot->ref.job_id, slot->ref.number, "\"error\":\"%s\"",
                log_escape(diag->detail, words, sizeof words));
    else
        log_message(CONFIG_LOG_ERROR, "%s: %s", what, diag->detail);
}

static void count(struct supervisor *s, int running, uint64_t launched, uint64_t died)
{
    pthread_mutex_lock(&s->lock);
    s->counts.n_running = (uint32_t)((int)s->counts.n_running + running);
    s->counts.n_launched += launched;
    s->counts.n_died += died;
    pthread_mutex_unlock(&s->lock);
}

/* --- logs ----------------------------------------------------------------------------- */

static void name_log(const struct supervisor *s, struct slot *slot)
{
    snprintf(slot->log_path, sizeof slot->log_path, "%s/%s.%u.log", s->options.log_folder, slot->ref.job_id,
             slot->ref.number);
}

/* What its process told the daemon itself: that it ends, and why. returns  whether it did */
static bool read_own_words(struct supervisor *s, const struct slot *slot, char *words, size_t size)
{
    struct store_attempt_list attempts = {0};
    bool told = false;
    if (store_attempts_list(s->jobs->store, slot->ref.job_id, &attempts, NULL) != GROOM_OK)
        return false;
    for (size_t i = 0; i < attempts.n; i++) {
        const struct store_attempt *attempt = &attempts.items[i];
        if (attempt->ref.number != slot->ref.number || attempt->finished_ms == 0)
            continue;
        told = true;
        snprintf(words, size, "%s", attempt->last_words);
    }
    store_attempt_list_finish(&attempts);
    return told;
}

/* How it ended, and the end of what it said; what is not text is made harmless. */
static void read_last_words(struct supervisor *s, const struct slot *slot, char *words, size_t size)
{
    if (read_own_words(s, slot, words, size))
        return;
    size_t n = (size_t)snprintf(words, size, "%s", slot->words);
    FILE *log = fopen(slot->log_path, "re");
    if (!log || n + 2 >= size)
        goto out;
    if (fseek(log, 0, SEEK_END) == 0 && ftell(log) > TAIL_BYTES)
        fseek(log, -TAIL_BYTES, SEEK_END);
    else
        rewind(log);
    words[n] = '\n';
    size_t got = fread(words + n + 1, 1, size - n - 2, log);
    for (size_t i = n + 1; i < n + 1 + got; i++)
        if ((unsigned char)words[i] >= 127 || (words[i] < ' ' && words[i] != '\n' && words[i] != '\t'))
            words[i] = '?';
    words[n + (got ? 1 + got : 0)] = 0;
out:
    if (log)
        fclose(log);
}

/* --- what becomes of a job whose attempt has ended ------------------------------------------ */

static cJSON *describe_attempts(struct supervisor *s, const char *job_id)
{
    struct store_attempt_list attempts = {0};
    cJSON *array = cJSON_CreateArray();
    if (store_attempts_list(s->jobs->store, job_id, &attempts, NULL) != GROOM_OK)
        return array;
    for (size_t i = 0; i < attempts.n; i++) {
        const struct store_attempt *attempt = &attempts.items[i];
        char time[32];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddNumberToObject(item, "attempt", attempt->ref.number);
        /* the last one is still running in the store: it is just being ended */
        cJSON_AddStringToObject(item, "state", attempt->state == STORE_ATTEMPT_RUNNING
                                                   ? store_attempt_state_name(STORE_ATTEMPT_DIED)
                                                   : store_attempt_state_name(attempt->state));
        store_time_text(attempt->started_ms, time);
        cJSON_AddStringToObject(item, "started_at", time);
        cJSON_AddStringToObject(item, "last_words", attempt->last_words);
        cJSON_AddItemToArray(array, item);
    }
    store_attempt_list_finish(&attempts);
    return array;
}

/* Which limit it was that an attempt has gone over. */
static void describe_limit(const struct supervisor *s, const struct slot *slot, struct problem *problem)
{
    bool by_the_clock = slot->late_ms > 0 && now_ms() >= slot->late_ms;
    problem_set(problem, 500, "time-limit", "the job has taken more time than it may",
                "attempt %u has used up its %llu s of %s (%s): give the job less to do, or ask for a larger limit",
                slot->ref.number, by_the_clock ? (unsigned long long)s->options.wall_s : (unsigned long long)s->options.limits.cpu_s,
                by_the_clock ? "time" : "processor time", by_the_clock ? "--job-wall" : "--job-time");
}

/* The error of a job that too many attempts have died of, or one for lack of time. Text of cJSON's, or NULL. */
static char *describe_death(struct supervisor *s, const struct slot *slot, const struct store_job *job, const char *words)
{
    struct problem problem;
    cJSON *attempts = describe_attempts(s, job->id);
    cJSON *last = cJSON_GetArrayItem(attempts, cJSON_GetArraySize(attempts) - 1);
    if (last)
        cJSON_ReplaceItemInObjectCaseSensitive(last, "last_words", cJSON_CreateString(words));
    if (slot->over_time)
        describe_limit(s, slot, &problem);
    else
        problem_set(&problem, 500, "worker-died", "the worker died again and again",
                    "%u attempts died without getting further; the last one ended with %.*s", job->n_failures + 1,
                    (int)strcspn(words, "\n"), words);
    cJSON *object = problem_to_json(&problem);
    cJSON_AddItemToObject(object, "attempts", attempts);
    char *text = cJSON_PrintUnformatted(object);
    cJSON_Delete(object);
    return text;
}

static int64_t backoff_ms(const struct supervisor *s, uint32_t n_failures)
{
    uint64_t ms = s->options.backoff_ms;
    for (uint32_t i = 0; i < n_failures && ms < s->options.backoff_max_ms; i++)
        ms *= 2;
    return (int64_t)(ms < s->options.backoff_max_ms ? ms : s->options.backoff_max_ms);
}

/* Where the move says that a cancellation was asked for meanwhile, cancelled is where it goes. */
static groom_status move_or_cancel(struct supervisor *s, struct store_job_move *move, struct groom_diag *diag)
{
    groom_status status = jobs_move(s->jobs, move, diag);
    if (status != GROOM_ECANCELLED)
        return status;
    move->to = STORE_JOB_CANCELLED;
    move->attempt_state = STORE_ATTEMPT_CANCELLED;
    move->error = NULL;
    return jobs_move(s->jobs, move, diag);
}

/* It ended and its job still runs: stopped by us, or dead. */
static groom_status settle(struct supervisor *s, const struct slot *slot, const struct store_job *job,
                           struct groom_diag *diag)
{
    char words[TAIL_BYTES + WORK_MAX_WORDS + sizeof slot->words + 2];
    char *error = NULL;
    struct store_job_move move = {.job_id = job->id, .from = STORE_JOB_RUNNING, .to = STORE_JOB_QUEUED,
                                  .attempt = slot->ref.number, .attempt_state = STORE_ATTEMPT_STOPPED,
                                  .last_words = words};
    read_last_words(s, slot, words, sizeof words);
    if (job->cancel_requested) {
        move.to = STORE_JOB_CANCELLED;
        move.attempt_state = STORE_ATTEMPT_CANCELLED;
    } else if (!slot->drained) {
        move.attempt_state = STORE_ATTEMPT_DIED;
        move.not_before_ms = store_now_ms() + backoff_ms(s, job->n_failures);
        if (slot->over_time || job->n_failures + 1 >= s->options.max_deaths) {
            move.to = STORE_JOB_FAILED;
            move.not_before_ms = 0;
            move.error = error = describe_death(s, slot, job, words);
        }
    }
    groom_status status = move_or_cancel(s, &move, diag);
    cJSON_free(error);
    if (status == GROOM_OK && move.attempt_state == STORE_ATTEMPT_DIED)
        count(s, 0, 0, 1);
    return status;
}

static bool runs_this(const struct store_job *job, const struct store_attempt_ref *ref)
{
    return job->state == STORE_JOB_RUNNING && job->attempt == ref->number;
}

/* Free the slot once the store knows; where it cannot be told, try again later. */
static void finish_slot(struct supervisor *s, struct slot *slot)
{
    struct groom_diag diag = {0};
    struct store_job job = {0};
    if (now_ms() < slot->retry_ms)
        return;
    groom_status status = store_job_get(s->jobs->store, slot->ref.job_id, &job, &diag);
    if (status == GROOM_OK && runs_this(&job, &slot->ref))
        status = settle(s, slot, &job, &diag);
    store_job_finish(&job);
    if (status != GROOM_OK && status != GROOM_ECONFLICT && status != GROOM_ENOTFOUND) {
        complain(slot, "an attempt's end could not be written", &diag);
        slot->retry_ms = now_ms() + RETRY_MS;
        return;
    }
    unlink(slot->log_path);
    slot->used = false;
    s->look = true;
    count(s, -1, 0, 0);
}

/* --- stopping ---------------------------------------------------------------------------------- */

static void begin_stopping(struct slot *slot, int64_t first_ms)
{
    if (slot->stopping != NOT_STOPPING)
        return;
    slot->stopping = TERMINATE_NEXT;
    slot->stop_ms = first_ms;
}

static void go_on_stopping(struct supervisor *s, struct slot *slot, uint32_t grace_ms)
{
    struct launcher *launcher = s->options.launcher;
    struct groom_diag diag = {0};
    if (slot->stopping == NOT_STOPPING || slot->stopping == KILLED || slot->ended || now_ms() < slot->stop_ms)
        return;
    enum launch_stop how = slot->stopping == TERMINATE_NEXT ? LAUNCH_TERMINATE : LAUNCH_KILL;
    if (launcher->table->stop(launcher, slot->handle, how, &diag) != GROOM_OK)
        complain(slot, "a worker could not be stopped", &diag);
    slot->stopping = how == LAUNCH_TERMINATE ? KILL_NEXT : KILLED;
    slot->stop_ms = now_ms() + grace_ms;
}

/* Its time is up: SIGTERM, so that its checkpoint and its last words are kept, then SIGKILL. */
static void watch_the_clock(struct slot *slot)
{
    if (!slot->late_ms || slot->over_time || slot->drained || now_ms() < slot->late_ms)
        return;
    slot->over_time = true;
    begin_stopping(slot, now_ms());
}

/* A launcher that lives on elsewhere learns late how a process ended; the process has been quicker. */
static bool says_it_ends(struct supervisor *s, const struct slot *slot)
{
    char words[WORK_MAX_WORDS + 1];
    return s->options.launcher->table->handle_of && read_own_words(s, slot, words, sizeof words);
}

/* Something was said of jobs: is one of ours to be cancelled, or over? Its place is free once the
 * launcher says that it is gone. */
static void review_slot(struct supervisor *s, struct slot *slot)
{
    struct store_job job = {0};
    struct groom_diag diag = {0};
    uint32_t grace = s->options.cancel_grace_ms;
    if (store_job_get(s->jobs->store, slot->ref.job_id, &job, NULL) != GROOM_OK)
        return;
    if (!runs_this(&job, &slot->ref))
        begin_stopping(slot, now_ms() + EXIT_PATIENCE * (int64_t)grace);
    else if (job.cancel_requested)
        begin_stopping(slot, now_ms() + grace);
    if (runs_this(&job, &slot->ref) && says_it_ends(s, slot) && settle(s, slot, &job, &diag) != GROOM_OK)
        complain(slot, "an attempt's end could not be written", &diag);
    store_job_finish(&job);
}

static void poll_slot(struct supervisor *s, struct slot *slot)
{
    struct launcher *launcher = s->options.launcher;
    struct launch_status status = {.state = LAUNCH_RUNNING};
    struct groom_diag diag = {0};
    if (launcher->table->poll(launcher, slot->handle, &status, &diag) != GROOM_OK) {
        complain(slot, "a worker could not be asked after", &diag);
        return;
    }
    if (status.state == LAUNCH_ENDED) {
        slot->ended = true;
        slot->over_time |= status.over_time;
        slot->drained |= slot->adopted && status.unknown; /* nobody knows whose fault that was */
        snprintf(slot->words, sizeof slot->words, "%s", status.words);
    }
}

/* --- launching ----------------------------------------------------------------------------------- */

#define MAX_ENV 64

/* What was said of all attempts, and of this job where nothing was. */
static struct launch_size choose_size(struct supervisor *s, const char *job_id)
{
    struct launch_size size = s->options.size, estimate = size_of_job(s->jobs, job_id);
    if (!size.threads)
        size.threads = estimate.threads;
    if (!size.memory_bytes)
        size.memory_bytes = estimate.memory_bytes;
    if (!size.wall_s)
        size.wall_s = estimate.wall_s;
    return size;
}

static groom_status launch(struct supervisor *s, struct slot *slot, const char *token, struct groom_diag *diag)
{
    char url[1200], secret[WORK_TOKEN_SIZE + 32], name[STORE_ID_SIZE + 16], threads[48];
    const char *env[MAX_ENV + 1];
    size_t n = 0;
    snprintf(url, sizeof url, "GROOM_WORK_URL=%s", s->options.work_url);
    snprintf(secret, sizeof secret, "GROOM_WORK_TOKEN=%s", token);
    snprintf(name, sizeof name, "%s.%u", slot->ref.job_id, slot->ref.number);
    env[n++] = url;
    env[n++] = secret;
    struct launch_size size = choose_size(s, slot->ref.job_id);
    if (s->options.launcher->table->handle_of) { /* it asks for what the job needs, wherever that is */
        snprintf(threads, sizeof threads, WORK_ENV_THREADS "=%u", size.threads);
        env[n++] = threads;
    }
    for (const char *const *more = s->options.worker_env; more && *more && n < MAX_ENV; more++)
        env[n++] = *more;
    env[n] = NULL;
    struct launch_spec spec = {.argv = s->options.worker_argv, .env = env, .name = name,
                               .log_path = slot->log_path, .limits = s->options.limits, .size = size};
    return s->options.launcher->table->start(s->options.launcher, &spec, slot->handle, diag);
}

/* Its attempt is in the store; a worker that cannot be started is one that died at once. */
static void start_slot(struct supervisor *s, struct slot *slot, const struct store_attempt_ref *ref,
                       const char *token)
{
    struct groom_diag diag = {0};
    *slot = (struct slot){.used = true, .ref = *ref};
    if (s->options.wall_s && !s->options.launcher->table->handle_of) /* a cluster has its own clock, and a queue */
        slot->late_ms = now_ms() + 1000 * (int64_t)s->options.wall_s;
    name_log(s, slot);
    count(s, 1, 1, 0);
    log_job(CONFIG_LOG_INFO, "job", ref->job_id, ref->number, "\"state\":\"running\"");
    jobs_notify(s->jobs, ref->job_id);
    if (launch(s, slot, token, &diag) != GROOM_OK) {
        slot->ended = true;
        snprintf(slot->words, sizeof slot->words, "%s", diag.detail);
    } else if (store_attempt_launched(s->jobs->store, ref, slot->handle, &diag) != GROOM_OK) {
        complain(slot, "a worker's handle could not be written", &diag);
    }
}

/* returns  whether a job was taken into the slot */
static bool fill_slot(struct supervisor *s, struct slot *slot)
{
    char token[WORK_TOKEN_SIZE], hash[STORE_HASH_SIZE];
    struct store_attempt_ref ref;
    struct groom_diag diag = {0};
    bool taken = false;
    int64_t next_ms = 0;
    groom_status status = work_token_make(token, hash);
    if (status == GROOM_OK)
        status = store_job_take(s->jobs->store, hash, &ref, &taken, &next_ms, &diag);
    if (status != GROOM_OK) {
        complain(NULL, "the next job could not be taken", &diag);
        next_ms = store_now_ms() + RETRY_MS;
    }
    if (!taken) {
        s->look = false;
        s->take_ms = next_ms;
        return false;
    }
    start_slot(s, slot, &ref, token);
    return true;
}

static void fill_slots(struct supervisor *s)
{
    if (s->take_ms > 0 && store_now_ms() >= s->take_ms)
        s->look = true;
    uint32_t n_used = 0;
    for (uint32_t i = 0; i < s->n_places; i++)
        n_used += s->slots[i].used;
    for (uint32_t i = 0; s->look && n_used < s->options.n_slots && i < s->n_places; i++) {
        if (s->slots[i].used)
            continue;
        if (!fill_slot(s, &s->slots[i]))
            return;
        n_used++;
    }
}

/* --- the thread ------------------------------------------------------------------------------------ */

static void see_to_slot(struct supervisor *s, struct slot *slot, bool nudged, bool draining, uint32_t grace_ms)
{
    if (nudged && !slot->ended)
        review_slot(s, slot);
    if (draining && !slot->ended && s->options.launcher->table->handle_of) {
        slot->used = false; /* it goes on without us, and the next daemon finds it */
        count(s, -1, 0, 0);
        return;
    }
    if (draining && !slot->drained) {
        slot->drained = true;
        slot->stopping = NOT_STOPPING; /* now, whatever was planned */
        begin_stopping(slot, now_ms());
    }
    if (!slot->ended)
        poll_slot(s, slot);
    if (!slot->ended)
        watch_the_clock(slot);
    go_on_stopping(s, slot, grace_ms);
    if (slot->ended)
        finish_slot(s, slot);
}

/* How long nothing is due: while workers run, until the next poll. */
static int64_t sleep_ms(const struct supervisor *s, bool running)
{
    int64_t ms = 60000;
    if (running)
        ms = s->options.launcher->table->poll_interval_ms;
    if (s->take_ms > 0 && s->take_ms - store_now_ms() < ms)
        ms = s->take_ms - store_now_ms();
    return ms < 1 ? 1 : ms;
}

/* returns  whether it was nudged */
static bool sleep_until_due(struct supervisor *s, int64_t ms, bool *draining)
{
    struct timespec until;
    int64_t until_ms = now_ms() + ms;
    until.tv_sec = until_ms / 1000;
    until.tv_nsec = until_ms % 1000 * 1000000;
    pthread_mutex_lock(&s->lock);
    int waited = 0;
    while (!s->nudged && waited != ETIMEDOUT)
        waited = pthread_cond_timedwait(&s->wake, &s->lock, &until);
    bool nudged = s->nudged;
    s->nudged = false;
    *draining = s->draining;
    pthread_mutex_unlock(&s->lock);
    return nudged;
}

static void *supervise(void *user)
{
    struct supervisor *s = user;
    bool nudged = false, draining = false;
    for (;;) {
        bool running = false;
        s->look |= nudged;
        uint32_t grace_ms = draining ? s->drain_grace_ms : s->options.cancel_grace_ms;
        for (uint32_t i = 0; i < s->n_places; i++)
            if (s->slots[i].used)
                see_to_slot(s, &s->slots[i], nudged, draining, grace_ms);
        if (!draining)
            fill_slots(s);
        for (uint32_t i = 0; i < s->n_places; i++) {
            /* drained and not to be written: the next start of the daemon says it */
            if (draining && s->slots[i].ended)
                s->slots[i].used = false;
            running |= s->slots[i].used;
        }
        if (draining && !running)
            return NULL;
        nudged = sleep_until_due(s, sleep_ms(s, running), &draining);
    }
}

static void nudge_supervisor(void *user)
{
    struct supervisor *s = user;
    pthread_mutex_lock(&s->lock);
    s->nudged = true;
    pthread_cond_signal(&s->wake);
    pthread_mutex_unlock(&s->lock);
}

/* --- starting and ending -------------------------------------------------------------------------------- */

/* A former daemon's worker: mostly dead with it, else killed now. It gets a few seconds to be gone. */
static void end_former(struct supervisor *s, const char *handle)
{
    struct launcher *launcher = s->options.launcher;
    struct launch_status status = {.state = LAUNCH_RUNNING};
    struct timespec nap = {0, 10 * 1000000};
    if (launcher->table->stop(launcher, handle, LAUNCH_KILL, NULL) != GROOM_OK)
        return;
    for (int i = 0; i < 300; i++) {
        if (launcher->table->poll(launcher, handle, &status, NULL) != GROOM_OK || status.state == LAUNCH_ENDED)
            return;
        nanosleep(&nap, NULL);
    }
}

/* Its daemon has ended, and it with it. Fenced from here on, a worker that were still alive could not
 * hand anything in. */
static groom_status give_back(struct supervisor *s, const struct store_attempt *attempt, struct groom_diag *diag)
{
    struct store_job_move move = {.job_id = attempt->ref.job_id, .from = STORE_JOB_RUNNING, .to = STORE_JOB_QUEUED,
                                  .attempt = attempt->ref.number, .attempt_state = STORE_ATTEMPT_STOPPED,
                                  .last_words = "the daemon ended"};
    struct slot slot = {.ref = attempt->ref};
    end_former(s, attempt->handle);
    name_log(s, &slot);
    unlink(slot.log_path);
    return move_or_cancel(s, &move, diag);
}

static bool is_handle_of(const struct supervisor *s, const struct store_attempt *attempt)
{
    size_t n = strlen(s->options.launcher->table->name);
    return !strncmp(attempt->handle, s->options.launcher->table->name, n) && attempt->handle[n] == ':';
}

/* It may run on, or wait to; the daemon may have ended before it noted the handle. */
static void adopt(struct supervisor *s, const struct store_attempt *attempt, struct slot *slot)
{
    char name[STORE_ID_SIZE + 16];
    *slot = (struct slot){.used = true, .ref = attempt->ref, .adopted = true};
    snprintf(name, sizeof name, "%s.%u", attempt->ref.job_id, attempt->ref.number);
    s->options.launcher->table->handle_of(name, slot->handle);
    name_log(s, slot);
    count(s, 1, 0, 0);
}

/* What the store says is running: a launcher that outlives the daemon may still have it. */
static groom_status recover(struct supervisor *s, struct groom_diag *diag)
{
    struct store_attempt_list attempts = {0};
    bool lives_on = s->options.launcher->table->handle_of != NULL;
    groom_status status = store_attempts_list(s->jobs->store, NULL, &attempts, diag);
    s->n_places = s->options.n_slots + (lives_on && status == GROOM_OK ? (uint32_t)attempts.n : 0);
    if (status == GROOM_OK && !(s->slots = calloc(s->n_places, sizeof *s->slots)))
        status = groom_fail(diag, GROOM_ENOMEM, "no memory for the supervisor");
    for (size_t i = 0; status == GROOM_OK && i < attempts.n; i++)
        /* one of another launcher's is nobody's any more */
        if (lives_on && (!attempts.items[i].handle[0] || is_handle_of(s, &attempts.items[i])))
            adopt(s, &attempts.items[i], &s->slots[i]);
        else
            status = give_back(s, &attempts.items[i], diag);
    store_attempt_list_finish(&attempts);
    return status;
}

static void fill_in(struct supervisor_options *options)
{
    if (options->n_slots == 0)
        options->n_slots = 1;
    if (options->max_deaths == 0)
        options->max_deaths = 3;
    if (options->backoff_ms == 0)
        options->backoff_ms = 500;
    if (options->backoff_max_ms == 0)
        options->backoff_max_ms = 60000;
    if (options->cancel_grace_ms == 0)
        options->cancel_grace_ms = 1000;
}

static groom_status start_thread(struct supervisor *s, struct groom_diag *diag)
{
    if (mkdir(s->options.log_folder, 0750) != 0 && errno != EEXIST)
        return groom_fail(diag, GROOM_EIO, "%s: %s", s->options.log_folder, strerror(errno));
    groom_status status = recover(s, diag);
    if (status != GROOM_OK)
        return status;
    jobs_set_nudge(s->jobs, nudge_supervisor, s);
    if (pthread_create(&s->thread, NULL, supervise, s) != 0) {
        jobs_set_nudge(s->jobs, NULL, NULL);
        return groom_fail(diag, GROOM_ENOMEM, "no thread for the supervisor");
    }
    s->joined = false;
    return GROOM_OK;
}

groom_status supervisor_start(struct jobs *jobs, const struct supervisor_options *options,
                              struct supervisor **supervisor, struct groom_diag *diag)
{
    pthread_condattr_t monotonic;
    struct supervisor *s = calloc(1, sizeof *s);
    if (!s)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the supervisor");
    s->jobs = jobs;
    s->options = *options;
    fill_in(&s->options);
    s->counts.n_slots = s->options.n_slots;
    s->look = true;
    s->joined = true;
    pthread_mutex_init(&s->lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&s->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
    groom_status status = start_thread(s, diag);
    if (status != GROOM_OK) {
        supervisor_destroy(s);
        return status;
    }
    *supervisor = s;
    return GROOM_OK;
}

void supervisor_drain(struct supervisor *s, uint32_t grace_ms)
{
    if (!s || s->joined)
        return;
    pthread_mutex_lock(&s->lock);
    s->draining = true;
    s->drain_grace_ms = grace_ms;
    s->nudged = true;
    pthread_cond_signal(&s->wake);
    pthread_mutex_unlock(&s->lock);
    pthread_join(s->thread, NULL);
    s->joined = true;
    jobs_set_nudge(s->jobs, NULL, NULL);
}

void supervisor_destroy(struct supervisor *s)
{
    if (!s)
        return;
    supervisor_drain(s, s->options.cancel_grace_ms);
    pthread_cond_destroy(&s->wake);
    pthread_mutex_destroy(&s->lock);
    free(s->slots);
    free(s);
}

void supervisor_count(struct supervisor *s, struct supervisor_counts *counts)
{
    pthread_mutex_lock(&s->lock);
    *counts = s->counts;
    pthread_mutex_unlock(&s->lock);
}
