/* The help: pages and pictures that client/docs/build.mjs has packed into one file. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "proto/embed.h"
#include "server/http/handlers.h"

EMBED(docs_pack, "build/web/docs.pack");

struct file {
    const char *bytes, *content_type;
    size_t n_bytes;
};

/* The types that build.mjs writes; an answer wants one that stays. */
static const char *known_type(const char *text, size_t n)
{
    static const char *const types[] = {"text/html; charset=utf-8", "text/css; charset=utf-8", "image/png", "image/jpeg"};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        if (strlen(types[i]) == n && !strncmp(types[i], text, n))
            return types[i];
    return "application/octet-stream";
}

/* Its table is lines of name, type and size, ended by an empty one; then come the bytes in the same order. */
static bool find_file(const char *name, struct file *found)
{
    const char *end = docs_pack + docs_pack_size, *line, *next;
    size_t before = 0;
    *found = (struct file){0};
    for (line = docs_pack; line < end && *line != '\n'; line = next) {
        size_t n_name = strcspn(line, "\t"), n_type = strcspn(line + n_name + 1, "\t");
        const char *type = line + n_name + 1;
        size_t size = strtoul(type + n_type + 1, NULL, 10);
        next = (const char *)memchr(line, '\n', (size_t)(end - line)) + 1;
        if (strlen(name) == n_name && !strncmp(name, line, n_name))
            *found = (struct file){(const char *)before, known_type(type, n_type), size};
        before += size;
    }
    if (!found->content_type)
        return false;
    found->bytes = line + 1 + (size_t)found->bytes;
    return true;
}

static void send_file(struct request *request, const char *name)
{
    struct file file;
    char etag[48];
    if (!find_file(name, &file)) {
        respond_refusal(request, 404, "not-found", "no such thing", "the help has no page \"%.60s\"; it begins at /docs/", name);
        return;
    }
    snprintf(etag, sizeof etag, "%zx-%zx", docs_pack_size, (size_t)(file.bytes - docs_pack));
    if (request_not_modified(request, etag))
        return;
    respond_static(request, 200, file.content_type, file.bytes, file.n_bytes);
    respond_etag(request, "%s", etag);
    respond_header(request, "Content-Security-Policy",
                   "default-src 'none'; style-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    respond_header(request, "Referrer-Policy", "no-referrer");
}

void docs_index(struct request *request) { send_file(request, "index.html"); }
void docs_file(struct request *request) { send_file(request, request->parameter[0]); }
