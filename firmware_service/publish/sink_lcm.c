#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <lcm/lcm.h>

#include "publish/sink_internal.h"

#define DEFAULT_ADDRESS "239.255.76.67"
#define DEFAULT_PORT    7667

/* One "NAME=NUMBER" of those behind the '?'. LCM prints on standard error what it does not know,
 * and goes on without it. */
static enum shef_err check_option(const char *url, const char *option, size_t n_bytes,
                                  struct shef_error *err)
{
    static const struct {
        const char *name;
        long min, max;
    } options[] = { { "ttl=", 0, 255 }, { "recv_buf_size=", 1, INT32_MAX } };

    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        const size_t n_name = strlen(options[i].name);
        char *end;

        if (n_bytes <= n_name || strncmp(option, options[i].name, n_name) != 0)
            continue;

        const long number = strtol(option + n_name, &end, 10);

        if (end == option + n_bytes && number >= options[i].min && number <= options[i].max)
            return SHEF_OK;
        return shef_fail(err, SHEF_ERR_INVALID,
                         "LCM address '%s': '%.*s' must be a whole number from %ld to %ld", url,
                         (int)n_bytes, option, options[i].min, options[i].max);
    }
    return shef_fail(err, SHEF_ERR_INVALID,
                     "LCM address '%s': '%.*s' is none of the options ttl=N and recv_buf_size=N",
                     url, (int)n_bytes, option);
}

static enum shef_err check_options(const char *url, const char *rest, struct shef_error *err)
{
    const char *option = strchr(rest, '?');
    enum shef_err result = SHEF_OK;

    while (option && !result) {
        const size_t n_bytes = strcspn(++option, "&");

        result = check_option(url, option, n_bytes, err);
        option = option[n_bytes] ? option + n_bytes : NULL;
    }
    return result;
}

/* [ADDRESS:PORT] as LCM reads it. Without the port it would send to port 0. */
static enum shef_err parse(const char *url, const char *rest, struct sockaddr_in *out_address,
                           struct shef_error *err)
{
    char address[INET_ADDRSTRLEN] = DEFAULT_ADDRESS;
    const size_t network_bytes = strcspn(rest, "?");
    const size_t address_bytes = strcspn(rest, ":?");
    long port = DEFAULT_PORT;

    *out_address = (struct sockaddr_in){ .sin_family = AF_INET };
    if (address_bytes >= sizeof address)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "LCM address '%s': '%.*s' is no IPv4 address such as " DEFAULT_ADDRESS,
                         url, (int)address_bytes, rest);
    if (address_bytes > 0) {
        memcpy(address, rest, address_bytes);
        address[address_bytes] = '\0';
    }
    if (inet_pton(AF_INET, address, &out_address->sin_addr) != 1)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "LCM address '%s': '%s' is no IPv4 address such as " DEFAULT_ADDRESS, url,
                         address);
    if (!IN_MULTICAST(ntohl(out_address->sin_addr.s_addr)))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "LCM address '%s': %s is no multicast address; those are 224.0.0.0 to "
                         "239.255.255.255",
                         url, address);
    if (address_bytes > 0 && address_bytes == network_bytes)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "LCM address '%s': behind %s the port is missing, such as :7667", url,
                         address);
    if (address_bytes + 1 < network_bytes) {
        char *end = NULL;

        port = strtol(rest + address_bytes + 1, &end, 10);
        if (end != rest + network_bytes || port < 1 || port > 65535)
            return shef_fail(err, SHEF_ERR_INVALID,
                             "LCM address '%s': '%.*s' is no port from 1 to 65535", url,
                             (int)(network_bytes - address_bytes - 1), rest + address_bytes + 1);
    }
    out_address->sin_port = htons((uint16_t)port);
    return SHEF_OK;
}

static enum shef_err udpm_check(const char *url, const char *rest, struct shef_error *err)
{
    struct sockaddr_in address;
    const enum shef_err result = parse(url, rest, &address, err);

    return result ? result : check_options(url, rest, err);
}

/* Without a route lcm_create() fails with a page of advice on standard error. */
static enum shef_err check_route(const char *url, const struct sockaddr_in *to,
                                 struct shef_error *err)
{
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);

    if (fd < 0)
        return shef_fail_os(err, errno, "LCM address '%s': no socket", url);

    const int refused = connect(fd, (const struct sockaddr *)to, sizeof *to) ? errno : 0;
    char address[INET_ADDRSTRLEN];

    close(fd);
    if (refused == 0)
        return SHEF_OK;
    if (refused != ENETUNREACH && refused != EHOSTUNREACH)
        return shef_fail_os(err, refused, "LCM address '%s'", url);
    (void)inet_ntop(AF_INET, &to->sin_addr, address, sizeof address);
    return shef_fail(
        err, SHEF_ERR_IO,
        "LCM address '%s': no route to %s, so nothing can be published; connect the "
        "network, or keep messages on this computer: 'ip link set lo up' and 'ip route "
        "add %s/32 dev lo' as root",
        url, address, address);
}

static enum shef_err create_lcm(const char *url, void **out_handle, struct shef_error *err)
{
    lcm_t *lcm = lcm_create(url);

    if (!lcm)
        return shef_fail(err, SHEF_ERR_IO,
                         "LCM address '%s': LCM cannot use it, for a reason that it printed itself",
                         url);
    *out_handle = lcm;
    return SHEF_OK;
}

static enum shef_err udpm_open(const char *url, const char *rest, void **out_handle,
                               struct shef_error *err)
{
    struct sockaddr_in address;
    enum shef_err result = parse(url, rest, &address, err);

    if (!result)
        result = check_route(url, &address, err);
    if (!result)
        result = create_lcm(url, out_handle, err);
    return result;
}

static enum shef_err lcm_send(void *handle, const char *channel, const void *bytes, size_t n_bytes,
                              int64_t utime_us, int *out_errno)
{
    (void)utime_us;
    errno = 0;
    if (lcm_publish(handle, channel, bytes, (unsigned)n_bytes) == 0)
        return SHEF_OK;
    *out_errno = errno;
    return SHEF_ERR_IO;
}

static void lcm_close(void *handle)
{
    lcm_destroy(handle);
}

const struct shef_sink_ops shef_sink_udpm_ops = { "udpm", udpm_check, udpm_open, lcm_send,
                                                  lcm_close };

static enum shef_err memq_check(const char *url, const char *rest, struct shef_error *err)
{
    if (*rest)
        return shef_fail(err, SHEF_ERR_INVALID, "LCM address '%s': nothing may follow memq://",
                         url);
    return SHEF_OK;
}

static enum shef_err memq_open(const char *url, const char *rest, void **out_handle,
                               struct shef_error *err)
{
    (void)rest;
    return create_lcm(url, out_handle, err);
}

const struct shef_sink_ops shef_sink_memq_ops = { "memq", memq_check, memq_open, lcm_send,
                                                  lcm_close };
