/* Content-Digest (RFC 9530): what a sender says of the bytes of its message, and what we say of ours.
 * sha-256 alone; other algorithms are passed over, as the RFC allows. */
#ifndef HTTP_DIGEST_H
#define HTTP_DIGEST_H

#include "server/http/request.h"

#define DIGEST_TEXT_SIZE 64

/* The request's Content-Digest. returns  1 and the 32 bytes; 0: it says nothing of sha-256; -1: it is
 * not well-formed */
int digest_of_request(const struct request *request, unsigned char digest[32]);
/* After the head: prepare to hash the body where the request has a digest. returns  false where the
 * header is refused (and answered) */
bool digest_start(struct request *request);
void digest_update(struct request *request, const char *bytes, size_t n);
/* After the body. returns  false where the bytes are others (and answered) */
bool digest_check(struct request *request);

/* 64 hexadecimal digits as "sha-256=:<base64>:". */
void digest_text(const char *sha256, char text[DIGEST_TEXT_SIZE]);

#endif
