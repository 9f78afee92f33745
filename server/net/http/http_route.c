#include "net/http/http_route.h"

#include <stdio.h>
#include <string.h>

#include "net/http/http_commands.h"
#include "net/http/viewer.h"

// Copies what is before `stop` and moves behind it. False if it does not fit or is empty.
static bool take_segment(const char **at, const char *stops, char *out, size_t size)
{
    size_t length = strcspn(*at, stops);
    if (length == 0 || length >= size) return false;
    memcpy(out, *at, length);
    out[length] = 0;
    *at += length;
    return true;
}

static bool take(const char **at, const char *text)
{
    size_t length = strlen(text);
    if (strncmp(*at, text, length) != 0) return false;
    *at += length;
    return true;
}

static enum bd_http_route find_under_scenes(const char *at, struct bd_http_target *out)
{
    if (!take(&at, "/") || !take_segment(&at, "/", out->id, sizeof out->id))
        return BD_HTTP_ROUTE_NONE;
    if (strcmp(at, "/stream.mjpeg") == 0) return BD_HTTP_ROUTE_MJPEG;
    if (strcmp(at, "/events") == 0) return BD_HTTP_ROUTE_EVENTS;
    if (!take(&at, "/frame.") || !take_segment(&at, "", out->extension, sizeof out->extension))
        return BD_HTTP_ROUTE_NONE;
    static const char *const extensions[] = {"png", "jpg", "jpeg", "exr", "json"};
    for (size_t i = 0; i < sizeof extensions / sizeof extensions[0]; i++)
        if (strcmp(out->extension, extensions[i]) == 0) return BD_HTTP_ROUTE_FRAME;
    return BD_HTTP_ROUTE_NONE;
}

static enum bd_http_route find_path(const char *path, struct bd_http_target *out)
{
    static const struct {
        const char *path;
        enum bd_http_route route;
    } fixed[] = {
        {"/healthz", BD_HTTP_ROUTE_HEALTH},     {"/readyz", BD_HTTP_ROUTE_READY},
        {"/metrics", BD_HTTP_ROUTE_METRICS},    {"/v1/render", BD_HTTP_ROUTE_RENDER},
        {"/v1/session", BD_HTTP_ROUTE_SESSION}, {"/v1/socket", BD_HTTP_ROUTE_SOCKET},
        {"/v1/events", BD_HTTP_ROUTE_EVENTS},
    };
    for (size_t i = 0; i < sizeof fixed / sizeof fixed[0]; i++)
        if (strcmp(path, fixed[i].path) == 0) return fixed[i].route;
    out->command = bd_http_command_find(path, out->id, sizeof out->id);
    if (out->command) return BD_HTTP_ROUTE_COMMAND;
    out->file = bd_viewer_find(path);
    if (out->file) return BD_HTTP_ROUTE_VIEWER;
    if (take(&path, "/v1/blobs/sha256:"))
        return take_segment(&path, "/", out->id, sizeof out->id) && *path == 0 ? BD_HTTP_ROUTE_BLOB
                                                                               : BD_HTTP_ROUTE_NONE;
    if (take(&path, "/v1/scenes")) return find_under_scenes(path, out);
    return BD_HTTP_ROUTE_NONE;
}

void bd_http_route_find(const char *url, struct bd_http_target *out)
{
    *out = (struct bd_http_target){.query = ""};
    char path[256];
    size_t length = strcspn(url, "?");
    if (url[length]) out->query = url + length + 1;
    if (length >= sizeof path) return;
    memcpy(path, url, length);
    path[length] = 0;
    out->route = find_path(path, out);
}

static unsigned methods_of_command(const struct bd_command_row *first)
{
    unsigned methods = 0;
    for (int method = BD_HTTP_GET; method <= BD_HTTP_DELETE; method++)
        if (bd_http_command_by(first, (enum bd_http_method)method)) methods |= 1u << method;
    return methods;
}

static unsigned methods_of(const struct bd_http_target *target)
{
    switch (target->route) {
    case BD_HTTP_ROUTE_COMMAND:
        return methods_of_command(target->command);
    case BD_HTTP_ROUTE_NONE:
        return 0;
    case BD_HTTP_ROUTE_HEALTH:
    case BD_HTTP_ROUTE_READY:
    case BD_HTTP_ROUTE_METRICS:
    case BD_HTTP_ROUTE_FRAME:
    case BD_HTTP_ROUTE_SOCKET:
    case BD_HTTP_ROUTE_MJPEG:
    case BD_HTTP_ROUTE_EVENTS:
        return 1u << BD_HTTP_GET;
    case BD_HTTP_ROUTE_SESSION:
        return 1u << BD_HTTP_POST | 1u << BD_HTTP_DELETE;
    case BD_HTTP_ROUTE_VIEWER:
        return 1u << BD_HTTP_GET | 1u << BD_HTTP_HEAD;
    case BD_HTTP_ROUTE_BLOB:
        return 1u << BD_HTTP_HEAD | 1u << BD_HTTP_PUT;
    case BD_HTTP_ROUTE_RENDER:
        return 1u << BD_HTTP_POST;
    }
    return 0;
}

// The viewer's files come whatever stands behind their name: that is for the page to read.
static bool takes_query(const struct bd_http_target *target, int method)
{
    switch (target->route) {
    case BD_HTTP_ROUTE_FRAME:
    case BD_HTTP_ROUTE_RENDER:
    case BD_HTTP_ROUTE_MJPEG:
    case BD_HTTP_ROUTE_VIEWER:
        return true;
    case BD_HTTP_ROUTE_COMMAND:
        return method == BD_HTTP_GET;
    default:
        return false;
    }
}

enum bd_err bd_http_route_check(const struct bd_http_target *target, int method,
                                struct bd_http_refusal *refusal)
{
    *refusal = (struct bd_http_refusal){0};
    if (target->route == BD_HTTP_ROUTE_NONE)
        return bd_fault_set(&refusal->fault, BD_ERR_NOT_FOUND, "path", "there is nothing here");
    if (method < 0 || !(methods_of(target) & 1u << method)) {
        refusal->status = 405;
        return bd_fault_set(&refusal->fault, BD_ERR_USAGE, "method", "not by this method");
    }
    if (!target->query[0] || takes_query(target, method)) return BD_ERR_OK;
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(target->query, "=&"), target->query);
    return bd_fault_set(&refusal->fault, BD_ERR_USAGE, name,
                        "there is no option \"%s\": this request takes none", name);
}
