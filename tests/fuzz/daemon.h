// The daemon in this process, with real sockets to it, and everything else as the input says: what
// runs on the pool, frames, time (pool.h, frames.h, machine.h).
//
// It begins with the two scenes of golden.h, with small limits, so that they are met, and with
// tokens if it is told to.

#ifndef BD_TESTS_FUZZ_DAEMON_H
#define BD_TESTS_FUZZ_DAEMON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define DAEMON_PEERS 4
// In the token file, by role.
#define DAEMON_TOKEN_READ  "read-read-read-read"
#define DAEMON_TOKEN_EDIT  "edit-edit-edit-edit"
#define DAEMON_TOKEN_ADMIN "admin-admin-admin"

// One daemon at a time.
void daemon_begin(bool has_tokens);
// Ends what is under way, as drains and disconnects do, and looks that nothing is left.
void daemon_end(void);

enum peer_kind { PEER_HTTP, PEER_FRAMED };

// A new connection takes the place of peer `at`, which is reset if it was one. Without a listener
// there is none.
void daemon_connect(uint32_t at, enum peer_kind kind);
bool daemon_is_connected(uint32_t at);
// Of the connection, as it was made.
enum peer_kind daemon_peer_kind(uint32_t at);
void daemon_send(uint32_t at, const void *bytes, size_t size);
// The end of what the peer sends; or of the connection.
void daemon_half_close(uint32_t at);
void daemon_reset(uint32_t at);

// The loop goes on until nothing more happens by itself. What peers are sent is read, and looked
// at: HTTP answers begin as such, framed ones are whole envelopes.
void daemon_pump(void);

// What happens beside the loop, then daemon_pump.
void daemon_run_one(void);
void daemon_return_one(void);
void daemon_end_frame(void);
void daemon_settle(void); // all of it, until nothing is under way
void daemon_pass_ms(uint64_t ms);
void daemon_drain(void);

#endif
