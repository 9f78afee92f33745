// The files that a glTF file names: within its folder, or refused.

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clients/cli/files.h"

// RFC 3986: a letter, then letters, digits, + - . up to a colon. "C:/x" is one too, as it should.
static bool has_scheme(const char *uri)
{
    if (!isalpha((unsigned char)uri[0])) return false;
    const char *end = uri + 1;
    while (isalnum((unsigned char)*end) || (*end && strchr("+-.", *end))) end++;
    return *end == ':';
}

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    c = (char)(c | 0x20);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

// A percent sign that no two digits follow stands for itself: exporters write such names. False if
// the uri holds a zero byte.
static bool percent_decode(const char *uri, char *out)
{
    while (*uri) {
        int high = *uri == '%' ? hex_digit(uri[1]) : -1;
        int low = high >= 0 ? hex_digit(uri[2]) : -1;
        if (low < 0) {
            *out++ = *uri++;
            continue;
        }
        if (high == 0 && low == 0) return false;
        *out++ = (char)(high << 4 | low);
        uri += 3;
    }
    *out = 0;
    return true;
}

static bool is_inside(const char *folder, const char *path)
{
    size_t length = strlen(folder);
    if (strcmp(folder, "/") == 0) return path[0] == '/' && path[1];
    return strncmp(folder, path, length) == 0 && path[length] == '/';
}

static enum bd_err refuse(struct bd_err_detail *detail, const char *uri, const char *why)
{
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "uri", "%.200s: %s", uri, why);
}

// `decoded` is relative. Resolves links as well, and asks afterwards where that led.
static enum bd_err resolve_decoded(const char *folder, const char *uri, const char *decoded,
                                   char **path, struct bd_err_detail *detail)
{
    size_t size = strlen(folder) + strlen(decoded) + 2;
    char *joined = malloc(size);
    if (!joined) return bd_err_set(detail, BD_ERR_NO_MEMORY, "uri", "no memory for a path");
    snprintf(joined, size, "%s/%s", folder, decoded);
    char *real = realpath(joined, NULL);
    int error = errno;
    free(joined);
    if (!real) {
        if (error == ENOENT || error == ENOTDIR) return BD_ERR_OK; // nothing there
        return refuse(detail, uri, strerror(error));
    }
    if (!is_inside(folder, real)) {
        free(real);
        return refuse(detail, uri, "leads out of the scene's folder");
    }
    *path = real;
    return BD_ERR_OK;
}

// Whether "a/../../b" climbs above its start at any point, without asking the disk: a missing
// file outside must be refused like one that is there, or the answer tells what exists.
static bool climbs_out(const char *relative)
{
    int depth = 0;
    while (*relative) {
        size_t length = strcspn(relative, "/");
        if (length == 2 && memcmp(relative, "..", 2) == 0)
            depth--;
        else if (length > 0 && !(length == 1 && relative[0] == '.'))
            depth++;
        if (depth < 0) return true;
        relative += length;
        relative += strspn(relative, "/");
    }
    return false;
}

enum bd_err bd_cli_resolve_uri(const char *folder, const char *uri, char **path, bool *is_data,
                               struct bd_err_detail *detail)
{
    *path = NULL;
    *is_data = strncasecmp(uri, "data:", 5) == 0;
    if (*is_data) return BD_ERR_OK;
    if (!uri[0]) return refuse(detail, uri, "empty uri");
    if (has_scheme(uri)) return refuse(detail, uri, "only files beside the scene are read");
    char *decoded = malloc(strlen(uri) + 1);
    if (!decoded) return bd_err_set(detail, BD_ERR_NO_MEMORY, "uri", "no memory for a path");
    enum bd_err err;
    if (!percent_decode(uri, decoded))
        err = refuse(detail, uri, "a zero byte in a uri");
    else if (decoded[0] == '/')
        err = refuse(detail, uri, "absolute paths are refused");
    else if (climbs_out(decoded))
        err = refuse(detail, uri, "leads out of the scene's folder");
    else
        err = resolve_decoded(folder, uri, decoded, path, detail);
    free(decoded);
    return err;
}

int bd_cli_open_regular(const char *path, uint64_t *size_bytes, struct bd_err_detail *detail)
{
    // O_NONBLOCK: opening a FIFO must not wait for a writer. It changes nothing for files.
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) {
        bd_err_set(detail, BD_ERR_IO, path, "%.200s: %s", path, strerror(errno));
        return -1;
    }
    struct stat info;
    if (fstat(fd, &info) == 0 && S_ISREG(info.st_mode)) {
        *size_bytes = (uint64_t)info.st_size;
        return fd;
    }
    close(fd);
    bd_err_set(detail, BD_ERR_BAD_INPUT, path, "%.200s: not a regular file", path);
    return -1;
}
