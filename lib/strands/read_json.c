/* JSON strands, {"strands":[[[x,y,z],...],...]} or the outer array alone, as a stream of numbers.
 *
 * Other members are skipped, whatever they hold, to 64 levels. null, NaN and Infinity stand for
 * values that are not finite (JavaScript and Python write them). */
#include <math.h>
#include <string.h>

#include "base/number.h"
#include "strands/reader.h"
#include "strands/text.h"

#define MAX_DEPTH 64

struct json {
    struct text text;
    struct reader *reader;
};

static groom_status fail(struct json *json, const char *what)
{
    return text_fail(&json->text, what, json->reader->diag);
}

static int next_is(struct json *json, char c)
{
    text_skip_space(&json->text);
    if (text_peek(&json->text) != c)
        return 0;
    json->text.p++;
    return 1;
}

/* --- strands: the hot path ----------------------------------------------------------- */

static groom_status read_coordinate_slowly(struct json *json, double *value)
{
    text_skip_space(&json->text);
    text_ready(&json->text);
    if (memcmp(json->text.p, "null", 4) == 0) {
        json->text.p += 4;
        *value = NAN;
        return GROOM_OK;
    }
    return *json->text.p != '+' && text_number(&json->text, value) ? GROOM_OK : fail(json, "a number");
}

static inline groom_status read_coordinate(struct json *json, double *value)
{
    struct text *text = &json->text;
    if (text->end - text->p >= TEXT_LOOKAHEAD) {
        const unsigned char *p = text->p + (*text->p == ' ');
        const unsigned char *after = *p == '+' ? NULL : number_scan_padded(p, value);
        if (after && after != text->end) {
            text->p = after;
            return GROOM_OK;
        }
    }
    return read_coordinate_slowly(json, value);
}

static inline int next_is_quickly(struct json *json, char c)
{
    if (*json->text.p == c) {
        json->text.p++;
        return 1;
    }
    return next_is(json, c);
}

/* x,y,z] after the bracket */
static inline groom_status read_point(struct json *json)
{
    double point[3];
    for (int k = 0; k < 3; k++) {
        groom_status status;
        if (k > 0 && !next_is_quickly(json, ','))
            return fail(json, "a comma and the next of three coordinates");
        if ((status = read_coordinate(json, &point[k])) != GROOM_OK)
            return status;
    }
    if (!next_is_quickly(json, ']'))
        return fail(json, "\"]\" after three coordinates");
    return builder_point(json->reader->out, point[0], point[1], point[2])
               ? GROOM_OK
               : builder_fail(json->reader->out, text_offset(&json->text), json->reader->diag);
}

/* [x,y,z],...] after the bracket */
static groom_status read_strand(struct json *json)
{
    struct builder *out = json->reader->out;
    if (next_is(json, ']'))
        goto cut;
    do {
        groom_status status;
        if (!next_is_quickly(json, '['))
            return fail(json, "\"[\" of a vertex");
        if ((status = read_point(json)) != GROOM_OK)
            return status;
    } while (next_is_quickly(json, ','));
    if (!next_is(json, ']'))
        return fail(json, "\",\" or \"]\" after a vertex");
cut:
    return builder_cut(out, builder_waiting(out))
               ? GROOM_OK
               : builder_fail(out, text_offset(&json->text), json->reader->diag);
}

/* [strand,...] after the bracket */
static groom_status read_strands(struct json *json)
{
    if (next_is(json, ']'))
        return GROOM_OK;
    do {
        groom_status status;
        if (!next_is(json, '['))
            return fail(json, "\"[\" of a strand");
        if ((status = read_strand(json)) != GROOM_OK)
            return status;
    } while (next_is(json, ','));
    return next_is(json, ']') ? GROOM_OK : fail(json, "\",\" or \"]\" after a strand");
}

/* --- everything else ------------------------------------------------------------------- */

/* After the opening quote; the first bytes, escapes as they stand, go to `start`. */
static groom_status read_string(struct json *json, char *start, size_t capacity)
{
    size_t n = 0;
    for (;;) {
        int c = text_peek(&json->text);
        if (c < 0x20)
            return fail(json, "the rest of a string");
        json->text.p++;
        if (c == '"')
            break;
        if (n + 1 < capacity)
            start[n++] = (char)c;
        if (c == '\\') {
            if (text_peek(&json->text) < 0x20)
                return fail(json, "an escaped character");
            json->text.p++;
        }
    }
    start[n] = 0;
    return GROOM_OK;
}

