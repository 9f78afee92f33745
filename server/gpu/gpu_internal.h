// What the files of this room share: the structs behind gpu.h, and the calls between them. No
// other room includes it.

#ifndef BD_GPU_INTERNAL_H
#define BD_GPU_INTERNAL_H

#include <epoxy/gl.h>

#include "gpu/egl.h"
#include "gpu/gpu.h"
#include "gpu/source.h"

// --- barriers (barrier.c) -----------------------------------------------------------------
//
// Writes by shaders through images and storage blocks are the only ones that GL does not order
// by itself. A resource remembers the serial of the last call that wrote it so, and that read
// it; the device remembers, for each way of using a resource, the serial of the last barrier.

enum bd_use {
    BD_USE_FETCH,      // sampled, or a texture buffer
    BD_USE_IMAGE,      // image load or store
    BD_USE_STORAGE,    // storage block
    BD_USE_VERTEX,     // vertex attribute
    BD_USE_INDEX,      // element array
    BD_USE_COMMAND,    // counts of an indirect dispatch
    BD_USE_TARGET,     // colour or depth attachment
    BD_USE_TEX_UPDATE, // upload, clear, readback of a texture
    BD_USE_BUF_UPDATE, // the same of a buffer
    BD_USE_COUNT
};

struct bd_access {
    uint64_t written_at, read_at; // serials of shader accesses; 0 = never
};

// Notes that the call being recorded uses the resource so, and whether that needs a barrier.
void bd_barrier_read(struct bd_gpu *gpu, const struct bd_access *access, enum bd_use use);
void bd_barrier_write(struct bd_gpu *gpu, const struct bd_access *access, enum bd_use use);
// Issues the barriers that the notes since the last call asked for.
void bd_barrier_issue(struct bd_gpu *gpu);

// --- resources ----------------------------------------------------------------------------

struct bd_format_info {
    GLenum internal_format, format, type;
    uint32_t texel_bytes;
    bool is_uint, is_depth, is_image; // is_image: may be bound with glBindImageTexture
    bool is_float;                    // 32 bits a channel: sums keep their low bits
};

struct bd_tex {
    struct bd_tex_desc desc;
    GLuint id;
    uint64_t size_bytes;
    struct bd_access access;
};

struct bd_buf {
    const char *name;
    GLuint id;
    GLuint texel_view; // texture buffer over it, for BD_ARRAY; 0 where storage blocks serve
    size_t size_bytes;
    void *bytes; // of a software device's buffer: where the host works on it; else NULL
    struct bd_access access;
};

const struct bd_format_info *bd_format_info(enum bd_format format);
GLenum bd_tex_gl_target(const struct bd_tex_desc *desc);
// Makes a texture object with storage; 0 with the GL error taken, if that fails.
GLuint bd_tex_make(const struct bd_tex_desc *desc);
GLuint bd_sampler(struct bd_gpu *gpu, enum bd_sampling sampling, enum bd_tex_wrap wrap_s,
                  enum bd_tex_wrap wrap_t);

// --- uniform bytes (uniform.c) ------------------------------------------------------------
//
// A persistently mapped ring. Segments are reused behind a fence, so that nothing is overwritten
// that a recorded call has still to read, and no call waits for the one before it.

#define BD_UNIFORM_SEGMENT_COUNT   4u
#define BD_UNIFORM_SEGMENT_BYTES   (256u * 1024u)
#define BD_UNIFORM_BLOCK_MAX_BYTES 16384u

struct bd_uniform_ring {
    GLuint id;
    uint8_t *mapped;
    uint32_t segment, used_bytes, alignment_bytes;
    GLsync fences[BD_UNIFORM_SEGMENT_COUNT];
};

BD_MUST_CHECK
enum bd_err bd_uniform_ring_init(struct bd_gpu *gpu, struct bd_err_detail *detail);
void bd_uniform_ring_finish(struct bd_gpu *gpu);
// Copies the bytes and binds them as uniform block `index`.
void bd_uniform_bind(struct bd_gpu *gpu, uint32_t index, const void *bytes, size_t size_bytes);

// --- programs -----------------------------------------------------------------------------

#define BD_PRECOMPILED_MAX 32

struct bd_program {
    struct bd_program_source source; // names owned
    GLuint id;
    uint32_t group_size[3];     // compute only
    uint64_t warm[BD_PRECOMPILED_MAX]; // signatures of bindings that it has been run with
    uint32_t warm_count;
};

void bd_programs_finish(struct bd_gpu *gpu);

