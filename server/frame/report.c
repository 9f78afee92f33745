#include "frame/report.h"

const char *bd_pass_state_name(enum bd_pass_state state)
{
    switch (state) {
    case BD_PASS_RAN: return "ran";
    case BD_PASS_REUSED: return "reused";
    case BD_PASS_PLANNED: return "planned";
    }
    return "planned";
}

const char *bd_stopped_name(enum bd_stopped stopped)
{
    switch (stopped) {
    case BD_STOPPED_COMPLETE: return "complete";
    case BD_STOPPED_DEADLINE: return "deadline";
    case BD_STOPPED_CANCELLED: return "cancelled";
    case BD_STOPPED_TARGET: return "target";
    case BD_STOPPED_FLOOR: return "floor";
    }
    return "complete";
}
