#include "strands/text.h"

#include <string.h>

#include "base/number.h"

void text_begin(struct text *text, struct input *in)
{
    *text = (struct text){in, in->buffer + in->at, in->buffer + in->end};
}

void text_end(struct text *text) { text->in->at = (size_t)(text->p - text->in->buffer); }

void text_refill(struct text *text)
{
    text_end(text);
    input_fill(text->in, TEXT_LOOKAHEAD);
    text_begin(text, text->in);
}

void text_skip_space(struct text *text)
{
    for (;;) {
        while (*text->p == ' ' || (*text->p >= '\t' && *text->p <= '\r'))
            text->p++;
        if (text->p != text->end || text_peek(text) < 0)
            return;
    }
}

void text_skip_blank(struct text *text)
{
    for (;;) {
        while (*text->p == ' ' || *text->p == '\t' || *text->p == '\r')
            text->p++;
        if (text->p != text->end || text_peek(text) < 0)
            return;
    }
}

void text_skip_line(struct text *text)
{
    while (text_peek(text) >= 0) {
        const unsigned char *newline = memchr(text->p, '\n', (size_t)(text->end - text->p));
        text->p = newline ? newline + 1 : text->end;
        if (newline)
            return;
    }
}

size_t text_word(struct text *text, char *word, size_t capacity)
{
    size_t n = 0;
    text_ready(text);
    while (text->p + n < text->end && text->p[n] > ' ')
        n++;
    if (n == 0 || n >= capacity)
        return 0;
    memcpy(word, text->p, n);
    word[n] = 0;
    text->p += n;
    return n;
}

/* A token that runs into the end of the window before the end of the input is too long. */
static int accept(struct text *text, const unsigned char *after)
{
    if (!after || (after == text->end && !text->in->at_end))
        return 0;
    text->p = after;
    return 1;
}

int text_number(struct text *text, double *value)
{
    text_ready(text);
    return accept(text, number_scan_any(text->p, value));
}

int text_integer(struct text *text, long long *value)
{
    text_ready(text);
    return accept(text, number_scan_integer(text->p, value));
}

groom_status text_fail(struct text *text, const char *what, struct groom_diag *diag)
{
    char found[16] = "";
    int c = text_peek(text);
    size_t n = 0;
    text_end(text);
    if (c < 0)
        return input_fail(text->in, what, diag);
    text_ready(text);
    while (n < 12 && text->p + n < text->end && text->p[n] > ' ' && text->p[n] < 127) {
        found[n] = (char)text->p[n];
        n++;
    }
    uint64_t offset = text_offset(text);
    if (n)
        return groom_fail_at(diag, GROOM_EFORMAT, (int64_t)offset,
                             "%s was expected at byte %llu, where \"%s\" stands", what,
                             (unsigned long long)offset, found);
    return groom_fail_at(diag, GROOM_EFORMAT, (int64_t)offset,
                         "%s was expected at byte %llu, where byte 0x%02x stands", what,
                         (unsigned long long)offset, (unsigned)c);
}
