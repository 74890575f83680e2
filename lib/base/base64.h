/* Base64 (RFC 4648, padded, no line breaks): how arrays travel in JSON. */
#ifndef BASE_BASE64_H
#define BASE_BASE64_H

#include <stddef.h>
#include <stdint.h>

/* Characters of n_bytes encoded, without a terminator. */
size_t base64_encoded_length(size_t n_bytes);
/* Writes base64_encoded_length(n_bytes) characters and a terminating zero. */
void base64_encode(const void *bytes, size_t n_bytes, char *text);

/* Bytes of a text of this length with its padding, or -1 where no base64 text has it. */
int64_t base64_decoded_length(const char *text, size_t n_characters);
/* returns 0, or -1 where a character is not base64's (padding inside, spaces, stray bits) */
int base64_decode(const char *text, size_t n_characters, void *bytes);

#endif
