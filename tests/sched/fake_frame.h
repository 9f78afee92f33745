// A device and frames without a GPU, for a test of the scheduler alone: the linker puts them in the
// place of gpu/'s and frame/'s (-Wl,--wrap, see meson.build), so that sched/ is what is shipped and
// no driver's threads stand beside it.
//
// A frame is a few slices of sleep, each of which heeds `should_stop`. Its pixels follow from its
// seed. Now and then the device is lost in the middle of one, or spoilt behind it. Every call
// asserts that it comes from the thread that made the device, and that no two frames run at once.

#ifndef BD_TESTS_SCHED_FAKE_FRAME_H
#define BD_TESTS_SCHED_FAKE_FRAME_H

#include "frame/request.h"

// The value of every channel of a layer.
float fake_frame_value(uint64_t seed, enum bd_layer layer);

// Since the start of the process. Any thread.
struct fake_frame_counts {
    uint32_t begun, stopped, devices_lost;
};
struct fake_frame_counts fake_frame_counts(void);

#endif
