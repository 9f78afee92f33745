#include "frame/report.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

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

void bd_report_flag(struct bd_report *report, const char *format, ...)
{
    if (report->flag_count == BD_REPORT_FLAG_MAX) return;
    va_list args;
    va_start(args, format);
    vsnprintf(report->flags[report->flag_count++], sizeof report->flags[0], format, args);
    va_end(args);
}

void bd_report_reword(struct bd_report *report, const char *name, const char *format, ...)
{
    size_t length = strlen(name);
    for (uint32_t i = 0; i < report->flag_count; i++) {
        char *flag = report->flags[i];
        if (strncmp(flag, name, length) != 0 || (flag[length] && flag[length] != ':')) continue;
        va_list args;
        va_start(args, format);
        vsnprintf(flag, sizeof report->flags[0], format, args);
        va_end(args);
        return;
    }
}

void bd_report_add_time(struct bd_report_time *sum, const struct bd_report_time *time)
{
    sum->total += time->total;
    sum->load += time->load;
    sum->compile += time->compile;
    sum->gpu += time->gpu;
    sum->check += time->check;
    sum->readback += time->readback;
}

void bd_report_refused_rays(struct bd_report *report, uint64_t count)
{
    if (count)
        bd_report_flag(report, "rays_refused: %llu out of range, taken to meet nothing",
                       (unsigned long long)count);
}

bool bd_report_inspect_row(struct bd_report *report, const struct bd_image *beauty, uint32_t row)
{
    bool is_lit = false;
    for (size_t x = 0; x < beauty->width_px; x++) {
        const float *p = beauty->pixels + 4 * ((size_t)row * beauty->width_px + x);
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) report->nonfinite_pixels++;
        if (p[0] != 0 || p[1] != 0 || p[2] != 0) is_lit = true;
    }
    return is_lit;
}

void bd_report_conclude(struct bd_report *report, bool is_lit)
{
    if (!is_lit) bd_report_flag(report, "blank_frame");
    if (report->nonfinite_pixels > 0) bd_report_flag(report, "nonfinite_pixels");
}

struct bd_doubt_sums bd_doubt_sums_of(float exposure_stops)
{
    return (struct bd_doubt_sums){.white = exp2(-(double)exposure_stops)};
}

void bd_doubt_sums_add(struct bd_doubt_sums *sums, double light, double square)
{
    if (!isfinite(light) || !isfinite(square)) return;
    const double doubt = sqrt(fmax(square, 0)), room = sums->white - (light - doubt);
    const double shown = fmin(doubt, fmax(room, 0));
    sums->squares += square;
    sums->light += light;
    sums->shown_squares += shown * shown;
    sums->shown_light += fmin(light, sums->white);
}

void bd_doubt_sums_add_row(struct bd_doubt_sums *sums, const struct bd_image *beauty,
                           const struct bd_image *noise, const struct bd_image *blur, uint32_t row)
{
    for (size_t x = 0; x < beauty->width_px; x++) {
        const size_t at = (size_t)row * beauty->width_px + x;
        const float *light = beauty->pixels + 4 * at, *half = noise->pixels + 3 * at;
        for (int c = 0; c < 3; c++)
            bd_doubt_sums_add(sums, light[c], (double)half[c] * half[c] + blur->pixels[at]);
    }
}

// Nothing is a part of black.
void bd_report_own_estimate(struct bd_report *report, const struct bd_doubt_sums *sums)
{
    const double floats = 3.0 * report->width_px * report->height_px;
    report->has_own_estimate = sums->light > 0;
    if (!report->has_own_estimate) return;
    report->own_estimate = sqrt(fmax(sums->squares, 0) * floats) / sums->light;
    report->shown_estimate = sums->shown_light > 0
                                 ? sqrt(sums->shown_squares * floats) / sums->shown_light
                                 : report->own_estimate;
}

void bd_report_inspect(struct bd_report *report, const struct bd_image *beauty)
{
    bool is_lit = false;
    for (uint32_t row = 0; row < beauty->height_px; row++)
        is_lit |= bd_report_inspect_row(report, beauty, row);
    bd_report_conclude(report, is_lit);
}
