// A frame's report: what ran, what it cost, what was reused, what was left out and why.
// Plain data of fixed size, filled on the render thread, turned into protobuf or JSON by net/.

#ifndef BD_FRAME_REPORT_H
#define BD_FRAME_REPORT_H

#include <stdbool.h>
#include <stdint.h>

#include "technique/params.h"

#define BD_REPORT_PASS_MAX    64
#define BD_REPORT_OMITTED_MAX 32
#define BD_REPORT_FLAG_MAX    32

enum bd_pass_state { BD_PASS_RAN, BD_PASS_REUSED, BD_PASS_PLANNED };
enum bd_stopped { BD_STOPPED_COMPLETE, BD_STOPPED_DEADLINE, BD_STOPPED_CANCELLED };

// "ran", "reused", "planned"; "complete", "deadline", "cancelled".
const char *bd_pass_state_name(enum bd_pass_state state);
const char *bd_stopped_name(enum bd_stopped stopped);

struct bd_report {
    char scene[72]; // "sha256:HEX" of the snapshot
    uint32_t width_px, height_px;
    char camera[64];
    char technique[32];
    struct bd_param_list params; // every parameter that the technique reads, as used
    uint64_t seed;
    uint32_t aa;
    struct {
        char name[128];
        char device_class[64]; // same class, same bytes: driver family and version
        bool software;
    } device;
    struct {
        double total, load, compile, gpu, readback; // ms; encode is added by who encodes
    } time_ms;
    uint32_t pass_count;
    struct {
        char name[24]; // of the one fixed list in protocol/README.md
        double ms;
        enum bd_pass_state state;
    } passes[BD_REPORT_PASS_MAX];
    uint32_t omitted_count;
    struct {
        char pass[24];
        char reason[104];
    } omitted[BD_REPORT_OMITTED_MAX];
    struct {
        uint64_t lights, vpls, fragments, triangles;
    } counts;
    double memory_gpu_mib, memory_gpu_peak_mib;
    uint32_t flag_count;
    char flags[BD_REPORT_FLAG_MAX][96];
    uint64_t nonfinite_pixels;
    enum bd_stopped stopped;
};

#endif
