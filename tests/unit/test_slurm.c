/* The Slurm launcher over scripts that play sbatch, squeue and scancel: a row a job in the file `jobs`,
 * and a file for each way in which they misbehave. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "server/jobs/size.h"
#include "server/jobs/supervisor.h"
#include "server/jobs/work.h"
#include "server/launch/launch.h"
#include "tests/support/folder.h"
#include "tests/support/test.h"

static struct groom_diag diag;
static char folder[512], path[600];

static void nap(int ms)
{
    struct timespec time = {ms / 1000, ms % 1000 * 1000000L};
    nanosleep(&time, NULL);
}

/* --- a cluster of shell scripts ---------------------------------------------------------- */

/* In one piece: the scripts read while we write. */
static void write_file(const char *name, const char *text)
{
    char part[700];
    FILE *file = fopen(test_folder_path("part"), "w");
    ck_assert_ptr_nonnull(file);
    fputs(text, file);
    fclose(file);
    snprintf(part, sizeof part, "%s", test_folder_path("part"));
    ck_assert_int_eq(rename(part, test_folder_path(name)), 0);
}

static char *read_file(const char *name)
{
    static char text[8192];
    FILE *file = fopen(test_folder_path(name), "r");
    size_t n = file ? fread(text, 1, sizeof text - 1, file) : 0;
    text[n] = 0;
    if (file)
        fclose(file);
    return text;
}

static void write_program(const char *name, const char *body)
{
    char text[4096];
    snprintf(text, sizeof text, "#!/bin/sh\nD='%s'\n%s", folder, body);
    write_file(name, text);
    ck_assert_int_eq(chmod(test_folder_path(name), 0700), 0);
}

static void make_cluster(void)
{
    test_folder_make();
    snprintf(folder, sizeof folder, "%s", test_folder_path(""));
    folder[strcspn(folder, "\n")] = 0;
    snprintf(path, sizeof path, "%s:/usr/bin:/bin", folder);
    write_file("jobs", "");
    write_program("sbatch",
                  "printf '%s\\n' \"$@\" > $D/sbatch.args; env > $D/sbatch.env; echo x >> $D/sbatch.calls\n"
                  "[ -e $D/unreachable ] && { echo 'sbatch: error: Unable to contact slurm controller (connect failure)' >&2;"
                  " exit 1; }\n"
                  "[ -e $D/refuse ] && { echo 'sbatch: error: Batch job submission failed: Requested node configuration"
                  " is not available' >&2; exit 1; }\n"
                  "[ -e $D/hang ] && { rm $D/hang; [ -e $D/lose ] || echo 'job_a.1|PENDING|0|n/a|18|Priority|' >> $D/jobs;"
                  " rm -f $D/lose; sleep 60; }\n"
                  "for a in \"$@\"; do case $a in --job-name=*) n=${a#--job-name=};; esac; done\n"
                  "echo \"$n|RUNNING|0|d1|17|None|\" >> $D/jobs; echo 17\n");
    write_program("squeue",
                  "printf '%s\\n' \"$*\" >> $D/squeue.calls\n"
                  "[ -e $D/silent ] && { echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2; exit 1; }\n"
                  "[ -e $D/slow ] && { rm $D/slow; sleep 60; }\n"
                  "cat $D/jobs\n");
    write_program("scancel",
                  "printf '%s\\n' \"$*\" >> $D/scancel.calls\n"
                  "[ -e $D/deaf ] && { rm $D/deaf; echo 'scancel: error: Unable to contact slurm controller' >&2; exit 1; }\n"
                  "case \"$*\" in *KILL*) sed -i 's/|RUNNING|0|/|FAILED|9|/' $D/jobs;;"
                  " *PENDING*) sed -i 's/|PENDING|0|/|CANCELLED|0|/' $D/jobs;; esac\n");
}

static struct launcher *make_launcher(void)
{
    struct launcher *launcher;
    const struct launch_slurm_options options = {.folder = folder, .log_folder = "/nodes/logs", .path = path,
                                                 .arguments = "--partition=hair  --qos=$(touch$IFS/tmp/owned)",
                                                 .interval_ms = 20, .wall_ms = 500};
    ck_ok(launch_slurm_create(&options, &launcher, &diag));
    return launcher;
}

