#include "scene/gltf/gltf_scan.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_container.h"
#include "scene/gltf/gltf_schema.h"

// An object or array that is open.
struct frame {
    const struct bd_gltf_property *property; // what it is the value of
    bool is_array;
    bool is_unread;        // it, or something around it
    uint32_t count;        // elements or members begun
    uint32_t seen;         // bits of an object's known properties
    size_t key, key_bytes; // of the member that is being read
    size_t start;
    uint64_t length_bytes; // an object's byteLength
    size_t choice;         // where an object's choice, such as a camera's type, begins; 0 = none
};

struct scan {
    char *text;
    size_t size, at;
    bool is_glb;
    struct frame stack[BD_GLTF_NESTING_MAX];
    uint32_t depth;
    uint64_t cost_left;
    uint64_t dataless_bytes; // of the largest buffer without data
    struct bd_gltf_text *out;
    struct bd_err_detail *detail;
    // The first error that matters only if the file holds a scene: fragments without one are
    // legal with, say, a buffer that has no uri, and are told that they hold no scene.
    struct bd_err_detail deferred;
};

static const struct bd_gltf_property unread = {.type = BD_GLTF_UNREAD};
static const struct bd_gltf_property document = {.type = BD_GLTF_OBJECT, .object = BD_GLTF_ROOT};

// The path of the value that is being read, "nodes[3].mesh".
static void write_path(const struct scan *scan, char *path, size_t size)
{
    size_t used = 0;
    path[0] = 0;
    for (uint32_t i = 0; i < scan->depth && used < size; i++) {
        const struct frame *frame = &scan->stack[i];
        int wrote;
        if (frame->is_array)
            wrote = snprintf(path + used, size - used, "[%u]", frame->count ? frame->count - 1 : 0);
        else if (frame->count > 0)
            wrote = snprintf(path + used, size - used, "%s%.*s", i ? "." : "",
                             frame->key_bytes > 60 ? 60 : (int)frame->key_bytes,
                             scan->text + frame->key);
        else
            break;
        used += (size_t)wrote;
    }
}

static enum bd_err refuse(struct scan *scan, enum bd_err err, const char *message)
{
    char path[128];
    write_path(scan, path, sizeof path);
    return bd_err_set(scan->detail, err, path, "%s", message);
}

static enum bd_err defer(struct scan *scan, const char *message)
{
    char path[128];
    if (scan->deferred.err != BD_ERR_OK) return BD_ERR_OK;
    write_path(scan, path, sizeof path);
    (void)bd_err_set(&scan->deferred, BD_ERR_BAD_INPUT, path, "%s", message);
    return BD_ERR_OK;
}

static enum bd_err syntax(struct scan *scan, const char *message)
{
    char path[128];
    write_path(scan, path, sizeof path);
    return bd_err_set(scan->detail, BD_ERR_BAD_INPUT, path, "invalid JSON at byte %zu: %s",
                      scan->at, message);
}

static char peek(struct scan *scan)
{
    while (scan->at < scan->size && strchr(" \t\r\n", scan->text[scan->at]) && scan->text[scan->at])
        scan->at++;
    return scan->at < scan->size ? scan->text[scan->at] : 0;
}

static enum bd_err spend(struct scan *scan, uint64_t cost)
{
    if (cost > scan->cost_left)
        return refuse(scan, BD_ERR_LIMIT, "more objects than a file of this size may hold");
    scan->cost_left -= cost;
    return BD_ERR_OK;
}

