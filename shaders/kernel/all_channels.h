// Strength of light of three channels, as one number.

#ifndef BD_KERNEL_ALL_CHANNELS_H
#define BD_KERNEL_ALL_CHANNELS_H

#include "kernel/math.h"

// Strength of light where one number must do. Not luminance: a picture with its channels exchanged
// must be the same picture with its channels exchanged, to the last bit; so the smaller two are
// added first, whichever they are.
KERNEL float all_channels(f3 rgb)
{
    float smaller = f_min(rgb.x, rgb.y), larger = f_max(rgb.x, rgb.y);
    return (f_min(smaller, rgb.z) + f_max(smaller, f_min(larger, rgb.z))) + f_max(larger, rgb.z);
}

// Of the strongest alone: what light of any colour is at most.
KERNEL float strongest_channel(f3 rgb) { return f_max(rgb.x, f_max(rgb.y, rgb.z)); }

#endif
