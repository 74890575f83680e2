/* numbers from text and into text, against the C library on bit patterns of all kinds */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "groom/random.h"
#include "base/number.h"
#include "tests/support/test.h"

static float float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void expect_printed(float value)
{
    char expected[64], printed[NUMBER_MAX + 1];
    snprintf(expected, sizeof expected, "%.9g", (double)value);
    size_t n = number_print(printed, value);
    printed[n] = 0;
    /* one call of Check for each of millions would be most of the time */
    if (n >= NUMBER_MAX || strcmp(printed, expected) != 0)
        ck_abort_msg("%a: %s, where printf says %s", (double)value, printed, expected);
}

START_TEST(print_says_what_printf_says)
{
    static const float special[] = {0,
                                    -0.0f,
                                    1,
                                    -1,
                                    0.1f,
                                    0.5f,
                                    10,
                                    123456789,
                                    999999999,
                                    1e9f,
                                    1e8f,
                                    99999999,
                                    1e-4f,
                                    9.9999997e-5f,
                                    1e-5f,
                                    1e-27f,
                                    9.99e-28f,
                                    1.17549435e-38f,
                                    1e-45f,
                                    3.4028235e38f,
                                    8388608.5f,
                                    16777216,
                                    0.3f,
                                    1e10f,
                                    5e-1f,
                                    33554432.0f,
                                    1073741824.0f,
                                    4294967296.0f};
    for (size_t i = 0; i < sizeof special / sizeof special[0]; i++)
        expect_printed(special[i]);
    for (int e = -45; e <= 38; e++) /* both neighbours of every power of ten */
        for (int k = -3; k <= 3; k++) {
            float value = strtof(
                (char[8]){'1', 'e', e < 0 ? '-' : '+', (char)('0' + abs(e) / 10), (char)('0' + abs(e) % 10)},
                NULL);
            uint32_t bits;
            memcpy(&bits, &value, sizeof bits);
            expect_printed(float_of(bits + (uint32_t)k));
        }
}
END_TEST

START_TEST(print_says_what_printf_says_for_random_bits)
{
    struct groom_random_key key = {1, 0};
    for (uint32_t i = 0; i < 1000000; i++) {
        uint32_t bits[4];
        groom_random_block(key, i, 0, bits);
        for (int k = 0; k < 3; k++)
            if (isfinite(float_of(bits[k])))
                expect_printed(float_of(bits[k]));
        expect_printed((float)bits[3] * 0x1p-32f - 0.5f); /* coordinates */
    }
}
END_TEST

START_TEST(scan_gives_back_every_float_that_print_wrote)
{
    struct groom_random_key key = {2, 0};
    for (uint32_t i = 0; i < 500000; i++) {
        uint32_t bits[4];
        groom_random_block(key, i, 0, bits);
        for (int k = 0; k < 4; k++) {
            char text[NUMBER_MAX + 1 + NUMBER_PADDING];
            double value;
            float expected = float_of(bits[k]);
            if (!isfinite(expected))
                continue;
            text[number_print(text, expected)] = 0;
            const unsigned char *end = number_scan((const unsigned char *)text, &value);
            double padded;
            float back = (float)value;
            if (number_scan_padded((const unsigned char *)text, &padded) != end || padded != value ||
                end != (const unsigned char *)text + strlen(text) ||
                memcmp(&back, &expected, sizeof back) != 0)
                ck_abort_msg("%s is read as %a, not %a", text, (double)back, (double)expected);
        }
    }
}
END_TEST

/* Within one unit in the last place of a double for 17 digits, and so the same float. */
START_TEST(scan_is_near_strtod_for_doubles)
{
    struct groom_random_key key = {3, 0};
    for (uint32_t i = 0; i < 200000; i++) {
        uint32_t words[4];
        char text[64];
        double expected, value;
        groom_random_block(key, i, 0, words);
        memcpy(&expected, words, sizeof expected);
        if (!isfinite(expected) || fabs(expected) < 1e-290)
            continue;
        snprintf(text, sizeof text, words[2] & 1 ? "%.17g" : "%.25e", expected);
        double padded;
        if (!number_scan((const unsigned char *)text, &value) ||
            number_scan_padded((const unsigned char *)text, &padded) == NULL || padded != value ||
            fabs(value - expected) > nextafter(fabs(expected), INFINITY) - fabs(expected))
            ck_abort_msg("%s is read as %.17g", text, value);
    }
}
END_TEST