static void start_job(struct launcher *launcher, char handle[LAUNCH_HANDLE_SIZE])
{
    static const char *const argv[] = {"/opt/groom worker", "attempt", "; rm -rf $HOME", NULL};
    static const char *const env[] = {"GROOM_WORK_URL=http://d", "GROOM_WORK_TOKEN=se cret", NULL};
    const struct launch_spec spec = {.argv = argv, .env = env, .name = "job_a.1", .log_path = "/data/logs/job_a.1.log",
                                     .limits = {.memory_bytes = 1u << 30},
                                     .size = {.threads = 4, .memory_bytes = 3000u << 20, .wall_s = 3600}};
    ck_ok(launcher->table->start(launcher, &spec, handle, &diag));
    ck_assert_str_eq(handle, "slurm:job_a.1");
}

static struct launch_status poll_once(struct launcher *launcher, const char *handle)
{
    struct launch_status status;
    ck_ok(launcher->table->poll(launcher, handle, &status, &diag));
    return status;
}

static struct launch_status wait_end(struct launcher *launcher, const char *handle)
{
    struct launch_status status = {.state = LAUNCH_RUNNING};
    for (int i = 0; i < 3000 && status.state == LAUNCH_RUNNING; i++) {
        status = poll_once(launcher, handle);
        nap(5);
    }
    ck_assert_int_eq(status.state, LAUNCH_ENDED);
    return status;
}

static void wait_text(const char *file, const char *text)
{
    for (int i = 0; i < 3000 && !strstr(read_file(file), text); i++)
        nap(5);
    ck_assert_msg(strstr(read_file(file), text) != NULL, "%s has no %s: %s", file, text, read_file(file));
}

static void finish(struct launcher *launcher)
{
    launch_destroy(launcher);
    test_folder_remove();
}

/* --- a job's way ---------------------------------------------------------------------------- */

START_TEST(a_job_is_submitted_with_its_size_and_no_shell_reads_it)
{
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    struct launcher *launcher = make_launcher();
    start_job(launcher, handle);
    wait_text("jobs", "job_a.1");
    const char *args = read_file("sbatch.args");
    static const char *const wanted[] = {"--job-name=job_a.1\n", "--requeue\n", "--cpus-per-task=4\n", "--mem=3000M\n",
                                         "--time=61\n", "--output=/nodes/logs/job_a.1.log\n",
                                         "--export=GROOM_WORK_URL,GROOM_WORK_TOKEN\n", "--dependency=singleton\n",
                                         "--partition=hair\n--qos=$(touch$IFS/tmp/owned)\n",
                                         "1048576\nunlimited\nunlimited\n/opt/groom worker\nattempt\n; rm -rf $HOME\n"};
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; i++)
        ck_assert_msg(strstr(args, wanted[i]) != NULL, "%s is not in\n%s", wanted[i], args);
    ck_assert_ptr_null(strstr(args, "se cret")); /* it would be seen in the list of processes */
    ck_assert_ptr_nonnull(strstr(read_file("sbatch.env"), "GROOM_WORK_TOKEN=se cret\n"));
    ck_assert_int_eq(poll_once(launcher, handle).state, LAUNCH_RUNNING);
    finish(launcher);
}
END_TEST

/* The script itself, as a node runs it. */
START_TEST(the_batch_script_passes_arguments_and_counts_runs)
{
    char command[1200], *out;
    make_cluster();
    struct launcher *launcher = make_launcher();
    snprintf(command, sizeof command,
             "cd %s && SLURM_RESTART_COUNT=2 ./slurm-attempt.sh 2000000 100 unlimited /bin/sh -c"
             " 'echo \"$GROOM_WORK_RUN|$0|$(ulimit -v)|$(ulimit -t)|$(ulimit -c)\"' 'a  b;c' > out && "
             "env -u SLURM_RESTART_COUNT ./slurm-attempt.sh unlimited unlimited unlimited /bin/sh -c 'echo $GROOM_WORK_RUN' >> out",
             folder);
    ck_assert_int_eq(system(command), 0);
    out = read_file("out");
    ck_assert_str_eq(out, "2|a  b;c|2000000|100|0\n0\n");
    finish(launcher);
}
END_TEST

