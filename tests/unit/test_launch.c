/* Launching: what a process is given, how it ends, and that nothing outlives its time. */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "server/launch/child.h"
#include "tests/support/folder.h"
#include "tests/support/test.h"

static struct groom_diag diag;

static void nap(int ms)
{
    struct timespec time = {ms / 1000, ms % 1000 * 1000000L};
    nanosleep(&time, NULL);
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* --- children -------------------------------------------------------------------------- */

static struct child_result run_shell(const char *script, struct child_spec spec)
{
    const char *argv[] = {"/bin/sh", "-c", script, NULL};
    struct child_result result = {0};
    spec.argv = argv;
    ck_ok(child_run(&spec, &result, &diag));
    return result;
}

static const struct child_spec plain = {.stdin_fd = -1, .stdout_fd = -1};

START_TEST(a_child_says_and_ends)
{
    struct child_result result = run_shell("echo out; echo err >&2; exit 3", plain);
    ck_assert_int_eq(result.exit_status, 3);
    ck_assert_int_eq(result.signal, 0);
    ck_assert(!result.timed_out);
    ck_assert_str_eq(result.output, "out\n");
    ck_assert_uint_eq(result.n_output, 4);
    ck_assert_str_eq(result.words, "err\n");
    child_result_finish(&result);
}
END_TEST

START_TEST(a_child_reads_the_given_descriptor)
{
    int fd = memfd_create("input", MFD_CLOEXEC);
    struct child_spec spec = plain;
    ck_assert_int_eq(write(fd, "hello", 5), 5);
    lseek(fd, 0, SEEK_SET);
    spec.stdin_fd = fd;
    struct child_result result = run_shell("cat", spec);
    ck_assert_str_eq(result.output, "hello");
    child_result_finish(&result);
    close(fd);
}
END_TEST

START_TEST(a_child_writes_to_the_given_descriptor)
{
    int fd = memfd_create("output", MFD_CLOEXEC);
    char bytes[8] = "";
    struct child_spec spec = plain;
    spec.stdout_fd = fd;
    struct child_result result = run_shell("echo hello", spec);
    ck_assert_ptr_null(result.output);
    ck_assert_int_eq(pread(fd, bytes, 7, 0), 6);
    ck_assert_str_eq(bytes, "hello\n");
    child_result_finish(&result);
    close(fd);
}
END_TEST

/* The environment is empty but for what the shell sets, and descriptors of the daemon are closed even
 * where they were not marked. */
START_TEST(a_child_inherits_nothing)
{
    int open_fd = open("/dev/null", O_RDONLY); /* not close-on-exec, on purpose */
    setenv("GROOM_SECRET", "token", 1);
    struct child_result result = run_shell("echo \"$GROOM_SECRET\"; ls /proc/self/fd | wc -l", plain);
    /* 0, 1, 2 and the one with which ls reads the folder */
    ck_assert_str_eq(result.output, "\n4\n");
    child_result_finish(&result);
    close(open_fd);
}
END_TEST

START_TEST(a_child_has_default_signals_and_no_new_privileges)
{
    signal(SIGPIPE, SIG_IGN);
    struct child_result result = run_shell("grep -E '^(SigIgn|SigBlk|NoNewPrivs)' /proc/self/status", plain);
    ck_assert_ptr_nonnull(strstr(result.output, "SigIgn:\t0000000000000000"));
    ck_assert_ptr_nonnull(strstr(result.output, "SigBlk:\t0000000000000000"));
    ck_assert_ptr_nonnull(strstr(result.output, "NoNewPrivs:\t1"));
    child_result_finish(&result);
}
END_TEST

START_TEST(a_child_that_runs_on_is_killed_with_its_own_children)
{
    struct child_spec spec = plain;
    spec.wall_ms = 100;
    double start = seconds();
    struct child_result result = run_shell("sleep 60 & echo $!; wait", spec);
    ck_assert_double_lt(seconds() - start, 30);
    ck_assert(result.timed_out);
    ck_assert_int_eq(result.signal, SIGKILL);
    ck_assert_int_eq(result.exit_status, -1);
    pid_t sleeper = (pid_t)atoi(result.output);
    for (int i = 0; i < 500 && kill(sleeper, 0) == 0; i++)
        nap(10); /* init collects it */
    char stat[64], state[256] = "";
    snprintf(stat, sizeof stat, "/proc/%d/stat", (int)sleeper);
    FILE *file = fopen(stat, "r");
    if (file && fgets(state, sizeof state, file))
        ck_assert_msg(strstr(state, ") Z") != NULL, "it still runs: %s", state);
    if (file)
        fclose(file);
    child_result_finish(&result);
}
END_TEST

START_TEST(a_child_that_burns_its_cpu_time_is_stopped)
{
    struct child_spec spec = plain;
    spec.limits.cpu_s = 1;
    struct child_result result = run_shell("while :; do :; done", spec);
    ck_assert(result.timed_out);
    ck_assert_int_eq(result.signal, SIGXCPU);
    child_result_finish(&result);
}
END_TEST

#if !defined(__SANITIZE_THREAD__) /* which needs a file for its shadow memory */
START_TEST(a_child_may_not_write_files_where_that_is_said)
{
    struct child_spec spec = plain;
    char script[600];
    test_folder_make();
    spec.limits.file_bytes = LAUNCH_NO_FILES;
    snprintf(script, sizeof script, "trap '' XFSZ; echo x > %s/file || echo refused", test_folder_path("."));
    struct child_result result = run_shell(script, spec);
    ck_assert_ptr_nonnull(strstr(result.output, "refused"));
    child_result_finish(&result);
    test_folder_remove();
}
END_TEST
#endif

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
START_TEST(a_child_has_no_more_memory_than_said)
{
    struct child_spec spec = plain;
    spec.limits.memory_bytes = 64u << 20;
    struct child_result result = run_shell("ulimit -v", spec);
    ck_assert_int_eq(atoi(result.output), 64 << 10);
    child_result_finish(&result);
}
END_TEST
#endif

START_TEST(too_much_output_is_refused)
{
    const char *argv[] = {"/bin/sh", "-c", "while :; do echo 0123456789; done", NULL};
    struct child_spec spec = {.argv = argv, .stdin_fd = -1, .stdout_fd = -1, .max_output = 100000};
    struct child_result result;
    ck_status(child_run(&spec, &result, &diag), GROOM_ETOOBIG);
}
END_TEST

START_TEST(the_end_of_a_long_complaint_is_kept)
{
    struct child_result result =
        run_shell("i=0; while [ $i -lt 2000 ]; do echo line $i >&2; i=$((i+1)); done", plain);
    size_t n = strlen(result.words);
    ck_assert_uint_eq(n, CHILD_WORDS_SIZE - 1);
    ck_assert_str_eq(result.words + n - 10, "line 1999\n");
    child_result_finish(&result);
}
END_TEST

START_TEST(a_program_that_is_missing_is_named)
{
    const char *argv[] = {"/nonexistent/tool", NULL};
    struct child_spec spec = {.argv = argv, .stdin_fd = -1, .stdout_fd = -1};
    struct child_result result;
    struct child *child;
    int fd;
    ck_status(child_run(&spec, &result, &diag), GROOM_EIO);
    ck_assert_ptr_nonnull(strstr(diag.detail, "/nonexistent/tool"));
    ck_status(child_start(&spec, &child, &fd, &diag), GROOM_EIO);
    ck_assert_ptr_nonnull(strstr(diag.detail, "/nonexistent/tool"));
}
END_TEST

START_TEST(a_streaming_child_is_read_to_its_end)
{
    const char *argv[] = {"/bin/sh", "-c", "head -c 1000000 /dev/zero; echo done >&2; exit 4", NULL};
    struct child_spec spec = {.argv = argv, .stdin_fd = -1};
    struct child *child;
    struct child_result result;
    char bytes[4096];
    size_t total = 0;
    ssize_t n;
    int fd;
    ck_ok(child_start(&spec, &child, &fd, &diag));
    while ((n = read(fd, bytes, sizeof bytes)) > 0)
        total += (size_t)n;
    close(fd);
    ck_ok(child_wait(child, &result, &diag));
    ck_assert_uint_eq(total, 1000000);
    ck_assert_int_eq(result.exit_status, 4);
    ck_assert_str_eq(result.words, "done\n");
    child_result_finish(&result);
}
END_TEST

START_TEST(a_streaming_child_ends_when_its_reader_goes)
{
    const char *argv[] = {"/bin/sh", "-c", "exec cat /dev/zero", NULL};
    struct child_spec spec = {.argv = argv, .stdin_fd = -1};
    struct child *child;
    struct child_result result;
    int fd;
    ck_ok(child_start(&spec, &child, &fd, &diag));
    close(fd);
    ck_ok(child_wait(child, &result, &diag));
    ck_assert_int_eq(result.signal, SIGPIPE);
    child_result_finish(&result);
}
END_TEST

/* --- the local launcher ----------------------------------------------------------------------- */

static struct launcher *make_launcher(void)
{
    struct launcher *launcher;
    test_folder_make();
    ck_ok(launch_local_create(&launcher, &diag));
    return launcher;
}

static groom_status start_shell(struct launcher *launcher, const char *script, char handle[LAUNCH_HANDLE_SIZE])
{
    const char *argv[] = {"/bin/sh", "-c", script, NULL};
    const char *env[] = {"GROOM_WORK_TOKEN=secret", NULL};
    struct launch_spec spec = {.argv = argv, .env = env, .name = "test", .log_path = test_folder_path("log")};
    return launcher->table->start(launcher, &spec, handle, &diag);
}

static struct launch_status wait_end(struct launcher *launcher, const char *handle)
{
    struct launch_status status = {.state = LAUNCH_RUNNING};
    for (int i = 0; i < 3000 && status.state == LAUNCH_RUNNING; i++) {
        ck_ok(launcher->table->poll(launcher, handle, &status, &diag));
        if (status.state == LAUNCH_RUNNING)
            nap(10);
    }
    ck_assert_int_eq(status.state, LAUNCH_ENDED);
    return status;
}

static void read_log(char text[256])
{
    FILE *file = fopen(test_folder_path("log"), "r");
    ck_assert_ptr_nonnull(file);
    size_t n = fread(text, 1, 255, file);
    text[n] = 0;
    fclose(file);
}

START_TEST(an_attempt_has_its_environment_and_its_log)
{
    struct launcher *launcher = make_launcher();
    char handle[LAUNCH_HANDLE_SIZE], log[256];
    ck_ok(start_shell(launcher, "echo $GROOM_WORK_TOKEN; echo err >&2; exit 1", handle));
    ck_assert_int_eq(strncmp(handle, "local:", 6), 0);
    ck_assert_str_eq(wait_end(launcher, handle).words, "exit status 1");
    read_log(log);
    ck_assert_str_eq(log, "secret\nerr\n");
    ck_assert_str_eq(wait_end(launcher, handle).words, "gone"); /* asked again: waited for already */
    launch_destroy(launcher);
    test_folder_remove();
}
END_TEST

START_TEST(an_attempt_is_terminated_or_killed)
{
    struct launcher *launcher = make_launcher();
    struct launch_status status;
    char handle[LAUNCH_HANDLE_SIZE];
    ck_ok(start_shell(launcher, "exec sleep 60", handle));
    ck_ok(launcher->table->poll(launcher, handle, &status, &diag));
    ck_assert_int_eq(status.state, LAUNCH_RUNNING);
    ck_ok(launcher->table->stop(launcher, handle, LAUNCH_TERMINATE, &diag));
    ck_assert_str_eq(wait_end(launcher, handle).words, "signal 15 (Terminated)");
    ck_ok(launcher->table->stop(launcher, handle, LAUNCH_KILL, &diag)); /* it has ended: fine */
    ck_ok(start_shell(launcher, "trap '' TERM; echo ready; while :; do sleep 60; done", handle));
    char log[256];
    do {
        nap(5);
        read_log(log);
    } while (strcmp(log, "ready\n") != 0);
    ck_ok(launcher->table->stop(launcher, handle, LAUNCH_TERMINATE, &diag));
    nap(50);
    ck_ok(launcher->table->poll(launcher, handle, &status, &diag));
    ck_assert_int_eq(status.state, LAUNCH_RUNNING);
    ck_ok(launcher->table->stop(launcher, handle, LAUNCH_KILL, &diag));
    ck_assert_str_eq(wait_end(launcher, handle).words, "signal 9 (Killed)");
    launch_destroy(launcher);
    test_folder_remove();
}
END_TEST

/* A handle of a pid that belongs to another process by now: neither waited for nor stopped. */
START_TEST(a_reused_pid_is_left_alone)
{
    struct launcher *launcher = make_launcher();
    struct launch_status status;
    char handle[LAUNCH_HANDLE_SIZE], stale[LAUNCH_HANDLE_SIZE];
    long pid;
    pid_t innocent = fork();
    if (innocent == 0) {
        setpgid(0, 0);
        for (;;)
            pause();
    }
    setpgid(innocent, innocent);
    ck_ok(start_shell(launcher, "exec sleep 60", handle));
    ck_assert_int_eq(sscanf(handle, "local:%ld", &pid), 1);
    snprintf(stale, sizeof stale, "local:%ld:12345:%s", (long)getppid(), strrchr(handle, ':') + 1);
    ck_ok(launcher->table->poll(launcher, stale, &status, &diag));
    ck_assert_int_eq(status.state, LAUNCH_ENDED);
    ck_ok(launcher->table->stop(launcher, stale, LAUNCH_KILL, &diag)); /* the test's parent lives on */
    snprintf(stale, sizeof stale, "local:%ld:12345:%s", (long)innocent, strrchr(handle, ':') + 1);
    ck_ok(launcher->table->stop(launcher, stale, LAUNCH_KILL, &diag));
    nap(20);
    ck_assert_int_eq(waitpid(innocent, NULL, WNOHANG), 0);
    ck_ok(launcher->table->stop(launcher, "nonsense", LAUNCH_KILL, &diag));
    ck_ok(launcher->table->poll(launcher, "local:1:1:00", &status, &diag));
    ck_assert_int_eq(status.state, LAUNCH_ENDED);
    kill(innocent, SIGKILL);
    ck_ok(launcher->table->stop(launcher, handle, LAUNCH_KILL, &diag));
    wait_end(launcher, handle);
    launch_destroy(launcher);
    test_folder_remove();
}
END_TEST

/* A daemon that is killed takes its workers with it. */
START_TEST(workers_die_with_their_daemon)
{
    struct launcher *launcher = make_launcher();
    int ends[2];
    char handle[LAUNCH_HANDLE_SIZE] = "";
    ck_assert_int_eq(pipe(ends), 0);
    pid_t daemon_pid = fork();
    if (daemon_pid == 0) {
        if (start_shell(launcher, "exec sleep 60", handle) == GROOM_OK &&
            write(ends[1], handle, sizeof handle) == (ssize_t)sizeof handle)
            pause();
        _exit(1);
    }
    ck_assert_int_eq(read(ends[0], handle, sizeof handle), sizeof handle);
    struct launch_status status;
    ck_ok(launcher->table->poll(launcher, handle, &status, &diag));
    ck_assert_int_eq(status.state, LAUNCH_RUNNING); /* not our child, yet seen */
    kill(daemon_pid, SIGKILL);
    waitpid(daemon_pid, NULL, 0);
    ck_assert_str_eq(wait_end(launcher, handle).words, "gone");
    launch_destroy(launcher);
    test_folder_remove();
}
END_TEST

START_TEST(a_former_daemons_worker_is_stopped_by_its_handle)
{
    struct launcher *launcher = make_launcher();
    int ends[2];
    char handle[LAUNCH_HANDLE_SIZE] = "";
    ck_assert_int_eq(pipe(ends), 0);
    pid_t other = fork();
    if (other == 0) { /* it lives on, so that its worker does: the handle is not of our child */
        if (start_shell(launcher, "exec sleep 60", handle) == GROOM_OK &&
            write(ends[1], handle, sizeof handle) == (ssize_t)sizeof handle)
            waitpid(-1, NULL, 0);
        _exit(0);
    }
    ck_assert_int_eq(read(ends[0], handle, sizeof handle), sizeof handle);
    ck_ok(launcher->table->stop(launcher, handle, LAUNCH_KILL, &diag));
    ck_assert_str_eq(wait_end(launcher, handle).words, "gone");
    waitpid(other, NULL, 0);
    launch_destroy(launcher);
    test_folder_remove();
}
END_TEST

START_TEST(a_worker_that_is_missing_is_named)
{
    struct launcher *launcher = make_launcher();
    const char *argv[] = {"/nonexistent/groom-worker", NULL};
    struct launch_spec spec = {.argv = argv, .name = "test", .log_path = test_folder_path("log")};
    char handle[LAUNCH_HANDLE_SIZE];
    ck_status(launcher->table->start(launcher, &spec, handle, &diag), GROOM_EIO);
    ck_assert_ptr_nonnull(strstr(diag.detail, "/nonexistent/groom-worker"));
    launch_destroy(launcher);
    test_folder_remove();
}
END_TEST

TEST_SUITE("launch", a_child_says_and_ends, a_child_reads_the_given_descriptor,
           a_child_writes_to_the_given_descriptor, a_child_inherits_nothing,
           a_child_has_default_signals_and_no_new_privileges,
           a_child_that_runs_on_is_killed_with_its_own_children, a_child_that_burns_its_cpu_time_is_stopped,
#if !defined(__SANITIZE_THREAD__)
           a_child_may_not_write_files_where_that_is_said,
#endif
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
           a_child_has_no_more_memory_than_said,
#endif
           too_much_output_is_refused, the_end_of_a_long_complaint_is_kept, a_program_that_is_missing_is_named,
           a_streaming_child_is_read_to_its_end, a_streaming_child_ends_when_its_reader_goes,
           an_attempt_has_its_environment_and_its_log, an_attempt_is_terminated_or_killed,
           a_reused_pid_is_left_alone, workers_die_with_their_daemon,
           a_former_daemons_worker_is_stopped_by_its_handle, a_worker_that_is_missing_is_named)
