// What a frame can be asked to be: a row for each option, by which it is set, checked, listed and
// explained, whoever asks. A row's type is that of its field of the schema's FrameRequest; that it
// is one of several words, or a number within a range, is said here alone.
//
// Thread: any. What a request holds is malloc'ed, as if it had been unpacked.

#ifndef BD_PROTOCOL_FRAME_OPTIONS_H
#define BD_PROTOCOL_FRAME_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "protocol/bounced.pb-c.h"

struct bd_frame_option {
    const char *name;         // FrameRequest's field; in queries, in Python; --with-dashes
    const char *alias;        // an earlier name, still taken; NULL: none
    const char *form;         // of its value, as text; NULL: a flag
    const char *const *words; // its value is one of these, a NULL behind them; or NULL
    double least, most;       // of numbers; both 0: what the field's type can say
    bool or_none;             // 0 is taken, too: as if it were not set
    bool or_number;           // beside its words
    bool of_one;              // of frames that are asked for alone: not of views
    bool of_now;              // depends on the moment: not kept for a later request
    uint32_t count;           // of numbers, with `between` between them
    char between;
    const char *standard; // what holds where it is not set, for a reader
    const char *help;     // one sentence or two
};

extern const struct bd_frame_option bd_frame_options[];
extern const uint32_t bd_frame_option_count;

// By name or alias, '-' for '_'. NULL, and an error with the name that is nearest: there is none.
const struct bd_frame_option *bd_frame_option_named(const char *name, struct bd_err_detail *detail);
// True: on a command line it has no value.
bool bd_frame_option_is_flag(const struct bd_frame_option *option);
// Of its field: "switch", "whole", "number", "text" or "message"; and whether it has many of them.
const char *bd_frame_option_type(const struct bd_frame_option *option, bool *has_many);

// Sets a field from text; `parameters` and `layers` grow. Where the form has ":full" and ":model",
// these set `against`. BD_ERR_USAGE: names the option and what it takes.
BD_MUST_CHECK
enum bd_err bd_frame_option_set(const struct bd_frame_option *option, const char *text,
                                Bounced__FrameRequest *request, struct bd_err_detail *detail);

// Whether a field says anything: not an empty list, 0 or false.
bool bd_frame_option_is_set(const struct bd_frame_option *option,
                            const Bounced__FrameRequest *request);
// Nothing that is set is of_now: the same request gets the same answer at any time.
bool bd_frame_options_are_lasting(const Bounced__FrameRequest *request);
// Of all that is set: words and ranges. BD_ERR_USAGE as above.
BD_MUST_CHECK
enum bd_err bd_frame_options_check(const Bounced__FrameRequest *request,
                                   struct bd_err_detail *detail);

// The number of a row's word, in whatever case; -1: it is none of them.
int bd_frame_option_word(const struct bd_frame_option *option, const char *text);

// What an option takes: "a whole number from 1 to 4096", "neutral, agx or linear". Returns `out`.
#define BD_FRAME_OPTION_TAKES_BYTES 160
const char *bd_frame_option_takes(const struct bd_frame_option *option,
                                  char out[BD_FRAME_OPTION_TAKES_BYTES]);

#endif
