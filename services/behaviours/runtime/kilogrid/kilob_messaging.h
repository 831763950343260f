/* A queue of three messages to send, for robots on a Kilogrid. */
#ifndef KILOTWIN_KILOB_MESSAGING_H
#define KILOTWIN_KILOB_MESSAGING_H

#include <message.h>

#ifdef __cplusplus
extern "C" {
#endif
/* Takes over kilo_message_tx and kilo_message_tx_success at its first call; empties the queue. */
void kilob_messaging_init();
/* Queues a message and returns it to be filled; the checksum is added when it is sent. NULL: the queue is full. */
IR_message_t* kilob_message_send();
#ifdef __cplusplus
}
#endif
#endif