START_TEST(ends_are_told_as_squeue_has_them)
{
    static const struct {
        const char *row, *words;
    } ends[] = {
        {"job_a.1|FAILED|1792|d1|17|NonZeroExitCode|\n",
         "exit status 7, FAILED (Slurm job 17 on d1, NonZeroExitCode)"},
        {"job_a.1|OUT_OF_MEMORY|9|d2|17|OutOfMemory|\n",
         "signal 9 (Killed), OUT_OF_MEMORY (Slurm job 17 on d2, OutOfMemory)"},
        {"job_a.1|TIMEOUT|0|d1|17|TimeLimit|\n", "TIMEOUT (Slurm job 17 on d1, TimeLimit)"},
        {"job_a.1|COMPLETED|0|d1|17|None|\n", "COMPLETED (Slurm job 17 on d1)"},
        {"job_a.1|NODE_FAIL|0|d1|17|NodeDown|\n", "NODE_FAIL (Slurm job 17 on d1, NodeDown)"},
        {"", "gone: Slurm does not know it (any more)"},
        {"job_b.1|RUNNING|0|d1|18|None|\ngarbage\n|||\n", "gone: Slurm does not know it (any more)"},
    };
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    struct launcher *launcher = make_launcher();
    for (size_t i = 0; i < sizeof ends / sizeof ends[0]; i++) {
        write_file("jobs", "");
        start_job(launcher, handle);
        wait_text("jobs", "job_a.1");
        write_file("jobs", ends[i].row);
        struct launch_status status = wait_end(launcher, handle);
        ck_assert_str_eq(status.words, ends[i].words);
        ck_assert_int_eq(status.unknown, strstr(ends[i].words, "gone") != NULL);
    }
    finish(launcher);
}
END_TEST

/* Slurm starts it again elsewhere: for us it has not ended. */
START_TEST(a_job_whose_node_failed_runs_on)
{
    static const char *const rows[] = {"job_a.1|PENDING|0|n/a|17|BeginTime|\n", "job_a.1|REQUEUED|0|n/a|17|None|\n",
                                       "job_a.1|CONFIGURING|0|d2|17|None|\n", "job_a.1|RUNNING|0|d2|17|None|\n"};
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    struct launcher *launcher = make_launcher();
    start_job(launcher, handle);
    wait_text("jobs", "job_a.1");
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        write_file("jobs", rows[i]);
        nap(100);
        ck_assert_int_eq(poll_once(launcher, handle).state, LAUNCH_RUNNING);
    }
    finish(launcher);
}
END_TEST

START_TEST(a_job_that_slurm_gave_up_starting_is_taken_out)
{
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    struct launcher *launcher = make_launcher();
    start_job(launcher, handle);
    wait_text("jobs", "job_a.1");
    write_file("jobs", "job_a.1|PENDING|0|n/a|17|launch failed requeued held|\n");
    wait_text("scancel.calls", "--name=job_a.1");
    finish(launcher);
}
END_TEST

/* --- sbatch fails ------------------------------------------------------------------------------ */

START_TEST(a_refused_job_ends_with_what_sbatch_said)
{
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    write_file("refuse", "");
    struct launcher *launcher = make_launcher();
    start_job(launcher, handle);
    ck_assert_str_eq(wait_end(launcher, handle).words,
                     "Slurm refused it: sbatch: error: Batch job submission failed: Requested node configuration is not "
                     "available");
    finish(launcher);
}
END_TEST

START_TEST(a_job_waits_for_a_controller_that_is_away_and_can_be_stopped_meanwhile)
{
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    write_file("unreachable", "");
    struct launcher *launcher = make_launcher();
    start_job(launcher, handle);
    wait_text("sbatch.calls", "x");
    nap(50);
    ck_assert_int_eq(poll_once(launcher, handle).state, LAUNCH_RUNNING);
    ck_ok(launcher->table->stop(launcher, handle, LAUNCH_TERMINATE, &diag));
    ck_assert_str_eq(wait_end(launcher, handle).words, "stopped before it was submitted");
    finish(launcher);
}
END_TEST

/* No answer from sbatch: squeue tells whether the job is there. */
START_TEST(a_doubtful_submission_is_found_or_repeated)
{
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    write_file("hang", "");
    struct launcher *launcher = make_launcher();
    start_job(launcher, handle);
    wait_text("squeue.calls", "job_a.1");
    nap(100);
    ck_assert_str_eq(read_file("sbatch.calls"), "x\n"); /* found: not submitted twice */
    ck_assert_int_eq(poll_once(launcher, handle).state, LAUNCH_RUNNING);
    launch_destroy(launcher);
    write_file("jobs", "");
    write_file("hang", "");
    write_file("lose", "");
    launcher = make_launcher();
    start_job(launcher, handle);
    wait_text("jobs", "job_a.1|RUNNING");
    ck_assert_str_eq(read_file("sbatch.calls"), "x\nx\nx\n");
    finish(launcher);
}
END_TEST

