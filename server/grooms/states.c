/* Dense strands that were computed, least recently used out first. */
#include <stdlib.h>
#include <string.h>

#include "server/grooms/room.h"

struct states {
    pthread_mutex_t lock;
    struct state *first;
    size_t n_bytes, max_bytes;
    uint64_t clock;
};

groom_status states_create(size_t max_bytes, struct states **out)
{
    struct states *states = calloc(1, sizeof *states);
    if (!states)
        return GROOM_ENOMEM;
    states->max_bytes = max_bytes;
    pthread_mutex_init(&states->lock, NULL);
    *out = states;
    return GROOM_OK;
}

static void free_state(struct state *state)
{
    groom_strands_destroy(state->strands);
    groom_layer_input_destroy(state->input);
    free(state);
}

void states_destroy(struct states *states)
{
    if (!states)
        return;
    for (struct state *state = states->first, *next; state; state = next) {
        next = state->next;
        free_state(state);
    }
    pthread_mutex_destroy(&states->lock);
    free(states);
}

/* --- with the lock held ----------------------------------------------------------------- */

static struct state *find(struct states *states, const char *key)
{
    for (struct state *state = states->first; state; state = state->next)
        if (strcmp(state->key, key) == 0) {
            state->n_users++;
            state->last_used = ++states->clock;
            return state;
        }
    return NULL;
}

static void make_room(struct states *states)
{
    while (states->n_bytes > states->max_bytes) {
        struct state **oldest = NULL;
        for (struct state **link = &states->first; *link; link = &(*link)->next)
            if ((*link)->n_users == 0 && (!oldest || (*link)->last_used < (*oldest)->last_used))
                oldest = link;
        if (!oldest)
            return;
        struct state *state = *oldest;
        *oldest = state->next;
        states->n_bytes -= state->n_bytes;
        free_state(state);
    }
}

/* --- what others call ------------------------------------------------------------------------ */

struct state *states_find(struct states *states, const char *key)
{
    pthread_mutex_lock(&states->lock);
    struct state *state = find(states, key);
    pthread_mutex_unlock(&states->lock);
    return state;
}

groom_status states_keep(struct states *states, const char *key, struct groom_strands *strands, struct state **out)
{
    struct state *made = calloc(1, sizeof *made), *state;
    if (!made) {
        groom_strands_destroy(strands);
        return GROOM_ENOMEM;
    }
    strncpy(made->key, key, sizeof made->key - 1);
    made->strands = strands;
    made->n_bytes = sizeof *made + (size_t)strands->n_vertices * 12 + (size_t)strands->n_strands * 4;
    pthread_mutex_lock(&states->lock);
    if (!(state = find(states, key))) { /* else another thread was faster, with the same bits */
        made->next = states->first;
        states->first = made;
        states->n_bytes += made->n_bytes;
        state = find(states, key);
        made = NULL;
        make_room(states);
    }
    pthread_mutex_unlock(&states->lock);
    if (made)
        free_state(made);
    *out = state;
    return GROOM_OK;
}

void states_release(struct states *states, struct state *state)
{
    if (!state)
        return;
    pthread_mutex_lock(&states->lock);
    state->n_users--;
    make_room(states);
    pthread_mutex_unlock(&states->lock);
}

static size_t input_bytes(const struct groom_layer_input *input) { return input ? groom_layer_input_bytes(input) : 0; }

struct groom_layer_input *states_take_input(struct states *states, struct state *state)
{
    pthread_mutex_lock(&states->lock);
    struct groom_layer_input *input = state->input;
    state->input = NULL;
    state->n_bytes -= input_bytes(input);
    states->n_bytes -= input_bytes(input);
    pthread_mutex_unlock(&states->lock);
    return input;
}

void states_give_input(struct states *states, struct state *state, struct groom_layer_input *input)
{
    pthread_mutex_lock(&states->lock);
    struct groom_layer_input *before = state->input;
    state->input = input;
    state->n_bytes += input_bytes(input) - input_bytes(before);
    states->n_bytes += input_bytes(input) - input_bytes(before);
    make_room(states);
    pthread_mutex_unlock(&states->lock);
    groom_layer_input_destroy(before);
}
