// Types of the structs that C and GLSL share. Only these, and scalars in groups of four (16 bytes),
// so that std140, std430 and C lay the structs out alike.
#ifndef BD_SHARED_TYPES_H
#define BD_SHARED_TYPES_H

#ifdef BD_GLSL
#define BD_FLOAT float
#define BD_UINT  uint
#define BD_VEC4  vec4
#define BD_UVEC4 uvec4
#else
#include <stdint.h>
struct bd_vec4 {
    float x, y, z, w;
};
struct bd_uvec4 {
    uint32_t x, y, z, w;
};
#define BD_FLOAT float
#define BD_UINT  uint32_t
#define BD_VEC4  struct bd_vec4
#define BD_UVEC4 struct bd_uvec4
#endif

#endif
