/* Uploads in pieces: what is told is on the disk, one writer at a time, nothing expires under anybody's hands. */
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/uploads/uploads.h"
#include "tests/support/folder.h"
#include "tests/support/test.h"

#define ABCDEF "bef57ec7f53a6d40beb640a780a639c83bc29ac8a9816f1fc6c5c6dcd93c4721"

static struct groom_diag diag;
static struct store *store;
static struct blobs *blobs;
static struct uploads *uploads;
static char id[STORE_ID_SIZE];
static struct blobs_system disk;
static atomic_int sync_error;

static int fragile_sync(int fd)
{
    (void)fd;
    errno = atomic_load(&sync_error);
    return errno ? -1 : 0;
}

static void open_uploads(int64_t expiry_ms, uint32_t silence_ms)
{
    disk = blobs_default_system;
    disk.sync = fragile_sync;
    ck_ok(store_open(test_folder_path("db"), &store, &diag));
    ck_ok(blobs_open(test_folder_path("blobs"), NULL, &blobs, &diag));
    const struct uploads_options options = {.store = store, .blobs = blobs, .system = &disk,
                                            .folder = test_folder_path("uploads"), .expiry_ms = expiry_ms,
                                            .settle_ms = 20, .silence_ms = silence_ms};
    ck_ok(uploads_create(&options, &uploads, &diag));
}

static void close_uploads(void)
{
    uploads_destroy(uploads);
    blobs_close(blobs);
    store_close(store);
}

static void begin(uint64_t n_bytes)
{
    struct store_upload upload;
    ck_ok(uploads_begin(uploads, NULL, NULL, n_bytes, "filename YQ==", &upload, &diag));
    memcpy(id, upload.id, sizeof id);
    store_upload_finish(&upload);
}

static uint64_t offset_now(void)
{
    struct store_upload upload;
    ck_ok(uploads_look(uploads, id, &upload, &diag));
    uint64_t offset = upload.n_durable;
    store_upload_finish(&upload);
    return offset;
}

static struct upload_writer *open_at(uint64_t offset)
{
    struct upload_writer *writer;
    enum upload_refusal refusal;
    ck_ok(upload_open(uploads, id, offset, NULL, &writer, &refusal, &diag));
    return writer;
}

static void send(uint64_t offset, const char *text)
{
    struct upload_writer *writer = open_at(offset);
    enum upload_refusal refusal;
    int64_t expires;
    uint64_t end = 0;
    ck_ok(upload_write(writer, text, strlen(text), &diag));
    ck_ok(upload_finish(writer, &end, &expires, &refusal, &diag));
    ck_assert_uint_eq(end, offset + strlen(text));
}

static void nap(int ms) { usleep((useconds_t)ms * 1000); }

START_TEST(pieces_become_one_blob)
{
    char sha256[BLOBS_HASH_SIZE];
    uint64_t n;
    enum upload_refusal refusal = UPLOAD_NOT_REFUSED;
    test_folder_make();
    open_uploads(60000, 0);
    begin(6);
    send(0, "abc");
    ck_status(uploads_take(uploads, id, sha256, &n, &refusal, &diag), GROOM_ECONFLICT);
    ck_assert_int_eq(refusal, UPLOAD_INCOMPLETE);
    close_uploads();
    open_uploads(60000, 0);
    ck_assert_uint_eq(offset_now(), 3);
    send(3, "def");
    for (int i = 0; i < 2; i++) { /* as often as one likes */
        ck_ok(uploads_take(uploads, id, sha256, &n, &refusal, &diag));
        ck_assert_str_eq(sha256, ABCDEF);
        ck_assert_uint_eq(n, 6);
        blobs_unpin(blobs, sha256);
    }
    ck_ok(uploads_remove(uploads, id, &diag));
    ck_status(uploads_remove(uploads, id, &diag), GROOM_ENOTFOUND);
    ck_status(blobs_pin(blobs, sha256, &diag), GROOM_ENOTFOUND);
    close_uploads();
    test_folder_remove();
}
END_TEST

START_TEST(a_line_that_breaks_counts_as_far_as_it_came)
{
    test_folder_make();
    open_uploads(60000, 0);
    begin(100);
    struct upload_writer *writer = open_at(0);
    ck_ok(upload_write(writer, "0123456789", 10, &diag));
    upload_abandon(writer);
    ck_assert_uint_eq(offset_now(), 10);
    send(10, "abc"); /* at once: whoever has ended does not stand in the way */
    close_uploads();
    test_folder_remove();
}
END_TEST

START_TEST(a_writer_that_is_heard_is_alone_and_a_silent_one_gives_way)
{
    struct upload_writer *second = NULL;
    enum upload_refusal refusal = UPLOAD_NOT_REFUSED;
    int64_t expires;
    uint64_t end;
    test_folder_make();
    open_uploads(60000, 100);
    begin(100);
    struct upload_writer *first = open_at(0);
    ck_ok(upload_write(first, "abc", 3, &diag));
    ck_status(upload_open(uploads, id, 3, NULL, &second, &refusal, &diag), GROOM_ECONFLICT);
    ck_assert_int_eq(refusal, UPLOAD_BUSY);
    nap(150);
    second = open_at(3);
    ck_status(upload_write(first, "lost", 4, &diag), GROOM_ECONFLICT);
    ck_ok(upload_write(second, "def", 3, &diag));
    ck_status(upload_finish(first, &end, &expires, &refusal, &diag), GROOM_ECONFLICT);
    ck_ok(upload_finish(second, &end, &expires, &refusal, &diag));
    ck_assert_uint_eq(end, 6);
    close_uploads();
    test_folder_remove();
}
END_TEST

