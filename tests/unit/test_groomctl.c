/* groomctl's parts that need no server: the command line, bars, hints, files. */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "client/groomctl/arguments.h"
#include "client/groomctl/groomctl.h"
#include "client/groomctl/jobs.h"
#include "client/groomctl/json_path.h"
#include "client/groomctl/nearest.h"
#include "client/groomctl/output_file.h"
#include "client/groomctl/progress_bar.h"
#include "client/groomctl/transfer.h"
#include "client/groomctl/unit_hint.h"
#include "tests/support/test.h"

/* main() is not linked here */
int groomctl_interrupted(void) { return 0; }

/* --- the command line -------------------------------------------------------------------- */

static const struct option_spec table[] = {
    {"unit", 0, "U", ""}, {"output", 'o', "FILE", ""}, {"wait", 'w', NULL, ""}, {0}};

static int parse(struct arguments *arguments, int n, const char *const *words)
{
    return arguments_parse(n, (char *const *)(size_t)words, table, NULL, 0, NULL, arguments);
}
#define PARSE(arguments, ...)                                                                                \
    parse(arguments, sizeof((const char *const[]){__VA_ARGS__}) / sizeof(char *),                            \
          (const char *const[]){__VA_ARGS__})

START_TEST(arguments_take_options_anywhere)
{
    static struct arguments a;
    ck_assert(PARSE(&a, "file", "--unit", "cm", "-w", "second", "--unit=mm", "-oout", "--", "--unit", "-"));
    ck_assert_uint_eq(a.n_operands, 4);
    ck_assert_str_eq(a.operands[2], "--unit");
    ck_assert_str_eq(a.operands[3], "-");
    ck_assert_str_eq(argument(&a, "unit"), "mm");
    ck_assert_str_eq(argument_nth(&a, "unit", 0), "cm");
    ck_assert_ptr_null(argument_nth(&a, "unit", 2));
    ck_assert_str_eq(argument(&a, "output"), "out");
    ck_assert_str_eq(argument(&a, "wait"), "");
    ck_assert_ptr_null(argument(&a, "format"));
}
END_TEST

START_TEST(arguments_complain_of_what_is_wrong)
{
    static struct arguments a;
    ck_assert(!PARSE(&a, "--unti", "cm"));
    ck_assert_str_eq(a.complaint, "there is no option --unti; --unit is one");
    ck_assert(!PARSE(&a, "-x"));
    ck_assert(!PARSE(&a, "x", "--unit"));
    ck_assert_str_eq(a.complaint, "a value is missing behind --unit");
    ck_assert(!PARSE(&a, "--wait=3"));
}
END_TEST

START_TEST(arguments_stop_at_the_command)
{
    static struct arguments a;
    const char *const words[] = {"--unit", "cm", "upload", "--what"};
    int read = 0;
    ck_assert(arguments_parse(4, (char *const *)(size_t)words, table, NULL, 1, &read, &a));
    ck_assert_int_eq(read, 2);
}
END_TEST

START_TEST(every_command_can_be_found_and_helps)
{
    for (const struct command *c = groomctl_commands; c->name; c++) {
        ck_assert_ptr_eq(groomctl_find_command(c->name), c);
        ck_assert(c->run && c->summary[0] && c->min_operands <= c->max_operands);
        for (const struct option_spec *o = c->options; o && o->name; o++)
            ck_assert_msg(o->help && o->help[0], "%s", o->name);
    }
    ck_assert_ptr_null(groomctl_find_command("fits"));
}
END_TEST

/* --- bars ----------------------------------------------------------------------------------- */

START_TEST(time_left_reads_well)
{
    static const struct {
        double s;
        const char *text;
    } cases[] = {{-1, ""},           {NAN, ""},
                 {0.2, "0 s left"},  {59.4, "59 s left"},
                 {125, "2:05 left"}, {3720, "1 h 02 min left"}};
    char text[32];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        progress_time_left(cases[i].s, text, sizeof text);
        ck_assert_str_eq(text, cases[i].text);
    }
}
END_TEST

static const struct progress_line half = {.stage = "initialize",
                                          .stage_index = 0,
                                          .stage_count = 5,
                                          .fraction = 0.5,
                                          .loss_name = "total",
                                          .loss = 0.01234,
                                          .eta_s = 8,
                                          .note = "note"};

START_TEST(bar_shows_stage_share_loss_and_time)
{
    char text[256];
    progress_bar_text(&half, 78, text, sizeof text);
    ck_assert_str_eq(text, "initialize 1/5 [============>           ]  50 %  total 0.01234  8 s left  note");
}
END_TEST

START_TEST(bar_fits_any_width)
{
    char text[256];
    for (size_t columns = 20; columns < 250; columns++) {
        progress_bar_text(&half, columns, text, sizeof text);
        ck_assert_uint_le(strlen(text), columns);
        if (columns >= 50)
            ck_assert_ptr_nonnull(strstr(text, " 50 %"));
    }
    progress_bar_text(&half, 60, text, sizeof text);
    ck_assert_ptr_null(strstr(text, "note"));
}
END_TEST

