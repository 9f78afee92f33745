// Import: a stranger's bytes in, a scene, a picture or a sky out, through a child process that can
// do nothing else.
//
// Parsers and decoders of what clients send run in `bounced --import`, with limits on memory and
// time and a seccomp filter; it gets the files as inherited descriptors and answers on one pipe in
// our own flat form (scene/model/flat.h), which the parent reads, while it comes, with bounds
// checks. One code path for daemon and tests, for files, pictures of edits and environments.
//
// One child, one question: what a picture made of its decoder ends with it, and the next client's
// bytes never meet it. A process start costs 30 ms, mostly of the dynamic linker, so the pool keeps
// a few children that are linked and wait.
//
// Thread: any but the event loop (it blocks); several at once are fine.

#ifndef BD_SCENE_IMPORT_IMPORT_H
#define BD_SCENE_IMPORT_IMPORT_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/gltf/import_input.h"
#include "scene/model/scene.h"

extern const struct bd_import_limits bd_import_default_limits;

// Children of one program. A pool without spares is no more than the program's name.
struct bd_import_pool;

// `program` is the path of the bounced binary (NULL: this very program, /proc/self/exe); copied. At
// most `spare_count` children wait; they are started by the first picture or sky that is asked for,
// since a scene's work is much to a process's start, and end after a while without one.
struct bd_import_pool *bd_import_pool_create(const char *program, uint32_t spare_count);
// Nobody imports any more. Nulls; takes NULL.
void bd_import_pool_destroy(struct bd_import_pool **pool);

// All of the below: BD_ERR_LIMIT names the limit that was passed; BD_ERR_BAD_INPUT what is wrong
// with the bytes, or that they crashed the child; BD_ERR_NO_MEMORY that somebody else killed it, as
// the kernel does where the machine has no memory left; BD_ERR_IO that there can be no child. The
// message names the file.

// Reads files[0], a .glb or .gltf, with the rest as what its uris mean. On success the caller owns
// one reference to a finished scene. On failure `detail` names the JSON path or the limit.
BD_MUST_CHECK
enum bd_err bd_import(struct bd_import_pool *pool, const struct bd_import_file *files,
                      uint32_t file_count, const struct bd_import_limits *limits,
                      struct bd_scene **out, struct bd_err_detail *detail);

// The same under an environment (or NULL for none), which belongs to the snapshot and its hash; its
// map gets a reference of the scene's own.
BD_MUST_CHECK
enum bd_err bd_import_under(struct bd_import_pool *pool, const struct bd_import_file *files,
                            uint32_t file_count, const struct bd_import_limits *limits,
                            const struct bd_environment *environment, struct bd_scene **out,
                            struct bd_err_detail *detail);

// A PNG or JPEG; its uri is the field that errors name. The caller owns a reference to a sealed
// picture of at most limits->picture_texels, never shrunk.
BD_MUST_CHECK
enum bd_err bd_import_picture(struct bd_import_pool *pool, const struct bd_import_file *file,
                              const struct bd_import_limits *limits, struct bd_picture **out,
                              struct bd_err_detail *detail);

// An EXR or a Radiance picture, as bd_sky_map_read takes them, its uri the field that errors name.
// The caller owns a reference to a sealed map; `negative_count` texels of it were raised to 0.
BD_MUST_CHECK
enum bd_err bd_import_sky_map(struct bd_import_pool *pool, const struct bd_import_file *file,
                              const struct bd_import_limits *limits, struct bd_sky_map **out,
                              uint64_t *negative_count, struct bd_err_detail *detail);

// The child's whole life: `bounced --import` ends with this. Returns the exit status.
int bd_import_child_main(int argc, char **argv);

#endif