START_TEST(what_was_not_synced_is_not_told)
{
    struct upload_writer *writer;
    enum upload_refusal refusal = UPLOAD_NOT_REFUSED;
    int64_t expires;
    uint64_t end;
    test_folder_make();
    open_uploads(60000, 0);
    begin(9);
    send(0, "abc");
    writer = open_at(3);
    ck_ok(upload_write(writer, "xyz", 3, &diag));
    atomic_store(&sync_error, EIO);
    groom_status status = upload_finish(writer, &end, &expires, &refusal, &diag);
    ck_status(status, GROOM_EIO);
    atomic_store(&sync_error, 0);
    ck_assert_uint_eq(offset_now(), 3);
    send(3, "def"); /* what the disk failed to keep is cut and sent again */
    send(6, "ghi");
    close_uploads();
    test_folder_remove();
}
END_TEST

START_TEST(a_piece_counts_only_with_its_checksum)
{
    struct upload_writer *writer;
    enum upload_refusal refusal = UPLOAD_NOT_REFUSED;
    struct upload_checksum wrong = {.algorithm = "sha1", .n_digest = 20};
    int64_t expires;
    uint64_t end;
    test_folder_make();
    open_uploads(60000, 0);
    begin(9);
    ck_ok(upload_open(uploads, id, 0, &wrong, &writer, &refusal, &diag));
    ck_ok(upload_write(writer, "abc", 3, &diag));
    nap(60);
    ck_assert_uint_eq(offset_now(), 0);
    ck_status(upload_finish(writer, &end, &expires, &refusal, &diag), GROOM_ECONFLICT);
    ck_assert_int_eq(refusal, UPLOAD_CHECKSUM);
    ck_assert_uint_eq(offset_now(), 0);
    send(0, "abc");
    close_uploads();
    test_folder_remove();
}
END_TEST

START_TEST(what_nobody_used_expires_and_leaves_nothing)
{
    struct store_upload gone;
    uint64_t n_removed = 0;
    test_folder_make();
    open_uploads(100, 0);
    begin(9);
    size_t n_files = test_folder_files();
    struct upload_writer *writer = open_at(0);
    nap(150);
    ck_ok(uploads_expire(uploads, &n_removed, &diag));
    ck_assert_uint_eq(n_removed, 0); /* somebody is at it */
    ck_ok(upload_write(writer, "abc", 3, &diag));
    upload_abandon(writer);
    ck_assert_uint_eq(offset_now(), 3); /* and has made it younger */
    nap(150);
    ck_status(uploads_look(uploads, id, &gone, &diag), GROOM_ENOTFOUND);
    ck_ok(uploads_expire(uploads, &n_removed, &diag));
    ck_assert_uint_eq(n_removed, 1);
    ck_assert_uint_lt(test_folder_files(), n_files);
    close_uploads();
    test_folder_remove();
}
END_TEST

/* Four senders fight for one upload, a fifth takes and looks; whatever the order, what is told grows and the
 * bytes are right in the end. */
static void *fight(void *user)
{
    static const char text[] = "abcdefghijklmnopqrstuvwxyz";
    unsigned seed = (unsigned)(size_t)user;
    for (int i = 0; i < 400; i++) {
        struct upload_writer *writer;
        enum upload_refusal refusal;
        int64_t expires;
        uint64_t at = offset_now(), end;
        uint64_t n = 1 + (uint64_t)rand_r(&seed) % 5;
        if (at + n > 26 * 26 || upload_open(uploads, id, at, NULL, &writer, &refusal, NULL) != GROOM_OK)
            continue;
        for (uint64_t k = 0; k < n; k++)
            if (upload_write(writer, &text[(at + k) % 26], 1, NULL) != GROOM_OK)
                break;
        if (rand_r(&seed) % 3 == 0)
            upload_abandon(writer);
        else if (upload_finish(writer, &end, &expires, &refusal, NULL) == GROOM_OK)
            ck_assert_uint_ge(end, at);
    }
    return NULL;
}

START_TEST(senders_that_fight_do_no_harm)
{
    pthread_t threads[4];
    char sha256[BLOBS_HASH_SIZE], bytes[26 * 26];
    uint64_t n = 0;
    int fd;
    enum upload_refusal refusal;
    test_folder_make();
    open_uploads(60000, 1);
    begin(26 * 26);
    for (size_t i = 0; i < 4; i++)
        ck_assert_int_eq(pthread_create(&threads[i], NULL, fight, (void *)(i + 1)), 0);
    for (size_t i = 0; i < 4; i++)
        pthread_join(threads[i], NULL);
    nap(5);
    for (uint64_t at; (at = offset_now()) < 26 * 26;)
        send(at, (char[]){(char)('a' + at % 26), 0});
    nap(5);
    ck_ok(uploads_take(uploads, id, sha256, &n, &refusal, &diag));
    ck_ok(blobs_read(blobs, sha256, &fd, &n, &diag));
    ck_assert_int_eq(read(fd, bytes, sizeof bytes), sizeof bytes);
    close(fd);
    for (size_t i = 0; i < sizeof bytes; i++)
        ck_assert_int_eq(bytes[i], 'a' + (int)(i % 26));
    blobs_unpin(blobs, sha256);
    close_uploads();
    test_folder_remove();
}
END_TEST

TEST_SUITE("uploads", pieces_become_one_blob, a_line_that_breaks_counts_as_far_as_it_came,
           a_writer_that_is_heard_is_alone_and_a_silent_one_gives_way, what_was_not_synced_is_not_told,
           a_piece_counts_only_with_its_checksum, what_nobody_used_expires_and_leaves_nothing,
           senders_that_fight_do_no_harm)