START_TEST(bar_takes_any_fraction)
{
    static const double fractions[] = {-1, 0, 1, 2, NAN, 1e300};
    char text[256];
    for (size_t i = 0; i < 6; i++) {
        struct progress_line line = {.fraction = fractions[i], .eta_s = -1};
        progress_bar_text(&line, 80, text, sizeof text);
        ck_assert_ptr_nonnull(strstr(text, fractions[i] >= 1 ? "100 %" : "  0 %"));
    }
    progress_plain_text(&half, text, sizeof text);
    ck_assert_str_eq(text, "initialize 1/5  50 %  total 0.01234  8 s left  note");
}
END_TEST

/* --- jobs --------------------------------------------------------------------------------------- */

static int event(struct job_view *view, const char *name, const char *json)
{
    cJSON *data = cJSON_Parse(json);
    ck_assert_ptr_nonnull(data);
    int is_news = job_view_event(view, name, data);
    cJSON_Delete(data);
    return is_news;
}

START_TEST(job_view_follows_events)
{
    struct job_view view;
    job_view_init(&view, "job_a");
    ck_assert(event(&view, "state", "{\"state\":\"running\"}"));
    ck_assert(event(&view, "stage", "{\"name\":\"initialize\",\"index\":0,\"count\":5}"));
    ck_assert(!event(&view, "progress", "{\"progress\":0.05,\"eta_s\":12}"));
    ck_assert(event(&view, "progress", "{\"progress\":0.11,\"eta_s\":null}"));
    ck_assert(view.eta_s < 0);
    ck_assert(!event(&view, "loss",
                     "{\"stage\":\"guides\",\"losses\":[{\"name\":\"total\",\"value\":2},"
                     "{\"name\":\"shape\",\"value\":1},{\"name\":\"total\",\"value\":0.5}]}"));
    ck_assert_str_eq(view.loss_name, "total");
    ck_assert(view.loss == 0.5);
    ck_assert(!event(&view, "novelty", "{}"));
    ck_assert(event(&view, "state", "{\"state\":\"failed\",\"error\":{\"title\":\"t\",\"detail\":\"d\"}}"));
    ck_assert_int_eq(view.state, JOB_STATE_FAILED);
    ck_assert_str_eq(view.problem, "t: d");
}
END_TEST

START_TEST(job_view_takes_a_resource)
{
    struct job_view view;
    cJSON *job = cJSON_Parse("{\"state\":\"succeeded\",\"stage\":null,\"progress\":1,\"result\":{\"groom\":"
                             "\"grm_a\"},\"error\":null}");
    job_view_init(&view, "job_a");
    job_view_resource(&view, job);
    ck_assert_int_eq(view.state, JOB_STATE_SUCCEEDED);
    ck_assert_str_eq(view.groom, "grm_a");
    cJSON_Delete(job);
}
END_TEST

/* --- hints and paths -------------------------------------------------------------------------------- */

START_TEST(a_wrong_unit_is_guessed_from_the_size)
{
    ck_assert_str_eq(unit_guess(SIZED_HAIR, 30, 1), "cm");
    ck_assert_str_eq(unit_guess(SIZED_HAIR, 400, 1), "mm");
    ck_assert_str_eq(unit_guess(SIZED_HAIR, 0.004, 0.01), "m");
    ck_assert_str_eq(unit_guess(SIZED_HEAD, 180, 1), "cm");
    ck_assert_str_eq(unit_guess(SIZED_HEAD, 32, 1), "cm"); /* 0.8 m in inches is nearer to what is likely */
    ck_assert_str_eq(unit_guess(SIZED_HEAD, 12.5, 1), "in");
    ck_assert_ptr_null(unit_guess(SIZED_HAIR, 0.3, 1));
    ck_assert_ptr_null(unit_guess(SIZED_HEAD, 1.8, 1));
    ck_assert_ptr_null(unit_guess(SIZED_HAIR, 1e9, 1));
    ck_assert_ptr_null(unit_guess(SIZED_HAIR, NAN, 1));
    char text[256];
    unit_hint_text(SIZED_HAIR, 30, 1, text, sizeof text);
    ck_assert_ptr_nonnull(strstr(text, "--unit cm"));
}
END_TEST

START_TEST(hair_that_lies_apart_from_its_head_is_told)
{
    const struct sized_box hair = {{-0.2, 1.4, -0.2}, {0.2, 1.8, 0.2}}, head = {{-0.1, 1.4, -0.1}, {0.1, 1.75, 0.1}};
    const struct sized_box lying = {{-0.2, -0.2, 1.4}, {0.2, 0.2, 1.8}};     /* z up, read as y up */
    const struct sized_box standing = {{-0.1, -0.1, -1.75}, {0.1, 0.1, -1.4}}; /* y up, read as z up */
    const struct sized_box large = {{-20, 140, -20}, {20, 180, 20}}, elsewhere = {{5, 5, 5}, {5.4, 5.4, 5.4}};
    char text[256];
    apart_hint_text(&hair, &head, text, sizeof text);
    ck_assert_str_eq(text, "");
    apart_hint_text(&lying, &head, text, sizeof text);
    ck_assert_ptr_nonnull(strstr(text, "the other up axis"));
    apart_hint_text(&hair, &standing, text, sizeof text);
    ck_assert_ptr_nonnull(strstr(text, "the other up axis"));
    apart_hint_text(&large, &head, text, sizeof text);
    ck_assert_ptr_nonnull(strstr(text, "another unit"));
    apart_hint_text(&elsewhere, &head, text, sizeof text);
    ck_assert_ptr_nonnull(strstr(text, "of one capture"));
}
END_TEST

