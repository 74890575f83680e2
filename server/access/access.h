/* Who may do what: tokens, their scopes and limits.
 *
 * Tokens live in one small file of the data folder, tokens.json, which is replaced as a whole (written
 * aside, synced, renamed, under a lock file) by `groomd token`, also while the daemon runs; the daemon
 * sees at the next request that it is another. A token itself is shown once and never kept: the file
 * has its SHA-256. It is compared against every entry in constant time. What was revoked stays listed.
 *
 * Before the first token is made nobody is asked for one: everything is done as project "default" with
 * all scopes. The daemon allows that on loopback alone. From the first token on (though it be revoked
 * or expired) each request needs one.
 *
 * threads   any */
#ifndef ACCESS_ACCESS_H
#define ACCESS_ACCESS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "groom/diag.h"

#define ACCESS_TEXT_SIZE  64 /* ids, names, projects */
#define ACCESS_TOKEN_SIZE 64 /* "grt_" and 48 characters: 240 random bits */
#define ACCESS_HASH_SIZE  32

/* No scope holds another. */
enum access_scope {
    ACCESS_READ = 1,   /* look at what the project has */
    ACCESS_SUBMIT = 2, /* upload, queue jobs, edit */
    ACCESS_WORK = 4,   /* what an attempt's own one-time token may, for its job */
    ACCESS_ADMIN = 8   /* the service: its audit, its figures, jobs ahead of others */
};
#define ACCESS_ALL (ACCESS_READ | ACCESS_SUBMIT | ACCESS_WORK | ACCESS_ADMIN)

const char *access_scope_name(enum access_scope scope); /* "read" */
/* "read,submit"; returns  GROOM_EINVAL, the detail lists the scopes */
GROOM_MUST_CHECK groom_status access_scopes_parse(const char *text, unsigned *scopes, struct groom_diag *diag);
void access_scopes_print(unsigned scopes, char text[ACCESS_TEXT_SIZE]);
/* 1 to 63 of a-z 0-9 - _ . */
GROOM_MUST_CHECK groom_status access_check_project(const char *name, struct groom_diag *diag);

/* 0: the daemon's default (struct access_options). */
struct access_limits {
    uint64_t requests_per_s; /* on average; ten seconds' worth at once */
    uint64_t bytes;          /* of its uploads */
    uint64_t queued;         /* jobs that may wait */
};

struct access_token {
    char id[ACCESS_TEXT_SIZE]; /* "tok_…" */
    char name[ACCESS_TEXT_SIZE], project[ACCESS_TEXT_SIZE];
    unsigned scopes;
    unsigned char hash[ACCESS_HASH_SIZE]; /* SHA-256 of the token */
    struct access_limits limits;
    int64_t created_ms, expires_ms, revoked_ms; /* since 1970; 0: never */
};

/* --- the file ------------------------------------------------------------------------- */

struct access_list {
    struct access_token *items;
    size_t n;
};

/* All of them, oldest first; none where there is no file. returns  GROOM_EFORMAT, GROOM_EIO */
GROOM_MUST_CHECK groom_status access_list_read(const char *folder, struct access_list *list,
                                               struct groom_diag *diag);
void access_list_finish(struct access_list *list); /* takes zeroed */
/* wanted   name, project, scopes, limits and expires_ms; the rest is filled in
 * token    shown here and nowhere else */
GROOM_MUST_CHECK groom_status access_create(const char *folder, struct access_token *wanted,
                                            char token[ACCESS_TOKEN_SIZE], struct groom_diag *diag);
/* Good from the next request on. returns  GROOM_ENOTFOUND, GROOM_ECONFLICT (it is revoked already) */
GROOM_MUST_CHECK groom_status access_revoke(const char *folder, const char *id, struct groom_diag *diag);

/* --- the daemon's view -------------------------------------------------------------------- */

struct access;

struct access_options {
    const char *folder; /* borrowed */
    struct access_limits defaults; /* 0: no limit */
    /* Something of a token has changed since the last look ("token.create", "token.revoke"); from any
     * thread that asks for access. NULL: nobody cares. */
    void (*changed)(void *user, const char *action, const struct access_token *token);
    void *user;
};

/* returns  GROOM_EFORMAT (the file is damaged: it says what to do), GROOM_EIO */
GROOM_MUST_CHECK groom_status access_open(const struct access_options *options, struct access **access,
                                          struct groom_diag *diag);
void access_close(struct access *access); /* takes NULL */

/* Was there never a token? */
bool access_is_open(struct access *access);
/* Is there one that is neither revoked nor expired? */
bool access_has_usable(struct access *access);
/* Copies with limits filled in. returns  GROOM_ENOTFOUND: unknown, revoked or expired (detail: which) */
GROOM_MUST_CHECK groom_status access_find(struct access *access, const char *token, struct access_token *found,
                                          struct groom_diag *diag);
GROOM_MUST_CHECK groom_status access_find_id(struct access *access, const char *id, struct access_token *found,
                                             struct groom_diag *diag);
/* One request of a token: 0, or milliseconds until it may ask again. */
int64_t access_take_turn(struct access *access, const struct access_token *token);

/* --- sessions: what a browser sends where it can set no header ------------------------------- */

#define ACCESS_SESSION_SIZE 192
/* A signed text that stands for a token until a time. The key is this process's own: a session ends with
 * the daemon, with its time, and with its token. */
void access_session_make(struct access *access, const char *token_id, int64_t until_ms,
                         char session[ACCESS_SESSION_SIZE]);
GROOM_MUST_CHECK groom_status access_session_find(struct access *access, const char *session,
                                                  struct access_token *found, struct groom_diag *diag);

#endif