START_TEST(scan_takes_every_spelling)
{
    static const struct {
        const char *text;
        double value;
        size_t length;
    } rows[] = {{"0", 0, 1},
                {"-0.5", -0.5, 4},
                {"+1.", 1, 3},
                {".25", 0.25, 3},
                {"1e3", 1000, 3},
                {"1E+2,", 100, 4},
                {"1e-2]", 0.01, 4},
                {"12e", 12, 2},
                {"12e+x", 12, 2},
                {"1.5.5", 1.5, 3},
                {"00012", 12, 5},
                {"1e400", INFINITY, 5},
                {"1e-400", 0, 6},
                {"0e99999999999", 0, 13},
                {"123456789012345678901234567890", 123456789012345678901234567890.0, 30},
                {"0.000000000000000000000000000000000000000000001", 1e-45, 47},
                {"1e-99999999999", 0, 14}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double value = NAN;
        const unsigned char *text = (const unsigned char *)rows[i].text, *end = number_scan(text, &value);
        ck_assert_msg(end == text + rows[i].length, "%s", rows[i].text);
        ck_assert_msg(value == rows[i].value, "%s is read as %.17g", rows[i].text, value);
    }
}
END_TEST

START_TEST(scan_refuses_what_is_no_number)
{
    static const char *const rows[] = {"", "-", "+", ".", "-.", "e5", "x", "--1", " 1", "nan", "inf"};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double value;
        ck_assert_msg(number_scan((const unsigned char *)rows[i], &value) == NULL, "\"%s\"", rows[i]);
    }
}
END_TEST

/* text, what it reads as, how much of it is read (0: refused) */
static const struct special {
    const char *text;
    double value;
    size_t length;
} specials[] = {{"NaN", NAN, 3},      {"nan(0x1) 2", NAN, 8}, {"-Infinity,", -INFINITY, 9}, {"inf", INFINITY, 3},
                {"1.#IND 2", NAN, 6}, {"-1.#QNAN", NAN, 8},   {"1.5#", 1.5, 3},             {"2.5e-1", 0.25, 6},
                {"none", 0, 0},       {"#", 0, 0},            {"", 0, 0}};

START_TEST(what_files_hold_in_place_of_numbers_is_read)
{
    for (size_t i = 0; i < sizeof specials / sizeof specials[0]; i++) {
        const struct special *s = &specials[i];
        unsigned char text[32] = {0};
        double value = 0;
        memcpy(text, s->text, strlen(s->text));
        const unsigned char *after = number_scan_any(text, &value);
        ck_assert_uint_eq(after ? (size_t)(after - text) : 0, s->length);
        ck_assert(s->length == 0 || value == s->value || (isnan(value) && isnan(s->value)));
    }
}
END_TEST

START_TEST(integers_are_bounded)
{
    long long value;
    ck_assert_ptr_nonnull(number_scan_integer((const unsigned char *)"-42/", &value));
    ck_assert_int_eq(value, -42);
    ck_assert_ptr_null(number_scan_integer((const unsigned char *)"9999999999999999999", &value));
    ck_assert_ptr_null(number_scan_integer((const unsigned char *)"x", &value));
    char text[24];
    ck_assert_uint_eq(number_print_integer(text, UINT64_MAX), 20);
    ck_assert_mem_eq(text, "18446744073709551615", 20);
    ck_assert_uint_eq(number_print_integer(text, 0), 1);
}
END_TEST

TEST_SUITE("numbers", print_says_what_printf_says, print_says_what_printf_says_for_random_bits,
           scan_gives_back_every_float_that_print_wrote, scan_is_near_strtod_for_doubles,
           scan_takes_every_spelling, scan_refuses_what_is_no_number, what_files_hold_in_place_of_numbers_is_read,
           integers_are_bounded)