static const char *nearest_of(const char *typed)
{
    struct nearest nearest;
    nearest_init(&nearest, typed, strlen(typed));
    for (const struct command *c = groomctl_commands; c->name; c++)
        nearest_offer(&nearest, c->name);
    return nearest.name ? nearest.name : "";
}

START_TEST(a_mistyped_name_finds_the_one_that_was_meant)
{
    static struct arguments a;
    ck_assert_str_eq(nearest_of("uplaod"), "upload");
    ck_assert_str_eq(nearest_of("exprot"), "export");
    ck_assert_str_eq(nearest_of("turn"), "turntable");
    ck_assert_str_eq(nearest_of("revison"), "revisions");
    ck_assert_str_eq(nearest_of("frobnicate"), "");
    ck_assert_str_eq(nearest_of("x"), "");
    ck_assert(!PARSE(&a, "--ouptut=x"));
    ck_assert_str_eq(a.complaint, "there is no option --ouptut=x; --output is one");
}
END_TEST

START_TEST(units_are_names_or_metres)
{
    ck_assert(unit_in_metres(NULL) == 1 && unit_in_metres("in") == 0.0254 && unit_in_metres("0.5") == 0.5);
    ck_assert(unit_in_metres("yard") == 0 && unit_in_metres("-1") == 0);
}
END_TEST

START_TEST(a_path_names_its_format)
{
    ck_assert_str_eq(format_of_path("a/b.hair"), "hair");
    ck_assert_str_eq(format_of_path("x.USD"), "usda");
    ck_assert_str_eq(format_of_path("x.usda"), "usda");
    ck_assert_ptr_null(format_of_path("x.d/plain"));
    ck_assert_ptr_null(format_of_path("x.tfx")); /* read only */
}
END_TEST

START_TEST(assignments_go_where_their_path_says)
{
    cJSON *object = cJSON_CreateObject();
    ck_assert(json_set_path(object, "stages.initialize.n_smooth=40"));
    ck_assert(json_set_path(object, "/stages/initialize/lambda_smooth=0.5"));
    ck_assert(json_set_path(object, "quality=high"));
    ck_assert(json_set_path(object, "operators=[\"curl\"]"));
    ck_assert(!json_set_path(object, "quality.x=1"));
    ck_assert(!json_set_path(object, "=1") && !json_set_path(object, "a") &&
              !json_set_path(object, "a..b=1"));
    char *text = cJSON_PrintUnformatted(object);
    ck_assert_str_eq(text, "{\"stages\":{\"initialize\":{\"n_smooth\":40,\"lambda_smooth\":0.5}},\"quality\":"
                           "\"high\",\"operators\":[\"curl\"],\"a\":{}}");
    free(text);
    cJSON_Delete(object);
}
END_TEST

/* --- files --------------------------------------------------------------------------------------------- */

START_TEST(a_file_is_whole_or_not_there)
{
    char folder[] = "/tmp/groomctl_XXXXXX", path[64], name[96];
    struct output_file file;
    struct stat status;
    ck_assert_ptr_nonnull(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/out", folder);
    ck_assert(output_file_open(&file, path));
    ck_assert(output_file_write(&file, "long ago", 8));
    output_file_restart(&file);
    ck_assert(output_file_write(&file, "abc", 3));
    ck_assert_int_ne(stat(path, &status), 0);
    snprintf(name, sizeof name, "%.90s", file.temporary);
    ck_assert(output_file_commit(&file));
    ck_assert(!stat(path, &status) && status.st_size == 3);
    ck_assert_int_ne(stat(name, &status), 0);
    ck_assert(output_file_open(&file, path));
    ck_assert(output_file_write(&file, "x", 1));
    output_file_abort(&file);
    ck_assert(!stat(path, &status) && status.st_size == 3);
    unlink(path);
    ck_assert_int_eq(rmdir(folder), 0); /* nothing else stayed */
}
END_TEST

TEST_SUITE("groomctl", arguments_take_options_anywhere, arguments_complain_of_what_is_wrong,
           arguments_stop_at_the_command, every_command_can_be_found_and_helps, time_left_reads_well,
           bar_shows_stage_share_loss_and_time, bar_fits_any_width, bar_takes_any_fraction,
           job_view_follows_events, job_view_takes_a_resource, a_wrong_unit_is_guessed_from_the_size, hair_that_lies_apart_from_its_head_is_told, a_mistyped_name_finds_the_one_that_was_meant,
           units_are_names_or_metres, a_path_names_its_format, assignments_go_where_their_path_says,
           a_file_is_whole_or_not_there)
