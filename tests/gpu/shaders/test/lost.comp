// Includes what is not there.
layout(local_size_x = 1) in;
#include "test/no_such.glsl"