static bool is_hex(char c)
{
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

// One escape after the backslash at `at`; 0 if it is none, else its length with the backslash.
static size_t escape_bytes(const struct scan *scan)
{
    if (scan->at + 1 >= scan->size) return 0;
    char kind = scan->text[scan->at + 1];
    if (kind && strchr("\"\\/bfnrt", kind)) return 2;
    if (kind != 'u' || scan->size - scan->at < 6) return 0;
    for (size_t i = 2; i < 6; i++)
        if (!is_hex(scan->text[scan->at + i])) return 0;
    return 6;
}

// The content's range, without the quotes.
static enum bd_err read_string(struct scan *scan, size_t *start, size_t *bytes)
{
    *start = ++scan->at;
    for (;;) {
        if (scan->at >= scan->size) return syntax(scan, "string does not end");
        unsigned char c = (unsigned char)scan->text[scan->at];
        if (c == '"') break;
        if (c < 0x20) return syntax(scan, "control character in a string");
        size_t length = c == '\\' ? escape_bytes(scan) : 1;
        if (length == 0) return syntax(scan, "unknown escape");
        scan->at += length;
    }
    *bytes = scan->at++ - *start;
    return BD_ERR_OK;
}

static bool skip_digits(struct scan *scan)
{
    size_t start = scan->at;
    while (scan->at < scan->size && scan->text[scan->at] >= '0' && scan->text[scan->at] <= '9')
        scan->at++;
    return scan->at > start;
}

static bool skip_char(struct scan *scan, const char *any_of)
{
    if (scan->at >= scan->size || !scan->text[scan->at] || !strchr(any_of, scan->text[scan->at]))
        return false;
    scan->at++;
    return true;
}

static bool skip_number(struct scan *scan)
{
    skip_char(scan, "-");
    if (!skip_char(scan, "0") && !skip_digits(scan)) return false;
    if (skip_char(scan, ".") && !skip_digits(scan)) return false;
    if (skip_char(scan, "eE")) {
        skip_char(scan, "+-");
        if (!skip_digits(scan)) return false;
    }
    return true;
}

// Long literals are cut: 60 digits say more than a double holds, but the exponent must survive.
static bool number_value(const struct scan *scan, size_t start, double *value)
{
    char literal[400];
    size_t bytes = scan->at - start;
    if (bytes >= sizeof literal) return false;
    memcpy(literal, scan->text + start, bytes);
    literal[bytes] = 0;
    *value = strtod(literal, NULL);
    return isfinite(*value);
}

// tinygltf takes 3.0 for no integer at all and would leave the property out without a word, so it
// is rewritten as 3, in place.
static enum bd_err check_integer(struct scan *scan, enum bd_gltf_type type, size_t start,
                                 double value)
{
    double least = type == BD_GLTF_LENGTH ? 1 : type == BD_GLTF_STRIDE ? 4 : 0;
    double most = type == BD_GLTF_INDEX    ? 2147483647
                  : type == BD_GLTF_STRIDE ? 252
                                           : 9007199254740992;
    char literal[32];
    size_t bytes = scan->at - start;
    if (value != floor(value)) return refuse(scan, BD_ERR_BAD_INPUT, "not an integer");
    if (!(value >= least && value <= most) || (type == BD_GLTF_STRIDE && fmod(value, 4) != 0))
        return refuse(scan, BD_ERR_BAD_INPUT, "integer out of range");
    if (type == BD_GLTF_LENGTH) scan->stack[scan->depth - 1].length_bytes = (uint64_t)value;
    size_t wrote = (size_t)snprintf(literal, sizeof literal, "%.0f", fabs(value));
    if (wrote > bytes) return refuse(scan, BD_ERR_BAD_INPUT, "integer written with an exponent");
    memset(scan->text + start, ' ', bytes);
    memcpy(scan->text + start, literal, wrote);
    return BD_ERR_OK;
}

static enum bd_err read_number(struct scan *scan, const struct bd_gltf_property *property)
{
    size_t start = scan->at;
    double value;
    if (!skip_number(scan)) return syntax(scan, "malformed number");
    if (property->type == BD_GLTF_UNREAD) return BD_ERR_OK;
    if (!number_value(scan, start, &value))
        return refuse(scan, BD_ERR_BAD_INPUT, "number out of range");
    switch (property->type) {
    case BD_GLTF_NUMBER:
        return BD_ERR_OK;
    case BD_GLTF_UINT:
    case BD_GLTF_LENGTH:
    case BD_GLTF_STRIDE:
    case BD_GLTF_INDEX:
        return check_integer(scan, property->type, start, value);
    case BD_GLTF_UNREAD:
    case BD_GLTF_BOOL:
    case BD_GLTF_STRING:
    case BD_GLTF_CHOICE:
    case BD_GLTF_VERSION:
    case BD_GLTF_MIN_VERSION:
    case BD_GLTF_EXTENSION_NAME:
    case BD_GLTF_OBJECT:
        break;
    }
    return refuse(scan, BD_ERR_BAD_INPUT, "a number stands here, which has the wrong type");
}

static bool is_choice(const char *choices, const char *text, size_t bytes)
{
    for (const char *choice = choices; choice;) {
        const char *end = strchr(choice, '|');
        size_t length = end ? (size_t)(end - choice) : strlen(choice);
        if (length == bytes && memcmp(choice, text, bytes) == 0) return true;
        choice = end ? end + 1 : NULL;
    }
    return false;
}

static enum bd_err check_version(struct scan *scan, const char *text, size_t bytes, bool is_minimum)
{
    size_t digits = 2;
    while (digits < bytes && text[digits] >= '0' && text[digits] <= '9') digits++;
    bool well_formed =
        bytes > 2 && text[0] >= '0' && text[0] <= '9' && text[1] == '.' && digits == bytes;
    if (!well_formed) return refuse(scan, BD_ERR_BAD_INPUT, "not a version");
    if (text[0] != '2') return refuse(scan, BD_ERR_UNSUPPORTED, "not version 2 of glTF");
    bool is_later = bytes > 3 || text[2] != '0';
    if (is_minimum && is_later)
        snprintf(scan->out->min_version, sizeof scan->out->min_version, "%.*s", (int)bytes, text);
    return BD_ERR_OK;
}

static enum bd_err check_extension(struct scan *scan, const char *text, size_t bytes)
{
    char name[64], message[128];
    snprintf(name, sizeof name, "%.*s", bytes > 63 ? 63 : (int)bytes, text);
    if (bytes < sizeof name && bd_gltf_extension_is_supported(name)) return BD_ERR_OK;
    snprintf(message, sizeof message, "extension %s is required and not supported", name);
    return refuse(scan, BD_ERR_UNSUPPORTED, message);
}

static enum bd_err check_string(struct scan *scan, const struct bd_gltf_property *property,
                                size_t start, size_t bytes)
{
    const char *text = scan->text + start;
    switch (property->type) {
    case BD_GLTF_UNREAD:
    case BD_GLTF_STRING:
        return BD_ERR_OK;
    case BD_GLTF_CHOICE:
        if (is_choice(property->choices, text, bytes)) {
            scan->stack[scan->depth - 1].choice = start;
            return BD_ERR_OK;
        }
        char message[128];
        snprintf(message, sizeof message, "not one of %s", property->choices);
        return defer(scan, message);
    case BD_GLTF_VERSION:
        return check_version(scan, text, bytes, false);
    case BD_GLTF_MIN_VERSION:
        return check_version(scan, text, bytes, true);
    case BD_GLTF_EXTENSION_NAME:
        return check_extension(scan, text, bytes);
    case BD_GLTF_BOOL:
    case BD_GLTF_UINT:
    case BD_GLTF_LENGTH:
    case BD_GLTF_STRIDE:
    case BD_GLTF_INDEX:
    case BD_GLTF_NUMBER:
    case BD_GLTF_OBJECT:
        break;
    }
    return refuse(scan, BD_ERR_BAD_INPUT, "a string stands here, which has the wrong type");
}

static enum bd_err read_literal(struct scan *scan, const struct bd_gltf_property *property)
{
    static const char *const words[] = {"true", "false", "null"};
    for (size_t i = 0; i < 3; i++) {
        size_t length = strlen(words[i]);
        if (scan->size - scan->at < length || memcmp(scan->text + scan->at, words[i], length) != 0)
            continue;
        scan->at += length;
        if (property->type == BD_GLTF_UNREAD || (property->type == BD_GLTF_BOOL && i < 2))
            return BD_ERR_OK;
        return refuse(scan, BD_ERR_BAD_INPUT, "true, false or null stands here: wrong type");
    }
    return syntax(scan, "a value was expected");
}

static bool is_inside_unread(const struct scan *scan)
{
    return scan->depth > 0 && scan->stack[scan->depth - 1].is_unread;
}

// A value that nobody reads becomes a 0 and spaces. What it holds went with it, so this is done
// once, for the outermost.
static void take_out(struct scan *scan, const struct bd_gltf_property *property, size_t start)
{
    if (property->type != BD_GLTF_UNREAD || is_inside_unread(scan)) return;
    memset(scan->text + start, ' ', scan->at - start);
    scan->text[start] = '0';
}

static enum bd_err open(struct scan *scan, const struct bd_gltf_property *property, bool is_array)
{
    if (scan->depth == BD_GLTF_NESTING_MAX)
        return bd_err_set(scan->detail, BD_ERR_LIMIT, "", "JSON nested deeper than %d",
                          BD_GLTF_NESTING_MAX);
    if (!is_array && property->type == BD_GLTF_OBJECT) {
        enum bd_err err = spend(scan, bd_gltf_rule(property->object)->cost_bytes);
        if (err != BD_ERR_OK) return err;
    }
    bool is_unread = is_inside_unread(scan) || property->type == BD_GLTF_UNREAD;
    scan->stack[scan->depth++] = (struct frame){
        .property = property, .is_array = is_array, .is_unread = is_unread, .start = scan->at++};
    return BD_ERR_OK;
}

// Reads a scalar, or opens an object or array. `is_element`: the property's array is open already.
static enum bd_err begin_value(struct scan *scan, const struct bd_gltf_property *property,
                               bool is_element)
{
    const uint64_t value_bytes = 48; // a JSON value, its place in a container, our double
    char c = peek(scan);
    bool wants_array = property->is_array && !is_element;
    bool any = property->type == BD_GLTF_UNREAD;
    size_t start = scan->at, text, bytes;
    enum bd_err err = any ? BD_ERR_OK : spend(scan, value_bytes);
    if (err != BD_ERR_OK) return err;
    if (c == '{' && (any || (!wants_array && property->type == BD_GLTF_OBJECT)))
        return open(scan, property, false);
    if (c == '[' && (any || wants_array)) return open(scan, property, true);
    if (c == '{') return refuse(scan, BD_ERR_BAD_INPUT, "an object stands here: wrong type");
    if (c == '[') return refuse(scan, BD_ERR_BAD_INPUT, "an array stands here: wrong type");
    if (wants_array) return refuse(scan, BD_ERR_BAD_INPUT, "not an array");
    if (c == '"') {
        err = read_string(scan, &text, &bytes);
        if (err == BD_ERR_OK) err = check_string(scan, property, text, bytes);
    } else if (c == '-' || (c >= '0' && c <= '9')) {
        err = read_number(scan, property);
    } else {
        err = read_literal(scan, property);
    }
    if (err == BD_ERR_OK) take_out(scan, property, start);
    return err;
}

static bool has(const struct frame *frame, const char *key)
{
    const struct bd_gltf_object_rule *rule = bd_gltf_rule(frame->property->object);
    const struct bd_gltf_property *found =
        bd_gltf_find_property(frame->property->object, key, strlen(key));
    return frame->seen & (1u << (found - rule->properties));
}

// Names the member that the innermost object lacks.
static struct bd_err_detail missing(struct scan *scan, const char *key)
{
    struct frame *frame = &scan->stack[scan->depth - 1];
    struct bd_err_detail detail;
    char path[128], full[192];
    uint32_t count = frame->count;
    frame->count = 0; // the path of the object itself
    write_path(scan, path, sizeof path);
    frame->count = count;
    snprintf(full, sizeof full, "%s%s%s", path, path[0] ? "." : "", key);
    (void)bd_err_set(&detail, BD_ERR_BAD_INPUT, full, "is missing");
    return detail;
}

static void defer_missing(struct scan *scan, const char *key)
{
    if (scan->deferred.err == BD_ERR_OK) scan->deferred = missing(scan, key);
}

static enum bd_err refuse_missing(struct scan *scan, const char *key)
{
    *scan->detail = missing(scan, key);
    return scan->detail->err;
}

// The first buffer of a .glb is its BIN chunk. Elsewhere a buffer without uri is legal and means
// that some extension has the bytes: zeros stand for them, as many as the file's size justifies.
static void note_dataless(struct scan *scan, const struct frame *frame)
{
    bool is_first = scan->stack[scan->depth - 2].count == 1;
    if (scan->is_glb && is_first) return;
    if (scan->is_glb || frame->length_bytes > 65536 + 16 * (uint64_t)scan->size) {
        defer_missing(scan, "uri");
        return;
    }
    scan->out->dataless_buffer_count++;
    if (frame->length_bytes > scan->dataless_bytes) scan->dataless_bytes = frame->length_bytes;
}

// What an object needs beyond single properties.
static enum bd_err check_together(struct scan *scan, const struct frame *frame)
{
    char first = frame->choice ? scan->text[frame->choice] : 0;
    switch (frame->property->object) {
    case BD_GLTF_BUFFER:
        if (!has(frame, "uri")) note_dataless(scan, frame);
        return BD_ERR_OK;
    case BD_GLTF_IMAGE:
        if (!has(frame, "uri") && !has(frame, "bufferView")) return refuse_missing(scan, "uri");
        if (has(frame, "uri") && has(frame, "bufferView"))
            return refuse(scan, BD_ERR_BAD_INPUT, "both uri and bufferView");
        return BD_ERR_OK;
    case BD_GLTF_CAMERA:
        if (first == 'p' && !has(frame, "perspective")) return refuse_missing(scan, "perspective");
        if (first == 'o' && !has(frame, "orthographic"))
            return refuse_missing(scan, "orthographic");
        return BD_ERR_OK;
    case BD_GLTF_LIGHT:
        if (first == 's' && !has(frame, "spot")) return refuse_missing(scan, "spot");
        return BD_ERR_OK;
    default:
        return BD_ERR_OK;
    }
}

static enum bd_err close_object(struct scan *scan, const struct frame *frame)
{
    if (frame->is_unread) return BD_ERR_OK;
    if (frame->property->object == BD_GLTF_ROOT)
        scan->out->has_scene = has(frame, "scenes") || has(frame, "nodes");
    const struct bd_gltf_object_rule *rule = bd_gltf_rule(frame->property->object);
    for (uint32_t i = 0; i < rule->property_count; i++)
        if (rule->properties[i].required && !(frame->seen & (1u << i)))
            return refuse_missing(scan, rule->properties[i].key);
    return check_together(scan, frame);
}

static enum bd_err close_array(struct scan *scan, const struct frame *frame)
{
    uint32_t wanted = frame->is_unread ? 0 : frame->property->length;
    if (wanted == 0 || frame->count == wanted) return BD_ERR_OK;
    char message[64];
    snprintf(message, sizeof message, "%u numbers, not %u", frame->count, wanted);
    scan->depth--; // the path of the array, not of its last element
    enum bd_err err = refuse(scan, BD_ERR_BAD_INPUT, message);
    scan->depth++;
    return err;
}

static enum bd_err close(struct scan *scan)
{
    struct frame *frame = &scan->stack[scan->depth - 1];
    enum bd_err err = frame->is_array ? close_array(scan, frame) : close_object(scan, frame);
    if (err != BD_ERR_OK) return err;
    scan->at++;
    scan->depth--;
    take_out(scan, frame->property, frame->start);
    return BD_ERR_OK;
}

static enum bd_err note_seen(struct scan *scan, struct frame *frame,
                             const struct bd_gltf_property *property)
{
    const struct bd_gltf_object_rule *rule = bd_gltf_rule(frame->property->object);
    if (rule->any_key) return BD_ERR_OK;
    uint32_t bit = 1u << (property - rule->properties);
    if (frame->seen & bit) return refuse(scan, BD_ERR_BAD_INPUT, "stands twice");
    frame->seen |= bit;
    return BD_ERR_OK;
}

static enum bd_err read_member(struct scan *scan, struct frame *frame)
{
    if (peek(scan) != '"') return syntax(scan, "a property's name was expected");
    enum bd_err err = read_string(scan, &frame->key, &frame->key_bytes);
    if (err != BD_ERR_OK) return err;
    frame->count++;
    if (peek(scan) != ':') return syntax(scan, "a colon was expected");
    scan->at++;
    if (frame->is_unread) return begin_value(scan, &unread, false);
    const struct bd_gltf_property *property =
        bd_gltf_find_property(frame->property->object, scan->text + frame->key, frame->key_bytes);
    if (!property) return begin_value(scan, &unread, false);
    err = note_seen(scan, frame, property);
    return err == BD_ERR_OK ? begin_value(scan, property, false) : err;
}

static enum bd_err read_element(struct scan *scan, struct frame *frame)
{
    frame->count++;
    return begin_value(scan, frame->is_unread ? &unread : frame->property, true);
}

// One step inside the innermost open object or array.
static enum bd_err step(struct scan *scan)
{
    struct frame *frame = &scan->stack[scan->depth - 1];
    char c = peek(scan);
    if (c == (frame->is_array ? ']' : '}')) return close(scan);
    if (frame->count > 0) {
        if (c != ',') return syntax(scan, "a comma or the end was expected");
        scan->at++;
    }
    return frame->is_array ? read_element(scan, frame) : read_member(scan, frame);
}

// Length of the UTF-8 character there; 0 if it is not valid (overlong, surrogate, cut).
static size_t utf8_bytes(const uint8_t *at, size_t left)
{
    if (at[0] < 0x80) return 1;
    size_t length = at[0] >= 0xf0 ? 4 : at[0] >= 0xe0 ? 3 : 2;
    if (at[0] < 0xc2 || at[0] > 0xf4 || length > left) return 0;
    for (size_t i = 1; i < length; i++)
        if ((at[i] & 0xc0) != 0x80) return 0;
    bool overlong = (at[0] == 0xe0 && at[1] < 0xa0) || (at[0] == 0xf0 && at[1] < 0x90);
    bool too_high = (at[0] == 0xed && at[1] > 0x9f) || (at[0] == 0xf4 && at[1] > 0x8f);
    return overlong || too_high ? 0 : length;
}

static bool begins_with_mark(const char *text, size_t size)
{
    return size >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0;
}

static enum bd_err check_utf8(const char *text, size_t size, struct bd_err_detail *detail)
{
    if (begins_with_mark(text, size))
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "", "JSON begins with a byte order mark");
    for (size_t i = 0; i < size;) {
        size_t length = utf8_bytes((const uint8_t *)text + i, size - i);
        if (length == 0)
            return bd_err_set(detail, BD_ERR_BAD_INPUT, "", "invalid UTF-8 at byte %zu of the JSON",
                              i);
        i += length;
    }
    return BD_ERR_OK;
}

