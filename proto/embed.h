/* Files as they are, inside a program: nothing has to be found at run time.
 *
 *     EMBED(openapi_json, "proto/openapi.json")
 *
 * defines `const char openapi_json[]` and `const size_t openapi_json_size`. The path starts at the
 * root of the source tree, where make runs; Makefile says which objects depend on which files. */
#ifndef PROTO_EMBED_H
#define PROTO_EMBED_H

#include <stddef.h>

#define EMBED(name, path)                                                                          \
    extern const char name[];                                                                      \
    extern const size_t name##_size;                                                               \
    __asm__(".pushsection .rodata\n"                                                               \
            ".balign 16\n.global " #name "\n" #name ":\n.incbin \"" path "\"\n" #name "_end:\n"    \
            ".balign 8\n.global " #name "_size\n" #name "_size:\n.quad " #name "_end - " #name "\n" \
            ".popsection\n")

#endif
