/* Blobs: named by their bytes, whole or not there, kept while a row or a pin holds them. */
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/blobs/blobs.h"
#include "tests/support/folder.h"
#include "tests/support/test.h"

#define HELLO "2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824"

static struct groom_diag diag;

static struct blobs *open_new(const struct blobs_system *system)
{
    struct blobs *blobs;
    test_folder_make();
    ck_ok(blobs_open(test_folder_path("blobs"), system, &blobs, &diag));
    return blobs;
}

static void close_all(struct blobs *blobs)
{
    blobs_close(blobs);
    test_folder_remove();
}

static groom_status put(struct blobs *blobs, const char *text, char sha256[BLOBS_HASH_SIZE])
{
    struct blobs_writer *writer;
    groom_status status = blobs_begin(blobs, strlen(text), &writer, &diag);
    if (status != GROOM_OK)
        return status;
    if ((status = blobs_write(writer, text, strlen(text), &diag)) != GROOM_OK) {
        blobs_abort(writer);
        return status;
    }
    return blobs_commit(writer, NULL, sha256, &diag);
}

static groom_status say(void *user, const char *sha256, bool *referenced)
{
    (void)sha256;
    *referenced = *(bool *)user;
    return GROOM_OK;
}

START_TEST(a_blob_is_named_by_its_bytes_and_read_back)
{
    struct blobs *blobs = open_new(NULL);
    struct blobs_writer *writer;
    char sha256[BLOBS_HASH_SIZE], bytes[8], path[512];
    uint64_t n;
    int fd;
    ck_ok(blobs_begin(blobs, 0, &writer, &diag));
    ck_ok(blobs_write(writer, "he", 2, &diag));
    ck_ok(blobs_write(writer, "llo", 3, &diag));
    ck_assert_uint_eq(blobs_written(writer), 5);
    ck_status(blobs_read(blobs, HELLO, &fd, &n, &diag), GROOM_ENOTFOUND);
    ck_ok(blobs_commit(writer, HELLO, sha256, &diag));
    blobs_unpin(blobs, sha256);
    ck_assert_str_eq(sha256, HELLO);
    ck_ok(blobs_read(blobs, HELLO, &fd, &n, &diag));
    ck_assert_uint_eq(n, 5);
    ck_assert_int_eq(read(fd, bytes, sizeof bytes), 5);
    ck_assert_mem_eq(bytes, "hello", 5);
    close(fd);
    ck_ok(blobs_path(blobs, HELLO, path, sizeof path));
    ck_assert_int_eq(access(path, R_OK), 0);
    close_all(blobs);
}
END_TEST

START_TEST(the_same_bytes_are_kept_once)
{
    struct blobs *blobs = open_new(NULL);
    char a[BLOBS_HASH_SIZE], b[BLOBS_HASH_SIZE];
    ck_ok(put(blobs, "hello", a));
    ck_ok(put(blobs, "hello", b));
    ck_assert_str_eq(a, b);
    ck_assert_uint_eq(test_folder_files(), 1);
    close_all(blobs);
}
END_TEST

START_TEST(an_expected_size_that_was_wrong_does_no_harm)
{
    struct blobs *blobs = open_new(NULL);
    struct blobs_writer *writer;
    char sha256[BLOBS_HASH_SIZE];
    struct stat info;
    uint64_t n;
    int fd;
    ck_ok(blobs_begin(blobs, 1 << 20, &writer, &diag));
    ck_ok(blobs_write(writer, "hello", 5, &diag));
    ck_ok(blobs_commit(writer, NULL, sha256, &diag));
    ck_ok(blobs_read(blobs, sha256, &fd, &n, &diag));
    ck_assert_uint_eq(n, 5);
    ck_assert_int_eq(fstat(fd, &info), 0);
    ck_assert_int_lt(info.st_blocks * 512, 1 << 20); /* the room was given back */
    close(fd);
    close_all(blobs);
}
END_TEST

START_TEST(an_abort_or_another_hash_leaves_nothing)
{
    struct blobs *blobs = open_new(NULL);
    struct blobs_writer *writer;
    char sha256[BLOBS_HASH_SIZE] = "untouched";
    ck_ok(blobs_begin(blobs, 0, &writer, &diag));
    ck_ok(blobs_write(writer, "hello", 5, &diag));
    blobs_abort(writer);
    blobs_abort(NULL);
    ck_assert_uint_eq(test_folder_files(), 0);
    ck_ok(blobs_begin(blobs, 0, &writer, &diag));
    ck_ok(blobs_write(writer, "hullo", 5, &diag));
    ck_status(blobs_commit(writer, HELLO, sha256, &diag), GROOM_EINVAL);
    ck_assert_str_eq(sha256, "untouched");
    ck_assert_uint_eq(test_folder_files(), 0);
    close_all(blobs);
}
END_TEST

