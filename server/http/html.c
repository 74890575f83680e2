#include "server/http/html.h"

#include <stdlib.h>

void html_escape(FILE *out, const char *text)
{
    for (; *text; text++)
        switch (*text) {
        case '<':
            fputs("&lt;", out);
            break;
        case '>':
            fputs("&gt;", out);
            break;
        case '&':
            fputs("&amp;", out);
            break;
        case '"':
            fputs("&quot;", out);
            break;
        case '\'':
            fputs("&#39;", out);
            break;
        default:
            fputc(*text, out);
        }
}

void html_respond(struct request *request, FILE *out, char **text, size_t *n_bytes)
{
    if (fclose(out)) {
        free(*text);
        respond_failure(request, GROOM_ENOMEM, NULL);
        return;
    }
    respond_bytes(request, 200, "text/html; charset=utf-8", *text, *n_bytes);
    respond_header(request, "Content-Security-Policy",
                   "default-src 'none'; img-src 'self'; style-src 'self'; base-uri 'none'; form-action "
                   "'none'; frame-ancestors 'none'");
    respond_header(request, "Referrer-Policy", "no-referrer");
}
