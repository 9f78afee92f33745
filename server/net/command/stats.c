#include "net/command/stats.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/loop/conn.h"

// Of slow and stalled peers: what credits and room let through.
static uint64_t sum_unsent_bytes(const struct bd_loop *loop)
{
    uint64_t sum = 0;
    for (const struct bd_conn *conn = loop->conns; conn; conn = conn->next)
        sum += bd_conn_unsent_bytes(conn);
    return sum;
}

struct bd_answer bd_answer_stats(const struct bd_loop *loop)
{
    struct bd_sched_stats sched;
    bd_sched_stats(loop->serving->sched, &sched);
    Bounced__StatsReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__stats_reply__init(reply);
    BD_SET(reply, uptime_seconds, bd_ms_since(loop->counts.start_ns) * 1e-3);
    BD_SET(reply, jobs_done, sched.jobs_done);
    BD_SET(reply, jobs_failed, sched.jobs_failed);
    BD_SET(reply, jobs_cancelled, sched.jobs_cancelled);
    BD_SET(reply, jobs_waiting, sched.jobs_waiting);
    BD_SET(reply, jobs_running, sched.jobs_running);
    BD_SET(reply, device_losses, sched.device_losses);
    BD_SET(reply, gpu_memory_mib, sched.gpu_memory_mib);
    BD_SET(reply, gpu_memory_peak_mib, sched.gpu_memory_peak_mib);
    BD_SET(reply, gpu_memory_limit_mib, sched.gpu_memory_limit_mib);
    BD_SET(reply, render_seconds, sched.render_seconds);
    BD_SET(reply, scenes, bd_store_count(loop->serving->store));
    BD_SET(reply, connections, loop->conn_count);
    BD_SET(reply, requests, loop->counts.requests);
    BD_SET(reply, requests_refused, loop->counts.requests_refused);
    BD_SET(reply, reference_memory_mib, sched.reference_memory_mib);
    BD_SET(reply, unsent_bytes, sum_unsent_bytes(loop));
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_STATS_REPLY, reply);
}

static void write_counter(FILE *out, const char *name, const char *help, double value)
{
    fprintf(out, "# HELP bounced_%s %s\n# TYPE bounced_%s counter\nbounced_%s %.17g\n", name, help,
            name, name, value);
}

static void write_gauge(FILE *out, const char *name, const char *help, double value)
{
    fprintf(out, "# HELP bounced_%s %s\n# TYPE bounced_%s gauge\nbounced_%s %.17g\n", name, help,
            name, name, value);
}

static void write_stalls(FILE *out, const char *name, const char *help,
                         const struct bd_stalls *stalls)
{
    uint64_t count = 0;
    fprintf(out, "# HELP bounced_%s_seconds %s\n# TYPE bounced_%s_seconds histogram\n", name, help,
            name);
    for (int i = 0; i < BD_STALLS_BUCKET_COUNT; i++) {
        count += stalls->counts[i];
        fprintf(out, "bounced_%s_seconds_bucket{le=\"%g\"} %llu\n", name, bd_stalls_bucket_s[i],
                (unsigned long long)count);
    }
    count += stalls->counts[BD_STALLS_BUCKET_COUNT];
    fprintf(out,
            "bounced_%s_seconds_bucket{le=\"+Inf\"} %llu\nbounced_%s_seconds_sum %.9g\n"
            "bounced_%s_seconds_count %llu\n",
            name, (unsigned long long)count, name, stalls->total_s, name,
            (unsigned long long)count);
}

static void write_all_stalls(FILE *out, const struct bd_loop *loop,
                             const struct bd_sched_stats *sched)
{
    uint64_t now_ns = bd_clock_ns();
    write_stalls(out, "loop_stall",
                 "How late a timer of 5 ms came on the loop, while anybody was connected.",
                 &loop->heart.stalls);
    write_gauge(out, "loop_stall_seconds_max", "The longest of the last one to two minutes.",
                bd_stalls_longest_s(&loop->heart.stalls, now_ns));
    write_stalls(out, "loop_work", "Processor time of the loop from each such timer to the next.",
                 &loop->heart.work);
    write_gauge(out, "loop_work_seconds_max", "The longest of the last one to two minutes.",
                bd_stalls_longest_s(&loop->heart.work, now_ns));
    write_stalls(out, "render_stall",
                 "How long the render thread worked without looking for cancels and other frames.",
                 &sched->render_stalls);
    write_gauge(out, "render_stall_seconds_max", "The longest of the last one to two minutes.",
                bd_stalls_longest_s(&sched->render_stalls, now_ns));
}

