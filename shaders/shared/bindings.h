// Binding numbers, one truth for C and GLSL. Textures and arrays share one number space (both
// are texture units on software devices); images, storage blocks and uniform blocks have one
// each. A pass uses the numbers of its own section; no shader sees two sections.
#ifndef BD_SHARED_BINDINGS_H
#define BD_SHARED_BINDINGS_H

// Every shader: the view or light that it renders for, and the arguments of its pass.
#define BD_UNIFORM_VIEW 0
#define BD_UNIFORM_ARGS 1

#endif
