// A frame's report: what ran, what it cost, what was reused, what was left out and why.
// Plain data of fixed size, filled on the render thread, turned into protobuf or JSON by net/.

#ifndef BD_FRAME_REPORT_H
#define BD_FRAME_REPORT_H

#include <stdbool.h>
#include <stdint.h>

#include "image/image.h"
#include "technique/params.h"

#define BD_REPORT_PASS_MAX    64
#define BD_REPORT_OMITTED_MAX 32
#define BD_REPORT_FLAG_MAX    32
#define BD_REPORT_ERROR_MAX   4
#define BD_REPORT_FLAG_BYTES  192

// The flag of frames whose indirect light goes through walls.
#define BD_FLAG_UNOCCLUDED "no_indirect_visibility"

enum bd_pass_state { BD_PASS_RAN, BD_PASS_REUSED, BD_PASS_PLANNED };
enum bd_stopped {
    BD_STOPPED_COMPLETE,
    BD_STOPPED_DEADLINE,
    BD_STOPPED_CANCELLED,
    BD_STOPPED_TARGET, // the error asked for is reached
    BD_STOPPED_FLOOR,  // and cannot be: refining no longer lowers it
};

// "ran", "reused", "planned"; "complete", "deadline", "cancelled", "target", "floor".
const char *bd_pass_state_name(enum bd_pass_state state);
const char *bd_stopped_name(enum bd_stopped stopped);

struct bd_report_time {
    double total, load, compile, gpu, check, readback; // ms; encode is added by who encodes
};

// Adds up `time`, of one frame of several.
void bd_report_add_time(struct bd_report_time *sum, const struct bd_report_time *time);

struct bd_report {
    char scene[72]; // "sha256:HEX" of the snapshot
    uint32_t width_px, height_px;
    char camera[64];
    char technique[32];
    struct bd_param_list params; // every parameter that the technique reads, as used
    uint64_t seed;
    uint32_t aa;
    char filter[8];     // "point", "box"
    uint32_t region[4]; // x, y, width, height of what was traced; all 0: the whole picture
    struct {
        char name[128];
        char device_class[64]; // same class, same bytes: driver family and version
        bool software;
    } device;
    char executor[8]; // "device", "native": who does the arithmetic; "" where there is no choice
    struct bd_report_time time_ms;
    uint32_t pass_count;
    struct {
        char name[24]; // of the one fixed list (protocol/bounced.proto, ReportPass)
        double ms;
        enum bd_pass_state state;
        uint32_t sub_frames;    // for which it ran; 0 of what is made for a light, or not at all
        bool of_each_sub_frame; // also where sub-frames share their light
    } passes[BD_REPORT_PASS_MAX];
    uint32_t omitted_count;
    struct {
        char pass[24];
        char reason[104];
    } omitted[BD_REPORT_OMITTED_MAX];
    struct {
        uint64_t lights, vpls, fragments, triangles;
        uint64_t subsplats, subsplats_tested, subsplats_split; // struct bd_subsplat_counts
        uint64_t screen_parts; // looked at by pixels, over iterations (pass/residual.h)
        uint64_t rays;
        double mrays_per_s; // of them; 0 without
    } counts;
    double memory_gpu_mib, memory_gpu_peak_mib;
    double memory_reference_mib; // prepared for tracing, of all scenes together
    uint32_t flag_count;
    char flags[BD_REPORT_FLAG_MAX][BD_REPORT_FLAG_BYTES];
    bool unoccluded; // indirect light that nothing hides (`no_indirect_visibility`)
    uint64_t nonfinite_pixels;
    // Relative RMSE of beauty by its layers noise and blur, over all channels; and of what a
    // picture shows of it, whose white is that of exposure auto (image/tonemap.h).
    bool has_own_estimate;
    double own_estimate, shown_estimate;
    uint32_t error_count; // estimates of how wrong the frame is, with 95 % intervals
    struct {
        char metric[16];         // "rel_rmse"; "rmse", in cd/m^2, where the reference is black
        char against[8];         // "full" or "model"; what was asked for comes first
        double value, low, high; // high = INFINITY: a few samples carry the error
        uint64_t samples;        // pixels that were traced
    } errors[BD_REPORT_ERROR_MAX];
    enum bd_stopped stopped;
};

// Appends a flag; drops it silently once the list is full.
void bd_report_flag(struct bd_report *report, const char *format, ...) BD_PRINTF(2, 3);

// Says something else of what a flag names, its first word; nothing where it is not there.
void bd_report_reword(struct bd_report *report, const char *name, const char *format, ...)
    BD_PRINTF(3, 4);

// Flags rays of the reference that could not be traced, if there are any.
void bd_report_refused_rays(struct bd_report *report, uint64_t count);

// Counts pixels that are not finite, and flags those and a blank picture.
void bd_report_inspect(struct bd_report *report, const struct bd_image *beauty);
// The same row by row: counts, and says whether anything is lit; then the flags.
bool bd_report_inspect_row(struct bd_report *report, const struct bd_image *beauty, uint32_t row);
void bd_report_conclude(struct bd_report *report, bool is_lit);

// A frame's own estimate of its error, row by row, of layers beauty, noise and blur; what is not
// finite does not count. What is shown is cut at white, and so is its doubt.
struct bd_doubt_sums {
    double white; // of exposure auto
    double squares, light, shown_squares, shown_light;
};
struct bd_doubt_sums bd_doubt_sums_of(float exposure_stops);
void bd_doubt_sums_add(struct bd_doubt_sums *sums, double light, double square);
void bd_doubt_sums_add_row(struct bd_doubt_sums *sums, const struct bd_image *beauty,
                           const struct bd_image *noise, const struct bd_image *blur, uint32_t row);
void bd_report_own_estimate(struct bd_report *report, const struct bd_doubt_sums *sums);

#endif
