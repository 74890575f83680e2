/* Attempts as batch jobs of Slurm. The supervisor's calls only read and change the entries; the thread
 * runs the programs, one after another: submit what is new, stop what is to be stopped, look. */
#include <errno.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>

#include "server/launch/slurm_commands.h"
#include "server/launch/spawn.h"
#include "server/log.h"

#define HANDLE_PREFIX "slurm:"
#define RETRY_MS      5000  /* where the controller does not answer */
#define SOON_MS       300   /* between two squeue while something is being stopped */

enum entry_state {
    ENTRY_NEW,     /* to be submitted */
    ENTRY_DOUBTED, /* submitted, and no answer: the next squeue tells whether it is there */
    ENTRY_THERE,
    ENTRY_ENDED
};

struct entry {
    char name[SLURM_NAME_SIZE];
    enum entry_state state;
    struct slurm_order *order;    /* until it is there */
    int64_t due_ms;               /* ENTRY_NEW: when to submit */
    bool stopping, stop_due;
    enum launch_stop stop;
    bool missed;                  /* by the last squeue */
    bool unknown;
    char words[SLURM_WORDS_SIZE];
    struct entry *next;
};

struct slurm {
    struct launcher launcher;     /* first */
    struct slurm_commands commands;
    bool (*stale)(void *user, const char *name);
    void *stale_user;
    uint32_t interval_ms;
    pthread_t thread;
    bool has_thread;

    pthread_mutex_t lock;         /* of what follows; not held while a program runs */
    pthread_cond_t wake;
    struct entry *entries;
    bool ending;

    bool swept, complained;       /* the thread's own */
    int64_t look_ms;
};

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* --- entries, with the lock held ----------------------------------------------------------- */

static struct entry *find(struct slurm *s, const char *name)
{
    struct entry *entry = s->entries;
    while (entry && strcmp(entry->name, name) != 0)
        entry = entry->next;
    return entry;
}

static struct entry *find_state(struct slurm *s, enum entry_state state)
{
    struct entry *entry = s->entries;
    while (entry && entry->state != state)
        entry = entry->next;
    return entry;
}

static struct entry *add_entry(struct slurm *s, const char *name, enum entry_state state)
{
    struct entry *entry = calloc(1, sizeof *entry);
    if (!entry)
        return NULL;
    snprintf(entry->name, sizeof entry->name, "%s", name);
    entry->state = state;
    entry->next = s->entries;
    s->entries = entry;
    return entry;
}

static void remove_entry(struct slurm *s, struct entry *entry)
{
    struct entry **at = &s->entries;
    while (*at != entry)
        at = &(*at)->next;
    *at = entry->next;
    slurm_order_destroy(entry->order);
    free(entry);
}

static __attribute__((format(printf, 3, 4))) void end_entry(struct entry *entry, bool unknown, const char *format,
                                                            ...)
{
    va_list values;
    va_start(values, format);
    vsnprintf(entry->words, sizeof entry->words, format, values);
    va_end(values);
    entry->state = ENTRY_ENDED;
    entry->unknown = unknown;
    entry->stop_due = false;
}

/* --- what went wrong, said once -------------------------------------------------------------- */

static void complain(struct slurm *s, const struct groom_diag *diag)
{
    if (atomic_load(&s->commands.give_up)) /* it was stopped by us */
        return;
    if (!s->complained)
        log_message(CONFIG_LOG_ERROR, "Slurm does not answer; trying on: %s", diag->detail);
    s->complained = true;
}

static void calm_down(struct slurm *s)
{
    if (s->complained)
        log_message(CONFIG_LOG_INFO, "Slurm answers again");
    s->complained = false;
}

/* --- the thread's three doings ------------------------------------------------------------------ */

/* Not in the queue (any more, or never): once more, unless it was stopped meanwhile. */
static void submit_again(struct entry *entry, int64_t due_ms)
{
    if (entry->stopping) {
        end_entry(entry, false, "stopped before it was submitted");
        return;
    }
    entry->state = ENTRY_NEW;
    entry->due_ms = due_ms;
}

static void note_submission(struct slurm *s, struct entry *entry, groom_status status, const struct groom_diag *diag)
{
    if (status == GROOM_OK)
        entry->state = ENTRY_THERE;
    else if (status == GROOM_EINVAL)
        end_entry(entry, false, "Slurm refused it: %.280s", diag->detail);
    else
        complain(s, diag);
    if (status == GROOM_ECANCELLED)
        submit_again(entry, now_ms() + RETRY_MS);
}

