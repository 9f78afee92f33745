#include "scene/gltf/gltf_write_json.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/text.h"

static void put(struct bd_gltf_json *json, const char *text, size_t size)
{
    if (json->no_memory) return;
    json->no_memory = bd_bytes_put(&json->text, json->text.size_bytes, text, size) != BD_ERR_OK;
}

static void begin(struct bd_gltf_json *json, const char *key)
{
    if (json->has_sibling) put(json, ",", 1);
    json->has_sibling = true;
    if (!key) return;
    put(json, "\"", 1);
    put(json, key, strlen(key));
    put(json, "\":", 2);
}

void bd_gltf_json_open(struct bd_gltf_json *json, const char *key, char bracket)
{
    begin(json, key);
    put(json, &bracket, 1);
    json->has_sibling = false;
}

void bd_gltf_json_close(struct bd_gltf_json *json, char bracket)
{
    put(json, bracket == '{' ? "}" : "]", 1);
    json->has_sibling = true;
}

void bd_gltf_json_bool(struct bd_gltf_json *json, const char *key, bool value)
{
    begin(json, key);
    put(json, value ? "true" : "false", value ? 4 : 5);
}

void bd_gltf_json_uint(struct bd_gltf_json *json, const char *key, uint64_t value)
{
    char text[24];
    begin(json, key);
    put(json, text, (size_t)snprintf(text, sizeof text, "%" PRIu64, value));
}

// --- text -----------------------------------------------------------------------------------

void bd_gltf_json_text(struct bd_gltf_json *json, const char *key, const char *text)
{
    const unsigned char *at = (const unsigned char *)text;
    begin(json, key);
    put(json, "\"", 1);
    while (*at) {
        char escaped[8];
        const size_t size = bd_text_character_bytes(at);
        if (size == 0)
            put(json, "\xef\xbf\xbd", 3);
        else if (*at == '"' || *at == '\\')
            put(json, escaped, (size_t)snprintf(escaped, sizeof escaped, "\\%c", *at));
        else if (*at < 0x20 || *at == 0x7f)
            put(json, escaped, (size_t)snprintf(escaped, sizeof escaped, "\\u%04x", *at));
        else
            put(json, (const char *)at, size);
        at += size ? size : 1;
    }
    put(json, "\"", 1);
}

// --- numbers --------------------------------------------------------------------------------

// Without its point, a negative zero would be read as an integer, which has no sign.
static bool put_zero(struct bd_gltf_json *json, double value)
{
    if (value != 0) return false;
    put(json, signbit(value) ? "-0.0" : "0", signbit(value) ? 4 : 1);
    return true;
}

static void put_f64(struct bd_gltf_json *json, double value)
{
    char text[32];
    BD_ASSERT(isfinite(value));
    if (put_zero(json, value)) return;
    int length = 0;
    for (int digits = 15; digits <= 17; digits++) {
        length = snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value) break;
    }
    put(json, text, (size_t)length);
}

// A reader may take the number for a double first and round that: such a way back has to end here
// too.
static void put_f32(struct bd_gltf_json *json, float value)
{
    char text[32];
    BD_ASSERT(isfinite(value));
    if (put_zero(json, (double)value)) return;
    int length = 0;
    for (int digits = 6; digits <= 9; digits++) {
        length = snprintf(text, sizeof text, "%.*g", digits, (double)value);
        if ((float)strtod(text, NULL) == value && strtof(text, NULL) == value) break;
    }
    put(json, text, (size_t)length);
}

void bd_gltf_json_f32(struct bd_gltf_json *json, const char *key, float value)
{
    begin(json, key);
    put_f32(json, value);
}

void bd_gltf_json_f64(struct bd_gltf_json *json, const char *key, double value)
{
    begin(json, key);
    put_f64(json, value);
}

void bd_gltf_json_f32s(struct bd_gltf_json *json, const char *key, const float *values, int count)
{
    bd_gltf_json_open(json, key, '[');
    for (int i = 0; i < count; i++) bd_gltf_json_f32(json, NULL, values[i]);
    bd_gltf_json_close(json, '[');
}

void bd_gltf_json_f64s(struct bd_gltf_json *json, const char *key, const double *values, int count)
{
    bd_gltf_json_open(json, key, '[');
    for (int i = 0; i < count; i++) bd_gltf_json_f64(json, NULL, values[i]);
    bd_gltf_json_close(json, '[');
}
