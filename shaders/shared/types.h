// Vector types of the structs that C and GLSL share. Only these, so that std140, std430 and C
// lay the structs out alike.
#ifndef BD_SHARED_TYPES_H
#define BD_SHARED_TYPES_H

#ifdef BD_GLSL
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
#define BD_VEC4  struct bd_vec4
#define BD_UVEC4 struct bd_uvec4
#endif

#endif
