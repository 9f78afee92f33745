#include "net/http/http_route.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/text.h"
#include "net/http/http_commands.h"
#include "net/http/viewer.h"
#include "net/wire/answer.h"
#include "protocol/frame_options.h"

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

// --- queries -------------------------------------------------------------------------------------

#define PAIRS_MAX 256

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

bool bd_http_query_decode(char *text)
{
    char *out = text;
    for (const char *at = text; *at; at++) {
        char c = *at == '+' ? ' ' : *at;
        if (c == '%') {
            int high = hex_digit(at[1]);
            int low = high < 0 ? -1 : hex_digit(at[2]);
            if (low < 0 || (high == 0 && low == 0)) return false;
            c = (char)(high * 16 + low);
            at += 2;
        }
        *out++ = c;
    }
    *out = 0;
    return bd_text_bad_at(text, (size_t)(out - text)) == (size_t)(out - text);
}

static void replace_text(char **field, const char *value)
{
    free(*field);
    *field = bd_answer_text(value);
}

// Their range is checked where an environment is read, whoever sent it.
static bool read_radiance(const char *text, Bounced__Environment *out)
{
    double radiance[3];
    for (int c = 0; c < 3; c++) {
        char *end;
        radiance[c] = strtod(text, &end);
        if (end == text || *end != (c < 2 ? ',' : 0)) return false;
        text = end + 1;
    }
    if (!out->radiance) out->radiance = malloc(sizeof radiance);
    BD_ASSERT(out->radiance);
    memcpy(out->radiance, radiance, sizeof radiance);
    out->n_radiance = 3;
    return true;
}

// Given twice, as numbers and as a map, it is both: the numbers are then a factor.
static bool set_environment(char *value, Bounced__Render *render)
{
    if (!render->environment) {
        render->environment = malloc(sizeof *render->environment);
        BD_ASSERT(render->environment);
        bounced__environment__init(render->environment);
    }
    if (strncmp(value, "sha256:", 7) != 0) return read_radiance(value, render->environment);
    replace_text(&render->environment->map, value);
    return true;
}

static enum bd_err refuse(const char *name, const char *wanted, const char *value,
                          struct bd_fault *fault)
{
    return bd_fault_set(fault, BD_ERR_USAGE, name, "%s is %s, not \"%.60s\"", name, wanted, value);
}

// What is no picture has its report as JSON.
static const char *encoding_of(const char *name)
{
    return strcmp(name, "json") == 0 ? "none" : name;
}

// `says_encoding`: the query does, not the path.
static enum bd_err set_pair(const char *name, char *value, bool says_encoding,
                            Bounced__Render *render, struct bd_fault *fault)
{
    // The one that is beside the frame.
    if (strcmp(name, "environment") == 0) {
        if (set_environment(value, render)) return BD_ERR_OK;
        return refuse(name, "R,G,B in cd/m^2, or sha256:HEX of a map", value, fault);
    }
    const struct bd_frame_option *option = bd_frame_option_named(name, fault);
    if (!option) return BD_ERR_USAGE;
    const bool is_encoding = strcmp(option->name, "encoding") == 0;
    if (is_encoding && !says_encoding)
        return bd_fault_set(fault, BD_ERR_USAGE, name, "%s: the path says it", name);
    return bd_frame_option_set(option, is_encoding ? encoding_of(value) : value, render->frame,
                               fault);
}

static enum bd_err read_pairs(char *text, bool says_encoding, Bounced__Render *render,
                              struct bd_fault *fault)
{
    char *rest = NULL;
    int count = 0;
    for (char *pair = strtok_r(text, "&", &rest); pair; pair = strtok_r(NULL, "&", &rest)) {
        char *value = strchr(pair, '=');
        if (!value || ++count > PAIRS_MAX)
            return bd_fault_set(fault, BD_ERR_USAGE, "query", "a query is up to %d NAME=VALUE",
                                PAIRS_MAX);
        *value++ = 0;
        if (!bd_http_query_decode(pair) || !bd_http_query_decode(value))
            return bd_fault_set(fault, BD_ERR_USAGE, "query", "the query has a broken %%-escape");
        enum bd_err err = set_pair(pair, value, says_encoding, render, fault);
        if (err) return err;
    }
    return BD_ERR_OK;
}

static Bounced__Render *new_render(void)
{
    Bounced__Render *render = malloc(sizeof *render);
    BD_ASSERT(render);
    bounced__render__init(render);
    render->frame = malloc(sizeof *render->frame);
    BD_ASSERT(render->frame);
    bounced__frame_request__init(render->frame);
    return render;
}

enum bd_err bd_http_query_read(const char *query, const char *extension, Bounced__Render **out,
                               struct bd_fault *fault)
{
    Bounced__Render *render = new_render();
    char *text = bd_answer_text(query);
    if (extension[0]) replace_text(&render->frame->encoding, encoding_of(extension));
    enum bd_err err = read_pairs(text, !extension[0], render, fault);
    free(text);
    if (err)
        bounced__render__free_unpacked(render, NULL);
    else
        *out = render;
    return err;
}

// Cuts "fps=NUMBER" out of a query. False if it is no number.
static bool take_fps(char *query, double *frames_per_second)
{
    for (char *at = query; *at;) {
        size_t length = strcspn(at, "&");
        char *next = at + length + (at[length] == '&');
        if (strncmp(at, "fps=", 4) != 0) {
            at = next;
            continue;
        }
        char *end;
        *frames_per_second = strtod(at + 4, &end);
        if (end == at + 4 || end != at + length) return false;
        memmove(at, next, strlen(next) + 1);
    }
    return true;
}

enum bd_err bd_http_query_read_stream(const char *query, Bounced__Render **out,
                                      double *frames_per_second, struct bd_fault *fault)
{
    char *text = bd_answer_text(query);
    *frames_per_second = 0;
    enum bd_err err = take_fps(text, frames_per_second)
                          ? bd_http_query_read(text, "jpg", out, fault)
                          : bd_fault_set(fault, BD_ERR_USAGE, "fps", "fps is a number");
    free(text);
    return err;
}
