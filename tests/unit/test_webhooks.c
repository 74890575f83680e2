/* Webhooks: signatures that others verify, addresses that no message goes to. */
#include <arpa/inet.h>
#include <netinet/in.h>
#include <string.h>

#include "server/webhooks/webhooks.h"
#include "tests/support/test.h"

static struct groom_diag diag;

static bool allowed(const char *text, const char *allow)
{
    struct sockaddr_in four = {.sin_family = AF_INET};
    struct sockaddr_in6 six = {.sin6_family = AF_INET6};
    struct sockaddr address;
    if (inet_pton(AF_INET, text, &four.sin_addr) == 1) {
        memcpy(&address, &four, sizeof address);
        return webhook_address_allowed(&address, allow);
    }
    ck_assert_int_eq(inet_pton(AF_INET6, text, &six.sin6_addr), 1);
    return webhook_address_allowed((const struct sockaddr *)&six, allow);
}

START_TEST(private_addresses_are_refused_in_every_spelling)
{
    static const char *const refused[] = {
        "127.0.0.1", "127.255.0.9", "10.1.2.3", "172.16.0.1", "172.31.255.255", "192.168.1.1", "169.254.169.254",
        "0.0.0.0", "100.64.0.1", "198.18.0.1", "224.0.0.1", "255.255.255.255", "::1", "::", "fe80::1", "fc00::1",
        "fd12:3456::1", "ff02::1", "::ffff:127.0.0.1", "::ffff:10.0.0.1", "64:ff9b::7f00:1", "2002:7f00:1::",
        "::127.0.0.1", "2001:db8::1"};
    static const char *const public[] = {"8.8.8.8", "172.32.0.1", "100.128.0.1", "193.168.1.1", "2606:4700::1111",
                                         "::ffff:8.8.8.8", "11.0.0.1", "169.253.0.1"};
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++)
        ck_assert_msg(!allowed(refused[i], ""), "%s is allowed", refused[i]);
    for (size_t i = 0; i < sizeof public / sizeof public[0]; i++)
        ck_assert_msg(allowed(public[i], ""), "%s is refused", public[i]);
    ck_assert(allowed("127.0.0.1", "127.0.0.1"));
    ck_assert(!allowed("127.0.0.2", "127.0.0.1"));
    ck_assert(allowed("10.9.8.7", "192.168.0.0/16 10.0.0.0/8"));
    ck_assert(allowed("::ffff:10.9.8.7", "10.0.0.0/8"));
    ck_assert(!allowed("172.16.0.1", "192.168.0.0/16 10.0.0.0/8"));
    ck_assert(allowed("fd00::5", "fd00::/16"));
    ck_assert(!allowed("fd01::5", "fd00::/16"));
}
END_TEST

START_TEST(urls_and_lists_are_checked)
{
    static const char *const bad[] = {"", "example.com", "ftp://example.com/x", "https://", "https://a:b@example.com/",
                                      "http://127.0.0.1/", "http://[::1]:8080/", "http://2130706433/", "http://0x7f.1/",
                                      "file:///etc/passwd", "https://10.0.0.1:443/hook", "http://[::ffff:10.0.0.1]/"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        ck_assert_msg(webhook_url_check(bad[i], "", &diag) == GROOM_EINVAL, "%s is taken", bad[i]);
    ck_ok(webhook_url_check("https://example.com/hook?x=1", "", &diag));
    ck_ok(webhook_url_check("http://127.0.0.1:99/", "127.0.0.1", &diag));
    ck_ok(webhook_allow_check("", &diag));
    ck_ok(webhook_allow_check("127.0.0.1, 10.0.0.0/8 fd00::/8", &diag));
    ck_status(webhook_allow_check("localhost", &diag), GROOM_EINVAL);
    ck_status(webhook_allow_check("10.0.0.0/33", &diag), GROOM_EINVAL);
    ck_status(webhook_allow_check("10.0.0.0/", &diag), GROOM_EINVAL);
}
END_TEST

/* The example of the specification's reference libraries. */
START_TEST(signatures_are_those_of_the_specification)
{
    char signature[WEBHOOK_SIGNATURE_SIZE];
    ck_ok(webhook_sign("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", "msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330,
                       "{\"test\": 2432232314}", signature));
    ck_assert_str_eq(signature, "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
    ck_ok(webhook_secret_check("sixteen-characters", &diag));
    ck_status(webhook_secret_check("short", &diag), GROOM_EINVAL);
    ck_status(webhook_secret_check("with blanks in it, so no", &diag), GROOM_EINVAL);
    ck_status(webhook_secret_check("whsec_not-base64-at-all!", &diag), GROOM_EINVAL);
}
END_TEST

TEST_SUITE("webhooks", private_addresses_are_refused_in_every_spelling, urls_and_lists_are_checked,
           signatures_are_those_of_the_specification)
