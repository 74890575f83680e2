/* A cursor over buffered input for the text formats.
 *
 * Between text_begin and text_end the cursor owns the position; a token of up to TEXT_LOOKAHEAD
 * bytes lies in one piece after text_ready. The byte at `end` is zero, which ends any token. */
#ifndef STRANDS_TEXT_H
#define STRANDS_TEXT_H

#include "strands/input.h"

#define TEXT_LOOKAHEAD 1024

struct text {
    struct input *in;
    const unsigned char *p, *end;
};

void text_begin(struct text *text, struct input *in);
void text_end(struct text *text); /* hand the position back to the input */
void text_refill(struct text *text);

/* A token that begins here is whole in the window (unless it is longer than TEXT_LOOKAHEAD). */
static inline void text_ready(struct text *text)
{
    if (text->end - text->p < TEXT_LOOKAHEAD)
        text_refill(text);
}

/* The present byte, or -1 at the end of the input. */
static inline int text_peek(struct text *text)
{
    if (text->p == text->end) {
        text_refill(text);
        if (text->p == text->end)
            return -1;
    }
    return *text->p;
}

static inline uint64_t text_offset(const struct text *text)
{
    return text->in->base + (uint64_t)(text->p - text->in->buffer);
}

/* Skip blanks and line ends / blanks alone / the rest of the line with its end. */
void text_skip_space(struct text *text);
void text_skip_blank(struct text *text);
void text_skip_line(struct text *text);

/* A word: bytes that are not blank, at most capacity - 1 of them, zero-terminated; 0 where none or too long.
 */
size_t text_word(struct text *text, char *word, size_t capacity);

/* A number here, "nan" and "inf" among them. 0: none, or one longer than TEXT_LOOKAHEAD. */
int text_number(struct text *text, double *value);
int text_integer(struct text *text, long long *value);

/* The failure that what stands here means where `what` was expected. */
groom_status text_fail(struct text *text, const char *what, struct groom_diag *diag);

#endif
