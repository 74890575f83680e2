/* Dense strands that were computed. */
#include <stdlib.h>
#include <string.h>

#include "server/grooms/room.h"

/* A few places of each chain of MOST_MODELS grooms. */
#define MOST_STATES 256

struct states {
    struct cache *cache;
    pthread_mutex_t inputs; /* of every state's `input` */
};

static struct state *state_of(struct cache_entry *entry) { return (struct state *)entry; }

static void free_state(struct cache_entry *entry)
{
    groom_strands_destroy(state_of(entry)->strands);
    groom_layer_input_destroy(state_of(entry)->input);
    free(entry);
}

groom_status states_create(size_t max_bytes, struct states **out)
{
    struct states *states = calloc(1, sizeof *states);
    if (!states || cache_create(max_bytes, MOST_STATES, free_state, &states->cache) != GROOM_OK) {
        free(states);
        return GROOM_ENOMEM;
    }
    pthread_mutex_init(&states->inputs, NULL);
    *out = states;
    return GROOM_OK;
}

void states_destroy(struct states *states)
{
    if (!states)
        return;
    cache_destroy(states->cache);
    pthread_mutex_destroy(&states->inputs);
    free(states);
}

struct state *states_find(struct states *states, const char *key) { return state_of(cache_get(states->cache, key)); }

static size_t bytes_of(const struct state *state)
{
    return sizeof *state + (size_t)state->strands->n_vertices * 12 + (size_t)state->strands->n_strands * 4 +
           (state->input ? groom_layer_input_bytes(state->input) : 0);
}

groom_status states_keep(struct states *states, const char *key, struct groom_strands *strands, struct state **state)
{
    struct state *made = calloc(1, sizeof *made);
    if (!made) {
        groom_strands_destroy(strands);
        return GROOM_ENOMEM;
    }
    strncpy(made->entry.key, key, sizeof made->entry.key - 1);
    made->strands = strands;
    made->entry.n_bytes = bytes_of(made);
    *state = state_of(cache_keep(states->cache, &made->entry)); /* or another thread's, with the same bits */
    return GROOM_OK;
}

void states_release(struct states *states, struct state *state) { cache_put_back(states->cache, (struct cache_entry *)state); }

/* Put another input in its place and return the one that was there. */
static struct groom_layer_input *exchange(struct states *states, struct state *state, struct groom_layer_input *input)
{
    pthread_mutex_lock(&states->inputs);
    struct groom_layer_input *before = state->input;
    state->input = input;
    cache_resize(states->cache, &state->entry, bytes_of(state));
    pthread_mutex_unlock(&states->inputs);
    return before;
}

struct groom_layer_input *states_take_input(struct states *states, struct state *state)
{
    return exchange(states, state, NULL);
}

void states_give_input(struct states *states, struct state *state, struct groom_layer_input *input)
{
    groom_layer_input_destroy(exchange(states, state, input));
}
