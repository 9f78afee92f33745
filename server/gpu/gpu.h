// The device: one EGL context without a window, and what lives in it. The only room that
// includes GL or EGL; everything above speaks of textures, buffers, programs and passes.
//
// It adds what nobody above need remember: a debug group and an error check for each call that
// records work, barriers derived from how a resource was last written, a timer a pass, memory
// accounting, the drivers' shader caches pointed into the data directory.
//
// Errors: calls that record work (upload, dispatch, draw, copy) return nothing; a failure there
// (lost context, out of memory) sticks to the device and is told by the next bd_gpu_wait,
// bd_gpu_readback_finish or bd_gpu_status. Creation calls return their error.
//
// Thread: one, the one that called bd_gpu_create, for every call but bd_gpu_list_devices.

#ifndef BD_GPU_GPU_H
#define BD_GPU_GPU_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

struct bd_gpu;
struct bd_tex;
struct bd_buf;
struct bd_program;

// --- device -------------------------------------------------------------------------------

struct bd_gpu_options {
    const char *device;          // auto | software | egl:N | uuid:HEX | pci:ID
    const char *cache_directory; // for the drivers' shader caches; NULL = the drivers' default
    uint64_t disk_reserve_bytes; // free on its disk, or there is no cache
    // A software device generates its code in 3/5 of the time, and the code takes up to twice as
    // long: for who renders little. The same bytes.
    bool quick_code;
    uint64_t memory_limit_bytes; // of bd_tex and bd_buf together; 0 = no limit
    bool debug;                  // KHR_debug, synchronous, into the log
    uint32_t lose_after_waits;   // test hook: the n-th bd_gpu_wait reports a lost device; 0 = never
};

struct bd_gpu_caps {
    char name[128]; // GL_RENDERER
    // Renderer and driver version, "llvmpipe-15.0.6-256-mesa-22.3.6", "nvidia-h200-570.12": same
    // class, same bytes.
    char device_class[64];
    bool software;
    uint32_t texture_side_max_px;
    uint64_t storage_block_max_bytes;
    uint64_t array_max_bytes; // of a buffer bound as BD_ARRAY
    uint64_t memory_bytes;    // 0 = the driver does not say
};

BD_MUST_CHECK
enum bd_err bd_gpu_create(const struct bd_gpu_options *options, struct bd_gpu **out,
                          struct bd_err_detail *detail);
// Everything made from the device must have been destroyed before.
void bd_gpu_destroy(struct bd_gpu **gpu);
const struct bd_gpu_caps *bd_gpu_caps(const struct bd_gpu *gpu);

// What stuck to the device: BD_ERR_OK, BD_ERR_DEVICE_LOST, BD_ERR_NO_MEMORY, or BD_ERR_INTERNAL
// for a call that GL refused, which is our bug; the log names it.
enum bd_err bd_gpu_status(struct bd_gpu *gpu);

struct bd_gpu_memory {
    uint64_t used_bytes, peak_bytes, limit_bytes;
};
void bd_gpu_memory(const struct bd_gpu *gpu, struct bd_gpu_memory *out);
void bd_gpu_memory_reset_peak(struct bd_gpu *gpu);
// For a limit that follows from what the device turned out to have.
void bd_gpu_set_memory_limit(struct bd_gpu *gpu, uint64_t limit_bytes);

// One line a device for people, or one JSON array: `bounced --list-devices`. Any thread; makes
// and ends a context on each. Caller frees.
char *bd_gpu_list_devices(bool json);

// --- textures -----------------------------------------------------------------------------

enum bd_format {
    BD_FORMAT_RGBA8,
    BD_FORMAT_RGBA8_SRGB,
    BD_FORMAT_RGBA16, // unorm
    BD_FORMAT_R32F,
    BD_FORMAT_RG32F,
    BD_FORMAT_RGBA32F,
    BD_FORMAT_R32UI,
    BD_FORMAT_RG32UI,
    BD_FORMAT_RGBA32UI,
    BD_FORMAT_DEPTH32F,
};

enum bd_tex_wrap { BD_TEX_REPEAT, BD_TEX_CLAMP, BD_TEX_MIRROR };

struct bd_tex_desc {
    const char *name; // in debug output; static storage
    enum bd_format format;
    uint32_t width_px, height_px;
    uint32_t layer_count; // 0 = a plain 2D texture, otherwise a 2D array
    uint32_t level_count; // 0 means 1
};

