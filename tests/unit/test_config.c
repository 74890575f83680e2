/* the one table of options: defaults, file, environment, command line */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/config.h"
#include "tests/support/test.h"

static groom_status load(struct config *config, char *const *environment, char *a, char *b,
                         struct groom_diag *diag)
{
    char program[] = "groomd";
    char *argv[] = {program, a, b, NULL};
    enum config_action action;
    return config_load(1 + (a != NULL) + (b != NULL), argv, environment, config, &action, diag);
}

static void write_file(char *path, const char *text)
{
    strcpy(path, "/tmp/groomd-config-XXXXXX");
    int fd = mkstemp(path);
    ck_assert_int_ge(fd, 0);
    ck_assert_int_eq(write(fd, text, strlen(text)), (int)strlen(text));
    close(fd);
}

START_TEST(defaults_are_loopback_and_sane)
{
    struct config config;
    ck_ok(load(&config, NULL, NULL, NULL, NULL));
    ck_assert_str_eq(config.listen, "127.0.0.1:8080");
    ck_assert_uint_eq(config.max_upload, (uint64_t)4 << 30);
    ck_assert_uint_eq(config.max_body, 1 << 20);
    ck_assert_uint_eq(config.log_level, CONFIG_LOG_INFO);
}
END_TEST

START_TEST(command_line_wins_over_environment_over_file)
{
    char path[40], variable[64], workers[] = "GROOMD_WORKERS=5", level[] = "GROOMD_LOG_LEVEL=debug";
    write_file(
        path, "# a comment\nworkers = 4\n\n max-upload=2M # here too\nlog-level = error\nhttp-threads = 7\n");
    snprintf(variable, sizeof variable, "GROOMD_CONFIG=%s", path);
    char *const environment[] = {variable, workers, level, NULL};
    struct config config;
    char a[] = "--workers=6";
    ck_ok(load(&config, environment, a, NULL, NULL));
    ck_assert_uint_eq(config.workers, 6);
    ck_assert_uint_eq(config.log_level, CONFIG_LOG_DEBUG);
    ck_assert_uint_eq(config.max_upload, 2 << 20);
    ck_assert_uint_eq(config.http_threads, 7);
    unlink(path);
}
END_TEST

START_TEST(bad_values_name_their_place)
{
    static const char *const bad[][3] = {
        {"--workers", "0", "--workers: 0 is outside 1..256"},
        {"--workers", "two", "--workers: \"two\" is not a whole number"},
        {"--max-upload=4X", NULL, "\"4X\" is not a number of bytes"},
        {"--max-upload", "99999999999T", "is not a number of bytes"},
        {"--log-level", "loud", "is not error, warning, info or debug"},
        {"--nonsense", "1", "\"--nonsense\" is not an option"},
        {"--data", NULL, "--data needs a value (DIR)"},
        {"--workers=-3", NULL, "is not a whole number"},
        {"stray", NULL, "is not an option"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct config config;
        struct groom_diag diag = {0};
        char a[64], b[64];
        snprintf(a, sizeof a, "%s", bad[i][0]);
        snprintf(b, sizeof b, "%s", bad[i][1] ? bad[i][1] : "");
        ck_status(load(&config, NULL, a, bad[i][1] ? b : NULL, &diag), GROOM_EINVAL);
        ck_assert_msg(strstr(diag.detail, bad[i][2]) != NULL, "%s", diag.detail);
    }
}
END_TEST

START_TEST(file_errors_name_the_line)
{
    char path[40], option[] = "--config";
    struct config config;
    struct groom_diag diag = {0};
    write_file(path, "workers = 2\nworkers 3\n");
    ck_status(load(&config, NULL, option, path, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, ":2: expected `name = value`"));
    unlink(path);
    ck_status(load(&config, NULL, option, path, &diag), GROOM_EINVAL);
    ck_assert_ptr_nonnull(strstr(diag.detail, "cannot be read"));
}
END_TEST

START_TEST(help_names_every_option)
{
    char *text = NULL;
    size_t n = 0;
    FILE *out = open_memstream(&text, &n);
    config_help(out);
    fclose(out);
    ck_assert_ptr_nonnull(strstr(text, "--data DIR"));
    ck_assert_ptr_nonnull(strstr(text, "--max-upload BYTES"));
    ck_assert_ptr_nonnull(strstr(text, "[4G]"));
    free(text);
}
END_TEST

TEST_SUITE("config", defaults_are_loopback_and_sane, command_line_wins_over_environment_over_file,
           bad_values_name_their_place, file_errors_name_the_line, help_names_every_option)