/* Called and left with the lock held, as the two below. returns  whether there was anything to do */
static bool submit_one(struct slurm *s)
{
    struct groom_diag diag = {0};
    struct entry *entry = s->entries;
    while (entry && (entry->state != ENTRY_NEW || entry->due_ms > now_ms()))
        entry = entry->next;
    if (!entry)
        return false;
    char name[SLURM_NAME_SIZE];
    struct slurm_order *order = entry->order;
    memcpy(name, entry->name, sizeof name);
    entry->order = NULL; /* ours while it is submitted; a stop meanwhile leaves the entry */
    entry->state = ENTRY_DOUBTED;
    pthread_mutex_unlock(&s->lock);
    groom_status status = slurm_submit(&s->commands, name, order, &diag);
    pthread_mutex_lock(&s->lock);
    s->look_ms = now_ms() + SOON_MS;
    entry = find(s, name);
    if (entry && status != GROOM_OK) {
        entry->order = order; /* it may be needed again */
        order = NULL;
    }
    slurm_order_destroy(order);
    if (entry)
        note_submission(s, entry, status, &diag);
    return true;
}

static bool stop_one(struct slurm *s)
{
    struct groom_diag diag = {0};
    struct entry *entry = s->entries;
    while (entry && (!entry->stop_due || entry->due_ms > now_ms()))
        entry = entry->next;
    if (!entry)
        return false;
    char name[SLURM_NAME_SIZE];
    enum launch_stop how = entry->stop;
    memcpy(name, entry->name, sizeof name);
    entry->stop_due = false;
    pthread_mutex_unlock(&s->lock);
    groom_status status = slurm_cancel(&s->commands, name, how, &diag);
    pthread_mutex_lock(&s->lock);
    entry = find(s, name);
    if (status != GROOM_OK) {
        complain(s, &diag);
        if (entry && entry->state != ENTRY_ENDED) {
            entry->stop_due = true;
            entry->due_ms = now_ms() + RETRY_MS;
        }
    }
    s->look_ms = now_ms() + SOON_MS;
    return true;
}

/* Where a name was submitted twice, the one that lives counts. */
static const struct slurm_row *find_row(const struct slurm_rows *rows, const char *name)
{
    const struct slurm_row *found = NULL;
    for (size_t i = 0; i < rows->n; i++)
        if (!strcmp(rows->items[i].name, name) && (!found || slurm_row_lives(&rows->items[i])))
            found = &rows->items[i];
    return found;
}

/* It waits for somebody who will not come: Slurm gave up starting it. */
static bool is_stuck(const struct slurm_row *row)
{
    return !strcmp(row->reason, "JobHoldMaxRequeue") || strstr(row->reason, "launch failed requeued held") ||
           strstr(row->reason, "launch_failed_requeued_held") || !strcmp(row->state, "SPECIAL_EXIT");
}

static void describe_end(struct entry *entry, const struct slurm_row *row)
{
    char how[64] = "";
    if (row->exit_code)
        spawn_words(row->exit_code, how, sizeof how);
    end_entry(entry, false, "%s%s%s (Slurm job %s on %s%s%s)", how, how[0] ? ", " : "", row->state, row->id, row->node,
              strcmp(row->reason, "None") ? ", " : "", strcmp(row->reason, "None") ? row->reason : "");
}

static void apply_row(struct entry *entry, const struct slurm_row *row)
{
    if (!row && entry->state == ENTRY_DOUBTED && entry->order) {
        submit_again(entry, 0); /* it was not accepted */
    } else if (!row && !entry->missed) {
        entry->missed = true; /* once may be a controller that is just starting */
        return;
    } else if (!row) {
        end_entry(entry, true, "gone: Slurm does not know it (any more)");
    } else if (!slurm_row_lives(row)) {
        describe_end(entry, row);
    } else if (is_stuck(row)) {
        log_attempt(CONFIG_LOG_WARNING, "Slurm holds a job that cannot start; it is taken out", entry->name);
        entry->stopping = entry->stop_due = true;
        entry->stop = LAUNCH_KILL;
        entry->state = ENTRY_THERE;
    } else {
        entry->state = ENTRY_THERE;
    }
    entry->missed = false;
}

/* What a former daemon left and nobody wants: fenced off anyway, it would only take a place. */
static void sweep(struct slurm *s, const struct slurm_rows *rows)
{
    struct groom_diag diag = {0};
    for (size_t i = 0; s->stale && i < rows->n; i++) {
        const struct slurm_row *row = &rows->items[i];
        if (!slurm_row_lives(row) || strncmp(row->name, "job_", 4) != 0 || !s->stale(s->stale_user, row->name))
            continue;
        log_attempt(CONFIG_LOG_INFO, "Slurm still has a job that nobody wants: cancelled", row->name);
        if (slurm_cancel(&s->commands, row->name, LAUNCH_KILL, &diag) != GROOM_OK)
            complain(s, &diag);
    }
    s->swept = true;
}

