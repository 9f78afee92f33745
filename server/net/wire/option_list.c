#include "net/wire/option_list.h"

#include "protocol/frame_options.h"

static char *text_or_none(const char *text)
{
    return text ? bd_answer_text(text) : NULL;
}

static Bounced__FrameOption *message_of(const struct bd_frame_option *option)
{
    char takes[BD_FRAME_OPTION_TAKES_BYTES];
    Bounced__FrameOption *out = bd_answer_zeroed(1, sizeof *out);
    bounced__frame_option__init(out);
    out->name = bd_answer_text(option->name);
    out->alias = text_or_none(option->alias);
    out->form = text_or_none(option->form);
    out->takes = bd_answer_text(bd_frame_option_takes(option, takes));
    out->standard = text_or_none(option->standard);
    out->help = bd_answer_text(option->help);
    size_t words = 0;
    while (option->words && option->words[words]) words++;
    out->words = bd_answer_zeroed(words + 1, sizeof *out->words);
    for (; out->n_words < words; out->n_words++)
        out->words[out->n_words] = bd_answer_text(option->words[out->n_words]);
    if (!(option->least < option->most)) return out;
    BD_SET(out, minimum, option->least);
    BD_SET(out, maximum, option->most);
    return out;
}

struct bd_answer bd_answer_options(void)
{
    Bounced__OptionsReply *reply = bd_answer_zeroed(1, sizeof *reply);
    bounced__options_reply__init(reply);
    reply->options = bd_answer_zeroed(bd_frame_option_count, sizeof *reply->options);
    for (; reply->n_options < bd_frame_option_count; reply->n_options++)
        reply->options[reply->n_options] = message_of(&bd_frame_options[reply->n_options]);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_OPTIONS_REPLY, reply);
}
