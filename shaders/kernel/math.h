// The words that kernels are written in.
//
// A kernel is a function from values to a value, read by GLSL and by C: no memory, no `inout`, no
// arrays, one return, loops of constant length alone, and f_select for what depends on a condition:
// both of its sides are computed. Types are float, uint, bool, f3, and structs of those. So a C
// compiler makes one loop of it for as many receivers as it has lanes, and the same bits come from
// any width: every operation here is one of IEEE 754's, in the order that is written.
#ifndef BD_KERNEL_MATH_H
#define BD_KERNEL_MATH_H

#ifdef BD_GLSL

#define KERNEL
#define STRUCT(name)         struct name
#define f3                   vec3
#define f3_of                vec3
#define f3_add(a, b)         ((a) + (b))
#define f3_sub(a, b)         ((a) - (b))
#define f3_mul(a, b)         ((a) * (b))
#define f3_scale(a, s)       ((a) * (s))
#define f3_abs               abs
#define f3_max               max
#define f3_min               min
#define f3_dot               dot
#define f3_cross             cross
#define f3_select(c, a, b)   ((c) ? (a) : (b))
#define f_select(c, a, b)    ((c) ? (a) : (b))
#define u_select(c, a, b)    ((c) ? (a) : (b))
#define b_and(a, b)          ((a) && (b))
#define b_or(a, b)           ((a) || (b))
#define f_min                min
#define f_max                max
#define f_abs                abs
#define f_sqrt               sqrt
#define f_bits               floatBitsToUint
#define f_of_bits            uintBitsToFloat
#define u_of                 uint
#define f_of                 float
#define f_floor              floor

#else

#include <stdbool.h>
#include <stdint.h>

#define KERNEL static inline __attribute__((always_inline))
#define STRUCT(name) typedef struct name name; struct name

typedef uint32_t uint;
typedef struct {
    float x, y, z;
} f3;

KERNEL f3 f3_of(float x, float y, float z) { return (f3){x, y, z}; }
KERNEL f3 f3_add(f3 a, f3 b) { return f3_of(a.x + b.x, a.y + b.y, a.z + b.z); }
KERNEL f3 f3_sub(f3 a, f3 b) { return f3_of(a.x - b.x, a.y - b.y, a.z - b.z); }
KERNEL f3 f3_mul(f3 a, f3 b) { return f3_of(a.x * b.x, a.y * b.y, a.z * b.z); }
KERNEL f3 f3_scale(f3 a, float s) { return f3_of(a.x * s, a.y * s, a.z * s); }
KERNEL float f3_dot(f3 a, f3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
KERNEL f3 f3_cross(f3 a, f3 b)
{
    return f3_of(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
// Both sides are computed: && would be a branch.
KERNEL bool b_and(bool a, bool b) { return a & b; }
KERNEL bool b_or(bool a, bool b) { return a | b; }
KERNEL float f_select(bool c, float a, float b) { return c ? a : b; }
KERNEL uint u_select(bool c, uint a, uint b) { return c ? a : b; }
KERNEL f3 f3_select(bool c, f3 a, f3 b)
{
    return f3_of(c ? a.x : b.x, c ? a.y : b.y, c ? a.z : b.z);
}
KERNEL float f_min(float a, float b) { return a < b ? a : b; }
KERNEL float f_max(float a, float b) { return a > b ? a : b; }
KERNEL float f_abs(float a) { return __builtin_fabsf(a); }
KERNEL f3 f3_abs(f3 a) { return f3_of(f_abs(a.x), f_abs(a.y), f_abs(a.z)); }
KERNEL f3 f3_max(f3 a, float b) { return f3_of(f_max(a.x, b), f_max(a.y, b), f_max(a.z, b)); }
KERNEL f3 f3_min(f3 a, float b)
{
    return f3_of(f_min(a.x, b), f_min(a.y, b), f_min(a.z, b));
}
KERNEL float f_sqrt(float a) { return __builtin_sqrtf(a); }
KERNEL float f_of(uint a)
{
    return (float)a;
}
// Rounded down, from 0 on.
KERNEL uint u_of(float a)
{
    return (uint)a;
}
// From 0 to 2^31.
KERNEL float f_floor(float a)
{
    return (float)(int32_t)a;
}
KERNEL uint f_bits(float a)
{
    uint bits;
    __builtin_memcpy(&bits, &a, sizeof bits);
    return bits;
}
KERNEL float f_of_bits(uint bits)
{
    float a;
    __builtin_memcpy(&a, &bits, sizeof a);
    return a;
}

#endif

#define F_PI 3.14159265f

// a^5.
KERNEL float f_fifth(float a)
{
    return (a * a) * (a * a) * a;
}

KERNEL float f3_length(f3 a) { return f_sqrt(f3_dot(a, a)); }

KERNEL f3 f3_unit(f3 a) { return f3_scale(a, 1.0f / f_sqrt(f3_dot(a, a))); }

// a at 0, b at 1.
KERNEL f3 f3_between(f3 a, f3 b, float t) { return f3_add(a, f3_scale(f3_sub(b, a), t)); }

// Arc tangent of 0 to 1, to 2e-8 of it (Abramowitz and Stegun 4.4.49).
KERNEL float f_atan_to_1(float t)
{
    float s = t * t;
    float p = 0.0028662257f;
    p = p * s - 0.0161657367f;
    p = p * s + 0.0429096138f;
    p = p * s - 0.0752896400f;
    p = p * s + 0.1065626393f;
    p = p * s - 0.1420889944f;
    p = p * s + 0.1999355085f;
    p = p * s - 0.3333314528f;
    return t + t * s * p;
}

// Angle of the point (x, y) from the x axis; y >= 0. 0 to pi, 0 at the origin.
KERNEL float f_angle(float y, float x)
{
    float across = f_abs(x);
    float t = f_min(y, across) / f_max(f_max(y, across), 1e-37f);
    float angle = f_atan_to_1(t);
    angle = f_select(y > across, 0.5f * F_PI - angle, angle);
    return f_select(x < 0.0f, F_PI - angle, angle);
}

#endif
