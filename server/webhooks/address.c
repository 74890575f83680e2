/* Where messages may go. */
#include "server/webhooks/webhooks.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <curl/curl.h>

/* An address as 16 bytes, IPv4 as ::ffff:a.b.c.d. */
struct network {
    unsigned char bytes[16];
    unsigned n_bits;
};

/* Networks that are nobody's on the open internet (IANA's special-purpose registries), and those whose
 * addresses hold an IPv4 address of any kind. */
static const char *const refused[] = {
    "0.0.0.0/8", "10.0.0.0/8", "100.64.0.0/10", "127.0.0.0/8", "169.254.0.0/16", "172.16.0.0/12", "192.0.0.0/24",
    "192.0.2.0/24", "192.88.99.0/24", "192.168.0.0/16", "198.18.0.0/15", "198.51.100.0/24", "203.0.113.0/24",
    "224.0.0.0/4", "240.0.0.0/4",
    "::/96", "64:ff9b::/96", "64:ff9b:1::/48", "100::/64", "2001::/23", "2001:db8::/32", "2002::/16", "fc00::/7",
    "fe80::/10", "fec0::/10", "ff00::/8",
};

static bool read_address(const char *text, struct network *network)
{
    static const unsigned char mapped[12] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
    network->n_bits = 128;
    if (inet_pton(AF_INET6, text, network->bytes) == 1)
        return true;
    memcpy(network->bytes, mapped, sizeof mapped);
    return inet_pton(AF_INET, text, network->bytes + 12) == 1;
}

static bool read_network(const char *text, size_t n, struct network *network)
{
    char address[64], *end;
    size_t n_address = strcspn(text, "/");
    n_address = n_address < n ? n_address : n;
    if (n_address == 0 || n_address >= sizeof address)
        return false;
    memcpy(address, text, n_address);
    address[n_address] = 0;
    if (!read_address(address, network))
        return false;
    if (n_address == n)
        return true;
    unsigned long bits = strtoul(text + n_address + 1, &end, 10), most = strchr(address, ':') ? 128 : 32;
    if (end != text + n || end == text + n_address + 1 || bits > most)
        return false;
    network->n_bits = (unsigned)bits + (128 - (unsigned)most);
    return true;
}

static bool is_in(const unsigned char address[16], const struct network *network)
{
    unsigned n_bytes = network->n_bits / 8, left = network->n_bits % 8;
    if (memcmp(address, network->bytes, n_bytes) != 0)
        return false;
    return left == 0 || ((address[n_bytes] ^ network->bytes[n_bytes]) >> (8 - left)) == 0;
}

/* returns  whether any network of the list (blanks between) has it */
static bool list_has(const char *list, const unsigned char address[16])
{
    struct network network;
    for (const char *at = list + strspn(list, " ,"); *at; at += strspn(at, " ,")) {
        size_t n = strcspn(at, " ,");
        if (read_network(at, n, &network) && is_in(address, &network))
            return true;
        at += n;
    }
    return false;
}

static bool bytes_allowed(const unsigned char address[16], const char *allow)
{
    if (allow && list_has(allow, address))
        return true;
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++)
        if (list_has(refused[i], address))
            return false;
    return true;
}

bool webhook_address_allowed(const struct sockaddr *address, const char *allow)
{
    struct network network;
    char text[INET6_ADDRSTRLEN];
    if (address->sa_family == AF_INET6) {
        struct sockaddr_in6 six;
        memcpy(&six, address, sizeof six);
        return bytes_allowed(six.sin6_addr.s6_addr, allow);
    }
    if (address->sa_family != AF_INET)
        return false;
    struct sockaddr_in four;
    memcpy(&four, address, sizeof four);
    return inet_ntop(AF_INET, &four.sin_addr, text, sizeof text) && read_address(text, &network) &&
           bytes_allowed(network.bytes, allow);
}

groom_status webhook_allow_check(const char *allow, struct groom_diag *diag)
{
    struct network network;
    for (const char *at = allow + strspn(allow, " ,"); *at; at += strspn(at, " ,")) {
        size_t n = strcspn(at, " ,");
        if (!read_network(at, n, &network))
            return groom_fail(diag, GROOM_EINVAL, "\"%.*s\" is no address and no network like 10.0.0.0/8",
                              (int)(n < 60 ? n : 60), at);
        at += n;
    }
    return GROOM_OK;
}

/* The host of a URL, without the brackets of an IPv6 address. */
static groom_status check_parts(CURLU *parts, const char *allow, struct groom_diag *diag)
{
    struct network network;
    char *scheme = NULL, *host = NULL, *user = NULL;
    groom_status status = GROOM_OK;
    if (curl_url_get(parts, CURLUPART_SCHEME, &scheme, 0) || curl_url_get(parts, CURLUPART_HOST, &host, 0) || !host[0])
        status = groom_fail(diag, GROOM_EINVAL, "a webhook is a URL like https://host/path");
    else if (strcmp(scheme, "http") && strcmp(scheme, "https"))
        status = groom_fail(diag, GROOM_EINVAL, "a webhook's URL begins with https:// or http://");
    else if (curl_url_get(parts, CURLUPART_USER, &user, 0) == CURLUE_OK)
        status = groom_fail(diag, GROOM_EINVAL, "a webhook's URL has no name and password; the signature says who calls");
    if (status == GROOM_OK) {
        size_t n = strlen(host);
        bool is_six = host[0] == '[' && host[n - 1] == ']';
        if (is_six)
            host[n - 1] = 0;
        if (read_address(host + is_six, &network) && !bytes_allowed(network.bytes, allow))
            status = groom_fail(diag, GROOM_EINVAL, "no message goes to %.60s, which is this machine's or a private "
                                                    "network's; --webhook-allow says which may be told", host + is_six);
    }
    curl_free(scheme);
    curl_free(host);
    curl_free(user);
    return status;
}

groom_status webhook_url_check(const char *url, const char *allow, struct groom_diag *diag)
{
    if (strlen(url) > 1000)
        return groom_fail(diag, GROOM_EINVAL, "a webhook's URL has at most 1000 characters");
    CURLU *parts = curl_url();
    if (!parts)
        return groom_fail(diag, GROOM_ENOMEM, "no memory for a URL");
    groom_status status = curl_url_set(parts, CURLUPART_URL, url, 0) == CURLUE_OK
                              ? check_parts(parts, allow, diag)
                              : groom_fail(diag, GROOM_EINVAL, "a webhook is a URL like https://host/path");
    curl_url_cleanup(parts);
    return status;
}
