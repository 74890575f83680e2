#include "strands/input.h"

#include <string.h>

#include "base/memory.h"
#include "base/progress.h"

groom_status input_init(struct input *input, const struct groom_source *source,
                        const struct groom_context *context, struct groom_diag *diag)
{
    *input = (struct input){.source = *source, .context = context};
    input->buffer = memory_array(memory_allocator(context), INPUT_CAPACITY + INPUT_PADDING, 1);
    if (!input->buffer)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for the input buffer");
    memset(input->buffer, 0, INPUT_PADDING);
    return GROOM_OK;
}

void input_finish(struct input *input)
{
    if (input->buffer)
        memory_release(memory_allocator(input->context), input->buffer, INPUT_CAPACITY + INPUT_PADDING, 1);
    input->buffer = NULL;
}

int64_t input_remaining(const struct input *input)
{
    uint64_t offset = input_offset(input);
    if (input->source.size < 0)
        return -1;
    return (uint64_t)input->source.size > offset ? input->source.size - (int64_t)offset : 0;
}

static void report(struct input *input)
{
    if (input->source.size > 0) {
        double fraction = (double)(input->base + input->end) / (double)input->source.size;
        progress_report(input->context, fraction < 1 ? fraction : 1);
    }
    if (progress_cancelled(input->context))
        input->status = GROOM_ECANCELLED;
}

static void read_some(struct input *input)
{
    int64_t n =
        input->source.read(input->source.user, input->buffer + input->end, INPUT_CAPACITY - input->end);
    if (n < 0 || (uint64_t)n > INPUT_CAPACITY - input->end)
        input->status = GROOM_EIO;
    else if (n == 0)
        input->at_end = 1;
    else
        input->end += (size_t)n;
    memset(input->buffer + input->end, 0, INPUT_PADDING);
}

size_t input_fill(struct input *input, size_t n)
{
    if (input_available(input) >= n || input->at_end || input->status != GROOM_OK)
        return input_available(input);
    memmove(input->buffer, input->buffer + input->at, input_available(input));
    input->base += input->at;
    input->end -= input->at;
    input->at = 0;
    while (input->end < n && !input->at_end && input->status == GROOM_OK) {
        read_some(input);
        report(input);
    }
    return input_available(input);
}

groom_status input_fail(const struct input *input, const char *what, struct groom_diag *diag)
{
    uint64_t end = input->base + input->end;
    if (input->status == GROOM_ECANCELLED)
        return groom_fail_at(diag, GROOM_ECANCELLED, (int64_t)end, "cancelled after %llu bytes",
                             (unsigned long long)end);
    if (input->status != GROOM_OK)
        return groom_fail_at(diag, input->status, (int64_t)end, "reading failed after %llu bytes",
                             (unsigned long long)end);
    return groom_fail_at(diag, GROOM_ETRUNCATED, (int64_t)end,
                         "the data ends at byte %llu, where %s was expected", (unsigned long long)end, what);
}

groom_status input_take(struct input *input, size_t n, const char *what, const unsigned char **bytes,
                        struct groom_diag *diag)
{
    if (input_fill(input, n) < n)
        return input_fail(input, what, diag);
    *bytes = input->buffer + input->at;
    input->at += n;
    return GROOM_OK;
}

groom_status input_records(struct input *input, size_t size, uint64_t limit, const char *what,
                           const unsigned char **records, size_t *n, struct groom_diag *diag)
{
    size_t available = input_fill(input, size);
    if (available < size)
        return input_fail(input, what, diag);
    *n = available / size;
    if (*n > limit)
        *n = (size_t)limit;
    return input_take(input, *n * size, what, records, diag);
}

groom_status input_skip(struct input *input, uint64_t n, const char *what, struct groom_diag *diag)
{
    while (n > 0) {
        size_t available = input_fill(input, 1);
        if (available == 0)
            return input_fail(input, what, diag);
        size_t step = n < available ? (size_t)n : available;
        input->at += step;
        n -= step;
    }
    return GROOM_OK;
}

uint16_t input_u16(const unsigned char *bytes)
{
    uint16_t value;
    memcpy(&value, bytes, sizeof value);
    return value;
}

uint32_t input_u32(const unsigned char *bytes)
{
    uint32_t value;
    memcpy(&value, bytes, sizeof value);
    return value;
}

uint64_t input_u64(const unsigned char *bytes)
{
    uint64_t value;
    memcpy(&value, bytes, sizeof value);
    return value;
}

float input_f32(const unsigned char *bytes)
{
    float value;
    memcpy(&value, bytes, sizeof value);
    return value;
}
