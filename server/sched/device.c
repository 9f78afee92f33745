// The render thread's device: opened, given up when it is lost or spoilt, opened again.

#include "sched/sched_parts.h"

#include <stdio.h>
#include <unistd.h>

#include "base/log.h"
#include "frame/memo.h"

#define GPU_MEMORY_UNKNOWN_MIB 2048
// Share of the memory limit that may hold outputs for frames to come; and no more than so much of a
// software device's, which is the host's own memory and shows as the daemon's.
#define MEMO_SHARE        0.6
#define MEMO_SOFTWARE_MIB 512
// Of the machine's memory, what the last frame was made of may hold until the next: ten million
// triangles and what rays ask of them are 1.6 GB.
#define MEMO_LAST_FRAME_SHARE 0.125

static uint64_t memory_limit_bytes(uint32_t limit_mib, const struct bd_gpu_caps *caps)
{
    if (limit_mib) return (uint64_t)limit_mib << 20;
    if (caps->memory_bytes) return caps->memory_bytes / 4 * 3;
    return (uint64_t)GPU_MEMORY_UNKNOWN_MIB << 20;
}

static uint64_t memo_budget_bytes(uint64_t limit_bytes, bool software)
{
    uint64_t share = (uint64_t)((double)limit_bytes * MEMO_SHARE);
    const uint64_t software_max = (uint64_t)MEMO_SOFTWARE_MIB << 20;
    return software && share > software_max ? software_max : share;
}

static uint64_t last_frame_bytes(bool software)
{
    const double bytes = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGE_SIZE);
    return software && bytes > 0 ? (uint64_t)(bytes * MEMO_LAST_FRAME_SHARE) : 0;
}

enum bd_err bd_sched_open_device(struct bd_sched *sched, uint32_t lose_after,
                                 struct bd_err_detail *detail)
{
    const struct bd_gpu_options options = {
        .device = sched->device,
        .cache_directory = sched->cache_directory[0] ? sched->cache_directory : NULL,
        .disk_reserve_bytes = sched->disk_reserve_bytes,
        .quick_code = sched->options.quick_code,
        .lose_after_waits = lose_after,
    };
    enum bd_err err = bd_gpu_create(&options, &sched->gpu, detail);
    if (err) return err;
    const struct bd_gpu_caps *caps = bd_gpu_caps(sched->gpu);
    uint64_t limit = memory_limit_bytes(sched->options.gpu_memory_mib, caps);
    bd_gpu_set_memory_limit(sched->gpu, limit);
    bd_renderer_init(&sched->renderer, sched->gpu, memo_budget_bytes(limit, caps->software));
    bd_memo_keep_last_frame(sched->renderer.memo, last_frame_bytes(caps->software));
    pthread_mutex_lock(&sched->lock);
    snprintf(sched->stats.device_name, sizeof sched->stats.device_name, "%s", caps->name);
    snprintf(sched->stats.device_class, sizeof sched->stats.device_class, "%s", caps->device_class);
    sched->stats.software = caps->software;
    sched->stats.device_ok = true;
    sched->stats.gpu_memory_limit_mib = (double)(limit >> 20);
    pthread_mutex_unlock(&sched->lock);
    return BD_ERR_OK;
}

void bd_sched_close_device(struct bd_sched *sched)
{
    if (!sched->gpu) return;
    bd_renderer_finish(&sched->renderer);
    bd_gpu_destroy(&sched->gpu);
}

bool bd_sched_device_is_spoilt(const struct bd_sched *sched)
{
    return sched->gpu && bd_gpu_status(sched->gpu) != BD_ERR_OK;
}

void bd_sched_drop_device(struct bd_sched *sched)
{
    enum bd_err why = bd_gpu_status(sched->gpu);
    bd_log(BD_LOG_WARN, "sched", "the device has failed (%s); building it anew from the snapshots",
           bd_err_name(why));
    pthread_mutex_lock(&sched->lock);
    sched->stats.device_ok = false;
    sched->stats.device_losses += why == BD_ERR_DEVICE_LOST;
    pthread_mutex_unlock(&sched->lock);
    bd_sched_close_device(sched);
}

void bd_sched_mend_device(struct bd_sched *sched)
{
    struct bd_err_detail detail = {0};
    if (!sched->gpu && bd_sched_open_device(sched, 0, &detail))
        bd_log(BD_LOG_ERROR, "sched", "no device any more: %s", detail.message);
}
