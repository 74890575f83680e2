#include "server/listen.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static groom_status split(const char *address, char *host, size_t capacity, const char **port,
                          struct groom_diag *diag)
{
    const char *colon = strrchr(address, ':');
    if (!colon || !colon[1] || colon[1 + strspn(colon + 1, "0123456789")])
        return groom_fail(diag, GROOM_EINVAL,
                          "--listen %.100s: expected HOST:PORT, such as 127.0.0.1:8080 or [::1]:8080",
                          address);
    size_t n = (size_t)(colon - address);
    if (n >= 2 && address[0] == '[' && address[n - 1] == ']') {
        address++;
        n -= 2;
    }
    if (n == 0 || n >= capacity)
        return groom_fail(diag, GROOM_EINVAL, "--listen: the host is missing; expected HOST:PORT");
    memcpy(host, address, n);
    host[n] = 0;
    *port = colon + 1;
    return GROOM_OK;
}

static int is_loopback(const struct sockaddr *address)
{
    if (address->sa_family == AF_INET)
        return ntohl(((const struct sockaddr_in *)(const void *)address)->sin_addr.s_addr) >> 24 == 127;
    return address->sa_family == AF_INET6 &&
           IN6_IS_ADDR_LOOPBACK(&((const struct sockaddr_in6 *)(const void *)address)->sin6_addr);
}

static groom_status bind_and_listen(const struct addrinfo *info, const char *address, int *out,
                                    struct groom_diag *diag)
{
    int yes = 1, fd = socket(info->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd >= 0 && !setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) &&
        !bind(fd, info->ai_addr, info->ai_addrlen) && !listen(fd, 1024)) {
        *out = fd;
        return GROOM_OK;
    }
    groom_status status =
        groom_fail(diag, GROOM_EIO, "cannot listen on %.100s: %s", address, strerror(errno));
    if (fd >= 0)
        close(fd);
    return status;
}

static void name_url(struct listening *listening)
{
    struct sockaddr_storage bound;
    socklen_t size = sizeof bound;
    char host[64] = "", port[8] = "";
    if (!getsockname(listening->fd, (struct sockaddr *)&bound, &size))
        (void)getnameinfo((struct sockaddr *)&bound, size, host, sizeof host, port, sizeof port,
                          NI_NUMERICHOST | NI_NUMERICSERV);
    snprintf(listening->url, sizeof listening->url,
             bound.ss_family == AF_INET6 ? "http://[%s]:%s" : "http://%s:%s", host, port);
}

groom_status listen_open(const char *address, bool guarded, struct listening *listening, struct groom_diag *diag)
{
    char host[256];
    const char *port = NULL;
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE}, *found = NULL;
    groom_status status = split(address, host, sizeof host, &port, diag);
    if (status != GROOM_OK)
        return status;
    int wrong = getaddrinfo(host, port, &hints, &found);
    if (wrong)
        return groom_fail(diag, GROOM_EINVAL, "--listen %.100s: %s", address, gai_strerror(wrong));
    if (!guarded && !is_loopback(found->ai_addr))
        status = groom_fail(diag, GROOM_EINVAL,
                            "--listen %.100s is an address that others can reach, and there is no token that is good: "
                            "make one with `groomd token create --name NAME --data DIR`, or listen on 127.0.0.1",
                            address);
    else
        status = bind_and_listen(found, address, &listening->fd, diag);
    freeaddrinfo(found);
    if (status == GROOM_OK)
        name_url(listening);
    return status;
}
