// The drivers' caches of compiled shaders: where they lie, and that no full disk ends the process
// by them.
//
// Thread: before a context is made; drivers read their environment then.

#ifndef BD_GPU_SHADER_CACHE_H
#define BD_GPU_SHADER_CACHE_H

#include <stdint.h>

// Points them into `directory`, NULL: where they are by default. What the user has set stays. With
// less than `reserve_bytes` free behind what they need at once they are switched off.
void bd_shader_cache_prepare(const char *directory, uint64_t reserve_bytes);

#endif
