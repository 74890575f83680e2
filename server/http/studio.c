/* The web studio: files that were bundled and compressed when groomd was built, and need nothing else. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "proto/embed.h"
#include "server/http/handlers.h"

EMBED(studio_index_html, "build/web/studio/index.html.gz");
EMBED(studio_js, "build/web/studio/studio.js.gz");
EMBED(studio_css, "build/web/studio/studio.css.gz");
EMBED(studio_worker_js, "build/web/studio/worker.js.gz");
EMBED(studio_engine_wasm, "build/web/studio/engine.wasm.gz");

static const struct file {
    const char *name, *content_type, *bytes; /* gzip */
    const size_t *n_bytes;
} files[] = {
    {"index.html", "text/html; charset=utf-8", studio_index_html, &studio_index_html_size},
    {"studio.js", "text/javascript; charset=utf-8", studio_js, &studio_js_size},
    {"studio.css", "text/css; charset=utf-8", studio_css, &studio_css_size},
    {"worker.js", "text/javascript; charset=utf-8", studio_worker_js, &studio_worker_js_size},
    {"engine.wasm", "application/wasm", studio_engine_wasm, &studio_engine_wasm_size},
};

/* Scripts of its own and the engine, pictures that it makes; no other host, no plug-in, no frame. */
#define POLICY                                                                                     \
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; " \
    "style-src-attr 'unsafe-inline'; img-src 'self' data: blob:; font-src data:; connect-src 'self'; base-uri 'none'; " \
    "form-action 'none'; frame-ancestors 'none'"

/* gzip ends in the checksum and the size of what it holds, little-endian. */
static uint32_t word_before_end(const struct file *file, size_t before)
{
    const unsigned char *at = (const unsigned char *)file->bytes + *file->n_bytes - before;
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static bool accepts_gzip(const struct request *request)
{
    const char *accepted = request_header(request, "Accept-Encoding"), *at = accepted ? strstr(accepted, "gzip") : NULL;
    return at && strncmp(at + 4, ";q=0", 4) != 0;
}

/* For the rare client that takes no gzip. */
static void respond_inflated(struct request *request, const struct file *file)
{
    size_t n = word_before_end(file, 4);
    char *bytes = malloc(n ? n : 1);
    z_stream stream = {.next_in = (Bytef *)(size_t)file->bytes, .avail_in = (uInt)*file->n_bytes,
                       .next_out = (Bytef *)bytes, .avail_out = (uInt)n};
    if (bytes && inflateInit2(&stream, 16 + MAX_WBITS) == Z_OK) {
        int end = inflate(&stream, Z_FINISH);
        inflateEnd(&stream);
        if (end == Z_STREAM_END) {
            respond_bytes(request, 200, file->content_type, bytes, n);
            return;
        }
    }
    free(bytes);
    respond_failure(request, GROOM_ENOMEM, NULL);
}

static void send_file(struct request *request, const struct file *file)
{
    char etag[24];
    bool gzip = accepts_gzip(request);
    snprintf(etag, sizeof etag, "%08x%s", word_before_end(file, 8), gzip ? "-gzip" : "");
    if (request_not_modified(request, etag))
        return;
    if (gzip) {
        respond_static(request, 200, file->content_type, file->bytes, *file->n_bytes);
        respond_header(request, "Content-Encoding", "gzip");
    } else {
        respond_inflated(request, file);
    }
    respond_etag(request, "%s", etag);
    respond_header(request, "Vary", "Accept-Encoding");
    respond_header(request, "Content-Security-Policy", POLICY);
    respond_header(request, "Referrer-Policy", "no-referrer");
}

void studio_index(struct request *request) { send_file(request, &files[0]); }

void studio_file(struct request *request)
{
    const char *name = request->parameter[0];
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
        if (!strcmp(name, files[i].name)) {
            send_file(request, &files[i]);
            return;
        }
    respond_refusal(request, 404, "not-found", "no such thing", "the studio has no file \"%.40s\"", name);
}
