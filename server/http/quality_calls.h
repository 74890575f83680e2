/* What the calls about quality share. */
#ifndef HTTP_QUALITY_CALLS_H
#define HTTP_QUALITY_CALLS_H

#include "server/grooms/grooms.h"
#include "server/http/request.h"

/* The groom of the path, ?revision= and ?with=. returns false where one was refused (and answered) */
bool quality_query(struct request *request, struct grooms_comparison *what);

#endif
