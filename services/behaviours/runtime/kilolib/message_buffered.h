/* Message buffers between the callbacks and loop(). Include this header in only one source file. */
#ifndef KILOTWIN_MESSAGE_BUFFERED_H
#define KILOTWIN_MESSAGE_BUFFERED_H

#include <stddef.h>

#include "kilolib.h"
#include "ringbuffer.h"

#ifndef RXBUFFER_SIZE
#define RXBUFFER_SIZE 16
#endif
#ifndef TXBUFFER_SIZE
#define TXBUFFER_SIZE 4
#endif

typedef struct {
  message_t msg;
  distance_measurement_t dist;
} received_message_t;

RB_create(rxbuffer, received_message_t, RXBUFFER_SIZE);
RB_create(txbuffer, message_t, TXBUFFER_SIZE);

uint8_t rxbuffer_size(void) { return (uint8_t)RB_size(rxbuffer); }

void rxbuffer_push(message_t* msg, distance_measurement_t* dist) {
  RB_back(rxbuffer).msg = *msg;
  RB_back(rxbuffer).dist = *dist;
  RB_pushback(rxbuffer);
}

/* The oldest received message and its strength, or NULL. */
message_t* rxbuffer_peek(distance_measurement_t* dist) {
  if (RB_empty(rxbuffer)) return NULL;
  *dist = RB_front(rxbuffer).dist;
  return &RB_front(rxbuffer).msg;
}

void rxbuffer_pop(void) {
  if (!RB_empty(rxbuffer)) RB_popfront(rxbuffer);
}

uint8_t txbuffer_size(void) { return (uint8_t)RB_size(txbuffer); }

/* Whether the oldest message is the one that kilo_message_tx gave last. Between that and kilo_message_tx_success loop() may push
 * into the full ring, which drops this message. The next one must then stay. */
static uint8_t txbuffer_is_sending;

void txbuffer_push(message_t* msg) {
  if (RB_full(txbuffer)) txbuffer_is_sending = 0;
  RB_back(txbuffer) = *msg;
  RB_pushback(txbuffer);
}

/* The oldest message that waits to be sent, or NULL. It is valid until the next push or pop. */
message_t* txbuffer_peek(void) { return RB_empty(txbuffer) ? NULL : &RB_front(txbuffer); }

void txbuffer_pop(void) {
  if (!RB_empty(txbuffer)) RB_popfront(txbuffer);
  txbuffer_is_sending = 0;
}

static message_t* txbuffer_give(void) {
  txbuffer_is_sending = 1;
  return txbuffer_peek();
}

static void txbuffer_sent(void) {
  if (txbuffer_is_sending) txbuffer_pop();
}

static inline void kilo_message_buffered(void) {
  RB_init(rxbuffer);
  RB_init(txbuffer);
  kilo_message_rx = rxbuffer_push;
  kilo_message_tx = txbuffer_give;
  kilo_message_tx_success = txbuffer_sent;
}

#endif