START_TEST(what_is_not_a_hash_is_refused)
{
    struct blobs *blobs = open_new(NULL);
    char path[512];
    uint64_t n;
    int fd;
    ck_status(blobs_read(blobs, "../../etc/passwd", &fd, &n, &diag), GROOM_EINVAL);
    ck_status(blobs_path(blobs, "", path, sizeof path), GROOM_EINVAL);
    ck_assert(!blobs_is_hash(NULL));
    ck_assert(!blobs_is_hash(HELLO "0"));
    ck_assert(blobs_is_hash(HELLO));
    close_all(blobs);
}
END_TEST

/* --- keeping house --------------------------------------------------------------------- */

START_TEST(only_garbage_is_collected)
{
    struct blobs *blobs = open_new(NULL);
    char sha256[BLOBS_HASH_SIZE];
    bool referenced = false, removed = true;
    ck_ok(put(blobs, "hello", sha256));
    ck_ok(blobs_collect(blobs, sha256, say, &referenced, &removed, &diag));
    ck_assert(!removed); /* pinned */
    blobs_unpin(blobs, sha256);
    referenced = true;
    ck_ok(blobs_collect(blobs, sha256, say, &referenced, &removed, &diag));
    ck_assert(!removed); /* a row */
    referenced = false;
    ck_ok(blobs_collect(blobs, sha256, say, &referenced, &removed, &diag));
    ck_assert(removed);
    ck_ok(blobs_collect(blobs, sha256, say, &referenced, &removed, &diag));
    ck_assert(!removed); /* it is gone: fine */
    close_all(blobs);
}
END_TEST

START_TEST(pins_are_counted)
{
    struct blobs *blobs = open_new(NULL);
    char sha256[BLOBS_HASH_SIZE];
    bool referenced = false, removed = true;
    ck_ok(put(blobs, "hello", sha256));
    ck_ok(put(blobs, "hello", sha256));
    blobs_unpin(blobs, sha256);
    ck_ok(blobs_collect(blobs, sha256, say, &referenced, &removed, &diag));
    ck_assert(!removed);
    blobs_unpin(blobs, sha256);
    ck_ok(blobs_collect(blobs, sha256, say, &referenced, &removed, &diag));
    ck_assert(removed);
    close_all(blobs);
}
END_TEST

START_TEST(all_garbage_goes_at_once)
{
    struct blobs *blobs = open_new(NULL);
    char sha256[BLOBS_HASH_SIZE], text[16];
    bool referenced = false;
    uint64_t n_removed = 0;
    for (int i = 0; i < 20; i++) {
        snprintf(text, sizeof text, "%d", i);
        ck_ok(put(blobs, text, sha256));
        if (i > 0)
            blobs_unpin(blobs, sha256);
    }
    ck_ok(blobs_collect_all(blobs, say, &referenced, &n_removed, &diag));
    ck_assert_uint_eq(n_removed, 19);
    ck_assert_uint_eq(test_folder_files(), 1);
    close_all(blobs);
}
END_TEST

START_TEST(what_a_killed_daemon_was_writing_is_removed)
{
    struct blobs *blobs = open_new(NULL);
    char sha256[BLOBS_HASH_SIZE];
    ck_ok(put(blobs, "hello", sha256));
    pid_t child = fork();
    if (child == 0) {
        struct blobs_writer *writer;
        if (blobs_begin(blobs, 0, &writer, NULL) == GROOM_OK && blobs_write(writer, "half", 4, NULL) == GROOM_OK)
            raise(SIGKILL);
        _exit(1);
    }
    int how;
    waitpid(child, &how, 0);
    ck_assert(WIFSIGNALED(how));
    ck_assert_uint_eq(test_folder_files(), 2);
    blobs_close(blobs);
    ck_ok(blobs_open(test_folder_path("blobs"), NULL, &blobs, &diag));
    ck_assert_uint_eq(test_folder_files(), 1);
    close_all(blobs);
}
END_TEST

/* --- faults below ------------------------------------------------------------------------ */

static int calls_left;
static int failure;

static bool fails(void)
{
    if (calls_left-- != 0)
        return false;
    errno = failure;
    return true;
}

static ssize_t failing_write(int fd, const void *bytes, size_t n) { return fails() ? -1 : write(fd, bytes, n); }
static int failing_preallocate(int fd, off_t n)
{
    return fails() ? -1 : blobs_default_system.preallocate(fd, n);
}
static int failing_sync(int fd) { return fails() ? -1 : blobs_default_system.sync(fd); }
static int failing_rename(int fd, const char *from, const char *to)
{
    return fails() ? -1 : blobs_default_system.rename(fd, from, to);
}
static const struct blobs_system failing = {failing_write, failing_preallocate, failing_sync, failing_rename};

