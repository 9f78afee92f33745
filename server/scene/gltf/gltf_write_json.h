// JSON text, piece by piece, with the shortest numbers that are read back as they were. Only
// gltf_write*.c include this.
//
// Thread: whoever owns the struct.

#ifndef BD_SCENE_GLTF_GLTF_WRITE_JSON_H
#define BD_SCENE_GLTF_GLTF_WRITE_JSON_H

#include <stdbool.h>
#include <stdint.h>

#include "image/bytes.h"

struct bd_gltf_json {
    struct bd_bytes text;
    bool has_sibling; // a comma comes before what comes next
    bool no_memory;   // sticky: what is written afterwards is lost
};

// `key` is NULL for elements of an array and for the outermost object. Keys are ours and are
// written as they are. `bracket` is '{' or '['.
void bd_gltf_json_open(struct bd_gltf_json *json, const char *key, char bracket);
void bd_gltf_json_close(struct bd_gltf_json *json, char bracket);

void bd_gltf_json_bool(struct bd_gltf_json *json, const char *key, bool value);
void bd_gltf_json_uint(struct bd_gltf_json *json, const char *key, uint64_t value);
// Escaped; bytes that are no UTF-8 become U+FFFD.
void bd_gltf_json_text(struct bd_gltf_json *json, const char *key, const char *text);
// Finite, or it is a bug of ours: JSON has no other numbers. A negative zero stays one.
void bd_gltf_json_f32(struct bd_gltf_json *json, const char *key, float value);
void bd_gltf_json_f64(struct bd_gltf_json *json, const char *key, double value);
void bd_gltf_json_f32s(struct bd_gltf_json *json, const char *key, const float *values, int count);
void bd_gltf_json_f64s(struct bd_gltf_json *json, const char *key, const double *values, int count);

#endif