// Names come from drivers: quotes and backslashes are possible in them.
static void write_label(FILE *out, const char *text)
{
    for (; *text; text++) {
        if (*text == '"' || *text == '\\') fputc('\\', out);
        fputc(*text == '\n' ? ' ' : *text, out);
    }
}

static void write_device(FILE *out, const struct bd_sched_stats *sched)
{
    fputs("# HELP bounced_device_info The device in use.\n# TYPE bounced_device_info gauge\n"
          "bounced_device_info{name=\"",
          out);
    write_label(out, sched->device_name);
    fputs("\",class=\"", out);
    write_label(out, sched->device_class);
    fprintf(out, "\",software=\"%d\"} 1\n", sched->software);
}

static void write_passes(FILE *out, const struct bd_counts *stats)
{
    fputs("# HELP bounced_pass_seconds_total Device time by pass.\n"
          "# TYPE bounced_pass_seconds_total counter\n",
          out);
    for (uint32_t i = 0; i < stats->pass_count; i++)
        fprintf(out, "bounced_pass_seconds_total{pass=\"%s\"} %.9g\n", stats->passes[i].name,
                stats->passes[i].seconds);
    fputs("# HELP bounced_passes_total Passes by name and whether they ran.\n"
          "# TYPE bounced_passes_total counter\n",
          out);
    for (uint32_t i = 0; i < stats->pass_count; i++)
        fprintf(out,
                "bounced_passes_total{pass=\"%s\",state=\"ran\"} %llu\n"
                "bounced_passes_total{pass=\"%s\",state=\"reused\"} %llu\n",
                stats->passes[i].name, (unsigned long long)stats->passes[i].ran,
                stats->passes[i].name, (unsigned long long)stats->passes[i].reused);
}

static void write_jobs(FILE *out, const struct bd_sched_stats *sched)
{
    write_counter(out, "jobs_done_total", "Frames finished.", (double)sched->jobs_done);
    write_counter(out, "jobs_failed_total", "Frames failed.", (double)sched->jobs_failed);
    write_counter(out, "jobs_cancelled_total", "Frames cancelled.", (double)sched->jobs_cancelled);
    write_gauge(out, "jobs_waiting", "Frames waiting for the device.", sched->jobs_waiting);
    write_gauge(out, "jobs_running", "Frames on the device.", sched->jobs_running);
    write_counter(out, "render_seconds_total", "Time of finished frames.", sched->render_seconds);
    write_counter(out, "device_losses_total", "Times the device was lost.",
                  (double)sched->device_losses);
    write_gauge(out, "device_ok", "0 between a loss and the rebuilt context.", sched->device_ok);
    write_gauge(out, "gpu_memory_bytes", "GPU memory in use.", sched->gpu_memory_mib * 1048576);
    write_gauge(out, "reference_memory_bytes", "Host memory of scenes prepared for tracing.",
                sched->reference_memory_mib * 1048576);
    write_gauge(out, "gpu_memory_limit_bytes", "GPU memory that may be used.",
                sched->gpu_memory_limit_mib * 1048576);
}

char *bd_net_metrics_text(const struct bd_loop *loop)
{
    struct bd_sched_stats sched;
    bd_sched_stats(loop->serving->sched, &sched);
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    BD_ASSERT(out);
    write_gauge(out, "uptime_seconds", "Since start.", bd_ms_since(loop->counts.start_ns) * 1e-3);
    write_device(out, &sched);
    write_jobs(out, &sched);
    write_counter(out, "requests_total", "Requests, all transports.",
                  (double)loop->counts.requests);
    write_counter(out, "requests_refused_total", "Requests answered by an error.",
                  (double)loop->counts.requests_refused);
    write_counter(out, "frames_remembered_total", "Frames answered as they were sent before.",
                  (double)loop->counts.frames_remembered);
    write_counter(out, "received_bytes_total", "Bytes from clients.",
                  (double)loop->counts.bytes_in);
    write_counter(out, "sent_bytes_total", "Bytes to clients.", (double)loop->counts.bytes_out);
    write_gauge(out, "connections", "Open connections.", loop->conn_count);
    write_gauge(out, "unsent_bytes", "Bytes that wait for peers to read them.",
                (double)sum_unsent_bytes(loop));
    write_gauge(out, "scenes", "Scenes held.", bd_store_count(loop->serving->store));
    write_all_stalls(out, loop, &sched);
    write_passes(out, &loop->counts);
    int result = fclose(out);
    BD_ASSERT_CMP(result, ==, 0);
    return text;
}
