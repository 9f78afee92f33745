// Content: the heavy objects of scenes (streams of a mesh, a picture, a sky map) by the SHA-256 of
// their bytes.
//
// A snapshot's index and a delta name content and do not hold it, so that both stay small; whoever
// keeps them keeps the bytes beside them, once each. A mesh's name and materials are no part of its
// content.
//
// Thread: any. Writing and reading take about a millisecond a MiB: not on the event loop.

#ifndef BD_SCENE_MODEL_CONTENT_H
#define BD_SCENE_MODEL_CONTENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/flat.h"
#include "scene/model/scene.h"

enum bd_content_kind { BD_CONTENT_MESH, BD_CONTENT_PICTURE, BD_CONTENT_SKY_MAP };

// One reference to something sealed; the pointer of its kind is set.
struct bd_content {
    enum bd_content_kind kind;
    struct bd_mesh *mesh;
    struct bd_picture *picture;
    struct bd_sky_map *sky_map;
};

// NULL of one that holds nothing.
const uint8_t *bd_content_sha256(const struct bd_content *content);
struct bd_content bd_content_retain(const struct bd_content *content);
void bd_content_release(struct bd_content *content);

// The bytes whose SHA-256 the content is named by. False if the sink said so.
BD_MUST_CHECK
bool bd_content_write(const struct bd_content *content, bd_flat_sink sink, void *user);

// The caller owns the result, sealed: compare its SHA-256 with the name that the bytes went by.
// Trusts nothing. BD_ERR_BAD_INPUT, BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_content_read(const void *bytes, size_t size, struct bd_content *out,
                            struct bd_err_detail *detail);

// The same from a source, of a kind that is known.
BD_MUST_CHECK
enum bd_err bd_content_receive(enum bd_content_kind kind, bd_flat_source source, void *user,
                               uint64_t size_max, struct bd_content *out,
                               struct bd_err_detail *detail);

// Calls `each` for all content that a snapshot needs; a thing may come more than once.
typedef void (*bd_content_visit)(void *user, const struct bd_content *content);
void bd_content_of_scene(const struct bd_scene *scene, bd_content_visit each, void *user);

// The bytes of a mesh's streams.
uint64_t bd_mesh_bytes(const struct bd_mesh *mesh);

// About the bytes that a snapshot takes: streams, texels and small objects, as quotas count them.
uint64_t bd_scene_bytes(const struct bd_scene *scene);

#endif
