#include "net/http/http_route.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/text.h"
#include "net/command/command.h"
#include "net/http/http_internal.h"
#include "net/http/viewer.h"
#include "net/wire/answer.h"
#include "protocol/field_text.h"
#include "protocol/frame_options.h"
#include "protocol/json.h"
#include "protocol/wire.h"

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
        return bd_err_set(&refusal->detail, BD_ERR_NOT_FOUND, "path", "there is nothing here");
    if (method < 0 || !(methods_of(target) & 1u << method)) {
        refusal->status = 405;
        return bd_err_set(&refusal->detail, BD_ERR_USAGE, "method", "not by this method");
    }
    if (!target->query[0] || takes_query(target, method)) return BD_ERR_OK;
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(target->query, "=&"), target->query);
    return bd_err_set(&refusal->detail, BD_ERR_USAGE, name,
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
                          struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_USAGE, name, "%s is %s, not \"%.60s\"", name, wanted, value);
}

// What is no picture has its report as JSON.
static const char *encoding_of(const char *name)
{
    return strcmp(name, "json") == 0 ? "none" : name;
}

// `says_encoding`: the query does, not the path.
static enum bd_err set_pair(const char *name, char *value, bool says_encoding,
                            Bounced__Render *render, struct bd_err_detail *detail)
{
    // The one that is beside the frame.
    if (strcmp(name, "environment") == 0) {
        if (set_environment(value, render)) return BD_ERR_OK;
        return refuse(name, "R,G,B in cd/m^2, or sha256:HEX of a map", value, detail);
    }
    const struct bd_frame_option *option = bd_frame_option_named(name, detail);
    if (!option) return BD_ERR_USAGE;
    const bool is_encoding = strcmp(option->name, "encoding") == 0;
    if (is_encoding && !says_encoding)
        return bd_err_set(detail, BD_ERR_USAGE, name, "%s: the path says it", name);
    return bd_frame_option_set(option, is_encoding ? encoding_of(value) : value, render->frame,
                               detail);
}

static enum bd_err read_pairs(char *text, bool says_encoding, Bounced__Render *render,
                              struct bd_err_detail *detail)
{
    char *rest = NULL;
    int count = 0;
    for (char *pair = strtok_r(text, "&", &rest); pair; pair = strtok_r(NULL, "&", &rest)) {
        char *value = strchr(pair, '=');
        if (!value || ++count > PAIRS_MAX)
            return bd_err_set(detail, BD_ERR_USAGE, "query", "a query is up to %d NAME=VALUE",
                              PAIRS_MAX);
        *value++ = 0;
        if (!bd_http_query_decode(pair) || !bd_http_query_decode(value))
            return bd_err_set(detail, BD_ERR_USAGE, "query", "the query has a broken %%-escape");
        enum bd_err err = set_pair(pair, value, says_encoding, render, detail);
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
                               struct bd_err_detail *detail)
{
    Bounced__Render *render = new_render();
    char *text = bd_answer_text(query);
    if (extension[0]) replace_text(&render->frame->encoding, encoding_of(extension));
    enum bd_err err = read_pairs(text, !extension[0], render, detail);
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
                                      double *frames_per_second, struct bd_err_detail *detail)
{
    char *text = bd_answer_text(query);
    *frames_per_second = 0;
    enum bd_err err = take_fps(text, frames_per_second)
                          ? bd_http_query_read(text, "jpg", out, detail)
                          : bd_err_set(detail, BD_ERR_USAGE, "fps", "fps is a number");
    free(text);
    return err;
}

// --- commands, by their paths ---------------------------------------------------------------

static const char *path_of(const struct bd_command_row *row)
{
    return strchr(row->http, ' ') + 1;
}

// "ID" stands for what is up to the next slash.
static bool matches(const char *pattern, const char *path, char *id, size_t id_bytes)
{
    while (*pattern) {
        if (strncmp(pattern, "ID", 2) != 0) {
            if (*pattern++ != *path++) return false;
            continue;
        }
        const size_t length = strcspn(path, "/");
        if (length == 0 || length >= id_bytes) return false;
        memcpy(id, path, length);
        id[length] = 0;
        path += length;
        pattern += 2;
    }
    return !*path;
}

const struct bd_command_row *bd_http_command_find(const char *path, char *id, size_t id_bytes)
{
    const struct bd_command_row *row;
    for (uint32_t i = 0; (row = bd_command_row_at(i)); i++)
        if (row->http && matches(path_of(row), path, id, id_bytes)) return row;
    return NULL;
}

static bool is_by(const struct bd_command_row *row, enum bd_http_method method)
{
    static const char *const words[] = {
        [BD_HTTP_GET] = "GET ", [BD_HTTP_HEAD] = "HEAD ",     [BD_HTTP_POST] = "POST ",
        [BD_HTTP_PUT] = "PUT ", [BD_HTTP_DELETE] = "DELETE ",
    };
    return strncmp(row->http, words[method], strlen(words[method])) == 0;
}

const struct bd_command_row *bd_http_command_by(const struct bd_command_row *first,
                                                enum bd_http_method method)
{
    const struct bd_command_row *row;
    for (uint32_t i = 0; (row = bd_command_row_at(i)); i++)
        if (row->http && strcmp(path_of(row), path_of(first)) == 0 && is_by(row, method))
            return row;
    return NULL;
}

// --- commands, by queries -------------------------------------------------------------------

static ProtobufCMessage *new_message(const ProtobufCMessageDescriptor *descriptor)
{
    ProtobufCMessage *message = malloc(descriptor->sizeof_message);
    BD_ASSERT(message);
    protobuf_c_message_init(descriptor, message);
    return message;
}

// A field by its name, but for the scene, which the path says.
static bool take_pair(const struct bd_command_row *row, ProtobufCMessage *message, const char *name,
                      char *value)
{
    const ProtobufCFieldDescriptor *field =
        protobuf_c_message_descriptor_get_field_by_name(message->descriptor, name);
    if (!field || !value || (row->scene && strcmp(name, row->scene) == 0)) return false;
    return bd_http_query_decode(value) && bd_field_set_text(message, field, value);
}

static enum bd_err read_query(const char *query, const struct bd_command_row *row,
                              ProtobufCMessage **out, struct bd_err_detail *detail)
{
    char *copy = bd_answer_text(query), *rest = NULL;
    enum bd_err err = BD_ERR_OK;
    *out = new_message(bd_command_message(row));
    for (char *pair = strtok_r(copy, "&", &rest); pair && !err; pair = strtok_r(NULL, "&", &rest)) {
        char *value = strchr(pair, '=');
        if (value) *value++ = 0;
        if (!take_pair(row, *out, pair, value))
            err = bd_err_set(detail, BD_ERR_USAGE, pair,
                             "\"%.40s\" is no option of this request, or its value makes no "
                             "sense",
                             pair);
    }
    free(copy);
    if (err) protobuf_c_message_free_unpacked(*out, NULL);
    return err;
}

// --- commands, by bodies --------------------------------------------------------------------

static enum bd_err check_op(size_t index, const json_t *op, struct bd_err_detail *detail)
{
    char path[32];
    if (json_is_object(op) && json_object_size(op) == 1) return BD_ERR_OK;
    snprintf(path, sizeof path, "ops[%zu]", index);
    return bd_err_set(detail, BD_ERR_USAGE, path,
                      "an operation is an object with one name: {\"set_light\": {...}}");
}

static enum bd_err check_ops(const json_t *json, struct bd_err_detail *detail)
{
    const json_t *ops = json_object_get(json, "ops");
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < json_array_size(ops); i++)
        err = check_op(i, json_array_get(ops, i), detail);
    return err;
}

