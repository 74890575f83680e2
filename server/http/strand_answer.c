#include "server/http/strand_answer.h"

#include <stdlib.h>

#include "proto/strand_stream.h"

struct answer {
    struct response_pieces pieces; /* first: it is released by its address */
    void (*release)(void *user);
    void *user;
    char head[STRAND_STREAM_HEAD];
};

static void release_answer(struct response_pieces *pieces)
{
    struct answer *answer = (struct answer *)pieces;
    answer->release(answer->user);
    free(answer);
}

void respond_strands(struct request *request, const struct groom_strands *strands, void (*release)(void *user), void *user)
{
    struct answer *answer = calloc(1, sizeof *answer);
    if (!answer) {
        release(user);
        respond_failure(request, GROOM_ENOMEM, NULL);
        return;
    }
    answer->release = release;
    answer->user = user;
    strand_stream_head(strands->n_strands, strands->n_vertices, answer->head);
    answer->pieces = (struct response_pieces){
        {{answer->head, sizeof answer->head},
         {strands->first, ((size_t)strands->n_strands + 1) * sizeof *strands->first},
         {strands->points, strands->n_vertices * sizeof *strands->points}}, 3, release_answer};
    respond_pieces(request, STRAND_STREAM_TYPE, &answer->pieces);
}
