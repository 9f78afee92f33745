// A picture of the whole sky from the bytes of an EXR or of a Radiance picture (.hdr), as they
// begin.
//
// The input is a stranger's: size before memory, every texel before use. Negative radiance, which
// resampling filters leave behind, is no light: it becomes 0 and is counted.
//
// Only the import child calls this for bytes that a client sent (scene/import/import.h). Thread:
// any.

#ifndef BD_SCENE_IMPORT_SKY_MAP_H
#define BD_SCENE_IMPORT_SKY_MAP_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/scene.h"

// Reads what image/exr.h and image/rgbe.h say: of an EXR the channels R, G and B, or Y alone, which
// is grey. On success the caller owns one reference to a map that is not sealed yet;
// `negative_count` is how many texels were raised to 0. BD_ERR_BAD_INPUT for what is no such file
// or not finite, that or BD_ERR_LIMIT for more than BD_SKY_MAP_SIDE_MAX_PX a side; the error names
// `field`.
BD_MUST_CHECK
enum bd_err bd_sky_map_read(const void *bytes, size_t size_bytes, const char *field,
                            struct bd_sky_map **out, uint64_t *negative_count,
                            struct bd_err_detail *detail);

#endif
