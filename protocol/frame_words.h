// Words of a frame's options that rooms of the daemon go by, too. Thread: plain data.

#ifndef BD_PROTOCOL_FRAME_WORDS_H
#define BD_PROTOCOL_FRAME_WORDS_H

#include <stddef.h>

// What is made anew although an earlier frame's output would do: for measuring what a frame costs
// after the camera moved, or after everything did. Uploaded meshes and textures always stay.
enum bd_fresh { BD_FRESH_NONE, BD_FRESH_CAMERA, BD_FRESH_ALL, BD_FRESH_COUNT };
#define BD_FRESH_WORDS "none", "camera", "all"

// What a frame's error is measured against.
enum bd_against {
    BD_AGAINST_FULL,  // the whole rendering equation
    BD_AGAINST_MODEL, // the technique's own declared model: what no sample, but a design leaves
                      // out, is no error
    BD_AGAINST_COUNT,
};
#define BD_AGAINST_WORDS "full", "model"

// NULL for a number out of range.
static inline const char *bd_against_name(enum bd_against against)
{
    static const char *const words[BD_AGAINST_COUNT] = {BD_AGAINST_WORDS};
    return against < BD_AGAINST_COUNT ? words[against] : NULL;
}

#endif
