/* What pages are made of. */
#ifndef HTTP_HTML_H
#define HTTP_HTML_H

#include <stdio.h>

#include "server/http/request.h"

/* Text with what HTML would read as markup written as entities. */
void html_escape(FILE *out, const char *text);

/* Answer with a page that was written to a stream of open_memstream (closed here; text taken over). It may
 * show pictures and use styles of this host, and nothing else. */
void html_respond(struct request *request, FILE *out, char **text, size_t *n_bytes);

#endif