BD_MUST_CHECK
enum bd_err bd_tex_create(struct bd_gpu *gpu, const struct bd_tex_desc *desc, struct bd_tex **out,
                          struct bd_err_detail *detail);
void bd_tex_destroy(struct bd_gpu *gpu, struct bd_tex **tex); // takes NULL
const struct bd_tex_desc *bd_tex_desc(const struct bd_tex *tex);
uint64_t bd_tex_bytes(const struct bd_tex *tex);

// Level 0 of one layer (0 for a plain texture), tightly packed rows in the texture's own format.
void bd_tex_upload(struct bd_gpu *gpu, struct bd_tex *tex, uint32_t layer, const void *texels,
                   size_t size_bytes);
// The same of some rows of it.
void bd_tex_upload_rows(struct bd_gpu *gpu, struct bd_tex *tex, uint32_t layer, uint32_t first_row,
                        uint32_t row_count, const void *texels, size_t size_bytes);
void bd_tex_generate_levels(struct bd_gpu *gpu, struct bd_tex *tex);
// Clears every layer of level 0. Integer formats take value[] as unsigned integers.
void bd_tex_clear(struct bd_gpu *gpu, struct bd_tex *tex, const float value[4]);

// --- buffers ------------------------------------------------------------------------------

BD_MUST_CHECK
enum bd_err bd_buf_create(struct bd_gpu *gpu, const char *name, size_t size_bytes,
                          const void *initial, struct bd_buf **out, struct bd_err_detail *detail);
// Without clearing it, which takes its time for a hundred megabytes: every byte that is read must
// have been written first.
BD_MUST_CHECK
enum bd_err bd_buf_create_unset(struct bd_gpu *gpu, const char *name, size_t size_bytes,
                                struct bd_buf **out, struct bd_err_detail *detail);
void bd_buf_destroy(struct bd_gpu *gpu, struct bd_buf **buf); // takes NULL
size_t bd_buf_size_bytes(const struct bd_buf *buf);
void bd_buf_upload(struct bd_gpu *gpu, struct bd_buf *buf, size_t offset, const void *bytes,
                   size_t size_bytes);
void bd_buf_clear(struct bd_gpu *gpu, struct bd_buf *buf); // to zero

// All bytes of a buffer, where the host works on them until they are returned: of a software device
// the buffer's own, since its memory is the host's; elsewhere a copy, which goes back if it was
// borrowed to be written. Waits for what was recorded. Meanwhile nobody else may write to it, nor
// read it where it is being written; to be returned even after a failure. What is borrowed to be
// written is written whole.
enum bd_borrow { BD_BORROW_TO_READ, BD_BORROW_TO_WRITE };
BD_MUST_CHECK
enum bd_err bd_buf_borrow(struct bd_gpu *gpu, struct bd_buf *buf, enum bd_borrow how, void **bytes,
                          struct bd_err_detail *detail);
void bd_buf_return(struct bd_gpu *gpu, struct bd_buf *buf, enum bd_borrow how, void **bytes);

// --- programs -----------------------------------------------------------------------------
//
// Sources are files under shaders/, embedded in the binary, named by their path there without
// "shaders/". `#include "common/x.glsl"` and `#include "shared/x.h"` are resolved from there,
// each file once. Every source gets `#version 450 core`, BD_GLSL, BD_SOFTWARE on a software
// device, and the given defines.

#define BD_DEFINE_MAX 16
struct bd_defines {
    uint32_t count;
    struct {
        char name[32];
        int32_t value;
    } pairs[BD_DEFINE_MAX];
};
void bd_define(struct bd_defines *defines, const char *name, int32_t value);

// `compute` alone, or `vertex` and `fragment`.
struct bd_program_source {
    const char *compute, *vertex, *fragment;
    struct bd_defines defines;
};

// The same source and defines give the same program for the life of the device: owned by the
// device, compiled and linked at first request. Software drivers generate code later, for the
// formats and sampling that are bound: so the first dispatch or draw with bindings of a new kind
// is run once before, in a way that leaves no trace (one work group with zero uniforms, zero
// storage and images of its own; one triangle or a few points behind an empty scissor). Both count
// as `compile` (bd_gpu_compile_ms) and not to the pass around them. It asks one thing of a kernel:
// to end when all its uniforms are zero.
BD_MUST_CHECK
enum bd_err bd_program_get(struct bd_gpu *gpu, const struct bd_program_source *source,
                           struct bd_program **out, struct bd_err_detail *detail);