static groom_status skip_scalar(struct json *json)
{
    char word[8];
    size_t n = 0;
    double value;
    text_skip_space(&json->text);
    text_ready(&json->text);
    if (text_number(&json->text, &value))
        return GROOM_OK;
    for (const unsigned char *p = json->text.p; n < 5 && *p >= 'a' && *p <= 'z'; p++)
        word[n++] = (char)*p;
    word[n] = 0;
    if (strcmp(word, "true") != 0 && strcmp(word, "false") != 0 && strcmp(word, "null") != 0)
        return fail(json, "a JSON value");
    json->text.p += n;
    return GROOM_OK;
}

static groom_status skip_value(struct json *json, int depth);

static groom_status skip_members(struct json *json, char close, int depth)
{
    char key[8];
    if (next_is(json, close))
        return GROOM_OK;
    do {
        groom_status status;
        if (close == '}') {
            if (!next_is(json, '"'))
                return fail(json, "a member's name");
            if ((status = read_string(json, key, sizeof key)) != GROOM_OK)
                return status;
            if (!next_is(json, ':'))
                return fail(json, "\":\" after a member's name");
        }
        if ((status = skip_value(json, depth + 1)) != GROOM_OK)
            return status;
    } while (next_is(json, ','));
    return next_is(json, close) ? GROOM_OK : fail(json, close == '}' ? "\",\" or \"}\"" : "\",\" or \"]\"");
}

static groom_status skip_value(struct json *json, int depth)
{
    char start[8];
    if (depth > MAX_DEPTH)
        return fail(json, "a value at most 64 levels deep");
    if (next_is(json, '{'))
        return skip_members(json, '}', depth);
    if (next_is(json, '['))
        return skip_members(json, ']', depth);
    return next_is(json, '"') ? read_string(json, start, sizeof start) : skip_scalar(json);
}

static groom_status read_member(struct json *json, int *found)
{
    char key[16];
    groom_status status;
    if (!next_is(json, '"'))
        return fail(json, "a member's name");
    if ((status = read_string(json, key, sizeof key)) != GROOM_OK)
        return status;
    if (!next_is(json, ':'))
        return fail(json, "\":\" after a member's name");
    if (strcmp(key, "strands") != 0)
        return skip_value(json, 1);
    if ((*found)++)
        return fail(json, "\"strands\" only once: a value of another member");
    if (!next_is(json, '['))
        return fail(json, "the array of strands");
    return read_strands(json);
}

static groom_status read_object(struct json *json)
{
    int found = 0;
    if (!next_is(json, '}')) {
        do {
            groom_status status = read_member(json, &found);
            if (status != GROOM_OK)
                return status;
        } while (next_is(json, ','));
        if (!next_is(json, '}'))
            return fail(json, "\",\" or \"}\" after a member");
    }
    if (!found)
        return groom_fail_at(json->reader->diag, GROOM_EFORMAT, (int64_t)text_offset(&json->text),
                             "the object that ends before byte %llu has no member \"strands\"",
                             (unsigned long long)text_offset(&json->text));
    return GROOM_OK;
}

groom_status read_json(struct reader *reader)
{
    struct json json = {.reader = reader};
    groom_status status;
    if (input_fill(reader->in, 3) >= 3 && memcmp(reader->in->buffer + reader->in->at, "\xef\xbb\xbf", 3) == 0)
        reader->in->at += 3;
    text_begin(&json.text, reader->in);
    if (next_is(&json, '['))
        status = read_strands(&json);
    else if (next_is(&json, '{'))
        status = read_object(&json);
    else
        return fail(&json, "\"{\" or \"[\"");
    text_skip_space(&json.text);
    if (status == GROOM_OK && text_peek(&json.text) >= 0)
        return fail(&json, "the end of the data");
    text_end(&json.text);
    return status == GROOM_OK && reader->in->status != GROOM_OK
               ? input_fail(reader->in, "the end", reader->diag)
               : status;
}
