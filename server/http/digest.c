#include "server/http/digest.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include <openssl/evp.h>

#define BASE64_LENGTH 44 /* of 32 bytes */

/* --- reading ------------------------------------------------------------------------------ */

/* ":<base64 of 32 bytes>:" */
static bool parse_bytes(const char *text, unsigned char digest[32])
{
    unsigned char decoded[36];
    if (text[0] != ':' || strcspn(text + 1, ":") != BASE64_LENGTH || text[BASE64_LENGTH + 1] != ':' ||
        text[BASE64_LENGTH] != '=' || text[BASE64_LENGTH - 1] == '=')
        return false;
    if (EVP_DecodeBlock(decoded, (const unsigned char *)text + 1, BASE64_LENGTH) != 33)
        return false;
    memcpy(digest, decoded, 32);
    return true;
}

/* A dictionary of structured fields (RFC 8941): key=value, key=value. */
int digest_of_request(const struct request *request, unsigned char digest[32])
{
    const char *at = request_header(request, "Content-Digest");
    while (at && *at) {
        at += strspn(at, " \t,");
        if (!strncmp(at, "sha-256=", 8))
            return parse_bytes(at + 8, digest) ? 1 : -1;
        at += strcspn(at, ",");
    }
    return 0;
}

/* --- hashing -------------------------------------------------------------------------------- */

bool digest_start(struct request *request)
{
    switch (digest_of_request(request, request->digest)) {
    case 0:
        return true;
    case 1:
        request->has_digest = true;
        break;
    default:
        respond_refusal(request, 400, "bad-digest", "Content-Digest cannot be understood",
                        "Content-Digest must be like sha-256=:<base64 of 32 bytes>:");
        return false;
    }
    if (request->route->body != BODY_FILE)
        return true; /* the others' bytes are hashed anyway, or are in memory */
    request->hash = EVP_MD_CTX_new();
    if (request->hash && EVP_DigestInit_ex(request->hash, EVP_sha256(), NULL) == 1)
        return true;
    respond_failure(request, GROOM_ENOMEM, NULL);
    return false;
}

void digest_update(struct request *request, const char *bytes, size_t n)
{
    if (request->hash && EVP_DigestUpdate(request->hash, bytes, n) != 1)
        respond_failure(request, GROOM_EINTERNAL, NULL);
}

static bool compute(struct request *request, unsigned char digest[32])
{
    switch (request->route->body) {
    case BODY_BLOB:
        return request->blob && blobs_digest(request->blob, digest);
    case BODY_FILE:
        return request->hash && EVP_DigestFinal_ex(request->hash, digest, NULL) == 1;
    default:
        return EVP_Digest(request->body ? request->body : "", request->n_body, digest, NULL, EVP_sha256(), NULL) == 1;
    }
}

static void print(const unsigned char digest[32], char text[DIGEST_TEXT_SIZE])
{
    unsigned char base64[BASE64_LENGTH + 1];
    EVP_EncodeBlock(base64, digest, 32);
    snprintf(text, DIGEST_TEXT_SIZE, "sha-256=:%s:", (const char *)base64);
}

bool digest_check(struct request *request)
{
    unsigned char computed[32];
    char said[DIGEST_TEXT_SIZE], found[DIGEST_TEXT_SIZE];
    if (!request->has_digest || request->route->body == BODY_UPLOAD)
        return true;
    if (!compute(request, computed)) {
        respond_failure(request, GROOM_EINTERNAL, NULL);
        return false;
    }
    if (!memcmp(computed, request->digest, 32))
        return true;
    print(request->digest, said);
    print(computed, found);
    respond_refusal(request, 400, "digest-mismatch", "the bytes are not those that their digest names",
                    "Content-Digest says %s, the bytes received have %s: send them again", said, found);
    return false;
}

void digest_text(const char *sha256, char text[DIGEST_TEXT_SIZE])
{
    unsigned char digest[32];
    for (int i = 0; i < 32; i++) {
        unsigned byte = 0;
        sscanf(sha256 + 2 * i, "%2x", &byte);
        digest[i] = (unsigned char)byte;
    }
    print(digest, text);
}