/* The names of those that squeue is asked for; malloc'ed, NULL where memory is out. */
static char *join_names(struct slurm *s)
{
    size_t n = 1, at = 0;
    for (struct entry *entry = s->entries; entry; entry = entry->next)
        n += strlen(entry->name) + 1;
    char *names = malloc(n);
    if (!names)
        return NULL;
    names[0] = 0;
    for (struct entry *entry = s->entries; entry; entry = entry->next)
        if (entry->state == ENTRY_THERE || entry->state == ENTRY_DOUBTED)
            at += (size_t)snprintf(names + at, n - at, "%s%s", at ? "," : "", entry->name);
    return names;
}

static bool is_asked_for(const char *names, const char *name)
{
    size_t n = strlen(name);
    for (const char *at = strstr(names, name); at; at = strstr(at + 1, name))
        if ((at == names || at[-1] == ',') && (at[n] == ',' || !at[n]))
            return true;
    return false;
}

static int64_t until_next_look(struct slurm *s)
{
    for (struct entry *entry = s->entries; entry; entry = entry->next)
        if ((entry->stopping || entry->missed) && entry->state != ENTRY_ENDED && s->interval_ms > SOON_MS)
            return SOON_MS;
    return s->interval_ms;
}

static bool look(struct slurm *s)
{
    struct slurm_rows rows;
    struct groom_diag diag = {0};
    bool wanted = find_state(s, ENTRY_THERE) || find_state(s, ENTRY_DOUBTED) || !s->swept;
    if (!wanted || now_ms() < s->look_ms)
        return false;
    char *names = join_names(s);
    pthread_mutex_unlock(&s->lock);
    groom_status status = names ? slurm_list(&s->commands, s->swept ? names : NULL, &rows, &diag)
                                : groom_fail(&diag, GROOM_ENOMEM, "no memory");
    if (status == GROOM_OK && !s->swept)
        sweep(s, &rows);
    pthread_mutex_lock(&s->lock);
    if (status == GROOM_OK) {
        calm_down(s);
        for (struct entry *entry = s->entries; entry; entry = entry->next)
            if ((entry->state == ENTRY_THERE || entry->state == ENTRY_DOUBTED) && is_asked_for(names, entry->name))
                apply_row(entry, find_row(&rows, entry->name));
        free(rows.items);
    } else {
        complain(s, &diag);
    }
    free(names);
    s->look_ms = now_ms() + (status == GROOM_OK ? until_next_look(s) : RETRY_MS);
    return true;
}

/* --- the thread ------------------------------------------------------------------------------------- */

static void sleep_a_little(struct slurm *s)
{
    struct timespec until;
    int64_t until_ms = now_ms() + (s->entries || !s->swept ? 100 : 60000);
    until.tv_sec = until_ms / 1000;
    until.tv_nsec = until_ms % 1000 * 1000000;
    pthread_cond_timedwait(&s->wake, &s->lock, &until);
}

static void *work(void *user)
{
    struct slurm *s = user;
    pthread_mutex_lock(&s->lock);
    while (!s->ending)
        if (!stop_one(s) && !submit_one(s) && !look(s))
            sleep_a_little(s);
    pthread_mutex_unlock(&s->lock);
    return NULL;
}

/* --- the table ---------------------------------------------------------------------------------------- */

static void slurm_handle_of(const char *name, char handle[LAUNCH_HANDLE_SIZE])
{
    snprintf(handle, LAUNCH_HANDLE_SIZE, HANDLE_PREFIX "%s", name);
}

/* NULL for a handle that is not ours. */
static const char *name_of(const char *handle)
{
    size_t n = strlen(HANDLE_PREFIX);
    return strncmp(handle, HANDLE_PREFIX, n) || !handle[n] || strlen(handle + n) >= SLURM_NAME_SIZE ||
                   handle[n + strspn(handle + n, "abcdefghijklmnopqrstuvwxyz0123456789_.")]
               ? NULL
               : handle + n;
}