static enum bd_err read_json(const struct bd_http *http, const struct bd_command_row *row,
                             ProtobufCMessage **out, struct bd_err_detail *detail)
{
    json_error_t error;
    // Where the path says what it is about, there may be nothing more to say.
    const bool is_empty = http->body_bytes == 0 && row->scene;
    json_t *json = json_loadb(is_empty ? "{}" : (const char *)http->body,
                              is_empty ? 2 : http->body_bytes, JSON_REJECT_DUPLICATES, &error);
    if (!json)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "body", "line %d of the body: %s", error.line,
                          error.text);
    const bool has_ops = row->body == BOUNCED__ENVELOPE__BODY_EDIT_BATCH;
    enum bd_err err = has_ops ? check_ops(json, detail) : BD_ERR_OK;
    if (!err) err = bd_json_to_message(json, bd_command_message(row), out, detail);
    json_decref(json);
    return err;
}

static enum bd_err read_protobuf(const struct bd_http *http, const struct bd_command_row *row,
                                 ProtobufCMessage **out, struct bd_err_detail *detail)
{
    struct bd_wire_alloc alloc;
    bd_wire_alloc_init(&alloc, bd_wire_budget(http->body_bytes));
    *out = protobuf_c_message_unpack(bd_command_message(row), &alloc.allocator, http->body_bytes,
                                     http->body);
    if (!*out)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "body", "the body is no %s",
                          bd_command_message(row)->short_name);
    enum bd_err err =
        bd_wire_check_text(bd_command_message(row), http->body, http->body_bytes, detail);
    if (err) protobuf_c_message_free_unpacked(*out, NULL);
    return err;
}

// The scene is the path's, whatever the body says.
static void set_scene(ProtobufCMessage *message, const char *name, const char *id)
{
    const ProtobufCFieldDescriptor *field =
        protobuf_c_message_descriptor_get_field_by_name(message->descriptor, name);
    const bool is_set = bd_field_set_text(message, field, id);
    BD_ASSERT(is_set);
}

enum bd_err bd_http_command_read(const struct bd_http *http, const struct bd_command_row *row,
                                 struct bd_answer *out, struct bd_err_detail *detail)
{
    const char *type = http->head.values[BD_HTTP_CONTENT_TYPE];
    ProtobufCMessage *message = NULL;
    enum bd_err err;
    if (http->method != BD_HTTP_POST)
        err = read_query(http->target.query, row, &message, detail);
    else if (bd_http_media_is(type, "application/json"))
        err = read_json(http, row, &message, detail);
    else
        err = read_protobuf(http, row, &message, detail);
    if (err) return err;
    if (row->scene) set_scene(message, row->scene, http->target.id);
    *out = bd_answer_of(row->body, message);
    return BD_ERR_OK;
}
