/* Who asks for what: credentials, scopes, limits, projects, other origins, repeated requests. The
 * handlers find the outcome in request->actor, scopes and limits, and need not care.
 *
 * A browser cannot set headers for event streams, images and downloads. For these there is a session: a
 * cookie that `POST /v1/session` gives to whoever shows a token. Scripts cannot read it (HttpOnly),
 * other sites cannot have it sent (SameSite=Strict), and it is good for GET and HEAD alone: whatever
 * changes something shows the token itself. Tokens never stand in URLs, which logs and histories keep. */
#ifndef HTTP_ACCESS_H
#define HTTP_ACCESS_H

#include "server/http/request.h"

struct MHD_Response;

#define ACCESS_COOKIE "groomd_session"

/* Before the body, in the HTTP thread: from memory alone.
 * returns  false where the request is refused (and answered): 401, 403, 429 */
bool access_check(struct request *request);
/* The refusal of a call that needs another token than it came with; error: "invalid_token" or NULL. */
void access_refuse(struct request *request, const char *error, const char *detail);

/* Is there an id in the path whose owner must be asked for? */
bool access_needs_owner(const struct request *request);
/* Asks the store. returns  false where it is another project's, or nobody's: 404 has been answered */
bool access_check_owner(struct request *request);
/* The same for an id that stands elsewhere: in the query, in a body. */
bool access_check_id(struct request *request, const char *id);

/* A request with an Idempotency-Key that came before is answered with what that one made. Around the
 * handler, in its lane.
 * returns  false where it has been answered */
bool access_begin_once(struct request *request);
void access_end_once(struct request *request);

/* May pages of this origin (--cors-origins) use the API? */
bool access_allows_origin(const struct request *request, const char *origin);
/* What such a page needs to read the answer, and to ask before it asks. */
void access_add_cors(const struct request *request, struct MHD_Response *response);

#endif