/* Each call in turn, with each of two errors: a clear answer, nothing half-written, and it goes on. */
START_TEST(any_call_below_may_fail)
{
    static const int errors[] = {ENOSPC, EIO};
    calls_left = -1;
    struct blobs *blobs = open_new(&failing);
    char sha256[BLOBS_HASH_SIZE];
    for (int e = 0; e < 2; e++) {
        int n_failed = 0;
        for (int nth = 0;; nth++) {
            bool referenced = false;
            uint64_t n_removed;
            calls_left = nth;
            failure = errors[e];
            groom_status status = put(blobs, "hello", sha256);
            bool reached = calls_left < 0;
            calls_left = -1;
            if (status == GROOM_OK)
                blobs_unpin(blobs, sha256);
            else
                ck_assert_int_eq(status, errors[e] == ENOSPC ? GROOM_ENOSPC : GROOM_EIO);
            n_failed += status != GROOM_OK;
            ck_ok(blobs_collect_all(blobs, say, &referenced, &n_removed, &diag));
            ck_assert_uint_eq(test_folder_files(), 0); /* no temporary, and no pin that held a blob */
            if (!reached)
                break;
        }
        /* preallocate, write, sync, rename, sync of the folder; room that cannot be set aside for
         * another reason than a full disk is no failure */
        ck_assert_int_eq(n_failed, errors[e] == ENOSPC ? 5 : 4);
    }
    close_all(blobs);
}
END_TEST

/* The kernel's own refusal: a file may not grow beyond RLIMIT_FSIZE. */
START_TEST(a_full_disk_is_said_and_survived)
{
    struct blobs *blobs = open_new(NULL);
    struct blobs_writer *writer;
    char sha256[BLOBS_HASH_SIZE];
    char *large = calloc(1, 1 << 20);
    struct rlimit before, small;
    getrlimit(RLIMIT_FSIZE, &before);
    small = before;
    small.rlim_cur = 1 << 16;
    signal(SIGXFSZ, SIG_IGN);
    ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &small), 0);
    ck_ok(blobs_begin(blobs, 0, &writer, &diag));
    ck_status(blobs_write(writer, large, 1 << 20, &diag), GROOM_ENOSPC);
    blobs_abort(writer);
    setrlimit(RLIMIT_FSIZE, &before);
    ck_assert_uint_eq(test_folder_files(), 0);
    ck_ok(put(blobs, "hello", sha256));
    free(large);
    close_all(blobs);
}
END_TEST

/* --- threads -------------------------------------------------------------------------------- */

static void *write_many(void *user)
{
    struct blobs *blobs = user;
    bool referenced = false;
    for (int i = 0; i < 40; i++) {
        struct blobs_writer *writer;
        char text[16], sha256[BLOBS_HASH_SIZE];
        uint64_t n;
        int fd;
        snprintf(text, sizeof text, "%d", i % 5);
        if (blobs_begin(blobs, 0, &writer, NULL) != GROOM_OK || blobs_write(writer, text, 1, NULL) != GROOM_OK ||
            blobs_commit(writer, NULL, sha256, NULL) != GROOM_OK)
            return (void *)(uintptr_t)"a blob was not written";
        if (blobs_collect(blobs, sha256, say, &referenced, NULL, NULL) != GROOM_OK)
            return (void *)(uintptr_t)"collecting failed";
        if (blobs_read(blobs, sha256, &fd, &n, NULL) != GROOM_OK)
            return (void *)(uintptr_t)"a pinned blob was collected";
        close(fd);
        blobs_unpin(blobs, sha256);
        if (blobs_collect(blobs, sha256, say, &referenced, NULL, NULL) != GROOM_OK)
            return (void *)(uintptr_t)"collecting failed";
    }
    return NULL;
}

START_TEST(writers_and_collectors_do_not_take_from_each_other)
{
    struct blobs *blobs = open_new(NULL);
    pthread_t threads[4];
    for (int i = 0; i < 4; i++)
        ck_assert_int_eq(pthread_create(&threads[i], NULL, write_many, blobs), 0);
    for (int i = 0; i < 4; i++) {
        void *complaint;
        pthread_join(threads[i], &complaint);
        ck_assert_msg(!complaint, "%s", (char *)complaint);
    }
    ck_assert_uint_eq(test_folder_files(), 0);
    close_all(blobs);
}
END_TEST

TEST_SUITE("blobs", a_blob_is_named_by_its_bytes_and_read_back, the_same_bytes_are_kept_once,
           an_expected_size_that_was_wrong_does_no_harm, an_abort_or_another_hash_leaves_nothing,
           what_is_not_a_hash_is_refused, only_garbage_is_collected, pins_are_counted, all_garbage_goes_at_once,
           what_a_killed_daemon_was_writing_is_removed, any_call_below_may_fail, a_full_disk_is_said_and_survived,
           writers_and_collectors_do_not_take_from_each_other)