// Runs the program once with what decides the driver's code generation (formats and sampling of
// `bindings`, of the current target) and writes nothing that anyone sees. Does nothing the
// second time. The time goes to `compile`, not to the pass being recorded.
void bd_precompile_dispatch(struct bd_gpu *gpu, const struct bd_program *program,
                            const struct bd_bindings *bindings);
void bd_precompile_draw(struct bd_gpu *gpu, const struct bd_draw *draw);

// --- recording ----------------------------------------------------------------------------

void bd_bind_note(struct bd_gpu *gpu, const struct bd_bindings *bindings); // barriers
// Takes images of earlier calls from the units that have none: what a shader stores there is
// dropped, and not written to somebody's texture.
void bd_unbind_images(struct bd_gpu *gpu, const struct bd_bindings *bindings);
void bd_bind_textures(struct bd_gpu *gpu, const struct bd_bindings *bindings);
void bd_bind_all(struct bd_gpu *gpu, const struct bd_bindings *bindings);
void bd_draw_submit(struct bd_gpu *gpu, const struct bd_draw *draw, uint32_t index_count,
                    uint32_t instance_count);
// The target as it was when it was suspended: nothing is cleared.
void bd_draw_resume_target(struct bd_gpu *gpu, const struct bd_gpu_suspended *suspended);

// --- timers -------------------------------------------------------------------------------

struct bd_timer_pass {
    const char *name;
    GLuint queries[2];
    double compile_ms; // spent on warm-up between the two, to be taken off
};

struct bd_timers {
    struct bd_timer_pass *passes;
    uint32_t count, capacity;
    bool open; // the last of `passes` has begun and not ended
};

void bd_timers_finish(struct bd_gpu *gpu);
// Milliseconds of compilation: to the device's sum, and off the pass being recorded.
void bd_timers_add_compile(struct bd_gpu *gpu, double ms);

// --- device -------------------------------------------------------------------------------

// Opens the device that `device` asks for (choose.c).
BD_MUST_CHECK
enum bd_err bd_choose(const char *device, bool debug, struct bd_egl *out,
                      struct bd_err_detail *detail);
// Of the context that is current (caps.c).
bool bd_is_software_renderer(const char *renderer);
void bd_read_caps(struct bd_gpu_caps *caps);

// Names of a device that outlive a reboot; empty where nothing tells them (identity.c).
struct bd_identity {
    char uuid[33]; // 32 lower-case hexadecimal digits
    char pci[16];  // 0000:65:00.0
};
// Wants the candidate's context current.
void bd_identify(const struct bd_egl_candidate *candidate, struct bd_identity *out);
bool bd_is_uuid(const struct bd_identity *identity, const char *text); // "GPU-1234..." too
bool bd_is_pci(const struct bd_identity *identity, const char *text);  // "65:00.0" too

struct bd_gpu {
    struct bd_egl egl;
    struct bd_gpu_caps caps;
    struct bd_gpu_memory memory;
    enum bd_err status; // what stuck
    uint32_t lose_after_waits, wait_count;
    bool arrays_are_textures;

    uint64_t serial; // of the call being recorded
    uint64_t barrier_at[BD_USE_COUNT];
    GLbitfield barriers_wanted;

    uint32_t images_bound; // units

    GLuint vertex_array, framebuffer;
    GLuint samplers[27];
    GLuint zero_buffer, scratch_buffer; // what warm-up binds for uniform and storage blocks
    struct bd_target target;            // between target_begin and target_end
    bool in_target;
    uint32_t first_row, row_count; // of the target that draws may touch
    struct bd_uniform_ring uniforms;
    struct bd_timers timers;

    struct bd_program **programs;
    uint32_t program_count, program_capacity;
    double compile_ms;
};

// Takes GL's errors after `call`; what cannot be mended sticks to the device. True if clean.
bool bd_gpu_check(struct bd_gpu *gpu, const char *call);
// Takes GL's errors after a creation call that failing is allowed to fail.
GLenum bd_gpu_take_error(void);
// Asks GL whether the context was reset; sticks.
void bd_gpu_check_reset(struct bd_gpu *gpu);
// Why a creation call failed: the device is lost, or else it has no room.
enum bd_err bd_gpu_why_not_made(struct bd_gpu *gpu);
// Room in the budget for `size_bytes` more, or BD_ERR_NO_MEMORY with the sizes in words.
BD_MUST_CHECK
enum bd_err bd_gpu_reserve(struct bd_gpu *gpu, const char *name, uint64_t size_bytes,
                           struct bd_err_detail *detail);
void bd_gpu_release(struct bd_gpu *gpu, uint64_t size_bytes);

#endif
