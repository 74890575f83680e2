/* Dense strands as an answer to a worker (proto/strand_stream.h). */
#ifndef HTTP_STRAND_ANSWER_H
#define HTTP_STRAND_ANSWER_H

#include "groom/strands.h"
#include "server/http/request.h"

/* The strands' own memory is sent; release(user) gives it back once that is done, or at once where memory is out. */
void respond_strands(struct request *request, const struct groom_strands *strands, void (*release)(void *user), void *user);

#endif
