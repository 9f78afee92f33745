// A snapshot on the GPU: meshes, textures, the list of draws and the list of triangles.
//
// Meshes and textures are shared between snapshots by the hash of their content, the list of
// triangles by the counters of geometry and transforms, so that an edit uploads only what it
// brought.
//
// Thread: render thread, context current.

#ifndef BD_UPLOAD_GPU_SCENE_H
#define BD_UPLOAD_GPU_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "gpu/gpu.h"
#include "scene/model/render_space.h"
#include "scene/model/scene.h"
#include "scene/model/triangle_order.h"
#include "upload/view_bounds.h"

// Where a primitive's streams lie in its mesh's vertex buffer.
enum bd_stream {
    BD_STREAM_POSITION, // 3 floats
    BD_STREAM_NORMAL,   // 3
    BD_STREAM_TANGENT,  // 4
    BD_STREAM_UV0,      // 2
    BD_STREAM_UV1,      // 2
    BD_STREAM_COLOR,    // 4
    BD_STREAM_COUNT,
};
extern const uint32_t bd_stream_component_count[BD_STREAM_COUNT];

struct bd_gpu_primitive {
    bool has[BD_STREAM_COUNT];
    size_t offset_bytes[BD_STREAM_COUNT];
    size_t index_offset_bytes;
    uint32_t index_count;
    struct bd_box *chunks; // of BD_CHUNK_TRIANGLES each, in order, the last of what is left
};

// Triangles of a primitive that are left out of a view, or not, together: as many as take the
// software device a few times as long as a draw call does.
#define BD_CHUNK_TRIANGLES 512u

struct bd_gpu_mesh {
    uint64_t content_hash;
    uint32_t reference_count;
    struct bd_box box; // of all primitives
    struct bd_buf *vertices, *indices;
    uint32_t primitive_count;
    struct bd_gpu_primitive *primitives;
};

struct bd_gpu_triangles;

struct bd_gpu_picture {
    uint64_t content_hash;
    bool srgb;
    uint32_t reference_count;
    struct bd_tex *tex;
};

// All instances of one primitive that share a winding: one draw call.
struct bd_scene_draw {
    const struct bd_triangle_run *run;
    const struct bd_gpu_mesh *mesh;
    const struct bd_gpu_primitive *primitive;
    const struct bd_material *material;
};

struct bd_gpu_scene {
    struct bd_scene *scene; // retained
    struct bd_render_space space;
    struct bd_triangle_order order;
    struct bd_scene_draw *draws; // one a run
    struct bd_buf *triangles;    // array, three vec4s: corner, edge, edge; render space
    struct bd_gpu_triangles *shared_triangles; // whose buffer that is
    uint32_t mesh_count, picture_count;
    struct bd_gpu_mesh **meshes;           // by scene mesh index; NULL where not drawn
    struct bd_gpu_picture *(*pictures)[2]; // by scene picture index and srgb
};

// Owns the shared meshes and textures. `upload_ms` grows by the time spent.
//
// Uploads come in pieces of a MiB or a millisecond or two; between them `pause` (may be NULL) is
// asked whether to stop. Another scene may be uploaded in it: a mesh or a texture is shared once it
// is there as a whole.
struct bd_uploader {
    struct bd_gpu *gpu;
    enum bd_err (*pause)(void *user);
    void *user;
    void *meshes, *pictures; // those that are there as a whole, by content: trees of tsearch
    struct bd_gpu_triangles *triangles; // lists of them that are there as a whole
    double upload_ms;
    uint64_t piece_start_ns;
};

// Errors: those of `pause`, BD_ERR_NO_MEMORY, BD_ERR_LIMIT; the error names the limit.
BD_MUST_CHECK
enum bd_err bd_gpu_scene_create(struct bd_uploader *uploader, struct bd_scene *scene,
                                struct bd_gpu_scene **out, struct bd_err_detail *detail);
void bd_gpu_scene_destroy(struct bd_uploader *uploader, struct bd_gpu_scene **scene);
// What it alone keeps, on the device and on the host: triangles, unless others had them already,
// draws and the snapshot's objects. Meshes and textures, which scenes share, are counted by the
// device.
uint64_t bd_gpu_scene_own_bytes(const struct bd_gpu_scene *scene);

// The texture behind a reference; NULL if it has none (then the factor stands alone).
const struct bd_tex *bd_gpu_scene_texture(const struct bd_gpu_scene *scene,
                                          const struct bd_texture_ref *ref, bool srgb);

#endif
