#include "clients/cli/transport.h"

#include <errno.h>
#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

static enum bd_err unreachable(struct bd_err_detail *detail, const char *server, const char *why)
{
    return bd_err_set(detail, BD_ERR_UNREACHABLE, "server", "cannot reach %.200s: %s", server, why);
}

static bool unix_address(const char *path, struct sockaddr_un *address)
{
    *address = (struct sockaddr_un){.sun_family = AF_UNIX};
    if (!path[0] || strlen(path) >= sizeof address->sun_path) return false;
    memcpy(address->sun_path, path, strlen(path));
    return true;
}

// The descriptor, or -1 with errno set.
static int connect_unix(const struct sockaddr_un *address)
{
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return -1;
    if (connect(fd, (const struct sockaddr *)address, sizeof *address) == 0) return fd;
    int error = errno;
    close(fd);
    errno = error;
    return -1;
}

static int connect_any(const struct addrinfo *addresses)
{
    int error = ECONNREFUSED;
    for (const struct addrinfo *a = addresses; a; a = a->ai_next) {
        int fd = socket(a->ai_family, a->ai_socktype | SOCK_CLOEXEC, a->ai_protocol);
        if (fd >= 0 && connect(fd, a->ai_addr, a->ai_addrlen) == 0) return fd;
        error = errno;
        if (fd >= 0) close(fd);
    }
    errno = error;
    return -1;
}

// Splits "HOST:PORT" or "[HOST]:PORT" in place.
static bool split_host_port(char *text, char **host, char **port)
{
    char *colon = strrchr(text, ':');
    if (!colon || colon == text || !colon[1]) return false;
    *colon = 0;
    *port = colon + 1;
    *host = text;
    size_t length = strlen(text);
    if (text[0] == '[' && text[length - 1] == ']') {
        text[length - 1] = 0;
        *host = text + 1;
    }
    return true;
}

static enum bd_err connect_tcp(const char *server, int *fd, struct bd_err_detail *detail)
{
    char text[256], *host = NULL, *port = NULL;
    snprintf(text, sizeof text, "%s", server + strlen("tcp:"));
    if (!split_host_port(text, &host, &port))
        return bd_err_set(detail, BD_ERR_USAGE, "server", "--server %.200s: tcp:HOST:PORT", server);
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM}, *addresses = NULL;
    int rv = getaddrinfo(host, port, &hints, &addresses);
    if (rv) return unreachable(detail, server, gai_strerror(rv));
    *fd = connect_any(addresses);
    int error = errno;
    freeaddrinfo(addresses);
    return *fd < 0 ? unreachable(detail, server, strerror(error)) : BD_ERR_OK;
}

enum bd_err bd_transport_connect(const char *server, int *fd, struct bd_err_detail *detail)
{
    if (strncmp(server, "tcp:", 4) == 0) return connect_tcp(server, fd, detail);
    if (strncmp(server, "http:", 5) == 0 || strncmp(server, "https:", 6) == 0)
        return bd_err_set(detail, BD_ERR_USAGE, "server",
                          "--server %.100s: bounce speaks the framed stream, not HTTP; give the "
                          "daemon --listen tcp:HOST:PORT and name that, or unix:PATH",
                          server);
    if (strncmp(server, "unix:", 5) != 0)
        return bd_err_set(detail, BD_ERR_USAGE, "server",
                          "--server %.100s: unix:PATH or tcp:HOST:PORT", server);
    struct sockaddr_un address;
    if (!unix_address(server + 5, &address))
        return bd_err_set(detail, BD_ERR_USAGE, "server",
                          "--server %.100s: a socket's path has 1 to %zu bytes", server,
                          sizeof address.sun_path - 1);
    *fd = connect_unix(&address);
    return *fd < 0 ? unreachable(detail, server, strerror(errno)) : BD_ERR_OK;
}

bool bd_transport_default_path(char *path, size_t size)
{
    const char *folder = getenv("XDG_RUNTIME_DIR");
    if (!folder || folder[0] != '/') return false;
    int length = snprintf(path, size, "%s/bounced.sock", folder);
    return length > 0 && (size_t)length < size;
}

bool bd_transport_connect_default(int *fd)
{
    char path[sizeof((struct sockaddr_un *)0)->sun_path];
    struct sockaddr_un address;
    if (!bd_transport_default_path(path, sizeof path) || !unix_address(path, &address))
        return false;
    *fd = connect_unix(&address);
    return *fd >= 0;
}