static enum bd_err scan_json(struct scan *scan)
{
    enum bd_err err = begin_value(scan, &document, false);
    while (err == BD_ERR_OK && scan->depth > 0) err = step(scan);
    if (err == BD_ERR_OK && (peek(scan) || scan->at < scan->size))
        err = syntax(scan, "text after the document");
    if (err == BD_ERR_OK && scan->out->has_scene && scan->deferred.err != BD_ERR_OK) {
        *scan->detail = scan->deferred;
        err = scan->deferred.err;
    }
    return err;
}

enum bd_err bd_gltf_scan(const void *bytes, size_t size, struct bd_gltf_text *out,
                         struct bd_err_detail *detail)
{
    struct bd_gltf_json_range json;
    *out = (struct bd_gltf_text){.size = size};
    if (size == 0) return bd_err_set(detail, BD_ERR_BAD_INPUT, "", "the file is empty");
    out->bytes = malloc(size);
    if (!out->bytes) return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the file");
    memcpy(out->bytes, bytes, size);
    enum bd_err err = bd_gltf_open_container(out, &json, detail);
    if (err != BD_ERR_OK) return err;
    struct scan scan = {.text = (char *)out->bytes + json.offset,
                        .size = json.size_bytes,
                        .is_glb = out->is_glb,
                        .cost_left = (64u << 20) + 128 * (uint64_t)json.size_bytes,
                        .out = out,
                        .detail = detail};
    if (peek(&scan) != '{' && !begins_with_mark(scan.text, scan.size))
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "",
                          scan.is_glb ? "the JSON chunk holds no object"
                                      : "neither a .glb nor a JSON document");
    err = check_utf8(scan.text, scan.size, detail);
    if (err == BD_ERR_OK) err = scan_json(&scan);
    out->is_scanned = err == BD_ERR_OK;
    if (err == BD_ERR_OK && out->dataless_buffer_count > 0)
        err = bd_gltf_wrap(out, scan.dataless_bytes, detail);
    return err;
}

void bd_gltf_text_free(struct bd_gltf_text *text)
{
    free(text->bytes);
    text->bytes = NULL;
}
