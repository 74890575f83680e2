#include "base/base64.h"

static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

size_t base64_encoded_length(size_t n_bytes) { return (n_bytes + 2) / 3 * 4; }

static void encode_triple(uint32_t triple, char *text)
{
    text[0] = alphabet[triple >> 18];
    text[1] = alphabet[triple >> 12 & 63];
    text[2] = alphabet[triple >> 6 & 63];
    text[3] = alphabet[triple & 63];
}

void base64_encode(const void *bytes, size_t n_bytes, char *text)
{
    const unsigned char *in = bytes;
    size_t n_left = n_bytes;
    for (; n_left >= 3; n_left -= 3, in += 3, text += 4)
        encode_triple((uint32_t)in[0] << 16 | (uint32_t)in[1] << 8 | in[2], text);
    if (n_left > 0) {
        encode_triple((uint32_t)in[0] << 16 | (n_left == 2 ? (uint32_t)in[1] << 8 : 0), text);
        text[3] = '=';
        if (n_left == 1)
            text[2] = '=';
        text += 4;
    }
    *text = '\0';
}

/* value of a character, or 255 */
static unsigned char value_of[256];

__attribute__((constructor)) static void fill_values(void)
{
    for (int i = 0; i < 256; i++)
        value_of[i] = 255;
    for (unsigned char i = 0; i < 64; i++)
        value_of[(unsigned char)alphabet[i]] = i;
}

static size_t padding_of(const char *text, size_t n_characters)
{
    if (n_characters < 4 || text[n_characters - 1] != '=')
        return 0;
    return text[n_characters - 2] == '=' ? 2 : 1;
}

int64_t base64_decoded_length(const char *text, size_t n_characters)
{
    if (n_characters % 4 != 0)
        return -1;
    return (int64_t)(n_characters / 4 * 3 - padding_of(text, n_characters));
}

/* The last quartet, whose padding counts as zeros; stray bits under the padding are refused. */
static int decode_tail(const char *text, size_t padding, unsigned char *out)
{
    uint32_t quartet = 0;
    for (size_t i = 0; i < 4; i++) {
        unsigned char value = i < 4 - padding ? value_of[(unsigned char)text[i]] : 0;
        if (value == 255)
            return -1;
        quartet = quartet << 6 | value;
    }
    for (size_t i = 0; i < 3 - padding; i++)
        out[i] = (unsigned char)(quartet >> (16 - 8 * i));
    return quartet & (padding == 2 ? 0xffffu : padding == 1 ? 0xffu : 0) ? -1 : 0;
}

int base64_decode(const char *text, size_t n_characters, void *bytes)
{
    unsigned char *out = bytes;
    if (n_characters % 4 != 0)
        return -1;
    if (n_characters == 0)
        return 0;
    unsigned char bad = 0;
    size_t n_body = n_characters - 4;
    for (size_t i = 0; i < n_body; i += 4, out += 3) {
        unsigned char a = value_of[(unsigned char)text[i]], b = value_of[(unsigned char)text[i + 1]];
        unsigned char c = value_of[(unsigned char)text[i + 2]], d = value_of[(unsigned char)text[i + 3]];
        bad |= a | b | c | d; /* 255 sets bit 7, which no value has */
        out[0] = (unsigned char)(a << 2 | b >> 4);
        out[1] = (unsigned char)(b << 4 | c >> 2);
        out[2] = (unsigned char)(c << 6 | d);
    }
    if (bad & 0x80)
        return -1;
    return decode_tail(text + n_body, padding_of(text, n_characters), out);
}