// Work-group size of a compute program, as its source declares it.
void bd_program_group_size(const struct bd_program *program, uint32_t out[3]);
// Since the device was made: number of programs, and milliseconds spent on them.
uint32_t bd_gpu_program_count(const struct bd_gpu *gpu);
double bd_gpu_compile_ms(const struct bd_gpu *gpu);

// --- recording ----------------------------------------------------------------------------
//
// A struct bd_bindings says what one dispatch or draw reads and writes, by the binding numbers
// that C and GLSL share (shaders/shared/bindings.h). Build it on the stack, zero-initialised.

#define BD_BINDING_MAX 16

enum bd_sampling { BD_SAMPLE_NEAREST, BD_SAMPLE_LINEAR, BD_SAMPLE_MIPMAP };

struct bd_bindings {
    // `layout(binding = i) uniform sampler2D / sampler2DArray / usampler2D`
    struct {
        const struct bd_tex *tex;
        enum bd_sampling sampling;
        enum bd_tex_wrap wrap_s, wrap_t;
    } textures[BD_BINDING_MAX];
    // `layout(binding = i, FORMAT) uniform image2D`: level 0; `layer` of an array, or all (-1)
    struct {
        struct bd_tex *tex;
        int32_t layer;
        bool read, write;
    } images[8];
    // BD_ARRAY(name, i) of shaders/common/array.glsl: read-only vec4s walked in lockstep; a
    // texture buffer on software devices, a storage buffer elsewhere.
    const struct bd_buf *arrays[BD_BINDING_MAX];
    // `layout(std430, binding = i) buffer`
    struct {
        struct bd_buf *buf;
        bool read, write;
    } storage[8];
    // `layout(std140, binding = i) uniform`: bytes are copied at the call.
    struct {
        const void *bytes;
        size_t size_bytes; // at most 16 KiB
    } uniforms[4];
};

// Counts are work groups.
void bd_gpu_dispatch(struct bd_gpu *gpu, const struct bd_program *program,
                     const struct bd_bindings *bindings, uint32_t x, uint32_t y, uint32_t z);
// Counts that the device has worked out: three uint32 at `offset_bytes` of `counts`, a multiple
// of 4. Each must be at most 65535; nobody checks. Zero is allowed.
void bd_gpu_dispatch_indirect(struct bd_gpu *gpu, const struct bd_program *program,
                              const struct bd_bindings *bindings, const struct bd_buf *counts,
                              size_t offset_bytes);

// Render target: colour textures and a depth texture of one size. `layer` selects a layer of an
// array texture (0 for plain ones).
#define BD_TARGET_COLOR_MAX 8
struct bd_target {
    struct {
        struct bd_tex *tex;
        uint32_t layer;
    } color[BD_TARGET_COLOR_MAX]; // up to the first NULL
    struct {
        struct bd_tex *tex;
        uint32_t layer;
    } depth; // DEPTH32F or NULL
};

enum bd_cull { BD_CULL_NONE, BD_CULL_BACK };
enum bd_topology {
    BD_TOPOLOGY_TRIANGLES,
    BD_TOPOLOGY_POINTS, // a point colours the pixel that it lies in
};
// How a draw uses the target's depth. Without a depth texture all three are the last.
enum bd_draw_depth {
    BD_DRAW_DEPTH_WRITE, // what is nearer passes, and leaves its depth
    BD_DRAW_DEPTH_TEST,  // what is nearer passes, the depth stays
    BD_DRAW_DEPTH_IGNORE,
};
enum bd_blend {
    BD_BLEND_REPLACE,
    // Adds to every colour, alpha too, in 32 bits a channel. Fragments of one pixel are added in
    // the order of draws, instances and primitives, so that two runs give the same sum. Every
    // colour texture of the target must be R32F, RG32F or RGBA32F.
    BD_BLEND_ADD,
};

// Attribute i of a vertex is `layout(location = i)`.
struct bd_attribute {
    const struct bd_buf *buf; // NULL: the constant (0, 0, 0, 1)
    size_t offset_bytes;
    uint32_t stride_bytes;
    uint32_t component_count; // floats; or one uint with `is_uint`
    bool is_uint;
    bool per_instance;
};
#define BD_ATTRIBUTE_MAX 8

struct bd_draw {
    const struct bd_program *program;
    struct bd_bindings bindings;
    struct bd_attribute attributes[BD_ATTRIBUTE_MAX];
    const struct bd_buf *indices; // uint32; NULL: vertices in order, from base_vertex
    size_t index_offset_bytes;
    uint32_t index_count;
    int32_t base_vertex;
    uint32_t instance_count;
    uint32_t base_instance;
    enum bd_cull cull; // front faces are counter-clockwise as the viewer sees them (so is
                       // gl_FrontFacing); `mirrored` swaps that
    bool mirrored;
    enum bd_topology topology;
    enum bd_draw_depth depth;
    enum bd_blend blend;
};

