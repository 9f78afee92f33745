#include "base/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/text.h"

static enum bd_log_level least_level = BD_LOG_INFO;
static bool json_lines;

static const char *const level_names[] = {"debug", "info", "warning", "error"};

void bd_log_setup(enum bd_log_level least, bool json)
{
    least_level = least;
    json_lines = json;
}

static void escape_json(char *out, size_t out_size, const char *text)
{
    size_t used = 0;
    for (; *text && used + 7 < out_size; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\') {
            out[used++] = '\\';
            out[used++] = (char)c;
        } else if (c < 0x20) {
            used += (size_t)snprintf(out + used, out_size - used, "\\u%04x", c);
        } else {
            out[used++] = (char)c;
        }
    }
    out[used] = 0;
}

static void format_time_utc(char out[32])
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    struct tm parts;
    gmtime_r(&now.tv_sec, &parts);
    size_t used = strftime(out, 32, "%Y-%m-%dT%H:%M:%S", &parts);
    snprintf(out + used, 32 - used, ".%03ldZ", now.tv_nsec / 1000000);
}

void bd_log(enum bd_log_level level, const char *area, const char *format, ...)
{
    if (level < least_level) return;
    char message[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    bd_text_make_plain(
        message); // names and messages of others make no line, and command no terminal

    char line[2600];
    int length;
    if (json_lines) {
        char when[32];
        char escaped[2400];
        format_time_utc(when);
        escape_json(escaped, sizeof escaped, message);
        length = snprintf(line, sizeof line,
                          "{\"time\":\"%s\",\"level\":\"%s\",\"area\":\"%s\",\"message\":\"%s\"}\n",
                          when, level_names[level], area, escaped);
    } else {
        length =
            snprintf(line, sizeof line, "bounced: %s: %s: %s\n", level_names[level], area, message);
    }
    // One write a line keeps the lines of several threads whole.
    if (write(STDERR_FILENO, line, (size_t)length) < 0) return;
}
