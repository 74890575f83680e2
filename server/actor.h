/* For whom a thread works just now: what the log and the audit say of whatever it does. The HTTP side
 * sets it around each handler; where nobody did, groomd acts by itself. */
#ifndef SERVER_ACTOR_H
#define SERVER_ACTOR_H

#include <stdint.h>

#define ACTOR_TEXT_SIZE 64

struct actor {
    char request[24];              /* id of the request; "" where there is none */
    char token[ACTOR_TEXT_SIZE];   /* id of the token ("tok_…"), or an attempt ("job_….2"); "" */
    char name[ACTOR_TEXT_SIZE];    /* of the token; "anybody" where none is asked for, "groomd" */
    char project[ACTOR_TEXT_SIZE]; /* "" where it is nobody's */
    /* Its Idempotency-Key, written with the first thing that it makes; borrowed; NULL: none */
    const char *key, *key_hash;
    int64_t key_lifetime_ms;
};

/* Of this thread; never NULL. */
const struct actor *actor_get(void);
/* Copied; NULL: groomd itself. */
void actor_set(const struct actor *actor);

#endif