static groom_status slurm_start(struct launcher *launcher, const struct launch_spec *spec,
                                char handle[LAUNCH_HANDLE_SIZE], struct groom_diag *diag)
{
    struct slurm *s = (struct slurm *)launcher;
    char made[LAUNCH_HANDLE_SIZE];
    slurm_handle_of(spec->name, made);
    if (!name_of(made))
        return groom_fail(diag, GROOM_EINVAL, "%.60s is no name for a Slurm job", spec->name);
    struct slurm_order *order = slurm_order_copy(spec);
    pthread_mutex_lock(&s->lock);
    struct entry *entry = order ? add_entry(s, spec->name, ENTRY_NEW) : NULL;
    if (entry)
        entry->order = order;
    pthread_cond_signal(&s->wake);
    pthread_mutex_unlock(&s->lock);
    if (!entry) {
        slurm_order_destroy(order);
        return groom_fail(diag, GROOM_ENOMEM, "no memory to launch %.60s", spec->name);
    }
    memcpy(handle, made, LAUNCH_HANDLE_SIZE);
    return GROOM_OK;
}

/* A name that is not known was launched by a former daemon: squeue will tell. */
static groom_status slurm_poll(struct launcher *launcher, const char *handle, struct launch_status *status,
                               struct groom_diag *diag)
{
    struct slurm *s = (struct slurm *)launcher;
    const char *name = name_of(handle);
    *status = (struct launch_status){.state = LAUNCH_RUNNING};
    if (!name) {
        *status = (struct launch_status){.state = LAUNCH_ENDED, .unknown = true, .words = "gone: it was not launched by Slurm"};
        return GROOM_OK;
    }
    pthread_mutex_lock(&s->lock);
    struct entry *entry = find(s, name);
    if (!entry) {
        entry = add_entry(s, name, ENTRY_THERE);
        pthread_cond_signal(&s->wake);
    } else if (entry->state == ENTRY_ENDED) {
        status->state = LAUNCH_ENDED;
        status->unknown = entry->unknown;
        memcpy(status->words, entry->words, sizeof status->words);
        remove_entry(s, entry);
    }
    pthread_mutex_unlock(&s->lock);
    return entry ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to ask for %.60s", name);
}

static groom_status slurm_stop(struct launcher *launcher, const char *handle, enum launch_stop how,
                               struct groom_diag *diag)
{
    struct slurm *s = (struct slurm *)launcher;
    const char *name = name_of(handle);
    if (!name)
        return GROOM_OK;
    pthread_mutex_lock(&s->lock);
    struct entry *entry = find(s, name);
    if (!entry)
        entry = add_entry(s, name, ENTRY_THERE);
    if (entry && entry->state == ENTRY_NEW)
        end_entry(entry, false, "stopped before it was submitted");
    else if (entry && entry->state != ENTRY_ENDED) {
        entry->stopping = entry->stop_due = true;
        entry->stop = how;
        entry->due_ms = 0;
    }
    pthread_cond_signal(&s->wake);
    pthread_mutex_unlock(&s->lock);
    return entry ? GROOM_OK : groom_fail(diag, GROOM_ENOMEM, "no memory to stop %.60s", name);
}

/* What runs lives on; what was not submitted yet is begun anew by the next daemon. */
static void slurm_destroy(struct launcher *launcher)
{
    struct slurm *s = (struct slurm *)launcher;
    atomic_store(&s->commands.give_up, true);
    if (s->has_thread) {
        pthread_mutex_lock(&s->lock);
        s->ending = true;
        pthread_cond_signal(&s->wake);
        pthread_mutex_unlock(&s->lock);
        pthread_join(s->thread, NULL);
    }
    while (s->entries)
        remove_entry(s, s->entries);
    slurm_commands_finish(&s->commands);
    pthread_cond_destroy(&s->wake);
    pthread_mutex_destroy(&s->lock);
    free(s);
}

static const struct launcher_table slurm_table = {"slurm",    slurm_handle_of, 100,          slurm_start,
                                                  slurm_poll, slurm_stop,      slurm_destroy};

groom_status launch_slurm_create(const struct launch_slurm_options *options, struct launcher **launcher,
                                 struct groom_diag *diag)
{
    pthread_condattr_t monotonic;
    struct slurm *s = calloc(1, sizeof *s);
    if (!s)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the launcher");
    s->launcher.table = &slurm_table;
    s->stale = options->stale;
    s->stale_user = options->user;
    s->swept = !options->stale;
    s->interval_ms = options->interval_ms ? options->interval_ms : 2000;
    pthread_mutex_init(&s->lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&s->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
    groom_status status = slurm_commands_init(options, &s->commands, diag);
    if (status == GROOM_OK && pthread_create(&s->thread, NULL, work, s) != 0)
        status = groom_fail(diag, GROOM_ENOMEM, "no thread for the launcher");
    s->has_thread = status == GROOM_OK;
    if (status != GROOM_OK) {
        slurm_destroy(&s->launcher);
        return status;
    }
    *launcher = &s->launcher;
    return GROOM_OK;
}