/* --- squeue and scancel fail --------------------------------------------------------------------- */

START_TEST(a_silent_squeue_ends_nothing)
{
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    struct launcher *launcher = make_launcher();
    start_job(launcher, handle);
    wait_text("jobs", "job_a.1");
    write_file("slow", "");
    write_file("silent", "");
    nap(200);
    ck_assert_int_eq(poll_once(launcher, handle).state, LAUNCH_RUNNING);
    finish(launcher);
}
END_TEST

START_TEST(a_job_is_stopped_whether_it_waits_or_runs)
{
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    struct launcher *launcher = make_launcher();
    start_job(launcher, handle);
    wait_text("jobs", "job_a.1");
    ck_ok(launcher->table->stop(launcher, handle, LAUNCH_TERMINATE, &diag));
    wait_text("scancel.calls", "--signal=TERM --name=job_a.1\n");
    wait_text("scancel.calls", "--name=job_a.1 --state=PENDING\n");
    ck_assert_int_eq(poll_once(launcher, handle).state, LAUNCH_RUNNING);
    ck_ok(launcher->table->stop(launcher, handle, LAUNCH_KILL, &diag));
    ck_assert_str_eq(wait_end(launcher, handle).words, "signal 9 (Killed), FAILED (Slurm job 17 on d1)");
    ck_ok(launcher->table->stop(launcher, "nonsense", LAUNCH_KILL, &diag));
    ck_ok(launcher->table->stop(launcher, "slurm:a,b;c", LAUNCH_KILL, &diag));
    ck_assert_int_eq(poll_once(launcher, "local:1:2:3").state, LAUNCH_ENDED);
    finish(launcher);
}
END_TEST

START_TEST(a_job_of_a_former_daemon_is_found_by_its_name)
{
    char handle[LAUNCH_HANDLE_SIZE];
    make_cluster();
    struct launcher *launcher = make_launcher();
    start_job(launcher, handle);
    wait_text("jobs", "job_a.1");
    launch_destroy(launcher); /* it is left running */
    ck_assert_str_eq(read_file("scancel.calls"), "");
    launcher = make_launcher();
    ck_assert_int_eq(poll_once(launcher, handle).state, LAUNCH_RUNNING);
    nap(100);
    ck_assert_int_eq(poll_once(launcher, handle).state, LAUNCH_RUNNING);
    write_file("jobs", "");
    ck_assert(wait_end(launcher, handle).unknown);
    finish(launcher);
}
END_TEST

static bool is_stale(void *user, const char *name) { return !strcmp(name, user); }

START_TEST(what_nobody_wants_any_more_is_cancelled_at_the_start)
{
    struct launcher *launcher;
    make_cluster();
    write_file("jobs", "job_old.3|PENDING|0|n/a|5|Priority|\njob_live.1|RUNNING|0|d1|6|None|\nother|RUNNING|0|d1|7|None|\n");
    struct launch_slurm_options options = {.folder = folder, .path = path, .stale = is_stale, .user = (char[]){"job_old.3"}};
    ck_ok(launch_slurm_create(&options, &launcher, &diag));
    wait_text("scancel.calls", "job_old.3");
    nap(50);
    ck_assert_ptr_null(strstr(read_file("scancel.calls"), "job_live"));
    ck_assert_ptr_null(strstr(read_file("scancel.calls"), "other"));
    finish(launcher);
}
END_TEST

START_TEST(a_missing_program_is_named)
{
    struct launcher *launcher;
    test_folder_make();
    const struct launch_slurm_options options = {.folder = test_folder_path(""), .path = test_folder_path("")};
    ck_status(launch_slurm_create(&options, &launcher, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "sbatch"));
    test_folder_remove();
}
END_TEST

/* --- with the supervisor --------------------------------------------------------------------------- */

static struct store *store;
static struct blobs *blobs;
static struct jobs *jobs;
static struct launcher *cluster;
static struct supervisor *supervisor;