// Clears the colours to 0 and the depth to 0 (infinitely far: depth is reversed), sets the
// viewport to the whole target, depth test GREATER, clip control zero to one with the origin at
// the *upper* left: row 0 of a texture is the top of the picture. Ends with bd_gpu_target_end.
void bd_gpu_target_begin(struct bd_gpu *gpu, const struct bd_target *target);
// Draws from here on touch these rows only, until the next call or the target's end: so a large
// target can be drawn in bands, with something else between them.
void bd_gpu_target_rows(struct bd_gpu *gpu, uint32_t first_row, uint32_t row_count);
void bd_gpu_draw(struct bd_gpu *gpu, const struct bd_draw *draw);
void bd_gpu_target_end(struct bd_gpu *gpu);

// --- time and slices ----------------------------------------------------------------------

// Brackets a pass: a debug group and two timestamps. Passes do not nest. `name` is static.
void bd_gpu_pass_begin(struct bd_gpu *gpu, const char *name);
void bd_gpu_pass_end(struct bd_gpu *gpu);
// Of the pass being recorded; NULL between passes.
const char *bd_gpu_pass_name(const struct bd_gpu *gpu);

// Submits what was recorded. On a software device it also waits: work there is done in our time
// whatever we do, and a slice must end when it says so.
void bd_gpu_flush(struct bd_gpu *gpu);
// Submits and waits for all of it. The check for a lost device.
BD_MUST_CHECK
enum bd_err bd_gpu_wait(struct bd_gpu *gpu);

// A pass and a target in the middle of their recording, set aside so that something else may be
// recorded between two of their calls: passes do not nest, but they may be interrupted. Nothing may
// be written to or destroyed that they use. The pass goes on as one more entry of the same name.
struct bd_gpu_suspended {
    const char *pass; // NULL: none was being recorded
    bool in_target;
    struct bd_target target;
    uint32_t first_row, row_count;
    uint64_t memory_peak_bytes;
};
void bd_gpu_suspend(struct bd_gpu *gpu, struct bd_gpu_suspended *out);
// With everything that was begun since ended again. The peak of memory is that of both together.
void bd_gpu_resume(struct bd_gpu *gpu, const struct bd_gpu_suspended *suspended);

struct bd_gpu_pass_time {
    const char *name;
    double ms; // device time between the timestamps
};
// The passes recorded since the last call, in order, up to `max`; waits for them. Returns the
// count.
uint32_t bd_gpu_take_pass_times(struct bd_gpu *gpu, struct bd_gpu_pass_time *out, uint32_t max);

// --- readback -----------------------------------------------------------------------------

// Starts an asynchronous copy of level 0 of one layer into memory that the host can read.
struct bd_readback;
BD_MUST_CHECK
enum bd_err bd_gpu_readback_start(struct bd_gpu *gpu, const struct bd_tex *tex, uint32_t layer,
                                  struct bd_readback **out, struct bd_err_detail *detail);
// The same of some rows.
BD_MUST_CHECK
enum bd_err bd_gpu_readback_rows_start(struct bd_gpu *gpu, const struct bd_tex *tex, uint32_t layer,
                                       uint32_t first_row, uint32_t row_count,
                                       struct bd_readback **out, struct bd_err_detail *detail);
// Waits for it and copies `size_bytes` (the tightly packed rows in the texture's own format)
// to `bytes`; destroys the readback either way.
BD_MUST_CHECK
enum bd_err bd_gpu_readback_finish(struct bd_gpu *gpu, struct bd_readback **readback, void *bytes,
                                   size_t size_bytes);
// Waits and copies some rows, at most 1 GiB, straight to `texels`: of a software device without a
// copy in between.
BD_MUST_CHECK
enum bd_err bd_tex_read_rows(struct bd_gpu *gpu, const struct bd_tex *tex, uint32_t layer,
                             uint32_t first_row, uint32_t row_count, void *texels,
                             size_t size_bytes);
// Waits and copies a buffer's bytes: counts that the host must know, and tests.
BD_MUST_CHECK
enum bd_err bd_buf_read(struct bd_gpu *gpu, const struct bd_buf *buf, size_t offset, void *bytes,
                        size_t size_bytes);

#endif
