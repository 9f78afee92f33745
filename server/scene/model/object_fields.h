// What can be told of an object: a row for each field, by which edits are decoded, checked and
// echoed, glTF's numbers are read and written, snapshots stored and compared, and people told.
//
// Ranges are those of edits and of the importer alike: an edit outside is refused, a file's number
// clamped and counted. They are compared as floats, which is how they are kept, so that what a
// scene says of itself is always taken.
//
// A row is bytes of the flat form, in this order: a new one changes every hash, and what journals
// of older builds hold cannot be read, for no reader of an older layout exists (flat.c,
// delta_flat.c).
//
// Thread: any; all data is constant.

#ifndef BD_SCENE_MODEL_OBJECT_FIELDS_H
#define BD_SCENE_MODEL_OBJECT_FIELDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "image/shrink.h"

struct bd_material;
struct bd_texture_ref;

// Smaller ones first, as in the flat form.
enum bd_object_kind {
    BD_OBJECT_PICTURE,
    BD_OBJECT_TEXTURE,
    BD_OBJECT_MATERIAL,
    BD_OBJECT_LIGHT,
    BD_OBJECT_CAMERA,
    BD_OBJECT_MESH,
    BD_OBJECT_NODE,
    BD_OBJECT_ENVIRONMENT, // one, of id 0; never removed, at most dark
    BD_OBJECT_KIND_COUNT
};

// "node", "material"; never NULL.
const char *bd_object_kind_name(enum bd_object_kind kind);

enum bd_field_type {
    BD_FIELD_NAME,    // char[64]
    BD_FIELD_SWITCH,  // bool
    BD_FIELD_NUMBERS, // `count` floats
    BD_FIELD_WORD,    // an enum, in the order of `words`
    BD_FIELD_OBJECT,  // int32_t: an id of `refers_to`, or BD_NONE
    BD_FIELD_MAP,     // struct bd_texture_ref
    BD_FIELD_HEAVY,   // bytes or a list of its own: read by whoever knows them
};

struct bd_object_field {
    const char *name; // on the wire and in Python
    enum bd_field_type type;
    uint32_t offset; // in struct bd_material, bd_light ...; of BD_FIELD_HEAVY nothing
    uint32_t count;  // of numbers
    double least, most;
    bool or_zero;    // 0 is taken, too, though it is out of the range
    bool or_none;    // +inf, as 0 on the wire, as no number or one beyond `most` in glTF
    bool inverted;   // of a switch: the struct says the opposite
    double standard; // what a new object has, in each number
    const char *const *words;
    enum bd_object_kind refers_to;
    // Whether an object has it at all: the cone of a spot. NULL: always.
    bool (*holds)(const void *object);
    enum bd_texel_kind texels; // what the picture of a map holds
    uint32_t aspects;          // BD_ASPECT_BIT: what a change of it is a change of (aspects.c)
    // In a material of a glTF file: "pbrMetallicRoughness.metallicFactor". A switch that ends in an
    // extension's name is on where the extension is there.
    const char *gltf;
    const char *gltf_scale; // another number there, that multiplies it
    const char *help;       // unit and meaning
};

struct bd_object_field_list {
    const struct bd_object_field *rows; // numbers of each kind in the order of the flat form
    uint32_t count;
};
struct bd_object_field_list bd_object_fields(enum bd_object_kind kind);
// NULL: there is none.
const struct bd_object_field *bd_object_field(enum bd_object_kind kind, const char *name);

// The field of an object, and how many bytes it has.
void *bd_field_of(const struct bd_object_field *row, const void *object);
size_t bd_field_bytes(const struct bd_object_field *row);
bool bd_field_holds(const struct bd_object_field *row, const void *object);

bool bd_field_takes(const struct bd_object_field *row, double value);
// The number that is kept for one that the row takes: of a none, +inf.
float bd_field_kept(const struct bd_object_field *row, double value);
// What a glTF file's number becomes: clamped, which adds to `clamped`.
float bd_field_clamped(const struct bd_object_field *row, double value, uint32_t *clamped);
// How the wire says it: of +inf, 0.
double bd_field_said(const struct bd_object_field *row, float value);
// What a stored number has to lie in: wider where the range is a matter of sense.
void bd_field_stored_range(const struct bd_object_field *row, float *least, float *most);

// The map of a material's nth row that is one, and that row; NULL: there are no more.
struct bd_texture_ref *bd_material_map(const struct bd_material *material, uint32_t n);
const struct bd_object_field *bd_material_map_row(uint32_t n);

// Sets every row of an object to what a new one has; the rest is left alone.
void bd_object_set_standards(enum bd_object_kind kind, void *object);

// What a field takes, for a reader: "4 numbers from 0 to 1". Returns `out`.
#define BD_FIELD_TAKES_BYTES 96
const char *bd_field_takes_text(const struct bd_object_field *row, char out[BD_FIELD_TAKES_BYTES]);

#endif