static void open_daemon(void)
{
    static const char *const argv[] = {"/bin/worker", NULL};
    static char logs[600];
    struct supervisor_options options = {.worker_argv = argv, .work_url = "http://d", .backoff_ms = 20,
                                         .cancel_grace_ms = 50};
    snprintf(logs, sizeof logs, "%s", test_folder_path("logs"));
    ck_ok(store_open(test_folder_path("groomd.db"), &store, &diag));
    ck_ok(blobs_open(test_folder_path("blobs"), NULL, &blobs, &diag));
    ck_ok(jobs_create(store, blobs, &jobs, &diag));
    const struct launch_slurm_options slurm = {.folder = folder, .path = path, .interval_ms = 20, .wall_ms = 2000,
                                               .stale = jobs_attempt_is_stale, .user = jobs};
    ck_ok(launch_slurm_create(&slurm, &cluster, &diag));
    options.launcher = cluster;
    options.log_folder = logs;
    ck_ok(supervisor_start(jobs, &options, &supervisor, &diag));
}

static void close_daemon(void)
{
    supervisor_destroy(supervisor);
    launch_destroy(cluster);
    jobs_destroy(jobs);
    blobs_close(blobs);
    store_close(store);
}

static void submit_job(char id[STORE_ID_SIZE])
{
    const struct jobs_request request = {.kind = "fit", .inputs = "{\"strands\":\"str_a\"}", .options = "{}"};
    struct store_job job;
    ck_ok(jobs_submit(jobs, &request, &job, &diag));
    memcpy(id, job.id, STORE_ID_SIZE);
    store_job_finish(&job);
}

static struct store_job wait_job(const char *id, enum store_job_state state)
{
    struct store_job job = {0};
    for (int i = 0; i < 3000; i++) {
        store_job_finish(&job);
        ck_ok(jobs_get(jobs, id, &job, &diag));
        if (job.state == state)
            return job;
        nap(5);
    }
    ck_abort_msg("the job is %s", store_job_state_name(job.state));
}

static void read_token(char token[WORK_TOKEN_SIZE + 8])
{
    const char *at = strstr(read_file("sbatch.env"), "GROOM_WORK_TOKEN=");
    ck_assert_ptr_nonnull(at);
    snprintf(token, WORK_TOKEN_SIZE, "%s", at + strlen("GROOM_WORK_TOKEN="));
}

/* The daemon ends and another begins: the attempt goes on under the same token. */
START_TEST(an_attempt_goes_on_through_a_restart_of_the_daemon)
{
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE + 8];
    struct store_attempt_ref ref;
    make_cluster();
    open_daemon();
    submit_job(id);
    wait_text("jobs", id);
    read_token(token);
    close_daemon();
    ck_assert_str_eq(read_file("scancel.calls"), "");
    open_daemon();
    ck_ok(work_authenticate(jobs, token, &ref, &diag));
    ck_assert_uint_eq(ref.number, 1);
    struct store_revision_new groom = {.groom_id = "grm_a", .name = "", .document = "{}", .note = "fit"};
    ck_ok(work_result(jobs, &ref, &groom, &diag));
    struct store_job job = wait_job(id, STORE_JOB_SUCCEEDED);
    ck_assert_uint_eq(job.attempt, 1);
    store_job_finish(&job);
    close_daemon();
    test_folder_remove();
}
END_TEST

/* It ended, and Slurm forgot it, while no daemon looked: nobody's fault. */
START_TEST(an_attempt_that_vanished_while_the_daemon_was_away_is_begun_again)
{
    char id[STORE_ID_SIZE];
    make_cluster();
    open_daemon();
    submit_job(id);
    wait_text("jobs", id);
    close_daemon();
    write_file("jobs", "");
    open_daemon();
    wait_text("jobs", ".2|RUNNING");
    struct store_job job = wait_job(id, STORE_JOB_RUNNING);
    ck_assert_uint_eq(job.attempt, 2);
    ck_assert_uint_eq(job.n_failures, 0);
    store_job_finish(&job);
    close_daemon();
    test_folder_remove();
}
END_TEST

/* The run that Slurm starts after a failed node speaks under the same token, and the old one is silenced. */
START_TEST(a_restarted_run_takes_the_attempt_over)
{
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE + 8], *order;
    struct store_attempt_ref first, second, other;
    bool cancel;
    make_cluster();
    struct store_asset asset = {.kind = STORE_STRANDS, .id = "str_a", .sha256 = "ab", .format = (char[]){"hair"},
                                .unit_m = 1, .up = 'y', .name = (char[]){""}, .metadata = (char[]){"{}"}};
    open_daemon();
    ck_ok(store_asset_put(store, &asset, 0, &(bool){0}, &diag));
    submit_job(id);
    wait_text("jobs", id);
    read_token(token);
    ck_ok(work_authenticate(jobs, token, &first, &diag));
    ck_ok(work_begin(jobs, &first, &diag));
    ck_ok(work_progress(jobs, &first, "{}", 2, &cancel, &diag));
    strcat(token, ".1");
    ck_ok(work_authenticate(jobs, token, &second, &diag));
    ck_ok(work_begin(jobs, &second, &diag));
    ck_ok(work_describe(jobs, &second, &order, &diag));
    free(order);
    ck_status(work_progress(jobs, &first, "{}", 2, &cancel, &diag), GROOM_ECONFLICT);
    ck_ok(work_progress(jobs, &second, "{}", 2, &cancel, &diag));
    strcat(token, "x");
    ck_status(work_authenticate(jobs, token, &other, &diag), GROOM_ENOTFOUND);
    close_daemon();
    test_folder_remove();
}
END_TEST

