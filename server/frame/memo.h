// Memo: outputs of passes by the hash of everything that they were made from.
//
// Same key, same output: the pass need not run. Outputs are destroyed least recently used first,
// when the memo is over its budget or has some thousands of them, or the device is short of memory;
// never while a frame that has not ended uses them.
//
// A frame may begin while another is set aside, and ends before that one goes on. What the one
// forgets the other may still use: it is found no more, and destroyed when its last user ends.
//
// Thread: render thread.

#ifndef BD_FRAME_MEMO_H
#define BD_FRAME_MEMO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct bd_memo;

// `owner` is what bd_memo_create was given: the device or the uploader that destroy needs.
typedef void (*bd_memo_destroy_fn)(void *owner, void *output);

struct bd_memo *bd_memo_create(void *owner, uint64_t budget_bytes);
void bd_memo_destroy(struct bd_memo **memo);
// What the last frame used stays beyond the budget, up to so many bytes in all; 0, as it begins:
// nothing does. Views of a scene that is larger than the budget would make everything anew.
void bd_memo_keep_last_frame(struct bd_memo *memo, uint64_t bytes_max);

// Frames that may be under way at once.
#define BD_MEMO_FRAMES_MAX 8

// Starts a frame: everything that it finds or stores is safe until it ends.
void bd_memo_begin_frame(struct bd_memo *memo);
// Ends the frame that was begun last.
void bd_memo_end_frame(struct bd_memo *memo);

// NULL if there is no such output.
void *bd_memo_find(struct bd_memo *memo, uint64_t key);
// The same, and the caller's from then on: for what is changed in place. Nobody else finds it until
// it is stored again.
void *bd_memo_take(struct bd_memo *memo, uint64_t key);
// The output used last of those with this `destroy` that `fits`; NULL if there is none. The current
// frame uses it from then on; *key is its key. So found it grows no younger.
void *bd_memo_find_fitting(struct bd_memo *memo, bd_memo_destroy_fn destroy,
                           bool (*fits)(const void *output, void *user), void *user, uint64_t *key);
// Takes ownership of `output`. What the key had before, made by a frame in between, is forgotten.
void bd_memo_store(struct bd_memo *memo, uint64_t key, void *output, uint64_t bytes,
                   bd_memo_destroy_fn destroy);
// The output is made of parts of another, which counts their bytes: from now on whoever uses the
// one uses the other too, or what that one is made of. So it is there as long as any of them.
void bd_memo_rest_on(struct bd_memo *memo, uint64_t key, uint64_t other);
// Forgets one output, if it is there: for what will not be asked for again.
void bd_memo_forget(struct bd_memo *memo, uint64_t key);
// The same, unless the current frame made it.
void bd_memo_forget_older(struct bd_memo *memo, uint64_t key);
// Destroys everything that no frame under way uses; returns the bytes set free.
uint64_t bd_memo_evict_unused(struct bd_memo *memo);

// Keys: begin with the pass's name, then add what it reads. Add no struct with padding.
uint64_t bd_key_begin(const char *pass);
uint64_t bd_key_bytes(uint64_t key, const void *bytes, size_t size_bytes);
uint64_t bd_key_number(uint64_t key, uint64_t value);

#endif
