#include "tests/support/fits.h"

#include <stdlib.h>
#include <string.h>

#include "tests/support/test.h"

static groom_status append(void *user, const void *bytes, size_t n)
{
    struct fits_state *state = user;
    if (state->n + n > state->room)
        state->bytes = realloc(state->bytes, state->room = 2 * (state->n + n));
    memcpy(state->bytes + state->n, bytes, n);
    state->n += n;
    return GROOM_OK;
}

struct fits_state fits_save(const struct groom_fit *fit)
{
    struct fits_state state = {0};
    ck_ok(groom_fit_save(fit, (struct groom_sink){append, &state}, NULL));
    return state;
}

groom_status fits_load(struct groom_fit *fit, const struct fits_state *state, struct groom_diag *diag)
{
    struct groom_memory_source memory;
    struct groom_source source = groom_source_from_memory(&memory, state->bytes, state->n);
    return groom_fit_load(fit, &source, NULL, diag);
}

struct groom_fit *fits_pass_on(struct groom_fit *fit, struct groom_fit *fresh)
{
    struct fits_state state = fits_save(fit);
    ck_ok(fits_load(fresh, &state, NULL));
    groom_fit_destroy(fit);
    free(state.bytes);
    return fresh;
}

size_t fits_finish_without_memory(struct groom_fit *fit)
{
    struct test_failing_allocator state;
    struct groom_allocator allocator;
    struct groom_context context = {.allocator = &allocator};
    size_t fail_at = 0, failures = 0;
    while (!groom_fit_done(fit)) {
        test_failing_allocator_init(&state, fail_at, &allocator);
        groom_status st = groom_fit_step(fit, &context, NULL);
        ck_assert_uint_eq(state.outstanding_bytes, 0);
        ck_assert(st == GROOM_OK || st == GROOM_ENOMEM);
        failures += st != GROOM_OK;
        fail_at = st == GROOM_OK ? 0 : fail_at + 1;
    }
    return failures;
}

const struct groom_fit_loss *fits_loss(const struct groom_fit *fit, const char *stage, const char *name)
{
    const struct groom_fit_report *report = groom_fit_get_report(fit);
    for (uint32_t i = 0; i < report->n_losses; i++)
        if (strcmp(report->losses[i].stage, stage) == 0 && strcmp(report->losses[i].name, name) == 0)
            return &report->losses[i];
    ck_abort_msg("no loss %s of stage %s", name, stage);
    return NULL;
}

int fits_is_noted(const struct groom_fit *fit, const char *words)
{
    const struct groom_fit_report *report = groom_fit_get_report(fit);
    for (uint32_t i = 0; i < report->n_notes; i++)
        if (strstr(report->notes[i], words))
            return 1;
    return 0;
}
