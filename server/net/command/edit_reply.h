// EditReply, from a batch that is staged, from what is shown, or from the journal.

#ifndef BD_NET_COMMAND_EDIT_REPLY_H
#define BD_NET_COMMAND_EDIT_REPLY_H

#include "net/command/edit_work.h"

// Also keeps it with the batch, as what is said again to the same client_edit_id.
struct bd_answer bd_edit_reply_of_batch(struct bd_batch *batch, const struct bd_edit_work *work);
struct bd_answer bd_edit_reply_of_entry(const struct bd_store_entry *entry,
                                        const struct bd_edit_work *work);
// Of a trial: `after` is nobody's revision.
struct bd_answer bd_edit_reply_of_trial(const struct bd_scene *after,
                                        const struct bd_edit_work *work);
// What was kept; `repeated_id` set. Pool or loop.
struct bd_answer bd_edit_reply_again(const void *bytes, size_t size);

#endif
