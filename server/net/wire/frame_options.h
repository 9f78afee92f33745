// The schema's FrameRequest as what the scheduler and the encoder take.
//
// Thread: any.

#ifndef BD_NET_WIRE_FRAME_OPTIONS_H
#define BD_NET_WIRE_FRAME_OPTIONS_H

#include <stdbool.h>

#include "base/err.h"
#include "frame/request.h"
#include "image/encode.h"
#include "protocol/bounced.pb-c.h"

struct bd_frame_options {
    struct bd_frame_request frame;
    bool wants_image; // false: the report alone
    struct bd_encode_request encode;
    enum bd_layer shown; // by PNG and JPEG
};

// `request` NULL: every default. Whatever needs no scene to be refused is refused here, by name.
BD_MUST_CHECK
enum bd_err bd_frame_options_read(const Bounced__FrameRequest *request,
                                  struct bd_frame_options *out, struct bd_err_detail *detail);

// A viewpoint's numbers; whether they make one is checked with the frame.
BD_MUST_CHECK
enum bd_err bd_pose_read(const Bounced__CameraPose *pose, struct bd_pose *out,
                         struct bd_err_detail *detail);

#endif
