// A read-only array of vec4 that all invocations walk in lockstep.
//
// On the software rasteriser a texture buffer reads such an array about four times faster than a
// storage buffer (200 against 50 million light-receiver evaluations a second on two cores); on
// hardware a storage buffer has no size limit worth naming. gpu/ binds whichever this picks.
// Storage blocks 0 to 7 are those of bd_bindings.storage; arrays come after them.
#ifdef BD_SOFTWARE
#define BD_ARRAY(name, unit) layout(binding = unit) uniform samplerBuffer name
#define BD_LOAD(name, index) texelFetch(name, int(index))
#else
#define BD_ARRAY(name, unit)                                                                       \
    layout(std430, binding = 8 + unit) readonly buffer name##_block { vec4 name[]; }
#define BD_LOAD(name, index) name[index]
#endif