/* The process says how it ended before squeue knows. */
START_TEST(last_words_reach_the_job)
{
    char id[STORE_ID_SIZE], token[WORK_TOKEN_SIZE + 8];
    struct store_attempt_ref ref;
    const char *body = "{\"words\":\"signal 11 (Segmentation fault)\\nout of luck\"}";
    make_cluster();
    open_daemon();
    submit_job(id);
    wait_text("jobs", id);
    read_token(token);
    ck_ok(work_authenticate(jobs, token, &ref, &diag));
    ck_status(work_ended(jobs, &ref, "{}", 2, &diag), GROOM_EINVAL);
    ck_ok(work_ended(jobs, &ref, body, strlen(body), &diag));
    struct store_attempt_list attempts = {0};
    for (int i = 0; i < 3000 && (attempts.n == 0 || attempts.items[0].state == STORE_ATTEMPT_RUNNING); i++) {
        store_attempt_list_finish(&attempts);
        ck_ok(store_attempts_list(store, id, &attempts, &diag));
        nap(5);
    }
    ck_assert_int_eq(attempts.items[0].state, STORE_ATTEMPT_DIED);
    ck_assert_str_eq(attempts.items[0].last_words, "signal 11 (Segmentation fault)\nout of luck");
    store_attempt_list_finish(&attempts);
    close_daemon();
    test_folder_remove();
}
END_TEST

START_TEST(a_cancelled_job_leaves_the_cluster)
{
    char id[STORE_ID_SIZE];
    struct store_job job;
    make_cluster();
    open_daemon();
    submit_job(id);
    wait_text("jobs", id);
    write_file("deaf", ""); /* once: it is told again */
    ck_ok(jobs_cancel(jobs, id, &job, &diag));
    store_job_finish(&job);
    job = wait_job(id, STORE_JOB_CANCELLED);
    store_job_finish(&job);
    ck_assert_ptr_nonnull(strstr(read_file("jobs"), "FAILED|9"));
    close_daemon();
    test_folder_remove();
}
END_TEST

START_TEST(a_larger_job_asks_for_more)
{
    struct launch_size small = size_of_fit(1000, "draft"), large = size_of_fit(20000000, "standard"),
                       high = size_of_fit(20000000, "high");
    ck_assert_uint_eq(small.threads, 1);
    ck_assert_uint_gt(large.threads, 4);
    ck_assert_uint_gt(large.memory_bytes, 2 * small.memory_bytes);
    ck_assert_uint_gt(large.wall_s, small.wall_s);
    ck_assert_uint_gt(high.wall_s, large.wall_s);
}
END_TEST

TEST_SUITE("slurm", a_job_is_submitted_with_its_size_and_no_shell_reads_it,
           the_batch_script_passes_arguments_and_counts_runs, ends_are_told_as_squeue_has_them,
           a_job_whose_node_failed_runs_on, a_job_that_slurm_gave_up_starting_is_taken_out,
           a_refused_job_ends_with_what_sbatch_said,
           a_job_waits_for_a_controller_that_is_away_and_can_be_stopped_meanwhile,
           a_doubtful_submission_is_found_or_repeated, a_silent_squeue_ends_nothing,
           a_job_is_stopped_whether_it_waits_or_runs, a_job_of_a_former_daemon_is_found_by_its_name,
           what_nobody_wants_any_more_is_cancelled_at_the_start, a_missing_program_is_named,
           an_attempt_goes_on_through_a_restart_of_the_daemon,
           an_attempt_that_vanished_while_the_daemon_was_away_is_begun_again, a_restarted_run_takes_the_attempt_over,
           last_words_reach_the_job, a_cancelled_job_leaves_the_cluster, a_larger_job_asks_for_more)
