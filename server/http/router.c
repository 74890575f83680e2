#include "server/http/router.h"

#include <stdio.h>
#include <string.h>

/* Does the uri fit the pattern? Fills the parameters as it goes. */
static int fits(const char *pattern, const struct uri *uri, struct router_match *match)
{
    size_t segment = 0, n_parameters = 0;
    if (!strcmp(pattern, "/"))
        return uri->n_segments == 0;
    while (*pattern == '/') {
        size_t n = strcspn(++pattern, "/");
        if (segment == uri->n_segments)
            return 0;
        const char *given = uri->segment[segment++];
        if (*pattern == '{') {
            if (!*given || n_parameters == ROUTE_MAX_PARAMETERS)
                return 0;
            match->parameter[n_parameters++] = given;
        } else if (strlen(given) != n || strncmp(given, pattern, n)) {
            return 0;
        }
        pattern += n;
    }
    return segment == uri->n_segments;
}

static void allow(struct router_match *match, const char *method)
{
    size_t n = strlen(match->allow);
    snprintf(match->allow + n, sizeof match->allow - n, "%s%s%s", n ? ", " : "", method,
             strcmp(method, "GET") ? "" : ", HEAD");
}

enum router_outcome router_find(const struct route *routes, size_t n_routes, const char *method,
                                const struct uri *uri, struct router_match *match)
{
    struct router_match found = {0}, trial = {0};
    const char *wanted = strcmp(method, "HEAD") ? method : "GET";
    for (size_t i = 0; i < n_routes; i++) {
        if (!fits(routes[i].pattern, uri, &trial))
            continue;
        allow(&found, routes[i].method);
        if (found.route || strcmp(routes[i].method, wanted))
            continue;
        found.route = &routes[i];
        memcpy(found.parameter, trial.parameter, sizeof found.parameter);
    }
    if (found.allow[0])
        strcat(found.allow, ", OPTIONS");
    *match = found;
    return found.route ? ROUTER_FOUND : found.allow[0] ? ROUTER_NO_METHOD : ROUTER_NO_PATH;
}

int router_knows(const char *list, const char *name)
{
    size_t n = strlen(name);
    for (const char *at = list; *at; at += strcspn(at, " ")) {
        at += strspn(at, " ");
        if (n && strcspn(at, " ") == n && !strncmp(at, name, n))
            return 1;
    }
    return 0;
}
